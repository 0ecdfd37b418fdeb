//! The outline of a candidate as places in the site: the foreground points that are left of a scan.
//!
//! ```text
//!             contour, at equal bearings between the ends
//!   first ●─ · ─ · ─ · ─ ○ ─ · ─ · ─ · ─● last      ● to the millimetre, · to 4 mm, ○ the median of five beams
//!                   ● nearest
//! ```
//!
//! Up to 18 points a candidate, each at its own beam's time. Contour points beyond what a byte holds (1.02 m
//! behind the nearest) are left out.

use kehai::candidate::{CONTOUR_UNIT_MM, Candidate};
use kehai::scan::Geometry;

use kehai_tracking::geometry::Point;
use kehai_tracking::observation::{Observation, View};

/// Code of a contour point too far behind the nearest point to be encoded.
const TOO_FAR: u8 = u8::MAX;

/// A place where a beam met something that is not background.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct FieldPoint {
    /// In the site's frame.
    pub at: Point,
    /// When the beam passed, s on the host's clock.
    pub at_s: f64,
    /// The beam.
    pub beam: u16,
}

/// Beams of a candidate with a known range, and the range in mm; sorted by beam, each at most once.
#[must_use]
pub fn ranges(candidate: &Candidate, geometry: &Geometry) -> Vec<(u16, u16)> {
    let (first, last) = (geometry.beam(candidate.first_step), geometry.beam(candidate.last_step));
    let span = u32::from(last.saturating_sub(first));
    let gaps = candidate.contour.len() as u32 + 1;
    // Finer readings come first: of several at one beam the first is kept.
    let mut ranges = vec![
        (first, candidate.first_mm),
        (last, candidate.last_mm),
        (geometry.beam(candidate.near_step), candidate.near_mm),
        (first + (span / 2) as u16, candidate.mid_mm),
    ];
    for (point, offset) in (1..).zip(&candidate.contour) {
        // As the module places them, rounded to the nearest beam.
        let beam = first + ((2 * point * span + gaps) / (2 * gaps)) as u16;
        if *offset != TOO_FAR {
            ranges.push((beam, candidate.near_mm.saturating_add(u16::from(*offset) * CONTOUR_UNIT_MM)));
        }
    }
    ranges.retain(|(_, range_mm)| *range_mm > 0);
    ranges.sort_by_key(|(beam, _)| *beam);
    ranges.dedup_by_key(|(beam, _)| *beam);
    ranges
}

/// The outline of a candidate of a scan that began at `start_s`, by beam.
#[must_use]
pub fn points(view: &View, candidate: &Candidate, start_s: f64) -> Vec<FieldPoint> {
    let point = |(beam, range_mm): (u16, u16)| FieldPoint {
        at: view.place(f64::from(view.geometry.bearing_rad(beam)), f64::from(range_mm) * 0.001),
        at_s: start_s + view.delay_s(beam),
        beam,
    };
    ranges(candidate, &view.geometry).into_iter().map(point).collect()
}

/// Beam by beam the range at which it met something that is not background, m; 0: it did not, or it is not
/// known. Between two known beams of one candidate the range is taken to change evenly.
#[must_use]
pub fn front_m(observation: &Observation) -> Vec<f64> {
    let mut front_m = vec![0.0; observation.view.geometry.beams().into()];
    for seen in &observation.detections {
        for pair in ranges(&seen.candidate, &observation.view.geometry).windows(2) {
            let ((from, from_mm), (to, to_mm)) = (pair[0], pair[1]);
            let slope_mm = (f64::from(to_mm) - f64::from(from_mm)) / f64::from(to - from);
            let between = front_m.iter_mut().enumerate().take(usize::from(to) + 1).skip(from.into());
            for (beam, front_m) in between {
                *front_m = (f64::from(from_mm) + slope_mm * (beam as f64 - f64::from(from))) * 0.001;
            }
        }
    }
    front_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai::centre::Estimator;
    use kehai::scan::URG_04LX;
    use kehai_tracking::geometry::Pose;
    use kehai_tracking::observation::Detection;
    use std::sync::Arc;

    /// Beams 340 to 380 of a URG, 1.000 m away at the first, 1.300 m at the last, 0.960 m at beam 350.
    fn candidate() -> Candidate {
        let geometry = Geometry::new(URG_04LX).unwrap();
        Candidate {
            first_step: geometry.step(340),
            last_step: geometry.step(380),
            first_mm: 1000,
            last_mm: 1300,
            near_mm: 960,
            near_step: geometry.step(350),
            mid_mm: 1002,
            beams: 41,
            contour: [5, 0, 4, 10, 20, 40, 255].into_iter().collect(),
            ..Candidate::default()
        }
    }

    fn view(pose: Pose) -> View {
        View {
            module: 0,
            pose,
            height_m: 0.6,
            geometry: Geometry::new(URG_04LX).unwrap(),
            upside_down: false,
        }
    }

    #[test]
    fn an_outline_is_every_beam_whose_range_was_told_once_and_in_order() {
        let ranges = ranges(&candidate(), &Geometry::new(URG_04LX).unwrap());
        // Beam 350 is the nearest and the second of the contour, beam 360 the middle; the one too far is left out.
        let expected = [
            (340, 1000),
            (345, 980),
            (350, 960),
            (355, 976),
            (360, 1002),
            (365, 1040),
            (370, 1120),
            (380, 1300),
        ];
        assert_eq!(ranges, expected);
    }

    #[test]
    fn points_lie_where_and_when_their_beams_passed() {
        let pose = Pose { at: Point::new(2.0, 1.0), yaw_rad: std::f64::consts::PI };
        let view = view(pose);
        let points = points(&view, &candidate(), 7.0);
        assert_eq!(points.len(), 8);
        for point in points {
            let (distance_m, beam) = view.beam_at(point.at);
            assert_eq!(beam, Some(point.beam));
            assert!((0.95..1.31).contains(&distance_m));
            assert_eq!(point.at_s, 7.0 + view.delay_s(point.beam));
        }
    }

    #[test]
    fn the_front_follows_the_outline_between_the_ends_only() {
        let view = Arc::new(view(Pose { at: Point::default(), yaw_rad: 0.0 }));
        let detections = vec![Detection::new(candidate(), &view, 0.0, Estimator::default())];
        let observation = Observation {
            view,
            start_s: 0.0,
            detections,
            empty_mm: Vec::new(),
            background_mm: Arc::from([]),
        };
        let front_m = front_m(&observation);
        assert_eq!((front_m[339], front_m[381]), (0.0, 0.0));
        assert!((front_m[340] - 1.0).abs() < 1e-9 && (front_m[380] - 1.3).abs() < 1e-9);
        assert!((front_m[375] - 1.21).abs() < 1e-9, "{}", front_m[375]);
    }
}
