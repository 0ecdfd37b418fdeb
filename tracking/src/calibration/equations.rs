//! The equations of the bundle adjustment at a state, with the walk eliminated (a Schur complement).
//!
//! ```text
//!   ┌ band  mixed ┐   the walk: a band, two numbers a knot
//!   └ mixedᵀ whole┘   the others: poses, scales, clocks, body      left = whole − mixedᵀ · band⁻¹ · mixed
//! ```

use nalgebra::{DMatrix, DVector};

use crate::geometry::{Point, wrapped};

use super::band::{BAND, Band, Factor};
use super::row::{Layout, Row, SHAPES, State};
use super::spline::{ACCELERATION_M_S2, KNOT_S};
use super::walk::Glimpse;

/// One σ before anything is seen: of a clock after the exchanges of the network, s; of a sensor's scale (a range
/// finder is within 1 %); of the constant part of the body's offset and of its changes with the angle, m.
const CLOCK_S: f64 = 0.010;
/// Of a floor it is also by how much the middle of the time that a foot is down is off the moment at which the body is above it:
/// a fifth of a step's time.
const FEET_S: f64 = 0.1;
const SCALE: f64 = 0.003;
const BODY_M: [f64; SHAPES] = [0.03, 0.02, 0.03, 0.02, 0.03];

/// Blocks over which errors are summed, s.
const BLOCK_S: f64 = 2.0;

/// The least loss: five numbers do not say all of a body's shape, and what they leave does not scatter from block to block
/// of one walk. On development seeds bounds without it held 88 to 96 %.
const LEAST_LOSS: f64 = 1.4;

/// The equations at a state, with the walk eliminated.
pub struct Equations {
    pub cost: f64,
    pub factor: Factor,
    /// Walk against the others.
    pub mixed: DMatrix<f64>,
    /// Factor⁻¹ of that: how the walk follows the others.
    pub follows: DMatrix<f64>,
    pub walk_side: DVector<f64>,
    /// What is left for the others; without the priors, and they.
    pub left: DMatrix<f64>,
    pub left_side: DVector<f64>,
    pub priors: DVector<f64>,
}

fn priors(layout: Layout) -> DVector<f64> {
    let mut priors = DVector::zeros(layout.size());
    for module in 0..layout.modules {
        priors[layout.scale(module)] = 1.0 / (SCALE * SCALE);
        if let Some(at) = layout.clock(module) {
            let sigma_s = if module < layout.beams { CLOCK_S } else { FEET_S };
            priors[at] = 1.0 / (sigma_s * sigma_s);
        }
    }
    for (shape, sigma_m) in BODY_M.iter().enumerate() {
        priors[layout.body() + shape] = 1.0 / (sigma_m * sigma_m);
    }
    priors
}

/// The curvature of the walk, as a whole σ.
const BEND: f64 = 1.0 / (KNOT_S * KNOT_S * ACCELERATION_M_S2);

pub fn cost(glimpses: &[Glimpse], state: &State, layout: Layout) -> f64 {
    let seen: f64 = glimpses.iter().map(|glimpse| Row::of(glimpse, state, layout).weight().1).sum();
    let bends = state.walk.points.windows(3).map(|three| {
        let bend = (three[0] - three[1] * 2.0 + three[2]) * BEND;
        0.5 * bend.dot(bend)
    });
    let priors = priors(layout);
    let known = state.rest.iter().zip(priors.iter()).map(|(value, weight)| 0.5 * weight * value * value);
    seen + bends.sum::<f64>() + known.sum::<f64>()
}

pub fn equations(glimpses: &[Glimpse], state: &State, layout: Layout) -> Option<Equations> {
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
    pub fn step(&self, state: &State, damping: f64, layout: Layout) -> Option<State> {
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

    /// How much more errors weigh than independent ones: their sums over blocks of time against themselves. Of modules, and of
    /// floors.
    pub fn losses(
        &self,
        glimpses: &[Glimpse],
        state: &State,
        layout: Layout,
        inverse: &DMatrix<f64>,
    ) -> [f64; 2] {
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
        let beams = 3 * (layout.beams - 1);
        [0..beams, beams..poses].map(|poses| {
            let number = poses.len().max(1) as f64;
            let ratios = poses.map(|at| sandwich[(at, at)] / plain[(at, at)].max(1e-12));
            (ratios.sum::<f64>() / number).max(LEAST_LOSS)
        })
    }
}
