//! What a host can say is empty: background profile, candidates and unseen spans together are the
//! whole visibility of a scan.
//!
//! ```text
//!   wall ┃▁▁▁▁▁▁▁▁▁┃           open ─ ─ ─ ─ ─ ─ ─   as far as black clothing would be seen
//!        ┃░░░░░░░░░┃                ░░░░░░░░░░░░
//!        ┃░░ empty ┃   ●──╮    ?    ░░░░░░░░░░░░    in front of a candidate: up to its nearest range
//!        ┃░░░░░░░░░┃░░░╰──╯░░░ ?    ░░░░░░░░░░░░    unseen span, unknown beam: nothing
//! ```
//!
//! Never more than the scan itself saw. A beam counts as empty only up to where the *nearest* mode
//! begins that could have been taken for its background, its neighbours' within the dilation
//! included: the host cannot know which of them answered.

use crate::background::{BeamProfile, BeamState, DILATION_BEAMS};
use crate::candidate::Candidate;
use crate::scan::Geometry;
use crate::unseen::UnseenSpan;

/// Writes into `empty_mm`, beam by beam, up to which range the scan saw nothing; 0: not known.
///
/// `profile` is the background version the report names, one item a beam; `open_range_mm` the
/// model's range for 10 % reflectance. Beams without a profile are not known.
pub fn seen_empty(
    geometry: &Geometry,
    profile: &[BeamProfile],
    candidates: &[Candidate],
    unseen: &[UnseenSpan],
    open_range_mm: u16,
    empty_mm: &mut [u16],
) {
    empty_before(profile, open_range_mm, empty_mm);
    cover(geometry, candidates.iter(), unseen.iter().copied(), empty_mm);
}

/// The part that only depends on the background: up to which range a beam at its background saw nothing.
pub fn empty_before(profile: &[BeamProfile], open_range_mm: u16, empty_mm: &mut [u16]) {
    empty_mm.fill(0);
    for (beam, (own, empty_mm)) in profile.iter().zip(empty_mm.iter_mut()).enumerate() {
        let first = beam.saturating_sub(DILATION_BEAMS);
        let around = profile.iter().skip(first).take(beam - first + 1 + DILATION_BEAMS);
        let edge_mm = around.filter_map(BeamProfile::nearest_edge_mm).min().unwrap_or(u16::MAX);
        *empty_mm = match own.state {
            BeamState::Unknown => 0,
            BeamState::Open => edge_mm.min(open_range_mm),
            BeamState::Wall => edge_mm,
        };
    }
}

/// The part of one scan: what stood before the background, and what was not seen.
pub fn cover<'a>(
    geometry: &Geometry,
    candidates: impl Iterator<Item = &'a Candidate>,
    unseen: impl Iterator<Item = UnseenSpan>,
    empty_mm: &mut [u16],
) {
    for candidate in candidates {
        let (first, last) = (geometry.beam(candidate.first_step), geometry.beam(candidate.last_step));
        let beams = usize::from(last.saturating_sub(first)) + 1;
        let whole = usize::from(candidate.beams) == beams;
        for empty_mm in empty_mm.iter_mut().skip(usize::from(first)).take(beams) {
            *empty_mm = if whole { candidate.near_mm } else { 0 };
        }
    }
    for span in unseen {
        let beams = span.beams_of(geometry);
        for empty_mm in empty_mm.iter_mut().skip(beams.start).take(beams.len()) {
            *empty_mm = 0;
        }
    }
}
