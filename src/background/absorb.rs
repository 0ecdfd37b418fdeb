//! Absorbing: a place the host has looked at becomes background.
//!
//! The module never absorbs anything that stands still on its own: only the host knows which track stands
//! there. The range the beams hold becomes their near mode, beside the wall behind, so
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
        for (at, (status, beam)) in self.statuses.iter().zip(&mut self.per_beam).take(self.beams).enumerate()
        {
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

#[cfg(test)]
mod tests {
    use super::super::fixture::BackgroundFixture;
    use super::*;

    const CHAIR: Absorb =
        Absorb { sequence: 0, first_step: 305, last_step: 314, nearest_mm: 1400, farthest_mm: 1600 };

    fn chair(beam: usize) -> u16 {
        if (5..15).contains(&beam) { 1500 } else { BackgroundFixture::room(beam) }
    }

    fn classes(fixture: &BackgroundFixture) -> std::vec::Vec<Class> {
        (4..16).map(|beam| fixture.background.class(beam)).collect()
    }

    #[test]
    fn an_absorbed_chair_is_background_and_so_is_the_wall_behind_it() {
        let mut fixture = BackgroundFixture::learned();
        let version = fixture.background.version();
        fixture.scan(chair);
        assert_eq!(fixture.background.absorb(CHAIR, &fixture.geometry, fixture.now_ds), Ok(10));
        assert_eq!(fixture.background.version(), version + 1);
        assert_eq!((fixture.profile(9).near_mm, fixture.profile(9).far_mm), (1500, 4000));
        fixture.scan(chair);
        assert_eq!(classes(&fixture), [Class::Background; 12]);
        fixture.scan(BackgroundFixture::room);
        assert_eq!(classes(&fixture), [Class::Background; 12]);
        fixture.scan(|beam| {
            if beam == 9 {
                1300
            } else if beam == 11 {
                2500
            } else {
                chair(beam)
            }
        });
        assert_eq!(
            (fixture.background.class(9), fixture.background.class(11)),
            (Class::Foreground, Class::Foreground)
        );
    }

    #[test]
    fn the_next_learn_undoes_it() {
        let mut fixture = BackgroundFixture::learned();
        fixture.scan(chair);
        fixture.background.absorb(CHAIR, &fixture.geometry, fixture.now_ds).unwrap();
        fixture.learn(60, |_, beam| BackgroundFixture::room(beam));
        assert_eq!(fixture.profile(9).near_mm, 0);
    }

    #[test]
    fn every_refusal_has_its_name_and_changes_nothing() {
        let mut fixture = BackgroundFixture::new();
        assert_eq!(fixture.background.absorb(CHAIR, &fixture.geometry, 0), Err(AbsorbRefusal::NoBackground));
        let mut fixture = BackgroundFixture::learned();
        let version = fixture.background.version();
        fixture.scan(|beam| if beam < 12 { chair(beam) } else { BackgroundFixture::room(beam) });
        let mut refused = |wish| fixture.background.absorb(wish, &fixture.geometry, 0).unwrap_err();
        assert_eq!(refused(CHAIR), AbsorbRefusal::Moved);
        assert_eq!(refused(Absorb { nearest_mm: 1700, farthest_mm: 1800, ..CHAIR }), AbsorbRefusal::Moved);
        assert_eq!(refused(Absorb { first_step: 315, ..CHAIR }), AbsorbRefusal::Span);
        assert_eq!(refused(Absorb { nearest_mm: 1601, ..CHAIR }), AbsorbRefusal::Span);
        assert_eq!(refused(Absorb { first_step: 0, last_step: 299, ..CHAIR }), AbsorbRefusal::Span);
        assert_eq!(fixture.background.version(), version);
    }
}
