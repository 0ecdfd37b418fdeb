//! What is known of the people in a zone. *Unknown* is never *empty*: here it is decided, for every surface.
//!
//! ```text
//!   seen                people found     is said
//!   nearly all of it    any number       count and distribution
//!   a part of it        some             the same: at least those
//!   a part of it        none             null: a person may stand where no module looks
//!   hardly any of it    any number       null
//! ```
//!
//! In JSON `count` and `p` are null together. Lines of older versions, which said 0 there, are read as null.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Share of a zone that is seen from which on it is known, and a door before it may unlock: of one in which seven people crowd before two
/// modules, shadows leave 0.75 to 0.95.
pub const KNOWN_SHARE: f64 = 0.8;

/// How much of a zone is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ZoneKnown {
    /// All of it is observed, or no person can have come in without a detection.
    Known,
    /// Some of it is not seen.
    Partly,
    /// None of it is seen.
    Unknown,
}

impl ZoneKnown {
    /// Its name, for programs.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Known => "known",
            Self::Partly => "partly",
            Self::Unknown => "unknown",
        }
    }
}

/// How many people are in the whole site.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Total {
    /// People; null where that is not known.
    pub count: Option<u32>,
    /// How much of the site's zones is known.
    pub state: ZoneKnown,
}

impl Default for Total {
    fn default() -> Self {
        Self { count: None, state: ZoneKnown::Unknown }
    }
}

/// People who were found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Confirmed and occluded tracks inside.
    pub count: u32,
    /// Probability of no person, of one, of two, …: tentative tracks and those at its edge included.
    pub p: Vec<f64>,
    /// The same of those that may be counted, each where its mean is and each one person, as if no track were mistaken: by
    /// this a door decides, which waits until nothing is in doubt. It is not written.
    pub counted_p: Vec<f64>,
}

impl Found {
    /// As many as may be counted, all of them well inside.
    #[must_use]
    pub fn inside(count: u32, p: Vec<f64>) -> Self {
        Self { count, counted_p: p.clone(), p }
    }
}

/// What is known of a zone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "Flat", into = "Flat")]
pub struct ZoneLine {
    state: ZoneKnown,
    seen_share: f64,
    /// Only as the table above says.
    found: Option<Found>,
}

impl ZoneLine {
    /// From what was found where modules look.
    #[must_use]
    pub fn new(found: Found, seen_share: f64, state: ZoneKnown) -> Self {
        let is_said = match state {
            ZoneKnown::Known => true,
            ZoneKnown::Partly => found.count > 0,
            ZoneKnown::Unknown => false,
        };
        Self { state, seen_share, found: is_said.then_some(found) }
    }

    /// Of which nothing is known.
    #[must_use]
    pub const fn unknown() -> Self {
        Self { state: ZoneKnown::Unknown, seen_share: 0.0, found: None }
    }

    /// How much the count can be trusted.
    #[must_use]
    pub const fn state(&self) -> ZoneKnown {
        self.state
    }

    /// Share of the zone that some module sees.
    #[must_use]
    pub const fn seen_share(&self) -> f64 {
        self.seen_share
    }

    /// Number of people found; none where 0 would say more than is known.
    #[must_use]
    pub fn count(&self) -> Option<u32> {
        self.found.as_ref().map(|found| found.count)
    }

    /// Probability of no person, of one, of two, …; empty without a count.
    #[must_use]
    pub fn p(&self) -> &[f64] {
        self.found.as_ref().map_or(&[], |found| &found.p)
    }

    /// The same of those that may be counted; empty without a count.
    #[must_use]
    pub fn counted_p(&self) -> &[f64] {
        self.found.as_ref().map_or(&[], |found| &found.counted_p)
    }
}

/// As it is written.
#[derive(Serialize, Deserialize, JsonSchema)]
struct Flat {
    /// Number of people found; null where 0 would say more than is known.
    count: Option<u32>,
    /// Probability of no person, of one, of two, …; null with the count.
    p: Option<Vec<f64>>,
    /// Share of the zone that some module sees.
    seen_share: f64,
    /// How much the count can be trusted.
    state: ZoneKnown,
}

impl From<Flat> for ZoneLine {
    fn from(flat: Flat) -> Self {
        let Flat { count, p, seen_share, state } = flat;
        match count {
            Some(count) => Self::new(Found::inside(count, p.unwrap_or_default()), seen_share, state),
            None => Self { state, seen_share, found: None },
        }
    }
}

impl From<ZoneLine> for Flat {
    fn from(line: ZoneLine) -> Self {
        let ZoneLine { state, seen_share, found } = line;
        let (count, p) = found.map(|Found { count, p, .. }| (count, p)).unzip();
        Self { count, p, seen_share, state }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_person_found_is_a_count_of_zero_only_where_all_is_seen() {
        let line = |count: u32, state| {
            let line = ZoneLine::new(Found::inside(count, vec![1.0]), 0.5, state);
            serde_json::to_string(&line).unwrap()
        };
        assert_eq!(line(0, ZoneKnown::Known), r#"{"count":0,"p":[1.0],"seen_share":0.5,"state":"known"}"#);
        assert_eq!(line(2, ZoneKnown::Partly), r#"{"count":2,"p":[1.0],"seen_share":0.5,"state":"partly"}"#);
        assert_eq!(
            line(0, ZoneKnown::Partly),
            r#"{"count":null,"p":null,"seen_share":0.5,"state":"partly"}"#
        );
        assert_eq!(
            line(2, ZoneKnown::Unknown),
            r#"{"count":null,"p":null,"seen_share":0.5,"state":"unknown"}"#
        );
    }

    #[test]
    fn lines_are_read_as_they_are_written_and_old_ones_say_no_more_than_is_known() {
        let known = ZoneLine::new(Found::inside(1, vec![0.1, 0.9]), 0.9, ZoneKnown::Known);
        for line in [known, ZoneLine::unknown()] {
            let text = serde_json::to_string(&line).unwrap();
            assert_eq!(serde_json::from_str::<ZoneLine>(&text).unwrap(), line);
        }
        let old = r#"{"count":0,"p":[1.0],"seen_share":0.0,"state":"unknown"}"#;
        assert_eq!(serde_json::from_str::<ZoneLine>(old).unwrap(), ZoneLine::unknown());
    }
}
