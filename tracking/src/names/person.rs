//! A track as names know it: how well it agrees with a reading, and with which others it may have been swapped.
//!
//! ```text
//!   agreement   ◌ P   ◌ R      N(z − x; 0, P + R) / N(0; 0, R)        touch    ◌ ◌    share of the places that P₁ and P₂
//!               x ─── z                                                        x₁x₂   leave open and that touch
//! ```
//!
//! Source: eq. 3 of Ota et al. 2006 (docs/bibliography.md, paper B), with the track's own covariance beside the reading's.

use nalgebra::Matrix2;

use crate::geometry::{Point, mahalanobis};
use crate::tracker::{LifeCycle, Origin, TrackId, TrackState};

/// A tag is carried so far from the middle of its body, m, one sigma along each axis: half a torso's width.
const CARRIED_M: f64 = 0.15;

/// Two middles so far apart touch while modules see both, m, one sigma: with it about as many swaps are expected as trackers make
/// (docs/design.md, names); shoulder to shoulder is three of them.
const TOUCH_M: f64 = 0.15;

/// The same while one of them is hidden or known by its feet, m: a body is that wide.
const WIDE_TOUCH_M: f64 = 0.25;

/// Tracks that touch for so long are alike by two thirds, s: the tracker tells passing walkers apart.
const MIX_S: f64 = 1.0;

/// Rarer swaps are not worth computing, 1/s: one in a quarter of an hour.
const RARE: f64 = 1e-3;

/// Farther apart no two may have been swapped, m: however wide their covariances are, the rate is at most
/// 2 · [`WIDE_TOUCH_M`]² ÷ e ÷ distance², and less than [`RARE`] beyond 6.8 m.
const FAR_M: f64 = 7.0;

/// A track at one moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Person {
    pub(super) track: TrackId,
    pub(super) at: Point,
    pub(super) velocity: Point,
    pub(super) covariance: Matrix2<f64>,
    pub(super) existence: f64,
    /// Whether a module sees it, and so tells it from one that touches it; not while it is hidden, nor if a floor feels its feet.
    pub(super) is_told_apart: bool,
}

impl Person {
    /// A track that can have a name: a part of another has none of its own.
    pub(super) fn of(track: &TrackState) -> Option<Self> {
        let [xx, xy, yy] = track.covariance_m2;
        let numbers = [track.at.x, track.at.y, track.velocity.x, track.velocity.y, xx, xy, yy];
        let is_sound = numbers.iter().all(|number| number.is_finite()) && xx >= 0.0 && yy >= 0.0;
        let is_own = !matches!(track.origin, Origin::PartOf(_));
        (is_sound && is_own).then(|| Self {
            track: track.id,
            at: track.at,
            velocity: track.velocity,
            covariance: Matrix2::new(xx, xy, xy, yy),
            existence: if track.existence.is_nan() { 0.0 } else { track.existence.clamp(0.0, 1.0) },
            is_told_apart: track.state != LifeCycle::Occluded,
        })
    }
}

/// How well a track agrees with a reading of the covariance `spread`, m²: N(offset; 0, P + R) as a share of what it
/// could be at most, N(0; 0, R). R is that of the reading, and of the tag on its body.
pub(super) fn agreement(offset: Point, covariance: Matrix2<f64>, spread: Matrix2<f64>) -> f64 {
    let spread = spread + Matrix2::identity() * (CARRIED_M * CARRIED_M);
    let (away, size_m4) = mahalanobis(offset, covariance + spread);
    libm::exp(-0.5 * away) * (spread.determinant() / size_m4).sqrt().min(1.0)
}

/// Two tracks that may have been swapped, by their places in the list, and how far they have become alike, 0 to 1.
pub(super) type Swap = (usize, usize, f64);

/// Pairs of people who may have been swapped within `passed_s`, but for pairs of the `first` ones. Whether two touch is not
/// known but likely: the share of their places, as far as those are known, that lie a touch apart.
pub(super) fn swaps(people: &[Person], first: usize, passed_s: f64) -> Vec<Swap> {
    let mut swaps = Vec::new();
    for (index, one) in people.iter().enumerate() {
        for (number, other) in people.iter().enumerate().skip(first.max(index + 1)) {
            if (other.at - one.at).length() > FAR_M {
                continue;
            }
            let touch_m = if one.is_told_apart && other.is_told_apart { TOUCH_M } else { WIDE_TOUCH_M };
            let touch = Matrix2::identity() * (touch_m * touch_m);
            let (away, size_m4) = mahalanobis(other.at - one.at, one.covariance + other.covariance + touch);
            let rate = libm::exp(-0.5 * away) * (touch.determinant() / size_m4).sqrt() / MIX_S;
            if rate > RARE {
                swaps.push((index, number, 1.0 - libm::exp(-rate * passed_s)));
            }
        }
    }
    swaps
}
