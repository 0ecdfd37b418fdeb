//! The host tracker's place: reports of many modules in, counted and followed people out.
//!
//! ```text
//! reports ─▶ one time line ─▶ predict ─▶ associate ─▶ update ─▶ tracks ─▶ zones · doors · counts
//! (kehai::wire)  module clocks    life cycle: tentative ─▶ confirmed ⇄ occluded ─▶ deleted
//! ```
//!
//! Not built yet. What modules send can be read with [`kehai::wire`] today.
#![forbid(unsafe_code)]
