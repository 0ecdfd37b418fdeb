//! What remains to be published to a broker: what is new to it, what has changed, what is no longer true.
//!
//! ```text
//!   connected ─▶ nothing has been told      ╮
//!   frame ─────▶ states, discovery          ├─▶ what differs from what was told ─▶ publications
//!   retained ──▶ a topic of an earlier time ╯
//!                └ an input: left as it is
//! ```
//!
//! Of a device of Home Assistant that has lost components two messages go out: one that removes them, and what stays.

use std::collections::{BTreeMap, BTreeSet};

use super::alarms;
use super::holds::Holds;
use super::home_assistant::{About, Removable, discovery, parting, removable};
use super::inputs::is_input;
use super::messages::states;
use super::topics::{State, Topics};
use super::unheard::{Earlier, is_door};
use kehai_tracking::alarm::{AlarmKind, Cause};
use kehai_tracking::alarm_list::{self, ListedAlarm};
use kehai_tracking::snapshot::{STALE_MS, Snapshot};

/// Least time between two publications of figures that change all the time, ms.
const FIGURES_MS: u64 = 10_000;

/// To be published, retained. An empty payload makes the broker forget the topic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Publication {
    /// Where.
    pub topic: String,
    /// What.
    pub payload: String,
}

#[derive(Clone, Debug)]
struct Told {
    state: State,
    at_ms: u64,
}

/// Whether a frame has all of the site. While an area is not heard or has not said its site, or two trackers take turns in its name,
/// what the frame does not have is not known to be gone.
fn is_whole(frame: &Snapshot) -> bool {
    !has_alarm_of_area(frame, AlarmKind::Silent) && !has_alarm_of_area(frame, AlarmKind::SameName)
}

fn has_alarm_of_area(frame: &Snapshot, kind: AlarmKind) -> bool {
    let is_it =
        |alarm: &ListedAlarm| alarm.about == alarm_list::About::Area && alarm.cause == Cause::Fault(kind);
    frame.alarms.iter().any(is_it)
}

/// What was published, and when.
#[derive(Debug)]
pub struct Outbox {
    topics: Topics,
    about: About,
    holds: Holds,
    told: BTreeMap<String, Told>,
    /// Topics of this site that the broker holds from an earlier time.
    earlier: BTreeMap<String, Earlier>,
    newest_ms: Option<u64>,
    online: Option<bool>,
}

impl Outbox {
    /// With nothing published.
    #[must_use]
    pub fn new(topics: Topics) -> Self {
        let (about, holds) = (About::default(), Holds::default());
        let (told, earlier) = (BTreeMap::new(), BTreeMap::new());
        Self { topics, about, holds, told, earlier, newest_ms: None, online: None }
    }

    /// Tells Home Assistant from now on also what no frame says.
    pub fn set_about(&mut self, about: About) {
        self.about = about;
    }

    /// Where everything goes.
    #[must_use]
    pub const fn topics(&self) -> &Topics {
        &self.topics
    }

    /// A broker that may know nothing.
    pub fn connected(&mut self) {
        self.told.clear();
        self.earlier.clear();
        self.online = None;
    }

    /// The broker holds this message from an earlier time. A topic that is an input is never published on: what makes the broker forget
    /// it comes back as a new message, and a door that is told `exit` opens.
    pub fn retained(&mut self, topic: &str, payload: &[u8]) {
        if self.topics.owns(topic) && !is_input(&self.topics, topic) {
            self.earlier.insert(topic.to_owned(), Earlier::of(self.rest(topic), payload));
        }
    }

    /// The broker has said that this tracker is offline: the last will of a connection before, which it noticed late, or the last words of
    /// another tracker under the same topics. If that is not so it is said anew.
    pub fn said_offline(&mut self) {
        self.online = self.online.filter(|online| !online);
    }

    /// What is to be published at `now_ms` of any steady clock. `frame` is a new one, if there is one.
    pub fn due(&mut self, frame: Option<&Snapshot>, now_ms: u64) -> Vec<Publication> {
        let mut out = Vec::new();
        if let Some(frame) = frame.filter(|frame| frame.unix_ms != 0) {
            self.newest_ms = Some(now_ms);
            self.compare(frame, now_ms, &mut out);
        }
        let fresh = self.newest_ms.is_some_and(|newest_ms| now_ms.saturating_sub(newest_ms) < STALE_MS);
        // The status is online only when everything has been published once.
        let online = fresh && !self.told.is_empty();
        if self.online != Some(online) {
            self.online = Some(online);
            let payload = if online { "online" } else { "offline" }.to_owned();
            out.push(Publication { topic: self.topics.status(), payload });
        }
        out
    }

    /// That nothing more will come.
    #[must_use]
    pub fn farewell(&self) -> Publication {
        Publication { topic: self.topics.status(), payload: "offline".to_owned() }
    }

    /// What removes components of a device that were told, or that the broker held `before`, and that `payload` names no more.
    fn parting(&self, topic: &str, payload: &str, mut before: Removable) -> Option<String> {
        let told = self.told.get(topic).filter(|told| told.state.payload != payload);
        before.extend(told.map(|told| removable(told.state.payload.as_bytes())).unwrap_or_default());
        parting(payload, before)
    }

    /// The topic after that of the site; empty for a topic beside it.
    fn rest<'a>(&self, topic: &'a str) -> &'a str {
        topic.strip_prefix(&self.topics.site()).unwrap_or_default()
    }

    /// Whether a topic is that of an alarm or a name: they are no parts of the site, and over when no frame has them.
    fn comes_and_goes(&self, topic: &str) -> bool {
        let rest = self.rest(topic);
        rest.starts_with("/alarm/") || rest.starts_with("/name/")
    }

    /// Leaves a topic as it is, of which nothing is known now; that much is said where there is a word for it.
    fn leave(&mut self, topic: String, earlier: Earlier, now_ms: u64, out: &mut Vec<Publication>) {
        let told = self.told.get(&topic).map(|told| &told.state);
        let unknown = earlier.unknown(self.rest(&topic), told);
        match unknown.filter(|unknown| told != Some(unknown)) {
            Some(state) => {
                out.push(Publication { topic: topic.clone(), payload: state.payload.clone() });
                self.told.insert(topic, Told { state, at_ms: now_ms });
            }
            None if told.is_none() => _ = self.earlier.insert(topic, earlier),
            None => {}
        }
    }

    fn compare(&mut self, frame: &Snapshot, now_ms: u64, out: &mut Vec<Publication>) {
        let (mut earlier, is_whole) = (std::mem::take(&mut self.earlier), is_whole(frame));
        let is_silent = has_alarm_of_area(frame, AlarmKind::Silent);
        let configs = discovery(frame, &self.about, &self.topics);
        let gone_parts = |(topic, payload): (&String, &String)| {
            let before = earlier.get(topic).map(|earlier| earlier.parts.clone()).unwrap_or_default();
            Some((topic.clone(), self.parting(topic, payload, before)?))
        };
        let mut partings: BTreeMap<String, String> = configs.iter().filter_map(gone_parts).collect();
        let at_once = |(topic, payload)| (topic, State::at_once(payload));
        let mut now: BTreeMap<String, State> = configs.into_iter().map(at_once).collect();
        // The states come first: what is discovered is there already.
        self.holds.note(frame, &self.about.site, now_ms);
        let mut states = states(frame, &self.about.site, &self.topics, &self.holds);
        states.extend(alarms::states(frame, &self.about.site, &self.topics));
        let order: Vec<String> = states.keys().chain(now.keys()).cloned().collect();
        now.extend(states);
        let status = self.topics.status();
        let known = self.told.keys().chain(earlier.keys());
        let gone: BTreeSet<String> = known.filter(|topic| !now.contains_key(*topic)).cloned().collect();
        for topic in gone.into_iter().filter(|topic| *topic != status) {
            if !is_whole && !self.comes_and_goes(&topic) {
                // While two trackers take turns in one area's name, the one without this door knows nothing of it: the other one tells it.
                if !is_silent && is_door(self.rest(&topic)) && self.told.contains_key(&topic) {
                    continue;
                }
                let before = earlier.remove(&topic).unwrap_or_default();
                self.leave(topic, before, now_ms, out);
                continue;
            }
            self.told.remove(&topic);
            out.push(Publication { topic, payload: String::new() });
        }
        for topic in order {
            let Some(state) = now.remove(&topic) else { continue };
            let parting = partings.remove(&topic);
            if parting.is_some() && !is_whole {
                // The device stays as it was told: what it lacks may be there all the same.
                self.earlier.extend(earlier.remove_entry(&topic));
                continue;
            }
            let due = self.told.get(&topic).is_none_or(|told| {
                told.state.urgent != state.urgent
                    || (told.state != state && now_ms.saturating_sub(told.at_ms) >= FIGURES_MS)
            });
            // What the broker is to keep comes last.
            let due = due || parting.is_some();
            out.extend(parting.map(|payload| Publication { topic: topic.clone(), payload }));
            if due {
                out.push(Publication { topic: topic.clone(), payload: state.payload.clone() });
                self.told.insert(topic, Told { state, at_ms: now_ms });
            }
        }
    }
}

#[cfg(test)]
mod tests;
