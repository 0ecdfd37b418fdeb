//! A scan as rays: what each beam of an observation measured.
//!
//! ```text
//!   candidate's contour ─▶ Hit(range)      │ between two contour points the range is interpolated
//!   … of a mover        ─▶ Swept(range)    │ what moves there, or a body
//!   background, empty   ─▶ Free(range)     │ nothing nearer than this; beyond it the beam says nothing
//!   unseen span         ─▶ Unknown         │ the beam says nothing at all
//! ```

use std::sync::Arc;

use crate::geometry::{Point, Pose};
use crate::observation::{Detection, Observation, View};

/// The middle of a body is at most so far behind a hit, m: half its width.
const BODY_M: f64 = 0.26;

/// More than a distance is rounded by, m.
const NEARLY_M: f64 = 1e-6;

/// Result of one beam, m.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Measured {
    /// It says nothing.
    Unknown,
    /// Nothing stood before this range.
    Free(f64),
    /// Something before the background, at this range.
    Hit(f64),
    /// The same where a door leaf or a curtain moves.
    Swept(f64),
}

/// The rays of one module's newest scan.
#[derive(Clone, Debug)]
pub struct Scan {
    view: Arc<View>,
    /// Unit vector of each beam, in the site.
    towards: Vec<Point>,
    measured: Vec<Measured>,
    background_mm: Arc<[u16]>,
    /// No background is farther, m.
    background_m: f64,
    first_rad: f64,
    beam_rad: f64,
    forward: Point,
}

impl Scan {
    /// With the directions of a view and nothing measured.
    pub fn of(view: &Arc<View>) -> Self {
        let geometry = &view.geometry;
        let beams = geometry.beams();
        let bearing = |beam| view.pose.yaw_rad + f64::from(geometry.bearing_rad(beam));
        Self {
            view: Arc::clone(view),
            towards: (0..beams).map(|beam| Point::towards(bearing(beam))).collect(),
            measured: vec![Measured::Unknown; usize::from(beams)],
            background_mm: Arc::default(),
            background_m: 0.0,
            first_rad: f64::from(geometry.bearing_rad(0)),
            beam_rad: f64::from(geometry.beam_rad()),
            forward: view.forward(),
        }
    }

    /// Of an upright module at the origin that looks along x.
    #[cfg(test)]
    pub fn at_origin() -> Self {
        Self::of(&Arc::new(View::at_origin()))
    }

    /// Whether it has the directions of this view.
    pub fn is_of(&self, view: &View) -> bool {
        *self.view == *view
    }

    /// The same of a module that has this number now.
    pub fn numbered(mut self, module: usize) -> Self {
        self.view = Arc::new(View { module, ..(*self.view).clone() });
        self
    }

    /// Takes the rays of an observation. `hit`: what a detection's beams measured, of their range in m.
    pub fn measure<F: Fn(f64) -> Measured>(
        &mut self,
        observation: &Observation,
        hit: impl Fn(&Detection) -> F,
    ) {
        for (measured, &empty_mm) in self.measured.iter_mut().zip(&observation.empty_mm) {
            *measured =
                if empty_mm == 0 { Measured::Unknown } else { Measured::Free(f64::from(empty_mm) * 0.001) };
        }
        self.take_background(Arc::clone(&observation.background_mm));
        let geometry = &self.view.geometry;
        for seen in &observation.detections {
            let (first, last) =
                (geometry.beam(seen.candidate.first_step), geometry.beam(seen.candidate.last_step));
            let measure = hit(seen);
            let knots_m = seen.knots_m();
            let span = f64::from(seen.candidate.last_step - seen.candidate.first_step).max(1.0);
            let knots_a_step = (knots_m.len() - 1) as f64 / span;
            for beam in first..=last {
                let Some(measured) = self.measured.get_mut(usize::from(beam)) else { break };
                let step = geometry.step(beam).saturating_sub(seen.candidate.first_step);
                let range_m = between(&knots_m, f64::from(step) * knots_a_step);
                *measured = measure(range_m);
            }
        }
    }

    fn take_background(&mut self, background_mm: Arc<[u16]>) {
        self.background_m = background_mm.iter().copied().max().map_or(0.0, f64::from) * 0.001;
        self.background_mm = background_mm;
    }

    /// Takes these results, beam by beam, before a background at 4 m.
    #[cfg(test)]
    pub fn set(&mut self, measured: Vec<Measured>) {
        self.reach(4000);
        self.measured = measured;
    }

    /// Takes a background at one range all around.
    #[cfg(test)]
    pub fn reach(&mut self, reach_mm: u16) {
        self.take_background(self.measured.iter().map(|_| reach_mm).collect());
    }

    /// How the module stands.
    pub fn pose(&self) -> &Pose {
        &self.view.pose
    }

    /// The module's place.
    pub fn origin(&self) -> Point {
        self.view.pose.at
    }

    /// Whether the module sees a place when nothing stands before it.
    pub fn covers(&self, place: Point) -> bool {
        let off = place - self.origin();
        // Of the modules of a site most see nothing of a place, and the angle is dear.
        if off.dot(off) > (self.background_m + NEARLY_M) * (self.background_m + NEARLY_M) {
            return false;
        }
        let (beam, distance_m) = self.beam_at(place);
        let beam = beam.round();
        let reach_mm = if beam >= 0.0 { self.background_mm.get(beam as usize).copied() } else { None };
        reach_mm.is_some_and(|reach_mm| distance_m < f64::from(reach_mm) * 0.001)
    }

    /// Whether the newest beam that points at a place reached it, or what stands there.
    pub fn sees(&self, place: Point) -> bool {
        let (beam, distance_m) = self.beam_at(place);
        let beam = beam.round();
        match if beam >= 0.0 { self.measured(beam as usize) } else { Measured::Unknown } {
            Measured::Unknown => false,
            Measured::Free(range_m) | Measured::Swept(range_m) => distance_m < range_m,
            Measured::Hit(range_m) => distance_m < range_m + BODY_M,
        }
    }

    /// No beam measures farther, m.
    pub fn reach_m(&self) -> f64 {
        f64::from(self.view.geometry.range_max_mm()) * 0.001
    }

    /// Number of beams.
    pub fn beams(&self) -> usize {
        self.measured.len()
    }

    /// Angle between two beams.
    pub const fn beam_rad(&self) -> f64 {
        self.beam_rad
    }

    /// Direction of a beam in the site.
    pub fn towards(&self, beam: usize) -> Point {
        self.towards.get(beam).copied().unwrap_or_default()
    }

    /// Result of a beam.
    pub fn measured(&self, beam: usize) -> Measured {
        self.measured.get(beam).copied().unwrap_or(Measured::Unknown)
    }

    /// The beam that points at a place, as a number that may lie outside the view, and the place's distance, m.
    pub fn beam_at(&self, place: Point) -> (f64, f64) {
        let offset = place - self.origin();
        let local = Point::new(offset.dot(self.forward), offset.dot(self.forward.left()));
        ((local.angle_rad() - self.first_rad) / self.beam_rad, local.length())
    }

    /// When a beam passes after step 0, s.
    pub fn delay_s(&self, beam: f64) -> f64 {
        let last = self.beams().saturating_sub(1) as f64;
        self.view.delay_s(beam.clamp(0.0, last) as u16)
    }
}

/// Interpolated at so many knots from the first.
fn between(knots: &[f64], place: f64) -> f64 {
    let before = place as u32 as usize;
    let last = knots.last().copied().unwrap_or(0.0);
    let near = knots.get(before).copied().unwrap_or(last);
    let far = knots.get(before + 1).copied().unwrap_or(last);
    near + (far - near) * (place - before as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_lies_on_the_line_between_two_points_that_were_sent() {
        let found = [0.0, 0.5, 1.5, 2.0, 5.0].map(|place| between(&[1.0, 2.0, 4.0], place));
        assert_eq!(found, [1.0, 1.5, 3.0, 4.0, 4.0]);
    }
}
