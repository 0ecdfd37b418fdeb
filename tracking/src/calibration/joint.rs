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
//! What a floor sees is a place: `row`. The feet of a walker have no shape that depends on the side.
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

use crate::geometry::{Point, Pose};

use super::equations::{cost, equations};
use super::median;
use super::row::{Layout, Row, State};
use super::spline::{KNOT_S, Spline};
use super::walk::{By, Glimpse};

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

/// The poses that fit best, from first ones that are about right; None if the equations have no solution.
#[must_use]
pub fn solve(glimpses: &[Glimpse], start: &[Pose]) -> Option<Joint> {
    let floors = glimpses.iter().filter(|glimpse| glimpse.by == By::Panels).map(|glimpse| glimpse.module);
    let layout = Layout { modules: start.len(), beams: floors.min().unwrap_or(start.len()) };
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
    let [loss, of_floors] = at.losses(glimpses, &state, layout, &inverse);
    let information = at.left.clone() / loss + DMatrix::from_diagonal(&at.priors);
    let mut covariance = information.cholesky()?.inverse();
    let wider = (of_floors / loss).max(1.0).sqrt();
    for at in 3 * (layout.beams - 1)..3 * (layout.modules - 1) {
        covariance.row_mut(at).scale_mut(wider);
        covariance.column_mut(at).scale_mut(wider);
    }
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
