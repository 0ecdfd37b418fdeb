//! Clusters: neighbouring foreground beams that belong to one thing.
//!
//! ```text
//!  range    ▁▁▁▁▁▁▁▁              ▁▁▁▁▁▁▁▁   background
//!                        ○▁▁▁▁▁▁▁            step over the break distance: a new cluster
//!                  ▄▅▆ ▆▅▄                   a single drop-out is bridged
//!                ╵           mixed pixel     the end beam between body and wall is left out
//!           └──────────────────────────▶ step
//! ```
//!
//! In scan order, one pass. Where a round body turns away from the sensor, the last beams on it lie
//! ever farther: the break distance allows the largest step a torso's flank can make between two beams.

use crate::background::{Class, Status};
use crate::breaks::Breaks;
pub use crate::breaks::{BREAK_MM, FLANK_RADIUS_MM};
use crate::scan::Scan;

/// Least beams of a cluster; shorter ones are unseen spans.
pub const CLUSTER_BEAMS_MIN: u16 = 3;

/// Range step at an end, beyond what its inner neighbours show, that makes a beam a mixed pixel, mm.
pub const MIXED_MM: u32 = 50;

/// Neighbouring foreground beams of one thing, mixed pixels left out.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Cluster {
    /// First beam.
    pub first: usize,
    /// Last beam, inclusive.
    pub last: usize,
    /// Beams with a return between them, both ends included.
    pub valid: u16,
}

impl Cluster {
    /// Beams from the first to the last.
    #[must_use]
    pub const fn beams(&self) -> usize {
        self.last - self.first + 1
    }
}

/// What the segmentation of a scan comes upon, in scan order.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Piece {
    /// A cluster of at least [`CLUSTER_BEAMS_MIN`] beams.
    Cluster(Cluster),
    /// Foreground that is too short for one, or a mixed pixel: first beam and length.
    Short(usize, usize),
    /// Wall beams without a return: first beam and length.
    NoReturn(usize, usize),
}

/// Foreground being collected.
#[derive(Clone, Copy)]
struct Run {
    first: usize,
    last: usize,
    last_mm: u16,
    valid: u16,
}

impl Run {
    /// Takes the neighbours behind the last beam that plainly belong to it; returns how many.
    fn go_on(&mut self, statuses: &[Status], scan: &Scan<'_>) -> usize {
        let next = self.last + 1;
        let statuses = statuses.get(next..).unwrap_or(&[]);
        let ranges_mm = scan.ranges_mm.get(next..).unwrap_or(&[]);
        let neighbours = statuses.iter().zip(ranges_mm).take_while(|(status, range_mm)| {
            let joins =
                status.class() == Class::Foreground && u32::from(range_mm.abs_diff(self.last_mm)) <= BREAK_MM;
            if joins {
                self.last_mm = **range_mm;
            }
            joins
        });
        let more = neighbours.count();
        self.last += more;
        self.valid = self.valid.saturating_add(more.min(usize::from(u16::MAX)) as u16);
        more
    }
}

/// Cuts a judged scan into its pieces, in scan order.
pub(crate) fn segment(statuses: &[Status], scan: &Scan<'_>, breaks: Breaks, mut found: impl FnMut(Piece)) {
    let mut run: Option<Run> = None;
    let mut lost: Option<(usize, usize)> = None;
    let mut beam = 0;
    while let Some(quiet) = quiet_beams(statuses, beam) {
        let here = beam + quiet;
        // Two beams at their background, or one that returned something, end what was open.
        if quiet > 0 {
            lost_ends(&mut lost, &mut found);
            if quiet > 1 || scan.reading(beam).range_mm().is_some() {
                run_ends(&mut run, scan, breaks, &mut found);
            }
        }
        let (Some(status), Some(&range_mm)) = (statuses.get(here), scan.ranges_mm.get(here)) else { break };
        beam = here + 1;
        match status.class() {
            Class::Foreground => {
                lost_ends(&mut lost, &mut found);
                match &mut run {
                    Some(open)
                        if here - open.last <= 2
                            && breaks.joins(open.last_mm, range_mm, here - open.last) =>
                    {
                        (open.last, open.last_mm) = (here, range_mm);
                        open.valid = open.valid.saturating_add(1);
                    }
                    _ => {
                        run_ends(&mut run, scan, breaks, &mut found);
                        run = Some(Run { first: here, last: here, last_mm: range_mm, valid: 1 });
                    }
                }
                if let Some(open) = &mut run {
                    beam += open.go_on(statuses, scan);
                }
            }
            Class::NoReturn => {
                let next_joins = |last_mm| {
                    statuses.get(here + 1).is_some_and(|next| next.class() == Class::Foreground)
                        && scan
                            .ranges_mm
                            .get(here + 1)
                            .is_some_and(|&next_mm| breaks.joins(last_mm, next_mm, 2))
                };
                if !run.is_some_and(|open| here - open.last == 1 && next_joins(open.last_mm)) {
                    run_ends(&mut run, scan, breaks, &mut found);
                    lost = Some(lost.map_or((here, 1), |(first, length)| (first, length + 1)));
                }
            }
            Class::Background => {
                lost_ends(&mut lost, &mut found);
                if scan.reading(here).range_mm().is_some() || run.is_some_and(|open| here - open.last > 1) {
                    run_ends(&mut run, scan, breaks, &mut found);
                }
            }
        }
    }
    lost_ends(&mut lost, &mut found);
    run_ends(&mut run, scan, breaks, &mut found);
}

/// Beams at their background from `beam` on until the next that is not; none when all the rest are.
fn quiet_beams(statuses: &[Status], beam: usize) -> Option<usize> {
    let rest = statuses.get(beam..)?;
    if rest.first().is_some_and(|status| !status.is_quiet()) {
        return Some(0);
    }
    // Four at a time: most of a scan is quiet.
    let (fours, _) = rest.as_chunks::<4>();
    let skipped = 4 * fours.iter().take_while(|four| Status::all_quiet(four)).count();
    let left = rest.get(skipped..)?.iter().position(|status| !status.is_quiet())?;
    Some(skipped + left)
}

fn lost_ends(lost: &mut Option<(usize, usize)>, found: &mut impl FnMut(Piece)) {
    if let Some((first, length)) = lost.take() {
        found(Piece::NoReturn(first, length));
    }
}

/// Hands a run over, without mixed pixels at its ends.
fn run_ends(run: &mut Option<Run>, scan: &Scan<'_>, breaks: Breaks, found: &mut impl FnMut(Piece)) {
    let Some(Run { mut first, mut last, mut valid, .. }) = run.take() else { return };
    if valid < CLUSTER_BEAMS_MIN {
        return found(Piece::Short(first, last - first + 1));
    }
    let mixed = |end: Option<usize>, inner: Option<usize>, innermost: Option<usize>| {
        let at = |beam: Option<usize>| beam.and_then(|beam| scan.ranges_mm.get(beam)).copied();
        let (Some(end_mm), Some(inner_mm), Some(innermost_mm)) = (at(end), at(inner), at(innermost)) else {
            return false;
        };
        let slope_mm = u32::from(inner_mm.abs_diff(innermost_mm));
        let sideways_mm = breaks.sideways_mm(inner_mm, 1);
        u32::from(end_mm.abs_diff(inner_mm)) > MIXED_MM + 2 * slope_mm + 2 * sideways_mm
    };
    if valid > CLUSTER_BEAMS_MIN && mixed(Some(first), first.checked_add(1), first.checked_add(2)) {
        found(Piece::Short(first, 1));
        first += 1;
        valid -= 1;
    }
    let mixed_last = valid > CLUSTER_BEAMS_MIN && mixed(Some(last), last.checked_sub(1), last.checked_sub(2));
    if mixed_last {
        last -= 1;
        valid -= 1;
    }
    found(Piece::Cluster(Cluster { first, last, valid }));
    if mixed_last {
        found(Piece::Short(last + 1, 1));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::{Geometry, GeometryParts, ScanTime, URG_04LX};
    use std::vec::Vec;

    /// The pieces of a scan whose beams are marked: `.` background, `f` foreground, `n` no return.
    fn pieces(marks: &str, ranges_mm: &[u16]) -> Vec<Piece> {
        let parts = GeometryParts { first_step: 300, last_step: 300 + marks.len() as u16 - 1, ..URG_04LX };
        let geometry = Geometry::new(parts).unwrap();
        let statuses: Vec<Status> = marks
            .chars()
            .map(|mark| match mark {
                'f' => Status::showing(Class::Foreground),
                'n' => Status::showing(Class::NoReturn),
                _ => Status::showing(Class::Background),
            })
            .collect();
        let scan = Scan { geometry: &geometry, ranges_mm, time: ScanTime::default() };
        let mut found = Vec::new();
        segment(&statuses, &scan, Breaks::of(&geometry), |piece| found.push(piece));
        found
    }

    const fn cluster(first: usize, last: usize, valid: u16) -> Piece {
        Piece::Cluster(Cluster { first, last, valid })
    }

    #[test]
    fn three_neighbours_are_a_cluster_and_two_are_short() {
        let ranges_mm = [4000, 2000, 2001, 2002, 4000, 2000, 2000, 4000];
        assert_eq!(pieces(".fff.ff.", &ranges_mm), [cluster(1, 3, 3), Piece::Short(5, 2)]);
    }

    #[test]
    fn a_range_step_parts_two_things_and_a_small_one_does_not() {
        let ranges_mm = [2000, 2000, 2000, 2119, 2119, 2119, 2240, 2240, 2240, 4000, 4000];
        assert_eq!(pieces("fffffffff..", &ranges_mm), [cluster(0, 5, 6), cluster(6, 8, 3)]);
    }

    #[test]
    fn a_single_drop_out_is_bridged_whether_the_beam_has_a_wall_or_not() {
        let ranges_mm = [2000, 2000, 0, 2000, 2000, 0, 2000, 2000, 2000, 4000];
        assert_eq!(pieces("ff.ffnfff.", &ranges_mm), [cluster(0, 8, 7)]);
    }

    #[test]
    fn two_drop_outs_or_a_look_at_the_wall_end_a_cluster() {
        let ranges_mm = [2000, 2000, 2000, 0, 0, 2000, 2000, 2000, 4000, 2000, 2000, 2000];
        let found = [cluster(0, 2, 3), cluster(5, 7, 3), cluster(9, 11, 3)];
        assert_eq!(pieces("fff..fff.fff", &ranges_mm), found);
        let lost = [cluster(0, 2, 3), Piece::NoReturn(3, 2), cluster(5, 7, 3), cluster(9, 11, 3)];
        assert_eq!(pieces("fffnnfff.fff", &ranges_mm), lost);
    }

    #[test]
    fn mixed_pixels_at_the_ends_are_left_out_and_said_to_be_unseen() {
        let ranges_mm = [4000, 2110, 2000, 2001, 2002, 2003, 2110, 4000];
        let found = [Piece::Short(1, 1), cluster(2, 5, 4), Piece::Short(6, 1)];
        assert_eq!(pieces(".ffffff.", &ranges_mm), found);
    }

    #[test]
    fn a_cluster_is_never_trimmed_below_three_beams() {
        let ranges_mm = [4000, 2110, 2000, 2001, 4000];
        assert_eq!(pieces(".fff.", &ranges_mm), [cluster(1, 3, 3)]);
    }

    #[test]
    fn walls_without_a_return_are_spans_up_to_both_edges_of_the_scan() {
        let ranges_mm = [0, 0, 4000, 0, 7, 4000, 0];
        let found = [Piece::NoReturn(0, 2), Piece::NoReturn(3, 2), Piece::NoReturn(6, 1)];
        assert_eq!(pieces("nn.nn.n", &ranges_mm), found);
    }
}
