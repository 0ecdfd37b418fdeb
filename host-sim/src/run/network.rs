//! The network between devices and host: delay, jitter, loss, duplication and reordering.
//!
//! ```text
//!   sent ─▶ lost? ─▶ delay + jitter (+ held back?) ─▶ arrives        each copy on its own: a later
//!              └─▶ duplicated? ─▶ a second copy                      datagram may overtake an earlier one
//! ```
//!
//! The same goes for both directions. Jitter is exponential, as queues make it; some datagrams are held back
//! for longer, evenly up to a limit, so that the order of reports changes.

use serde::{Deserialize, Serialize};

use crate::world::random::Stream;

/// Quality of the network and of the devices' clocks.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Conditions {
    /// Least time of a datagram on its way, in µs.
    pub delay_us: f64,
    /// Mean of the jitter, in µs: it is added to that.
    pub jitter_us: f64,
    /// Share of the datagrams with an extra delay.
    pub held_share: f64,
    /// Largest extra delay, in µs.
    pub held_us: f64,
    /// Share that is lost.
    pub lost_share: f64,
    /// Share that arrives twice.
    pub doubled_share: f64,
    /// Modules are switched on within so long after the host, in µs: their clocks differ by that.
    pub start_spread_us: f64,
    /// Their clocks run fast or slow by up to so much, in millionths.
    pub drift_ppm: f64,
}

impl Conditions {
    /// Nothing takes any time, nothing is lost, all clocks are one.
    pub const IDEAL: Self = Self {
        delay_us: 0.0,
        jitter_us: 0.0,
        held_share: 0.0,
        held_us: 0.0,
        lost_share: 0.0,
        doubled_share: 0.0,
        start_spread_us: 0.0,
        drift_ppm: 0.0,
    };

    /// Switched Ethernet and ordinary crystals.
    pub const LAN: Self = Self {
        delay_us: 150.0,
        jitter_us: 100.0,
        start_spread_us: 500_000.0,
        drift_ppm: 30.0,
        ..Self::IDEAL
    };

    /// Everything bad at once: 5 % lost, 2 % twice, order changed within 100 ms, drifts of 200 ppm.
    pub const DISTURBED: Self = Self {
        delay_us: 1_000.0,
        jitter_us: 4_000.0,
        held_share: 0.2,
        held_us: 100_000.0,
        lost_share: 0.05,
        doubled_share: 0.02,
        start_spread_us: 500_000.0,
        drift_ppm: 200.0,
    };

    /// The presets by their names.
    pub const NAMED: [(&str, Self); 3] =
        [("ideal", Self::IDEAL), ("lan", Self::LAN), ("disturbed", Self::DISTURBED)];

    /// The preset of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::NAMED.into_iter().find(|(known, _)| *known == name).map(|(_, conditions)| conditions)
    }

    /// When the copies of a datagram arrive that is sent at `now_us`: none, one or two.
    pub fn arrivals(&self, now_us: u64, stream: &mut Stream) -> impl Iterator<Item = u64> + use<> {
        let lost = stream.chance(self.lost_share);
        let doubled = stream.chance(self.doubled_share);
        let mut arrival_us = || {
            let jitter_us = -self.jitter_us * libm::log(1.0 - stream.uniform());
            let held = stream.chance(self.held_share);
            let held_us = stream.between(0.0, self.held_us);
            now_us + (self.delay_us + jitter_us + if held { held_us } else { 0.0 }) as u64
        };
        let (first_us, second_us) = (arrival_us(), arrival_us());
        [Some(first_us).filter(|_| !lost), Some(second_us).filter(|_| doubled && !lost)].into_iter().flatten()
    }
}

impl Default for Conditions {
    fn default() -> Self {
        Self::LAN
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::random::Purpose;

    fn sent(conditions: Conditions) -> Vec<Vec<u64>> {
        let mut stream = Stream::new(1, Purpose::Network, [0, 0]);
        (0..20_000).map(|number| conditions.arrivals(number * 100_000, &mut stream).collect()).collect()
    }

    #[test]
    fn an_ideal_network_does_nothing() {
        let arrivals = sent(Conditions::IDEAL);
        assert!(arrivals.iter().zip(0..).all(|(copies, number)| *copies == [number * 100_000]));
    }

    #[test]
    fn a_disturbed_one_loses_doubles_and_changes_the_order_as_much_as_it_says() {
        let arrivals = sent(Conditions::DISTURBED);
        let share = |copies: usize| {
            arrivals.iter().filter(|arrivals| arrivals.len() == copies).count() as f64 / 20_000.0
        };
        assert!((share(0) - 0.05).abs() < 0.005, "lost {}", share(0));
        assert!((share(2) - 0.019).abs() < 0.004, "doubled {}", share(2));
        let late = arrivals.iter().zip(0..).flat_map(|(copies, number)| {
            copies.iter().map(move |arrival_us| arrival_us - number * 100_000).collect::<Vec<u64>>()
        });
        let overtaken = late.filter(|late_us| *late_us > 50_000).count() as f64 / 20_000.0;
        assert!((0.07..0.13).contains(&overtaken), "held back for more than 50 ms: {overtaken}");
    }
}
