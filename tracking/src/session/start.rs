//! Which start of a device is believed: the one that answers what this host has asked.
//!
//! ```text
//!   the start that is believed ──────────────────────────▶ admitted
//!   a higher one ── has answered a fresh request ────────▶ believed: the device has restarted
//!   a lower one ─── has answered two, and the higher ────▶ believed: the device's flash was erased, or the
//!                   none for 3 s                           higher one was never true
//!   all others ──────────────────────────────────────────▶ refused, counted
//! ```
//!
//! A datagram with a forged sender says any number, and gets no answers to its address: it cannot silence the device.

use super::outstanding::Kind;

/// A device that has answered nothing for so long is silent, µs: it is asked every second, and two answers may be lost. Reports do
/// not count: they can be forged. While the believed start is not silent, no lower one is believed.
pub const SILENT_US: u64 = 3_000_000;

/// Answers that a lower start must have given: one may have been on its way since before the restart.
const ANSWERS: u8 = 2;

/// Why a datagram of a device is refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Refusal {
    /// It is from a start that is not believed.
    StaleBoot,
    /// It answers nothing that was asked.
    Unasked,
}

/// The start of one device that is believed.
#[derive(Clone, Copy, Debug, Default)]
pub struct BootFilter {
    believed: Option<u32>,
    answered_us: u64,
    /// A lower one, and how many requests it has answered.
    rival: Option<(u32, u8)>,
}

impl BootFilter {
    /// Whether a datagram of start `boot` that came at `now_us` is to be used.
    ///
    /// # Errors
    /// It is not, and why.
    pub fn admit(&mut self, boot: u32, kind: Kind, now_us: u64) -> Result<(), Refusal> {
        if kind == Kind::Unasked {
            return Err(Refusal::Unasked);
        }
        let answers = kind == Kind::Answer;
        let is_believed = match self.believed {
            Some(believed) if boot == believed => true,
            Some(believed) if boot < believed => answers && self.has_replaced(boot, now_us),
            _ => answers,
        };
        if !is_believed {
            return Err(Refusal::StaleBoot);
        }
        if self.believed != Some(boot) {
            (self.believed, self.rival) = (Some(boot), None);
        }
        if answers {
            self.answered_us = now_us;
        }
        Ok(())
    }

    /// Whether a lower start that has answered once more is the device's own.
    fn has_replaced(&mut self, boot: u32, now_us: u64) -> bool {
        let before = self.rival.filter(|(rival, _)| *rival == boot).map_or(0, |(_, answers)| answers);
        let answers = before.saturating_add(1);
        self.rival = Some((boot, answers));
        answers >= ANSWERS && now_us.saturating_sub(self.answered_us) >= SILENT_US
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND_US: u64 = 1_000_000;

    #[test]
    fn f3_a_forged_higher_start_does_not_silence_the_device() {
        let mut boots = BootFilter::default();
        assert_eq!(boots.admit(5, Kind::Answer, 0), Ok(()));
        for boot in [6, u32::MAX] {
            assert_eq!(boots.admit(boot, Kind::Unsolicited, 1), Err(Refusal::StaleBoot));
            assert_eq!(boots.admit(boot, Kind::Unasked, 1), Err(Refusal::Unasked));
        }
        assert_eq!(boots.admit(5, Kind::Unsolicited, 2), Ok(()));
        assert_eq!(boots.admit(6, Kind::Answer, 3), Ok(()), "it has restarted, and says so when asked");
        assert_eq!(boots.admit(5, Kind::Unsolicited, 4), Err(Refusal::StaleBoot));
    }

    #[test]
    fn f3_a_start_number_that_went_back_counts_after_two_answers_and_three_seconds() {
        let mut boots = BootFilter::default();
        assert_eq!(boots.admit(57, Kind::Answer, 0), Ok(()));
        for second in 1..3 {
            let answer = boots.admit(1, Kind::Answer, second * SECOND_US);
            assert_eq!(answer, Err(Refusal::StaleBoot), "57 may still answer");
            // Its reports can be forged, and hold nothing up.
            assert_eq!(boots.admit(57, Kind::Unsolicited, second * SECOND_US), Ok(()));
        }
        assert_eq!(boots.admit(1, Kind::Unsolicited, 4 * SECOND_US), Err(Refusal::StaleBoot));
        assert_eq!(boots.admit(1, Kind::Answer, 4 * SECOND_US), Ok(()));
        assert_eq!(boots.admit(1, Kind::Unsolicited, 4 * SECOND_US), Ok(()));
        assert_eq!(boots.admit(57, Kind::Unsolicited, 4 * SECOND_US), Err(Refusal::StaleBoot));
    }

    #[test]
    fn f3_one_answer_from_before_is_not_enough() {
        let mut boots = BootFilter::default();
        assert_eq!(boots.admit(57, Kind::Answer, 0), Ok(()));
        assert_eq!(boots.admit(56, Kind::Answer, 9 * SECOND_US), Err(Refusal::StaleBoot));
        assert_eq!(boots.admit(57, Kind::Unsolicited, 10 * SECOND_US), Ok(()));
    }
}
