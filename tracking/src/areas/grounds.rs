//! Whose ground a place is: that of the area whose zones have it.
//!
//! ```text
//!   west's zone ├──────────────┤├──────────────┤ east's zone, seen
//!                          ●┄┄┄┄┄┄┄○             west's track, hidden since ●: at ○ it is for east to say who is there
//! ```
//!
//! A tracker keeps a person who went out of its sight for up to half a minute, since they may stand behind something. Behind the
//! border that is another area's to know.

use std::collections::BTreeMap;

use super::AreaName;
use crate::geometry::{Point, inside};
use crate::jsonl::TrackLine;
use crate::occupancy::ZoneKnown;
use crate::site::{Site, Zone};
use crate::snapshot::Snapshot;

/// The zones of the areas that are heard.
#[derive(Debug, Default)]
pub struct Grounds<'a> {
    /// Each with whether its area knows anything of it: where it is seen in part, the total is said to be so, too.
    zones: BTreeMap<&'a AreaName, Vec<(Vec<Point>, bool)>>,
}

impl<'a> Grounds<'a> {
    /// Of these areas, by their sites and their last frames.
    pub fn of(areas: impl Iterator<Item = (&'a AreaName, &'a Site, &'a Snapshot)>) -> Self {
        let zones = |(name, site, frame): (&'a AreaName, &'a Site, &'a Snapshot)| {
            let is_seen = |zone: &Zone| {
                frame.line.zones.get(&zone.name).is_some_and(|zone| zone.state() != ZoneKnown::Unknown)
            };
            let zones = site.zones.iter().map(|zone| (zone.corners(), is_seen(zone))).collect();
            (name, zones)
        };
        Self { zones: areas.map(zones).collect() }
    }

    /// Whether a track of an area is at a place that is not its own, and that another area sees.
    pub fn is_abroad(&self, area: &AreaName, track: &TrackLine) -> bool {
        let at = Point::new(track.x, track.y);
        let holds = |(corners, _): &&(Vec<Point>, bool)| inside(at, corners);
        let is_own =
            || self.zones.get(area).is_none_or(|own| own.is_empty() || own.iter().any(|zone| holds(&zone)));
        let is_seen = || {
            let others = self.zones.iter().filter(|(name, _)| **name != area).flat_map(|(_, zones)| zones);
            others.filter(holds).any(|(_, is_seen)| *is_seen)
        };
        !is_own() && is_seen()
    }
}
