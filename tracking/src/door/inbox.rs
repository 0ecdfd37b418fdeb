//! Messages from outside to events: what is malformed, late, repeated or out of order changes nothing, and says why.
//!
//! ```text
//!   {"id": 17, "at_ms": 1700000000000, "card": "04A22B…"}     id: counts the device's messages, from 1
//!      │          └ when it was sent, ms since 1970; at most 5 s ago
//!      └ higher than the last one's; 1 again, and sent later, after the device has restarted
//! ```
//!
//! | input | payload beside `id` and `at_ms` |
//! |---|---|
//! | `card` | `"card": "…"`: only a keyed hash of it is kept |
//! | `number` | `"number": 3` |
//! | `contact` | `"contact": "open"` or `"shut"` |
//! | `exit`, `reset` | nothing |
//! | `lock/taken`, `alarm/taken` | `"taken": 12`, the number of the output |

use serde::Deserialize;

use super::event::Event;
use super::terms::{Card, Contact};

/// Older than this, or newer than the clock by more, a message is not taken, ms.
pub const LATE_MS: u64 = 5000;

/// Longest message, bytes.
pub const LONGEST: usize = 1024;

/// Longest card number, characters.
const CARD_MAX: usize = 128;

/// The inputs of a door.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Input {
    /// A card was shown.
    Card,
    /// A number was entered.
    Number,
    /// The leaf opened or shut.
    Contact,
    /// A person wants out.
    Exit,
    /// The alarm was looked after.
    Reset,
    /// The lock has taken an output.
    LockTaken,
    /// The alarm has taken an output.
    AlarmTaken,
}

impl Input {
    /// All of them by their names in topics and paths.
    pub const NAMED: [(Self, &'static str); 7] = [
        (Self::Card, "card"),
        (Self::Number, "number"),
        (Self::Contact, "contact"),
        (Self::Exit, "exit"),
        (Self::Reset, "reset"),
        (Self::LockTaken, "lock/taken"),
        (Self::AlarmTaken, "alarm/taken"),
    ];

    /// The input of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::NAMED.iter().find(|(_, known)| *known == name).map(|(input, _)| *input)
    }
}

/// Why a message is not taken.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum NotTaken {
    /// It says something else, or nothing.
    #[error("malformed: {0}")]
    Malformed(String),
    /// It was sent too long ago.
    #[error("late: it was sent {0} ms ago, at most {LATE_MS} are taken; is the sender's clock right?")]
    Late(u64),
    /// It is from the future.
    #[error("its time is {0} ms ahead of this machine's clock: set the sender's clock")]
    Ahead(u64),
    /// It came before.
    #[error("repeated: number {0} was taken already")]
    Repeated(u64),
    /// A later one came before it.
    #[error("out of order: number {id} came after number {last}")]
    OutOfOrder {
        /// Its number.
        id: u64,
        /// The last one's.
        last: u64,
    },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Message {
    id: u64,
    at_ms: u64,
    card: Option<String>,
    number: Option<u32>,
    contact: Option<Contact>,
    taken: Option<u64>,
}

/// Number and time of the newest message of each input of one door.
#[derive(Clone, Debug, Default)]
pub struct Inbox {
    last: [Option<(u64, u64)>; Input::NAMED.len()],
}

impl Inbox {
    /// The event of a message that arrived at `now_ms`, since 1970; `hash` makes of a card what may be kept of it.
    ///
    /// # Errors
    /// Why it is not taken; nothing has changed then.
    pub fn take(
        &mut self,
        input: Input,
        bytes: &[u8],
        now_ms: u64,
        hash: impl FnOnce(&str) -> Card,
    ) -> Result<Event, NotTaken> {
        let malformed = |what: &str| NotTaken::Malformed(what.to_owned());
        if bytes.len() > LONGEST {
            return Err(malformed("longer than 1024 bytes"));
        }
        let message: Message =
            serde_json::from_slice(bytes).map_err(|error| NotTaken::Malformed(error.to_string()))?;
        let Message { id, at_ms, card, number, contact, taken } = message;
        if id == 0 {
            return Err(malformed("id counts from 1"));
        }
        let event = match (input, card, number, contact, taken) {
            (Input::Card, Some(card), None, None, None) => {
                if card.trim().is_empty() || card.len() > CARD_MAX {
                    return Err(malformed("card must have 1 to 128 characters"));
                }
                Event::Card(hash(card.trim()))
            }
            (Input::Number, None, Some(number), None, None) => Event::Number(number),
            (Input::Contact, None, None, Some(contact), None) => Event::Contact(contact),
            (Input::LockTaken, None, None, None, Some(taken)) => Event::LockTaken(taken),
            (Input::AlarmTaken, None, None, None, Some(taken)) => Event::AlarmTaken(taken),
            (Input::Exit, None, None, None, None) => Event::Exit,
            (Input::Reset, None, None, None, None) => Event::Reset,
            _ => {
                return Err(malformed(
                    "beside id and at_ms it must say what its topic is about, and nothing else",
                ));
            }
        };
        if at_ms > now_ms.saturating_add(LATE_MS) {
            return Err(NotTaken::Ahead(at_ms - now_ms));
        }
        if now_ms.saturating_sub(at_ms) > LATE_MS {
            return Err(NotTaken::Late(now_ms - at_ms));
        }
        let Some(known) = self.last.get_mut(input as usize) else { return Err(malformed("no such input")) };
        if let Some((last, last_ms)) = *known {
            let begins_anew = id == 1 && at_ms > last_ms;
            if id == last && !begins_anew {
                return Err(NotTaken::Repeated(id));
            }
            if (id < last && !begins_anew) || at_ms < last_ms {
                return Err(NotTaken::OutOfOrder { id, last });
            }
        }
        *known = Some((id, at_ms));
        Ok(event)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const NOW_MS: u64 = 1_700_000_000_000;

    fn number(inbox: &mut Inbox, id: u64, at_ms: u64) -> Result<Event, NotTaken> {
        let text = format!("{{\"id\": {id}, \"at_ms\": {at_ms}, \"number\": 2}}");
        inbox.take(Input::Number, text.as_bytes(), NOW_MS, |_| Card(0))
    }

    #[test]
    fn a_message_is_taken_once_and_in_order() {
        let mut inbox = Inbox::default();
        assert_eq!(number(&mut inbox, 5, NOW_MS - 100), Ok(Event::Number(2)));
        assert_eq!(number(&mut inbox, 5, NOW_MS - 100), Err(NotTaken::Repeated(5)));
        assert_eq!(number(&mut inbox, 4, NOW_MS - 200), Err(NotTaken::OutOfOrder { id: 4, last: 5 }));
        assert_eq!(number(&mut inbox, 6, NOW_MS - 200), Err(NotTaken::OutOfOrder { id: 6, last: 5 }));
        assert_eq!(number(&mut inbox, 1, NOW_MS), Ok(Event::Number(2)), "the device has started anew");
        assert_eq!(number(&mut inbox, 1, NOW_MS), Err(NotTaken::Repeated(1)));
    }

    #[test]
    fn late_and_early_messages_are_not_taken() {
        let mut inbox = Inbox::default();
        assert_eq!(number(&mut inbox, 1, NOW_MS - 5001), Err(NotTaken::Late(5001)));
        assert_eq!(number(&mut inbox, 1, NOW_MS + 5001), Err(NotTaken::Ahead(5001)));
        assert_eq!(
            number(&mut inbox, 1, NOW_MS - 4999),
            Ok(Event::Number(2)),
            "what was refused has changed nothing"
        );
    }

    #[test]
    fn malformed_messages_say_what_is_wrong() {
        let mut inbox = Inbox::default();
        let mut said = |input, text: &str| {
            inbox.take(input, text.as_bytes(), NOW_MS, |_| Card(0)).unwrap_err().to_string()
        };
        let stamp = format!("\"id\": 1, \"at_ms\": {NOW_MS}");
        assert!(said(Input::Number, "three").starts_with("malformed: expected"));
        assert!(said(Input::Number, "{\"number\": 3}").contains("missing field `id`"));
        assert!(said(Input::Number, &format!("{{{stamp}, \"number\": -1}}")).contains("invalid value"));
        assert!(said(Input::Number, &format!("{{{stamp}, \"numbr\": 1}}")).contains("unknown field `numbr`"));
        assert!(said(Input::Number, &format!("{{{stamp}}}")).contains("must say what its topic is about"));
        assert!(said(Input::Card, &format!("{{{stamp}, \"card\": \" \"}}")).contains("1 to 128 characters"));
        assert!(
            said(Input::Contact, &format!("{{{stamp}, \"contact\": \"ajar\"}}"))
                .contains("unknown variant `ajar`")
        );
        assert!(said(Input::Exit, &" ".repeat(2000)).contains("longer than"));
        assert!(inbox.last.iter().all(Option::is_none));
    }

    proptest! {
        #[test]
        fn whatever_bytes_come_nothing_panics(bytes in proptest::collection::vec(any::<u8>(), 0..200), input in 0..7_usize) {
            let _ = Inbox::default().take(Input::NAMED[input].0, &bytes, NOW_MS, |_| Card(0));
        }
    }
}
