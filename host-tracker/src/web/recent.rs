//! The last ten minutes, for the map's time line: two lines a second, each already written.

use std::collections::{BTreeMap, VecDeque};

use schemars::JsonSchema;
use serde::Serialize;

use kehai_tracking::jsonl::{TrackLine, ZoneKnown, ZoneLine};
use kehai_tracking::occupancy::Total;
use kehai_tracking::snapshot::Snapshot;

/// Lines kept: ten minutes at two a second, about half a megabyte in a home.
const LINES: usize = 1200;

/// The last ten minutes.
#[derive(Debug, Default)]
pub struct History(VecDeque<String>);

/// What was known at a time.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "PastLine")]
pub(crate) struct Past<'a> {
    /// When, ms since 1970.
    unix_ms: u64,
    /// All tracks.
    tracks: &'a [TrackLine],
    /// Each zone by its name.
    zones: BTreeMap<String, PastZone>,
    /// How many people were in the whole site, as it was then.
    total: Total,
}

/// What was known of a zone.
#[derive(Serialize, JsonSchema)]
pub(crate) struct PastZone {
    /// People; null where 0 would say more than is known.
    count: Option<u32>,
    /// How much of it was seen.
    state: ZoneKnown,
}

impl History {
    /// Notes a frame; the oldest line makes room.
    pub fn push(&mut self, frame: &Snapshot) {
        let zone = |(name, zone): (&String, &ZoneLine)| {
            (name.clone(), PastZone { count: zone.count(), state: zone.state() })
        };
        let zones = frame.line.zones.iter().map(zone).collect();
        let past = Past { unix_ms: frame.unix_ms, tracks: &frame.line.tracks, zones, total: frame.total };
        if self.0.len() >= LINES {
            self.0.pop_front();
        }
        self.0.push_back(serde_json::to_string(&past).unwrap_or_default());
    }

    /// All of it, oldest first, as one JSON array.
    #[must_use]
    pub fn to_json(&self) -> String {
        let mut text = String::with_capacity(self.0.iter().map(|line| line.len() + 1).sum::<usize>() + 2);
        text.push('[');
        for (index, line) in self.0.iter().enumerate() {
            if index > 0 {
                text.push(',');
            }
            text.push_str(line);
        }
        text.push(']');
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ten_minutes_are_kept_and_no_more() {
        let mut history = History::default();
        assert_eq!(history.to_json(), "[]");
        for half_second in 1..=1500 {
            history.push(&Snapshot { unix_ms: half_second * 500, ..Snapshot::default() });
        }
        let lines: Vec<serde_json::Value> = serde_json::from_str(&history.to_json()).unwrap();
        assert_eq!(lines.len(), 1200);
        assert_eq!(lines.first().unwrap()["unix_ms"], 301 * 500);
        assert_eq!(lines.last().unwrap()["unix_ms"], 1500 * 500);
    }
}
