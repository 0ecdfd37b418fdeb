//! Sensor milliseconds to module microseconds.
//!
//! A scan carries the sensor's own millisecond counter, 24 bits of it, as it stood when step 0
//! passed. The scan arrives later, by a delay that is never less than some constant and often more:
//!
//! ```text
//!   sensor   step 0 ├─── mirror turns ───┤ sends ├──▶
//!            stamp ─┘                            │ transport: jitter, stalls
//!   module   ├────────────── delay ──────────────▶├───▶ first byte
//!            ▲ wanted                             ▲ the quickest: lower envelope of (arrival − stamp)
//!
//!   TM1      sent ├──── counter read ────┤ received       the sensor's clock without the delay
//! ```
//!
//! So the wanted time is the envelope less the delay, and the delay is what lies between the
//! envelope and the clock as `TM1` reported it before the stream began. Where a sensor does not know
//! `TM1` the delay is assumed. The counter wraps after 4.66 hours (SCIP 2.0, C-42-03320B) and
//! starts from 0 after a reset; both cases are distinguished here. All arithmetic is in integers: the same stamps
//! in, the same times out.

use super::envelope::{Envelope, Point};
use crate::scan::ScanTime;

/// Values of the sensor's counter: 24 bits of milliseconds.
pub const STAMP_RANGE_MS: u32 = 1 << 24;

/// A counter that goes back by up to this much has not wrapped; less than the 25 ms of the fastest scan.
pub const STEP_BACK_MS: u32 = 16;

/// The same stamp this many times in a row: the sensor is stuck.
pub const STUCK_REPEATS: u8 = 3;

/// Scans of a new stream that say nothing about the delay: its first replies come unsteadily.
pub const SKIPPED_SCANS: u8 = 5;

/// A stamp may run ahead of the arrivals by this much: the scan before may have come this late.
const LATE_MAX_MS: u64 = 2000;

/// Longest gap over which wraps are counted: half the counter's range.
const GAP_MAX_MS: u64 = STAMP_RANGE_MS as u64 / 2;

/// The first stamp of a new stream must be this close to the envelope, or the sensor was reset.
const FRESH_MISFIT_US: u64 = 500_000;

/// The delay is measured against `TM1` until this long after it: then the drift in between is known
/// to 0.01 %, and later a changing drift would spoil it.
const DELAY_SETTLE_US: u64 = 30_000_000;

/// Requests leave at once and replies wait to be read, so of what an exchange leaves open the request took
/// half, but no more than this.
const REQUEST_MAX_US: i64 = 1000;

/// Half a tick: on average the counter has stood for so long when step 0 passes.
const HALF_TICK_US: i64 = 500;

/// Where the sensor's counter stood, from `TM1`.
#[derive(Clone, Copy, Debug)]
struct Anchor {
    stamp_ms: u32,
    received_us: u64,
    /// Bounds of (module time − 1000 µs · stamp).
    least_lag_us: i64,
    greatest_lag_us: i64,
}

/// What a stamp says about the sensor.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StampEvent {
    /// The counter goes on.
    Continued,
    /// The counter started anew: the first stamp of all, or the sensor was reset.
    Restarted,
    /// The same stamp for the [`STUCK_REPEATS`]th time or more: the sensor does not measure.
    Stuck,
}

/// A scan's time and what its stamp says.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Stamped {
    /// When step 0 passed.
    pub time: ScanTime,
    /// What became of the sensor's counter.
    pub event: StampEvent,
}
#[derive(Clone, Copy, Debug)]
struct Last {
    stamp_ms: u32,
    sensor_ms: u64,
    arrival_us: u64,
}

/// The mapping from the sensor's clock to the module's. About 1.2 KiB.
#[derive(Clone, Debug)]
pub struct SensorClock {
    last: Option<Last>,
    repeats: u8,
    /// Scans still to be left out.
    skip: u8,
    /// No scan of this stream has come yet.
    fresh: bool,
    envelope: Envelope,
    anchor: Option<Anchor>,
    /// The exchanges are of the stream before: they count only if the sensor's counter has gone on.
    anchor_before: bool,
    delay_us: i64,
    delay_uncertainty_us: i64,
    delay_measured: bool,
}

impl Default for SensorClock {
    fn default() -> Self {
        Self::new()
    }
}

impl SensorClock {
    /// A clock that knows nothing yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            last: None,
            repeats: 0,
            skip: 0,
            fresh: true,
            envelope: Envelope::new(),
            anchor: None,
            anchor_before: false,
            delay_us: 0,
            delay_uncertainty_us: 0,
            delay_measured: false,
        }
    }

    /// A stream begins, the sensor perhaps having been reset before: its first scans are left out of the
    /// fit and exchanges of an earlier start are forgotten. Unless the delay is measured now or was
    /// once, `assumed_delay_us` is used, give or take half of it.
    pub fn begin(&mut self, assumed_delay_us: u32) {
        self.resume();
        self.anchor = None;
        if !self.delay_measured {
            self.delay_us = i64::from(assumed_delay_us);
            self.delay_uncertainty_us = i64::from(assumed_delay_us / 2);
        }
    }

    /// A stream goes on after a pause: its first scans are left out of the fit. The exchanges still count, unless
    /// the first stamp shows that the counter started anew.
    pub fn resume(&mut self) {
        self.skip = SKIPPED_SCANS;
        self.fresh = true;
        self.anchor_before = true;
    }

    /// A `TM1` exchange: the counter read `stamp_ms` at some moment between `sent_us` and `received_us`.
    /// Any number of exchanges within a second narrow each other down.
    pub fn exchange(&mut self, stamp_ms: u32, sent_us: u64, received_us: u64) {
        if received_us < sent_us {
            return;
        }
        // The counter had stood at the stamp for up to a tick.
        let one = Anchor {
            stamp_ms,
            received_us,
            least_lag_us: Point::new(stamp_ms.into(), sent_us).lag_us.saturating_sub(1000),
            greatest_lag_us: Point::new(stamp_ms.into(), received_us).lag_us,
        };
        // If they contradict, across a wrap or a reset, the later one counts.
        let narrowed = self.anchor.map_or(one, |other| Anchor {
            least_lag_us: one.least_lag_us.max(other.least_lag_us),
            greatest_lag_us: one.greatest_lag_us.min(other.greatest_lag_us),
            ..one
        });
        self.anchor = Some(if narrowed.least_lag_us <= narrowed.greatest_lag_us { narrowed } else { one });
        self.anchor_before = false;
    }

    /// How far the exchanges leave the sensor's clock open, in µs; `None` without any.
    #[must_use]
    pub fn exchange_width_us(&self) -> Option<u32> {
        let width_us = |anchor: Anchor| anchor.greatest_lag_us.saturating_sub(anchor.least_lag_us);
        self.anchor.map(|anchor| u32::try_from(width_us(anchor)).unwrap_or(u32::MAX))
    }

    /// Adds a scan stamped `stamp_ms` (24 bits) whose first byte came at `arrival_us`.
    #[must_use]
    pub fn scan(&mut self, stamp_ms: u32, arrival_us: u64) -> Stamped {
        let stamp_ms = stamp_ms % STAMP_RANGE_MS;
        let repeated = self.last.is_some_and(|last| last.stamp_ms == stamp_ms);
        self.repeats = if repeated { self.repeats.saturating_add(1) } else { 0 };
        let unwrapped = self.unwrap(stamp_ms, arrival_us);
        if unwrapped.is_none() {
            self.envelope.restart();
            self.repeats = 0;
            self.anchor = self.anchor.filter(|_| !self.anchor_before);
        }
        let sensor_ms = unwrapped.unwrap_or(u64::from(stamp_ms));
        self.last = Some(Last { stamp_ms, sensor_ms, arrival_us });
        self.fresh = false;
        if self.skip > 0 {
            self.skip -= 1;
        } else if self.envelope.push(Point::new(sensor_ms, arrival_us)) {
            self.measure_delay();
        }
        let event = match unwrapped {
            None => StampEvent::Restarted,
            Some(_) if self.repeats >= STUCK_REPEATS - 1 => StampEvent::Stuck,
            Some(_) => StampEvent::Continued,
        };
        Stamped { time: self.time(sensor_ms, arrival_us), event }
    }

    /// How much longer than a millisecond of the module the sensor's is, in parts per billion; 0
    /// until known.
    #[must_use]
    pub const fn drift_ppb(&self) -> i64 {
        self.envelope.drift_ppb()
    }

    /// From the stamp to the first byte of the quickest scan, in µs, measured or assumed.
    #[must_use]
    pub const fn delay_us(&self) -> i64 {
        self.delay_us
    }

    /// The stamp on a line without wraps; nothing when the counter started anew.
    fn unwrap(&self, stamp_ms: u32, arrival_us: u64) -> Option<u64> {
        let last = self.last?;
        let elapsed_us = arrival_us.saturating_sub(last.arrival_us);
        let elapsed_ms = elapsed_us / 1000;
        if elapsed_ms > GAP_MAX_MS {
            return None;
        }
        let ahead_ms = stamp_ms.wrapping_sub(last.stamp_ms) % STAMP_RANGE_MS;
        if ahead_ms == 0 {
            return Some(last.sensor_ms);
        }
        if STAMP_RANGE_MS - ahead_ms <= STEP_BACK_MS {
            return Some(last.sensor_ms.saturating_sub(u64::from(STAMP_RANGE_MS - ahead_ms)));
        }
        if u64::from(ahead_ms) > elapsed_ms + elapsed_ms / 64 + LATE_MAX_MS {
            return None;
        }
        let sensor_ms = last.sensor_ms.saturating_add(u64::from(ahead_ms));
        // A scan of a running stream may come late; the first of a new one that does was not late, but
        // stamped by a counter that started anew.
        let envelope_us = self.envelope.lag_us(sensor_ms as i64);
        let misfit_us =
            envelope_us.map_or(0, |lag_us| Point::new(sensor_ms, arrival_us).lag_us.abs_diff(lag_us));
        (!self.fresh || misfit_us <= FRESH_MISFIT_US + elapsed_us / 64).then_some(sensor_ms)
    }

    /// The exchanges: their stamp on the line without wraps, before its start too; the lag, and how far it
    /// may be off.
    fn anchored(&self) -> Option<(i64, i64, i64)> {
        let (anchor, last) = (self.anchor?, self.last?);
        let since_us = last.arrival_us.saturating_sub(anchor.received_us);
        let since_ms = since_us / 1000;
        let back_ms = last.stamp_ms.wrapping_sub(anchor.stamp_ms) % STAMP_RANGE_MS;
        if since_us > DELAY_SETTLE_US || u64::from(back_ms) > since_ms + since_ms / 64 + LATE_MAX_MS {
            return None;
        }
        let anchor_ms = (last.sensor_ms as i64).saturating_sub(i64::from(back_ms));
        let unwrapped_us = i64::from(anchor.stamp_ms).saturating_sub(anchor_ms).saturating_mul(1000);
        let half_us = anchor.greatest_lag_us.saturating_sub(anchor.least_lag_us) / 2;
        let likely_us = anchor.least_lag_us.saturating_add(half_us.min(REQUEST_MAX_US));
        Some((anchor_ms, likely_us.saturating_add(unwrapped_us), half_us))
    }

    /// What lies between the envelope and the clock as `TM1` reported it.
    fn measure_delay(&mut self) {
        if let Some((anchor_ms, middle_us, half_us)) = self.anchored()
            && let Some(envelope_us) = self.envelope.lag_us(anchor_ms)
        {
            self.delay_us = envelope_us.saturating_sub(middle_us).max(0);
            self.delay_uncertainty_us = half_us.saturating_add(self.envelope.uncertainty_us(anchor_ms));
            self.delay_measured = true;
        }
    }

    fn time(&self, sensor_ms: u64, arrival_us: u64) -> ScanTime {
        let stamp_ms = sensor_ms as i64;
        let (lag_us, uncertainty_us) = match (self.envelope.lag_us(stamp_ms), self.anchored()) {
            (Some(envelope_us), _) => (
                envelope_us.saturating_sub(self.delay_us),
                self.delay_uncertainty_us.saturating_add(self.envelope.uncertainty_us(stamp_ms)),
            ),
            (None, Some((anchor_ms, middle_us, half_us))) => {
                (middle_us, half_us.saturating_add(self.envelope.tilt_us(stamp_ms, anchor_ms)))
            }
            (None, None) => (
                Point::new(sensor_ms, arrival_us).lag_us.saturating_sub(self.delay_us),
                self.delay_uncertainty_us.saturating_add(self.envelope.uncertainty_us(stamp_ms)),
            ),
        };
        let stamp_us = stamp_ms.saturating_mul(1000).saturating_add(lag_us).saturating_add(HALF_TICK_US);
        ScanTime {
            sensor_ms,
            stamp_us: stamp_us.max(0) as u64,
            uncertainty_us: u32::try_from(uncertainty_us.saturating_add(HALF_TICK_US)).unwrap_or(u32::MAX),
        }
    }
}

#[cfg(test)]
mod tests;
