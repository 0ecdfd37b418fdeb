//! The centre of simulated bodies, through background, clusters and candidates: how far it is off,
//! by distance and by what the candidate carries.

use kehai::background::Fingerprint;
use kehai::candidate::Candidate;
use kehai::centre::{Estimator, TWO_POINT_RADIUS_MM, centre};
use kehai::pipeline::{Pipeline, Settings};
use kehai::scan::{Geometry, MAX_BEAMS, Scan, ScanTime, URG_04LX};

/// Small, seeded, and the same everywhere: xorshift.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.next()
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.next()).sum::<f64>() - 6.0
    }
}

/// An ellipse: centre, semi-axes, heading.
#[derive(Clone, Copy)]
struct Ellipse {
    x: f64,
    y: f64,
    wide: f64,
    deep: f64,
    heading: f64,
}

impl Ellipse {
    /// Distance from the origin along a bearing, m.
    fn hit(&self, bearing: f64) -> Option<f64> {
        let turn = |x: f64, y: f64| {
            let (s, c) = self.heading.sin_cos();
            ((c * x + s * y) / self.deep, (c * y - s * x) / self.wide)
        };
        let (ox, oy) = turn(-self.x, -self.y);
        let (dx, dy) = turn(bearing.cos(), bearing.sin());
        let (a, b, c) = (dx * dx + dy * dy, ox * dx + oy * dy, ox * ox + oy * oy - 1.0);
        let root = b * b - a * c;
        (root >= 0.0).then(|| (-b - root.sqrt()) / a).filter(|&range| range > 0.0)
    }
}

/// A torso with two arms at its sides, as in the reference world.
fn body(x: f64, y: f64, random: &mut Random) -> Vec<Ellipse> {
    let (wide, deep) = (random.between(0.20, 0.25), random.between(0.12, 0.16));
    let heading = random.between(0.0, core::f64::consts::TAU);
    let arm = |side: f64| {
        let reach = side * (wide - 0.02);
        Ellipse {
            x: x - reach * heading.sin(),
            y: y + reach * heading.cos(),
            wide: 0.045,
            deep: 0.045,
            heading,
        }
    };
    vec![Ellipse { x, y, wide: wide - 0.03, deep, heading }, arm(1.0), arm(-1.0)]
}

/// A scan of the bodies before nothing: the nearest hit of each beam, with the noise of a URG.
fn scan_of(bodies: &[Ellipse], geometry: &Geometry, random: &mut Random) -> Vec<u16> {
    let beams = 0..geometry.beams();
    let ranges = beams.map(|beam| {
        let bearing = f64::from(geometry.bearing_rad(beam));
        let nearest = bodies.iter().filter_map(|body| body.hit(bearing)).fold(f64::MAX, f64::min);
        let noise = random.normal() * if nearest < 1.0 { 0.003 } else { 0.003 * nearest };
        let range_mm = (nearest + noise) * 1000.0;
        if range_mm < 5600.0 { range_mm as u16 } else { 0 }
    });
    ranges.collect()
}

fn learned(geometry: &Geometry) -> Box<Pipeline<MAX_BEAMS>> {
    let mut pipeline = Box::new(Pipeline::new());
    pipeline.configure(geometry, Settings::URG_04LX, Fingerprint(1)).unwrap();
    for index in 0..60 {
        let time = ScanTime { sensor_ms: index * 100, ..ScanTime::default() };
        pipeline.process(&Scan { geometry, ranges_mm: &vec![0; geometry.beams().into()], time });
    }
    assert!(pipeline.background().is_known());
    pipeline
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|error| error * error).sum::<f64>() / errors.len().max(1) as f64).sqrt()
}

fn error_mm(candidate: &Candidate, geometry: &Geometry, estimator: Estimator, at: (f64, f64)) -> f64 {
    let centre = centre(candidate, geometry, estimator);
    1000.0 * (f64::from(centre.x_m) - at.0).hypot(f64::from(centre.y_m) - at.1)
}

const TWO_POINT: Estimator = Estimator::TwoPoint { radius_mm: TWO_POINT_RADIUS_MM };

/// The widest candidate of bodies at (`x`, `y`) and before it, 300 times.
fn candidates(distance: f64, occluder: Option<f64>, seed: u64) -> Vec<(Candidate, (f64, f64))> {
    let geometry = Geometry::new(URG_04LX).unwrap();
    let mut pipeline = learned(&geometry);
    let mut random = Random(seed);
    let mut found = vec![];
    for index in 0..300 {
        let bearing = random.between(-1.0, 1.0);
        let at = (distance * bearing.cos(), distance * bearing.sin());
        let mut bodies = body(at.0, at.1, &mut random);
        if let Some(beside) = occluder {
            let side = if index % 2 == 0 { 1.0 } else { -1.0 };
            let turned = bearing + side * beside;
            let near = 0.5 * distance;
            bodies.push(Ellipse {
                x: near * turned.cos(),
                y: near * turned.sin(),
                wide: 0.2,
                deep: 0.2,
                heading: 0.0,
            });
        }
        let ranges_mm = scan_of(&bodies, &geometry, &mut random);
        let time = ScanTime { sensor_ms: 10_000 + index * 100, ..ScanTime::default() };
        let judgement = pipeline.process(&Scan { geometry: &geometry, ranges_mm: &ranges_mm, time });
        let behind =
            |candidate: &&Candidate| occluder.is_none() || f64::from(candidate.mid_mm) > 650.0 * distance;
        let widest = judgement.candidates().iter().filter(behind).max_by_key(|candidate| candidate.beams);
        found.extend(widest.map(|candidate| (candidate.clone(), at)));
    }
    found
}

#[test]
fn whole_outlines_give_the_centre_within_a_hand() {
    let geometry = Geometry::new(URG_04LX).unwrap();
    for (distance, bound_mm) in [(0.5, 60.0), (1.0, 55.0), (1.5, 52.0), (2.0, 52.0), (3.0, 60.0), (3.9, 67.0)]
    {
        let seen = candidates(distance, None, 7);
        let of = |estimator| {
            let errors: Vec<f64> =
                seen.iter().map(|(c, at)| error_mm(c, &geometry, estimator, *at)).collect();
            rms(&errors)
        };
        let (silhouette, two_point) = (of(Estimator::Silhouette), of(TWO_POINT));
        let far = of(Estimator::TwoPoint { radius_mm: 380 });
        println!(
            "{distance} m: {} seen, RMS silhouette {silhouette:.0} mm, eq. 6 {two_point:.0} mm, with 380 mm {far:.0} mm",
            seen.len()
        );
        assert!(seen.len() >= 298 && silhouette <= bound_mm && silhouette < two_point, "{distance} m");
        assert!(far > 200.0);
    }
}

#[test]
fn half_hidden_bodies_are_found_by_their_free_side_and_the_contour_helps() {
    let geometry = Geometry::new(URG_04LX).unwrap();
    let seen: Vec<_> = candidates(2.0, Some(0.2), 11);
    let with = |change: &dyn Fn(&mut Candidate)| {
        let errors: Vec<f64> = seen
            .iter()
            .map(|(candidate, at)| {
                let mut candidate = candidate.clone();
                change(&mut candidate);
                error_mm(&candidate, &geometry, Estimator::Silhouette, *at)
            })
            .collect();
        rms(&errors)
    };
    let all = with(&|_| ());
    let no_contour = with(&|candidate| candidate.contour.clear());
    let fifteen = with(&|candidate| {
        let seven = candidate.contour.clone();
        candidate.contour.clear();
        for point in 0..15 {
            let at = (point + 1) as f32 * 8.0 / 16.0 - 1.0;
            let left = seven[(at.max(0.0) as usize).min(seven.len() - 1)];
            candidate.contour.push(left).unwrap();
        }
    });
    let no_flags = with(&|candidate| {
        candidate.first_end.kind = kehai::candidate::EndKind::Free;
        candidate.last_end.kind = kehai::candidate::EndKind::Free;
    });
    println!(
        "half hidden at 2 m, {} seen: RMS {all:.0} mm with 7 contour points, {no_contour:.0} with none, {fifteen:.0} with 15, {no_flags:.0} without end flags",
        seen.len()
    );
    assert!(seen.len() > 200 && all < 100.0 && all <= no_contour + 5.0 && no_flags > all * 1.2);
}

#[test]
fn whatever_a_candidate_says_the_centre_is_finite() {
    let geometry = Geometry::new(URG_04LX).unwrap();
    let mut random = Random(3);
    for _ in 0..2000 {
        let mut any = || (random.next() * 65_536.0) as u16;
        let mut candidate = Candidate {
            first_step: any(),
            last_step: any(),
            first_mm: any(),
            mid_mm: any(),
            last_mm: any(),
            near_mm: any(),
            ..Candidate::default()
        };
        for _ in 0..any() % 16 {
            let _ = candidate.contour.push(any() as u8);
        }
        for estimator in [Estimator::Silhouette, Estimator::TwoPoint { radius_mm: any() }] {
            let centre = centre(&candidate, &geometry, estimator);
            let numbers = [centre.x_m, centre.y_m].into_iter().chain(centre.covariance_m2);
            assert!(numbers.into_iter().all(f32::is_finite), "{candidate:?}");
        }
    }
}
