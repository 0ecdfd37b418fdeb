//! Messages from outside to events: what is malformed, late, repeated or out of order changes nothing, and says why.
//!
//! ```text
//!   {"id": 17, "boot": 9041, "at_ms": 1700000000000, "card": "04A22B…"}     id: counts the device's messages, from 1
//!      │         │              └ when it was sent, ms since 1970; at most 5 s ago or ahead
//!      │         └ optional: any number that the device makes at its start; each counts for itself
//!      └ higher than the last one's; 1 again, and sent later, after a device without `boot` has restarted
//! ```
//!
//! | input | payload |
//! |---|---|
//! | `card` | `id`, `at_ms`, `"card": "…"`: only a keyed hash of it is kept |
//! | `number` | `id`, `at_ms`, `"number": 3` |
//! | `contact` | `id`, `at_ms`, `"contact": "open"` or `"shut"` |
//! | `reset` | `id`, `at_ms` |
//! | `exit` | anything, or nothing: the way out depends on no clock and on no counter |
//! | `lock/ready` | `"nonce": 41`, a number of the lock's own, another each time |
//! | `lock/taken`, `alarm/taken` | `"taken": 12`, the number of the output, which comes once |
//!
//! A number that is far ahead stops a device for ten seconds at most: what is older than that is late by its stamp.

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::Deserialize;
use serde_json::{Value, json};

use super::event::Event;
use super::terms::{Card, Contact, Nonce};
use crate::now::Now;

/// Older than this, or newer than the clock by more, a message is not taken, ms.
pub const LATE_MS: u64 = 5000;

/// The number of a message is remembered for so long, s, however the wall clock is set meanwhile: later, its stamp alone tells that
/// it is old.
const REMEMBERED_S: f64 = 2e-3 * LATE_MS as f64;

/// Starts of devices that are told apart, for each input.
const BOOTS_MAX: usize = 8;

/// Longest message, bytes.
pub const LONGEST: usize = 1024;

/// Longest card number, characters.
const CARD_MAX: usize = 128;

/// What a message may say of itself, whatever it is about.
const STAMP: [&str; 3] = ["id", "boot", "at_ms"];

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
    /// The lock is there, and waits for an order.
    LockReady,
    /// The lock has taken an output.
    LockTaken,
    /// The alarm has taken an output.
    AlarmTaken,
}

impl Input {
    /// All of them by their names in topics and paths.
    pub const NAMED: [(Self, &'static str); 8] = [
        (Self::Card, "card"),
        (Self::Number, "number"),
        (Self::Contact, "contact"),
        (Self::Exit, "exit"),
        (Self::Reset, "reset"),
        (Self::LockReady, "lock/ready"),
        (Self::LockTaken, "lock/taken"),
        (Self::AlarmTaken, "alarm/taken"),
    ];

    /// The input of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::NAMED.iter().find(|(_, known)| *known == name).map(|(input, _)| *input)
    }

    /// What its message must say; beside that, it may have a stamp.
    #[must_use]
    pub const fn fields(self) -> &'static [&'static str] {
        match self {
            Self::Card => &["id", "at_ms", "card"],
            Self::Number => &["id", "at_ms", "number"],
            Self::Contact => &["id", "at_ms", "contact"],
            Self::Reset => &["id", "at_ms"],
            Self::LockReady => &["nonce"],
            Self::LockTaken | Self::AlarmTaken => &["taken"],
            Self::Exit => &[],
        }
    }

    /// The schema of its message. A request to leave is taken whatever it says.
    #[must_use]
    pub fn schema(self, generator: &mut SchemaGenerator) -> Schema {
        if self == Self::Exit {
            return Schema::default();
        }
        let fields = self.fields();
        let mut schema = Message::json_schema(generator);
        schema.insert("required".to_owned(), json!(fields));
        if let Some(Value::Object(known)) = schema.get_mut("properties") {
            known.retain(|name, _| fields.contains(&name.as_str()) || STAMP.contains(&name.as_str()));
            for (name, property) in known.iter_mut().filter(|(name, _)| fields.contains(&name.as_str())) {
                *property = required(name, property.take());
            }
        }
        schema
    }
}

/// The schema of a field that is never left out nor null.
fn required(name: &str, mut property: Value) -> Value {
    if let Some(either) = property.get("anyOf").and_then(|either| either.get(0)).cloned() {
        property["$ref"] = either["$ref"].clone();
        if let Some(property) = property.as_object_mut() {
            property.remove("anyOf");
        }
    } else {
        property["type"] = property["type"][0].clone();
    }
    if name == "id" {
        property["minimum"] = json!(1);
    }
    property
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

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Message {
    /// Counts the device's messages, from 1.
    id: Option<u64>,
    /// Any number that the device makes at its start; messages count for each by themselves.
    boot: Option<u64>,
    /// When it was sent, ms since 1970; at most 5 s ago or ahead.
    at_ms: Option<u64>,
    /// The card's number, 1 to 128 characters: only a keyed hash of it is kept.
    #[schemars(length(min = 1, max = 128))]
    card: Option<String>,
    /// How many people go in.
    number: Option<u32>,
    /// How the leaf is.
    contact: Option<Contact>,
    /// A number of the lock's own, another each time.
    nonce: Option<Nonce>,
    /// The number of the output that was taken.
    taken: Option<u64>,
}

/// The newest message of one start of a device.
#[derive(Clone, Copy, Debug)]
struct Newest {
    boot: Option<u64>,
    id: u64,
    at_ms: u64,
    /// When it came, s on the steady clock.
    came_s: f64,
}

/// The newest messages of each input of one door.
#[derive(Clone, Debug, Default)]
pub struct Inbox {
    newest: [Vec<Newest>; Input::NAMED.len()],
}

impl Inbox {
    /// The event of a message that arrived now; `hash` makes of a card what may be kept of it.
    ///
    /// # Errors
    /// Why it is not taken; nothing has changed then. A request to leave always is.
    pub fn read(
        &mut self,
        input: Input,
        bytes: &[u8],
        now: Now,
        hash: impl FnOnce(&str) -> Card,
    ) -> Result<Event, NotTaken> {
        if input == Input::Exit {
            return Ok(Event::Exit);
        }
        if bytes.len() > LONGEST {
            return Err(malformed("longer than 1024 bytes"));
        }
        let message: Message =
            serde_json::from_slice(bytes).map_err(|error| NotTaken::Malformed(error.to_string()))?;
        let Message { id, boot, at_ms, card, number, contact, nonce, taken } = message;
        let event = match (input, card, number, contact, nonce, taken) {
            (Input::LockReady, None, None, None, Some(nonce), None) => return Ok(Event::LockReady(nonce)),
            (Input::LockTaken, None, None, None, None, Some(taken)) => return Ok(Event::LockTaken(taken)),
            (Input::AlarmTaken, None, None, None, None, Some(taken)) => return Ok(Event::AlarmTaken(taken)),
            (Input::Card, Some(card), None, None, None, None) => {
                if !card.contains(char::is_alphanumeric) || card.chars().count() > CARD_MAX {
                    let why = "card must have 1 to 128 characters, a letter or a digit among them";
                    return Err(malformed(why));
                }
                Event::Card(hash(card.trim()))
            }
            (Input::Number, None, Some(number), None, None, None) => Event::Number(number),
            (Input::Contact, None, None, Some(contact), None, None) => Event::Contact(contact),
            (Input::Reset, None, None, None, None, None) => Event::Reset,
            _ => return Err(malformed("it must say what its topic is about, and nothing else")),
        };
        let id = id.ok_or_else(|| malformed("missing field `id`"))?;
        let at_ms = at_ms.ok_or_else(|| malformed("missing field `at_ms`"))?;
        if id == 0 {
            return Err(malformed("id counts from 1"));
        }
        let Now { steady_s: came_s, unix_ms: now_ms } = now;
        if at_ms > now_ms.saturating_add(LATE_MS) {
            return Err(NotTaken::Ahead(at_ms - now_ms));
        }
        if now_ms.saturating_sub(at_ms) > LATE_MS {
            return Err(NotTaken::Late(now_ms - at_ms));
        }
        let Some(newest) = self.newest.get_mut(input as usize) else {
            return Err(malformed("no such input"));
        };
        note(newest, Newest { boot, id, at_ms, came_s })?;
        Ok(event)
    }
}

/// Notes a message, if it is newer than those of its device's start.
fn note(newest: &mut Vec<Newest>, message: Newest) -> Result<(), NotTaken> {
    let Newest { boot, id, at_ms, came_s } = message;
    newest.retain(|known| came_s - known.came_s <= REMEMBERED_S);
    let place = newest.iter().position(|known| known.boot == boot);
    if let Some(known) = place.and_then(|place| newest.get(place)) {
        let begins_anew = boot.is_none() && id == 1 && at_ms > known.at_ms;
        if id == known.id && !begins_anew {
            return Err(NotTaken::Repeated(id));
        }
        if (id < known.id && !begins_anew) || at_ms < known.at_ms {
            return Err(NotTaken::OutOfOrder { id, last: known.id });
        }
    }
    if let Some(place) = place {
        newest.remove(place);
    } else if newest.len() >= BOOTS_MAX {
        newest.remove(0);
    }
    newest.push(message);
    Ok(())
}

fn malformed(what: &str) -> NotTaken {
    NotTaken::Malformed(what.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const NOW_MS: u64 = 1_700_000_000_000;
    const NOW: Now = now(NOW_MS);

    const fn now(unix_ms: u64) -> Now {
        Now { steady_s: (unix_ms - NOW_MS) as f64 * 1e-3, unix_ms }
    }

    fn number(inbox: &mut Inbox, id: u64, at_ms: u64) -> Result<Event, NotTaken> {
        let text = format!("{{\"id\": {id}, \"at_ms\": {at_ms}, \"number\": 2}}");
        inbox.read(Input::Number, text.as_bytes(), NOW, |_| Card(0))
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
    fn a_message_is_not_taken_again_after_the_clock_was_set_back() {
        let mut inbox = Inbox::default();
        let mut take = |id: u64, steady_s: f64, unix_ms: u64, at_ms: u64| {
            let text = format!("{{\"id\": {id}, \"at_ms\": {at_ms}, \"number\": 2}}");
            inbox.read(Input::Number, text.as_bytes(), Now { steady_s, unix_ms }, |_| Card(0))
        };
        assert_eq!(take(3, 100.0, NOW_MS, NOW_MS), Ok(Event::Number(2)));
        assert_eq!(take(5, 120.0, NOW_MS + 20_000, NOW_MS + 20_000), Ok(Event::Number(2)));
        assert_eq!(take(3, 121.0, NOW_MS + 1000, NOW_MS), Err(NotTaken::OutOfOrder { id: 3, last: 5 }));
    }

    #[test]
    fn malformed_messages_say_what_is_wrong() {
        let mut inbox = Inbox::default();
        let mut said =
            |input, text: &str| inbox.read(input, text.as_bytes(), NOW, |_| Card(0)).unwrap_err().to_string();
        let stamp = format!("\"id\": 1, \"at_ms\": {NOW_MS}");
        assert!(said(Input::Number, "three").starts_with("malformed: expected"));
        assert!(said(Input::Number, "{\"number\": 3}").contains("missing field `id`"));
        assert!(said(Input::Number, &format!("{{{stamp}, \"number\": -1}}")).contains("invalid value"));
        assert!(said(Input::Number, &format!("{{{stamp}, \"numbr\": 1}}")).contains("unknown field `numbr`"));
        assert!(said(Input::Number, &format!("{{{stamp}}}")).contains("must say what its topic is about"));
        assert!(said(Input::Card, &format!("{{{stamp}, \"card\": \" \"}}")).contains("1 to 128 characters"));
        assert!(said(Input::Card, &format!("{{{stamp}, \"card\": \"##\"}}")).contains("a letter or a digit"));
        assert!(
            said(Input::Contact, &format!("{{{stamp}, \"contact\": \"ajar\"}}"))
                .contains("unknown variant `ajar`")
        );
        assert!(said(Input::Reset, &" ".repeat(2000)).contains("longer than"));
        assert!(inbox.newest.iter().all(Vec::is_empty));
    }

    #[test]
    fn the_length_of_a_card_is_in_characters() {
        let mut inbox = Inbox::default();
        let mut read = |length: usize| {
            let card = "鍵".repeat(length);
            let text = format!("{{\"id\": 1, \"at_ms\": {NOW_MS}, \"card\": \"{card}\"}}");
            inbox.read(Input::Card, text.as_bytes(), NOW, |_| Card(7))
        };
        let refused = read(CARD_MAX + 1).unwrap_err().to_string();
        assert!(refused.contains("1 to 128 characters"), "{refused}");
        assert_eq!(read(CARD_MAX), Ok(Event::Card(Card(7))));
    }

    #[test]
    fn f10_the_way_out_depends_on_no_clock_and_no_counter() {
        let mut inbox = Inbox::default();
        let stamps = [
            "{\"id\": 18446744073709551615, \"at_ms\": 1700000000000}",
            "{\"id\": 2, \"at_ms\": 1}",
            "{\"id\": 1, \"at_ms\": 9999999999999}",
            "pressed",
            "",
        ];
        for bytes in stamps {
            assert_eq!(
                inbox.read(Input::Exit, bytes.as_bytes(), NOW, |_| Card(0)),
                Ok(Event::Exit),
                "{bytes}"
            );
        }
    }

    #[test]
    fn f10_a_number_far_ahead_stops_no_device_that_says_its_start_and_no_other_for_long() {
        let mut inbox = Inbox::default();
        let mut take = |boot: &str, id: u64, now_ms: u64| {
            let text = format!("{{{boot}\"id\": {id}, \"at_ms\": {now_ms}, \"contact\": \"open\"}}");
            inbox.read(Input::Contact, text.as_bytes(), now(now_ms), |_| Card(0))
        };
        let open = Ok(Event::Contact(Contact::Open));
        assert_eq!(take("", u64::MAX, NOW_MS), open);
        assert_eq!(take("", 17, NOW_MS + 500), Err(NotTaken::OutOfOrder { id: 17, last: u64::MAX }));
        assert_eq!(take("\"boot\": 9041, ", 17, NOW_MS + 500), open, "another count");
        assert_eq!(take("\"boot\": 9041, ", 17, NOW_MS + 600), Err(NotTaken::Repeated(17)));
        assert_eq!(take("\"boot\": 9042, ", 1, NOW_MS + 700), open, "the device has started anew");
        assert_eq!(take("", 18, NOW_MS + 10_501), open, "what was far ahead is forgotten");
    }

    proptest! {
        #[test]
        fn whatever_bytes_come_nothing_panics(bytes in proptest::collection::vec(any::<u8>(), 0..200), input in 0..8_usize) {
            let _ = Inbox::default().read(Input::NAMED[input].0, &bytes, NOW, |_| Card(0));
        }
    }
}
