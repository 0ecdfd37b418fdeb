//! Recent answers: a repeated request gets the same answer and is not carried out twice.

use core::net::SocketAddrV4;

use crate::seal::Holder;
use crate::wire::{Incoming, Message, Refusal};

/// Answers kept: two for each of four hosts.
const KEPT: usize = 8;

/// An answer that can be kept.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Answer {
    /// None yet; it comes when something is stored.
    Pending,
    Done,
    /// These became background.
    Absorbed {
        beams: u16,
        /// The version from now on.
        background_version: u16,
    },
    Refused(Refusal),
}

/// Which request: by its sender, its kind and its number.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct RequestKey {
    /// The host that sent it.
    pub from: SocketAddrV4,
    pub kind: u8,
    /// Its number, chosen by the sender.
    pub request_id: u32,
    /// By which right it was asked: an answer leaves as its request came, sealed or in clear.
    pub by: Holder,
}

impl RequestKey {
    /// Of a request as it came.
    #[must_use]
    pub(crate) const fn of(from: SocketAddrV4, by: Holder, incoming: &Incoming<'_>) -> Self {
        Self { from, kind: incoming.header.kind, request_id: incoming.request_id, by }
    }
}

impl Answer {
    /// The message to `to`; none while it is pending.
    #[must_use]
    pub(crate) const fn message(self, to: RequestKey) -> Option<Message<'static>> {
        let RequestKey { request_id, kind, .. } = to;
        Some(match self {
            Self::Pending => return None,
            Self::Done => Message::Done { request_id },
            Self::Absorbed { beams, background_version } => {
                Message::Absorbed { request_id, beams, background_version }
            }
            Self::Refused(refusal) => Message::Refused(crate::wire::Refused { request_id, kind, refusal }),
        })
    }
}
#[derive(Clone, Debug)]
pub(crate) struct Answers {
    kept: [Option<(RequestKey, Answer)>; KEPT],
    next: usize,
}

impl Answers {
    #[must_use]
    pub(crate) const fn new() -> Self {
        Self { kept: [None; KEPT], next: 0 }
    }

    /// What this request was answered, if it came before.
    #[must_use]
    pub(crate) fn of(&self, request: RequestKey) -> Option<Answer> {
        self.kept.iter().flatten().find(|(key, _)| *key == request).map(|(_, answer)| *answer)
    }

    /// Keeps an answer, or changes it; the oldest one gives way.
    pub(crate) fn keep(&mut self, request: RequestKey, answer: Answer) {
        if let Some((_, kept)) = self.kept.iter_mut().flatten().find(|(key, _)| *key == request) {
            *kept = answer;
            return;
        }
        if let Some(slot) = self.kept.get_mut(self.next) {
            *slot = Some((request, answer));
        }
        self.next = (self.next + 1) % KEPT;
    }
}

impl Default for Answers {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seal::Role;
    use core::net::Ipv4Addr;

    #[test]
    fn the_newest_eight_are_kept_and_told_apart_by_sender_kind_and_number() {
        let from = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 1);
        let key = |request_id| RequestKey { from, kind: 5, request_id, by: Holder::Nothing };
        let mut answers = Answers::new();
        (0..10).for_each(|id| answers.keep(key(id), Answer::Refused(Refusal::Unknown(id as u8))));
        assert_eq!(answers.of(key(1)), None);
        assert_eq!(answers.of(key(2)), Some(Answer::Refused(Refusal::Unknown(2))));
        assert_eq!(answers.of(RequestKey { kind: 6, ..key(9) }), None);
        assert_eq!(answers.of(RequestKey { by: Holder::Key(Role::Control), ..key(9) }), None);
        assert_eq!(
            answers.of(RequestKey { from: SocketAddrV4::new(Ipv4Addr::LOCALHOST, 2), ..key(9) }),
            None
        );
        answers.keep(key(9), Answer::Done);
        assert_eq!((answers.of(key(9)), answers.of(key(2)).is_some()), (Some(Answer::Done), true));
    }
}
