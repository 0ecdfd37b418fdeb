//! Whether another tracker publishes under the same topics: each says now and then that it is there, by a number of its own.
//!
//! ```text
//!   every 10 s ─▶ kehai/SITE/presence {"instance":"5c1e…"}       kept by no broker: an earlier start is none
//!   heard with another number ─▶ alarm `same-name` ─ none for 30 s ─▶ over
//! ```

use std::collections::hash_map::RandomState;
use std::hash::BuildHasher;
use std::time::{Duration, Instant};

use super::payloads::{Present, written};

/// Between two messages: of another tracker it is known as soon as it connects, and for no longer than three of these.
const EVERY: Duration = Duration::from_secs(10);

/// So long after its last message another tracker is gone: two of them may be lost.
const GONE: Duration = EVERY.saturating_mul(3);

/// Its own presence, and that of others.
#[derive(Debug)]
pub(super) struct Presence {
    own: String,
    said: Option<Instant>,
    other: Option<Instant>,
}

impl Presence {
    /// Under a number that no other start has.
    pub fn new() -> Self {
        let own = format!("{:016x}", RandomState::new().hash_one(std::process::id()));
        Self { own, said: None, other: None }
    }

    /// The number.
    pub fn own(&self) -> &str {
        &self.own
    }

    /// To a broker that was just connected it is said at once.
    pub const fn connected(&mut self) {
        self.said = None;
    }

    /// What is to be said now, if it is time.
    pub fn due(&mut self, now: Instant) -> Option<String> {
        if self.said.is_some_and(|said| now.duration_since(said) < EVERY) {
            return None;
        }
        self.said = Some(now);
        Some(written(&Present { instance: self.own.clone() }))
    }

    /// Takes what was said, be it the copy of its own; whether it is news that another tracker is there.
    pub fn hear(&mut self, payload: &[u8], now: Instant) -> bool {
        let said = serde_json::from_slice::<Present>(payload);
        if !said.is_ok_and(|said| said.instance != self.own) {
            return false;
        }
        let is_new = !self.is_shared(now);
        self.other = Some(now);
        is_new
    }

    /// Whether another tracker is there.
    pub fn is_shared(&self, now: Instant) -> bool {
        self.other.is_some_and(|other| now.duration_since(other) < GONE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_with_one_name_hear_each_other_until_one_is_gone_and_none_hears_itself() {
        let (mut one, mut other, now) = (Presence::new(), Presence::new(), Instant::now());
        assert_ne!(one.own(), other.own());
        let said = one.due(now).unwrap();
        assert!(!one.hear(said.as_bytes(), now) && !one.is_shared(now), "the copy of its own");
        assert!(!one.hear(b"online", now), "no tracker says so");
        assert!(other.hear(said.as_bytes(), now) && other.is_shared(now));
        assert!(!other.hear(said.as_bytes(), now + EVERY), "known already");
        assert!(other.is_shared(now + EVERY + GONE / 2) && !other.is_shared(now + EVERY + GONE));
        assert!(other.hear(said.as_bytes(), now + EVERY + GONE), "it is back");
    }

    #[test]
    fn it_is_said_now_and_then_and_at_once_to_a_new_broker() {
        let (mut presence, now) = (Presence::new(), Instant::now());
        assert!(presence.due(now).is_some() && presence.due(now + EVERY / 2).is_none());
        presence.connected();
        assert!(presence.due(now + EVERY / 2).is_some());
        assert!(presence.due(now + EVERY + EVERY / 2).is_some());
    }
}
