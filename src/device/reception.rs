//! Frames from the network: the limit for one poll, and the restart when none come.
//!
//! ```text
//!   controller ─▶ FramesPerPoll ─▶ stack        after 16 the others have their turn
//!                      │ count
//!                      ▼
//!                SilentNetwork ─▶ restart       link, a subscriber, and no frame for 10 min
//! ```
//!
//! smoltcp's `poll` takes frames for as long as there are any, and everything of a module runs in one
//! executor: a flood would keep the sensor and the watchdog from theirs.

/// Frames the stack gets before everything else has its turn. 16 of the longest take 1.3 ms at 100 Mbit/s; the
/// sensor's line fills its buffer of 4096 bytes in 54 ms at 750 000 baud.
const FRAMES_AT_ONCE: u8 = 16;

/// A network without a frame for so long counts as dead, µs: hosts renew every second, and any other machine
/// sends ARP.
const SILENT_US: u64 = 600_000_000;

/// Limits how many frames a poll takes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct FramesPerPoll {
    taken: u8,
}

impl FramesPerPoll {
    /// None taken.
    #[must_use]
    pub const fn new() -> Self {
        Self { taken: 0 }
    }

    /// Whether one more may be taken now. If not, the poll ends, and the next one may take as many again:
    /// the caller must make sure that there is a next one.
    pub fn admits(&mut self) -> bool {
        let admits = self.taken < FRAMES_AT_ONCE;
        self.taken = if admits { self.taken.saturating_add(1) } else { 0 };
        admits
    }

    /// There was none: the poll ends.
    pub fn ended(&mut self) {
        self.taken = 0;
    }
}

/// Notices a network that has died without the link going down.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SilentNetwork {
    frames: u32,
    since_us: u64,
}

impl SilentNetwork {
    /// Begins to listen.
    #[must_use]
    pub const fn new(now_us: u64) -> Self {
        Self { frames: 0, since_us: now_us }
    }

    /// Whether the module must restart. `frames` were received since the start; `had_subscriber`: there was
    /// one since the start, so that hosts can be expected.
    pub fn is_dead(&mut self, frames: u32, link: bool, had_subscriber: bool, now_us: u64) -> bool {
        if frames != self.frames || !link || !had_subscriber {
            *self = Self { frames, since_us: now_us };
        }
        now_us >= self.since_us.saturating_add(SILENT_US)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_poll_takes_sixteen_frames_and_the_next_one_sixteen_more() {
        let mut frames = FramesPerPoll::new();
        for _ in 0..3 {
            assert!((0..16).all(|_| frames.admits()));
            assert!(!frames.admits());
        }
        assert!((0..10).all(|_| frames.admits()));
        frames.ended();
        assert!((0..16).all(|_| frames.admits()));
        assert!(!frames.admits());
    }

    #[test]
    fn ten_minutes_with_link_and_subscriber_but_without_a_frame_are_a_dead_network() {
        let mut network = SilentNetwork::new(5);
        assert!(!network.is_dead(7, true, true, 1_000));
        assert!(!network.is_dead(7, true, true, 1_000 + SILENT_US - 1));
        assert!(network.is_dead(7, true, true, 1_000 + SILENT_US));
    }

    #[test]
    fn a_frame_a_lost_link_and_a_module_without_subscribers_are_none() {
        let last_us = 1_000 + SILENT_US;
        for (frames, link, had_subscriber) in [(8, true, true), (7, false, true), (7, true, false)] {
            let mut network = SilentNetwork::new(0);
            assert!(!network.is_dead(7, true, true, 1_000));
            assert!(!network.is_dead(frames, link, had_subscriber, last_us - 1));
            assert!(!network.is_dead(frames, true, true, last_us));
        }
    }
}
