//! What a calibration finds, or why it finds nothing.

use nalgebra::Matrix3;

use super::limits::SIGMAS_95;
use crate::geometry::Pose;

/// How a module hangs, as the walk says.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Hang {
    /// The other way up than it was observed with.
    pub turned: bool,
    /// How far apart it and another module see the walker, m: this way up, and the other way; None where the walk does not
    /// say it.
    pub apart_m: Option<(f64, f64)>,
}

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
    /// Whether it hangs the other way up than it was observed with; its pose is of that way up.
    pub hang: Hang,
}

impl Placed {
    /// The radius within which it is with 95 %, m, and the same for its direction, rad; without end if its covariance is no numbers.
    #[must_use]
    pub fn bounds(&self) -> (f64, f64) {
        // The greater of 0 and what is no number is 0: the place would be said to be exact.
        if self.covariance.iter().any(|value| !value.is_finite()) {
            return (f64::INFINITY, f64::INFINITY);
        }
        let (xx, xy, yy) = (self.covariance[(0, 0)], self.covariance[(0, 1)], self.covariance[(1, 1)]);
        let (middle, half) = (0.5 * (xx + yy), (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt());
        (radius_95(middle + half, middle - half), SIGMAS_95 * self.covariance[(2, 2)].max(0.0).sqrt())
    }

    /// Within which its clock is with 95 %, s.
    #[must_use]
    pub fn clock_within_s(&self) -> f64 {
        self.clock_s.abs() + SIGMAS_95 * self.clock_sigma_s
    }
}

/// The radius that holds 95 % of a normal distribution in the plane whose axes have these variances, the greater first:
/// 1.96 σ of a line, 2.45 σ of a circle, and between them to a hundredth as the formula has it.
pub(super) fn radius_95(greater: f64, lesser: f64) -> f64 {
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

impl Calibration {
    /// Of a single module, whose place needs no walk: it says itself where the site's axes are.
    #[must_use]
    pub fn of_one(pose: Pose) -> Self {
        let only = Placed {
            pose,
            covariance: Matrix3::zeros(),
            clock_s: 0.0,
            clock_sigma_s: 0.0,
            residual_m: 0.0,
            hang: Hang::default(),
        };
        Self { modules: vec![only], pairs: Vec::new(), shared_wall_m: 0.0 }
    }
}

/// Why nothing was found. [`words`](super::words) says it to the installer.
#[derive(Clone, Debug, PartialEq)]
pub enum Refusal {
    /// There are not two modules.
    Alone,
    /// A module has seen no person walk together with any module that is placed.
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
        /// The module with the uncertain place.
        module: usize,
        /// Within which it is with 95 %, m.
        within_m: f64,
        /// The same for its direction, rad.
        within_rad: f64,
    },
    /// The equations have no solution: what was seen is no walk.
    Unsolved,
    /// Since the walk began, the site has got other modules or floors or another order of them, or has a module the other way up or
    /// the one that is held at another place.
    SiteChanged,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    #[test]
    fn what_is_no_number_is_not_exact() {
        let mut placed = Calibration::of_one(Pose { at: Point::default(), yaw_rad: 0.0 }).modules.remove(0);
        assert_eq!(placed.bounds(), (0.0, 0.0));
        placed.covariance[(0, 0)] = f64::NAN;
        assert_eq!(placed.bounds(), (f64::INFINITY, f64::INFINITY));
    }
}
