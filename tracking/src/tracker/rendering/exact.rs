//! The formulas of [`super::ray`] and [`super::field`] against brute force: two bodies and thirty beams.
//!
//! The sum over all surfaces is written down anew here, without tables, prefix sums or mean fields.

use super::SPEAKS;
use super::body::Body;
use super::cloud::{Cloud, SAMPLES};
use super::ellipse::{ALONG_M, Edge, Outline};
use super::field::render;
use super::random::Random;
use super::ray::{Mixture, Surface};
use super::sample::Sample;
use super::scan::{Measured, Scan};
use super::window::window;
use crate::geometry::Point;

/// Thirty beams around the front.
const BEAMS: std::ops::Range<usize> = 327..357;

/// Density of a range in p(z), 1/m: noise of a surface, a Student distribution of three degrees of freedom, by its general formula.
fn noise(off_m: f64) -> f64 {
    let (freedom, scale_m) = (3.0, 0.0286);
    let gamma = |x: f64| libm::exp(libm::lgamma(x));
    let peak = gamma(0.5 * (freedom + 1.0))
        / (gamma(0.5 * freedom) * (freedom * core::f64::consts::PI).sqrt() * scale_m);
    let off = off_m / scale_m;
    peak * libm::pow(1.0 + off * off / freedom, -0.5 * (freedom + 1.0))
}

/// p(z) of a beam with these surfaces, opacity and range.
fn density(measured: Measured, mut surfaces: Vec<(f64, f64)>) -> f64 {
    surfaces.sort_by(|one, other| one.1.total_cmp(&other.1));
    let (mut sum, mut through, mut through_to_background) = (0.10, 1.0, 1.0);
    for (opacity, range_m) in surfaces {
        if let Measured::Hit(hit_m) | Measured::Swept(hit_m) = measured {
            sum += through * opacity * noise(hit_m - range_m);
        }
        through *= 1.0 - opacity;
        match measured {
            Measured::Free(background_m) | Measured::Swept(background_m) if range_m < background_m => {
                through_to_background = through;
            }
            _ => {}
        }
    }
    if matches!(measured, Measured::Hit(_)) { sum } else { sum + 10.0 * through_to_background }
}

fn cloud(middle: Point, sd_m: f64, random: &mut Random) -> Body {
    let sample = |_| {
        let (x, y) = random.pair();
        let at = middle + Point::new(x, y) * sd_m;
        Sample::new(at, Point::default(), Point::new(0.0, 1.0))
    };
    Body::begin(1, 20.0, Cloud::new((0..SAMPLES).map(sample).collect(), 0.0))
}

/// What thirty beams see of one body, half of them of nothing.
fn results(scan: &Scan, seen: &Sample) -> Vec<Measured> {
    let result = |beam| match seen.torso().meet_one(scan.towards(beam), Edge::of(true)) {
        (opacity, range_m) if opacity > 0.5 => Measured::Hit(range_m + 0.01),
        _ => Measured::Free(3.5),
    };
    BEAMS.map(result).collect()
}

#[test]
fn the_ratio_of_thirty_beams_is_that_of_the_sums_over_all_surfaces() {
    let (scan, edge) = (Scan::at_origin(), Edge::of(true));
    let heading = Point::new(0.0, 1.0);
    for at in [Point::new(1.2, 0.05), Point::new(1.9, -0.1), Point::new(2.6, 0.2)] {
        let (own, other) =
            (Outline::body(at, heading, 1.0, 1.0), Outline::body(Point::new(2.0, 0.1), heading, 1.1, 1.0));
        let (mut fast, mut slow) = (0.0, 0.0);
        for beam in BEAMS {
            let towards = scan.towards(beam);
            let (own, other) = (own.meet_one(towards, edge), other.meet_one(towards, edge));
            let hits = [Measured::Hit(2.0 - ALONG_M), Measured::Hit(1.3), Measured::Swept(1.9)];
            for measured in hits.into_iter().chain([Measured::Free(2.2), Measured::Free(3.9)]) {
                let surface = Surface { opacity: other.0, range_m: other.1, variance_m2: 0.0 };
                let mixture = Mixture::new(measured, &mut [surface]);
                fast += libm::log(mixture.ratio_alone(own.0, own.1));
                slow += libm::log(density(measured, vec![own, other]) / density(measured, vec![other]));
            }
        }
        assert!((fast - slow).abs() < 0.02 * slow.abs().max(1.0), "{at:?}: {fast} {slow}");
    }
}

#[test]
fn the_likelihood_of_all_ranges_is_what_does_not_pass() {
    let surfaces = [(0.6, 1.2), (0.9, 2.0)];
    let step_m = 0.001;
    let mass: f64 = (0..4000)
        .map(|step| Measured::Hit(f64::from(step) * step_m))
        .map(|measured| {
            let mut surfaces =
                surfaces.map(|(opacity, range_m)| Surface { opacity, range_m, variance_m2: 0.0 });
            (Mixture::new(measured, &mut surfaces).without - 0.10) * step_m
        })
        .sum();
    assert!((mass - (1.0 - 0.4 * 0.1)).abs() < 0.001, "{mass}");
}

#[test]
fn the_mean_field_of_a_seen_body_is_the_mean_over_its_cloud() {
    let (scan, edge, mut random) = (Scan::at_origin(), Edge::of(true), Random::new(3));
    let other = cloud(Point::new(2.0, 0.1), 0.015, &mut random);
    let measured = results(&scan, &other.cloud.samples()[0]);
    let window = window(&other, &scan, 1).unwrap();
    let field = render(&other, &scan, &window, edge);
    for at in [Point::new(1.3, 0.0), Point::new(2.5, 0.1), Point::new(2.0, -0.5)] {
        let own = Outline::body(at, Point::new(0.0, 1.0), 1.0, 1.0);
        let mut fast = 0.0;
        for (beam, &measured) in BEAMS.zip(&measured) {
            let mut surfaces: Vec<Surface> = field.at(beam).copied().into_iter().collect();
            let (opacity, range_m) = own.meet_one(scan.towards(beam), edge);
            let mixture = Mixture::new(measured, &mut surfaces);
            fast += libm::log(mixture.ratio_alone(opacity, range_m));
        }
        // Exactly: the likelihood of all beams together, on the average over the other's places.
        let (mut with, mut without) = (0.0, 0.0);
        for sample in other.cloud.samples() {
            let other = sample.torso();
            let (mut both, mut alone) = (0.0, 0.0);
            for (beam, &measured) in BEAMS.zip(&measured) {
                let towards = scan.towards(beam);
                let other = other.meet_one(towards, edge);
                both += libm::log(density(measured, vec![own.meet_one(towards, edge), other]));
                alone += libm::log(density(measured, vec![other]));
            }
            with += libm::exp(both);
            without += libm::exp(alone);
        }
        let slow = libm::log(with / without);
        // Less apart than what counts as evidence, or a tenth of it where much is said.
        assert!((fast - slow).abs() < SPEAKS.max(0.1 * slow.abs()), "{at:?}: {fast} {slow}");
    }
}
