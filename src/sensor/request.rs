//! The request to the sensor that is due or under way, and what the bytes that come in reply look like.
//!
//! ```text
//!   Due(step) ── deadline ──▶ Asked(step) ──┬─ reply ────▶ Due(next step), Streaming or Paused
//!      ▲                                    └─ deadline ─▶ time-out
//!      └──────────── repeat, while attempts are left ──────────┘
//! ```

use super::action::Message;

/// After a request, bytes may still come out of buffers that were filled at the speed before. They say nothing about
/// this one.
const STALE_US: u64 = 60_000;

/// Most bytes at one rate: what a scan stream of 40 Hz, with intensities, sends in 4.5 s, twice.
const CANDIDATE_BYTES: u32 = 2_500_000;

/// Text this long shows that the rate is right.
const TEXT_BYTES: u32 = 24;

/// This many bytes that are mostly no text show that the rate is wrong, but for noise before the first reply: the
/// reply is given `GARBLED_US` to come.
const GARBLED_BYTES: u32 = 64;
const GARBLED_US: u64 = 120_000;

/// What the sensor is asked, one thing at a time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Step {
    /// `QT`: is there a sensor at this rate? It also ends a stream that still runs.
    Quit,
    /// `SCIP2.0`, to a sensor that answered in SCIP 1.1.
    Scip20,
    /// `TM2`, to a sensor found in the time-synchronisation state.
    LeaveTimeSync,
    /// `VV`.
    Version,
    /// `PP`.
    Parameters,
    /// `SS`.
    BitRate(u32),
    /// `PP` again, at the new rate.
    Verify,
    /// `TM0`.
    TimeEnter,
    /// `QT` once more, because `TM0` was denied.
    TimeQuit,
    /// `TM1`.
    TimeRead,
    /// `TM2`.
    TimeLeave,
    /// `MD` or `MS`.
    Measure,
    /// `BM`, because measuring was denied.
    LaserOn,
    /// `RS`.
    Reset,
    /// `RB`.
    Reboot,
    /// `RB` for the second time.
    RebootAgain,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Phase {
    /// The request is sent at the deadline.
    Due(Step),
    /// The request was sent; the deadline ends the wait for the reply.
    Asked(Step),
    /// Scans come, or should; the deadline says by when.
    Streaming,
    /// Stopped by [`Session::pause`](super::Session::pause): nothing is sent, and every byte that comes is skipped.
    Paused,
}

/// The present phase and the deadline that ends it.
#[derive(Clone, Debug)]
pub(super) struct RequestState {
    pub(super) phase: Phase,
    pub(super) deadline_us: u64,
    /// Times the present step was asked before.
    pub(super) attempt: u8,
    /// When the last request was sent.
    pub(super) asked_us: u64,
    pub(super) reply: ReplyBytes,
    /// The request to hand to the link.
    pub(super) message: Option<Message>,
}

impl RequestState {
    pub(super) const fn new() -> Self {
        Self {
            phase: Phase::Due(Step::Quit),
            deadline_us: 0,
            attempt: 0,
            asked_us: 0,
            reply: ReplyBytes::NONE,
            message: None,
        }
    }

    /// Plans `step` for `at_us`, as its first attempt.
    pub(super) fn schedule(&mut self, step: Step, at_us: u64) {
        self.phase = Phase::Due(step);
        self.deadline_us = at_us;
        self.attempt = 0;
    }

    /// Plans `step` once more if it was asked fewer than `limit` times; says whether it was.
    pub(super) fn repeat(&mut self, step: Step, at_us: u64, limit: u8) -> bool {
        let attempt = self.attempt.saturating_add(1);
        if attempt < limit {
            self.schedule(step, at_us);
            self.attempt = attempt;
        }
        attempt < limit
    }

    /// Begins the wait for the reply to `step`.
    pub(super) fn sent(&mut self, step: Step, now_us: u64, reply_us: u64) {
        self.phase = Phase::Asked(step);
        self.asked_us = now_us;
        self.reply = ReplyBytes::NONE;
        self.deadline_us = now_us.saturating_add(reply_us);
    }

    /// Counts bytes that came since the request, and ends the wait early if they show that it is in vain: far too
    /// many bytes, or bytes that must have been sent at another rate while the rate is in question.
    pub(super) fn count_bytes(&mut self, bytes: &[u8], rate_in_question: bool, now_us: u64) {
        if now_us.saturating_sub(self.asked_us) >= STALE_US {
            self.reply.count(bytes);
        }
        if !matches!(self.phase, Phase::Asked(_)) {
            return;
        }
        if self.reply.total() > CANDIDATE_BYTES {
            self.deadline_us = self.deadline_us.min(now_us);
        } else if self.phase == Phase::Asked(Step::Quit) && rate_in_question && self.reply.is_garbled() {
            self.deadline_us = self.deadline_us.min(self.asked_us.saturating_add(GARBLED_US));
        }
    }
}

/// Bytes since the request, but for those that may have been on their way before.
#[derive(Clone, Copy, Debug)]
pub(super) struct ReplyBytes {
    /// Line ends and printable ASCII: all that SCIP sends.
    text: u32,
    other: u32,
}

impl ReplyBytes {
    const NONE: Self = Self { text: 0, other: 0 };

    fn count(&mut self, bytes: &[u8]) {
        for byte in bytes {
            let counter = match byte {
                b'\n' | b'\r' | b' '..=b'~' => &mut self.text,
                _ => &mut self.other,
            };
            *counter = counter.saturating_add(1);
        }
    }

    fn total(self) -> u32 {
        self.text.saturating_add(self.other)
    }

    /// Whether the bytes are text: the rate is right.
    pub(super) const fn is_text(self) -> bool {
        self.text >= TEXT_BYTES && self.other <= self.text / 8
    }

    /// Whether the bytes are no text: they were sent at another rate.
    pub(super) fn is_garbled(self) -> bool {
        self.total() >= GARBLED_BYTES && self.other > self.text / 2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waiting_for_quit() -> RequestState {
        let mut request = RequestState::new();
        request.sent(Step::Quit, 1_000_000, 250_000);
        request
    }

    #[test]
    fn a_step_is_repeated_until_its_limit() {
        let mut request = RequestState::new();
        request.schedule(Step::Version, 5);
        assert!(request.repeat(Step::Version, 10, 3));
        assert!(request.repeat(Step::Version, 20, 3));
        assert_eq!((request.phase, request.deadline_us), (Phase::Due(Step::Version), 20));
        assert!(!request.repeat(Step::Version, 30, 3));
        assert_eq!(request.deadline_us, 20);
    }

    #[test]
    fn bytes_that_are_no_text_shorten_the_wait_only_while_the_rate_is_in_question() {
        let mut request = waiting_for_quit();
        request.count_bytes(&[0xFF; 64], false, 1_070_000);
        assert_eq!(request.deadline_us, 1_250_000);
        let mut request = waiting_for_quit();
        request.count_bytes(&[0xFF; 63], true, 1_070_000);
        assert_eq!(request.deadline_us, 1_250_000);
        request.count_bytes(&[0xFF], true, 1_080_000);
        assert_eq!(request.deadline_us, 1_000_000 + GARBLED_US);
        assert!(request.reply.is_garbled() && !request.reply.is_text());
    }

    #[test]
    fn bytes_from_before_the_request_do_not_count() {
        let mut request = waiting_for_quit();
        request.count_bytes(&[0xFF; 500], true, 1_000_000 + STALE_US - 1);
        assert_eq!((request.reply.total(), request.deadline_us), (0, 1_250_000));
        request.count_bytes(b"00P\n00P\n00P\n00P\n00P\n00P\n", true, 1_100_000);
        assert!(request.reply.is_text() && !request.reply.is_garbled());
    }
}
