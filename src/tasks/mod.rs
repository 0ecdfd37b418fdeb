//! The module's tasks, for any executor: they wait, and decide nothing.
//!
//! ```text
//!   begin:  store ─▶ start, settings, background                       before the first datagram
//!
//!   run:    ┌ sensor ─────── driver ──▶ scan, state ─┐
//!           │ control ────── datagrams ─▶ request ───┼─▶ Module ─▶ perception ─▶ uplink: reports, health
//!           │ time ──────────────────────────────────┘     │
//!           │ storing ◀──────────── wish ──────────────────┘   stream stopped meanwhile
//!           └ supervision ─▶ watchdog
//! ```
//!
//! Sensor, control, perception and uplink are one task: they share the background, a scan is judged in less
//! than a millisecond, and no send ever waits. Supervision runs beside it and feeds the watchdog only as
//! long as that task comes round.
//!
//! All memory is the caller's: driver, module, sockets, store.

mod floor;
mod log;
mod notices;
mod operation;
mod supervision;

pub use floor::{FloorHardware, run_floor};
pub use notices::Notices;
pub use supervision::{Pulse, Waiting};

use embassy_futures::select::{Either, select};
use embedded_io_async::{Read, Write};

use crate::device::starts::ShortStarts;
use crate::device::trial::StoredAddressing;
use crate::device::{Module, Wish};
use crate::link::{Baud, Clock, Datagrams, Images, Store, StoreError, Watchdog};
use crate::sensor::{Driver, LineSettings};
use crate::store;
use crate::update::plan::ImageJob;
use operation::Operation;

/// The job on flash that a wish to note something of images is: [`Wish::Told`], or else [`Wish::Confirm`].
const fn image_job(wish: Wish) -> ImageJob<'static> {
    if matches!(wish, Wish::Told) { ImageJob::Told } else { ImageJob::Confirm }
}

/// Time for the last answers to leave before a restart, µs.
const FAREWELL_US: u64 = 200_000;

/// Counts this start and gives the module its settings and its background. To be done before the network is
/// up: no datagram may be sent with another start's number. `short_starts` came before this one. Returns the
/// speed at which the sensor answered last, for [`LineSettings`].
///
/// # Cancellation
/// The start may have been counted; begin anew with a new module.
pub async fn begin<const BEAMS: usize>(
    store: &mut (impl Store + Images),
    module: &mut Module<BEAMS>,
    short_starts: ShortStarts,
) -> Option<u32> {
    let start = store::start(store, module.unlikely_boot()).await;
    let stored = StoredAddressing {
        addressing: start.settings.addressing,
        unusable: start.address_unusable,
        trial: start.trial,
        short_starts,
    };
    module.begin(start.boot, start.settings);
    module.begin_keys(start.keyring);
    let counted = match module.begin_addressing(stored) {
        Some(trial) => store::save_trial(store, &trial.bytes()).await,
        None => Ok(()),
    };
    if start.failed || counted.is_err() {
        module.store_failed();
    }
    if start.was_reset {
        module.was_reset();
    }
    module.begin_images(store.images(ImageJob::Look).await);
    match store::load_background(store, module.background_mut()).await {
        Ok(serial) => serial.into_iter().for_each(|serial| module.remember_serial(serial)),
        Err(StoreError) => module.store_failed(),
    }
    start.last_baud
}

/// The hardware of a module, as the library sees it.
#[derive(Debug)]
pub struct Hardware<'a, L, C, D, S, W, const BEAMS: usize> {
    /// The sensor, set up by [`Settings::sensor`](crate::device::Settings::sensor).
    pub driver: &'a mut Driver<L, C, BEAMS>,
    /// Its line.
    pub line: LineSettings,
    /// The module's port.
    pub datagrams: D,
    /// Where settings, background and images are kept.
    pub store: S,
    /// The watchdog.
    pub watchdog: W,
    /// The same clock as the driver's.
    pub clock: C,
    /// What the LED and the network have to know, and what they have counted.
    pub notices: &'a Notices,
}

/// Runs the module until it is to start anew: the caller then resets the board.
///
/// # Cancellation
/// As a loss of power: settings and background are the old or the new ones. Call again.
pub async fn run<L, C, D, S, W, const BEAMS: usize>(
    module: &mut Module<BEAMS>,
    hardware: Hardware<'_, L, C, D, S, W, BEAMS>,
) where
    L: Read + Write + Baud,
    C: Clock,
    D: Datagrams,
    S: Store + Images,
    W: Watchdog,
{
    let Hardware { driver, line, datagrams, store, watchdog, clock, notices } = hardware;
    let pulse = Pulse::new(clock.now_us());
    let operation = Operation { module, driver, line, datagrams, clock: &clock, pulse: &pulse, notices };
    let operation = operation.run(store);
    match select(operation, supervision::run(watchdog, &clock, &pulse)).await {
        Either::First(()) | Either::Second(()) => {}
    }
}
