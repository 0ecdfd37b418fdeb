//! The requests that wait for an answer: only what answers one of them is an answer.
//!
//! ```text
//!   asked ─▶ id, kind, T1 ─┬─ the same id, kind and T1 come back ─▶ answered, once
//!                          └─ two seconds ─────────────────────────▶ forgotten
//! ```
//!
//! Ids cannot be guessed by a host that does not see the requests, so an answer proves that its sender receives what is
//! sent to its address.

use std::collections::VecDeque;

use kehai::wire::{Message, Request};

/// Requests that are remembered: three a second at most, for as long as answers are taken, and some more.
const ASKED: usize = 8;

/// So long an answer is taken, µs: two renewals.
pub const ANSWER_US: u64 = 2_000_000;

/// A request that was sent.
#[derive(Clone, Copy, Debug)]
struct Asked {
    id: u32,
    kind: u8,
    t1_us: u64,
}

/// What a message is, to a host that knows what it has asked.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// No answer to anything: a report, a health, a part.
    Unsolicited,
    /// The answer to a request that waits for one.
    Answer,
    /// An answer that nothing has asked for.
    Unasked,
}

/// The requests to one device that wait for an answer.
#[derive(Clone, Debug, Default)]
pub struct Outstanding(VecDeque<Asked>);

impl Outstanding {
    /// A request was sent at `now_us`.
    pub fn note(&mut self, id: u32, request: Request<'_>, now_us: u64) {
        if self.0.len() == ASKED {
            self.0.pop_front();
        }
        self.0.push_back(Asked { id, kind: request.kind(), t1_us: now_us });
    }

    /// Those of another subscription wait here, too.
    pub fn adopt(&mut self, other: &Self) {
        self.0.extend(&other.0);
        let more = self.0.len().saturating_sub(ASKED);
        self.0.drain(..more);
    }

    /// What a message is that came at `now_us`.
    pub fn kind(&self, message: &Message<'_>, now_us: u64) -> Kind {
        match answer_to(message) {
            None => Kind::Unsolicited,
            Some(answered) if self.0.iter().any(|asked| asked.fits(answered, now_us)) => Kind::Answer,
            Some(_) => Kind::Unasked,
        }
    }

    /// The same; the request is answered by it.
    pub fn consume(&mut self, message: &Message<'_>, now_us: u64) -> Kind {
        let kind = self.kind(message, now_us);
        if let Some(answered) = answer_to(message) {
            self.0.retain(|asked| !asked.fits(answered, now_us));
        }
        kind
    }
}

impl Asked {
    fn fits(&self, (id, kind, t1): (u32, u8, Option<[u8; 8]>), now_us: u64) -> bool {
        let own_t1 = t1.is_none_or(|t1| t1 == self.t1_us.to_le_bytes());
        self.id == id && self.kind == kind && own_t1 && now_us.saturating_sub(self.t1_us) <= ANSWER_US
    }
}

/// Whether a message answers a request, of whichever host.
pub const fn is_answer(message: &Message<'_>) -> bool {
    answer_to(message).is_some()
}

/// Id, kind and T1 of the request that a message answers; T1 if it is to come back.
const fn answer_to(message: &Message<'_>) -> Option<(u32, u8, Option<[u8; 8]>)> {
    const SUBSCRIBE: u8 = Request::Subscribe { t1: [0; 8] }.kind();
    match message {
        Message::Cookie { request_id, t1, .. } => Some((*request_id, SUBSCRIBE, Some(*t1))),
        Message::Subscribed(answer) => Some((answer.request_id, SUBSCRIBE, Some(answer.t1))),
        Message::Info(info) => Some((info.request_id, Request::Info.kind(), None)),
        Message::Refused(refused) => Some((refused.request_id, refused.kind, None)),
        // Sessions never ask for these: kind 0 is no request's.
        Message::Done { request_id }
        | Message::Settings { request_id, .. }
        | Message::Absorbed { request_id, .. }
        | Message::Receiving { request_id, .. } => Some((*request_id, 0, None)),
        Message::Report(_)
        | Message::Health(_)
        | Message::ProfilePart(_)
        | Message::RawPart(_)
        | Message::Pressed(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai::wire::{Cookie, Subscribed};

    fn subscribed(request_id: u32, t1_us: u64) -> Message<'static> {
        Message::Subscribed(Subscribed {
            request_id,
            t1: t1_us.to_le_bytes(),
            t2_us: 0,
            t3_us: 0,
            lease_ms: 5000,
            subscribers: 1,
            may_control: true,
        })
    }

    #[test]
    fn f6_only_the_own_id_with_the_own_t1_answers_and_once() {
        let mut outstanding = Outstanding::default();
        outstanding.note(7, Request::Subscribe { t1: 500_u64.to_le_bytes() }, 500);
        outstanding.note(8, Request::Info, 500);
        let cookie = Message::Cookie { request_id: 8, t1: 500_u64.to_le_bytes(), cookie: Cookie([1; 8]) };
        for forged in [subscribed(6, 500), subscribed(7, 0), subscribed(8, 500), cookie] {
            assert_eq!(outstanding.consume(&forged, 600), Kind::Unasked, "{forged:?}");
        }
        assert_eq!(outstanding.kind(&subscribed(7, 500), 500 + ANSWER_US + 1), Kind::Unasked, "too late");
        assert_eq!(outstanding.consume(&subscribed(7, 500), 600), Kind::Answer);
        assert_eq!(outstanding.consume(&subscribed(7, 500), 600), Kind::Unasked, "it was answered before");
    }

    #[test]
    fn no_more_requests_than_can_be_answered_are_remembered() {
        let mut outstanding = Outstanding::default();
        for id in 0..100 {
            outstanding.note(id, Request::Info, 0);
        }
        outstanding.adopt(&outstanding.clone());
        assert_eq!(outstanding.0.len(), ASKED);
    }
}
