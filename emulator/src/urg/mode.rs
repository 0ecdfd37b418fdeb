//! What the sensor has been switched to since power-up, and the fault drills (`DB`).
//!
//! ```text
//!   DB03   20 scans ─▶ ten times 21 ─▶ 98 ─▶ scans        drills of SCIP 2.0 sensors
//!   DB04   20 scans ─▶ ten times 21 ─▶ 50, out of order
//!   DB05   20 scans ─▶ 50, out of order
//! ```

use super::State;

/// The fault drill (`DB`) in which a SCIP 2.0 sensor is out of order, as after a fault of its own.
pub(super) const FAULTY: u8 = 2;

/// Scans sent before a fault drill (`DB03` to `DB05`) begins, and the time it lasts, in scans.
const DRILL_AFTER: u64 = 20;
const DRILL_SCANS: u64 = 10;

/// Everything that power-up resets. The default is an idle sensor that speaks SCIP 2, its laser off.
#[derive(Debug, Default)]
pub(super) struct Mode {
    pub(super) scip11: bool,
    pub(super) laser: bool,
    pub(super) time_sync: bool,
    pub(super) asleep: bool,
    pub(super) abnormal: bool,
    pub(super) wedged: bool,
    /// A measurement was asked for before the sensor had started up.
    pub(super) asked_while_booting: bool,
    /// Percent by which the motor is slower than usual (`CR`).
    pub(super) speed_level: u8,
    pub(super) high_sensitivity: bool,
    pub(super) drill: Option<u8>,
}

impl Mode {
    /// Whether the sensor is out of order.
    pub(super) fn is_faulty(&self) -> bool {
        self.abnormal || self.drill == Some(FAULTY)
    }

    /// The state of a sensor that has started up.
    pub(super) fn state(&self, streaming: bool) -> State {
        if self.wedged {
            State::Wedged
        } else if self.is_faulty() {
            State::Abnormal
        } else if self.scip11 {
            State::Scip11
        } else if self.time_sync {
            State::TimeSync
        } else if self.asleep {
            State::Asleep
        } else if streaming {
            State::Streaming
        } else {
            State::Idle
        }
    }

    /// The status a fault drill puts in place of scan number `scans` of a measurement of `asked` scans (0: endless).
    pub(super) fn drill_status(&mut self, scans: u64, asked: u8) -> Option<&'static str> {
        let long = asked == 0 || u64::from(asked) > DRILL_AFTER;
        let since = scans.checked_sub(DRILL_AFTER + 1)?;
        match self.drill? {
            3 if long && since == DRILL_SCANS => {
                self.drill = None;
                Some("98")
            }
            3 | 4 if long && since < DRILL_SCANS => Some("21"),
            4 | 5 if long => {
                self.drill = Some(FAULTY);
                Some("50")
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn statuses(drill: u8, asked: u8) -> (Mode, Vec<Option<&'static str>>) {
        let mut mode = Mode { drill: Some(drill), ..Mode::default() };
        let statuses = (1..=32).map(|scan| mode.drill_status(scan, asked)).collect();
        (mode, statuses)
    }

    #[test]
    fn a_drill_begins_after_twenty_scans() {
        let (mode, passing) = statuses(3, 0);
        assert_eq!(passing[..20], [None; 20]);
        assert_eq!(passing[20..30], [Some("21"); 10]);
        assert_eq!(passing[30..], [Some("98"), None]);
        assert_eq!(mode.state(true), State::Streaming);
        let (mode, lasting) = statuses(4, 0);
        assert_eq!((lasting[29], lasting[30]), (Some("21"), Some("50")));
        assert_eq!(mode.state(true), State::Abnormal);
        let (_, sudden) = statuses(5, 21);
        assert_eq!((sudden[19], sudden[20]), (None, Some("50")));
        let (_, short) = statuses(5, 20);
        assert_eq!(short, [None; 32]);
    }

    #[test]
    fn the_state_that_hides_the_others_is_named() {
        let mut mode = Mode { asleep: true, time_sync: true, ..Mode::default() };
        assert_eq!(mode.state(true), State::TimeSync);
        mode.abnormal = true;
        assert_eq!(mode.state(false), State::Abnormal);
        mode.wedged = true;
        assert_eq!(mode.state(false), State::Wedged);
        assert_eq!(Mode::default().state(false), State::Idle);
    }
}
