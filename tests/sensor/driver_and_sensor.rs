//! A driver, an emulated sensor and the link between them, on virtual time.

use std::cell::RefCell;
use std::rc::Rc;

use embedded_io_async::{ErrorType, Read, Write};
use kehai::link::Baud;
use kehai::scan::{MAX_BEAMS, ScanTime};
use kehai::sensor::{Driver, LineSettings, SensorCounters, SensorEvent, SensorSettings, SensorState};
use kehai_emulator::link::{LinkError, LinkOptions, MemoryLink};
use kehai_emulator::simulated_time::{SimulatedClock, block_on_until};
use kehai_emulator::source::{RangeSource, Revolution, StillRoom};
use kehai_emulator::urg::faults::Fault;
use kehai_emulator::urg::model::{Interface, Model};
use kehai_emulator::urg::{Config, ScanTruth, Start, Urg};

pub const SECOND_US: u64 = 1_000_000;

/// The host's end of the link with a tap on it: it records requests, and damages the bytes read.
#[derive(Clone)]
pub struct Tap(MemoryLink, Rc<RefCell<TapState>>);

#[derive(Default)]
pub struct TapState {
    /// Everything written, with the time.
    pub requests: Vec<(u64, String)>,
    clock: SimulatedClock,
    random: u64,
    /// From, to, and one byte in how many is replaced.
    pub noise: Option<(u64, u64, u64)>,
    /// Reads that fail, from and to.
    pub broken: Option<(u64, u64)>,
}

impl TapState {
    fn damage(&mut self, bytes: &mut [u8]) {
        let now_us = self.clock.now_us();
        let Some((from_us, to_us, every)) = self.noise else { return };
        for byte in bytes.iter_mut().filter(|_| (from_us..to_us).contains(&now_us)) {
            self.random =
                self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            if (self.random >> 33).is_multiple_of(every) {
                *byte ^= 1 << (self.random >> 60 & 7);
            }
        }
    }
}

impl ErrorType for Tap {
    type Error = LinkError;
}

impl Read for Tap {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, LinkError> {
        let now_us = self.1.borrow().clock.now_us();
        if self.1.borrow().broken.is_some_and(|(from_us, to_us)| (from_us..to_us).contains(&now_us)) {
            return Err(LinkError::Closed);
        }
        let count = self.0.read(buffer).await?;
        self.1.borrow_mut().damage(&mut buffer[..count]);
        Ok(count)
    }
}

impl Write for Tap {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, LinkError> {
        let now_us = self.1.borrow().clock.now_us();
        let text = String::from_utf8_lossy(bytes).trim().to_string();
        if !text.is_empty() {
            self.1.borrow_mut().requests.push((now_us, text));
        }
        self.0.write(bytes).await
    }

    async fn flush(&mut self) -> Result<(), LinkError> {
        self.0.flush().await
    }
}

impl Baud for Tap {
    async fn set_baud(&mut self, rate_baud: u32) {
        self.0.set_baud(rate_baud).await;
    }
}

/// A scan as it was handed on.
#[derive(Clone, Copy, Debug)]
pub struct ScanRecord {
    pub at_us: u64,
    pub time: ScanTime,
    pub beams: usize,
}

pub struct DriverAndSensor<const BEAMS: usize = MAX_BEAMS> {
    pub clock: SimulatedClock,
    pub link: MemoryLink,
    pub tapped: Rc<RefCell<TapState>>,
    pub driver: Driver<Tap, SimulatedClock, BEAMS>,
    pub scans: Vec<ScanRecord>,
    pub states: Vec<(u64, SensorState)>,
    /// What every scan of all steps must be.
    expected_mm: Vec<u16>,
}

/// A sensor in this state, with these faults.
pub fn config(model: Model, start: Start, faults: &[Fault]) -> Config {
    Config { start, faults: faults.to_vec(), ..Config::new(model) }
}

/// A fault as on the command line.
pub fn fault(text: &str) -> Fault {
    text.parse().unwrap()
}

/// Serial settings with this rate remembered.
pub fn remembering(last_baud: u32) -> SensorSettings {
    let line = LineSettings::Serial { last_baud: Some(last_baud), wanted_baud: None, fastest_baud: 750_000 };
    SensorSettings { line, ..SensorSettings::SERIAL }
}

impl DriverAndSensor {
    /// A pair with memory for every supported sensor, and the settings for the model's link.
    pub fn new(config: Config) -> Self {
        let serial = config.model.interface == Interface::Rs232;
        let settings = if serial { SensorSettings::SERIAL } else { SensorSettings::NO_SPEED };
        Self::with(config, LinkOptions::default(), settings)
    }
}

impl<const BEAMS: usize> DriverAndSensor<BEAMS> {
    pub fn with(config: Config, options: LinkOptions, settings: SensorSettings) -> Self {
        let mut room = StillRoom::new(config.model.geometry);
        let revolution = Revolution { start_us: 0, period_us: 100_000, earliest_us: 0 };
        let ranges_mm = room.scan(revolution).unwrap().ranges_mm;
        let expected_mm = ranges_mm.into_iter().map(|range_mm| u16::try_from(range_mm).unwrap()).collect();
        Self::on(config, options, settings, Box::new(room), expected_mm, 0)
    }

    /// With a source of its own, and a module that has been running for a while.
    pub fn on(
        config: Config,
        options: LinkOptions,
        settings: SensorSettings,
        source: Box<dyn RangeSource>,
        expected_mm: Vec<u16>,
        start_us: u64,
    ) -> Self {
        let clock = SimulatedClock::starting_at(start_us);
        let link = MemoryLink::new(&clock, Urg::new(config, source, start_us), options);
        let tapped = TapState { clock: clock.clone(), random: 1, ..TapState::default() };
        let tap = Tap(link.clone(), Rc::new(RefCell::new(tapped)));
        let tapped = tap.1.clone();
        let driver = Driver::new(tap, clock.clone(), settings);
        Self { clock, link, tapped, driver, scans: Vec::new(), states: Vec::new(), expected_mm }
    }

    /// How often this was sent.
    pub fn requests(&self, start: &str) -> usize {
        self.tapped.borrow().requests.iter().filter(|(_, text)| text.starts_with(start)).count()
    }

    /// The scans that were accepted and those that were counted as missing are those that were sent, up
    /// to the last accepted.
    pub fn assert_all_accounted_for(&self) {
        let counters = self.counters();
        let last_ms = (self.scans.last().unwrap().time.sensor_ms & 0xff_ffff) as u32;
        let sent = self.truth().iter().position(|truth| truth.stamp_ms == last_ms).unwrap() + 1;
        let unstable = counters.scans_unstable as usize;
        println!("{sent} sent, {} accepted, {} missing", counters.scans_accepted, counters.scans_missing);
        assert_eq!(counters.scans_accepted as usize, self.scans.len());
        assert_eq!(counters.scans_accepted + counters.scans_missing, (sent + unstable) as u32, "{self:?}");
    }

    /// One outcome, if there is one before `limit_us`. Every scan of all steps is compared with the truth.
    fn step(&mut self, limit_us: u64) -> bool {
        let clock = self.clock.clone();
        match block_on_until(&clock, limit_us, self.driver.event_until(u64::MAX)) {
            Err(_) | Ok(SensorEvent::Timeout) => return false,
            Ok(SensorEvent::State(state)) => self.states.push((clock.now_us(), state)),
            Ok(SensorEvent::Scan) => {
                let scan = self.driver.scan().unwrap();
                let beams = scan.ranges_mm.len();
                let wrong = beams == self.expected_mm.len() && scan.ranges_mm != self.expected_mm;
                assert!(!wrong, "a wrong scan was accepted at {} µs", clock.now_us());
                self.scans.push(ScanRecord { at_us: clock.now_us(), time: scan.time, beams });
            }
        }
        true
    }

    /// Runs until the clock would pass `at_s` seconds.
    pub fn run_to(&mut self, at_s: f64) -> &mut Self {
        while self.step((at_s * 1e6) as u64) {}
        self
    }

    /// Runs until a scan comes at or after `from_s`; when it came, in seconds.
    pub fn scan_after(&mut self, from_s: f64) -> f64 {
        let from_us = (from_s * 1e6) as u64;
        self.run_to(from_s);
        let known = self.scans.len();
        while self.scans.len() == known {
            assert!(self.step(from_us + 120 * SECOND_US), "no scan within 120 s after {from_s} s: {self:?}");
        }
        self.scans[known].at_us as f64 / 1e6
    }

    pub fn state(&self) -> SensorState {
        self.driver.session().state()
    }

    pub fn counters(&self) -> SensorCounters {
        *self.driver.session().counters()
    }

    /// Whether this state was passed through.
    pub fn was(&self, state: SensorState) -> bool {
        self.states.iter().any(|(_, passed)| *passed == state)
    }

    pub fn sensor_baud(&self) -> u32 {
        self.link.with_sensor(|sensor, _| sensor.baud())
    }

    pub fn truth(&self) -> Vec<ScanTruth> {
        self.link.with_sensor(|sensor, _| sensor.truth().collect())
    }

    /// Errors of the accepted scans' times against the truth in µs, with the time they came in s.
    pub fn time_errors(&self) -> Vec<(f64, i64, u32)> {
        let truth = self.truth();
        let start_us = |taken: &ScanRecord| {
            let stamp_ms = (taken.time.sensor_ms & 0xff_ffff) as u32;
            let near = |truth: &&ScanTruth| {
                truth.stamp_ms == stamp_ms && truth.start_us.abs_diff(taken.at_us) < 5 * SECOND_US
            };
            truth.iter().find(near).unwrap().start_us
        };
        let error = |taken: &ScanRecord| taken.time.stamp_us as i64 - start_us(taken) as i64;
        self.scans
            .iter()
            .map(|taken| (taken.at_us as f64 / 1e6, error(taken), taken.time.uncertainty_us))
            .collect()
    }
}

impl<const BEAMS: usize> std::fmt::Debug for DriverAndSensor<BEAMS> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "{} µs, {:?}, {:?}", self.clock.now_us(), self.state(), self.counters())?;
        writeln!(f, "{:?}", self.driver.session().losses())?;
        writeln!(f, "last states {:?}", &self.states[self.states.len().saturating_sub(12)..])?;
        self.link.with_sensor(|sensor, _| write!(f, "{sensor:?}"))
    }
}
