//! The tracker of Ukyo et al. (paper D): segments of point clouds with their volume, that split and merge.
//!
//! ```text
//!   segments ─▶ linear assignment: α·distance + (1 − α)·|ΔV|       left over, a track:    split or merged · merged · left
//!                  │ rejected: too far, too different              left over, a segment:  split · entered
//!                  ▼
//!   Kalman filter (x, y, z and their velocities), gain by how much of the body is seen
//!
//!   merged:  A ─┬─ D (derived)  D is followed by itself; A and B are carried along with it
//!            B ─┘
//!   split:   A ─┬─ D            A follows the box around D and E
//!               └─ E            either ends when its origins have had their own segments for two frames
//! ```
//!
//! Where the paper leaves something open:
//!
//! | open | here |
//! |---|---|
//! | what "differ much" means | `GATE_M`, `GATE_LITRES` |
//! | unit of the volume in the cost | m³, as the distance's metres |
//! | V_thr | `WHOLE_LITRES` |
//! | sign of O | the less is seen, the smaller the gain: what the text says it is for |
//! | how O changes the gain | it is multiplied by it |
//! | which merges are noticed | a track without a segment whose place lies in another's |

mod axis;
mod explain;

use kehai_depth::segment::Segment;
use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;

use crate::world::geometry::Point;
use axis::Axis;

/// Weight of the distance in the cost.
const ALPHA: f64 = 0.8;

/// Weight of the absolute volume in the share that is seen.
const BETA: f64 = 0.2;

/// Frames without a segment after which a track has left, and with one after which a split or merge is over.
const FRAMES: u32 = 2;

/// Frames of which the largest volume is taken.
const REMEMBERED: usize = 5;

/// A segment farther than this from a track is not its, m: a step of a brisk walker from standstill, and half a body.
const GATE_M: f64 = 1.0;

/// Nor is one whose volume differs by more, litres: by another adult.
const GATE_LITRES: f64 = 200.0;

/// Volume from which on a body counts as wholly seen, litres: what an adult shows above 1 m.
const WHOLE_LITRES: f64 = 30.0;

/// A box around a segment.
#[derive(Clone, Copy, Debug)]
struct Extent {
    low: [f64; 3],
    high: [f64; 3],
}

impl Extent {
    fn of(segment: &Segment, plane_m: f64) -> Self {
        let (mut low, mut high) =
            ([f64::MAX, f64::MAX, plane_m], [f64::MIN, f64::MIN, f64::from(segment.top_cm) / 100.0]);
        for corner in &segment.outline_m {
            for axis in 0..2 {
                low[axis] = low[axis].min(f64::from(corner[axis]));
                high[axis] = high[axis].max(f64::from(corner[axis]));
            }
        }
        Self { low, high }
    }

    fn with(&self, other: &Self) -> Self {
        let each = |of: fn(f64, f64) -> f64, one: [f64; 3], two: [f64; 3]| {
            [0, 1, 2].map(|n: usize| of(one[n], two[n]))
        };
        Self { low: each(f64::min, self.low, other.low), high: each(f64::max, self.high, other.high) }
    }

    fn middle(&self) -> [f64; 3] {
        [0, 1, 2].map(|axis: usize| 0.5 * (self.low[axis] + self.high[axis]))
    }

    /// Whether a place lies over the box once it is moved so that its middle is at `at`.
    fn holds(&self, at: [f64; 3], place: [f64; 3]) -> bool {
        (0..2).all(|axis| (place[axis] - at[axis]).abs() <= 0.5 * (self.high[axis] - self.low[axis]))
    }
}

/// Why a derived track is there.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Derived {
    /// Two people seen as one: both origins.
    Merged([u64; 2]),
    /// One person seen as two: the origin.
    Split { of: u64 },
}

#[derive(Clone, Debug)]
struct Track {
    id: u64,
    axes: [Axis; 3],
    extent: Extent,
    /// The last volumes, litres; the newest last.
    volumes: Vec<f64>,
    /// Frames without a segment, and with one, in a row.
    missed: u32,
    matched: u32,
    segment: Option<usize>,
    derived: Option<Derived>,
    /// Where it was in the frame before.
    before: [f64; 3],
    /// Whether it came in this frame.
    is_new: bool,
}

impl Track {
    fn at(&self) -> [f64; 3] {
        self.axes.map(|axis| axis.place)
    }

    fn is_from(&self, id: u64) -> bool {
        match self.derived {
            None => false,
            Some(Derived::Merged(origins)) => origins.contains(&id),
            Some(Derived::Split { of }) => of == id,
        }
    }
}

/// Which of the paper's ideas are used.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct UkyoSettings {
    /// The volume is a part of the cost.
    pub has_size: bool,
    /// The gain follows the share that is seen.
    pub has_gain: bool,
}

/// The tracker.
#[derive(Clone, Debug)]
pub struct Ukyo {
    settings: UkyoSettings,
    period_s: f64,
    plane_m: f64,
    tracks: Vec<Track>,
    newest: u64,
}

/// A track after a frame.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Followed {
    /// Its number.
    pub id: u64,
    /// Where, m.
    pub at: Point,
    /// The segment in which it is seen.
    pub segment: Option<usize>,
}

impl Ukyo {
    /// For frames this far apart, of points above this height.
    #[must_use]
    pub const fn new(settings: UkyoSettings, period_s: f64, plane_m: f64) -> Self {
        Self { settings, period_s, plane_m, tracks: Vec::new(), newest: 0 }
    }

    /// Takes the segments of a frame: all tracks.
    pub fn observe(&mut self, segments: &[Segment]) -> Vec<Followed> {
        let seen: Vec<(Extent, f64)> = segments
            .iter()
            .map(|segment| (Extent::of(segment, self.plane_m), f64::from(segment.volume_l)))
            .collect();
        for track in &mut self.tracks {
            track.before = track.at();
            track.axes.iter_mut().for_each(|axis| axis.predict(self.period_s));
            track.segment = None;
            track.is_new = false;
        }
        let mut free = self.assign(&seen);
        self.explain_tracks(&seen, &mut free);
        self.explain_segments(&seen, &mut free);
        self.update(&seen);
        self.end();
        let report = |track: &Track| {
            let [x, y, _] = track.at();
            Followed { id: track.id, at: Point::new(x, y), segment: track.segment }
        };
        self.tracks.iter().map(report).collect()
    }

    /// The segments of the tracks; true for each segment that is left.
    fn assign(&mut self, seen: &[(Extent, f64)]) -> Vec<bool> {
        let mut free = vec![true; seen.len()];
        if self.tracks.is_empty() || seen.is_empty() {
            return free;
        }
        let distance_m = |track: &Track, extent: &Extent| {
            let (one, other) = (track.at(), extent.middle());
            (0..3).map(|axis| (one[axis] - other[axis]).powi(2)).sum::<f64>().sqrt()
        };
        let differs = |track: &Track, volume_l: f64| (volume_l - track.volumes.last().unwrap_or(&0.0)).abs();
        let has_size = self.settings.has_size;
        let cost = |(row, column): (usize, usize)| {
            let (track, (extent, volume_l)) = (&self.tracks[row], &seen[column]);
            let volume_m3 = if has_size { differs(track, *volume_l) / 1000.0 } else { 0.0 };
            ((ALPHA * distance_m(track, extent) + (1.0 - ALPHA) * volume_m3) * 1e6) as i64
        };
        let (rows, columns) = (self.tracks.len(), seen.len());
        let pairs: Vec<(usize, usize)> = if rows <= columns {
            let (_, chosen) = kuhn_munkres_min(&Matrix::from_fn(rows, columns, cost));
            chosen.into_iter().enumerate().collect()
        } else {
            let turned = Matrix::from_fn(columns, rows, |(column, row)| cost((row, column)));
            let (_, chosen) = kuhn_munkres_min(&turned);
            chosen.into_iter().enumerate().map(|(column, row)| (row, column)).collect()
        };
        for (row, column) in pairs {
            let track = &self.tracks[row];
            let (extent, volume_l) = &seen[column];
            let is_alike = !has_size || differs(track, *volume_l) <= GATE_LITRES;
            if distance_m(track, extent) <= GATE_M && is_alike {
                self.tracks[row].segment = Some(column);
                free[column] = false;
            }
        }
        free
    }
}

#[cfg(test)]
mod tests;
