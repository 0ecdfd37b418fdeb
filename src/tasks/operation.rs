//! The task that does the work: whatever comes first of sensor, datagrams and time goes to the module.

use core::pin::pin;

use embassy_futures::select::{Either3, select3};
use embedded_io_async::{Read, Write};

use super::notices::Notices;
use super::supervision::{Pulse, Waiting};
use super::{FAREWELL_US, image_job, log};
use crate::device::{Module, Stored, Wish};
use crate::link::{Baud, Clock, Datagrams, Images, Store};
use crate::sensor::{Driver, LineSettings, SensorEvent, SensorState};
use crate::store;
use crate::wire::DATAGRAM_MAX;

/// The sensor is looked at so often when nothing comes from it, µs.
const LOOK_US: u64 = 500_000;

/// Longest wait for the stream to stop, µs: two requests without an answer, and a second.
const PAUSE_US: u64 = 2_000_000;

pub(super) struct Operation<'a, L, C, D, const BEAMS: usize> {
    pub(super) module: &'a mut Module<BEAMS>,
    pub(super) driver: &'a mut Driver<L, C, BEAMS>,
    pub(super) line: LineSettings,
    pub(super) datagrams: D,
    pub(super) clock: &'a C,
    pub(super) pulse: &'a Pulse,
    pub(super) notices: &'a Notices,
}

impl<L: Read + Write + Baud, C: Clock, D: Datagrams, const BEAMS: usize> Operation<'_, L, C, D, BEAMS> {
    /// Until the module is to start anew.
    ///
    /// # Cancellation
    /// As a loss of power.
    pub(super) async fn run(mut self, mut store: impl Store + Images) {
        loop {
            match self.module.wish() {
                None => self.turn(u64::MAX, &mut store).await,
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

    /// Until the sensor has something to say, the module has a wish, or `limit_us`.
    ///
    /// # Cancellation
    /// As [`Driver::event_until`]; a piece of an image may be stored, or not.
    async fn turn(&mut self, limit_us: u64, images: &mut impl Images) {
        let Self { module, driver, datagrams, clock, pulse, notices, .. } = self;
        let mut datagram = [0; DATAGRAM_MAX + 1];
        let look_us = clock.now_us().saturating_add(LOOK_US).min(limit_us);
        let event = {
            // Kept over all datagrams: nothing that is under way with the sensor is given up for them.
            let mut sensor = pin!(driver.event_until(look_us));
            loop {
                module.network_lost(datagrams.losses());
                module.discovery_dropped(notices.discovery_drops());
                let due_us = module.poll(clock.now_us(), datagrams);
                notices.publish(module.status(clock.now_us()));
                let time = clock.wait_until(due_us);
                match select3(sensor.as_mut(), datagrams.receive_from(&mut datagram), time).await {
                    Either3::First(event) => break event,
                    Either3::Second((length, from)) => {
                        let received = datagram.get_mut(..length).unwrap_or(&mut []);
                        if let Some(work) = module.receive(from, received, clock.now_us(), datagrams) {
                            let done = images.images(work.job(received)).await.map(|_| ());
                            module.image_done(&work, done, clock.now_us(), datagrams);
                        }
                    }
                    Either3::Third(()) => {}
                }
                if module.wish().is_some() {
                    return;
                }
            }
        };
        let now_us = clock.now_us();
        match (event, driver.scan()) {
            (SensorEvent::Scan, Some(scan)) => {
                module.scan(driver.session(), &scan, now_us, datagrams);
                log::report(module.pipeline().judgement().sequence);
            }
            _ => module.sensor(driver.session(), now_us, datagrams),
        }
        if let SensorEvent::State(state) = event {
            log::sensor(state);
        }
        match (event, driver.session().state()) {
            // Here only scans show that all is well.
            (SensorEvent::Timeout, SensorState::Streaming) => {}
            (_, SensorState::Streaming) => pulse.beat(Waiting::Scans, now_us),
            _ => pulse.beat(Waiting::Sensor, now_us),
        }
        notices.publish(module.status(now_us));
    }

    /// Stops the stream, stores what is to be stored, and lets the sensor go on.
    ///
    /// # Cancellation
    /// As a loss of power.
    async fn store(&mut self, store: &mut (impl Store + Images)) {
        self.module.begin_storing(self.clock.now_us(), &mut self.datagrams);
        self.notices.publish(self.module.status(self.clock.now_us()));
        self.driver.pause();
        let limit_us = self.clock.now_us().saturating_add(PAUSE_US);
        while self.driver.session().state() != SensorState::Paused && self.clock.now_us() < limit_us {
            self.turn(limit_us, store).await;
        }
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
        let mut background = match self.module.background_to_store() {
            Some((background, serial)) => {
                Some(store::save_background(store, background, serial).await.is_ok())
            }
            None => None,
        };
        if let Some(rate_baud) = self.driver.session().last_baud()
            && store::save_baud(store, rate_baud).await.is_err()
        {
            background = Some(false);
        }
        if lost {
            // It is stored again later.
            background = Some(false);
        }
        let stored = Stored { settings, keys, background };
        self.module.end_storing(stored, self.clock.now_us(), &mut self.datagrams);
        self.driver.resume_with(self.module.settings().sensor(self.line));
        self.pulse.beat(Waiting::Sensor, self.clock.now_us());
    }
}
