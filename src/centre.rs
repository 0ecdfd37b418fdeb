//! Centre estimation: from a candidate to the middle of the body, with covariance. One pure function, used by device
//! and host.
//!
//! It reads nothing but the fields of a [`Candidate`], which is what the wire carries.
//!
//! ```text
//!   silhouette (default)                          two points (Lee et al. 2006, eq. 6)
//!
//!        ╭───────╮  ellipse 0.225 × 0.14 m              ●  centre: radius r away
//!        │   ●   │  as wide as seen              r   ╱    ╲  r   from both end points
//!        ╰───┬───╯                                  ╱      ╲
//!       ╲    │ρ  ╱                              p1 ●        ● p2
//!        ╲   ┴  ╱ ◀ range in the middle
//!         ╲  │ ╱
//!          ╲ │╱     between the two silhouettes: the middle
//!           ●       bearing, whatever the body's heading
//! ```
//!
//! An ellipse with semi-axes *a* (shoulders) and *b* (chest) that is 2·h wide from where one looks
//! is a·b/h deep in that direction, at any heading: the width gives the depth. Where one end is
//! cut off, the other silhouette alone says where the body is: half a body's width inside it.
//!
//! Free-radius circles are of no use: a torso's front is flat, and the radius runs away.

use crate::candidate::{Candidate, EndKind};
use crate::math;
use crate::scan::Geometry;

/// Half the width of a torso with arms, m.
pub const HALF_WIDTH_M: f32 = 0.225;

/// Half the depth of a torso, m.
pub const HALF_DEPTH_M: f32 = 0.14;

/// Half the width assumed of a body of which one end is cut off, m: the mean over headings.
pub const CUT_HALF_WIDTH_M: f32 = 0.19;

/// Radius for the two-point estimator, mm. The 38 cm in Lee et al. 2006 are plausibly a diameter: as a
/// radius they put every centre 22 to 27 cm too far from its sensor.
pub const TWO_POINT_RADIUS_MM: u16 = 190;

/// How to find a centre.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Estimator {
    /// Between the silhouettes, as deep as they are wide.
    #[default]
    Silhouette,
    /// Lee et al. 2006, eq. 6: at this radius from both end points, mm.
    TwoPoint {
        /// The radius, mm; [`TWO_POINT_RADIUS_MM`] by default.
        radius_mm: u16,
    },
}

/// A person's centre in the sensor's frame (x forward, y left), m, with its covariance, m².
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Centre {
    /// Forward, m.
    pub x_m: f32,
    /// Left, m.
    pub y_m: f32,
    /// Covariance xx, xy, yy in m².
    pub covariance_m2: [f32; 3],
}

/// Where the person stands, by `estimator`. All numbers are finite for any candidate.
#[must_use]
pub fn centre(candidate: &Candidate, geometry: &Geometry, estimator: Estimator) -> Centre {
    let shape = CandidateShape::of(candidate, geometry);
    let (range_m, bearing_rad, half_width_m) = match estimator {
        Estimator::Silhouette => shape.silhouette(candidate),
        Estimator::TwoPoint { radius_mm } => shape.two_point(f32::from(radius_mm) * 0.001),
    };
    let (sine, cosine) = math::sin_cos(bearing_rad);
    let (radial_m, tangential_m) = shape.deviations(range_m, half_width_m);
    let (radial_m2, tangential_m2) = (radial_m * radial_m, tangential_m * tangential_m);
    Centre {
        x_m: range_m * cosine,
        y_m: range_m * sine,
        covariance_m2: [
            radial_m2 * cosine * cosine + tangential_m2 * sine * sine,
            (radial_m2 - tangential_m2) * sine * cosine,
            radial_m2 * sine * sine + tangential_m2 * cosine * cosine,
        ],
    }
}

/// A candidate in m and rad.
struct CandidateShape {
    /// Bearings of the end beams.
    first_rad: f32,
    last_rad: f32,
    /// Half the angle of a beam: where a silhouette is between two beams.
    half_beam_rad: f32,
    first_m: f32,
    mid_m: f32,
    last_m: f32,
    first_free: bool,
    last_free: bool,
    narrow: bool,
}

impl CandidateShape {
    fn of(candidate: &Candidate, geometry: &Geometry) -> Self {
        let metres = |range_mm: u16| f32::from(range_mm) * 0.001;
        Self {
            first_rad: geometry.bearing_rad(geometry.beam(candidate.first_step)),
            last_rad: geometry.bearing_rad(geometry.beam(candidate.last_step)),
            half_beam_rad: 0.5 * geometry.beam_rad(),
            first_m: metres(candidate.first_mm),
            mid_m: metres(candidate.mid_mm),
            last_m: metres(candidate.last_mm),
            first_free: candidate.first_end.kind == EndKind::Free,
            last_free: candidate.last_end.kind == EndKind::Free,
            narrow: candidate.narrow,
        }
    }

    /// Half the angle between the silhouettes.
    fn half_angle_rad(&self) -> f32 {
        0.5 * (self.last_rad - self.first_rad) + self.half_beam_rad
    }

    /// Range, bearing and half width by the silhouettes.
    fn silhouette(&self, candidate: &Candidate) -> (f32, f32, f32) {
        let (sine, _) = math::sin_cos(self.half_angle_rad().min(0.5 * math::PI));
        let from_cut = match (self.first_free, self.last_free) {
            (true, false) => Some((self.first_rad - self.half_beam_rad, 1.0)),
            (false, true) => Some((self.last_rad + self.half_beam_rad, -1.0)),
            _ => None,
        };
        let mut bearing_rad = 0.5 * (self.first_rad + self.last_rad);
        let mut front_m = self.mid_m;
        let mut depth_m = HALF_DEPTH_M;
        let mut half_width_m = HALF_WIDTH_M;
        // The depth changes the distance at which the width is seen, by less each time.
        for _ in 0..3 {
            half_width_m = (front_m + depth_m) * sine;
            if let Some((silhouette_rad, inwards)) = from_cut {
                half_width_m = half_width_m.max(CUT_HALF_WIDTH_M);
                let inside_rad = asin(half_width_m / (front_m + depth_m).max(half_width_m).max(0.001));
                bearing_rad = silhouette_rad + inwards * inside_rad;
                front_m = self.range_at(bearing_rad, candidate);
            }
            depth_m = depth_of(half_width_m);
        }
        (front_m + depth_m, bearing_rad, half_width_m)
    }

    /// Range of the outline at a bearing: between contour points, or at an end beyond it.
    fn range_at(&self, bearing_rad: f32, candidate: &Candidate) -> f32 {
        let span_rad = self.last_rad - self.first_rad;
        let gaps = candidate.contour.len() + 1;
        let place = (bearing_rad - self.first_rad) / span_rad.max(1e-6) * gaps as f32;
        let place = place.clamp(0.0, gaps as f32);
        let left = (place as usize).min(gaps - 1);
        let at = |point: usize| match point.checked_sub(1) {
            None => self.first_m,
            Some(point) => {
                candidate.contour_mm(point).map_or(self.last_m, |range_mm| f32::from(range_mm) * 0.001)
            }
        };
        if candidate.contour.is_empty() {
            // Without a contour: the middle range in the inner half, the end's beyond.
            return if place < 0.25 {
                self.first_m
            } else if place > 0.75 {
                self.last_m
            } else {
                self.mid_m
            };
        }
        let share = place - left as f32;
        at(left) * (1.0 - share) + at(left + 1) * share
    }

    /// Lee et al. 2006, eq. 6, in its symmetric form: on the bisector of the end points, away from the sensor.
    fn two_point(&self, radius_m: f32) -> (f32, f32, f32) {
        let (first_sine, first_cosine) = math::sin_cos(self.first_rad);
        let (last_sine, last_cosine) = math::sin_cos(self.last_rad);
        let (x1, y1) = (self.first_m * first_cosine, self.first_m * first_sine);
        let (x2, y2) = (self.last_m * last_cosine, self.last_m * last_sine);
        let half_chord_m = 0.5 * math::hypot(x2 - x1, y2 - y1);
        let behind_m = math::sqrt(radius_m * radius_m - half_chord_m * half_chord_m);
        // The chord runs from the first end (right) to the last (left): away is to its right.
        let per_chord = behind_m / (2.0 * half_chord_m).max(1e-6);
        let x = 0.5 * (x1 + x2) + (y2 - y1) * per_chord;
        let y = 0.5 * (y1 + y2) - (x2 - x1) * per_chord;
        (math::hypot(x, y), math::atan2(y, x), half_chord_m)
    }

    /// Standard deviations along and across the line of sight, m, from the reference simulation:
    /// 31 and 22 mm for whole outlines at 1.5 m, the body's own shape being the error; twice to
    /// four times that when one or both ends are cut; and the distance of two beams on top.
    fn deviations(&self, range_m: f32, half_width_m: f32) -> (f32, f32) {
        let beams_m = range_m * 2.0 * self.half_beam_rad;
        let (radial_m, tangential_m) = match (self.first_free, self.last_free) {
            // A limb: its person stands beside it.
            (true, true) if self.narrow => (0.10, 0.10),
            (true, true) => (0.035, 0.025),
            (true, false) | (false, true) => (0.060, 0.070),
            (false, false) => (0.080, 0.120),
        };
        let more_than_one_m = (half_width_m - HALF_WIDTH_M).max(0.0);
        (radial_m + beams_m, tangential_m + beams_m + more_than_one_m)
    }
}

/// How deep a body that is 2·h wide lies behind its front.
fn depth_of(half_width_m: f32) -> f32 {
    let depth_m = HALF_WIDTH_M * HALF_DEPTH_M / half_width_m.clamp(HALF_DEPTH_M, HALF_WIDTH_M);
    // Narrower than any torso: a limb, as deep as it is wide.
    if half_width_m < HALF_DEPTH_M { depth_m * half_width_m / HALF_DEPTH_M } else { depth_m }
}

fn asin(sine: f32) -> f32 {
    math::atan2(sine, math::sqrt(1.0 - sine * sine))
}
