//! Which track is whom, so probably: identity beside position, never moving it.
//!
//! ```text
//!   card, tag ─▶ message ─▶ Sign: whose, when, where ─▶ ╭───────╮ ─▶ each ID: its tracks, the likeliest first
//!   tracks, every 0.1 s ──────────────────────────────▶ │ names │ ─▶ where is this ID?
//!                                                       ╰───────╯
//!   a sign at z      each track's likelihood × (ε + N(z; x, P + R)); the rest: none of the tracks
//!   time             what is known fades; a track that is gone takes its likelihood with it
//!   tracks touch     by distance and covariances they may have been swapped: their likelihoods become alike
//! ```
//!
//! | file | what |
//! |---|---|
//! | `sign` | a sign, and why one is not taken |
//! | `message` | a sign as a message from outside |
//! | `table` | tracks and IDs |
//! | `known` | what is known of an ID: the likelihoods themselves |
//! | `carried` | names that are read once and kept among tracks: those of other areas, and a door's cards |
//! | `believed` | names under one explanation of what was seen, where it has several |
//! | `person` | a track as names know it: agreement with a reading, swaps with others |
//! | `line` | what is said of them in a snapshot and to a question |
//!
//! The site's table, a door ([`crate::door::names`]) and a site of several areas keep names by this one model. They differ in which
//! readings they take, and in how soon they forget.
//!
//! Signs say where an ID is, never where a track is: tracks are the same bit by bit with and without them.
//!
//! Source: Ota et al. 2006 (docs/bibliography.md, paper B): positions and IDs have likelihoods apart from each other; an
//! ID that is read leaves positions alone (eq. 3 for its likelihood, eq. 4 for its decay). Its eq. 1, the mean place of an
//! ID over all particles, becomes: the likeliest track of an ID, and the probability of that.

mod believed;
mod carried;
mod known;
pub mod line;
pub mod message;
mod person;
pub mod sign;
mod table;
#[cfg(test)]
mod tests;

pub use carried::Carried;
pub use line::{Likelihood, NameLine, Whereabouts};
pub use sign::{NotTaken, Read, Sign, SignCounts};
pub use table::Names;
