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
//! envelope and the clock as `TM1` told it before the stream began. Where a sensor does not know
//! `TM1` the delay is assumed. The counter wraps after 4.66 hours (SCIP 2.0, C-42-03320B) and
//! starts from 0 after a reset; both are told apart here. All arithmetic is in integers: the same stamps
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

/// The scan before.
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
            delay_us: 0,
            delay_uncertainty_us: 0,
            delay_measured: false,
        }
    }

    /// A stream begins, the sensor perhaps having been reset before: its first scans are left out of the
    /// fit and exchanges of an earlier start are forgotten. Unless the delay is measured now or was
    /// once, `assumed_delay_us` is used, give or take half of it.
    pub fn begin(&mut self, assumed_delay_us: u32) {
        self.skip = SKIPPED_SCANS;
        self.fresh = true;
        self.repeats = 0;
        self.anchor = None;
        if !self.delay_measured {
            self.delay_us = i64::from(assumed_delay_us);
            self.delay_uncertainty_us = i64::from(assumed_delay_us / 2);
        }
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
    }

    /// How far the exchanges leave the sensor's clock open, in µs; `None` without any.
    #[must_use]
    pub fn exchange_width_us(&self) -> Option<u32> {
        let width_us = |anchor: Anchor| anchor.greatest_lag_us.saturating_sub(anchor.least_lag_us);
        self.anchor.map(|anchor| u32::try_from(width_us(anchor)).unwrap_or(u32::MAX))
    }

    /// Takes in a scan stamped `stamp_ms` (24 bits) whose first byte came at `arrival_us`.
    #[must_use]
    pub fn scan(&mut self, stamp_ms: u32, arrival_us: u64) -> Stamped {
        let stamp_ms = stamp_ms % STAMP_RANGE_MS;
        let repeated = self.last.is_some_and(|last| last.stamp_ms == stamp_ms);
        self.repeats = if repeated { self.repeats.saturating_add(1) } else { 0 };
        let unwrapped = self.unwrap(stamp_ms, arrival_us);
        if unwrapped.is_none() {
            self.envelope.restart();
            self.repeats = 0;
        }
        let sensor_ms = unwrapped.unwrap_or(u64::from(stamp_ms));
        self.last = Some(Last { stamp_ms, sensor_ms, arrival_us });
        self.fresh = false;
        if self.skip > 0 {
            self.skip -= 1;
        } else if self.envelope.take(Point::new(sensor_ms, arrival_us)) {
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
        let middle_us = anchor.least_lag_us.midpoint(anchor.greatest_lag_us).saturating_add(unwrapped_us);
        let half_us = anchor.greatest_lag_us.saturating_sub(anchor.least_lag_us) / 2;
        Some((anchor_ms, middle_us, half_us))
    }

    /// What lies between the envelope and the clock as `TM1` told it.
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
mod tests {
    use super::*;
    use std::vec::Vec;

    /// SplitMix64.
    struct Random(u64);

    impl Random {
        fn below(&mut self, limit: u64) -> u64 {
            self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            (z ^ (z >> 31)) % limit.max(1)
        }
    }

    /// A sensor on a link, scanning at 10 Hz.
    struct Simulation {
        random: Random,
        jitter_us: u64,
        delay_us: u64,
        /// Drift in parts per billion as a function of the true time in µs.
        drift_ppb: fn(u64) -> i64,
        counter_ns: i128,
        now_us: u64,
        /// Start and length of stalls: what would arrive inside arrives at the end.
        stalls: Vec<(u64, u64)>,
        clock: SensorClock,
    }

    impl Simulation {
        fn new(seed: u64, drift_ppb: fn(u64) -> i64) -> Self {
            let mut clock = SensorClock::new();
            clock.begin(80_000);
            Self {
                random: Random(seed),
                jitter_us: 20_000,
                delay_us: 73_000,
                drift_ppb,
                counter_ns: 5_000_000_000,
                now_us: 3_000_000,
                stalls: Vec::new(),
                clock,
            }
        }

        fn pass(&mut self, us: u64) {
            self.now_us += us;
            // A millisecond of the sensor lasts longer by the drift.
            self.counter_ns += i128::from(us) * 1_000_000_000_000
                / (1_000_000_000 + i128::from((self.drift_ppb)(self.now_us)));
        }

        fn stamp_ms(&self) -> u32 {
            ((self.counter_ns / 1_000_000) % i128::from(STAMP_RANGE_MS)) as u32
        }

        fn exchanges(&mut self) {
            for _ in 0..16 {
                let sent_us = self.now_us;
                let (out_us, back_us) =
                    (500 + self.random.below(1000), self.random.below(self.jitter_us + 1));
                self.pass(out_us);
                let stamp_ms = self.stamp_ms();
                self.pass(back_us);
                self.clock.exchange(stamp_ms, sent_us, self.now_us);
            }
        }

        /// The next scan: what came of it, and the error in µs.
        fn scan(&mut self) -> (Stamped, i64) {
            self.pass(100_000);
            let arrival_us = self.now_us + self.delay_us + self.random.below(self.jitter_us + 1);
            let stall =
                self.stalls.iter().find(|(start, length)| (*start..start + length).contains(&arrival_us));
            let arrival_us = stall.map_or(arrival_us, |(start, length)| start + length);
            let stamped = self.clock.scan(self.stamp_ms(), arrival_us);
            (stamped, stamped.time.stamp_us as i64 - self.now_us as i64)
        }

        /// Runs to `seconds` after the start; the largest error and uncertainty in µs after `settle_s`.
        fn run(&mut self, settle_s: u64, seconds: u64) -> (i64, u32) {
            let (mut error_us, mut uncertainty_us) = (0, 0);
            for n in 0..seconds * 10 {
                let (stamped, error) = self.scan();
                if n >= settle_s * 10 {
                    error_us = error_us.max(error.abs());
                    uncertainty_us = uncertainty_us.max(stamped.time.uncertainty_us);
                }
            }
            (error_us, uncertainty_us)
        }
    }

    #[test]
    fn drift_of_three_thousandths_jitter_and_a_stall_cost_less_than_5_ms_after_10_s() {
        let drifts: [fn(u64) -> i64; 3] = [|_| 3_000_000, |_| -3_000_000, |_| 0];
        let (mut worst_us, mut over) = (0, 0);
        for seed in 0..100 {
            for drift_ppb in drifts {
                let mut simulation = Simulation::new(seed, drift_ppb);
                let stall_us = 4_000_000 + simulation.random.below(12_000_000);
                simulation.stalls.push((stall_us, 390_000));
                simulation.exchanges();
                let (error_us, _) = simulation.run(10, 120);
                worst_us = worst_us.max(error_us);
                over += u32::from(error_us > 5_000);
            }
        }
        std::println!("largest error from 10 s to 120 s in 300 runs: {worst_us} µs; {over} runs over 5 ms");
        assert!(over <= 3 && worst_us <= 6_000, "{over} runs, {worst_us} µs");
    }

    #[test]
    fn drift_and_jitter_of_every_size_are_followed() {
        let drifts: [fn(u64) -> i64; 5] =
            [|_| 5_000_000, |_| 1_000_000, |_| -20_000, |_| -2_000_000, |_| -9_000_000];
        for drift_ppb in drifts {
            for jitter_us in [0, 2_000, 10_000, 20_000] {
                let mut simulation = Simulation { jitter_us, ..Simulation::new(jitter_us + 5, drift_ppb) };
                simulation.exchanges();
                let (error_us, uncertainty_us) = simulation.run(20, 200);
                let (drift, found) = (drift_ppb(0), simulation.clock.drift_ppb());
                std::println!(
                    "drift {drift} ppb (found {found}), jitter {jitter_us} µs: off by {error_us} of ±{uncertainty_us} µs"
                );
                assert!(error_us <= 1_000 + jitter_us as i64 / 5);
                assert!((drift - found).abs() < 50_000);
            }
        }
    }

    #[test]
    fn a_day_with_a_drift_that_follows_the_temperature_and_five_wraps() {
        // 0.3 %, swinging by 40 ppm with the hours.
        let mut simulation = Simulation::new(9, |now_us| {
            let phase = (now_us / 1_000_000 % 7200) as i64 - 3600;
            3_000_000 + 40 * phase.abs() / 3600 * 1000
        });
        simulation.exchanges();
        simulation.stalls = (1..24).map(|hour| (hour * 3_600_000_000, 390_000)).collect();
        let mut last_ms = 0;
        let mut worst_us = 0;
        for n in 0..24 * 36_000 {
            let (stamped, error_us) = simulation.scan();
            assert!(stamped.time.sensor_ms > last_ms, "back at scan {n}");
            last_ms = stamped.time.sensor_ms;
            if n > 100 {
                worst_us = worst_us.max(error_us.abs());
            }
        }
        std::println!("24 h, {} wraps: off by {worst_us} µs at most", last_ms >> 24);
        assert_eq!(last_ms >> 24, 5);
        assert!(worst_us <= 5_000, "{worst_us}");
    }

    #[test]
    fn the_error_is_seldom_larger_than_said() {
        let mut outside = 0;
        for seed in 0..40 {
            let mut simulation =
                Simulation::new(seed, if seed % 2 == 0 { |_| 3_000_000 } else { |_| -2_000_000 });
            simulation.exchanges();
            for _ in 0..1000 {
                let (stamped, error_us) = simulation.scan();
                outside += u32::from(error_us.unsigned_abs() > stamped.time.uncertainty_us.into());
            }
        }
        std::println!("{outside} of 40000 scans off by more than their uncertainty");
        assert!(outside <= 400, "{outside}");
    }

    #[test]
    fn stalls_never_pull_the_time_up() {
        // 1 s in every 5 arrives late.
        let mut simulation = Simulation::new(3, |_| 3_000_000);
        simulation.stalls = (2..60).map(|n| (n * 5_000_000, 1_000_000)).collect();
        simulation.exchanges();
        assert!(simulation.run(15, 250).0 <= 5_000);
    }

    #[test]
    fn unsteady_first_scans_are_left_out_of_the_fit() {
        let mut simulation = Simulation::new(4, |_| 3_000_000);
        simulation.exchanges();
        for _ in 0..SKIPPED_SCANS {
            // 40 ms earlier than any later one.
            simulation.delay_us = 33_000;
            let _ = simulation.scan();
        }
        simulation.delay_us = 73_000;
        assert!(simulation.run(10, 60).0 <= 5_000);
        assert!((simulation.clock.delay_us() - 73_000).abs() < 4_000);
    }

    #[test]
    fn without_exchanges_the_delay_is_assumed() {
        let mut simulation = Simulation::new(4, |_| -3_000_000);
        let (error_us, uncertainty_us) = simulation.run(10, 60);
        assert!(error_us <= 12_000, "assumed 80 ms, true 73 ms, off by {error_us} µs");
        assert!(uncertainty_us >= 40_000);
    }

    /// A clock that has seen `stamp_ms` at 100 s.
    fn at(stamp_ms: u32) -> SensorClock {
        let mut clock = SensorClock::new();
        let first = clock.scan(stamp_ms, 100_000_000);
        assert_eq!(first.event, StampEvent::Restarted);
        assert_eq!(first.time.sensor_ms, u64::from(stamp_ms));
        clock
    }

    #[test]
    fn the_counter_wraps_once_and_twice() {
        let last = STAMP_RANGE_MS - 1;
        let mut clock = at(last);
        let mut now_us = 100_000_000;
        for turn in 1..=2u64 {
            let after = clock.scan(99, now_us + 100_000);
            assert_eq!(after.event, StampEvent::Continued);
            assert_eq!(after.time.sensor_ms, (turn << 24) + 99);
            // The rest of the turn in hours' steps, so that no gap is too long.
            for part in 1..=4 {
                now_us += u64::from(STAMP_RANGE_MS / 4) * 1000;
                let stamp_ms = (STAMP_RANGE_MS / 4 * part).wrapping_sub(1);
                assert_eq!(clock.scan(stamp_ms, now_us).event, StampEvent::Continued);
            }
        }
    }

    #[test]
    fn a_small_step_back_is_no_wrap_before_and_after_one() {
        let mut clock = at(500);
        assert_eq!(clock.scan(499, 100_010_000).time.sensor_ms, 499);
        let mut clock = at(STAMP_RANGE_MS - 1);
        assert_eq!(clock.scan(0, 100_001_000).time.sensor_ms, 1 << 24);
        let back = clock.scan(STAMP_RANGE_MS - 1, 100_002_000);
        assert_eq!((back.event, back.time.sensor_ms), (StampEvent::Continued, (1 << 24) - 1));
        assert_eq!(clock.scan(99, 100_101_000).time.sensor_ms, (1 << 24) + 99);
    }

    #[test]
    fn a_counter_set_to_0_restarts_the_mapping() {
        let mut simulation = Simulation::new(6, |_| 3_000_000);
        simulation.exchanges();
        let _ = simulation.run(0, 60);
        simulation.pass(1_500_000);
        simulation.counter_ns = 700_000_000;
        simulation.clock.begin(80_000);
        simulation.exchanges();
        let (stamped, _) = simulation.scan();
        assert_eq!(stamped.event, StampEvent::Restarted);
        assert!(stamped.time.sensor_ms < 2_000);
        // The drift is known by now: at once it is good.
        assert!(simulation.run(3, 60).0 <= 5_000);
    }

    #[test]
    fn a_reset_soon_after_the_start_is_told_from_a_late_scan() {
        // Started 10 s ago, unplugged for 12 s and reset meanwhile: the counter is ahead of before.
        let mut simulation = Simulation::new(6, |_| 0);
        simulation.counter_ns = 0;
        let _ = simulation.run(0, 10);
        simulation.pass(12_000_000);
        simulation.counter_ns = 11_000_000_000;
        simulation.clock.begin(80_000);
        assert_eq!(simulation.scan().0.event, StampEvent::Restarted);
        // In a running stream the same is a late scan.
        let mut clock = at(10_000);
        assert_eq!(clock.scan(11_000, 113_000_000).event, StampEvent::Continued);
    }

    #[test]
    fn the_mapping_goes_on_after_a_gap() {
        let mut simulation = Simulation::new(8, |_| 3_000_000);
        simulation.exchanges();
        let _ = simulation.run(0, 60);
        simulation.pass(30_000_000);
        simulation.clock.begin(80_000);
        let (stamped, error_us) = simulation.scan();
        assert_eq!(stamped.event, StampEvent::Continued);
        assert!(error_us.abs() <= 5_000, "{error_us}");
        assert!(simulation.run(0, 60).0 <= 6_000);
    }

    #[test]
    fn the_same_stamp_three_times_is_a_stuck_sensor() {
        let mut clock = at(500);
        assert_eq!(clock.scan(500, 100_100_000).event, StampEvent::Continued);
        assert_eq!(clock.scan(500, 100_200_000).event, StampEvent::Stuck);
        assert_eq!(clock.scan(500, 100_300_000).event, StampEvent::Stuck);
        assert_eq!(clock.scan(900, 100_400_000).event, StampEvent::Continued);
    }

    #[test]
    fn any_stamps_at_any_times_are_survived() {
        let mut random = Random(1);
        let mut clock = SensorClock::new();
        for n in 0..200_000u64 {
            let at_us = match random.below(4) {
                0 => n * 100_000,
                1 => random.below(u64::MAX),
                2 => random.below(1 << 40),
                _ => u64::MAX - random.below(3),
            };
            let stamp_ms = random.below(1 << 32) as u32;
            match random.below(8) {
                0 => clock.begin(stamp_ms),
                1 => clock.exchange(stamp_ms, at_us, at_us.saturating_add(random.below(1 << 50))),
                _ => drop(clock.scan(if random.below(3) == 0 { n as u32 * 100 } else { stamp_ms }, at_us)),
            }
        }
    }
}
