//! The surfaces of now: what each says of the newest snapshot.
//!
//! ```text
//!   Snapshot ─┬─▶ frames     WebSocket, GET /api/state, lines of --tracks-out
//!             ├─▶ metrics    GET /metrics
//!             ├─▶ MQTT       what the broker keeps, and what Home Assistant makes of it
//!             └─▶ reasons    GET /api/explain
//! ```

use std::collections::BTreeMap;
use std::sync::Arc;

use host_tracker::mqtt::{About, Outbox, Publication, Topics};
use kehai_tracking::explain::words::words;
use kehai_tracking::explain::{Question, Reasons, explain};
use kehai_tracking::site::Site;
use kehai_tracking::site_tracker::SiteTracker;
use kehai_tracking::snapshot::Snapshot;
use serde_json::Value;

use super::judge::{Judge, When};
use super::truth::{HOLDS_MS, Truth, What};

/// What a template of Home Assistant makes of a payload, in words of ours.
const COUNT: &str = "{{ value_json.count }}";
const OCCUPIED: &str =
    "{{ 'None' if value_json.occupied is none else 'ON' if value_json.occupied else 'OFF' }}";

/// Zones and total of a frame, or of a line, as JSON.
pub fn frame(judge: &mut Judge, surface: &'static str, frame: &Value, when: When<'_>) {
    for (name, zone) in frame["zones"].as_object().unwrap() {
        let has_p_of_nobody = zone["p"].as_array().is_some_and(|p| p.len() == 1);
        if zone["count"] == 0 || zone["count"].is_null() && has_p_of_nobody {
            judge.empty(surface, &What::Zone(name.clone()), when, &zone.to_string());
        }
    }
    if frame["total"]["count"] == 0 {
        judge.empty(surface, &What::Total, when, &frame["total"].to_string());
    }
}

/// The metrics.
pub fn metrics(judge: &mut Judge, truth: &Truth, text: &str) {
    const SURFACE: &str = "metrics";
    let when = When::At(truth.newest());
    let mut tracks = Vec::new();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let Some((name, value)) = line.rsplit_once(' ') else { continue };
        let label = |metric: &str| name.strip_prefix(metric)?.strip_prefix('{')?.strip_suffix('}');
        if let Some(zone) = label("kehai_zone_people").and_then(|label| label.strip_prefix("zone=")) {
            if value.parse() == Ok(0.0) {
                let what = What::Zone(zone.trim_matches('"').to_owned());
                judge.empty(SURFACE, &what, when, line);
            }
        } else if label("kehai_tracks").is_some_and(|label| !label.contains("tentative")) {
            tracks.push(value.parse() == Ok(0.0));
        }
    }
    // Their sum is how many people are followed.
    if !tracks.is_empty() && tracks.iter().all(|is_none| *is_none) {
        judge.empty("metrics, sum of tracks", &What::Total, when, "kehai_tracks 0");
    }
}

/// Why figures are what they are.
pub fn reasons(judge: &mut Judge, truth: &Truth, site_tracker: &SiteTracker, site: &Site, t_s: f64) {
    for zone in &site.zones {
        let facts = site_tracker.facts(&Question::Zone(zone.name.clone()), t_s);
        let Some(reasons) = explain(facts) else { continue };
        let told = words(&reasons);
        let Reasons::Zone(of) = &reasons else { continue };
        if of.count == Some(0) || told.first().is_some_and(|first| first.starts_with("no person")) {
            let when = When::At(truth.newest());
            judge.empty("explain", &What::Zone(zone.name.clone()), when, &told.join("; "));
        }
    }
}

/// A broker that keeps what is retained.
pub struct Broker {
    outbox: Outbox,
    kept: BTreeMap<String, String>,
}

impl Broker {
    pub fn new(site: &Arc<Site>) -> Self {
        let home_assistant = Some("homeassistant".to_owned());
        let topics = Topics { title: "home".into(), prefix: "kehai".into(), home_assistant };
        let mut broker = Self { outbox: Outbox::new(topics), kept: BTreeMap::new() };
        broker.change_site(site);
        broker
    }

    pub fn change_site(&mut self, site: &Arc<Site>) {
        self.outbox.set_about(About { site: Arc::clone(site), map_url: None, buttons: false });
    }

    /// The tracker of before is gone, and its last will is done; another connects.
    pub fn begin(&mut self, site: &Arc<Site>) {
        let will = self.outbox.farewell();
        self.keep(will);
        let topics = self.outbox.topics().clone();
        self.outbox = Outbox::new(topics);
        self.change_site(site);
        self.outbox.connected();
        self.kept.iter().for_each(|(topic, payload)| self.outbox.retained(topic, payload.as_bytes()));
    }

    /// A new snapshot.
    pub fn tenth(&mut self, judge: &mut Judge, truth: &Truth, snapshot: &Snapshot, now_ms: u64) {
        for publication in self.outbox.due(Some(snapshot), now_ms) {
            self.keep(publication);
        }
        self.look(judge, When::At(truth.newest()));
    }

    /// None has come for so long.
    pub fn silent(&mut self, judge: &mut Judge, truth: &Truth, silent_ms: u64, now_ms: u64) {
        for publication in self.outbox.due(None, now_ms) {
            self.keep(publication);
        }
        let holds = truth.newest().filter(|_| silent_ms < HOLDS_MS);
        self.look(judge, When::At(holds));
    }

    fn keep(&mut self, Publication { topic, payload }: Publication) {
        if payload.is_empty() {
            self.kept.remove(&topic);
        } else {
            self.kept.insert(topic, payload);
        }
    }

    fn is_online(&self, topic: &str) -> bool {
        self.kept.get(topic).is_some_and(|payload| payload == "online")
    }

    fn json(&self, topic: &str) -> Option<Value> {
        serde_json::from_str(self.kept.get(topic)?).ok()
    }

    /// Holds what is kept against the truth.
    fn look(&self, judge: &mut Judge, when: When<'_>) {
        if !self.is_online(&self.outbox.topics().status()) {
            return;
        }
        let site = self.outbox.topics().site();
        for (topic, payload) in &self.kept {
            let Some(what) = what(topic, &site) else { continue };
            let Ok(payload) = serde_json::from_str::<Value>(payload) else { continue };
            if payload["count"] == 0 || payload["occupied"] == false {
                judge.empty("MQTT", &what, when, &payload.to_string());
            }
        }
        for (topic, config) in self.kept.iter().filter(|(topic, _)| topic.ends_with("/config")) {
            let config: Value = serde_json::from_str(config).unwrap();
            for component in config["components"].as_object().unwrap().values() {
                self.entity(judge, when, &site, component);
            }
            assert!(topic.starts_with("homeassistant/device/"));
        }
    }

    /// An entity of Home Assistant: what its template makes of the state, while it is available.
    fn entity(&self, judge: &mut Judge, when: When<'_>, site: &str, component: &Value) {
        let Some(topic) = component["state_topic"].as_str() else { return };
        let Some(what) = what(topic, site) else { return };
        let mut needed = component["availability"].as_array().unwrap().iter();
        if !needed.all(|needed| self.is_online(needed["topic"].as_str().unwrap())) {
            return;
        }
        let state = self.json(topic).unwrap_or_default();
        let is_empty = match component["value_template"].as_str().unwrap() {
            COUNT => state["count"] == 0,
            OCCUPIED => !state["occupied"].is_null() && state["occupied"] == false,
            other if other.contains("count") || other.contains("occupied") => {
                panic!("it is not known what Home Assistant makes of {other}")
            }
            _ => false,
        };
        if is_empty {
            judge.empty("Home Assistant", &what, when, &component["name"].to_string());
        }
    }
}

/// What the state of a topic is of. Names of the sites here are their own slugs.
fn what(topic: &str, site: &str) -> Option<What> {
    match topic.strip_prefix(site)?.strip_prefix('/')?.split_once('/') {
        None => (topic.ends_with("/total")).then_some(What::Total),
        Some(("zone", name)) if !name.contains('/') => Some(What::Zone(name.to_owned())),
        Some(_) => None,
    }
}
