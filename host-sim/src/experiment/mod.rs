//! What comes out of an experiment: a table of trackers in scenes, and its picture.
//!
//! ```text
//! Plan ─▶ runner (seed by seed, on all cores) ─▶ Row: one scene, one number of people, one tracker ─▶ CSV · Markdown · SVG
//! ```

pub mod paper;
pub mod picture;
pub mod plan;
pub mod runner;
pub mod table;

pub use self::table::{Cell, Outcome, Row};
