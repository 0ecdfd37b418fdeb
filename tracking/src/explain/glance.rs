//! The newest scan of a module, and why it does not show a place.
//!
//! ```text
//!   module ●───────────(person)───── place      behind a person
//!          ●────────────────────│─── place      behind a thing that belongs to the room, or a wall of the site
//!          ●──── range ────)         place      too far · beside the view · silent for 2 s · not judged
//! ```

use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::geometry::{Point, cross};
use crate::observation::{Observation, View};
use crate::site::{Blocks, Site, Wall};
use crate::tracker::walls::seen_from;
use crate::tracker::{LifeCycle, TrackId, TrackState};
use crate::zones::SEEN_S;

/// A module that has sent nothing for so long sees nothing, s: as long as what was seen counts as seen.
pub const SILENT_S: f64 = SEEN_S;

/// What stands so near to a place, along the beam, stands there, m: half a body, and what its place is unsure by.
const THERE_M: f64 = 0.45;

/// A track so near to what a module sees is what it sees, m: the gate of the tracker's association.
const SAME_M: f64 = 0.5;

/// The newest scan of a module.
#[derive(Clone, Debug)]
pub struct Glance {
    /// Its view.
    pub view: Arc<View>,
    /// When it began, s.
    pub start_s: f64,
    empty_mm: Vec<u16>,
    background_mm: Arc<[u16]>,
    /// Up to which range a beam with nothing behind it is empty, mm; 0: not known.
    open_range_mm: u16,
    bodies: Vec<Body>,
}

/// Something that stood out.
#[derive(Clone, Copy, Debug)]
struct Body {
    beams: (u16, u16),
    near_m: f64,
    at: Point,
}

/// Why a module does not see a place; the order is from what passes by itself to what only another module changes.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "is")]
pub enum Why {
    /// It sees it.
    Seen,
    /// A person stands before it.
    Person {
        /// Who, if that is a track.
        track: Option<TrackId>,
    },
    /// It says nothing.
    Silent,
    /// It does not know that direction: it returns nothing, or no background is learned there.
    NotJudged,
    /// A thing that belongs to the room stands before it: furniture, a shelf, a wall that is not in the site.
    Thing,
    /// A wall of the site stands before it.
    Wall,
    /// It is beside its view.
    OutOfView,
    /// It is farther than it sees.
    TooFar,
    /// There is no module.
    NoModule,
}

/// What a module sees of a place; a higher one says more.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Sight {
    /// Nothing: it is silent, or does not see the place in the empty room either.
    None,
    /// It sees the place if no person stands before it.
    InView,
    /// That nothing stands there.
    Empty,
}

impl Glance {
    /// Of an observation.
    #[must_use]
    pub fn of(observation: &Observation) -> Self {
        let mut glance = Self {
            view: Arc::clone(&observation.view),
            start_s: f64::NEG_INFINITY,
            empty_mm: Vec::new(),
            background_mm: Arc::clone(&observation.background_mm),
            open_range_mm: 0,
            bodies: Vec::new(),
        };
        glance.take(observation);
        glance
    }

    /// Goes on to a newer one.
    pub fn take(&mut self, observation: &Observation) {
        if observation.start_s < self.start_s {
            return;
        }
        self.start_s = observation.start_s;
        self.view = Arc::clone(&observation.view);
        self.background_mm = Arc::clone(&observation.background_mm);
        self.empty_mm.clone_from(&observation.empty_mm);
        let geometry = &observation.view.geometry;
        let body = |seen: &crate::observation::Detection| Body {
            beams: (geometry.beam(seen.candidate.first_step), geometry.beam(seen.candidate.last_step)),
            near_m: f64::from(seen.candidate.near_mm) * 1e-3,
            at: Point::new(seen.centre.x, seen.centre.y),
        };
        self.bodies.clear();
        self.bodies.extend(observation.detections.iter().map(body));
    }

    /// Up to which range its beams with nothing behind them are empty, mm: nothing need stand there.
    #[must_use]
    pub fn with_open_range(self, open_range_mm: u16) -> Self {
        Self { open_range_mm, ..self }
    }

    /// Number of the module in the site.
    #[must_use]
    pub fn module(&self) -> usize {
        self.view.module
    }

    /// Whether its range reaches a place.
    #[must_use]
    pub fn reaches(&self, place: Point) -> bool {
        (place - self.view.pose.at).length() <= f64::from(self.view.geometry.parts().range_max_mm) * 1e-3
    }

    /// Whether it sees a place in the empty room: it lies before the background.
    #[must_use]
    pub fn sees_empty(&self, place: Point) -> bool {
        let (distance_m, beam) = self.view.beam_at(place);
        let background_mm = beam.and_then(|beam| self.background_mm.get(usize::from(beam)));
        background_mm.is_some_and(|background_mm| distance_m < f64::from(*background_mm) * 1e-3)
    }

    /// What it sees of a place at `at_s`.
    #[must_use]
    pub fn sight(&self, place: Point, at_s: f64) -> Sight {
        let (distance_m, beam) = self.view.beam_at(place);
        let empty_mm = beam.and_then(|beam| self.empty_mm.get(usize::from(beam)));
        if at_s - self.start_s > SILENT_S || !self.reaches(place) || !self.sees_empty(place) {
            Sight::None
        } else if empty_mm.is_some_and(|empty_mm| f64::from(*empty_mm) * 1e-3 > distance_m) {
            Sight::Empty
        } else {
            Sight::InView
        }
    }

    /// Why the module does not see what is `slack_m` before a place, or the body that stands there.
    #[must_use]
    pub fn why(&self, place: Point, slack_m: f64, scene: &Scene<'_>) -> Why {
        if !self.reaches(place) {
            return Why::TooFar;
        }
        let (distance_m, beam) = self.view.beam_at(place);
        let Some(beam) = beam else { return Why::OutOfView };
        let from = seen_from(&self.view.pose, scene.walls.iter().copied());
        if scene.walls.iter().any(|wall| cross(*wall, (from, place))) {
            return Why::Wall;
        }
        let range_mm = |ranges_mm: &[u16]| ranges_mm.get(usize::from(beam)).copied().unwrap_or(0);
        let background_mm = range_mm(&self.background_mm);
        let is_behind = background_mm > 0 && f64::from(background_mm) * 1e-3 < distance_m;
        // At the open range a beam ends by itself. A wall may begin to the millimetre as far away, one in thousands.
        let behind = if background_mm == self.open_range_mm { Why::TooFar } else { Why::Thing };
        if scene.at_s - self.start_s > SILENT_S {
            return if is_behind { behind } else { Why::Silent };
        }
        let empty_m = f64::from(range_mm(&self.empty_mm)) * 1e-3;
        if empty_m > distance_m - slack_m {
            return Why::Seen;
        }
        let on_beam = self.bodies.iter().filter(|body| (body.beams.0..=body.beams.1).contains(&beam));
        if let Some(body) = on_beam.min_by(|one, other| one.near_m.total_cmp(&other.near_m)) {
            if body.near_m > distance_m - THERE_M {
                return Why::Seen;
            }
            return Why::Person { track: scene.track_at(body.at) };
        }
        if is_behind { behind } else { Why::NotJudged }
    }
}

/// What stands about at a time.
#[derive(Clone, Debug)]
pub struct Scene<'a> {
    /// The time, s.
    pub at_s: f64,
    walls: Vec<(Point, Point)>,
    tracks: &'a [TrackState],
}

impl<'a> Scene<'a> {
    /// The walls of a site that stop beams, and tracks.
    #[must_use]
    pub fn of(site: &Site, tracks: &'a [TrackState], at_s: f64) -> Self {
        let stops = |wall: &&Wall| wall.stops(Blocks::Beams);
        let walls = site.walls.iter().filter(stops).flat_map(Wall::sides).collect();
        Self { at_s, walls, tracks }
    }

    /// The nearest track to what a module sees.
    fn track_at(&self, at: Point) -> Option<TrackId> {
        let far_m = |track: &TrackState| (track.at - at).length();
        let near =
            self.tracks.iter().filter(|track| track.state != LifeCycle::Occluded && far_m(track) < SAME_M);
        near.min_by(|one, other| far_m(one).total_cmp(&far_m(other))).map(|track| track.id)
    }
}

/// Which module is nearest to seeing a place, and why it does not; the module is none where none reaches it.
#[must_use]
pub fn best(glances: &[Glance], place: Point, slack_m: f64, scene: &Scene<'_>) -> (Why, Option<usize>) {
    let each = glances.iter().map(|glance| (glance.why(place, slack_m, scene), Some(glance.module())));
    // Modules out of range are not named.
    let told = each.map(|(why, module)| (why, module.filter(|_| why < Why::OutOfView)));
    told.min_by_key(|(why, _)| *why).unwrap_or((Why::NoModule, None))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beyond_the_open_range_a_place_is_too_far_and_not_behind_a_thing() {
        let view = Arc::new(View::at_origin());
        let beams = usize::from(view.geometry.beams());
        // To the left nothing is behind any beam, to the right a sofa.
        let background_mm: Arc<[u16]> =
            (0..beams).map(|beam| if beam > beams / 2 { 1600 } else { 1200 }).collect();
        let observation = Observation {
            view,
            start_s: 1.0,
            detections: Vec::new(),
            empty_mm: background_mm.to_vec(),
            background_mm,
        };
        let site = Site::default();
        let why = |glance: &Glance, y: f64, at_s: f64| {
            glance.why(Point::new(2.0, y), 0.1, &Scene::of(&site, &[], at_s))
        };
        let glance = Glance::of(&observation).with_open_range(1600);
        for at_s in [1.0, 9.0] {
            assert_eq!((why(&glance, 1.0, at_s), why(&glance, -1.0, at_s)), (Why::TooFar, Why::Thing));
        }
        assert_eq!(why(&Glance::of(&observation), 1.0, 1.0), Why::Thing);
        let near = glance.why(Point::new(1.0, 0.5), 0.1, &Scene::of(&site, &[], 1.0));
        assert_eq!(near, Why::Seen);
    }
}
