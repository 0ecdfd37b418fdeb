//! The devices beside the guarded doors of a scene: readers and keypads by its script, contacts by the leaf.
//!
//! ```text
//!   [[told]] at_s ──▶ card, number, reset ─╮
//!   leaf open or shut ──▶ contact ─────────┴─▶ {"id": 7, "at_ms": …, …} ─▶ the tracker's doors
//! ```

use host_sim::world::door::Door;
use host_sim::world::scene::Scene;
use host_sim::world::told::{Says, Told};
use host_tracker::daemon::Daemon;
use kehai_tracking::door::Input;
use kehai_tracking::snapshot::unix_ms;
use serde_json::{Value, json};

/// The leaf of a door is seen to be open from so much on: a contact's play.
const AJAR: f64 = 0.02;

/// The devices beside the doors of a scene.
pub struct Devices {
    /// What is still to be told, in the order of time.
    told: std::vec::IntoIter<Told>,
    next: Option<Told>,
    /// The doors that have a leaf of the same line: number of the leaf, name of the door, whether it was open.
    contacts: Vec<(Door, String, Option<bool>)>,
    /// Messages so far.
    id: u64,
}

impl Devices {
    /// Those of `scene`; they say nothing if it has no guarded door.
    pub fn of(scene: &Scene) -> Self {
        let mut told = scene.told.clone();
        told.sort_by(|one, other| one.at_s.total_cmp(&other.at_s));
        let contact = |door: &kehai_tracking::site::door::Door| {
            let leaf = scene.doors.iter().find(|leaf| leaf.line == door.line)?;
            Some((leaf.clone(), door.name.clone(), None))
        };
        let contacts = scene.site.doors.iter().filter_map(contact).collect();
        let mut told = told.into_iter();
        Self { next: told.next(), told, contacts, id: 0 }
    }

    /// Tells what is to be told up to `now_s`.
    pub fn until(&mut self, now_s: f64, daemon: &Daemon) {
        for (leaf, door, was_open) in &mut self.contacts {
            let is_open = leaf.open_share(now_s) > AJAR;
            if *was_open != Some(is_open) {
                *was_open = Some(is_open);
                let contact = if is_open { "open" } else { "shut" };
                tell(daemon, door, Input::Contact, &mut self.id, json!({ "contact": contact }));
            }
        }
        while let Some(told) = self.next.take_if(|told| told.at_s <= now_s) {
            let (input, message) = match told.says() {
                Some(Says::Card(card)) => (Input::Card, json!({ "card": card })),
                Some(Says::Number(number)) => (Input::Number, json!({ "number": number })),
                Some(Says::Reset) => (Input::Reset, json!({})),
                None => continue,
            };
            tell(daemon, &told.door, input, &mut self.id, message);
            self.next = self.told.next();
        }
    }
}

fn tell(daemon: &Daemon, door: &str, input: Input, id: &mut u64, mut message: Value) {
    *id += 1;
    message["id"] = json!(*id);
    message["at_ms"] = json!(unix_ms());
    daemon.doors().post(door, input, message.to_string().as_bytes());
}
