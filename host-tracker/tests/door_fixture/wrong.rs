//! Messages that must change nothing: malformed, late, from the future, repeated, out of order. A request to leave is
//! none of them, whatever it says.
//!
//! ```text
//!   input       number 5, taken         what would change something, if it were taken
//!   contact     shut                    open
//!   lock/taken  locked                  unlocked: the lock has never said so
//!   card        a person's              another, or the same while no card has been shown
//!   number      2, with one person      1
//! ```

use kehai_tracking::snapshot::unix_ms;
use serde_json::{Value, json};

use super::DoorServer;

/// The number of each input's message that is taken.
const TAKEN: u64 = 5;

/// An answer to an order that is over.
const OLD: &str = "what is acknowledged is not what is said now";

/// `tell` hands in a message that is taken; `refuses` one that is not, and gives the words that came back.
pub fn changes_nothing(
    server: &DoorServer,
    mut tell: impl FnMut(&str, &str),
    mut refuses: impl FnMut(&str, &str) -> String,
) {
    let stamped = |body: &Value, id: u64, at_ms: u64| {
        let mut body = body.clone();
        body["id"] = json!(id);
        body["at_ms"] = json!(at_ms);
        body.to_string()
    };
    let mut refused = |input: &str, message: &str, why: &str| {
        let before = server.still();
        let words = refuses(input, message);
        assert!(words.starts_with(why), "{input}: {message}: {words}, not {why}");
        let then = server.door()["unix_ms"].clone();
        server.waits_until("the next look", |door| door["unix_ms"] != then);
        assert_eq!(server.still(), before, "{input}: {message}: {words}");
    };
    // Before anything is taken, and again afterwards: what is refused does not count.
    let mut first = |input: &str, body: Value| {
        let now_ms = unix_ms();
        let good = stamped(&body, TAKEN, now_ms);
        for malformed in ["", "5", "null", good.trim_end_matches('}'), &good.replacen('{', "{\"x\": 1, ", 1)]
        {
            refused(input, malformed, "malformed: ");
        }
        refused(input, &json!({ "id": TAKEN, "at_ms": now_ms }).to_string(), "malformed: ");
        if input == "lock/taken" {
            // The number of the output is enough: it comes once.
            return;
        }
        refused(input, &body.to_string(), "malformed: missing field");
        refused(input, &stamped(&body, 0, now_ms), "malformed: id counts from 1");
        refused(input, &stamped(&body, TAKEN, now_ms - 60_000), "late: ");
        refused(input, &stamped(&body, TAKEN, now_ms + 60_000), "its time is ");
    };
    server.waits_for("idle");
    server.people(&[[0.0, 0.4]]);
    let locked = server.door()["lock_id"].as_u64().unwrap();
    let (shut, open) = (json!({ "contact": "shut" }), json!({ "contact": "open" }));
    let (card, other) = (json!({ "card": "04:A2" }), json!({ "card": "04:A3" }));
    let (two, one) = (json!({ "number": 2 }), json!({ "number": 1 }));
    let taken = |id: u64| json!({ "taken": id });
    first("contact", open.clone());
    first("lock/taken", taken(locked));
    first("card", card.clone());
    tell("contact", &stamped(&shut, TAKEN, unix_ms()));
    server.waits_until("the leaf is shut", |door| door["contact"] == "shut");
    tell("lock/taken", &stamped(&taken(locked), TAKEN, unix_ms()));
    server.waits_until("the lock is locked", |door| door["lock_taken"] == true);
    tell("card", &stamped(&card, TAKEN, unix_ms()));
    server.waits_for("asked");
    first("number", one.clone());
    tell("number", &stamped(&two, TAKEN, unix_ms()));
    server.waits_until("two is not one", |door| door["phase"] == "asked" && door["tries_left"] == 2);
    let mut again = |input: &str, body: &Value| {
        let now_ms = unix_ms();
        refused(input, &stamped(body, TAKEN, now_ms), "repeated: ");
        refused(input, &stamped(body, TAKEN - 1, now_ms), "out of order: ");
    };
    again("number", &one);
    again("contact", &open);
    again("card", &other);
    tell("number", &stamped(&one, TAKEN + 2, unix_ms()));
    let unlocked = server.waits_for("unlocked")["lock_id"].as_u64().unwrap();
    assert_ne!(unlocked, locked);
    refused("lock/taken", &taken(locked).to_string(), OLD);
    assert_eq!(server.door()["lock_taken"], false, "the lock has not said that it is unlocked");
    tell("lock/taken", &stamped(&taken(unlocked), TAKEN + 2, unix_ms()));
    server.waits_until("the lock is unlocked", |door| door["lock_taken"] == true);
}
