//! A device with a floor of panels in the place of a sensor: each reading is sent to all subscribers.
//!
//! ```text
//!   panels ─▶ crate::floor: debounce, faults ─▶ `pressed`   also when nothing is pressed: silence never means empty
//! ```

use heapless::Vec;

use super::Module;
use crate::floor::{FAULTY, Floor};
use crate::link::Outbox;
use crate::wire::{Counter, FaultyPanel, List, Message, Pressed, ReportHead, SensorCode, SensorHealth};

/// Without a reading for so long there are no scans, µs: four at 9 Hz, as the host takes a floor for silent.
pub(super) const NO_READING_US: u64 = 500_000;

impl<const BEAMS: usize> Module<BEAMS> {
    /// The newest reading of `floor` was made at `stamp_us`, in µs since boot: it is sent. From the first one on the
    /// device has a floor.
    pub fn panels(&mut self, floor: &Floor, stamp_us: u64, now_us: u64, out: &mut impl Outbox) {
        self.begin_floor();
        self.observed.last_scan_us = Some(now_us);
        let down = floor.pressed();
        let mut faulty: Vec<FaultyPanel, FAULTY> = Vec::new();
        for (panel, fault) in floor.faulty() {
            // At most as many as there is room for, of at most 1024 panels.
            let _ = u16::try_from(panel).map(|panel| faulty.push(FaultyPanel { panel, fault }));
        }
        let head = ReportHead {
            sequence: floor.sequence(),
            setup: self.setup.number(),
            stamp_us,
            sensor_ms: stamp_us / 1000,
            ..ReportHead::default()
        };
        let pressed = Pressed {
            head,
            columns: floor.columns(),
            rows: floor.rows(),
            down: List::new(down.bytes(floor.panels())),
            faulty: List::new(&faulty),
        };
        let encoded = Message::Pressed(pressed).encode(self.identity, &mut self.datagram);
        let datagram = encoded.ok().and_then(|length| self.datagram.get(..length)).unwrap_or(&[]);
        let dropped = (&mut self.counters, Counter::ReportsDropped);
        self.subscribers.send(datagram, |_| true, dropped, now_us, &mut self.guard.over(out));
        self.poll(now_us, out);
    }

    /// From now on it has a floor: the alarms say nothing of a background.
    pub(super) const fn begin_floor(&mut self) {
        self.observed.has_floor = true;
    }

    /// Whether it has a floor.
    pub(super) const fn has_floor(&self) -> bool {
        self.observed.has_floor
    }

    /// What health says of the floor, where otherwise it speaks of the sensor; none without a floor.
    pub(super) fn floor_health(&self, now_us: u64) -> Option<SensorHealth> {
        let code = match self.observed.last_scan_us {
            _ if !self.has_floor() => return None,
            None => SensorCode::Searching,
            Some(_) if now_us < self.no_scan_us() => SensorCode::Streaming,
            Some(_) => SensorCode::Stalled,
        };
        Some(SensorHealth { code, detail: (0, 0) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::fixture::{Sent, about};
    use crate::wire::Alarms;

    #[test]
    fn a_floor_that_is_read_lacks_no_sensor_and_one_that_is_not_has_no_scans() {
        let mut module = Module::<1>::new(about());
        let mut sent = Sent::default();
        let lacks = |module: &Module<1>, now_us| {
            let alarms = module.alarms(now_us);
            [Alarms::NO_SCANS, Alarms::NO_BACKGROUND].map(|alarm| alarms.with(alarm) == alarms)
        };
        assert_eq!(lacks(&module, 0), [true, true]);
        let floor = Floor::new(4, 4).unwrap();
        module.panels(&floor, 1_000_000, 1_000_100, &mut sent);
        assert_eq!(lacks(&module, 1_500_000), [false, false]);
        assert_eq!(lacks(&module, 1_500_100), [true, false]);
        let code = |now_us| module.floor_health(now_us).map(|health| health.code);
        assert_eq!(code(1_500_000), Some(SensorCode::Streaming));
        assert_eq!(code(1_500_100), Some(SensorCode::Stalled));
        assert_eq!(sent.0, 0, "no subscriber yet");
    }
}
