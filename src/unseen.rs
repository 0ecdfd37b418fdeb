//! Unseen spans: directions that are neither background nor candidate, and must not read as empty.
//!
//! ```text
//!  background ▁▁▁▁▁▁     ▁▁▁▁▁▁▁▁▁▁  ▁▁▁▁▁   a black coat returns nothing,
//!                   ?????          ╷╷        two beams hit a hand:
//!                   └ first step, beams      both are spans, with a reason
//! ```

use crate::scan::{Geometry, Scan};

/// Most spans in a scan: what a report has room for beside [`CANDIDATES`](crate::candidate::CANDIDATES)
/// candidates of the largest kind, see [`crate::wire`]; recordings of real scenes show 15 at most.
pub const UNSEEN_SPANS: usize = 28;

/// Why a direction is not known to be empty.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum UnseenReason {
    /// A wall is expected and nothing came back: dark clothing, a drop-out, a beam the scan lacks.
    NoReturn,
    /// Foreground of fewer than three beams, or a mixed pixel.
    TooShort,
    /// Candidates beyond the capacity, or spans merged because they were too many.
    Overflow,
}

/// Neighbouring beams not known to be empty.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct UnseenSpan {
    /// Step of the first beam.
    pub first_step: u16,
    /// Number of beams, 1 at least.
    pub beams: u16,
    /// Why.
    pub reason: UnseenReason,
    /// Nearest reading in it, mm, where there is one.
    pub near_mm: Option<u16>,
}

impl UnseenSpan {
    /// Beams of `geometry` it covers.
    #[must_use]
    pub fn beams_of(&self, geometry: &Geometry) -> core::ops::Range<usize> {
        let first = usize::from(geometry.beam(self.first_step));
        first..first + usize::from(self.beams)
    }

    /// The span from the first beam of either to the last of either.
    fn joined(self, other: Self, geometry: &Geometry) -> Self {
        let (one, two) = (self.beams_of(geometry), other.beams_of(geometry));
        let beams = one.end.max(two.end) - one.start.min(two.start);
        Self {
            first_step: self.first_step.min(other.first_step),
            beams: beams.min(usize::from(u16::MAX)) as u16,
            reason: UnseenReason::Overflow,
            near_mm: match (self.near_mm, other.near_mm) {
                (Some(one_mm), Some(two_mm)) => Some(one_mm.min(two_mm)),
                (one_mm, two_mm) => one_mm.or(two_mm),
            },
        }
    }

    /// Beams between the two, 0 when they touch or overlap.
    fn distance(&self, other: &Self, geometry: &Geometry) -> usize {
        let (one, two) = (self.beams_of(geometry), other.beams_of(geometry));
        two.start.saturating_sub(one.end).max(one.start.saturating_sub(two.end))
    }
}

/// The unseen spans of a scan. Beyond the capacity they grow together; none is dropped.
#[derive(Clone, Debug)]
pub struct UnseenSpans {
    spans: heapless::Vec<UnseenSpan, UNSEEN_SPANS>,
}

impl Default for UnseenSpans {
    fn default() -> Self {
        Self::new()
    }
}

impl UnseenSpans {
    /// No spans.
    #[must_use]
    pub const fn new() -> Self {
        Self { spans: heapless::Vec::new() }
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.spans.clear();
    }

    /// The spans, in the order they were found: by step, overflow last.
    #[must_use]
    pub fn as_slice(&self) -> &[UnseenSpan] {
        &self.spans
    }

    /// Adds `beams` beams from `first` on, with their nearest reading. When there is no room, the
    /// span nearest to them grows over them and whatever lies between. True when that happened.
    pub fn add(&mut self, first: usize, beams: usize, reason: UnseenReason, scan: &Scan<'_>) -> bool {
        let readings = (first..first + beams).filter_map(|beam| scan.reading(beam).range_mm());
        let new = UnseenSpan {
            first_step: scan.geometry.step(first.min(usize::from(u16::MAX)) as u16),
            beams: beams.min(usize::from(u16::MAX)) as u16,
            reason,
            near_mm: readings.min(),
        };
        let Err(new) = self.spans.push(new) else { return false };
        let nearest = self.spans.iter_mut().min_by_key(|span| span.distance(&new, scan.geometry));
        if let Some(nearest) = nearest {
            *nearest = nearest.joined(new, scan.geometry);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::{GeometryParts, ScanTime, URG_04LX};

    fn with_scan(geometry: Geometry, ranges_mm: &[u16], test: impl FnOnce(&Scan<'_>)) {
        test(&Scan { geometry: &geometry, ranges_mm, time: ScanTime::default() });
    }

    #[test]
    fn a_span_knows_its_nearest_reading_and_ignores_codes() {
        let mut ranges_mm = [0u16; 682];
        ranges_mm[100..103].copy_from_slice(&[1200, 7, 900]);
        with_scan(Geometry::new(URG_04LX).unwrap(), &ranges_mm, |scan| {
            let mut spans = UnseenSpans::new();
            assert!(!spans.add(100, 3, UnseenReason::TooShort, scan));
            assert!(!spans.add(10, 2, UnseenReason::NoReturn, scan));
            let short =
                UnseenSpan { first_step: 144, beams: 3, reason: UnseenReason::TooShort, near_mm: Some(900) };
            let lost = UnseenSpan { first_step: 54, beams: 2, reason: UnseenReason::NoReturn, near_mm: None };
            assert_eq!(spans.as_slice(), [short, lost]);
        });
    }

    #[test]
    fn spans_beyond_the_capacity_grow_the_nearest_and_cover_everything() {
        let geometry = Geometry::new(GeometryParts { cluster: 2, ..URG_04LX }).unwrap();
        with_scan(geometry, &[1000; 341], |scan| {
            let mut spans = UnseenSpans::new();
            let firsts: std::vec::Vec<usize> = (0..UNSEEN_SPANS + 10).map(|i| i * 5).collect();
            for &first in &firsts {
                spans.add(first, 2, UnseenReason::TooShort, scan);
            }
            assert_eq!(spans.as_slice().len(), UNSEEN_SPANS);
            for beam in firsts.iter().flat_map(|&first| [first, first + 1]) {
                let covered = |span: &UnseenSpan| span.beams_of(scan.geometry).contains(&beam);
                assert!(spans.as_slice().iter().any(covered), "beam {beam}");
            }
            assert_eq!(spans.as_slice().last().unwrap().reason, UnseenReason::Overflow);
        });
    }
}
