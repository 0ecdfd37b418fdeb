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
//! In scan order, one pass. The break distance grows with the distance between neighbouring
//! beams: the flank of a body falls away from beam to beam, the more the farther it is.

use crate::background::{Class, Status};
use crate::scan::Geometry;

/// Least beams of a cluster; shorter ones are unseen spans.
pub const CLUSTER_BEAMS_MIN: u16 = 3;

/// Least range step that parts two things, mm. Two people whose ranges differ by less than 0.12 m
/// are one cluster anyway (noise, clothing, arms): the value of the reference simulation.
pub const BREAK_MM: u32 = 120;

/// Growth of the break distance with the lateral distance of two beams: a flank seen at
/// 14° (its range falls 4 mm for every 1 mm sideways) still holds together.
pub const BREAK_FLANK: u32 = 4;

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

/// The break distance of one geometry.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Breaks {
    /// Angle between neighbouring beams, 1/65 536 rad.
    beam_q16: u32,
}

impl Breaks {
    /// For the beams of `geometry`.
    #[must_use]
    pub fn of(geometry: &Geometry) -> Self {
        Self { beam_q16: (geometry.beam_rad() * 65_536.0) as u32 }
    }

    /// Distance sideways between beams `apart` places from each other at `range_mm`, mm.
    #[must_use]
    pub fn sideways_mm(self, range_mm: u16, apart: usize) -> u32 {
        let one_mm = u64::from(range_mm) * u64::from(self.beam_q16) / 65_536;
        (one_mm as u32).saturating_mul(apart.min(1 << 12) as u32)
    }

    /// Range step over which two readings `apart` beams from each other are two things, mm.
    #[must_use]
    pub fn break_mm(self, range_mm: u16, apart: usize) -> u32 {
        BREAK_MM.saturating_add(self.sideways_mm(range_mm, apart).saturating_mul(BREAK_FLANK))
    }

    /// Whether readings `apart` beams from each other belong to one thing.
    #[must_use]
    pub fn joins(self, one_mm: u16, other_mm: u16, apart: usize) -> bool {
        u32::from(one_mm.abs_diff(other_mm)) <= self.break_mm(one_mm.min(other_mm), apart)
    }
}

/// Foreground being collected.
#[derive(Clone, Copy)]
struct Run {
    first: usize,
    last: usize,
    last_mm: u16,
    valid: u16,
}

/// Cuts a judged scan into its pieces, in scan order.
pub(crate) fn segment(
    statuses: &[Status],
    ranges_mm: &[u16],
    geometry: &Geometry,
    mut found: impl FnMut(Piece),
) {
    let breaks = Breaks::of(geometry);
    let mut run: Option<Run> = None;
    let mut lost: Option<(usize, usize)> = None;
    let mut beam = 0;
    while let Some(quiet) = quiet_beams(statuses, beam) {
        // Two beams at their background, or one that returned something, end whatever was open.
        let here = beam + quiet;
        let bridge = quiet == 1 && beam_is_silent(ranges_mm, beam, geometry);
        if quiet > 0 {
            lost_ends(&mut lost, &mut found);
        }
        if quiet > 1 || (quiet == 1 && !bridge) {
            run_ends(&mut run, ranges_mm, breaks, &mut found);
        }
        let (Some(status), Some(&range_mm)) = (statuses.get(here), ranges_mm.get(here)) else { break };
        match status.class() {
            Class::Foreground => {
                lost_ends(&mut lost, &mut found);
                run = match run {
                    Some(open)
                        if here - open.last <= 2
                            && breaks.joins(open.last_mm, range_mm, here - open.last) =>
                    {
                        Some(Run {
                            last: here,
                            last_mm: range_mm,
                            valid: open.valid.saturating_add(1),
                            ..open
                        })
                    }
                    _ => {
                        run_ends(&mut run, ranges_mm, breaks, &mut found);
                        Some(Run { first: here, last: here, last_mm: range_mm, valid: 1 })
                    }
                };
            }
            Class::NoReturn => {
                let bridged = run.is_some_and(|open| {
                    here - open.last == 1
                        && statuses.get(here + 1).is_some_and(|next| next.class() == Class::Foreground)
                        && ranges_mm
                            .get(here + 1)
                            .is_some_and(|&next_mm| breaks.joins(open.last_mm, next_mm, 2))
                });
                if !bridged {
                    run_ends(&mut run, ranges_mm, breaks, &mut found);
                    lost = Some(lost.map_or((here, 1), |(first, length)| (first, length + 1)));
                }
            }
            Class::Background => {
                lost_ends(&mut lost, &mut found);
                let silent = beam_is_silent(ranges_mm, here, geometry);
                if !silent || run.is_some_and(|open| here - open.last > 1) {
                    run_ends(&mut run, ranges_mm, breaks, &mut found);
                }
            }
        }
        beam = here + 1;
    }
    lost_ends(&mut lost, &mut found);
    run_ends(&mut run, ranges_mm, breaks, &mut found);
}

/// Beams at their background from `beam` on until the next that is not; none when all the rest are.
fn quiet_beams(statuses: &[Status], beam: usize) -> Option<usize> {
    statuses.get(beam..)?.iter().position(|status| !status.is_quiet())
}

fn beam_is_silent(ranges_mm: &[u16], beam: usize, geometry: &Geometry) -> bool {
    ranges_mm.get(beam).is_some_and(|&value_mm| geometry.reading(value_mm).range_mm().is_none())
}

fn lost_ends(lost: &mut Option<(usize, usize)>, found: &mut impl FnMut(Piece)) {
    if let Some((first, length)) = lost.take() {
        found(Piece::NoReturn(first, length));
    }
}

/// Hands a run over, without mixed pixels at its ends.
fn run_ends(run: &mut Option<Run>, ranges_mm: &[u16], breaks: Breaks, found: &mut impl FnMut(Piece)) {
    let Some(Run { mut first, mut last, mut valid, .. }) = run.take() else { return };
    if valid < CLUSTER_BEAMS_MIN {
        return found(Piece::Short(first, last - first + 1));
    }
    let mixed = |end: Option<usize>, inner: Option<usize>, innermost: Option<usize>| {
        let at = |beam: Option<usize>| beam.and_then(|beam| ranges_mm.get(beam)).copied();
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
