//! Registration of two devices: the turn and shift that lay the walk seen by one upon the walk seen by the other; then
//! from device to device along the best pairs. The start of the bundle adjustment in `joint`.
//!
//! ```text
//!   in a's frame  ╭──╮      in b's frame   ╰╮      turn and shift that bring one upon the other:
//!                 │  ╰─                  ╭──╯      weighted least squares, robust against outliers
//!
//!   hall ══ 31 s ══ kitchen ══ 24 s ══ study       a spanning tree of the pairs that share most
//!     └─────── 9 s ────────┘ (not needed to begin)
//! ```

use crate::geometry::{Point, Pose, wrapped};

use super::walk::{Glimpse, Walk};
use super::{ENOUGH_S, LEAST_S, LEAST_SPREAD_M, Pair, Refusal, median};

/// Two centres of one walker are no farther apart, m: twice the bias of a body and half a walker's way in a scan.
const FITS_M: f64 = 0.25;

/// Share of the common walk that must fit.
const FITS_SHARE: f64 = 0.7;

/// Least squares, repeated with weights from the last round.
const ROUNDS: usize = 30;

/// One module in the frame of another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Where the second device is, in the frame of the first.
    pub pose: Pose,
    /// Share of the common walk that fits.
    pub share: f64,
    /// How far what fits of the common walk spreads about its middle, m.
    pub spread_m: f64,
    /// Common time, s.
    pub common_s: f64,
}

impl Link {
    /// Why it is no good, if it is not; it links these modules.
    fn refusal(&self, modules: (usize, usize)) -> Option<Refusal> {
        if self.common_s < LEAST_S {
            return Some(Refusal::Short { modules, common_s: self.common_s });
        }
        if self.share < FITS_SHARE {
            return Some(Refusal::Contradiction { modules, share: self.share });
        }
        (self.spread_m < LEAST_SPREAD_M).then_some(Refusal::Narrow { modules, spread_m: self.spread_m })
    }
}

/// Where module `other` is in the frame of `one`; None without a common walk.
#[must_use]
pub fn link(walk: &Walk, one: usize, other: usize) -> Option<Link> {
    let common: Vec<(Point, Point)> =
        walk.common(one, other).map(|(here, there)| (here.place(), there.place())).collect();
    let pose = registered(&common)?;
    let fits = |(here, there): &&(Point, Point)| (pose.to_site(*there) - *here).length() < FITS_M;
    // What does not fit says nothing of the pose, however far away it is.
    let fitting: Vec<Point> = common.iter().filter(fits).map(|(here, _)| *here).collect();
    let count = fitting.len().max(1) as f64;
    let middle = fitting.iter().fold(Point::default(), |sum, here| sum + *here) * (1.0 / count);
    let spread: f64 = fitting.iter().map(|here| (*here - middle).dot(*here - middle)).sum();
    Some(Link {
        pose,
        share: fitting.len() as f64 / common.len() as f64,
        spread_m: (spread / count).sqrt(),
        common_s: walk.common_s(one, other),
    })
}

/// How far apart two modules see the walker once their walks are laid upon each other, m: median; `mirrored` takes one of the
/// two for its mirror image. None without a common walk.
pub(super) fn apart_m(walk: &Walk, (one, other): (usize, usize), mirrored: bool) -> Option<f64> {
    let there = |glimpse: Glimpse| if mirrored { glimpse.mirrored() } else { glimpse };
    let common: Vec<(Point, Point)> =
        walk.common(one, other).map(|(here, seen)| (here.place(), there(seen).place())).collect();
    let pose = registered(&common)?;
    let mut apart: Vec<f64> =
        common.iter().map(|(here, there)| (pose.to_site(*there) - *here).length()).collect();
    Some(median(&mut apart))
}

/// The turn and shift that lay the second places upon the first, whatever a few of them are; None of fewer than three.
fn registered(common: &[(Point, Point)]) -> Option<Pose> {
    if common.len() < 3 {
        return None;
    }
    let mut weights = vec![1.0; common.len()];
    let mut pose = fit(common, &weights);
    // What lies far off counts little from the first round on, and ever less.
    for round in 0..ROUNDS {
        let scale_m = FITS_M * (1.0 + 3.0 * (1.0 - (round as f64 / 10.0).min(1.0)));
        for (weight, (here, there)) in weights.iter_mut().zip(common) {
            let off = (pose.to_site(*there) - *here).length() / scale_m;
            *weight = 1.0 / (1.0 + off * off).powi(2);
        }
        pose = fit(common, &weights);
    }
    Some(pose)
}

/// The turn and shift that bring the second places upon the first: in the plane the best turn is the angle of the
/// sum of scalar and vector products.
fn fit(common: &[(Point, Point)], weights: &[f64]) -> Pose {
    let total: f64 = weights.iter().sum::<f64>().max(1e-12);
    let mean = |pick: fn(&(Point, Point)) -> Point| {
        let sum = common
            .iter()
            .zip(weights)
            .fold(Point::default(), |sum, (pair, &weight)| sum + pick(pair) * weight);
        sum * (1.0 / total)
    };
    let (here, there) = (mean(|pair| pair.0), mean(|pair| pair.1));
    let (mut scalar, mut vector) = (0.0, 0.0);
    for ((one, other), weight) in common.iter().zip(weights) {
        scalar += weight * (*other - there).dot(*one - here);
        vector += weight * (*other - there).cross(*one - here);
    }
    let turned = Pose { at: Point::default(), yaw_rad: libm::atan2(vector, scalar) };
    Pose { at: here - turned.to_site(there), ..turned }
}

/// A pose given in the frame of another.
fn seen_from(base: &Pose, relative: &Pose) -> Pose {
    Pose { at: base.to_site(relative.at), yaw_rad: wrapped(base.yaw_rad + relative.yaw_rad) }
}

/// First poses of all modules: from module to module, the pair that shares most first.
///
/// # Errors
/// A module cannot be reached; the pair that comes nearest is named.
pub fn all(walk: &Walk, first: Pose) -> Result<Vec<Pose>, Refusal> {
    let modules = walk.modules();
    let mut poses: Vec<Option<Pose>> = vec![None; modules];
    poses[0] = Some(first);
    let links: Vec<((usize, usize), Link)> =
        walk.pairs().into_iter().filter_map(|(pair, _)| Some((pair, link(walk, pair.0, pair.1)?))).collect();
    while poses.iter().any(Option::is_none) {
        // Pairs with one device that is placed and one that is not.
        let open = links.iter().filter(|((one, other), _)| poses[*one].is_some() != poses[*other].is_some());
        let worth = |link: &Link| link.common_s.min(2.0 * ENOUGH_S) * link.spread_m.min(2.0) * link.share;
        // One that is no good is looked at only to say why.
        let good = |link: &Link| link.refusal((0, 0)).is_none();
        let order = |a: &Link, b: &Link| good(a).cmp(&good(b)).then(worth(a).total_cmp(&worth(b)));
        let Some(((one, other), link)) = open.max_by(|a, b| order(&a.1, &b.1)) else {
            let module = poses.iter().position(Option::is_none).unwrap_or(0);
            return Err(Refusal::Apart { module });
        };
        let modules = (*one, *other);
        if let Some(refusal) = link.refusal(modules) {
            return Err(refusal);
        }
        match (poses[*one], poses[*other]) {
            (Some(base), _) => poses[*other] = Some(seen_from(&base, &link.pose)),
            (None, Some(base)) => poses[*one] = Some(seen_from(&base, &inverse(&link.pose))),
            (None, None) => return Err(Refusal::Unsolved),
        }
    }
    Ok(poses.into_iter().flatten().collect())
}

/// Inverts a pose: from the second device in the frame of the first to the first in the frame of the second.
fn inverse(pose: &Pose) -> Pose {
    Pose { at: pose.to_sensor(Point::default()), yaw_rad: -pose.yaw_rad }
}

/// Every pair's common time, and how far apart the two see the walker from these poses.
#[must_use]
pub fn pairs(walk: &Walk, poses: &[Pose]) -> Vec<Pair> {
    let pair = |((one, other), common_s): ((usize, usize), f64)| {
        let apart = |(here, there): (Glimpse, Glimpse)| {
            (poses[one].to_site(here.place()) - poses[other].to_site(there.place())).length()
        };
        let mut apart: Vec<f64> = walk.common(one, other).map(apart).collect();
        Pair { modules: (one, other), common_s, residual_m: median(&mut apart) }
    };
    walk.pairs().into_iter().map(pair).collect()
}
