//! Bringing an image to modules: what a module's answers and events come to, and when the next module may follow.
//!
//! ```text
//!   may it? ─▶ update: from where ─▶ chunks ─▶ install ─▶ back, on trial ─▶ confirmed │ back as before, and why
//!      ▲ doors idle, zones as known as before                                     │
//!      └──────────────────────────── the next module ◀─────────────────────────────┘
//! ```

use std::collections::BTreeSet;
use std::fmt;

use kehai::update::Version;
use kehai::wire::EventKind;
use kehai_tracking::door::Phase;
use kehai_tracking::occupancy::ZoneKnown;
use kehai_tracking::snapshot::Snapshot;

/// What has become of an image.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Outcome {
    /// It runs, and stays.
    Confirmed,
    /// The module runs what it ran before: why.
    Kept(EventKind),
}

/// What the events of a start say of an image; none yet.
#[must_use]
pub fn outcome(events: impl IntoIterator<Item = EventKind>) -> Option<Outcome> {
    events.into_iter().find_map(|kind| match kind {
        EventKind::ImageConfirmed => Some(Outcome::Confirmed),
        EventKind::ImageReverted
        | EventKind::ImageForged
        | EventKind::ImageDamaged
        | EventKind::ImageOther
        | EventKind::ImageTooOld => Some(Outcome::Kept(kind)),
        _ => None,
    })
}

/// What a module says it runs, against what it is to run.
#[must_use]
pub fn runs(firmware: &str, version: Version) -> bool {
    Version::of_text(firmware) == Some(version)
}

/// Why a module is not updated now.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Hold {
    /// A door is in use, or in alarm: its modules count the people in transit.
    Door {
        /// The door.
        name: String,
        /// Where it is.
        phase: Phase,
    },
    /// A zone that was known is not, since a module was updated.
    Zone(String),
}

impl fmt::Display for Hold {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Door { name, phase } => {
                let phase = serde_json::to_value(phase).unwrap_or_default();
                write!(f, "door \"{name}\" is {}", phase.as_str().unwrap_or("in use"))
            }
            Self::Zone(name) => write!(f, "zone \"{name}\" is not known yet"),
        }
    }
}

/// The zones of which something is known.
#[must_use]
pub fn known_zones(snapshot: &Snapshot) -> BTreeSet<String> {
    let zones = snapshot.line.zones.iter();
    zones.filter(|(_, zone)| zone.state() != ZoneKnown::Unknown).map(|(name, _)| name.clone()).collect()
}

/// What a module has to wait for, by what the tracker says: doors that are not idle, and zones that were `known` before
/// the first module was updated.
#[must_use]
pub fn hold(snapshot: &Snapshot, known: &BTreeSet<String>) -> Option<Hold> {
    let door = snapshot.doors.iter().find(|door| !matches!(door.phase, Phase::Idle));
    if let Some(door) = door {
        return Some(Hold::Door { name: door.name.clone(), phase: door.phase });
    }
    let now = known_zones(snapshot);
    known.iter().find(|zone| !now.contains(*zone)).map(|zone| Hold::Zone(zone.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn snapshot(zones: &str, doors: &str) -> Snapshot {
        let text =
            format!(r#"{{"unix_ms":1,"t":1.0,"tracks":[],"zones":{zones},"doors":{doors},"modules":[]}}"#);
        serde_json::from_str(&text).unwrap()
    }

    const KNOWN: &str = r#"{"state":"known","count":0,"p":[1.0],"seen_share":1.0}"#;
    const UNKNOWN: &str = r#"{"state":"unknown","seen_share":0.0}"#;

    fn door(phase: &str) -> String {
        format!(
            r#"[{{"name":"front","phase":"{phase}","lock":"locked","lock_id":1,"lock_taken":true,"alarm":null,"alarm_id":1,"alarm_taken":true,"trouble":null,"contact":null,"entered":0,"people_max":9,"through":0,"tries_left":3,"passage":0,"prompt":""}}]"#
        )
    }

    #[test]
    fn a_module_waits_for_doors_and_for_what_was_known_before() {
        let both = snapshot(&format!(r#"{{"hall":{KNOWN},"yard":{UNKNOWN}}}"#), &door("idle"));
        let known = known_zones(&both);
        assert_eq!(known, BTreeSet::from(["hall".to_owned()]));
        assert_eq!(hold(&both, &known), None);
        let dark = snapshot(&format!(r#"{{"hall":{UNKNOWN}}}"#), "[]");
        assert_eq!(hold(&dark, &known).unwrap().to_string(), "zone \"hall\" is not known yet");
        // A zone that is not in the site any more is not known either.
        assert_eq!(hold(&snapshot("{}", "[]"), &known), Some(Hold::Zone("hall".into())));
        for phase in ["asked", "checking", "unlocked", "closing", "held-open", "alarmed", "failed"] {
            let busy = snapshot(&format!(r#"{{"hall":{KNOWN}}}"#), &door(phase));
            assert_eq!(hold(&busy, &known).unwrap().to_string(), format!("door \"front\" is {phase}"));
        }
    }

    #[test]
    fn what_a_start_says_of_an_image() {
        use EventKind::{ImageConfirmed, ImageForged, ImageOnTrial, ImageReverted, LearnStarted};
        assert_eq!(outcome([LearnStarted, ImageOnTrial]), None);
        assert_eq!(outcome([ImageOnTrial, ImageConfirmed]), Some(Outcome::Confirmed));
        assert_eq!(outcome([ImageReverted]), Some(Outcome::Kept(ImageReverted)));
        assert_eq!(outcome([ImageForged]), Some(Outcome::Kept(ImageForged)));
        assert!(runs("0.3.0", Version([0, 3, 0])) && !runs("0.2.0", Version([0, 3, 0])));
    }
}
