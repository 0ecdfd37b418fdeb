//! A reading of a floor in the site: which panels are down, when, and which do not work.
//!
//! ```text
//!   datagram `pressed` ─▶ session: sequence, clock, place ─▶ Reading        no panel down is a reading, too;
//!                                                                          silence is none
//! ```

use kehai::floor::{Bits, FAULTY};
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
    /// The panels that do not work, in order and at most [`FAULTY`]: nothing is known there.
    pub faulty: Vec<FaultyPanel>,
}

impl Reading {
    /// The panel from which on nothing is known: where the list of faulty panels is full there may be more behind the last one.
    #[must_use]
    pub fn unknown_from(&self) -> Option<u16> {
        unknown_from(&self.faulty)
    }

    /// Whether a panel says that a foot is on it, or that none is.
    #[must_use]
    pub fn works(&self, panel: usize) -> bool {
        let is_named = self.faulty.iter().any(|faulty| usize::from(faulty.panel) == panel);
        !is_named && self.unknown_from().is_none_or(|from| panel < usize::from(from))
    }
}

/// The panel from which on nothing is known, by the list of faulty panels: where it is full there may be more behind the last one.
#[must_use]
pub fn unknown_from(faulty: &[FaultyPanel]) -> Option<u16> {
    faulty.last().filter(|_| faulty.len() >= FAULTY).map(|last| last.panel.saturating_add(1))
}
