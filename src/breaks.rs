//! The break distance: how far apart two neighbouring readings of one thing may lie.
//!
//! ```text
//!   range        ╭───╮
//!            ○  ╱     ╲   ○     a step along the flank of a body: joined
//!            │                  a step of more than that: another thing
//!            └▁▁▁▁▁▁▁▁▁▁▁▁▁ beams
//! ```

use crate::scan::Geometry;

/// Least range step that parts two things, mm. Two people whose ranges differ by less than 0.12 m
/// are one cluster anyway (noise, clothing, arms): the value of the reference simulation.
pub const BREAK_MM: u32 = 120;

/// Radius of the roundest flank a body turns towards a sensor, mm: half the width of a torso. Beams
/// `s` apart sideways differ by at most √(2 · radius · s) on it, which is 104 mm at 4 m for a URG.
pub const FLANK_RADIUS_MM: u32 = 220;

/// The break distance of one geometry.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Breaks {
    /// Angle between neighbouring beams, 1/65 536 rad.
    beam_q16: u32,
}

impl Breaks {
    /// Beams in one direction: the least break distance everywhere.
    pub(crate) const NONE: Self = Self { beam_q16: 0 };

    /// For the beams of `geometry`.
    #[must_use]
    pub(crate) fn of(geometry: &Geometry) -> Self {
        Self { beam_q16: (geometry.beam_rad() * 65_536.0) as u32 }
    }

    /// Distance sideways between beams `apart` places from each other at `range_mm`, mm.
    #[must_use]
    pub(crate) fn sideways_mm(self, range_mm: u16, apart: usize) -> u32 {
        let one_mm = u64::from(range_mm) * u64::from(self.beam_q16) / 65_536;
        (one_mm as u32).saturating_mul(apart.min(1 << 12) as u32)
    }

    /// Whether readings `apart` beams from each other belong to one thing.
    #[must_use]
    pub(crate) fn joins(self, one_mm: u16, other_mm: u16, apart: usize) -> bool {
        let step_mm = u32::from(one_mm.abs_diff(other_mm));
        // Squared, so that no root is needed.
        step_mm <= BREAK_MM
            || step_mm * step_mm
                <= self.sideways_mm(one_mm.min(other_mm), apart).saturating_mul(2 * FLANK_RADIUS_MM)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::{GeometryParts, URG_04LX};

    #[test]
    fn the_flank_of_a_distant_body_holds_together() {
        // 10 m away beams are 61 mm apart, and the last one on a torso may lie 164 mm behind the one before.
        let ranges_mm = [10_000, 10_000, 10_000, 10_160, 4000];
        let parts = GeometryParts { range_max_mm: 30_000, ..URG_04LX };
        let breaks = Breaks::of(&Geometry::new(parts).unwrap());
        assert!(breaks.joins(ranges_mm[2], ranges_mm[3], 1));
        assert!(!breaks.joins(4000, 4160, 1));
    }
}
