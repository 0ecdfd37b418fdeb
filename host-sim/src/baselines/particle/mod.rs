//! The particle filter of Noguchi et al. 2009 (docs/bibliography.md, paper C), step by step as written: a baseline.
//!
//! ```text
//!   outline points ─▶ off the grid map ─▶ near a track ──▶ cloud follows ─▶ estimate
//!                                         left over ─▶ segments ─▶ circle of a plausible radius ─▶ birth
//!   no points for a few frames, or every particle where no person can be ─▶ death
//! ```
//!
//! Given by the paper: places as state, constant velocity, the likelihood and R, the map's and the scan's veto on
//! particles, birth by a circle fit, death after a few frames. What it leaves open, and is chosen here:
//!
//! | open | chosen |
//! |---|---|
//! | assignment of points (its home has one person) | to the nearest predicted person, inside a gate |
//! | scans of several modules | each moves and weighs the cloud when it comes; births see the newest of all |
//! | σ, particles, w, range of radii, frames | [`ParticleSettings::RADIUS_15`] |
//! | where the velocity comes from | how far estimates are off the predicted place, over a while |
//! | confirmation | a new track is confirmed after a few frames, not at once |
//!
//! Foreground points are reconstructed from candidates: up to 18 points each (`baselines::outline`).

mod birth;
mod cloud;
mod grid;

use std::sync::Arc;

use crate::baselines::outline::{self, FieldPoint};
use cloud::Cloud;
pub use cloud::CloudSettings;
use grid::GridMap;
use kehai_tracking::geometry::Point;
use kehai_tracking::observation::Observation;
use kehai_tracking::site::Site;
use kehai_tracking::tracker::{LifeCycle, Origin, TrackState, Tracker};

/// Parameters: those of paper C, and those that it leaves open.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ParticleSettings {
    /// Of each person's cloud.
    pub cloud: CloudSettings,
    /// Gate: a point farther than this from every predicted middle belongs to no person, m.
    pub gate_m: f64,
    /// Fewest points that update a person.
    pub points: usize,
    /// Points nearer to each other than this are one segment, m.
    pub link_m: f64,
    /// Fewest points of a segment that may be a new person.
    pub birth_points: usize,
    /// Smallest and largest radius of a new person, m.
    pub birth_radius_m: [f64; 2],
    /// No person is born nearer than this to another person, m.
    pub suppression_m: f64,
    /// Frames until a new person is confirmed.
    pub frames: u32,
    /// Gone after so long without support, s.
    pub forget_s: f64,
}

impl ParticleSettings {
    /// With R = 15 cm, as in the paper. A few frames are five. The range of radii goes from a thin thigh to a flat
    /// front. The rest was tried one number at a time on sixty runs with five and six people: only the time to
    /// forget matters, five seconds lose fewer of them and keep more ghosts.
    pub const RADIUS_15: Self = Self {
        cloud: CloudSettings {
            particles: 200,
            radius_m: 0.15,
            sigma_m: 0.15,
            seed_m: 0.15,
            wander: 0.2,
            velocity_s: 0.4,
        },
        gate_m: 0.4,
        points: 2,
        link_m: 0.2,
        birth_points: 5,
        birth_radius_m: [0.06, 0.40],
        suppression_m: 0.4,
        frames: 3,
        forget_s: 0.5,
    };
}

/// Points of several modules are of one frame up to this age, s: a scan takes 0.1 s.
const FRAME_S: f64 = 0.12;

struct Person {
    id: u32,
    cloud: Cloud,
    frames: u32,
    supported_s: f64,
}

/// Unassigned points of a module's newest scan.
struct Rest {
    module: usize,
    points: Vec<FieldPoint>,
}

/// Paper C's tracker.
pub struct Particle {
    settings: ParticleSettings,
    grid: GridMap,
    people: Vec<Person>,
    rests: Vec<Rest>,
    next_id: u32,
}

/// Places that a scan or the map proves to be without a person.
struct Veto<'a> {
    observation: &'a Observation,
    front_m: Vec<f64>,
    grid: &'a GridMap,
}

impl Veto<'_> {
    /// Whether the place is on the map, or nearer than the measured range of its beam.
    fn is_impossible(&self, place: Point) -> bool {
        if self.grid.holds(place, self.observation.start_s) {
            return true;
        }
        let (distance_m, beam) = self.observation.view.beam_at(place);
        let front_m = beam.and_then(|beam| self.front_m.get(usize::from(beam)));
        front_m.is_some_and(|&front_m| distance_m < front_m)
    }
}

impl Particle {
    /// A tracker without tracks.
    #[must_use]
    pub fn new(site: &Arc<Site>, settings: ParticleSettings) -> Self {
        Self { settings, grid: GridMap::of(site), people: Vec::new(), rests: Vec::new(), next_id: 1 }
    }

    /// Foreground points that are not on the map.
    fn points(&mut self, observation: &Observation) -> Vec<FieldPoint> {
        let mut points = Vec::new();
        for seen in &observation.detections {
            for point in outline::points(&observation.view, &seen.candidate, observation.start_s) {
                self.grid.learn(point.at, point.at_s, seen.candidate.static_ds);
                if !self.grid.holds(point.at, point.at_s) {
                    points.push(point);
                }
            }
        }
        points
    }

    /// Assigns every point to the nearest person inside the gate; returns the points of each person, and the others.
    fn divide(&self, points: Vec<FieldPoint>) -> (Vec<Vec<FieldPoint>>, Vec<FieldPoint>) {
        let mut owned = vec![Vec::new(); self.people.len()];
        let mut rest = Vec::new();
        for point in points {
            let distance_m = |person: &Person| (person.cloud.place(point.at_s) - point.at).length();
            let nearest = (self.people.iter().map(distance_m).enumerate())
                .min_by(|one, other| one.1.total_cmp(&other.1))
                .filter(|(_, distance_m)| *distance_m < self.settings.gate_m);
            match nearest {
                Some((index, _)) => owned[index].push(point),
                None => rest.push(point),
            }
        }
        (owned, rest)
    }

    /// Looks for new people in the unassigned points of the newest scans.
    fn bear(&mut self, veto: &Veto<'_>) {
        let newest_s = veto.observation.start_s;
        let fresh: Vec<FieldPoint> = (self.rests.iter().flat_map(|rest| &rest.points))
            .filter(|point| (point.at_s - newest_s).abs() < FRAME_S)
            .copied()
            .collect();
        let places: Vec<Point> = fresh.iter().map(|point| point.at).collect();
        let segments = birth::segments(&places, self.settings.link_m);
        let count = segments.iter().max().map_or(0, |last| last + 1);
        for segment in 0..count {
            let own = |points: &[Point]| -> Vec<Point> {
                (points.iter().zip(&segments)).filter(|(_, of)| **of == segment).map(|(at, _)| *at).collect()
            };
            let places = own(&places);
            if places.len() < self.settings.birth_points {
                continue;
            }
            let Some(circle) = birth::fit(&places) else { continue };
            let [smallest_m, largest_m] = self.settings.birth_radius_m;
            if !(smallest_m..=largest_m).contains(&circle.radius_m) {
                continue;
            }
            let at_s = (fresh.iter().zip(&segments))
                .filter(|(_, of)| **of == segment)
                .map(|(point, _)| point.at_s)
                .fold(f64::NEG_INFINITY, f64::max);
            let near = |person: &Person| {
                (person.cloud.place(at_s) - circle.centre).length() < self.settings.suppression_m
            };
            if self.people.iter().any(near) {
                continue;
            }
            let mut cloud = Cloud::new(at_s, circle.centre, self.next_id, self.settings.cloud);
            if cloud.follow(at_s, &places, |place| veto.is_impossible(place)) {
                self.people.push(Person { id: self.next_id, cloud, frames: 1, supported_s: at_s });
                self.next_id += 1;
            }
        }
    }

    fn forget(&mut self, now_s: f64) {
        self.people.retain(|person| now_s - person.supported_s <= self.settings.forget_s);
    }
}

impl Tracker for Particle {
    fn observe(&mut self, observation: &Observation) {
        self.forget(observation.start_s);
        let points = self.points(observation);
        let (owned, rest) = self.divide(points);
        let grid = std::mem::take(&mut self.grid);
        let veto = Veto { observation, front_m: outline::front_m(observation), grid: &grid };
        for (person, points) in self.people.iter_mut().zip(owned) {
            if points.len() < self.settings.points {
                continue;
            }
            let newest_s = points.iter().map(|point| point.at_s).fold(person.cloud.at_s(), f64::max);
            // Beams of a scan pass one after another: points go with the person to the time of the last.
            let velocity = person.cloud.velocity();
            let places: Vec<Point> =
                points.iter().map(|point| point.at + velocity * (newest_s - point.at_s)).collect();
            if person.cloud.follow(newest_s, &places, |place| veto.is_impossible(place)) {
                person.frames += 1;
                person.supported_s = newest_s;
            }
        }
        let module = observation.view.module;
        self.rests.retain(|rest| rest.module != module);
        self.rests.push(Rest { module, points: rest });
        self.bear(&veto);
        self.grid = grid;
    }

    fn tracks(&mut self, at_s: f64) -> Vec<TrackState> {
        self.forget(at_s);
        self.peek(at_s)
    }

    fn peek(&self, at_s: f64) -> Vec<TrackState> {
        let state = |person: &Person| {
            let confirmed = person.frames >= self.settings.frames;
            let (state, reason) = match (confirmed, at_s - person.supported_s < 0.25) {
                (false, _) => (LifeCycle::Tentative, "circle found"),
                (true, true) => (LifeCycle::Confirmed, "seen"),
                (true, false) => (LifeCycle::Occluded, "no support"),
            };
            TrackState {
                id: person.id.into(),
                at: person.cloud.place(at_s),
                velocity: person.cloud.velocity(),
                covariance_m2: person.cloud.covariance_m2(at_s),
                state,
                existence: if confirmed { 1.0 } else { 0.5 },
                reason,
                origin: Origin::Entered,
            }
        };
        self.people.iter().map(state).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::kehai::candidate::{CONTOUR_POINTS, CONTOUR_UNIT_MM, Candidate};
    use ::kehai::centre::Estimator;
    use ::kehai::scan::{Geometry, URG_04LX};
    use kehai_tracking::geometry::Pose;
    use kehai_tracking::observation::{Detection, View};
    use kehai_tracking::site::Mover;

    /// What a module at the origin that looks along x sees of a body of R, `x` before it.
    fn round(x: f64, view: &View) -> Candidate {
        let half = (libm::asin(0.15 / x) / f64::from(view.geometry.beam_rad())) as u16;
        let middle = view.beam_towards(0.0).unwrap();
        let range_mm = |beam: u16| {
            let off_rad = f64::from(view.geometry.bearing_rad(beam));
            let (sine, cosine) = libm::sincos(off_rad);
            ((x * cosine - (0.15 * 0.15 - x * x * sine * sine).max(0.0).sqrt()) * 1000.0) as u16
        };
        let (first, last, near_mm) = (middle - half, middle + half, range_mm(middle));
        let contour = (1..=CONTOUR_POINTS as u16).map(|point| {
            let beam = first + (2 * point * (last - first) + 8) / 16;
            ((range_mm(beam) - near_mm) / CONTOUR_UNIT_MM) as u8
        });
        Candidate {
            first_step: view.geometry.step(first),
            last_step: view.geometry.step(last),
            first_mm: range_mm(first),
            last_mm: range_mm(last),
            near_mm,
            near_step: view.geometry.step(middle),
            mid_mm: near_mm,
            beams: last - first + 1,
            contour: contour.collect(),
            ..Candidate::default()
        }
    }

    fn observation(start_s: f64, x: Option<f64>) -> Observation {
        let pose = Pose { at: Point::default(), yaw_rad: 0.0 };
        let geometry = Geometry::new(URG_04LX).unwrap();
        let view = Arc::new(View { module: 0, pose, height_m: 0.6, geometry, upside_down: false });
        let seen = |x: f64| Detection::new(round(x, &view), &view, start_s, Estimator::default());
        let detections = x.map(seen).into_iter().collect();
        Observation { view, start_s, detections, empty_mm: Vec::new(), background_mm: Arc::from([]) }
    }

    fn tracker(site: Site) -> Particle {
        Particle::new(&Arc::new(site), ParticleSettings::RADIUS_15)
    }

    #[test]
    fn a_person_is_born_from_a_circle_and_gone_after_a_few_frames_unseen() {
        let mut tracker = tracker(Site::default());
        tracker.observe(&observation(0.0, Some(2.0)));
        assert_eq!(tracker.tracks(0.1)[0].state, LifeCycle::Tentative);
        for scan in 1..10 {
            tracker.observe(&observation(f64::from(scan) * 0.1, Some(2.0)));
        }
        let [track] = tracker.tracks(1.0)[..] else { panic!("not one") };
        assert_eq!((track.id, track.state), (1, LifeCycle::Confirmed));
        assert!((track.at - Point::new(2.0, 0.0)).length() < 0.07, "{:?}", track.at);
        tracker.observe(&observation(1.2, None));
        assert_eq!(tracker.tracks(1.3)[0].state, LifeCycle::Occluded);
        tracker.observe(&observation(1.6, None));
        assert!(tracker.tracks(1.6).is_empty());
    }

    #[test]
    fn what_a_mover_shows_is_no_person() {
        let polygon = vec![[1.5, -0.5], [2.5, -0.5], [2.5, 0.5], [1.5, 0.5]];
        let mover = Mover { name: String::new(), polygon };
        let mut tracker = tracker(Site { movers: vec![mover], ..Site::default() });
        tracker.observe(&observation(0.0, Some(2.0)));
        assert!(tracker.tracks(0.1).is_empty());
        tracker.observe(&observation(0.1, Some(3.0)));
        assert_eq!(tracker.tracks(0.2).len(), 1);
    }
}
