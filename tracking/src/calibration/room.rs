//! Scan matching: the walls in several backgrounds are laid upon each other. A pose that is right to a hand's breadth
//! becomes right to a finger's.
//!
//! ```text
//!   a's wall   ────────────────        each point of b, along the normal of a's surface nearest to it:
//!   b's wall    ·  ·  ·  ·  ·  ·       one residual a point; a point without a counterpart, of a surface that
//!                  ↕ error             faces the other way, or beyond the ends of a's surface, counts nothing
//! ```
//!
//! Point-to-line matching of all pairs at once (a relative of ICP), with the result of the walk as its prior. The
//! distance at which two points can be the same surface shrinks round by round (Tukey's weights). Planes at different
//! heights see different furniture: points that only one module sees have no counterpart, or are outvoted.

use nalgebra::{DMatrix, DVector};

use crate::geometry::{Point, Pose, wrapped};

use super::joint::Joint;

/// Between two points kept of an outline, m.
const SPACING_M: f64 = 0.05;

/// Neighbouring points are of one surface within this distance, m, or this share of their range.
const TOGETHER_M: f64 = 0.12;
const TOGETHER_SHARE: f64 = 0.05;

/// Points on either side from which a surface's direction is taken.
const REACH: usize = 4;

/// A surface is straight if its points are no farther from their line, m.
const STRAIGHT_M: f64 = 0.02;

/// How well a learned wall is where it is, one σ, m: the median of sixty scans, mixed pixels, a skirting board. Measured
/// on the walls themselves once they lie upon each other, within these limits.
const WALL_M: (f64, f64) = (0.006, 0.012);

/// Points whose errors are one error: 0.4 m of wall, a board's width or a sensor's own waviness.
const ALIKE: f64 = 8.0;

/// Surfaces face the same way: within 35°.
const FACING: f64 = 0.82;

/// Distance at which two points can be one surface, first and last, m.
const GATES_M: (f64, f64) = (0.35, 0.06);

/// Rounds of matching.
const ROUNDS: usize = 25;

/// A background as a module sees it: where its beams end, in its own frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outline {
    points: Vec<Surface>,
}

/// A point of a surface, and where the surface faces.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Surface {
    at: Point,
    normal: Point,
}

impl Outline {
    /// From the wall each beam ends at, by bearing: `(bearing_rad, range_m)`, 0 where there is none.
    #[must_use]
    pub fn of(beams: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let mut runs: Vec<Vec<Point>> = vec![Vec::new()];
        let mut last: Option<(Point, f64)> = None;
        for (bearing_rad, range_m) in beams {
            let at = Point::towards(bearing_rad) * range_m;
            let near = last.is_some_and(|(last, last_m)| {
                (at - last).length() < TOGETHER_M.max(TOGETHER_SHARE * last_m.min(range_m))
            });
            if range_m <= 0.0 || !near {
                runs.push(Vec::new());
            }
            last = (range_m > 0.0).then_some((at, range_m));
            if let (Some(run), true) = (runs.last_mut(), range_m > 0.0) {
                run.push(at);
            }
        }
        Self { points: runs.iter().flat_map(|run| surfaces(run)).collect() }
    }

    /// The same of a module that hangs the other way up.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let over = |point: Point| Point::new(point.x, -point.y);
        let over = |surface: &Surface| Surface { at: over(surface.at), normal: over(surface.normal) };
        Self { points: self.points.iter().map(over).collect() }
    }

    /// The direction of most walls, from -45° to 45° to the module's front, rad: walls stand at right angles, so four times
    /// their direction is the same of all of them. 0 without walls.
    #[must_use]
    pub fn direction_rad(&self) -> f64 {
        let sum = self
            .points
            .iter()
            .fold(Point::default(), |sum, surface| sum + Point::towards(4.0 * surface.normal.angle_rad()));
        if sum.length() > 0.0 { sum.angle_rad() / 4.0 } else { 0.0 }
    }
}

/// Points of one run of beams, thinned out, with the direction of their neighbourhood.
fn surfaces(run: &[Point]) -> Vec<Surface> {
    let mut found: Vec<Surface> = Vec::new();
    for index in 0..run.len() {
        let from = index.saturating_sub(REACH);
        let part = &run[from..(index + REACH + 1).min(run.len())];
        // An end has its neighbours on one side only: its direction is theirs.
        if part.len() < 2 * REACH {
            continue;
        }
        let Some(surface) = straight(part, run[index]) else { continue };
        if found.last().is_none_or(|last| (last.at - surface.at).length() >= SPACING_M) {
            found.push(surface);
        }
    }
    found
}

/// The line through some points, at the one nearest to `about`; None if they are not straight.
fn straight(part: &[Point], about: Point) -> Option<Surface> {
    let count = part.len() as f64;
    let middle = part.iter().fold(Point::default(), |sum, &point| sum + point) * (1.0 / count);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for point in part {
        let off = *point - middle;
        xx += off.x * off.x;
        xy += off.x * off.y;
        yy += off.y * off.y;
    }
    let along_rad = 0.5 * libm::atan2(2.0 * xy, xx - yy);
    let mut normal = Point::towards(along_rad).left();
    // It faces the sensor, which is at the origin.
    if normal.dot(middle) > 0.0 {
        normal = normal * -1.0;
    }
    let off: f64 = part.iter().map(|point| (*point - middle).dot(normal).powi(2)).sum();
    let at = about - normal * (about - middle).dot(normal);
    ((off / count).sqrt() < STRAIGHT_M).then_some(Surface { at, normal })
}

/// What the backgrounds add to the walk.
#[derive(Clone, Debug)]
pub struct Refined {
    /// Every module's pose.
    pub poses: Vec<Pose>,
    /// Covariance of x, y and yaw of all modules but the first.
    pub covariance: DMatrix<f64>,
    /// Metres of wall that two backgrounds share, over all pairs.
    pub shared_wall_m: f64,
}

/// Two points that are one surface.
struct Match {
    /// The module of the line, and the module of the point.
    line: usize,
    point: usize,
    on: Surface,
    at: Point,
    /// Distance along the normal, m, and its weight.
    error_m: f64,
    weight: f64,
}

/// Lays the backgrounds upon each other; None with fewer than two of them.
#[must_use]
pub fn refine(joint: &Joint, rooms: &[Option<Outline>]) -> Option<Refined> {
    let modules = joint.poses.len();
    if rooms.iter().flatten().filter(|room| !room.points.is_empty()).count() < 2 {
        return None;
    }
    let prior = joint.covariance.clone().cholesky()?.inverse();
    let size = prior.nrows();
    let mut change = DVector::zeros(size);
    let mut solution = None;
    let mut wall_m = WALL_M.1;
    for round in 0..ROUNDS {
        let share = (round as f64 / (ROUNDS as f64 * 0.6)).min(1.0);
        let gate_m = GATES_M.0 * libm::pow(GATES_M.1 / GATES_M.0, share);
        let (poses, scales) = state(joint, &change);
        let matches = matches(&poses, &scales, rooms, gate_m);
        let mut information = prior.clone();
        let mut side = -&prior * &change;
        let (mut sum, mut squares) = (0.0, 0.0);
        for found in &matches {
            let weight = found.weight / (wall_m * wall_m * ALIKE);
            let row = row(found, &poses, modules);
            for &(unknown, effect) in &row {
                for &(other, left) in &row {
                    information[(unknown, other)] += weight * effect * left;
                }
                side[unknown] -= weight * effect * found.error_m;
            }
            sum += found.weight;
            squares += found.weight * found.error_m * found.error_m;
        }
        if share >= 1.0 && sum > 0.0 {
            wall_m = (squares / sum).sqrt().clamp(WALL_M.0, WALL_M.1);
        }
        let factor = information.cholesky()?;
        change += factor.solve(&side);
        solution = Some((factor.inverse(), sum * SPACING_M * 0.5));
    }
    let (covariance, shared_wall_m) = solution?;
    let (poses, _) = state(joint, &change);
    let poses_size = 3 * (modules - 1);
    let covariance = covariance.view((0, 0), (poses_size, poses_size)).into_owned();
    Some(Refined { poses, covariance, shared_wall_m })
}

/// Poses and scales, changed.
fn state(joint: &Joint, change: &DVector<f64>) -> (Vec<Pose>, Vec<f64>) {
    let modules = joint.poses.len();
    let pose = |(module, pose): (usize, &Pose)| {
        let Some(at) = module.checked_sub(1).map(|index| 3 * index) else { return *pose };
        Pose {
            at: pose.at + Point::new(change[at], change[at + 1]),
            yaw_rad: wrapped(pose.yaw_rad + change[at + 2]),
        }
    };
    let scale = |(module, scale): (usize, &f64)| scale + change[3 * (modules - 1) + module];
    (joint.poses.iter().enumerate().map(pose).collect(), joint.scales.iter().enumerate().map(scale).collect())
}

/// All points of every module that lie at a surface of another.
fn matches(poses: &[Pose], scales: &[f64], rooms: &[Option<Outline>], gate_m: f64) -> Vec<Match> {
    let turned = |(module, room): (usize, &Option<Outline>)| -> Vec<Surface> {
        let pose = poses[module];
        let facing = Pose { at: Point::default(), ..pose };
        let points = room.iter().flat_map(|room| &room.points);
        let place = |surface: &Surface| Surface {
            at: pose.to_site(surface.at * (1.0 - scales[module])),
            normal: facing.to_site(surface.normal),
        };
        points.map(place).collect()
    };
    let all: Vec<Vec<Surface>> = rooms.iter().enumerate().map(turned).collect();
    let mut found = Vec::new();
    for (line, lines) in all.iter().enumerate() {
        for (point, points) in all.iter().enumerate().filter(|(point, _)| *point != line) {
            for surface in points {
                let nearest = lines
                    .iter()
                    .filter(|other| other.normal.dot(surface.normal) > FACING)
                    .map(|other| (other, surface.at - other.at))
                    .map(|(other, off)| (off.dot(off), other, off))
                    .min_by(|a, b| a.0.total_cmp(&b.0));
                let Some((_, on, off)) = nearest else { continue };
                let error_m = off.dot(on.normal);
                let aside_m = off.dot(on.normal.left()).abs();
                let share = error_m / gate_m;
                if share.abs() < 1.0 && aside_m < 2.0 * SPACING_M + 0.5 * gate_m {
                    let weight = (1.0 - share * share).powi(2);
                    found.push(Match { line, point, on: *on, at: surface.at, error_m, weight });
                }
            }
        }
    }
    found
}

/// How an error changes with the unknowns.
fn row(found: &Match, poses: &[Pose], modules: usize) -> Vec<(usize, f64)> {
    let normal = found.on.normal;
    let mut row = Vec::with_capacity(8);
    let mut side = |module: usize, at: Point, sign: f64| {
        let off = at - poses[module].at;
        if let Some(first) = module.checked_sub(1).map(|index| 3 * index) {
            row.push((first, sign * normal.x));
            row.push((first + 1, sign * normal.y));
            row.push((first + 2, sign * normal.dot(off.left())));
        }
        row.push((3 * (modules - 1) + module, -sign * normal.dot(off)));
    };
    side(found.point, found.at, 1.0);
    // The line moves and turns with its module: what turns under the point is the line at the point.
    side(found.line, found.at, -1.0);
    row
}
