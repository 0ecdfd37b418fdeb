//! Segments of a depth camera to people, followed in time.
//!
//! ```text
//!   segments (place, outline, top, volume) ─▶ assign ─┬─ own segment ────── update, trusted as much as is seen
//!                                                     ├─ shares a segment ─ two people seen as one: moves with it
//!                                                     ├─ behind another ─── hidden: carried on
//!                                                     └─ nothing there ──── gone
//! ```
//!
//! Bodies neither appear nor vanish in mid-view: a track without a segment is first looked for in the segments of others
//! and behind them, and a segment without a track must be too far from every body to be a part of it.

mod bodies;
mod seen;
#[cfg(test)]
mod tests;

pub use bodies::{Bodies, Followed, Ideas, Where};
pub use seen::{Seen, Sight};
