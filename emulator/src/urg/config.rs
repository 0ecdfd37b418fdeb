//! How an emulated sensor is set up, and what can be asked about it.

use super::clock::FAST_PPM;
use super::faults::Fault;
use super::model::{Interface, MODELS, Model};

/// Time a sensor takes to start, unless told otherwise.
const BOOT_US: u64 = 2_000_000;

/// What state the sensor is found in.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Start {
    /// SCIP 2.0, laser off.
    #[default]
    Idle,
    /// As after power-up of a classic URG-04LX.
    Scip11,
    /// A measurement of the last session is still running.
    Streaming,
    /// In the time-sync state.
    TimeSync,
    /// Just plugged in.
    Booting,
    /// Broken. In SCIP 2.2 everything but `VV`, `II` and `RB` is answered 0L; in SCIP 2.0 measurements are
    /// answered 50 and `BM` 01, until `RS` or a loss of power.
    Abnormal,
}

/// A state in which a model cannot be found.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum StartError {
    /// It never spoke SCIP 1.1.
    #[error("{0} speaks no SCIP 1.1; {list} does", list = speaking_scip11())]
    NoScip11(&'static str),
}

fn speaking_scip11() -> String {
    let names: Vec<_> =
        MODELS.iter().filter(|model| model.powers_up_in_scip11).map(|model| model.name).collect();
    names.join(", ")
}

impl Start {
    /// Whether a sensor of this model can be found in this state.
    ///
    /// # Errors
    /// [`StartError`].
    pub fn of(self, model: &Model) -> Result<Self, StartError> {
        match self {
            Self::Scip11 if !model.powers_up_in_scip11 => Err(StartError::NoScip11(model.name)),
            start => Ok(start),
        }
    }
}

/// How an emulated sensor is set up.
#[derive(Clone, Debug)]
pub struct Config {
    /// Which sensor.
    pub model: Model,
    /// Whether bytes take their time on the line (RS-232C), or leave at once (USB, Ethernet).
    pub paced: bool,
    /// Bit rate it is found at. Power cycles and resets bring back the model's own.
    pub baud: u32,
    /// State it is found in.
    pub start: Start,
    /// The measurement that runs in [`Start::Streaming`]; None: all steps, three characters, until `QT`.
    pub left_running: Option<String>,
    /// What the millisecond counter shows at first; 0xff_ff00 is 256 ms before its wrap.
    pub clock_start_ms: u32,
    /// Millionths by which the sensor's clock, and with it the mirror, runs fast.
    pub clock_fast_ppm: i32,
    /// Time to start up, in µs.
    pub boot_us: u64,
    /// For everything random.
    pub seed: u64,
    /// What goes wrong.
    pub faults: Vec<Fault>,
    /// Leaves out a last group that the cluster does not fill, so that n steps give floor(n / cluster) values
    /// instead of ceil: sources differ on what sensors do.
    pub drop_incomplete_group: bool,
    /// Scans whose true times are kept, the newest ones.
    pub kept_scans: usize,
}

/// Two hours at 10 Hz.
const KEPT_SCANS: usize = 65_536;

impl Config {
    /// A faultless sensor, idle.
    #[must_use]
    pub fn new(model: Model) -> Self {
        Self {
            model,
            paced: model.interface == Interface::Rs232,
            baud: model.power_up_baud,
            start: Start::Idle,
            left_running: None,
            clock_start_ms: 0,
            clock_fast_ppm: FAST_PPM,
            boot_us: BOOT_US,
            seed: 1,
            faults: Vec::new(),
            drop_incomplete_group: false,
            kept_scans: KEPT_SCANS,
        }
    }
}

/// What the sensor is doing.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum State {
    /// No power, or restarting.
    Off,
    /// Starting up.
    Booting,
    /// Speaks SCIP 1.1.
    Scip11,
    /// Waits for requests.
    Idle,
    /// Sends scans.
    Streaming,
    /// In the time-sync state.
    TimeSync,
    /// Asleep.
    Asleep,
    /// Broken.
    Abnormal,
    /// Says nothing until the power is cut.
    Wedged,
}

/// Whether bytes pass between host and sensor.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LinkState {
    /// They do.
    Up,
    /// They vanish.
    Silent,
    /// The connection is gone: end of file, device removed.
    Closed,
}

/// Truth about one scan, for tests.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ScanTruth {
    /// When step 0 passed, on the world's clock.
    pub start_us: u64,
    /// The stamp the sensor gave it.
    pub stamp_ms: u32,
    /// When its first byte was handed to the transmitter.
    pub queued_us: u64,
    /// Whether anything was damaged or held back on purpose: a fault other than a random byte fault.
    pub damaged: bool,
}

/// What has happened so far.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Counts {
    /// Scans handed to the transmitter.
    pub scans_sent: u64,
    /// Scans lost because the line was still busy, or the host had not read those before.
    pub scans_dropped: u64,
    /// Requests taken in.
    pub requests: u64,
    /// Requests answered with a refusal.
    pub refusals: u64,
    /// Faults done: bytes damaged, scans cut, events.
    pub faults: u64,
}
