//! Bundle adjustment: all poses, clocks, the walk and the body's shape at once, in one least-squares problem. Wanted
//! are the poses that make one smooth walk of what every device measured.
//!
//! ```text
//!   unknowns      the walk            two numbers a knot, 0.25 s apart: a band
//!                 the modules         x, y, yaw, clock of all but the first; each sensor's scale
//!                 the body            how far its centre seems off, by the angle at which it is seen
//!
//!   ray frame     along   r − (1 + s)·|p(t − c) − a| − b(θ)        a: the module, p: the walk,
//!                 across  r·(bearing − that of p(t − c)) − d(θ)    θ: between the ray and the chest
//! ```
//!
//! Nothing measured is multiplied by an unknown: it would shrink the noise, and with it the room.
//!
//! Gauss-Newton with Levenberg's damping. The walk is eliminated: what is left are a few dozen equations for
//! everything else (a Schur complement). Measurements that do not fit count less (Huber).
//!
//! A body is symmetric: what is off along the ray is even in the angle θ between its chest and the ray, what is off
//! across is odd. Five numbers describe it; while the walker stands, only the first of them is used, since the
//! direction of the chest is not known.
//!
//! **Covariance.** Errors of a body's shape last as long as the body is seen from the same side, so ten
//! scans a second are not ten measurements. How much they are worth is measured: the sums of the equations' errors over
//! blocks of two seconds scatter more than independent errors would, by a factor which is the loss.

use nalgebra::{DMatrix, DVector};

use crate::geometry::{Point, Pose, wrapped};

use super::band::{BAND, Band, Factor};
use super::median;
use super::spline::{ACCELERATION_M_S2, KNOT_S, Spline};
use super::walk::Glimpse;

/// An error beyond so many σ counts less.
const HUBER: f64 = 1.5;

/// One σ before anything is seen: of a clock after the exchanges of the network, s; of a sensor's scale (a range
/// finder is within 1 %); of the constant part of the body's offset and of its changes with the angle, m.
const CLOCK_S: f64 = 0.010;
const SCALE: f64 = 0.003;
const BODY_M: [f64; SHAPES] = [0.03, 0.02, 0.03, 0.02, 0.03];

/// Numbers that say how a body's centre seems off.
const SHAPES: usize = 5;

/// From this speed on the chest points along the way, m/s.
const WALKS_M_S: f64 = 0.4;

/// Blocks over which errors are summed, s.
const BLOCK_S: f64 = 2.0;

/// The least loss: five numbers do not say all of a body's shape, and what they leave does not scatter from block to block
/// of one walk. On development seeds bounds without it held 88 to 96 %.
const LEAST_LOSS: f64 = 1.4;

/// Steps at most.
const STEPS: usize = 40;

/// What was found.
#[derive(Clone, Debug)]
pub struct Joint {
    /// Every module's pose.
    pub poses: Vec<Pose>,
    /// How far each one's clock is behind, s, and one σ of it.
    pub clocks_s: Vec<f64>,
    /// See `clocks_s`.
    pub clock_sigmas_s: Vec<f64>,
    /// By how much each sensor's ranges are too long.
    pub scales: Vec<f64>,
    /// Covariance of poses (three numbers a module, all but the first) and scales (all), in that order.
    pub covariance: DMatrix<f64>,
    /// By how much the errors of a body's shape weigh more than as many independent ones.
    pub loss: f64,
    residuals_m: Vec<Vec<f64>>,
}

impl Joint {
    /// Covariance of the poses alone.
    #[must_use]
    pub fn pose_covariance(&self) -> DMatrix<f64> {
        let size = 3 * (self.poses.len() - 1);
        self.covariance.view((0, 0), (size, size)).into_owned()
    }

    /// How far what a module saw is from the walk, m: median.
    #[must_use]
    pub fn residual_m(&self, module: usize) -> f64 {
        median(&mut self.residuals_m.get(module).cloned().unwrap_or_default())
    }
}

/// Where each unknown stands: poses, scales, clocks, body.
#[derive(Clone, Copy, Debug)]
struct Layout {
    modules: usize,
}

impl Layout {
    const fn pose(self, module: usize) -> Option<usize> {
        if module == 0 { None } else { Some(3 * (module - 1)) }
    }

    const fn scale(self, module: usize) -> usize {
        3 * (self.modules - 1) + module
    }

    const fn clock(self, module: usize) -> Option<usize> {
        if module == 0 { None } else { Some(4 * self.modules - 3 + module - 1) }
    }

    const fn body(self) -> usize {
        5 * self.modules - 4
    }

    const fn size(self) -> usize {
        self.body() + SHAPES
    }
}

/// All unknowns.
#[derive(Clone, Debug)]
struct State {
    poses: Vec<Pose>,
    /// Scales, clocks and body, where the [`Layout`] has them; the places of the poses are not used.
    rest: DVector<f64>,
    walk: Spline,
}

/// One glimpse against the state: errors along and across, and how they change.
struct Row {
    errors: [f64; 2],
    sigmas: [f64; 2],
    /// First control point and the weights of four.
    first: usize,
    position: [f64; 4],
    /// Changes of both errors with the walker's place, turned round.
    rays: [Point; 2],
    /// Unknowns and the changes of both errors with them; a module has three of pose, scale and clock.
    others: [(usize, [f64; 2]); 5 + SHAPES],
    count: usize,
}

impl Row {
    fn of(glimpse: &Glimpse, state: &State, layout: Layout) -> Self {
        let module = glimpse.module;
        let pose = state.poses[module];
        let clock_s = layout.clock(module).map_or(0.0, |at| state.rest[at]);
        let place = state.walk.place(glimpse.at_s - clock_s);
        let at = state.walk.sum(place.first, &place.position);
        let velocity = state.walk.sum(place.first, &place.velocity);
        let offset = at - pose.at;
        let away_m = offset.length().max(0.05);
        let ray = offset * (1.0 / away_m);
        let shapes = shapes(velocity, ray);
        let body = layout.body();
        let (mut radial_m, mut tangential_m) = (0.0, 0.0);
        for (shape, changes) in shapes.iter().enumerate() {
            radial_m += state.rest[body + shape] * changes[0];
            tangential_m += state.rest[body + shape] * changes[1];
        }
        let longer = 1.0 + state.rest[layout.scale(module)];
        let aside_rad = wrapped(glimpse.bearing_rad + pose.yaw_rad - offset.angle_rad());
        let errors =
            [glimpse.range_m - longer * away_m - radial_m, glimpse.range_m * aside_rad - tangential_m];
        let (along, across) = (ray * longer, ray.left() * (glimpse.range_m / away_m));
        let mut row = Self {
            errors,
            sigmas: [glimpse.radial_m, glimpse.tangential_m],
            first: place.first,
            position: place.position,
            rays: [along, across],
            others: [(0, [0.0; 2]); 5 + SHAPES],
            count: 0,
        };
        if let Some(at) = layout.pose(module) {
            row.put(at, [along.x, across.x]);
            row.put(at + 1, [along.y, across.y]);
            row.put(at + 2, [0.0, glimpse.range_m]);
        }
        row.put(layout.scale(module), [-away_m, 0.0]);
        if let Some(at) = layout.clock(module) {
            row.put(at, [along.dot(velocity), across.dot(velocity)]);
        }
        for (shape, changes) in shapes.iter().enumerate() {
            row.put(body + shape, changes.map(|change| -change));
        }
        row
    }

    fn put(&mut self, unknown: usize, changes: [f64; 2]) {
        self.others[self.count] = (unknown, changes);
        self.count += 1;
    }

    fn others(&self) -> &[(usize, [f64; 2])] {
        &self.others[..self.count]
    }

    /// Squared length in σ.
    fn squared(&self) -> f64 {
        (0..2).map(|part| (self.errors[part] / self.sigmas[part]).powi(2)).sum()
    }

    /// Huber's weight and cost.
    fn weight(&self) -> (f64, f64) {
        let squared = self.squared();
        let length = squared.sqrt();
        if length <= HUBER { (1.0, 0.5 * squared) } else { (HUBER / length, HUBER * (length - 0.5 * HUBER)) }
    }
}

/// How the body's offsets, along and across, change with its numbers: 1, cos θ, cos 2θ along; sin θ, sin 2θ across.
fn shapes(velocity: Point, along: Point) -> [[f64; 2]; SHAPES] {
    let speed = velocity.length();
    let mut shapes = [[0.0; 2]; SHAPES];
    shapes[0] = [1.0, 0.0];
    if speed > 1e-6 {
        let heading = velocity * (1.0 / speed);
        let sure = (speed / WALKS_M_S).min(1.0);
        let (cosine, sine) = (-heading.dot(along), -heading.cross(along));
        shapes[1] = [sure * cosine, 0.0];
        shapes[2] = [sure * (2.0 * cosine * cosine - 1.0), 0.0];
        shapes[3] = [0.0, sure * sine];
        shapes[4] = [0.0, sure * 2.0 * sine * cosine];
    }
    shapes
}

/// The equations at a state, with the walk eliminated.
struct Equations {
    cost: f64,
    factor: Factor,
    /// Walk against the others.
    mixed: DMatrix<f64>,
    /// Factor⁻¹ of that: how the walk follows the others.
    follows: DMatrix<f64>,
    walk_side: DVector<f64>,
    /// What is left for the others; without the priors, and they.
    left: DMatrix<f64>,
    left_side: DVector<f64>,
    priors: DVector<f64>,
}

fn priors(layout: Layout) -> DVector<f64> {
    let mut priors = DVector::zeros(layout.size());
    for module in 0..layout.modules {
        priors[layout.scale(module)] = 1.0 / (SCALE * SCALE);
        if let Some(at) = layout.clock(module) {
            priors[at] = 1.0 / (CLOCK_S * CLOCK_S);
        }
    }
    for (shape, sigma_m) in BODY_M.iter().enumerate() {
        priors[layout.body() + shape] = 1.0 / (sigma_m * sigma_m);
    }
    priors
}

/// The curvature of the walk, as a whole σ.
const BEND: f64 = 1.0 / (KNOT_S * KNOT_S * ACCELERATION_M_S2);

fn cost(glimpses: &[Glimpse], state: &State, layout: Layout) -> f64 {
    let seen: f64 = glimpses.iter().map(|glimpse| Row::of(glimpse, state, layout).weight().1).sum();
    let bends = state.walk.points.windows(3).map(|three| {
        let bend = (three[0] - three[1] * 2.0 + three[2]) * BEND;
        0.5 * bend.dot(bend)
    });
    let priors = priors(layout);
    let known = state.rest.iter().zip(priors.iter()).map(|(value, weight)| 0.5 * weight * value * value);
    seen + bends.sum::<f64>() + known.sum::<f64>()
}

fn equations(glimpses: &[Glimpse], state: &State, layout: Layout) -> Option<Equations> {
    let knots = 2 * state.walk.points.len();
    let size = layout.size();
    let mut band = Band::new(knots);
    let mut mixed = DMatrix::zeros(knots, size);
    let mut whole = DMatrix::zeros(size, size);
    let mut walk_side = DVector::zeros(knots);
    let mut side = DVector::zeros(size);
    for glimpse in glimpses {
        let row = Row::of(glimpse, state, layout);
        let (weight, _) = row.weight();
        for part in 0..2 {
            let weight = weight / (row.sigmas[part] * row.sigmas[part]);
            let error = row.errors[part];
            // The eight numbers of the walk that it touches.
            let walk: [f64; BAND] = std::array::from_fn(|index| {
                let ray = row.rays[part];
                -row.position[index / 2] * if index % 2 == 0 { ray.x } else { ray.y }
            });
            for (index, change) in walk.iter().enumerate() {
                let at = 2 * row.first + index;
                for (other, left) in walk.iter().enumerate().take(index + 1) {
                    band.add(at, 2 * row.first + other, weight * change * left);
                }
                for (unknown, changes) in row.others() {
                    mixed[(at, *unknown)] += weight * change * changes[part];
                }
                walk_side[at] -= weight * change * error;
            }
            for (unknown, changes) in row.others() {
                for (other, left) in row.others() {
                    whole[(*unknown, *other)] += weight * changes[part] * left[part];
                }
                side[*unknown] -= weight * changes[part] * error;
            }
        }
    }
    for (index, three) in state.walk.points.windows(3).enumerate() {
        let bend = (three[0] - three[1] * 2.0 + three[2]) * BEND;
        let parts = [BEND, -2.0 * BEND, BEND];
        for (one, change) in parts.iter().enumerate() {
            for axis in 0..2 {
                let at = 2 * (index + one) + axis;
                for (other, left) in parts.iter().enumerate().take(one + 1) {
                    band.add(at, 2 * (index + other) + axis, change * left);
                }
                walk_side[at] -= change * if axis == 0 { bend.x } else { bend.y };
            }
        }
    }
    let factor = band.factor()?;
    let mut follows = mixed.clone();
    for mut column in follows.column_iter_mut() {
        factor.solve(column.as_mut_slice());
    }
    let mut walk_step = walk_side.clone();
    factor.solve(walk_step.as_mut_slice());
    let left = whole - mixed.transpose() * &follows;
    let priors = priors(layout);
    let left_side = side - mixed.transpose() * walk_step - priors.component_mul(&state.rest);
    let cost = cost(glimpses, state, layout);
    Some(Equations { cost, factor, mixed, follows, walk_side, left, left_side, priors })
}

impl Equations {
    /// The next state, damped.
    fn step(&self, state: &State, damping: f64, layout: Layout) -> Option<State> {
        let mut matrix = self.left.clone() + DMatrix::from_diagonal(&self.priors);
        for at in 0..layout.size() {
            matrix[(at, at)] *= 1.0 + damping;
        }
        let change = matrix.cholesky()?.solve(&self.left_side);
        let mut walk = &self.walk_side - &self.mixed * &change;
        self.factor.solve(walk.as_mut_slice());
        let mut next = state.clone();
        for (module, pose) in next.poses.iter_mut().enumerate() {
            if let Some(at) = layout.pose(module) {
                pose.at = pose.at + Point::new(change[at], change[at + 1]);
                pose.yaw_rad = wrapped(pose.yaw_rad + change[at + 2]);
            }
        }
        let poses = 3 * (layout.modules - 1);
        for at in poses..layout.size() {
            next.rest[at] += change[at];
        }
        for (index, point) in next.walk.points.iter_mut().enumerate() {
            *point = *point + Point::new(walk[2 * index], walk[2 * index + 1]);
        }
        Some(next)
    }

    /// How much more errors weigh than independent ones: their sums over blocks of time against themselves.
    fn loss(&self, glimpses: &[Glimpse], state: &State, layout: Layout, inverse: &DMatrix<f64>) -> f64 {
        let poses = 3 * (layout.modules - 1);
        let mut blocks: std::collections::BTreeMap<i64, DVector<f64>> = std::collections::BTreeMap::new();
        for glimpse in glimpses {
            let row = Row::of(glimpse, state, layout);
            let (weight, _) = row.weight();
            let sum = blocks
                .entry((glimpse.at_s / BLOCK_S).floor() as i64)
                .or_insert_with(|| DVector::zeros(layout.size()));
            for part in 0..2 {
                let weight = weight / (row.sigmas[part] * row.sigmas[part]);
                for (unknown, changes) in row.others() {
                    sum[*unknown] += weight * changes[part] * row.errors[part];
                }
                // What the walk would follow is no error of the others.
                let ray = row.rays[part];
                for index in 0..BAND {
                    let change = -row.position[index / 2] * if index % 2 == 0 { ray.x } else { ray.y };
                    let at = 2 * row.first + index;
                    sum.axpy(-weight * change * row.errors[part], &self.follows.row(at).transpose(), 1.0);
                }
            }
        }
        // Mean over the poses of (their variance by blocks) / (their variance by the equations).
        let mut by_blocks = DMatrix::zeros(layout.size(), layout.size());
        for sum in blocks.values() {
            by_blocks += sum * sum.transpose();
        }
        let sandwich = inverse * by_blocks * inverse;
        let plain = inverse * &self.left * inverse;
        let ratios = (0..poses).map(|at| sandwich[(at, at)] / plain[(at, at)].max(1e-12));
        (ratios.sum::<f64>() / poses.max(1) as f64).max(LEAST_LOSS)
    }
}

/// The poses that fit best, from first ones that are about right; None if the equations have no solution.
#[must_use]
pub fn solve(glimpses: &[Glimpse], start: &[Pose]) -> Option<Joint> {
    let layout = Layout { modules: start.len() };
    let (first, last) = (glimpses.first()?, glimpses.last()?);
    let mut state = State {
        poses: start.to_vec(),
        rest: DVector::zeros(layout.size()),
        walk: Spline::new(first.at_s - KNOT_S, last.at_s + KNOT_S),
    };
    lay(&mut state, glimpses);
    let mut damping = 1e-3;
    let mut at = equations(glimpses, &state, layout)?;
    for _ in 0..STEPS {
        let next = at.step(&state, damping, layout)?;
        let now = cost(glimpses, &next, layout);
        if now <= at.cost {
            let gained = at.cost - now;
            state = next;
            let done = gained < 1e-6 * (1.0 + now);
            at = equations(glimpses, &state, layout)?;
            damping = (damping * 0.1).max(1e-9);
            if done {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e6 {
                break;
            }
        }
    }
    let inverse = (at.left.clone() + DMatrix::from_diagonal(&at.priors)).cholesky()?.inverse();
    let loss = at.loss(glimpses, &state, layout, &inverse);
    let information = at.left.clone() / loss + DMatrix::from_diagonal(&at.priors);
    let covariance = information.cholesky()?.inverse();
    let of_poses_and_scales = 4 * layout.modules - 3;
    let mut residuals_m = vec![Vec::new(); layout.modules];
    for glimpse in glimpses {
        let [along, across] = Row::of(glimpse, &state, layout).errors;
        residuals_m[glimpse.module].push((along * along + across * across).sqrt());
    }
    let number = |module: usize| layout.clock(module).map_or(0.0, |at| state.rest[at]);
    let sigma = |module: usize| layout.clock(module).map_or(0.0, |at| covariance[(at, at)].max(0.0).sqrt());
    Some(Joint {
        clocks_s: (0..layout.modules).map(number).collect(),
        clock_sigmas_s: (0..layout.modules).map(sigma).collect(),
        scales: (0..layout.modules).map(|module| state.rest[layout.scale(module)]).collect(),
        covariance: covariance.view((0, 0), (of_poses_and_scales, of_poses_and_scales)).into_owned(),
        poses: state.poses,
        loss,
        residuals_m,
    })
}

/// Lays the walk through the mean of what is seen at each time.
fn lay(state: &mut State, glimpses: &[Glimpse]) {
    let mut sums = vec![(Point::default(), 0.0); state.walk.points.len()];
    for glimpse in glimpses {
        let place = state.walk.place(glimpse.at_s);
        let at = state.poses[glimpse.module].to_site(glimpse.place());
        for (sum, weight) in sums.iter_mut().skip(place.first).zip(place.position) {
            *sum = (sum.0 + at * weight, sum.1 + weight);
        }
    }
    let mut last = sums.iter().find(|sum| sum.1 > 0.0).map_or(Point::default(), |sum| sum.0 * (1.0 / sum.1));
    for (point, (sum, weight)) in state.walk.points.iter_mut().zip(sums) {
        if weight > 0.01 {
            last = sum * (1.0 / weight);
        }
        *point = last;
    }
}
