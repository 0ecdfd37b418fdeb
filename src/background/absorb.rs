//! Absorbing: a place the host has looked at becomes background.
//!
//! Nothing that stands still is ever absorbed by the module on its own: the host knows who is
//! standing there. The range the beams hold becomes their near mode, beside the wall behind, so
//! that a door leaf or a chair may come and go; the next `learn` undoes it.

use super::{Background, Class, noise_mm};
use crate::scan::Geometry;

/// Beams of the span that must still be in the band, of 5.
const STILL_THERE_OF_5: usize = 4;

/// What to absorb: the foreground that a report showed between two steps, within a band of ranges.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Absorb {
    /// Sequence of the report the host looked at.
    pub sequence: u32,
    /// First step, inclusive.
    pub first_step: u16,
    /// Last step, inclusive.
    pub last_step: u16,
    /// Nearest range of the thing, mm.
    pub nearest_mm: u16,
    /// Farthest range of the thing, mm.
    pub farthest_mm: u16,
}

/// Why nothing was absorbed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AbsorbRefusal {
    /// No background has been learned.
    NoBackground,
    /// Steps or ranges in the wrong order, or no step of the scan among them.
    Span,
    /// A report that was never made, or one older than [`ABSORB_AGE_SCANS`](crate::pipeline::ABSORB_AGE_SCANS).
    Report,
    /// The latest scan shows something else there.
    Moved,
}

impl core::fmt::Display for AbsorbRefusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NoBackground => "no background has been learned",
            Self::Span => "no such steps or ranges",
            Self::Report => "that report is too old or was never made",
            Self::Moved => "the latest scan shows something else there",
        })
    }
}

impl core::error::Error for AbsorbRefusal {}

impl<const BEAMS: usize> Background<BEAMS> {
    /// Makes what the latest scan shows in the span a part of the background, and publishes.
    /// Returns how many beams took it. The report is not checked here.
    ///
    /// # Errors
    /// [`AbsorbRefusal`]; then nothing has changed.
    pub(crate) fn absorb(
        &mut self,
        wish: Absorb,
        geometry: &Geometry,
        now_ds: u32,
    ) -> Result<u16, AbsorbRefusal> {
        if !self.known {
            return Err(AbsorbRefusal::NoBackground);
        }
        if wish.first_step > wish.last_step || wish.nearest_mm > wish.farthest_mm {
            return Err(AbsorbRefusal::Span);
        }
        let band = wish.nearest_mm..=wish.farthest_mm;
        let span = wish.first_step..=wish.last_step;
        let mut beams = 0;
        let mut there = 0;
        for (at, (status, beam)) in self.statuses.iter().zip(&self.per_beam).take(self.beams).enumerate() {
            if span.contains(&geometry.step(at as u16)) {
                beams += 1;
                there += usize::from(status.class() == Class::Foreground && band.contains(&beam.held_mm));
            }
        }
        if beams == 0 {
            return Err(AbsorbRefusal::Span);
        }
        if there * 5 < beams * STILL_THERE_OF_5 {
            return Err(AbsorbRefusal::Moved);
        }
        for (at, (status, beam)) in self.statuses.iter().zip(&mut self.per_beam).take(self.beams).enumerate() {
            let inside = span.contains(&geometry.step(at as u16)) && band.contains(&beam.held_mm);
            if inside && status.class() == Class::Foreground {
                beam.profile.near_mm = beam.held_mm;
                beam.profile.spread_mm = beam.profile.spread_mm.max(noise_mm(beam.held_mm));
            }
        }
        self.refresh(0, self.beams, geometry);
        self.publish(now_ds);
        Ok(there.min(usize::from(u16::MAX)) as u16)
    }
}
