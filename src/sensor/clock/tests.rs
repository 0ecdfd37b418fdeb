//! The clock against simulated sensors: drift, jitter, stalls, wraps and resets.

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
    /// Start and length of stalls: what would leave inside leaves after the end, one after the other.
    stalls: Vec<(u64, u64)>,
    /// Time a scan takes on the line, and when the line is free.
    line_us: u64,
    free_us: u64,
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
            line_us: 85_000,
            free_us: 0,
            clock,
        }
    }

    fn pass(&mut self, us: u64) {
        self.now_us += us;
        // A millisecond of the sensor lasts longer by the drift.
        self.counter_ns +=
            i128::from(us) * 1_000_000_000_000 / (1_000_000_000 + i128::from((self.drift_ppb)(self.now_us)));
    }

    fn stamp_ms(&self) -> u32 {
        ((self.counter_ns / 1_000_000) % i128::from(STAMP_RANGE_MS)) as u32
    }

    fn exchanges(&mut self) {
        for _ in 0..32 {
            let sent_us = self.now_us;
            let (out_us, back_us) = (500 + self.random.below(1000), self.random.below(self.jitter_us + 1));
            self.pass(out_us);
            let stamp_ms = self.stamp_ms();
            self.pass(back_us);
            self.clock.exchange(stamp_ms, sent_us, self.now_us);
        }
    }

    /// The next scan: what came of it, and the error in µs.
    fn scan(&mut self) -> (Stamped, i64) {
        self.pass(100_000);
        let ready_us = self.now_us + self.delay_us;
        let stall = self.stalls.iter().find(|(start, length)| (*start..start + length).contains(&ready_us));
        let leaves_us = stall.map_or(ready_us, |(start, length)| start + length).max(self.free_us);
        self.free_us = leaves_us + self.line_us;
        let arrival_us = leaves_us + self.random.below(self.jitter_us + 1);
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

/// 300 runs with 20 ms of jitter, three drifts, and a stall of 390 ms between 4 s and 16 s: the largest
/// error from 10 s on, and in how many runs it was above 5 ms.
fn stalled_runs(line_us: u64) -> (i64, u32) {
    let drifts: [fn(u64) -> i64; 3] = [|_| 3_000_000, |_| -3_000_000, |_| 0];
    let (mut worst_us, mut over) = (0, 0);
    for seed in 0..100 {
        for drift_ppb in drifts {
            let mut simulation = Simulation { line_us, ..Simulation::new(seed, drift_ppb) };
            let stall_us = 4_000_000 + simulation.random.below(12_000_000);
            simulation.stalls.push((stall_us, 390_000));
            simulation.exchanges();
            let (error_us, _) = simulation.run(10, 120);
            worst_us = worst_us.max(error_us);
            over += u32::from(error_us > 5_000);
        }
    }
    std::println!("{line_us} µs a scan: off by {worst_us} µs at most; {over} of 300 runs over 5 ms");
    (worst_us, over)
}

#[test]
fn drift_of_three_thousandths_jitter_and_a_stall_cost_less_than_5_ms_after_10_s() {
    // What is left over, 1 to 2 runs in 100, is what 90 scans with 20 ms of jitter can say at all.
    let (worst_us, over) = stalled_runs(0);
    assert!(over <= 6 && worst_us <= 6_500);
}

#[test]
fn a_stall_that_takes_a_slow_line_3_s_to_make_up_for_costs_little_more() {
    let (worst_us, over) = stalled_runs(85_000);
    assert!(over <= 20 && worst_us <= 9_000);
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
    // 1 s in every 5 is held back, and another second's scans come late behind it.
    let mut simulation = Simulation { line_us: 50_000, ..Simulation::new(3, |_| 3_000_000) };
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
    // The drift is known by now: it is good sooner.
    assert!(simulation.run(3, 10).0 <= 9_000);
    assert!(simulation.run(0, 60).0 <= 5_000);
}

#[test]
fn the_exchanges_still_count_after_a_pause() {
    let mut simulation = Simulation { jitter_us: 2_000, ..Simulation::new(6, |_| 3_000_000) };
    simulation.exchanges();
    // Too short to know the delay well.
    let (_, before_us) = simulation.run(1, 2);
    simulation.pass(1_500_000);
    simulation.clock.resume();
    let (_, after_us) = simulation.run(15, 25);
    std::println!("±{before_us} µs before the pause, ±{after_us} µs after it");
    assert!(after_us < 2_500);
}

#[test]
fn exchanges_of_a_counter_that_started_anew_in_a_pause_are_forgotten() {
    let mut simulation = Simulation { jitter_us: 0, ..Simulation::new(6, |_| 0) };
    simulation.exchanges();
    let _ = simulation.run(0, 2);
    simulation.pass(1_500_000);
    simulation.counter_ns = 700_000_000;
    simulation.clock.resume();
    let (stamped, error_us) = simulation.scan();
    assert_eq!(stamped.event, StampEvent::Restarted);
    assert!(error_us.abs() <= 5_000, "{error_us}");
    assert!(simulation.clock.exchange_width_us().is_none());
    assert!(simulation.run(0, 60).0 <= 5_000);
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
