//! The laboratory: a simulated world, runs of it through the real core and tracker, experiments and their scores.
//!
//! ```text
//! world ─▶ run ─▶ kehai's tasks ─▶ reports ─▶ tracker or baseline ─▶ score ─▶ tables, pictures
//! truth ──────────────────────────────────────────────────────────────▲
//! ```
#![forbid(unsafe_code)]

pub mod baselines;
pub mod building;
pub mod devices;
pub mod entrance;
pub mod experiment;
pub mod floor;
pub mod halls;
pub mod jsonl;
pub mod passage;
pub mod picture;
pub mod plan;
pub mod replay;
pub mod run;
pub mod score;
pub mod soak;
pub mod world;
