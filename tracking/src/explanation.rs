//! One way to explain what was seen, where there are several: who is where if it is right, and what it grew out of.
//!
//! ```text
//!            ╭─ 4 ──┬─ 4 ──── 4      likeliest: its people are the tracks
//!   4 ───────┤      ╰─ 7 ──── 7      7 ◁ 4
//!            ╰─ 5 ──── 5 ─┬── 5      5 ◁ 4
//!                         ╰── 9      9 ◁ 5 ◁ 4
//! ```
//!
//! Tracks are those of the likeliest explanation. What is known of them beside their places, such as names, is handed on from
//! each explanation to those that grow out of it, so that it is still right when another becomes the likeliest.

use crate::tracker::TrackState;

/// As many of those that it grew out of are told: explanations live for a few steps.
pub const ELDERS_MAX: usize = 16;

/// An explanation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Explanation {
    /// Its number, and after it those that it grew out of, the newest first; at least one, and at most [`ELDERS_MAX`] more.
    pub line: Vec<u64>,
    /// Natural logarithm of how much likelier the likeliest explanation is.
    pub surprise: f64,
    /// Those whose place it explains.
    pub people: Vec<TrackState>,
}
