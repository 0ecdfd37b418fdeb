//! What is done about a sensor that answers and sends no scan, and about one that reports a fault.
//!
//! ```text
//!   answers without a scan   40 s ─▶ RS, 20 s ─▶ RB, then RB every 120 s
//!   reports of a fault       RB at once ─▶ after 2, 4, 8, 16, 30, 30 … s
//!   an accepted scan         both begin again
//! ```

use super::request::Step;

/// A sensor that answers without sending a scan may still be booting, 30 s the slowest seen: it is reset after this
/// time,
const RESET_AFTER_US: u64 = 40_000_000;
/// rebooted when two more rounds of denials have not helped,
const REBOOT_AFTER_US: u64 = 20_000_000;
/// and again once in two minutes.
const REBOOT_AGAIN_AFTER_US: u64 = 120_000_000;

/// Pause before a full start while the sensor may still be booting: its first scan is late by no more than this and a
/// start. And once a reset has not helped: ten starts between two reboots.
const START_PAUSE_US: u64 = 500_000;
const LATER_START_PAUSE_US: u64 = 12_000_000;

/// Longest pause before a sensor that keeps reporting a fault is rebooted again.
const FAULT_PAUSE_MAX_US: u64 = 30_000_000;

/// Resets and reboots since the last accepted scan.
#[derive(Clone, Debug)]
pub(super) struct Cures {
    /// The sensor has answered without sending a scan since then.
    fruitless_since_us: Option<u64>,
    /// Resets and reboots for that.
    applied: u8,
    /// The sensor's reports of a fault.
    faults: u8,
}

impl Cures {
    pub(super) const NONE: Self = Self { fruitless_since_us: None, applied: 0, faults: 0 };

    /// A scan came: the sensor is well.
    pub(super) const fn clear(&mut self) {
        *self = Self::NONE;
    }

    /// The sensor cannot be used with these settings: neither a reset nor a reboot would help. Faults still count.
    pub(super) const fn give_up(&mut self) {
        self.fruitless_since_us = None;
        self.applied = 0;
    }

    /// The sensor does not answer at all, and may boot again: its time begins anew.
    pub(super) const fn restart_time(&mut self) {
        self.fruitless_since_us = None;
    }

    /// The sensor answered that it is not ready.
    pub(super) fn push_denial(&mut self, now_us: u64) {
        self.fruitless_since_us.get_or_insert(now_us);
    }

    /// The reset or reboot that is due now: none until the sensor has had the time to boot.
    pub(super) fn next(&mut self, now_us: u64) -> Option<Step> {
        let since_us = *self.fruitless_since_us.get_or_insert(now_us);
        let (after_us, step) = match self.applied {
            0 => (RESET_AFTER_US, Step::Reset),
            1 => (REBOOT_AFTER_US, Step::Reboot),
            _ => (REBOOT_AGAIN_AFTER_US, Step::Reboot),
        };
        if now_us < since_us.saturating_add(after_us) {
            return None;
        }
        self.fruitless_since_us = Some(now_us);
        self.applied = self.applied.saturating_add(1);
        Some(step)
    }

    /// Pause before a full start.
    pub(super) const fn start_pause_us(&self) -> u64 {
        if self.applied == 0 { START_PAUSE_US } else { LATER_START_PAUSE_US }
    }

    /// Counts a report of a fault; the pause before the reboot it calls for.
    pub(super) fn push_fault(&mut self) -> u64 {
        let pause_us = match self.faults {
            0 => 0,
            faults => 1_000_000u64 << faults.min(5),
        };
        self.faults = self.faults.saturating_add(1);
        pause_us.min(FAULT_PAUSE_MAX_US)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn a_reset_comes_first_then_reboots_further_apart() {
        let mut cures = Cures::NONE;
        assert_eq!(cures.next(1_000_000), None);
        assert_eq!(cures.start_pause_us(), START_PAUSE_US);
        assert_eq!(cures.next(40_999_999), None);
        assert_eq!(cures.next(41_000_000), Some(Step::Reset));
        assert_eq!(cures.start_pause_us(), LATER_START_PAUSE_US);
        assert_eq!(cures.next(60_999_999), None);
        assert_eq!(cures.next(61_000_000), Some(Step::Reboot));
        assert_eq!(cures.next(180_999_999), None);
        assert_eq!(cures.next(181_000_000), Some(Step::Reboot));
        cures.clear();
        assert_eq!(cures.next(200_000_000), None);
        assert_eq!(cures.next(240_000_000), Some(Step::Reset));
    }

    #[test]
    fn silence_gives_the_sensor_its_time_again() {
        let mut cures = Cures::NONE;
        cures.push_denial(0);
        cures.push_denial(39_000_000);
        cures.restart_time();
        assert_eq!(cures.next(40_000_000), None);
        assert_eq!(cures.next(80_000_000), Some(Step::Reset));
    }

    #[test]
    fn faults_are_answered_at_once_and_then_after_growing_pauses() {
        let mut cures = Cures::NONE;
        let pauses_us: Vec<u64> = (0..7).map(|_| cures.push_fault()).collect();
        let seconds = [0, 2, 4, 8, 16, 30, 30];
        assert_eq!(pauses_us, seconds.map(|second: u64| second * 1_000_000));
        cures.give_up();
        assert_eq!(cures.push_fault(), 30_000_000);
        cures.clear();
        assert_eq!(cures.push_fault(), 0);
    }
}
