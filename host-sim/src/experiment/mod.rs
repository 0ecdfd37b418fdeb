//! What comes out of an experiment: a table of trackers in scenes, and its picture.
//!
//! ```text
//! Plan ─┬▶ Case: the door area ──▶ runner (seed by seed, ─▶ Row: scene, people, tracker ─▶ CSV · Markdown · SVG
//!       └▶ Trial: one scene, one rule ─▶ on all cores) ──▶ Pooled: trial, tracker ───────▶ CSV · Markdown
//!                                                                       Markdown ─▶ docs/accuracy.md (`page`)
//! ```

mod cores;
pub mod findings;
pub mod log;
pub mod page;
pub mod paper;
pub mod passages;
pub mod picture;
pub mod plan;
pub mod poses;
pub mod rules;
pub mod runner;
pub mod table;
pub mod trial;

pub use self::table::{Cell, Outcome, Row};
