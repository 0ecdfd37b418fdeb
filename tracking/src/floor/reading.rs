//! A reading of a floor in the site: which panels are down, when, and which do not work.
//!
//! ```text
//!   datagram `pressed` ─▶ session: sequence, clock, place ─▶ Reading        no panel down is a reading, too;
//!                                                                          silence is none
//! ```

use kehai::floor::Bits;
use kehai::wire::FaultyPanel;

use super::plan::Plan;

/// A reading of a floor.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// Number of the floor in the site.
    pub floor: usize,
    /// Where its panels are.
    pub plan: Plan,
    /// When it was read, s on the host's clock.
    pub at_s: f64,
    /// The panels that are down.
    pub down: Bits,
    /// The panels that do not work: nothing is known there.
    pub faulty: Vec<FaultyPanel>,
}
