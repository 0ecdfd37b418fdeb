//! Extrinsic calibration: a person walks about, and the poses of the devices follow from what they saw.
//!
//! ```text
//!   observations ─▶ walk     which device saw the walker when, alone; how long which pair saw it at the same time
//!                     │
//!                     ├─▶ advice   where to walk next, until every pair has seen enough
//!                     ▼
//!                  upside_down   which modules hang head down: theirs is the mirror image of what the others saw
//!                     ▼
//!                  align    registration of two devices at a time: one walk, seen twice, is laid upon itself
//!                     ▼
//!                  joint    bundle adjustment: all poses, clocks and the walk at once, with their covariance
//!                     ▼
//!                  room     scan matching: the same walls in several backgrounds are laid upon each other
//!                     ▼
//!                  Calibration, or a Refusal in words
//! ```
//!
//! A depth camera is a module like any other, and a floor is one that sees a place instead of range and bearing.
//!
//! One device is held fixed: it says where the site's axes are. Everything here is a plain function or a
//! state machine: observations in, poses and words out; the same input gives the same bits.
//!
//! A candidate's centre is off by several centimetres along the ray, by the shape of the body and the direction of the
//! chest; `joint` estimates that with the poses, so that it does not distort them.

pub mod advice;
pub mod align;
mod band;
pub mod coverage;
mod equations;
pub mod held;
pub mod joint;
mod limits;
mod names;
mod nearby;
mod result;
pub mod room;
mod row;
pub mod session;
mod spline;
mod statistics;
pub mod status;
mod steps;
pub mod told;
mod turned;
pub mod upside_down;
pub mod walk;
pub mod walker;
pub mod watch;
pub mod words;

use nalgebra::{DMatrix, Matrix3};

use crate::geometry::Pose;
pub use limits::{ENOUGH_S, LEAST_S, LEAST_SPREAD_M, SIGMAS_95, WORST_M, WORST_RAD};
pub use names::Names;
pub use result::{Calibration, Hang, Pair, Placed, Refusal};
use room::Outline;
pub(crate) use statistics::median;
use walk::Walk;

/// All poses from a walk. `first` is where module 0 is, which measures beams; floors are the last ones. `rooms` are the
/// backgrounds, by module, as far as known, and empty to do without.
///
/// # Errors
/// The first [`Refusal`] found.
pub fn calibrate(walk: &Walk, first: Pose, rooms: &[Option<Outline>]) -> Result<Calibration, Refusal> {
    let modules = walk.modules();
    if modules < 2 {
        return Err(Refusal::Alone);
    }
    let hangs = upside_down::find(walk);
    let turned: Vec<bool> = hangs.iter().map(|hang| hang.turned).collect();
    let walk = &walk.with_turned(&turned);
    let rooms: Vec<Option<Outline>> =
        rooms.iter().zip(&turned).map(|(room, turned)| over(room, *turned)).collect();
    let glimpses = walk.glimpses();
    let start = align::all(walk, first)?;
    let joint = joint::solve(&glimpses, &start).ok_or(Refusal::Unsolved)?;
    let (state, covariance, shared_wall_m) = match room::refine(&joint, &rooms) {
        Some(refined) => (refined.poses, refined.covariance, refined.shared_wall_m),
        None => (joint.poses.clone(), joint.pose_covariance(), 0.0),
    };
    let placed = |module: usize| Placed {
        pose: state[module],
        covariance: block(&covariance, module),
        clock_s: joint.clocks_s[module],
        clock_sigma_s: joint.clock_sigmas_s[module],
        residual_m: joint.residual_m(module),
        hang: hangs[module],
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

/// The background of a module that hangs the other way up.
fn over(room: &Option<Outline>, turned: bool) -> Option<Outline> {
    let room = room.as_ref()?;
    Some(if turned { room.mirrored() } else { room.clone() })
}

/// The covariance of one module's x, y and yaw, out of that of all modules but the first.
fn block(covariance: &DMatrix<f64>, module: usize) -> Matrix3<f64> {
    let Some(at) = module.checked_sub(1).map(|index| 3 * index) else { return Matrix3::zeros() };
    Matrix3::from_fn(|row, column| covariance[(at + row, at + column)])
}

#[cfg(test)]
mod tests;
