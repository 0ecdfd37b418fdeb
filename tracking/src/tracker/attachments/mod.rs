//! What is no person of its own, whichever tracker follows it: things in tow, and things that were put down.
//!
//! ```text
//!   outlines ─▶ is it a box?   places ─▶ is it beside a person, all the way?   still for ─▶ does it stir?
//! ```
//!
//! Only judgements: who is compared with whom, and what follows, is each tracker's.

pub mod outlines;
pub mod reach;
pub mod stir;
