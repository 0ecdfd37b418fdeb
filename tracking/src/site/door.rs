//! A door of a site: which zone and line it has, how many people may enter, and what its lock does in trouble.
//!
//! ```toml
//! [[door]]
//! name = "front"
//! zone = "area"                       # the counted zone before it
//! line = [[-0.45, 1.0], [0.45, 1.0]]  # what people cross; the far side of the zone is inside
//! fail = "secure"                     # or "safe": what the lock does when it is unknown what happens
//! without_keys = true                 # also by modules whose reports anybody on the network can forge
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::geometry::Point;

/// How far the line of a door may be from its zone, m. A doorway is in the zone's edge: the wall between them is up to half a metre
/// thick, and both are drawn by hand.
pub const OFF_ZONE_M: f64 = 1.0;

/// What the lock does when it is unknown what happens at the door.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Fail {
    /// No person gets in.
    Secure,
    /// Every person gets in.
    Safe,
}

/// A door.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Door {
    /// Its name.
    pub name: String,
    /// The zone before it, in which people are counted.
    pub zone: String,
    /// The line across which people go in, in either direction.
    pub line: [[f64; 2]; 2],
    /// What the lock does in trouble.
    pub fail: Fail,
    /// Where cards are shown; the middle of the line, by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reader: Option<[f64; 2]>,
    /// Most people who may enter at once.
    #[serde(default = "people_max")]
    pub people_max: u32,
    /// Longest time from the card to the number, s.
    #[serde(default = "ask_s")]
    pub ask_s: f64,
    /// Longest time a number is compared with the count before it is asked again, s.
    #[serde(default = "check_s")]
    pub check_s: f64,
    /// Numbers that may be tried with one card.
    #[serde(default = "tries_max")]
    pub tries_max: u32,
    /// How long the door stays unlocked for the first of a group, s.
    #[serde(default = "pass_s")]
    pub pass_s: f64,
    /// And for each further one, s.
    #[serde(default = "next_s")]
    pub next_s: f64,
    /// Longest time from the lock to a leaf that is shut, s; then it is held open.
    #[serde(default = "close_s")]
    pub close_s: f64,
    /// A card that went in is not taken again for so long, s.
    #[serde(default = "passback_s")]
    pub passback_s: f64,
    /// How long the door stays open for a person who wants out, s.
    #[serde(default = "exit_s")]
    pub exit_s: f64,
    /// Also modules without a key are believed: their reports can be forged.
    #[serde(default, skip_serializing_if = "is_false")]
    pub without_keys: bool,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "what serde asks for")]
const fn is_false(value: &bool) -> bool {
    !*value
}

const fn people_max() -> u32 {
    7
}

const fn ask_s() -> f64 {
    30.0
}

const fn check_s() -> f64 {
    4.0
}

const fn tries_max() -> u32 {
    3
}

/// A slow walker's two metres, and a pause.
const fn pass_s() -> f64 {
    8.0
}

const fn next_s() -> f64 {
    3.0
}

/// A second of the leaf, and a person who stands in it.
const fn close_s() -> f64 {
    6.0
}

const fn passback_s() -> f64 {
    60.0
}

const fn exit_s() -> f64 {
    5.0
}

impl Door {
    /// One that fails secure, with the times a door has if its file says nothing of them.
    #[must_use]
    pub fn new(name: &str, zone: &str, line: [[f64; 2]; 2]) -> Self {
        Self {
            name: name.to_owned(),
            zone: zone.to_owned(),
            line,
            fail: Fail::Secure,
            reader: None,
            people_max: people_max(),
            ask_s: ask_s(),
            check_s: check_s(),
            tries_max: tries_max(),
            pass_s: pass_s(),
            next_s: next_s(),
            close_s: close_s(),
            passback_s: passback_s(),
            exit_s: exit_s(),
            without_keys: false,
        }
    }

    /// Its line.
    #[must_use]
    pub fn ends(&self) -> (Point, Point) {
        (self.line[0].into(), self.line[1].into())
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::site::Site;

    pub(crate) const DOOR: &str = "
[[zone]]
name = \"area\"
polygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
secure = true

[[door]]
name = \"front\"
zone = \"area\"
line = [[-0.45, 1.0], [0.45, 1.0]]
fail = \"secure\"
";

    #[test]
    fn a_door_is_read_with_its_times() {
        let site = Site::parse("x.toml", DOOR).unwrap();
        assert_eq!((site.doors[0].fail, site.doors[0].people_max), (Fail::Secure, 7));
        let text = toml::to_string(&site).unwrap();
        assert_eq!(Site::parse("y.toml", &text).unwrap(), site);
    }

    #[test]
    fn mistakes_are_named_with_their_place() {
        let wrong =
            |from: &str, to: &str| Site::parse("x.toml", &DOOR.replace(from, to)).unwrap_err().to_string();
        assert_eq!(
            wrong("zone = \"area\"", "zone = \"hall\""),
            "x.toml: door \"front\": zone: there is no zone \"hall\""
        );
        assert_eq!(
            wrong("-0.45", "0.44"),
            "x.toml: door \"front\": line: must be 0.3 to 20 m long, is 0.01 m"
        );
        assert_eq!(
            wrong("[[-0.45, 1.0], [0.45, 1.0]]", "[[-0.45, 5.0], [0.45, 5.0]]"),
            "x.toml: door \"front\": line: is 4.0 m from zone \"area\": it must be in its edge, at most 1 m off"
        );
        let off = DOOR.replace("[[-0.45, 1.0], [0.45, 1.0]]", "[[-0.45, 1.9], [0.45, 1.9]]");
        assert!(Site::parse("x.toml", &off).is_ok(), "behind a thick wall");
        assert!(wrong("secure = true", "").contains("zone: \"area\" must have secure = true"));
        let fail = wrong("\"secure\"", "\"shut\"");
        assert!(fail.starts_with("x.toml:11: ") && fail.contains("secure"), "{fail}");
        let more = |line: &str| wrong("fail", &format!("{line}\nfail"));
        assert_eq!(more("ask_s = nan"), "x.toml: door \"front\": ask_s: must be from 1 to 600, is NaN");
        assert_eq!(more("people_max = 0"), "x.toml: door \"front\": people_max: must be from 1 to 16, is 0");
        let unknown = more("hold_s = 1");
        assert!(unknown.starts_with("x.toml:11: unknown field `hold_s`"), "{unknown}");
        let door = DOOR.split_once("[[door]]").unwrap().1;
        let twice = Site::parse("x.toml", &format!("{DOOR}\n[[door]]{door}")).unwrap_err().to_string();
        assert_eq!(twice, "x.toml: two doors are named \"front\": rename one");
        let other = door.replace("\"front\"", "\"Front\"");
        let alike = Site::parse("x.toml", &format!("{DOOR}\n[[door]]{other}")).unwrap_err().to_string();
        assert_eq!(
            alike,
            "x.toml: door \"Front\": name: has the topic \"front\", as door \"front\": rename door \"Front\", and use its \
             new topic in its devices"
        );
    }
}
