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
use super::payloads::Availability;
use super::topics::{State, Topics};
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
    let hides = |alarm: &ListedAlarm| {
        let is_such = matches!(alarm.cause, Cause::Fault(AlarmKind::Silent | AlarmKind::SameName));
        alarm.about == alarm_list::About::Area && is_such
    };
    !frame.alarms.iter().any(hides)
}

/// What was published, and when.
#[derive(Debug)]
pub struct Outbox {
    topics: Topics,
    about: About,
    holds: Holds,
    told: BTreeMap<String, Told>,
    /// Topics of this site that the broker holds from an earlier time, with the components of Home Assistant's devices there.
    earlier: BTreeMap<String, Removable>,
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
            self.earlier.insert(topic.to_owned(), removable(payload));
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

    /// Whether a topic is that of an alarm or a name: they are no parts of the site, and over when no frame has them.
    fn comes_and_goes(&self, topic: &str) -> bool {
        let rest = topic.strip_prefix(&self.topics.site()).unwrap_or_default();
        rest.starts_with("/alarm/") || rest.starts_with("/name/")
    }

    /// Leaves a topic as it is, of which nothing is known now; that much is said where a topic beside it says whether anything is.
    fn leave(&mut self, topic: String, parts: Removable, now_ms: u64, out: &mut Vec<Publication>) {
        let rest = topic.strip_prefix(&self.topics.site()).unwrap_or_default();
        let is_availability = rest.ends_with("/availability") && rest.matches('/').count() == 3;
        let offline = State::at_once(Availability::Offline.name().to_owned());
        let is_said = self.told.get(&topic).is_some_and(|told| told.state == offline);
        if is_availability && !is_said {
            out.push(Publication { topic: topic.clone(), payload: offline.payload.clone() });
            self.told.insert(topic, Told { state: offline, at_ms: now_ms });
        } else if !self.told.contains_key(&topic) {
            self.earlier.insert(topic, parts);
        }
    }

    fn compare(&mut self, frame: &Snapshot, now_ms: u64, out: &mut Vec<Publication>) {
        let (mut earlier, is_whole) = (std::mem::take(&mut self.earlier), is_whole(frame));
        let configs = discovery(frame, &self.about, &self.topics);
        let gone_parts = |(topic, payload): (&String, &String)| {
            let before = earlier.get(topic).cloned().unwrap_or_default();
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
                let parts = earlier.remove(&topic).unwrap_or_default();
                self.leave(topic, parts, now_ms, out);
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
mod tests {
    use super::super::messages::tests::{frame, site, topics, zone};
    use super::*;
    use kehai_tracking::jsonl::ZoneKnown;
    use serde_json::{Value, json};

    /// Of the site to which the frame's module belongs.
    fn outbox() -> Outbox {
        let mut outbox = Outbox::new(topics());
        outbox.set_about(About { site: site().into(), ..About::default() });
        outbox
    }

    fn topics_of(publications: &[Publication]) -> Vec<&str> {
        publications.iter().map(|publication| publication.topic.as_str()).collect()
    }

    #[test]
    fn a_new_broker_is_told_everything_and_then_only_what_changes() {
        let mut outbox = outbox();
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
        let mut outbox = outbox();
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
        let mut outbox = outbox();
        outbox.retained("kehai/front-door/zone/cellar", b"");
        outbox.retained("kehai/front-door/zone/hall", b"");
        outbox.retained("kehai/front-door/status", b"");
        outbox.retained("homeassistant/device/kehai_front-door_right/config", b"");
        outbox.retained("homeassistant/device/another/config", b"");
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

    /// The site's device, as it is told in one message after the other: of each component of a zone its platform, if that is all.
    fn zones_told(publications: &[Publication]) -> Vec<BTreeMap<String, Option<String>>> {
        let of_site = publications.iter().filter(|told| told.topic.ends_with("kehai_front-door/config"));
        let components = |told: &Publication| -> BTreeMap<String, Option<String>> {
            let config: Value = serde_json::from_str(&told.payload).unwrap();
            let all = config["components"].as_object().unwrap().iter();
            let is_of_zone =
                |name: &str| ["zone_hall", "zone_cellar"].iter().any(|zone| name.starts_with(zone));
            let zones = all.filter(|(name, _)| is_of_zone(name));
            let platform = |entity: &Value| entity["platform"].as_str().unwrap().to_owned();
            let gone = |entity: &Value| (entity.as_object().unwrap().len() == 1).then(|| platform(entity));
            zones.map(|(name, entity)| (name.clone(), gone(entity))).collect()
        };
        of_site.map(components).collect()
    }

    #[test]
    fn a_zone_that_is_gone_is_removed_from_home_assistant_once_also_if_no_tracker_ran_meanwhile() {
        let there = |name: &str| (name.to_owned(), None);
        let gone = |name: &str, platform: &str| (name.to_owned(), Some(platform.to_owned()));
        let hall = || [there("zone_hall_count"), there("zone_hall_occupancy")];
        let mut outbox = outbox();
        let first = outbox.due(Some(&frame()), 0);
        assert_eq!(zones_told(&first), [BTreeMap::from(hall())]);
        // The broker's answer may come after what was published over the same connection.
        let cellar = json!({ "platform": "sensor", "unique_id": "kehai_front-door_zone_cellar_count" });
        let kept = json!({ "components": { "zone_cellar_count": cellar }, "device": {} }).to_string();
        outbox.retained("homeassistant/device/kehai_front-door/config", kept.as_bytes());
        let told = outbox.due(Some(&frame()), 100);
        let parting: BTreeMap<String, Option<String>> =
            hall().into_iter().chain([gone("zone_cellar_count", "sensor")]).collect();
        assert_eq!(zones_told(&told), [parting, BTreeMap::from(hall())]);
        assert_eq!(outbox.due(Some(&frame()), 200), []);
        let mut smaller = frame();
        smaller.line.zones.remove("hall");
        let told = outbox.due(Some(&smaller), 300);
        let parting = [gone("zone_hall_count", "sensor"), gone("zone_hall_occupancy", "binary_sensor")];
        assert_eq!(zones_told(&told), [BTreeMap::from(parting), BTreeMap::new()]);
        assert_eq!(outbox.due(Some(&smaller), 400), []);
    }

    #[test]
    fn while_an_area_is_not_heard_nothing_of_the_site_is_forgotten() {
        let mut outbox = outbox();
        let (cellar, device) =
            ("kehai/front-door/zone/cellar", "homeassistant/device/kehai_front-door_right/config");
        let (over, open) = ("kehai/front-door/alarm/zone/hall/crowded", format!("{cellar}/availability"));
        [cellar, &open, device, over].iter().for_each(|topic| outbox.retained(topic, b""));
        let silent = json!({ "source": "area", "of": "west", "name": "silent", "text": "…" });
        let mut part = frame();
        part.alarms = vec![serde_json::from_value(silent).unwrap()];
        let forgotten = |told: &[Publication]| -> Vec<String> {
            told.iter().filter(|told| told.payload.is_empty()).map(|told| told.topic.clone()).collect()
        };
        let offline =
            |topic: &str| Publication { topic: format!("{topic}/availability"), payload: "offline".into() };
        let first = outbox.due(Some(&part), 0);
        assert_eq!(forgotten(&first), [over], "an alarm that is over is");
        assert!(first.contains(&offline(cellar)), "nothing is known of it: {first:?}");
        part.line.zones.remove("hall");
        let later = outbox.due(Some(&part), 100);
        assert_eq!(forgotten(&later), [""; 0]);
        assert!(later.contains(&offline("kehai/front-door/zone/hall")), "{later:?}");
        assert!(later.iter().all(|told| !told.topic.starts_with("homeassistant/")), "{later:?}");
        assert!(!outbox.due(Some(&part), 200).iter().any(|told| told.payload == "offline"), "said once");
        // All of it is heard.
        let whole = outbox.due(Some(&frame()), 300);
        let silent = "kehai/front-door/alarm/area/west/silent";
        assert_eq!(forgotten(&whole), [device, silent, cellar, &open]);
        let online = "kehai/front-door/zone/hall/availability";
        assert!(whole.iter().any(|told| told.topic == online && told.payload == "online"), "{whole:?}");
    }

    #[test]
    fn an_input_that_the_broker_keeps_is_never_published_on() {
        let mut outbox = outbox();
        let inputs = ["door/front/exit", "door/gone/lock/ready", "module/left/restart", "sign"];
        let inputs = inputs.map(|input| format!("kehai/front-door/{input}"));
        inputs.iter().for_each(|input| outbox.retained(input, b""));
        outbox.retained("kehai/front-door/zone/cellar", b"");
        let published = outbox.due(Some(&frame()), 0);
        assert!(topics_of(&published).contains(&"kehai/front-door/zone/cellar"));
        assert!(published.iter().all(|publication| !inputs.contains(&publication.topic)), "{published:?}");
    }

    #[test]
    fn a_last_will_that_comes_late_is_taken_back() {
        let mut outbox = outbox();
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
        let mut outbox = outbox();
        assert_eq!(outbox.due(None, 0), [outbox.farewell()]);
        assert_eq!(outbox.due(Some(&Snapshot::default()), 100), [], "nothing is known before the first line");
        outbox.due(Some(&frame()), 200);
        assert_eq!(outbox.due(None, 3_100), []);
        assert_eq!(outbox.due(None, 3_200), [outbox.farewell()]);
        let back = outbox.due(Some(&frame()), 9_000);
        assert_eq!(back, [Publication { topic: topics().status(), payload: "online".into() }]);
    }
}
