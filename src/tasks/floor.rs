//! The task of a module beside a SensFloor: whatever comes first of its line, datagrams and time goes to the module.
//!
//! ```text
//!   line ──── bytes ─▶ device::tiles ─┐
//!   line ◀─── request ────────────────┤
//!   control ─ datagrams ─▶ request ───┼─▶ Module ─▶ readings, health
//!   time ─────────────────────────────┘
//! ```

use embassy_futures::select::{Either, Either3, select, select3};
use embedded_io_async::{Read, Write};

use super::notices::Notices;
use super::supervision::{self, Pulse, Waiting};
use super::{FAREWELL_US, image_job, log};
use crate::device::tiles::Tiles;
use crate::device::{Module, Stored, Wish};
use crate::floor::sensfloor::{BAUD, FRAME_LEN};
use crate::link::{Baud, Clock, Datagrams, Images, Store, Watchdog};
use crate::store;
use crate::wire::{Counter, DATAGRAM_MAX};

/// Bytes read from the line at once: what three tiles say in a tick.
const CHUNK: usize = 3 * FRAME_LEN;

/// A line that fails is tried again after so long, µs.
const RETRY_US: u64 = 200_000;

/// A request that the line does not take within this is given up, µs: before the next one.
const WRITE_US: u64 = 50_000;

/// The hardware of a module beside a floor, as the library sees it.
#[derive(Debug)]
pub struct FloorHardware<'a, L, C, D, S, W> {
    /// What is known of the floor: nothing yet.
    pub tiles: &'a mut Tiles,
    /// Its serial line.
    pub line: L,
    /// The module's port.
    pub datagrams: D,
    /// Where settings are kept.
    pub store: S,
    /// The watchdog.
    pub watchdog: W,
    /// Its time.
    pub clock: C,
    /// What the LED and the network have to know, and what they have counted.
    pub notices: &'a Notices,
}

/// Runs the module until it is to start anew: the caller then resets the board.
///
/// # Cancellation
/// As a loss of power: settings are the old or the new ones. Call again.
pub async fn run_floor<L, C, D, S, W, const BEAMS: usize>(
    module: &mut Module<BEAMS>,
    hardware: FloorHardware<'_, L, C, D, S, W>,
) where
    L: Read + Write + Baud,
    C: Clock,
    D: Datagrams,
    S: Store + Images,
    W: Watchdog,
{
    let FloorHardware { tiles, line, datagrams, store, watchdog, clock, notices } = hardware;
    let pulse = Pulse::new(clock.now_us());
    let operation =
        Operation { module, tiles, line, read_us: 0, datagrams, clock: &clock, pulse: &pulse, notices };
    match select(operation.run(store), supervision::run(watchdog, &clock, &pulse)).await {
        Either::First(()) | Either::Second(()) => {}
    }
}

struct Operation<'a, L, C, D, const BEAMS: usize> {
    module: &'a mut Module<BEAMS>,
    tiles: &'a mut Tiles,
    line: L,
    /// From when on the line is read, µs.
    read_us: u64,
    datagrams: D,
    clock: &'a C,
    pulse: &'a Pulse,
    notices: &'a Notices,
}

impl<L: Read + Write + Baud, C: Clock, D: Datagrams, const BEAMS: usize> Operation<'_, L, C, D, BEAMS> {
    /// Until the module is to start anew.
    ///
    /// # Cancellation
    /// As a loss of power.
    async fn run(mut self, mut store: impl Store + Images) {
        self.line.set_baud(BAUD).await;
        loop {
            match self.module.wish() {
                None => self.turn(&mut store).await,
                Some(Wish::Store) => self.store(&mut store).await,
                Some(wish @ (Wish::Confirm | Wish::Told)) => {
                    let done = store.images(image_job(wish)).await.map(|_| ());
                    self.module.image_noted(wish, done, self.clock.now_us(), &mut self.datagrams);
                }
                Some(Wish::Restart) => break,
            }
        }
        self.pulse.beat(Waiting::Restart, self.clock.now_us());
        self.clock.wait_until(self.clock.now_us().saturating_add(FAREWELL_US)).await;
    }

    /// Until one thing has come.
    ///
    /// # Cancellation
    /// A request may be cut off in the middle; a piece of an image may be stored, or not.
    async fn turn(&mut self, images: &mut impl Images) {
        self.module.network_lost(self.datagrams.losses());
        self.module.discovery_dropped(self.notices.discovery_drops());
        let now_us = self.clock.now_us();
        let readings = |module: &Module<BEAMS>| module.counters().get(Counter::ScansAccepted);
        let before = readings(self.module);
        let request = self.module.tiles(self.tiles, now_us, &mut self.datagrams);
        if readings(self.module) != before {
            log::reading(readings(self.module));
        }
        if let Some(request) = request.filter(|_| now_us >= self.read_us) {
            self.write(&request).await;
        }
        let due_us = self.module.poll(self.clock.now_us(), &mut self.datagrams).min(self.tiles.next_us());
        self.notices.publish(self.module.status(self.clock.now_us()));
        self.pulse.beat(Waiting::Sensor, self.clock.now_us());
        let Self { line, read_us, datagrams, clock, .. } = self;
        let (mut bytes, mut datagram) = ([0; CHUNK], [0; DATAGRAM_MAX + 1]);
        let read = async {
            clock.wait_until(*read_us).await;
            line.read(&mut bytes).await
        };
        let came = select3(read, datagrams.receive_from(&mut datagram), clock.wait_until(due_us)).await;
        let now_us = self.clock.now_us();
        match came {
            Either3::First(Ok(length @ 1..)) => {
                self.tiles.receive(bytes.get(..length).unwrap_or(&bytes), now_us);
            }
            // An end of the file, or a failure: bytes may be lost.
            Either3::First(_) => {
                self.tiles.lost();
                self.read_us = now_us.saturating_add(RETRY_US);
            }
            Either3::Second((length, from)) => {
                let received = datagram.get_mut(..length).unwrap_or(&mut []);
                if let Some(work) = self.module.receive(from, received, now_us, &mut self.datagrams) {
                    let done = images.images(work.job(received)).await.map(|_| ());
                    self.module.image_done(&work, done, self.clock.now_us(), &mut self.datagrams);
                }
            }
            Either3::Third(()) => {}
        }
    }

    /// Asks the floor; what the line does not take in time is lost, and asked again in the next round.
    ///
    /// # Cancellation
    /// The request may be cut off.
    async fn write(&mut self, request: &[u8]) {
        let until_us = self.clock.now_us().saturating_add(WRITE_US);
        match select(self.line.write_all(request), self.clock.wait_until(until_us)).await {
            Either::First(Ok(())) => {}
            Either::First(Err(_)) => {
                self.tiles.lost();
                self.read_us = self.clock.now_us().saturating_add(RETRY_US);
            }
            Either::Second(()) => {}
        }
    }

    /// Stores settings.
    ///
    /// # Cancellation
    /// As a loss of power.
    async fn store(&mut self, store: &mut impl Store) {
        self.module.begin_storing(self.clock.now_us(), &mut self.datagrams);
        self.notices.publish(self.module.status(self.clock.now_us()));
        self.pulse.beat(Waiting::Storing, self.clock.now_us());
        let settings = match self.module.settings_to_store() {
            Some((settings, trial)) => {
                Some(store::save_settings_on_trial(store, settings, trial).await.is_ok())
            }
            None => None,
        };
        let (mut keys, mut lost) = (None, false);
        if let Some(keyring) = self.module.keys_to_store() {
            // A store beyond repair was erased for the first, which has lost all else, and takes the second.
            for attempt in 0..2 {
                keys = Some(store.save(store::KEYS, &keyring.bytes()).await.is_ok());
                if keys == Some(true) {
                    lost = attempt > 0;
                    break;
                }
            }
        }
        let stored = Stored { settings, keys, background: lost.then_some(false) };
        self.module.end_storing(stored, self.clock.now_us(), &mut self.datagrams);
        self.pulse.beat(Waiting::Sensor, self.clock.now_us());
    }
}
