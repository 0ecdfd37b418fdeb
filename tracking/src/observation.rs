//! An observation: what one device saw in one scan, in the site's frame and on the host's clock.
//!
//! ```text
//!   report ─▶ candidates, each at its own beam's time ─▶ detections: outline, centre, covariance
//!             background, candidates, unseen spans     ─▶ free space: the empty range of every beam
//! ```
//!
//! Trackers read observations and nothing else.

use std::sync::Arc;

use kehai::candidate::{Candidate, EndKind};
use kehai::centre::{Estimator, centre};
use kehai::scan::Geometry;
use kehai::wire::Size;
use nalgebra::{Matrix2, Vector2};

use crate::geometry::{Point, Pose};

/// Oldest report that is still used, s behind its arrival: that much is kept of reports and states.
pub const LATE_S: f64 = 0.3;

/// Most that a scan may seem to begin after its report has arrived, s: a sensor's clock is followed to 20 ms, or an alarm
/// says so, and the module's to half of the delay of an exchange, 25 ms on a slow network; the scan itself takes 25 ms at
/// least. What begins later has no time that is known.
pub const AHEAD_S: f64 = 0.05;

/// Where a module is and where its beams point.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Number of the module in the site.
    pub module: usize,
    /// Its place.
    pub pose: Pose,
    /// Its plane above the floor, m.
    pub height_m: f64,
    /// Its beams, from right to left.
    pub geometry: Geometry,
    /// Whether it hangs head down: its mirror turns from left to right.
    pub upside_down: bool,
}

impl View {
    /// Distance of a place, m, and the beam that points there; None where none does.
    #[must_use]
    pub fn beam_at(&self, place: Point) -> (f64, Option<u16>) {
        self.beam_ahead(self.forward(), place)
    }

    /// The direction of the front step in the site.
    #[must_use]
    pub fn forward(&self) -> Point {
        self.pose.forward()
    }

    /// As [`beam_at`](Self::beam_at), for many places: `forward` is [`forward`](Self::forward).
    #[must_use]
    pub fn beam_ahead(&self, forward: Point, place: Point) -> (f64, Option<u16>) {
        let offset = place - self.pose.at;
        let local = Point::new(offset.dot(forward), offset.dot(forward.left()));
        (local.length(), self.beam_towards(local.angle_rad()))
    }

    /// The beam nearest to a bearing in the sensor's frame; None outside its view.
    #[must_use]
    pub fn beam_towards(&self, bearing_rad: f64) -> Option<u16> {
        let first_rad = f64::from(self.geometry.bearing_rad(0));
        let beam = ((bearing_rad - first_rad) / f64::from(self.geometry.beam_rad())).round();
        (beam >= 0.0 && beam < f64::from(self.geometry.beams())).then_some(beam as u16)
    }

    /// Time of a beam after step 0, s.
    #[must_use]
    pub fn delay_s(&self, beam: u16) -> f64 {
        if !self.upside_down {
            return f64::from(self.geometry.beam_delay_us(beam)) * 1e-6;
        }
        let (parts, half_steps) = (self.geometry.parts(), f64::from(self.geometry.half_steps(beam)));
        let half_steps_a_turn = 2.0 * f64::from(parts.steps_per_turn);
        // Its step in the sensor: both together are one less than the steps of a turn.
        f64::from(parts.period_us) * (half_steps_a_turn - 2.0 - half_steps) / half_steps_a_turn * 1e-6
    }

    /// A place in the site, from a bearing in the sensor's frame and a range, m.
    #[must_use]
    pub fn place(&self, bearing_rad: f64, range_m: f64) -> Point {
        self.place_ahead(self.forward(), bearing_rad, range_m)
    }

    /// As [`place`](Self::place), for many places: `forward` is [`forward`](Self::forward).
    #[must_use]
    pub fn place_ahead(&self, forward: Point, bearing_rad: f64, range_m: f64) -> Point {
        self.pose.to_site_ahead(forward, Point::towards(bearing_rad) * range_m)
    }
}

/// How large what is seen of a body is.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct BodySize {
    /// Volume of the part that is seen, litres.
    pub volume_l: f64,
    /// Its highest point above the floor, m.
    pub top_m: f64,
}

impl BodySize {
    /// As reported; None if nothing is known.
    #[must_use]
    pub fn of(size: Size) -> Option<Self> {
        let known = || Self { volume_l: size.volume_l.into(), top_m: f64::from(size.top_cm) * 0.01 };
        size.is_known().then(known)
    }
}

/// A candidate in the site.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    /// As it was reported.
    pub candidate: Candidate,
    /// When its middle beam passed, s on the host's clock.
    pub at_s: f64,
    /// Where the person's middle is taken to be.
    pub centre: Vector2<f64>,
    /// How well that is known, m².
    pub covariance: Matrix2<f64>,
    /// Its outline at the first, the middle and the last beam.
    pub outline: [Point; 3],
    /// Length of that chord, m.
    pub width_m: f64,
    /// Its size, from a device that measures sizes.
    pub size: Option<BodySize>,
}

impl Detection {
    /// Places a candidate whose scan began at `start_s`.
    #[must_use]
    pub fn new(candidate: Candidate, view: &View, start_s: f64, estimator: Estimator) -> Self {
        let geometry = &view.geometry;
        let (first, last) = (geometry.beam(candidate.first_step), geometry.beam(candidate.last_step));
        let own = centre(&candidate, geometry, estimator);
        let forward = view.forward();
        let turn = Matrix2::new(forward.x, -forward.y, forward.y, forward.x);
        let [xx, xy, yy] = own.covariance_m2.map(f64::from);
        let centre = view.pose.to_site_ahead(forward, Point::new(f64::from(own.x_m), f64::from(own.y_m)));
        let end = |beam: u16, range_mm: u16| {
            let bearing_rad = f64::from(geometry.bearing_rad(beam));
            view.place_ahead(forward, bearing_rad, f64::from(range_mm) * 0.001)
        };
        let (one, other) = (end(first, candidate.first_mm), end(last, candidate.last_mm));
        let middle = end(first.midpoint(last), candidate.mid_mm);
        Self {
            at_s: start_s + view.delay_s(first.midpoint(last)),
            centre: Vector2::new(centre.x, centre.y),
            covariance: turn * Matrix2::new(xx, xy, xy, yy) * turn.transpose(),
            outline: [one, middle, other],
            width_m: (other - one).length(),
            size: None,
            candidate,
        }
    }

    /// Ranges of its outline at equal bearings from the first beam to the last, m: the points that were sent, two at least.
    #[must_use]
    pub fn knots_m(&self) -> Vec<f64> {
        let candidate = &self.candidate;
        let known = |point| candidate.contour_mm(point).unwrap_or(candidate.mid_mm);
        let inner = (0..candidate.contour.len()).map(known);
        let all = [candidate.first_mm].into_iter().chain(inner).chain([candidate.last_mm]);
        all.map(|range_mm| f64::from(range_mm) * 0.001).collect()
    }

    /// Middle of the chord between its ends.
    #[must_use]
    pub fn chord_middle(&self) -> Point {
        (self.outline[0] + self.outline[2]) * 0.5
    }

    /// Whether both silhouettes of the body are seen.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.candidate.first_end.kind == EndKind::Free && self.candidate.last_end.kind == EndKind::Free
    }
}

#[cfg(test)]
impl View {
    /// Of an upright module at the origin that looks along x.
    pub fn at_origin() -> Self {
        let geometry = Geometry::new(kehai::scan::URG_04LX).unwrap();
        let pose = Pose { at: Point::default(), yaw_rad: 0.0 };
        Self { module: 0, pose, height_m: 0.6, geometry, upside_down: false }
    }
}

#[cfg(test)]
impl Detection {
    /// One whose outline is the chord between two places, without a contour.
    pub fn chord(first: (f64, f64), last: (f64, f64)) -> Self {
        let (first, last) = (Point::new(first.0, first.1), Point::new(last.0, last.1));
        let middle = (first + last) * 0.5;
        Self {
            candidate: Candidate::default(),
            at_s: 0.0,
            centre: Vector2::new(middle.x, middle.y),
            covariance: Matrix2::identity() * 0.0009,
            outline: [first, middle, last],
            width_m: (last - first).length(),
            size: None,
        }
    }
}

/// What one module saw in one scan.
#[derive(Clone, Debug)]
pub struct Observation {
    /// The module's view.
    pub view: Arc<View>,
    /// When step 0 passed, s on the host's clock.
    pub start_s: f64,
    /// What stood out.
    pub detections: Vec<Detection>,
    /// Beam by beam, up to which range nothing was, mm; 0: not known.
    pub empty_mm: Vec<u16>,
    /// The same with nothing before the background: as far as the module ever sees.
    pub background_mm: Arc<[u16]>,
}

impl Observation {
    /// Up to which range a beam saw nothing, m; 0: not known.
    #[must_use]
    pub fn empty_m(&self, beam: u16) -> f64 {
        self.empty_mm.get(usize::from(beam)).map_or(0.0, |&range_mm| f64::from(range_mm) * 0.001)
    }

    /// Up to which range a beam ever sees, m; 0: not known.
    #[must_use]
    pub fn background_m(&self, beam: u16) -> f64 {
        self.background_mm.get(usize::from(beam)).map_or(0.0, |&range_mm| f64::from(range_mm) * 0.001)
    }
}
