//! Power and reboots.
//!
//! ```text
//!   Off ── power ──▶ Booting ── boot time ──▶ On ── RB, RB within 1 s ──▶ 1 s ──▶ Off ── 0.3 s ──▶ Booting
//! ```

/// Time between the second `RB` and the link going down.
const REBOOT_US: u64 = 1_000_000;

/// Longest time between the two `RB`.
const REBOOT_TWICE_US: u64 = 1_000_000;

/// Time the link is down in a reboot.
pub(super) const DOWN_US: u64 = 300_000;

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Power {
    Off,
    Booting { until_us: u64 },
    On,
}

/// The power supply, and the reboot that was asked for.
#[derive(Debug)]
pub(super) struct Supply {
    pub(super) power: Power,
    /// When the first `RB` came.
    reboot_asked_us: Option<u64>,
    /// When the sensor goes down or, if it is off, comes back.
    pub(super) reboot_at_us: Option<u64>,
}

impl Supply {
    pub(super) const ON: Self = Self { power: Power::On, reboot_asked_us: None, reboot_at_us: None };

    /// One `RB`; whether it was the second in time, which plans the reboot.
    pub(super) fn ask_reboot(&mut self, now_us: u64) -> bool {
        let asked_us = self.reboot_asked_us.replace(now_us);
        let twice = asked_us.is_some_and(|asked_us| now_us - asked_us <= REBOOT_TWICE_US);
        if twice {
            self.reboot_asked_us = None;
            self.reboot_at_us = Some(now_us + REBOOT_US);
        }
        twice
    }

    pub(super) fn switch_off(&mut self) {
        *self = Self { power: Power::Off, ..Self::ON };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_two_reboot_requests_within_a_second_count() {
        let mut supply = Supply::ON;
        assert!(!supply.ask_reboot(0));
        assert!(!supply.ask_reboot(1_000_001));
        assert_eq!(supply.reboot_at_us, None);
        assert!(supply.ask_reboot(2_000_001));
        assert_eq!(supply.reboot_at_us, Some(3_000_001));
        assert!(!supply.ask_reboot(2_000_002), "a pair counts once");
    }
}
