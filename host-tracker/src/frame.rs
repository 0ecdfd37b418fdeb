//! What is known at one time, for everybody who shows, stores or tells it: a line of tracks, and how each module is.
//!
//! ```text
//!   live ── every 0.1 s ──▶ Frame ──▶ file of lines · live map · database · MQTT · metrics
//!                            ├ line      tracks and zones at t        (`jsonl`)
//!                            └ modules   rates, losses, clock, alarms
//! ```
//!
//! A frame is made once and shared; whoever is slow misses frames and holds up nobody.

use std::collections::BTreeMap;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use crate::door::DoorLine;
use crate::intake::Drops;
use crate::jsonl::{TrackLine, TracksLine, ZoneLine};

/// ms since 1970, by this machine's clock.
#[must_use]
pub fn unix_ms() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_millis()).unwrap_or(u64::MAX)
}

/// What is known at one time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "Flat")]
pub struct Frame {
    /// Milliseconds since 1970 when it was made, by this machine's clock: for people and databases, never for
    /// computing.
    pub unix_ms: u64,
    /// Tracks and zones.
    #[serde(flatten)]
    pub line: TracksLine,
    /// What is wrong with the tracker itself: its database, its recording.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub alarms: Vec<AlarmLine>,
    /// Every guarded door of the site.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub doors: Vec<DoorLine>,
    /// Every module of the site, and every one that was found beside them.
    pub modules: Vec<ModuleLine>,
    /// Datagrams of modules that were not used, since the start.
    #[serde(default)]
    pub dropped: Drops,
    /// Datagrams that came from nobody we know, since the start.
    #[serde(default)]
    pub strangers: u64,
}

/// A frame as it is written, its line's parts beside its own. To be read this way, since numbers within a flattened
/// part cannot be read when some other crate has switched on `serde_json`'s `arbitrary_precision`.
#[derive(Deserialize)]
struct Flat {
    unix_ms: u64,
    t: f64,
    tracks: Vec<TrackLine>,
    #[serde(default)]
    zones: BTreeMap<String, ZoneLine>,
    #[serde(default)]
    alarms: Vec<AlarmLine>,
    #[serde(default)]
    doors: Vec<DoorLine>,
    modules: Vec<ModuleLine>,
    #[serde(default)]
    dropped: Drops,
    #[serde(default)]
    strangers: u64,
}

impl From<Flat> for Frame {
    fn from(flat: Flat) -> Self {
        let Flat { unix_ms, t, tracks, zones, alarms, doors, modules, dropped, strangers } = flat;
        Self { unix_ms, line: TracksLine { t, tracks, zones }, alarms, doors, modules, dropped, strangers }
    }
}

/// How a module is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ModuleLine {
    /// As the site calls it, or else as it calls itself.
    pub name: String,
    /// Its identity, as hexadecimal bytes between colons; empty until it has answered.
    pub id: String,
    /// Where it answers; empty until it is found.
    pub address: String,
    /// What it is doing, in a word: `missing`, `found` (it is there, but has no place in the site), `searching` for its
    /// sensor, `learning`, `watching`, `storing`.
    pub state: String,
    /// Scans a second over the last ten seconds.
    pub scans_hz: f64,
    /// Share of its scans that were lost over the last minute, on whatever part of the way.
    pub lost_share: f64,
    /// Checksum errors on its sensor's line since it started.
    pub checksum_errors: u64,
    /// Share of its beams that could not be judged in the newest report.
    pub unknown_share: f64,
    /// Its clock minus this machine's, ms; absent until it was measured.
    pub clock_offset_ms: Option<f64>,
    /// How much that scatters, ms.
    pub clock_jitter_ms: f64,
    /// Age of its background, s; absent while it has none.
    pub background_age_s: Option<f64>,
    /// Since its last datagram, s; absent until there was one.
    pub silent_s: Option<f64>,
    /// What its newest scan saw empty, in the site's frame, m: the corners of an area that begins at the module.
    /// Empty while it sees nothing. What lies outside is not seen.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub free: Vec<[f64; 2]>,
    /// What is wrong, worst first.
    pub alarms: Vec<AlarmLine>,
    /// What it has done within the last minute, oldest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub events: Vec<EventLine>,
}

/// Something that a module did: with its background, its settings or itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EventLine {
    /// In which of its starts.
    pub boot: u32,
    /// Counts the events of that start, from 1.
    pub number: u32,
    /// Its name, for programs: `learn-started`, `learned`, `learn-restarted`, `absorbed`, `background-forgotten`,
    /// `background-drifted`, `settings-changed`, `restarting`; `unknown` is of a newer module.
    pub kind: String,
    /// What it is, in words, and which host asked for it, if one did.
    pub text: String,
    /// Since then, s.
    pub ago_s: f64,
}

/// Something that is wrong.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AlarmLine {
    /// Its name, for programs: `silent`, `sensor`, `line`, `covered`, `slow`, `clock-off`, `dirty`, `store`, `background`,
    /// `suspect`, `watchdog`, and of its place `moved` and `blind` (`calibrate/watch.rs`). When each is raised: `host-tracker/src/health/alarms.rs`.
    pub name: String,
    /// What it is and what to do, in words.
    pub text: String,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jsonl::{ZoneKnown, ZoneLine};

    #[test]
    fn a_frame_survives_being_written_and_read() {
        let zone = ZoneLine { count: 1, p: vec![0.1, 0.9], seen_share: 1.0, state: ZoneKnown::Known };
        let track =
            r#"{"id":7,"x":1.5,"y":-0.25,"cov":[0.01,0.0,0.01],"state":"occluded","reason":"hidden"}"#;
        let line = TracksLine {
            t: 12.3,
            tracks: vec![serde_json::from_str(track).unwrap()],
            zones: [("hall".to_owned(), zone)].into(),
        };
        let frame = Frame { unix_ms: 1_700_000_000_000, line, ..Frame::default() };
        let text = serde_json::to_string(&frame).unwrap();
        assert_eq!(
            serde_json::from_str::<Frame>(&text).map_err(|error| format!("{error}: {text}")),
            Ok(frame)
        );
    }
}
