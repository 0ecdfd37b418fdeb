//! Poses without a ruler: somebody walks about, and where the modules are follows from what they saw.
//!
//! ```text
//!   sightings ─▶ walk     who saw the walker when, alone; how long which two of them at the same time
//!                  │
//!                  ├─▶ advice   where to walk next, until every pair has seen enough
//!                  ▼
//!               align    two modules at a time: one walk, seen twice, is laid upon itself
//!                  ▼
//!               joint    all poses, clocks and the walk at once, with how well each is known
//!                  ▼
//!               room     the same walls in several backgrounds are laid upon each other
//!                  ▼
//!               Calibration, or a Refusal in words
//! ```
//!
//! The first module is held fixed: it says where the site's axes are. Everything here is a plain function or a
//! state machine: sightings in, poses and words out; the same input gives the same bits.
//!
//! A candidate's centre is off by several centimetres along the ray, by the shape of the body and where the
//! chest points; `joint` estimates that with the poses, so that it does not go into them.

pub mod advice;
pub mod align;
mod band;
pub mod coverage;
pub mod joint;
pub mod look;
pub mod room;
pub mod session;
mod spline;
mod turned;
pub mod walk;
pub mod watch;
pub mod words;

use nalgebra::{DMatrix, Matrix3};

use crate::geometry::Pose;
use room::Outline;
use walk::Walk;

/// Time two modules should have seen the walker together, s: at walking speed some 15 m of way, the errors of a
/// body's shape being new every second.
pub const ENOUGH_S: f64 = 20.0;

/// Less than this links no two modules, s.
pub const LEAST_S: f64 = 8.0;

/// The walk two modules share must spread so far about its middle, m (root mean square): centres are wrong by 5 cm,
/// and 5 cm at 0.6 m are as much as 5°, ten times that with the number of scans.
pub const LEAST_SPREAD_M: f64 = 0.4;

/// Greatest uncertainty (95 %) of a pose that is still worth having: half a body, and what moves a centre by
/// as much at 4 m.
pub const WORST_M: f64 = 0.25;
/// The same for its direction, rad.
pub const WORST_RAD: f64 = 4.0 * std::f64::consts::PI / 180.0;

/// From one σ of a normal error to the bound that 95 % of them keep.
pub const SIGMAS_95: f64 = 1.96;

/// The place of one module, as found.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// Where it is and where its front step points.
    pub pose: Pose,
    /// Covariance of x, y (m) and yaw (rad); zero for the module that was held fixed.
    pub covariance: Matrix3<f64>,
    /// How far its clock, as the exchanges have it, is behind the others', s.
    pub clock_s: f64,
    /// One σ of that, s.
    pub clock_sigma_s: f64,
    /// How far the walk it saw is from the walk all saw, m: median.
    pub residual_m: f64,
}

impl Placed {
    /// The radius within which it is with 95 %, m, and the same for its direction, rad.
    #[must_use]
    pub fn bounds(&self) -> (f64, f64) {
        let (xx, xy, yy) = (self.covariance[(0, 0)], self.covariance[(0, 1)], self.covariance[(1, 1)]);
        let (middle, half) = (0.5 * (xx + yy), (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt());
        (radius_95(middle + half, middle - half), SIGMAS_95 * self.covariance[(2, 2)].max(0.0).sqrt())
    }
}

/// The radius that holds 95 % of a normal distribution in the plane whose axes have these variances, the greater first:
/// 1.96 σ of a line, 2.45 σ of a circle, and between them to a hundredth as the formula has it.
fn radius_95(greater: f64, lesser: f64) -> f64 {
    let sigma = greater.max(0.0).sqrt();
    let share = if greater > 0.0 { (lesser / greater).clamp(0.0, 1.0).sqrt() } else { 0.0 };
    sigma * (SIGMAS_95 + share * share * (0.12 + 0.37 * share))
}

/// Two modules that saw the walker together.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair {
    /// Their numbers, the lower one first.
    pub modules: (usize, usize),
    /// How long, s.
    pub common_s: f64,
    /// How far apart the two saw the walker, m: median.
    pub residual_m: f64,
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// All modules, in the order of the site.
    pub modules: Vec<Placed>,
    /// Every pair that saw the walker together.
    pub pairs: Vec<Pair>,
    /// Metres of wall that two backgrounds share, over all pairs; 0 without any.
    pub shared_wall_m: f64,
}

/// Why nothing was found. [`words`] says it to the installer.
#[derive(Clone, Debug, PartialEq)]
pub enum Refusal {
    /// There are not two modules.
    Alone,
    /// A module has seen nobody walk together with any module that is placed.
    Apart {
        /// It.
        module: usize,
    },
    /// Two modules that nothing else links have not seen the walker together for long enough.
    Short {
        /// They.
        modules: (usize, usize),
        /// How long they did, s.
        common_s: f64,
    },
    /// They have, but always at the same place.
    Narrow {
        /// They.
        modules: (usize, usize),
        /// How far the walk spreads about its middle, m.
        spread_m: f64,
    },
    /// What they saw does not fit together.
    Contradiction {
        /// They.
        modules: (usize, usize),
        /// The share of the walk that does.
        share: f64,
    },
    /// Found, but not well enough.
    Vague {
        /// Whose place.
        module: usize,
        /// Within which it is with 95 %, m.
        within_m: f64,
        /// The same for its direction, rad.
        within_rad: f64,
    },
    /// The equations have no solution: what was seen is no walk.
    Unsolved,
}

/// All poses from a walk. `first` is where module 0 is; `rooms` are the backgrounds, by module, as far as known, and
/// empty to do without.
///
/// # Errors
/// The first [`Refusal`] found.
pub fn calibrate(walk: &Walk, first: Pose, rooms: &[Option<Outline>]) -> Result<Calibration, Refusal> {
    let modules = walk.modules();
    if modules < 2 {
        return Err(Refusal::Alone);
    }
    let glimpses = walk.glimpses();
    let start = align::all(walk, first)?;
    let joint = joint::solve(&glimpses, &start).ok_or(Refusal::Unsolved)?;
    let (state, covariance, shared_wall_m) = match room::refine(&joint, rooms) {
        Some(refined) => (refined.poses, refined.covariance, refined.shared_wall_m),
        None => (joint.poses.clone(), joint.pose_covariance(), 0.0),
    };
    let placed = |module: usize| Placed {
        pose: state[module],
        covariance: block(&covariance, module),
        clock_s: joint.clocks_s[module],
        clock_sigma_s: joint.clock_sigmas_s[module],
        residual_m: joint.residual_m(module),
    };
    let calibration = Calibration {
        modules: (0..modules).map(placed).collect(),
        pairs: align::pairs(walk, &state),
        shared_wall_m,
    };
    let bounds = calibration.modules.iter().map(Placed::bounds).enumerate();
    let vague = bounds.filter(|(_, (within_m, within_rad))| *within_m > WORST_M || *within_rad > WORST_RAD);
    match vague.max_by(|a, b| a.1.0.total_cmp(&b.1.0)) {
        Some((module, (within_m, within_rad))) => Err(Refusal::Vague { module, within_m, within_rad }),
        None => Ok(calibration),
    }
}

/// The covariance of one module's x, y and yaw, out of that of all modules but the first.
fn block(covariance: &DMatrix<f64>, module: usize) -> Matrix3<f64> {
    let Some(at) = module.checked_sub(1).map(|index| 3 * index) else { return Matrix3::zeros() };
    Matrix3::from_fn(|row, column| covariance[(at + row, at + column)])
}

/// The middle one of some values; 0 of none.
pub(crate) fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[cfg(test)]
mod tests;
