//! The outline of a cluster: what a candidate's numbers are taken from.
//!
//! ```text
//!             neck                    ranges over the beams from the first to the last
//!     ●      ╱▔╲      ●
//!      ╲ ·  ╱   ╲  · ╱                · contour: at equal bearings
//!       ╲__╱     ╲__╱
//!        side     side                a neck is as deep as its farther side is nearer
//! ```

use crate::cluster::Cluster;
use crate::math;
use crate::scan::Scan;

/// Chord above which a contour has [`CONTOUR_POINTS_WIDE`] points, mm: two people side by side.
pub const WIDE_MM: f32 = 550.0;

/// Contour points of a candidate up to [`WIDE_MM`].
pub const CONTOUR_POINTS: usize = 7;

/// Contour points of a wider candidate.
pub const CONTOUR_POINTS_WIDE: usize = 15;

/// Unit of a contour point, mm: the resolution of a byte that still reaches a metre.
pub const CONTOUR_UNIT_MM: u16 = 4;

/// Most necks reported.
pub const NECKS: usize = 3;

/// Depth a neck has at least, mm: five times the range noise at 3.5 m, an arm lying on a hip.
pub const NECK_MM: u16 = 50;

/// Beams around the middle whose median is the mid range.
const MIDDLE_BEAMS: usize = 5;

/// A place inside a candidate that lies farther than both sides of it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Neck {
    /// Step of its deepest beam.
    pub step: u16,
    /// How much farther it is than the farther of its two sides, mm.
    pub depth_mm: u16,
}

/// Distance between the two end points of a cluster, mm.
pub(crate) fn chord_mm(scan: &Scan<'_>, cluster: Cluster) -> f32 {
    let angle_rad = (cluster.beams() - 1) as f32 * scan.geometry.beam_rad();
    let ends_mm = (range_at(scan, cluster.first), range_at(scan, cluster.last));
    math::chord(f32::from(ends_mm.0), f32::from(ends_mm.1), angle_rad)
}

/// Nearest beam of a cluster and its range.
#[inline(never)]
pub(crate) fn nearest(scan: &Scan<'_>, cluster: Cluster) -> (usize, u16) {
    let mut best = (cluster.first, u16::MAX);
    for (beam, range_mm) in readings(scan, cluster) {
        if range_mm < best.1 {
            best = (beam, range_mm);
        }
    }
    best
}

/// The beams of a cluster that returned something.
fn readings(scan: &Scan<'_>, cluster: Cluster) -> impl Iterator<Item = (usize, u16)> {
    let ranges_mm = scan.ranges_mm.get(cluster.first..=cluster.last).unwrap_or(&[]);
    let valid_mm = scan.geometry.range_min_mm()..=scan.geometry.range_max_mm();
    let beams = (cluster.first..).zip(ranges_mm);
    beams.map(|(beam, &range_mm)| (beam, range_mm)).filter(move |(_, range_mm)| valid_mm.contains(range_mm))
}

pub(crate) fn range_at(scan: &Scan<'_>, beam: usize) -> u16 {
    scan.reading(beam).range_mm().unwrap_or(0)
}

/// Median of the readings around the middle beam.
pub(crate) fn mid_mm(scan: &Scan<'_>, cluster: Cluster) -> u16 {
    let middle = cluster.first + (cluster.beams() - 1) / 2;
    let first = middle.saturating_sub(MIDDLE_BEAMS / 2).max(cluster.first);
    let last = (middle + MIDDLE_BEAMS / 2).min(cluster.last);
    let mut sorted = Median::<MIDDLE_BEAMS>::new();
    readings(scan, Cluster { first, last, ..cluster }).for_each(|(_, range_mm)| sorted.add(range_mm));
    sorted.median()
}

/// Ranges at equal bearings between the ends, less the nearest.
pub(crate) fn contour(
    scan: &Scan<'_>,
    cluster: Cluster,
    near_mm: u16,
    chord_mm: f32,
) -> heapless::Vec<u8, CONTOUR_POINTS_WIDE> {
    let wanted = if chord_mm > WIDE_MM { CONTOUR_POINTS_WIDE } else { CONTOUR_POINTS };
    let points = wanted.min(cluster.beams().saturating_sub(2));
    let mut contour = heapless::Vec::new();
    let mut last_mm = range_at(scan, cluster.first);
    for point in 1..=points {
        // Rounded, so that the points lie evenly on both sides of the middle.
        let gaps = points + 1;
        let offset = (2 * point * (cluster.beams() - 1) + gaps).checked_div(2 * gaps).unwrap_or(0);
        last_mm = scan.reading(cluster.first + offset).range_mm().unwrap_or(last_mm);
        let relative = last_mm.saturating_sub(near_mm).saturating_add(CONTOUR_UNIT_MM / 2) / CONTOUR_UNIT_MM;
        if contour.push(relative.min(255) as u8).is_err() {
            break;
        }
    }
    contour
}

/// Places deeper than [`NECK_MM`] between two nearer ones. The walk over the ranges turns only when
/// they have come back by that much, so that noise makes no necks.
#[inline(never)]
pub(crate) fn necks(scan: &Scan<'_>, cluster: Cluster) -> heapless::Vec<Neck, NECKS> {
    let mut necks = heapless::Vec::new();
    let mut readings = readings(scan, cluster);
    // A top with the nearest range before it, whose other side is still going nearer.
    let mut passed: Option<(Neck, u16)> = None;
    let mut low_mm = u16::MAX;
    loop {
        let rising = readings.find(|&(_, range_mm)| {
            low_mm = low_mm.min(range_mm);
            range_mm >= low_mm.saturating_add(NECK_MM)
        });
        let Some((mut top_beam, mut top_mm)) = rising else { break };
        keep_deepest(&mut necks, passed.take(), low_mm);
        let falling = readings.find(|&(beam, range_mm)| {
            if range_mm > top_mm {
                (top_beam, top_mm) = (beam, range_mm);
            }
            range_mm.saturating_add(NECK_MM) <= top_mm
        });
        let Some((_, range_mm)) = falling else { break };
        let step = scan.geometry.step(top_beam.min(usize::from(u16::MAX)) as u16);
        passed = Some((Neck { step, depth_mm: top_mm }, low_mm));
        low_mm = range_mm;
    }
    keep_deepest(&mut necks, passed, low_mm);
    necks
}

/// Adds a neck, whose depth is still its range, once both sides are known; the shallowest gives way.
fn keep_deepest(necks: &mut heapless::Vec<Neck, NECKS>, passed: Option<(Neck, u16)>, after_mm: u16) {
    let Some((Neck { step, depth_mm: top_mm }, before_mm)) = passed else { return };
    let new = Neck { step, depth_mm: top_mm.saturating_sub(before_mm.max(after_mm)) };
    if let Err(new) = necks.push(new) {
        let shallowest = necks.iter().min_by_key(|neck| neck.depth_mm).copied().unwrap_or(new);
        if shallowest.depth_mm < new.depth_mm {
            necks.retain(|neck| *neck != shallowest);
            let _ = necks.push(new);
        }
    }
}

/// Median of at most `N` values, kept in order as they come; more are left out.
pub(crate) struct Median<const N: usize> {
    sorted: heapless::Vec<u16, N>,
}

impl<const N: usize> Median<N> {
    pub(crate) const fn new() -> Self {
        Self { sorted: heapless::Vec::new() }
    }

    pub(crate) fn add(&mut self, value: u16) {
        if self.sorted.push(value).is_ok() {
            let mut descending = self.sorted.iter_mut().rev();
            if let Some(mut larger) = descending.next() {
                for smaller in descending {
                    if *smaller <= *larger {
                        break;
                    }
                    core::mem::swap(smaller, larger);
                    larger = smaller;
                }
            }
        }
    }

    /// The middle value, the lower of two; 0 of none.
    pub(crate) fn median(&self) -> u16 {
        let middle = self.sorted.len().saturating_sub(1) / 2;
        self.sorted.get(middle).copied().unwrap_or(0)
    }
}
