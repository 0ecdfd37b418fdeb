//! Candidates: the detections of a scan, in so few numbers that they can be sent.
//!
//! ```text
//!                  beyond                        first and last step, their ranges and ends:
//!    ─ ─ ─ ─ ─ ─ ─ ─┐                   ┌─ ─ ─   free, cut by a body or a wall, neck, edge of view
//!                   │ step              │
//!                   ●                   ●        contour: ranges at equal bearings between the
//!              first ╲ ·   neck ▲    · ╱ last    ends, relative to the nearest
//!                     ╲·╭──╮╱ ╲╭──╮·╱
//!                       ●  ╰╯   ╰──╯             necks: the run is never split here
//!                     near      mid
//! ```
//!
//! A candidate is one cluster, whole: two people that touch are one, and the host, which knows where
//! they were, divides it. All numbers are mm and steps; about 30 bytes on the wire. The ablations
//! behind the choice of fields: only the kind of the ends is significant on its own.

use crate::breaks::Breaks;
use crate::cluster::Cluster;
use crate::outline::{self, Median, range_at};
pub use crate::outline::{
    CONTOUR_POINTS, CONTOUR_POINTS_WIDE, CONTOUR_UNIT_MM, NECK_MM, NECKS, Neck, WIDE_MM,
};
use crate::scan::Scan;

/// Most candidates in a scan: what one datagram can carry beside its spans, and four times what a
/// crowd of ten showed at worst (9).
pub const CANDIDATES: usize = 24;

/// Chord between the end points below which a candidate is flagged narrow, mm. A torso shows 290
/// to 420 mm, a leg 70 to 130 mm.
pub const NARROW_MM: f32 = 200.0;

/// Beams whose median says how long a candidate has stood.
const STATIC_BEAMS: usize = 7;

/// Beams looked at beyond an end for what is there: drop-outs beside a body last one or two.
const BEYOND_BEAMS: usize = 3;

/// How an end of a candidate ends.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum EndKind {
    /// Free silhouette: what lies beyond is farther, or nothing.
    #[default]
    Free,
    /// Cut by a nearer foreground thing.
    Body,
    /// Cut by a nearer part of the background.
    Wall,
    /// Cut by the edge of the scan.
    View,
    /// Goes on in a foreground neighbour at about the same range, parted only by beams that returned nothing.
    Neck,
}

/// One end of a candidate.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct End {
    /// How it ends.
    pub kind: EndKind,
    /// Range beyond less range at the end, mm; `i16::MAX` when nothing returned there.
    pub step_mm: i16,
}

/// What was seen of one foreground thing. See the module's picture.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Candidate {
    /// Step of the first beam.
    pub first_step: u16,
    /// Step of the last beam.
    pub last_step: u16,
    /// Range of the first beam, mm.
    pub first_mm: u16,
    /// Range at the middle bearing, mm: the median of five beams.
    pub mid_mm: u16,
    /// Range of the last beam, mm.
    pub last_mm: u16,
    /// Nearest range, mm.
    pub near_mm: u16,
    /// Its step.
    pub near_step: u16,
    /// Beams with a return, of those from the first to the last.
    pub beams: u16,
    /// The end at the first step.
    pub first_end: End,
    /// The end at the last step.
    pub last_end: End,
    /// Ranges at equal bearings between the ends, less the nearest, in [`CONTOUR_UNIT_MM`], at most 255.
    pub contour: heapless::Vec<u8, CONTOUR_POINTS_WIDE>,
    /// The deepest necks, by step.
    pub necks: heapless::Vec<Neck, NECKS>,
    /// No beam at its background lies between this and a neighbour.
    pub touches: bool,
    /// The chord between the ends is under [`NARROW_MM`].
    pub narrow: bool,
    /// Median time its beams have held their range, 0.1 s, by sensor stamps.
    pub static_ds: u16,
}

impl Candidate {
    /// Range at contour point `point`, mm.
    #[must_use]
    pub fn contour_mm(&self, point: usize) -> Option<u16> {
        let offset = u16::from(*self.contour.get(point)?);
        Some(self.near_mm.saturating_add(offset * CONTOUR_UNIT_MM))
    }
}

/// What stands beside a candidate, as the pipeline sees it.
pub(crate) trait Surroundings {
    /// Whether beam `beam` shows foreground.
    fn is_foreground(&self, beam: usize) -> bool;
    /// For how long beam `beam` has held its range, 0.1 s.
    fn held_ds(&self, beam: usize) -> u16;
}

/// Describes a cluster of `scan`.
pub(crate) fn describe(
    scan: &Scan<'_>,
    cluster: Cluster,
    breaks: Breaks,
    around: &impl Surroundings,
) -> Candidate {
    let step = |beam: usize| scan.geometry.step(beam.min(usize::from(u16::MAX)) as u16);
    let (near, near_mm) = outline::nearest(scan, cluster);
    let (first_mm, last_mm) = (range_at(scan, cluster.first), range_at(scan, cluster.last));
    let chord_mm = outline::chord_mm(scan, cluster);
    let first = end(scan, cluster.first, first_mm, Side::Before, breaks, around);
    let last = end(scan, cluster.last, last_mm, Side::After, breaks, around);
    Candidate {
        first_step: step(cluster.first),
        last_step: step(cluster.last),
        first_mm,
        mid_mm: outline::mid_mm(scan, cluster),
        last_mm,
        near_mm,
        near_step: step(near),
        beams: cluster.valid,
        first_end: first.0,
        last_end: last.0,
        contour: outline::contour(scan, cluster, near_mm, chord_mm),
        necks: outline::necks(scan, cluster),
        touches: first.1 || last.1,
        narrow: chord_mm < NARROW_MM,
        static_ds: static_ds(cluster, around),
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Side {
    Before,
    After,
}

/// How a cluster ends at `beam`, and whether it touches a neighbour there. A stray foreground beam
/// beside it, a mixed pixel more often than not, is looked past.
fn end(
    scan: &Scan<'_>,
    beam: usize,
    end_mm: u16,
    side: Side,
    breaks: Breaks,
    around: &impl Surroundings,
) -> (End, bool) {
    let outwards = |distance: usize| match side {
        Side::Before => beam.checked_sub(distance),
        Side::After => beam.checked_add(distance).filter(|&beam| beam < scan.ranges_mm.len()),
    };
    if outwards(1).is_none() {
        return (End { kind: EndKind::View, step_mm: i16::MAX }, false);
    }
    for distance in 1..=BEYOND_BEAMS {
        let Some(beyond) = outwards(distance) else { break };
        let Some(beyond_mm) = scan.reading(beyond).range_mm() else { continue };
        let touches = around.is_foreground(beyond);
        let goes_on = outwards(distance + 1).is_some_and(|next| {
            let next_mm = scan.reading(next).range_mm();
            around.is_foreground(next) && next_mm.is_some_and(|next_mm| breaks.joins(beyond_mm, next_mm, 1))
        });
        if touches && !goes_on {
            continue;
        }
        let step_mm = i32::from(beyond_mm) - i32::from(end_mm);
        let kind = if touches && breaks.joins(end_mm, beyond_mm, distance) {
            EndKind::Neck
        } else if step_mm >= 0 {
            EndKind::Free
        } else if touches {
            EndKind::Body
        } else {
            EndKind::Wall
        };
        let step_mm = step_mm.clamp(i32::from(i16::MIN), i32::from(i16::MAX)) as i16;
        return (End { kind, step_mm }, touches);
    }
    (End { kind: EndKind::Free, step_mm: i16::MAX }, false)
}

/// Median over [`STATIC_BEAMS`] beams, evenly spread.
fn static_ds(cluster: Cluster, around: &impl Surroundings) -> u16 {
    let mut sorted = Median::<STATIC_BEAMS>::new();
    for part in 0..STATIC_BEAMS {
        let beam = cluster.first + (2 * part + 1) * cluster.beams() / (2 * STATIC_BEAMS);
        if around.is_foreground(beam) {
            sorted.add(around.held_ds(beam));
        }
    }
    sorted.median()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::{Geometry, GeometryParts, ScanTime, URG_04LX};
    use std::vec;
    use std::vec::Vec;

    /// Foreground is whatever is nearer than 3.9 m.
    struct Nearer<'a>(&'a [u16]);

    impl Surroundings for Nearer<'_> {
        fn is_foreground(&self, beam: usize) -> bool {
            self.0.get(beam).is_some_and(|&range_mm| (20..3900).contains(&range_mm))
        }

        fn held_ds(&self, beam: usize) -> u16 {
            beam as u16 * 10
        }
    }

    fn describe_beams(ranges_mm: &[u16], first: usize, last: usize) -> Candidate {
        let last_step = 300 + ranges_mm.len() as u16 - 1;
        let geometry = Geometry::new(GeometryParts { first_step: 300, last_step, ..URG_04LX }).unwrap();
        let scan = Scan { geometry: &geometry, ranges_mm, time: ScanTime::default() };
        let valid = ranges_mm[first..=last].iter().filter(|&&range_mm| range_mm >= 20).count();
        let cluster = Cluster { first, last, valid: valid as u16 };
        describe(&scan, cluster, Breaks::of(&geometry), &Nearer(ranges_mm))
    }

    /// `beams` readings of a flat thing at `range_mm` between two pieces of wall.
    fn thing(beams: usize, range_mm: u16) -> Vec<u16> {
        [vec![4000; 5], vec![range_mm; beams], vec![4000; 5]].concat()
    }

    #[test]
    fn a_body_before_a_wall_has_two_free_ends_and_the_step_to_the_wall() {
        let mut ranges_mm = thing(30, 2000);
        ranges_mm[12] = 1950;
        let candidate = describe_beams(&ranges_mm, 5, 34);
        assert_eq!((candidate.first_step, candidate.last_step, candidate.beams), (305, 334, 30));
        assert_eq!((candidate.near_mm, candidate.near_step, candidate.mid_mm), (1950, 312, 2000));
        let free = End { kind: EndKind::Free, step_mm: 2000 };
        assert_eq!((candidate.first_end, candidate.last_end), (free, free));
        assert_eq!(candidate.static_ds, 200);
        assert!(!candidate.narrow && !candidate.touches);
    }

    #[test]
    fn narrow_is_a_chord_under_two_hundred_millimetres() {
        // 16 gaps of 12.27 mm make 196 mm at 2 m; 17 make 209.
        assert!(describe_beams(&thing(17, 2000), 5, 21).narrow);
        assert!(!describe_beams(&thing(18, 2000), 5, 22).narrow);
    }

    #[test]
    fn ends_say_what_cuts_them() {
        let mut ranges_mm = thing(30, 2000);
        ranges_mm[..5].fill(1500);
        ranges_mm[35..].fill(0);
        let candidate = describe_beams(&ranges_mm, 5, 34);
        assert_eq!(candidate.first_end, End { kind: EndKind::Body, step_mm: -500 });
        assert_eq!(candidate.last_end, End { kind: EndKind::Free, step_mm: i16::MAX });
        assert!(candidate.touches);
        // The nearer one of the two is free on that side.
        assert_eq!(describe_beams(&ranges_mm, 0, 4).last_end, End { kind: EndKind::Free, step_mm: 500 });
        assert_eq!(describe_beams(&ranges_mm, 0, 4).first_end.kind, EndKind::View);
    }

    #[test]
    fn a_nearer_wall_and_a_neck_are_told_apart() {
        let mut ranges_mm = thing(30, 4500);
        ranges_mm[35..].fill(0);
        ranges_mm[37..39].fill(4550);
        let geometry = Geometry::new(GeometryParts { first_step: 300, last_step: 339, ..URG_04LX }).unwrap();
        let scan = Scan { geometry: &geometry, ranges_mm: &ranges_mm, time: ScanTime::default() };
        struct All;
        impl Surroundings for All {
            fn is_foreground(&self, beam: usize) -> bool {
                beam >= 5
            }
            fn held_ds(&self, _: usize) -> u16 {
                0
            }
        }
        let cluster = Cluster { first: 5, last: 34, valid: 30 };
        let candidate = describe(&scan, cluster, Breaks::of(&geometry), &All);
        assert_eq!(candidate.first_end, End { kind: EndKind::Wall, step_mm: -500 });
        assert_eq!(candidate.last_end, End { kind: EndKind::Neck, step_mm: 50 });
    }

    #[test]
    fn a_mixed_pixel_beside_a_body_leaves_its_end_free() {
        let mut ranges_mm = thing(30, 2000);
        ranges_mm[35] = 2110;
        ranges_mm[4] = 3000;
        let candidate = describe_beams(&ranges_mm, 5, 34);
        let free = End { kind: EndKind::Free, step_mm: 2000 };
        assert_eq!((candidate.first_end, candidate.last_end, candidate.touches), (free, free, false));
    }

    #[test]
    fn the_contour_has_seven_points_and_fifteen_when_wide() {
        let hollow: Vec<u16> = thing(39, 2000)
            .iter()
            .enumerate()
            .map(
                |(beam, &range_mm)| {
                    if range_mm == 2000 { 2000 + 2 * (beam as u16).abs_diff(24) } else { range_mm }
                },
            )
            .collect();
        let candidate = describe_beams(&hollow, 5, 43);
        assert_eq!(candidate.contour.len(), CONTOUR_POINTS);
        assert_eq!(candidate.contour_mm(3), Some(2000));
        for point in 0..CONTOUR_POINTS {
            let mirrored = candidate.contour[CONTOUR_POINTS - 1 - point];
            assert!(candidate.contour[point].abs_diff(mirrored) <= 1);
        }
        assert_eq!(describe_beams(&thing(60, 2000), 5, 64).contour.len(), CONTOUR_POINTS_WIDE);
        assert_eq!(describe_beams(&thing(4, 2000), 5, 8).contour.len(), 2);
        assert_eq!(candidate.contour_mm(CONTOUR_POINTS), None);
    }

    #[test]
    fn the_three_deepest_necks_are_told_in_their_order() {
        let depths = [0, 80, 0, 300, 0, 40, 0, 120, 0, 200, 0];
        let lobes: Vec<u16> = depths.iter().flat_map(|&depth| [2000 + depth; 3]).collect();
        let ranges_mm = [vec![4000; 5], lobes, vec![4000; 5]].concat();
        let necks: Vec<(u16, u16)> =
            describe_beams(&ranges_mm, 5, 37).necks.iter().map(|neck| (neck.step, neck.depth_mm)).collect();
        assert_eq!(necks, [(314, 300), (326, 120), (332, 200)]);
    }

    #[test]
    fn drop_outs_inside_shorten_nothing_but_the_count() {
        let mut ranges_mm = thing(30, 2000);
        ranges_mm[20] = 0;
        let candidate = describe_beams(&ranges_mm, 5, 34);
        assert_eq!((candidate.beams, candidate.mid_mm, candidate.near_mm), (29, 2000, 2000));
        assert!(candidate.contour.iter().all(|&offset| offset == 0));
    }
}
