//! Line of sight: what one observation says about a place: free space, something there, or occluded.
//!
//! ```text
//!   module ●━━━━━━━━━━━━━━━━━━━━━━━━━━▶   through: empty to 0.25 m behind the place, or to the wall
//!          ●━━━━━━━━━━━┫▓▓                 at: ends about the place
//!          ●━━━┫▓▓      ✕                  occluded: ends before the place, or not known
//!              └ place ┘
//! ```

use crate::geometry::Point;
use crate::observation::Observation;

/// Half of what a body shows at least from any side, m.
const HALF_BODY_M: f64 = 0.15;

/// A beam that goes on so far behind a place passed through it, m: a body's depth.
const BEHIND_M: f64 = 0.25;

/// A beam that ends so far before a place was stopped by another object, m.
const BEFORE_M: f64 = 0.35;

/// Beams looked at across a body.
const SAMPLES: u16 = 7;

/// Shares of the beams towards a place, together 1; all 0 outside the module's view.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Look {
    /// Passed through the place.
    pub through: f64,
    /// Ended about the place.
    pub at: f64,
    /// Ended before it, or not known.
    pub hidden: f64,
}

impl Look {
    /// Whether the module could see the place at all in this scan.
    #[must_use]
    pub fn judged(&self) -> f64 {
        self.through + self.at
    }
}

/// Looks where a module looked.
pub struct Eye<'a> {
    observation: &'a Observation,
    forward: Point,
}

impl<'a> Eye<'a> {
    /// The module's of an observation.
    #[must_use]
    pub fn of(observation: &'a Observation) -> Self {
        Self { observation, forward: observation.view.forward() }
    }

    /// Looks at a body's middle at `place`.
    #[must_use]
    pub fn at_body(&self, place: Point) -> Look {
        let Self { observation, forward } = *self;
        let (distance_m, Some(middle)) = observation.view.beam_ahead(forward, place) else {
            return Look::default();
        };
        let half_rad = libm::atan2(HALF_BODY_M, distance_m);
        let half = (half_rad / f64::from(observation.view.geometry.beam_rad())) as u16;
        let last = observation.view.geometry.beams() - 1;
        let (from, to) = (middle.saturating_sub(half), middle.saturating_add(half).min(last));
        let samples = SAMPLES.min(to - from + 1);
        let mut look = Look::default();
        for sample in 0..samples {
            let share = u32::from(to - from) * u32::from(sample) / u32::from(samples.max(2) - 1);
            tally(observation, from + share as u16, distance_m, &mut look);
        }
        let all = f64::from(samples);
        Look { through: look.through / all, at: look.at / all, hidden: look.hidden / all }
    }

    /// Looks at a place along the one beam that points there; also whether the module would see it with nothing
    /// standing before it.
    #[must_use]
    pub fn at_point(&self, place: Point) -> (Look, bool) {
        let mut look = Look::default();
        let (distance_m, Some(beam)) = self.observation.view.beam_ahead(self.forward, place) else {
            return (look, false);
        };
        tally(self.observation, beam, distance_m, &mut look);
        (look, self.observation.background_m(beam) > distance_m)
    }
}

fn tally(observation: &Observation, beam: u16, distance_m: f64, look: &mut Look) {
    let (empty_m, background_m) = (observation.empty_m(beam), observation.background_m(beam));
    let reaches_wall = empty_m >= background_m && background_m > distance_m;
    if empty_m > distance_m + BEHIND_M || reaches_wall {
        look.through += 1.0;
    } else if empty_m > distance_m - BEFORE_M {
        look.at += 1.0;
    } else {
        look.hidden += 1.0;
    }
}
