//! A module's clock on the host's: offset, drift and jitter from the exchanges of the subscription.
//!
//! ```text
//!   host    T1 ──╲                 ╱──▶ T4       delay  = (T4 − T1) − (T3 − T2)
//!   module        ╲──▶ T2   T3 ──╱               offset = ((T2 − T1) + (T3 − T4)) / 2, off by at most delay / 2
//! ```
//!
//! Transport only ever adds, so the exchanges with the least delay are the true ones: each counts by the
//! inverse square of what its delay exceeds the least by, and a line through them is offset and drift.
//!
//! ```text
//!   exchange ─▶ possible? ─▶ do drift and delays allow it beside each one kept? ─▶ taken
//!                  │no           │no: no times until the next exchange
//!               refused          ╰─▶ the next agrees with those kept ─▶ it was wrong
//!                                    the next agrees with it ─────────▶ the clock has jumped: a new line from these two
//! ```

use std::collections::VecDeque;

/// Exchanges kept, a second apart: two minutes tell 200 ppm from nothing to a millisecond.
const EXCHANGES: usize = 120;

/// Exchanges so much older than the newest are not kept, µs: drift has made too much of them to tell a jump from.
const KEPT_US: u64 = EXCHANGES as u64 * 1_000_000;

/// Uncertainty that remains of an exchange of the least delay, s: the wake-up of a task.
const FLOOR_S: f64 = 0.000_2;

/// Most drift of a crystal and a resonator together.
const DRIFT_MAX: f64 = 0.001;

/// Drift before it is measured, one σ: two crystals.
const DRIFT_PRIOR: f64 = 0.000_1;

/// Longest that a module takes to answer, s: it answers from memory, within a millisecond. One that stores something
/// answers late, and its exchange says little.
const ANSWER_S: f64 = 0.05;

/// Longest that an exchange takes, s: two renewals. An answer that waited longer waited at this machine, as during its
/// sleep.
const EXCHANGE_S: f64 = 2.0;

/// What became of an exchange.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Verdict {
    /// It is in the line.
    Taken,
    /// No exchange can be so: it runs backwards, or took too long.
    Impossible,
    /// It contradicts those kept. There are no times until the next exchange decides.
    Doubted,
    /// Two in a row contradict those kept and agree with each other: the clock has jumped, and the line is new.
    Jumped,
}

/// Four times of one exchange, µs: host, module, module, host.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Exchange {
    /// When the host asked.
    pub t1_us: u64,
    /// When the module received that.
    pub t2_us: u64,
    /// When the module answered.
    pub t3_us: u64,
    /// When the host received the answer.
    pub t4_us: u64,
}

impl Exchange {
    /// Time on the way, there and back, s.
    fn delay_s(&self) -> f64 {
        let host_us = self.t4_us.saturating_sub(self.t1_us);
        let module_us = self.t3_us.saturating_sub(self.t2_us);
        host_us.saturating_sub(module_us) as f64 * 1e-6
    }

    /// Whether it can have happened.
    fn is_possible(&self) -> bool {
        let (Some(host_us), Some(module_us)) =
            (self.t4_us.checked_sub(self.t1_us), self.t3_us.checked_sub(self.t2_us))
        else {
            return false;
        };
        let (host_s, module_s) = (host_us as f64 * 1e-6, module_us as f64 * 1e-6);
        module_s <= ANSWER_S && host_s <= EXCHANGE_S && module_s <= host_s + FLOOR_S
    }

    /// Whether one clock without a jump can have given both: the offset of each is off by half of its delay at most.
    fn agrees(&self, other: &Self) -> bool {
        let apart_s = self.t4_us.abs_diff(other.t4_us) as f64 * 1e-6;
        let unsure_s = 0.5 * (self.delay_s() + other.delay_s()) + FLOOR_S + DRIFT_MAX * apart_s;
        (self.offset_s() - other.offset_s()).abs() <= unsure_s
    }

    /// Module less host, s.
    fn offset_s(&self) -> f64 {
        let there = self.t2_us as f64 - self.t1_us as f64;
        let back = self.t3_us as f64 - self.t4_us as f64;
        (there + back) * 0.5e-6
    }
}

/// Maps one module's microseconds to the host's seconds. A new boot needs a new one.
#[derive(Clone, Debug, Default)]
pub struct ModuleClock {
    exchanges: VecDeque<Exchange>,
    line: Option<Line>,
    /// One that contradicts those kept, until the next decides.
    doubted: Option<Exchange>,
}

/// offset(t) = offset_s + drift · (t − about_s), t on the host's clock.
#[derive(Clone, Copy, Debug)]
struct Line {
    about_s: f64,
    offset_s: f64,
    drift: f64,
    jitter_s: f64,
}

impl ModuleClock {
    /// Takes an exchange, if it can be.
    pub fn add(&mut self, exchange: Exchange) -> Verdict {
        if !exchange.is_possible() {
            return Verdict::Impossible;
        }
        self.exchanges.retain(|kept| exchange.t4_us.abs_diff(kept.t4_us) <= KEPT_US);
        let doubted = self.doubted.take();
        if self.exchanges.iter().all(|kept| kept.agrees(&exchange)) {
            self.keep(exchange);
            return Verdict::Taken;
        }
        let Some(earlier) = doubted.filter(|doubted| doubted.agrees(&exchange)) else {
            self.doubted = Some(exchange);
            return Verdict::Doubted;
        };
        self.exchanges.clear();
        self.keep(earlier);
        self.keep(exchange);
        Verdict::Jumped
    }

    fn keep(&mut self, exchange: Exchange) {
        if self.exchanges.len() == EXCHANGES {
            self.exchanges.pop_front();
        }
        self.exchanges.push_back(exchange);
        self.fit(exchange.t4_us as f64 * 1e-6);
    }

    fn fit(&mut self, about_s: f64) {
        let least_s = self.exchanges.iter().map(Exchange::delay_s).fold(f64::INFINITY, f64::min);
        let weight = |exchange: &Exchange| {
            let deviation_s = FLOOR_S + 0.5 * (exchange.delay_s() - least_s);
            1.0 / (deviation_s * deviation_s)
        };
        // Least squares for offset and drift, with the prior on the drift.
        let (mut n, mut t, mut tt, mut y, mut ty) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for exchange in &self.exchanges {
            let (weight, offset_s) = (weight(exchange), exchange.offset_s());
            let at_s = exchange.t4_us as f64 * 1e-6 - about_s;
            n += weight;
            t += weight * at_s;
            tt += weight * at_s * at_s;
            y += weight * offset_s;
            ty += weight * at_s * offset_s;
        }
        tt += 1.0 / (DRIFT_PRIOR * DRIFT_PRIOR);
        let determinant = n * tt - t * t;
        if determinant <= 0.0 {
            return;
        }
        let drift = ((n * ty - t * y) / determinant).clamp(-DRIFT_MAX, DRIFT_MAX);
        let offset_s = (y - drift * t) / n;
        let (mut weights, mut squares) = (0.0, 0.0);
        for exchange in &self.exchanges {
            let at_s = exchange.t4_us as f64 * 1e-6 - about_s;
            let error_s = exchange.offset_s() - offset_s - drift * at_s;
            weights += weight(exchange);
            squares += weight(exchange) * error_s * error_s;
        }
        self.line = Some(Line { about_s, offset_s, drift, jitter_s: (squares / weights).sqrt() });
    }

    /// The host's time of a module's stamp, s; None before the first exchange, and while the newest contradicts the
    /// others.
    #[must_use]
    pub fn host_s(&self, module_us: u64) -> Option<f64> {
        let line = self.line.filter(|_| self.doubted.is_none())?;
        let module_s = module_us as f64 * 1e-6;
        // module = host + offset + drift · (host − about)
        Some((module_s - line.offset_s + line.drift * line.about_s) / (1.0 + line.drift))
    }

    /// Module less host, s, at the last exchange.
    #[must_use]
    pub fn offset_s(&self) -> Option<f64> {
        self.line.map(|line| line.offset_s)
    }

    /// How much faster the module's clock runs.
    #[must_use]
    pub fn drift(&self) -> Option<f64> {
        self.line.map(|line| line.drift)
    }

    /// Spread of the exchanges around offset and drift, s.
    #[must_use]
    pub fn jitter_s(&self) -> Option<f64> {
        self.line.map(|line| line.jitter_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exchanges a second apart with a clock that is off and drifts, delayed by up to `jitter_us` each way.
    fn clock(seconds: u64, offset_us: f64, drift: f64, jitter_us: u64) -> ModuleClock {
        let module_us = |host_us: u64| (host_us as f64 * (1.0 + drift) + offset_us) as u64;
        let mut random = 12_345_u64;
        let mut delay_us = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            200 + (random >> 33) % jitter_us.max(1)
        };
        let mut clock = ModuleClock::default();
        for second in 1..=seconds {
            let t1_us = second * 1_000_000;
            let t2 = t1_us + delay_us();
            let t3 = t2 + 50;
            let t4_us = t3 + delay_us();
            let exchange = Exchange { t1_us, t2_us: module_us(t2), t3_us: module_us(t3), t4_us };
            assert_eq!(clock.add(exchange), Verdict::Taken, "{second}");
        }
        clock
    }

    #[test]
    fn offset_and_drift_are_found_through_jitter() {
        let clock = clock(60, 400_000.0, 200e-6, 30_000);
        let at_us = 61_000_000_f64;
        let module_us = (at_us * (1.0 + 200e-6) + 400_000.0) as u64;
        let error_s = clock.host_s(module_us).unwrap() - at_us * 1e-6;
        assert!(error_s.abs() < 0.003, "{error_s} s");
        assert!((clock.drift().unwrap() - 200e-6).abs() < 100e-6);
    }

    #[test]
    fn one_exchange_is_enough_to_begin() {
        let clock = clock(1, -700_000.0, 0.0, 0);
        let error_s = clock.host_s(1_300_000).unwrap() - 2.0;
        assert!(error_s.abs() < 0.001, "{error_s} s");
    }

    #[test]
    fn an_exchange_that_runs_backwards_is_ignored() {
        let mut clock = ModuleClock::default();
        clock.add(Exchange { t1_us: 10, t2_us: 5, t3_us: 4, t4_us: 20 });
        assert_eq!(clock.host_s(7), None);
    }

    #[test]
    fn f6_an_answer_that_took_longer_than_its_exchange_or_too_long_moves_nothing() {
        let mut clock = clock(30, 400_000.0, 0.0, 1000);
        let before_s = clock.host_s(30_000_000).unwrap();
        // What one forged datagram said: T1 = 0 and so much between T2 and T3 that no delay was left.
        let forged = Exchange { t1_us: 0, t2_us: 31_400_000, t3_us: 62_600_000, t4_us: 31_000_000 };
        let slow = Exchange { t1_us: 30_900_000, t2_us: 31_300_000, t3_us: 31_360_000, t4_us: 31_000_000 };
        let waited = Exchange { t1_us: 31_000_000, t2_us: 31_400_000, t3_us: 31_400_050, t4_us: 34_000_000 };
        for exchange in [forged, slow, waited] {
            assert_eq!(clock.add(exchange), Verdict::Impossible, "{exchange:?}");
            assert_eq!(clock.host_s(30_000_000), Some(before_s));
        }
    }

    #[test]
    fn f6_one_exchange_that_contradicts_the_line_is_no_part_of_it() {
        let mut clock = clock(30, 400_000.0, 0.0, 1000);
        let before_s = clock.host_s(30_000_000).unwrap();
        let at = |second: u64, offset_us: u64| Exchange {
            t1_us: second * 1_000_000,
            t2_us: second * 1_000_000 + 300 + offset_us,
            t3_us: second * 1_000_000 + 350 + offset_us,
            t4_us: second * 1_000_000 + 650,
        };
        assert_eq!(clock.add(at(31, 1_300_000)), Verdict::Doubted);
        assert_eq!(clock.host_s(30_000_000), None, "which of them is right is not known");
        assert_eq!(clock.add(at(32, 400_000)), Verdict::Taken);
        assert!((clock.host_s(30_000_000).unwrap() - before_s).abs() < 0.001);
    }

    #[test]
    fn f1_a_clock_that_jumps_begins_anew_and_has_no_times_before() {
        let mut clock = clock(60, 400_000.0, 0.0, 1000);
        let at = |second: u64| Exchange {
            t1_us: second * 1_000_000,
            t2_us: second * 1_000_000 + 600_000_300,
            t3_us: second * 1_000_000 + 600_000_350,
            t4_us: second * 1_000_000 + 650,
        };
        assert_eq!(clock.add(at(61)), Verdict::Doubted);
        assert_eq!(clock.host_s(661_000_000), None);
        assert_eq!(clock.add(at(62)), Verdict::Jumped);
        let error_s = clock.host_s(662_000_000).unwrap() - 62.0;
        assert!(error_s.abs() < 0.001, "{error_s} s: nothing of the old line is left");
    }

    #[test]
    fn f1_a_clock_that_jumped_while_the_host_slept_is_no_drift() {
        let mut clock = clock(60, 400_000.0, 0.0, 1000);
        let offset_us = 400_000 - 300_000;
        let asleep = 600;
        for second in 61 + asleep..63 + asleep {
            let t1_us = second * 1_000_000;
            let t2_us = t1_us + 300 + offset_us;
            clock.add(Exchange { t1_us, t2_us, t3_us: t2_us + 50, t4_us: t1_us + 650 });
        }
        let error_s = clock.host_s(670_000_000 + offset_us).unwrap() - 670.0;
        assert!(error_s.abs() < 0.001, "{error_s} s");
    }

    #[test]
    fn no_exchange_of_a_jittery_network_or_of_a_fast_clock_is_doubted() {
        for (drift, jitter_us) in [(0.0, 30_000), (900e-6, 100), (-900e-6, 300_000), (200e-6, 0)] {
            let clock = clock(600, 400_000.0, drift, jitter_us);
            assert_eq!(clock.exchanges.len(), EXCHANGES);
        }
    }
}
