//! Counting lines: the people who walk across them in each direction, and for how long the lines were not seen.
//!
//! ```text
//!   tracks ─────▶ Passing, one a line ─▶ crossings ─▶ in, out
//!   zones' cells ─▶ known · partly · unknown ────────▶ seconds of which nothing is said
//! ```
//!
//! *Unknown* is never 0: the counts say how many were seen to cross, and beside them stands for how long a person may have crossed
//! unseen. A line that was never seen has no counts.

mod passing;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::passing::Passing;
use crate::occupancy::ZoneKnown;
use crate::site::Site;
use crate::site::line::CountingLine;
use crate::tracker::{TrackId, TrackState};
use crate::zones::SEEN_S;

/// Of a longer time between two looks nothing is known, s: as long as what was seen counts as seen.
const GAP_S: f64 = SEEN_S;

/// Across a line, seen from its beginning to its end.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// To the left.
    In,
    /// To the right.
    Out,
}

impl Direction {
    /// Its name, for programs.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::In => "in",
            Self::Out => "out",
        }
    }
}

/// A track has crossed a line.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Crossing {
    /// Number of the line in the site.
    pub line: usize,
    /// The track that has crossed it.
    pub track: TrackId,
    /// Which way.
    pub direction: Direction,
    /// When the track passed the line, s; it is said once the track is away from it. If no device saw it: at the latest.
    pub at_s: f64,
    /// If no device saw it pass: at the earliest; else the same.
    pub since_s: f64,
}

/// Crossings of a line since counting began.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Totals {
    /// Inward.
    #[serde(rename = "in")]
    pub inward: u64,
    /// Outward.
    #[serde(rename = "out")]
    pub outward: u64,
}

/// A counting line in a frame.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize, JsonSchema)]
pub struct CrossedLine {
    /// As the site calls it.
    pub name: String,
    /// Inward; none if it was never seen.
    #[serde(rename = "in")]
    pub inward: Option<u64>,
    /// Outward; none if it was never seen.
    #[serde(rename = "out")]
    pub outward: Option<u64>,
    /// Whether it is seen now.
    pub state: ZoneKnown,
    /// For how long it was not known since the start, s.
    pub unknown_s: f64,
    /// Tracks that were not followed since the start, as there were too many near it at once; they may have crossed uncounted.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub unfollowed: u64,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
const fn is_zero(value: &u64) -> bool {
    *value == 0
}

impl CrossedLine {
    /// Both counts, if there are any.
    #[must_use]
    pub fn totals(&self) -> Option<Totals> {
        Some(Totals { inward: self.inward?, outward: self.outward? })
    }
}

#[derive(Debug)]
struct Counter {
    name: String,
    passing: Passing,
    totals: Totals,
    /// It was seen, or counted before.
    is_counted: bool,
    state: ZoneKnown,
    unknown_s: f64,
}

impl Counter {
    fn new(line: &CountingLine, site: &Site) -> Self {
        Self {
            name: line.name.clone(),
            passing: Passing::new(line, site),
            totals: Totals::default(),
            is_counted: false,
            state: ZoneKnown::Unknown,
            unknown_s: 0.0,
        }
    }
}

/// All counting lines of a site.
#[derive(Debug, Default)]
pub struct Lines {
    counters: Vec<Counter>,
    at_s: Option<f64>,
}

impl Lines {
    /// Those of a site.
    #[must_use]
    pub fn new(site: &Site) -> Self {
        let mut lines = Self::default();
        lines.change_site(site);
        lines
    }

    /// Goes on in another site: counts go on under the names of their lines. Tracks near a line that was moved begin anew.
    pub fn change_site(&mut self, site: &Site) {
        let mut before = std::mem::take(&mut self.counters);
        let counter = |line: &CountingLine| {
            let known = before.iter().position(|counter| counter.name == line.name);
            let Some(known) = known else { return Counter::new(line, site) };
            let mut counter = before.swap_remove(known);
            counter.passing.change_site(line, site);
            counter
        };
        self.counters = site.lines.iter().map(counter).collect();
    }

    /// Goes on from what an earlier process has counted, by the names of lines.
    pub fn restore(&mut self, totals: &BTreeMap<String, Totals>) {
        for counter in &mut self.counters {
            if let Some(totals) = totals.get(&counter.name) {
                counter.totals = *totals;
                counter.is_counted = true;
            }
        }
    }

    /// Takes all tracks at `at_s`, and how much of each line is known, in the order of the site; returns who has crossed.
    pub fn observe(
        &mut self,
        tracks: &[TrackState],
        known: impl IntoIterator<Item = ZoneKnown>,
        at_s: f64,
    ) -> Vec<Crossing> {
        let past_s = self.at_s.map_or(0.0, |before_s| (at_s - before_s).max(0.0));
        self.at_s = Some(at_s);
        let mut crossings = Vec::new();
        for ((line, counter), known) in (0..).zip(&mut self.counters).zip(known) {
            counter.state = known;
            if known != ZoneKnown::Known || past_s > GAP_S {
                counter.unknown_s += past_s;
            }
            counter.is_counted |= known == ZoneKnown::Known;
            for pass in counter.passing.observe(tracks, known, at_s) {
                let totals = &mut counter.totals;
                let total = match pass.direction {
                    Direction::In => &mut totals.inward,
                    Direction::Out => &mut totals.outward,
                };
                *total += 1;
                counter.is_counted = true;
                let passing::Pass { track, direction, since_s, at_s } = pass;
                crossings.push(Crossing { line, track, direction, at_s, since_s });
            }
        }
        crossings
    }

    /// How often each was crossed.
    #[must_use]
    pub fn counted(&self) -> Vec<CrossedLine> {
        let line = |counter: &Counter| CrossedLine {
            name: counter.name.clone(),
            inward: counter.is_counted.then_some(counter.totals.inward),
            outward: counter.is_counted.then_some(counter.totals.outward),
            state: counter.state,
            unknown_s: (counter.unknown_s * 10.0).round() / 10.0,
            unfollowed: counter.passing.overflow,
        };
        self.counters.iter().map(line).collect()
    }
}

#[cfg(test)]
mod tests;
