//! A track of the modules and a body on a floor: how likely they are the same person, and where that person is.
//!
//! ```text
//!   ✕ ┄┄┄ d ┄┄┄ ◖       S = P + Q + L      cost = dᵀ S⁻¹ d + ln |S| / |L|
//!   P            Q       L: from the trunk, which beams meet, to what is above the feet
//! ```

use nalgebra::{Matrix2, Vector2};

use crate::geometry::Point;
use crate::tracker::{LifeCycle, TrackState};

/// From the trunk to what is above the feet, m, one sigma: a walker leans and swings by as much.
const LEAN_M: f64 = 0.1;

/// What a floor says of a hidden person's place, m, one sigma. In a crowd it is off by 0.27 m, more at its edge, where
/// one foot is beside it; and as long as the feet stand, so does the error: readings in a row do not average it.
const ON_FLOOR_M: f64 = 0.4;

/// As far as a person can be from feet that are taken for that person's, m: the longest step, 0.7 m, and what either place is off.
pub(super) const REACH_M: f64 = 0.9;

/// How likely a hidden person is over the feet, instead of where both places weigh: nothing says which.
const OVER_FEET: f64 = 0.5;

/// Farther apart, in squared standard deviations, they are two people: 99 % of one person's places are nearer
/// (χ² with two degrees of freedom).
const GATE: f64 = 9.21;

/// What it costs that a track and a body are two people of whom each source misses one: more than any pair within the
/// gate whose places are known as well as both sources know them.
pub(super) const ALONE: f64 = GATE + STAYS + HIDDEN;

/// A pair of before stays one unless another is so much likelier, in the units of the gate: 20 : 1.
const STAYS: f64 = 6.0;

/// What a pair of a hidden track may cost more, ln |S| / |L|: hidden for a second, it is known to 0.3 m.
const HIDDEN: f64 = 5.0;

fn covariance(track: &TrackState) -> Matrix2<f64> {
    let [xx, xy, yy] = track.covariance_m2;
    Matrix2::new(xx, xy, xy, yy)
}

/// That it is one person, as a cost; None: it is not.
pub(super) fn cost(track: &TrackState, body: &TrackState, were_one: bool) -> Option<f64> {
    let lean = Matrix2::identity() * (LEAN_M * LEAN_M);
    let spread = covariance(track) + covariance(body) + lean;
    let off = Vector2::new(body.at.x - track.at.x, body.at.y - track.at.y);
    let distance = off.dot(&(spread.try_inverse()? * off));
    let volume = libm::log(spread.determinant() / lean.determinant());
    let anew = if were_one { 0.0 } else { STAYS };
    (distance + anew < GATE + STAYS).then_some(distance + volume + anew)
}

/// Both as one person. Where a module sees the person its place stands; where the person is hidden, what is left of it
/// and the floor's weigh by how well they are known. The feet may be another's: the person may as well be over them, and
/// the covariance says so. A track that may not be a person is one if the floor says so, too.
pub(super) fn fused(track: &TrackState, body: &TrackState) -> TrackState {
    let is_sure = body.state == LifeCycle::Confirmed;
    if track.state != LifeCycle::Occluded {
        let state = if is_sure { LifeCycle::Confirmed } else { track.state };
        return TrackState { state, existence: track.existence.max(body.existence), ..*track };
    }
    let own = covariance(track);
    let other = covariance(body) + Matrix2::identity() * (ON_FLOOR_M * ON_FLOOR_M);
    let Some(inverse) = (own + other).try_inverse() else { return *track };
    let gain = own * inverse;
    let weighed = |one: Point, two: Point| {
        let off = gain * Vector2::new(two.x - one.x, two.y - one.y);
        Point::new(one.x + off.x, one.y + off.y)
    };
    let at = weighed(track.at, body.at);
    let off = Vector2::new(at.x - body.at.x, at.y - body.at.y);
    let spread = (Matrix2::identity() - gain) * own + off * off.transpose() * OVER_FEET;
    TrackState {
        at,
        velocity: weighed(track.velocity, body.velocity),
        covariance_m2: [spread[(0, 0)], 0.5 * (spread[(0, 1)] + spread[(1, 0)]), spread[(1, 1)]],
        state: if is_sure { LifeCycle::Confirmed } else { track.state },
        existence: track.existence.max(body.existence),
        reason: if is_sure { "hidden, on the floor" } else { track.reason },
        ..*track
    }
}

/// The place of a track, and four around it so many standard deviations off, along the site's axes.
pub(super) fn around(track: &TrackState, sigmas: f64) -> [Point; 5] {
    let [xx, _, yy] = track.covariance_m2.map(|variance| sigmas * variance.max(0.0).sqrt());
    let at = |x: f64, y: f64| Point::new(track.at.x + x, track.at.y + y);
    [at(0.0, 0.0), at(xx, 0.0), at(-xx, 0.0), at(0.0, yy), at(0.0, -yy)]
}
