//! With what probability a track is inside a zone: its place is a Gaussian, and zones end within it.
//!
//! ```text
//!         ·   ·   ·         nine places about the mean, √3 standard deviations apart,
//!        ───────────  edge  with weights 1/6, 2/3, 1/6 along each axis; those inside, summed
//!         ·   ✕   ·
//!         ·   ·   ·
//! ```
//!
//! Source: Gauss–Hermite quadrature of three points an axis, exact for polynomials up to the fifth degree.

use crate::cells::Areas;
use crate::geometry::{Point, bounds};
use crate::tracker::TrackState;

/// Along an axis: how many times √3 standard deviations off, and the weight in sixths.
const ABSCISSAS: [(f64, u8); 3] = [(-1.0, 1), (0.0, 4), (1.0, 1)];

/// All weights.
pub const WHOLE: u8 = 36;

/// A track that may be inside a zone.
#[derive(Clone, Copy, Debug)]
pub struct Presence<'a> {
    pub track: &'a TrackState,
    /// Its mean is inside: it counts here.
    pub is_inside: bool,
    /// Probability that it is inside, if it exists, in parts of [`WHOLE`].
    pub parts: u8,
}

/// Adds `track` to each zone that it may be in; `inside` has as many entries as there are `areas`.
pub fn place<'a>(track: &'a TrackState, areas: &Areas, inside: &mut [Vec<Presence<'a>>]) {
    let [xx, xy, yy] = track.covariance_m2;
    // The columns of the covariance's Cholesky factor, times √3; a place that is not known at all stays a point.
    let first = (3.0 * xx.max(0.0)).sqrt();
    let slope = if first > 0.0 { 3.0 * xy / first } else { 0.0 };
    let axes = [Point::new(first, slope), Point::new(0.0, slope.mul_add(-slope, 3.0 * yy).max(0.0).sqrt())];
    let along = |(across, one): (f64, u8)| {
        ABSCISSAS.map(|(along, other)| (track.at + axes[0] * across + axes[1] * along, one * other))
    };
    let places = ABSCISSAS.map(along);
    let mean = places[1][1].0;
    let Some(around) = bounds(places.as_flattened().iter().map(|(place, _)| *place)) else { return };
    for zone in areas.near(around) {
        let Some(inside) = inside.get_mut(zone) else { continue };
        if inside.last().is_some_and(|last| last.track.id == track.id) {
            continue;
        }
        let is_in = |(place, _): &&(Point, u8)| areas.is_in(zone, *place);
        let parts = places.as_flattened().iter().filter(is_in).map(|(_, parts)| *parts).sum();
        if parts > 0 {
            inside.push(Presence { track, is_inside: areas.is_in(zone, mean), parts });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::{LifeCycle, Origin};

    fn presence(at: Point, covariance_m2: [f64; 3]) -> Vec<(bool, u8)> {
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let areas = Areas::of(vec![square.map(|(x, y)| Point::new(x, y)).to_vec()]);
        let track = TrackState {
            id: 1,
            at,
            velocity: Point::default(),
            covariance_m2,
            state: LifeCycle::Confirmed,
            existence: 1.0,
            reason: "seen",
            origin: Origin::Entered,
        };
        let mut inside = vec![Vec::new()];
        place(&track, &areas, &mut inside);
        inside[0].iter().map(|presence| (presence.is_inside, presence.parts)).collect()
    }

    #[test]
    fn a_track_is_in_a_zone_as_far_as_its_covariance_is() {
        assert_eq!(presence(Point::new(0.5, 0.5), [0.01, 0.0, 0.01]), [(true, WHOLE)]);
        assert_eq!(presence(Point::new(0.9, 0.5), [0.01, 0.0, 0.01]), [(true, 30)]);
        assert_eq!(presence(Point::new(1.1, 0.5), [0.01, 0.0, 0.01]), [(false, 6)]);
        assert!(presence(Point::new(1.1, 0.5), [0.0001, 0.0, 0.25]).is_empty());
        // Along the diagonal, whose ends are outside.
        assert_eq!(presence(Point::new(0.5, 0.5), [0.25, 0.25, 0.25]), [(true, 24)]);
    }

    #[test]
    fn no_covariance_makes_a_share_that_is_none() {
        for covariance_m2 in [[0.0; 3], [f64::NAN; 3], [f64::INFINITY; 3], [-1.0, 5.0, -1.0], [1.0, 9.0, 1.0]]
        {
            for (_, parts) in presence(Point::new(0.5, 0.5), covariance_m2) {
                assert!(parts <= WHOLE, "{covariance_m2:?}: {parts}");
            }
        }
    }
}
