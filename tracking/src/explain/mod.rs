//! Why a figure is what it is: what the tracker knew in, reasons out.
//!
//! ```text
//!   Question ─▶ SiteTracker::facts ─▶ ZoneFacts, PersonFacts ─▶ zone::explain, person::explain ─▶ reasons ─▶ words
//!               copies, in the tracking loop                    in any thread, as long as it takes
//! ```
//!
//! | file | what |
//! |---|---|
//! | `glance` | the newest scan of each module, and why it does not show a place |
//! | `zone` | why a zone is known or not, who is in it, and which parts are not seen, behind what, since when |
//! | `person` | why a track exists: born when, seen by whom when last, hidden behind what |
//! | `alarm` | why an alarm of a device rings or not: what is measured, and the limit |
//! | `words` | all of it in words: nowhere else |
//!
//! A question changes nothing: recordings are the same with and without.

pub mod alarm;
pub mod glance;
pub mod person;
mod round;
pub mod words;
pub mod zone;

use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::alarm::AlarmKind;
use crate::site::Site;
use crate::tracker::{TrackId, TrackState};
use crate::zones::facts::ZoneFacts;
use alarm::DeviceCondition;
use glance::Glance;
use person::{PersonFacts, PersonReasons};
use zone::ZoneReasons;

/// What is to be explained.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Question {
    /// A zone, by its name.
    Zone(String),
    /// A counting line, by its name.
    Line(String),
    /// A track, by its number.
    Person(TrackId),
    /// An alarm of every device.
    Alarm(AlarmKind),
    /// Nothing but what modules see.
    Views,
}

/// What was known when it was asked.
#[derive(Clone, Debug)]
pub struct Facts {
    /// Time of it, s.
    pub at_s: f64,
    /// The site.
    pub site: Arc<Site>,
    /// Every track.
    pub tracks: Vec<TrackState>,
    /// The newest scan of each module.
    pub glances: Vec<Glance>,
    /// Of what was asked for; none if there is no such thing.
    pub of: Option<FactsOf>,
}

/// Of what was asked for.
#[derive(Clone, Debug)]
pub enum FactsOf {
    /// A zone, or a counting line.
    Zone(ZoneFacts),
    /// A track.
    Person(PersonFacts),
    /// An alarm, device by device.
    Alarm(Vec<DeviceCondition>),
}

/// The answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Reasons {
    /// Of a zone, or of a counting line.
    Zone(ZoneReasons),
    /// Of a track.
    Person(PersonReasons),
    /// Of an alarm, device by device.
    Alarm(Vec<DeviceCondition>),
}

/// Explains; none if there is no such thing.
#[must_use]
pub fn explain(facts: Facts) -> Option<Reasons> {
    let Facts { at_s, site, tracks, glances, of } = facts;
    Some(match of? {
        FactsOf::Zone(zone) => Reasons::Zone(zone::explain(&zone, &glances, &site, &tracks, at_s)),
        FactsOf::Person(person) => Reasons::Person(person::explain(&person, &glances, &site, &tracks, at_s)),
        FactsOf::Alarm(devices) => Reasons::Alarm(devices),
    })
}
