//! What remains to be published to a broker: what is new to it, what has changed, what is no longer true.
//!
//! ```text
//!   connected ─▶ nothing has been told      ╮
//!   frame ─────▶ states, discovery          ├─▶ what differs from what was told ─▶ publications
//!   retained ──▶ a topic of an earlier time ╯
//!                └ an input: left as it is
//! ```

use std::collections::{BTreeMap, BTreeSet};

use super::alarms;
use super::holds::Holds;
use super::home_assistant::{About, discovery};
use super::inputs::is_input;
use super::messages::states;
use super::topics::{State, Topics};
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

/// What was published, and when.
#[derive(Debug)]
pub struct Outbox {
    topics: Topics,
    about: About,
    holds: Holds,
    told: BTreeMap<String, Told>,
    /// Topics of this site that the broker holds from an earlier time.
    earlier: BTreeSet<String>,
    newest_ms: Option<u64>,
    online: Option<bool>,
}

impl Outbox {
    /// With nothing published.
    #[must_use]
    pub fn new(topics: Topics) -> Self {
        let (about, holds) = (About::default(), Holds::default());
        let (told, earlier) = (BTreeMap::new(), BTreeSet::new());
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

    /// The broker holds this topic from an earlier time. One that is an input is never published on: what makes the broker forget
    /// it comes back as a new message, and a door that is told `exit` opens.
    pub fn retained(&mut self, topic: &str) {
        if self.topics.owns(topic) && !is_input(&self.topics, topic) {
            self.earlier.insert(topic.to_owned());
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

    fn compare(&mut self, frame: &Snapshot, now_ms: u64, out: &mut Vec<Publication>) {
        let configs = discovery(frame, &self.about, &self.topics)
            .into_iter()
            .map(|(topic, payload)| (topic, State { urgent: payload.clone(), payload }));
        let mut now: BTreeMap<String, State> = configs.collect();
        // The states come first: what is discovered is there already.
        self.holds.note(frame, &self.about.site, now_ms);
        let mut states = states(frame, &self.about.site, &self.topics, &self.holds);
        states.extend(alarms::states(frame, &self.about.site, &self.topics));
        let order: Vec<String> = states.keys().chain(now.keys()).cloned().collect();
        now.extend(states);
        let status = self.topics.status();
        let earlier = std::mem::take(&mut self.earlier);
        let gone: BTreeSet<String> =
            self.told.keys().chain(&earlier).filter(|topic| !now.contains_key(*topic)).cloned().collect();
        for topic in gone.into_iter().filter(|topic| *topic != status) {
            self.told.remove(&topic);
            out.push(Publication { topic, payload: String::new() });
        }
        for topic in order {
            let Some(state) = now.remove(&topic) else { continue };
            let due = self.told.get(&topic).is_none_or(|told| {
                told.state.urgent != state.urgent
                    || (told.state != state && now_ms.saturating_sub(told.at_ms) >= FIGURES_MS)
            });
            if due {
                out.push(Publication { topic: topic.clone(), payload: state.payload.clone() });
                self.told.insert(topic, Told { state, at_ms: now_ms });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::messages::tests::{frame, topics, zone};
    use super::*;
    use kehai_tracking::jsonl::ZoneKnown;

    fn topics_of(publications: &[Publication]) -> Vec<&str> {
        publications.iter().map(|publication| publication.topic.as_str()).collect()
    }

    #[test]
    fn a_new_broker_is_told_everything_and_then_only_what_changes() {
        let mut outbox = Outbox::new(topics());
        let first = outbox.due(Some(&frame()), 0);
        assert_eq!(first.len(), 6 + 3 + 1 + 2 + 1);
        assert_eq!(first.last(), Some(&Publication { topic: topics().status(), payload: "online".into() }));
        assert_eq!(outbox.due(Some(&frame()), 100), []);
        let mut changed = frame();
        changed.line.zones.insert("hall".into(), zone(3, ZoneKnown::Known));
        assert_eq!(topics_of(&outbox.due(Some(&changed), 200)), ["kehai/front-door/zone/hall"]);
        outbox.connected();
        let again = outbox.due(Some(&changed), 300);
        assert_eq!(again.len(), first.len());
        assert!(again.iter().any(|told| told.payload.contains("\"count\":3")));
    }

    #[test]
    fn figures_wait_but_a_state_or_an_alarm_does_not() {
        let mut outbox = Outbox::new(topics());
        let mut frame = frame();
        outbox.due(Some(&frame), 0);
        frame.modules[0].scans_hz = 9.7;
        for now_ms in (100..FIGURES_MS).step_by(100) {
            assert_eq!(outbox.due(Some(&frame), now_ms), []);
        }
        assert_eq!(topics_of(&outbox.due(Some(&frame), FIGURES_MS)), ["kehai/front-door/module/left"]);
        frame.modules[0].state = kehai_tracking::snapshot::DeviceState::Learning;
        assert_eq!(topics_of(&outbox.due(Some(&frame), FIGURES_MS + 100)), ["kehai/front-door/module/left"]);
    }

    #[test]
    fn what_is_gone_from_the_site_or_was_left_by_an_earlier_one_is_forgotten() {
        let mut outbox = Outbox::new(topics());
        outbox.retained("kehai/front-door/zone/cellar");
        outbox.retained("kehai/front-door/zone/hall");
        outbox.retained("kehai/front-door/status");
        outbox.retained("homeassistant/device/kehai_front-door_right/config");
        outbox.retained("homeassistant/device/another/config");
        let first = outbox.due(Some(&frame()), 0);
        let empty: Vec<&Publication> = first.iter().filter(|told| told.payload.is_empty()).collect();
        let forgotten: Vec<&str> = empty.iter().map(|told| told.topic.as_str()).collect();
        assert_eq!(
            forgotten,
            ["homeassistant/device/kehai_front-door_right/config", "kehai/front-door/zone/cellar"]
        );
        let mut smaller = frame();
        smaller.line.zones.remove("hall");
        let told = outbox.due(Some(&smaller), 100);
        let empty: Vec<&Publication> = told.iter().filter(|told| told.payload.is_empty()).collect();
        let forgotten: Vec<&str> = empty.iter().map(|told| told.topic.as_str()).collect();
        assert_eq!(forgotten, ["kehai/front-door/zone/hall", "kehai/front-door/zone/hall/availability"]);
        assert!(told.iter().any(|told| told.topic.ends_with("kehai_front-door/config") && !told.payload.contains("hall")));
    }

    #[test]
    fn an_input_that_the_broker_keeps_is_never_published_on() {
        let mut outbox = Outbox::new(topics());
        let inputs = ["door/front/exit", "door/gone/lock/ready", "module/left/restart", "sign"];
        let inputs = inputs.map(|input| format!("kehai/front-door/{input}"));
        inputs.iter().for_each(|input| outbox.retained(input));
        outbox.retained("kehai/front-door/zone/cellar");
        let published = outbox.due(Some(&frame()), 0);
        assert!(topics_of(&published).contains(&"kehai/front-door/zone/cellar"));
        assert!(published.iter().all(|publication| !inputs.contains(&publication.topic)), "{published:?}");
    }

    #[test]
    fn a_last_will_that_comes_late_is_taken_back() {
        let mut outbox = Outbox::new(topics());
        let online = Publication { topic: topics().status(), payload: "online".into() };
        assert_eq!(outbox.due(Some(&frame()), 0).last(), Some(&online));
        outbox.said_offline();
        assert_eq!(outbox.due(Some(&frame()), 100), [online]);
        assert_eq!(outbox.due(None, 3_100), [outbox.farewell()]);
        outbox.said_offline();
        assert_eq!(outbox.due(None, 3_200), [], "so it is");
    }

    #[test]
    fn without_frames_everything_is_offline_and_with_the_next_it_is_back() {
        let mut outbox = Outbox::new(topics());
        assert_eq!(outbox.due(None, 0), [outbox.farewell()]);
        assert_eq!(outbox.due(Some(&Snapshot::default()), 100), [], "nothing is known before the first line");
        outbox.due(Some(&frame()), 200);
        assert_eq!(outbox.due(None, 3_100), []);
        assert_eq!(outbox.due(None, 3_200), [outbox.farewell()]);
        let back = outbox.due(Some(&frame()), 9_000);
        assert_eq!(back, [Publication { topic: topics().status(), payload: "online".into() }]);
    }
}
