//! What comes out of an experiment: tables of trackers in scenes, their pages and a picture.
//!
//! ```text
//! plan ─┬▶ Case: the door area ────────┐
//!       ├▶ Trial: one scene, one rule ─┤─▶ jobs: seed by seed, on all cores ─▶ results ─┬─▶ docs/tables/*.csv (`line`)
//!       ├▶ passages: the guarded door ─┤                                                └─▶ docs/*.md (`summary`, `pages`)
//!       ├▶ poses: calibration ─────────┤
//!       ├▶ entrance: a depth camera ───┤
//!       ├▶ floor, silences: paper B ───┤
//!       ├▶ both: floor and modules ────┤
//!       ├▶ lines: people counted ──────┤
//!       ├▶ worlds, cases: other worlds ┤
//!       └▶ counts: how sure they are ──┘
//! ```

pub mod both;
pub mod cases;
pub mod counts;
pub mod counts_picture;
pub mod counts_table;
pub mod entrance;
pub mod figure;
pub mod findings;
pub mod floor;
pub mod in_view;
pub mod jobs;
pub mod line;
pub mod lines;
pub mod log;
pub mod pages;
pub mod paper;
pub mod passages;
pub mod picture;
pub mod plan;
pub mod poses;
pub mod results;
pub mod rules;
pub mod runner;
pub mod silences;
pub mod sources;
pub mod summary;
pub mod table;
pub mod trial;
pub mod worlds;

pub use self::results::Results;
pub use self::table::{Cell, Outcome, Row};
