//! Things in a learned background that have the shape of a person: a person may have stood still.
//!
//! ```text
//!        ▁▁▁▁▁▁▁▁▁▁▁▁▁▁ wall          free on both sides, as wide as a body,
//!              ╭─╮                    and bulging towards the sensor
//!              ╰─╯
//!               ● sensor
//! ```

use super::{Beam, BeamProfile, BeamState};
use crate::breaks::Breaks;
use crate::math;
use crate::scan::Geometry;

/// Most suspects reported.
pub const SUSPECTS: usize = 8;

/// Chords a person can have, mm: from a leg together with the other one to a wide coat.
const BODY_MM: core::ops::RangeInclusive<f32> = 200.0..=700.0;

/// How far behind a suspect its surroundings are, mm at least: an arm's depth.
const FREE_MM: u16 = 300;

/// How far its middle stands out of the chord between its ends, mm at least.
const BULGE_MM: f32 = 10.0;

/// Something in the background for the host to confirm or mask.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Suspect {
    /// Its first step.
    pub first_step: u16,
    /// Its last step.
    pub last_step: u16,
    /// Its nearest range, mm.
    pub near_mm: u16,
}

/// The first [`SUSPECTS`] of a background.
pub(super) fn find(beams: &[Beam], geometry: &Geometry) -> heapless::Vec<Suspect, SUSPECTS> {
    let mut suspects = heapless::Vec::new();
    let breaks = Breaks::of(geometry);
    let mut start = 0;
    while start < beams.len() {
        let rest = beams.get(start..).unwrap_or(&[]);
        let length = surface_length(rest, breaks);
        let before = start.checked_sub(1).and_then(|beam| beams.get(beam));
        let after = rest.get(length);
        if let Some(suspect) =
            rest.get(..length).and_then(|surface| examine(surface, start, before, after, geometry))
            && suspects.push(suspect).is_err()
        {
            break;
        }
        start += length.max(1);
    }
    suspects
}

/// Beams at the start of `beams` that show one surface; 0 when the first shows none.
fn surface_length(beams: &[Beam], breaks: Breaks) -> usize {
    let mut last_mm = None;
    let same = beams.iter().take_while(|Beam { profile, .. }| {
        let joined = profile.state == BeamState::Wall
            && last_mm.is_none_or(|last_mm| breaks.joins(last_mm, profile.far_mm, 1));
        last_mm = Some(profile.far_mm);
        joined
    });
    same.count()
}

fn examine(
    surface: &[Beam],
    start: usize,
    before: Option<&Beam>,
    after: Option<&Beam>,
    geometry: &Geometry,
) -> Option<Suspect> {
    let (first, last, middle) =
        (surface.first()?.profile, surface.last()?.profile, surface.get(surface.len() / 2)?.profile);
    let free = |end: BeamProfile, beyond: Option<&Beam>| {
        beyond.is_some_and(|Beam { profile: beyond, .. }| match beyond.state {
            BeamState::Unknown => false,
            BeamState::Open => true,
            BeamState::Wall => beyond.far_mm > end.far_mm.saturating_add(FREE_MM),
        })
    };
    let angle_rad = (surface.len() - 1) as f32 * geometry.beam_rad();
    let (first_mm, last_mm) = (f32::from(first.far_mm), f32::from(last.far_mm));
    let chord_mm = math::chord(first_mm, last_mm, angle_rad);
    let (_, half_cosine) = math::sin_cos(angle_rad * 0.5);
    let chord_range_mm = 2.0 * first_mm * last_mm * half_cosine / (first_mm + last_mm).max(1.0);
    let bulges = f32::from(middle.far_mm) + BULGE_MM <= chord_range_mm;
    let body = BODY_MM.contains(&chord_mm) && bulges && free(first, before) && free(last, after);
    let near_mm = surface.iter().map(|beam| beam.profile.far_mm).min()?;
    body.then(|| Suspect {
        first_step: geometry.step(start as u16),
        last_step: geometry.step((start + surface.len() - 1) as u16),
        near_mm,
    })
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{BEAMS, BackgroundFixture};
    use super::*;

    /// The ranges of a body 0.36 m wide in front of the wall, 23 beams around beam 25 at 2.4 m.
    fn body(beam: usize) -> Option<u16> {
        let aside_mm = (beam as f32 - 25.0) * 0.006_136 * 2600.0;
        let inside = 180.0 * 180.0 - aside_mm * aside_mm;
        (inside > 0.0).then(|| (2600.0 - math::sqrt(inside)) as u16)
    }

    #[test]
    fn a_person_that_stood_through_the_learning_is_a_suspect() {
        let mut fixture = BackgroundFixture::new();
        fixture.learn(60, |_, beam| body(beam).unwrap_or(4000));
        let [suspect] = fixture.background.suspects() else { panic!("one suspect") };
        assert!((312..316).contains(&suspect.first_step) && (335..338).contains(&suspect.last_step));
        assert_eq!(suspect.near_mm, 2420);
    }

    #[test]
    fn walls_corners_and_flat_boards_are_not() {
        let mut fixture = BackgroundFixture::new();
        fixture.learn(60, |_, beam| match beam {
            // A board 0.4 m wide across the view: its ends are farther than its middle by no more than geometry asks.
            10..36 => (2500.0 / math::sin_cos((beam as f32 - 22.5) * 0.006_136).1) as u16,
            // A body at the edge of what is behind: not free on one side.
            _ if beam >= BEAMS - 12 => 3800,
            _ => 4000,
        });
        assert_eq!(fixture.background.suspects(), []);
    }
}
