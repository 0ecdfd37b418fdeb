//! Topics of which nothing is known now, as an area is not heard: what is said there instead of what was said last.
//!
//! ```text
//!   kehai/SITE/zone/west-hall/availability  online             ─▶ offline
//!   kehai/SITE/door/west-front              {"phase":"idle",…} ─▶ {"phase":"failed","trouble":"no-frames",…}
//!   kehai/SITE/zone/west-hall               {"count":2,…}         stays: the topic beside it says that nothing is known
//! ```

use kehai_tracking::door::DoorLine;

use super::home_assistant::{Removable, removable};
use super::payloads::{Availability, written};
use super::topics::State;

/// Longest state of a door that is kept, bytes: names of cards are not in it.
const DOOR_MAX: usize = 4096;

/// What the broker holds of an earlier time under a topic.
#[derive(Clone, Debug, Default)]
pub(super) struct Earlier {
    /// The components of a device of Home Assistant.
    pub parts: Removable,
    /// The state of a door, as it was published; empty under any other topic.
    door: String,
}

impl Earlier {
    /// `rest` is the topic after that of the site, empty for a topic beside it.
    pub fn of(rest: &str, payload: &[u8]) -> Self {
        let text = std::str::from_utf8(payload).ok().filter(|text| is_door(rest) && text.len() <= DOOR_MAX);
        Self { parts: removable(payload), door: text.unwrap_or_default().to_owned() }
    }

    /// What is to be said while nothing is known, after `told`, if anything was told since; none: the topic stays as it is.
    pub fn unknown(&self, rest: &str, told: Option<&State>) -> Option<State> {
        if rest.ends_with("/availability") && rest.matches('/').count() == 3 {
            return Some(State::at_once(Availability::Offline.name().to_owned()));
        }
        let said = told.map_or(self.door.as_str(), |told| told.payload.as_str());
        let door: DoorLine = is_door(rest).then(|| serde_json::from_str(said).ok()).flatten()?;
        Some(State::at_once(written(&door.unheard())))
    }
}

/// Whether a topic is the state of a door, which has no availability beside it.
pub(super) fn is_door(rest: &str) -> bool {
    rest.strip_prefix("/door/").is_some_and(|door| !door.contains('/'))
}
