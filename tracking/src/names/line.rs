//! What is said of names: in each snapshot, and to the question where an ID is.
//!
//! ```text
//!   {"label":"a11ce000","heard_s":0.3,"read_s":0.3,"tracks":[{"track":4,"probability":0.93},{"track":7,"probability":0.05}],…}
//!       │                                                     └ the likeliest first; what is missing to 1: none of them, or not known
//!       └ the first digits of the ID's keyed hash: the ID itself is kept nowhere
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::card::Card;
use crate::geometry::{Point, inside};
use crate::site::Site;
use crate::tracker::TrackId;

/// A track that may be the one of an ID.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Likelihood {
    /// The track.
    pub track: TrackId,
    /// How probable that is, 0 to 1.
    pub probability: f64,
}

/// An ID, and the tracks that may be it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NameLine {
    /// The whole hash, for the database; not written.
    #[serde(skip)]
    pub card: Option<Card>,
    /// Its first digits.
    pub label: String,
    /// Since it was read last, s.
    pub heard_s: f64,
    /// Since it was read last at a place that is known, s: its tracks go by that. Absent while it never was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub read_s: Option<f64>,
    /// The likeliest first; empty while it is not known which track it is.
    pub tracks: Vec<Likelihood>,
    /// The zones in which the likeliest is.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub zones: Vec<String>,
}

/// Where an ID is.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Whereabouts {
    /// The ID and its tracks.
    #[serde(flatten)]
    pub name: NameLine,
    /// Where its likeliest track is, m; none while there is no such track.
    pub at: Option<[f64; 2]>,
    /// Where it was read last, m, if that was said.
    pub read: Option<[f64; 2]>,
}

/// The names of the zones around a place.
pub(crate) fn zones_at(site: &Site, at: Point) -> Vec<String> {
    let around = site.zones.iter().filter(|zone| inside(at, &zone.corners()));
    around.map(|zone| zone.name.clone()).collect()
}
