//! Long silences: people walk about on a floor for twenty minutes, and the ID of each is not read for up to a minute at a time.
//!
//! ```text
//!   read     ▪▪▪▪▪▪▪            ▪▪▪▪▪▪▪▪▪▪▪          ▪▪▪▪▪
//!   silent          ─ 1 to 60 s ─           ── … ──
//!   right?                     ↑└ 1 s ┘↑     still, at the end of the silence; again, within a second of the first reading
//! ```
//!
//! They walk to places anywhere on the largest floor that one device can have, wait at some of them, and avoid each other; their
//! feet follow from their balance. A floor alone does not know who is who: where it has taken two for each other, only readings
//! can tell.

use kehai::floor::{Floor, READING_US};
use kehai_tracking::floor::{Plan, Reading};
use kehai_tracking::geometry::{Point, Pose};
use serde::{Deserialize, Serialize};

use super::feet::Feet;
use super::gait::Sole;
use super::host::{Host, site};
use super::panels::{Broken, PITCH_M, reading};
use super::tags::{Camera, Covered};
use super::trial::{BACK_S, RIGHT_M, SETTLED_S};
use crate::world::body::{Body, Section, Stance};
use crate::world::motion::Track;
use crate::world::random::{Purpose, Stream};
use crate::world::walker::{Habit, Repeat, WayPoint};
use crate::world::wandering::{Wanderer, simulate};

/// How long it lasts, s.
pub const DURATION_S: f64 = 1200.0;

/// How many people, at most: more cannot get past each other.
pub const PEOPLE: [usize; 3] = [2, 3, 4];

/// Panels along a side of the floor: 1024 in all.
const SIDE: u8 = 32;

/// Half of the floor's side, m; and how far from its middle people go, so that their feet stay on it.
const HALF_M: f64 = 0.5 * SIDE as f64 * PITCH_M;
const GOES_M: f64 = HALF_M - 0.3;

/// They begin so far from each other, m.
const APART_M: f64 = 0.7;

/// Places that each goes to: at a metre each, and some waits, as many as take twenty minutes.
const PLACES: usize = 1500;

/// Share of the places at which they wait, and how long, s.
const WAITS: f64 = 0.3;
const WAIT_S: [f64; 2] = [1.0, 10.0];

/// The camera, before the middle of a side, m.
const CAMERA: Point = Point { x: 0.0, y: -HALF_M - 2.0 };

/// An ID that was not read for so long was silent, s.
const LEAST_S: f64 = 1.0;

/// Between two places of a body from which its feet follow, s.
const GAIT_S: f64 = 0.01;

/// What a run shows.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Silences {
    /// Silences of at least a second, of all IDs.
    pub times: u64,
    /// Of them: the ID was right as they ended.
    pub kept: u64,
    /// Of them: it was right within a second of the first reading.
    pub back: u64,
    /// The longest until it was, s.
    pub longest_s: f64,
}

/// Runs it with so many people.
#[must_use]
pub fn run(people: usize, seed: u64) -> Silences {
    let corner = Pose { at: Point::new(-HALF_M, -HALF_M), yaw_rad: 0.0 };
    let plan = Plan { corner, columns: SIDE, rows: SIDE, pitch_m: PITCH_M };
    let Some(mut floor) = Floor::new(SIDE, SIDE) else { return Silences::default() };
    let (mut host, mut camera) = (Host::new(site(&plan)), Camera::new(CAMERA, seed));
    let mut tags: Vec<Covered> =
        (0..people).map(|person| Covered::new(SETTLED_S, (seed, person as u64))).collect();
    let (mut crowd, mut judge) = (Crowd::new(people, seed), Judge::new(people));
    for number in 1.. {
        let at_s = f64::from(number) * READING_US as f64 * 1e-6;
        if at_s > crowd.end_s() {
            break;
        }
        while camera.next_s() <= at_s {
            let read_s = camera.next_s();
            let in_view =
                crowd.stances(read_s).map(|Stance { at, heading_rad, .. }| (at, Point::towards(heading_rad)));
            let in_view: Vec<_> = (0..).zip(in_view).map(|(id, (at, ahead))| (id, at, ahead)).collect();
            for tag in camera.read(&in_view) {
                let person = tag.id as usize;
                if tags.get_mut(person).is_some_and(|tag| tag.shows(read_s)) {
                    judge.read(person, read_s);
                    host.tag(read_s, &tag);
                }
            }
        }
        let bits = reading(&plan, &crowd.soles(at_s), &Broken::default());
        // As many bits as the floor has panels.
        let _ = floor.read(bits.bytes(plan.panels()));
        host.read(&Reading { floor: 0, plan, at_s, down: floor.pressed(), faulty: Vec::new() });
        let truth: Vec<Point> = crowd.stances(at_s).map(|stance| stance.at).collect();
        let found: Vec<Option<Point>> = (0..).take(people).map(|id| host.place_of(id)).collect();
        judge.look(at_s, &truth, &found);
    }
    judge.silences()
}

/// People and their feet.
struct Crowd {
    tracks: Vec<Track>,
    feet: Vec<Option<Feet>>,
    /// How many steps of [`GAIT_S`] the feet have followed.
    followed: u32,
}

impl Crowd {
    fn new(people: usize, seed: u64) -> Self {
        let tracks = simulate(&wanderers(people, seed), &[], DURATION_S);
        Self { tracks, feet: vec![None; people], followed: 0 }
    }

    /// All are there until then, s.
    fn end_s(&self) -> f64 {
        self.tracks.iter().map(Track::end_s).fold(DURATION_S, f64::min)
    }

    fn stances(&self, at_s: f64) -> impl Iterator<Item = Stance> {
        self.tracks.iter().filter_map(move |track| track.stance(at_s))
    }

    /// The soles on the floor; times only grow.
    fn soles(&mut self, at_s: f64) -> Vec<Sole> {
        while f64::from(self.followed + 1) * GAIT_S <= at_s {
            self.followed += 1;
            let now_s = f64::from(self.followed) * GAIT_S;
            for (track, feet) in self.tracks.iter().zip(&mut self.feet) {
                let Some(Stance { at, heading_rad, .. }) = track.stance(now_s) else { continue };
                feet.get_or_insert_with(|| Feet::new(now_s, at, heading_rad)).follow(now_s, at, heading_rad);
            }
        }
        self.feet.iter().flatten().flat_map(Feet::soles).collect()
    }
}

/// People who go from place to place.
fn wanderers(people: usize, seed: u64) -> Vec<Wanderer> {
    let mut begins: Vec<Point> = Vec::new();
    let one = |person: usize| {
        let mut random = Stream::new(seed, Purpose::Walk, [0xb5, person as u64]);
        let place = |random: &mut Stream| {
            Point::new(random.between(-GOES_M, GOES_M), random.between(-GOES_M, GOES_M))
        };
        let mut first = place(&mut random);
        while begins.iter().any(|other| (*other - first).length() < APART_M) {
            first = place(&mut random);
        }
        begins.push(first);
        let mut points = vec![WayPoint { at: first, wait_s: 0.0 }];
        for _ in 1..PLACES {
            let at = place(&mut random);
            let waits = random.chance(WAITS);
            let wait_s = random.between(WAIT_S[0], WAIT_S[1]);
            points.push(WayPoint { at, wait_s: if waits { wait_s } else { 0.0 } });
        }
        let body =
            Body::random(Section::Torso, &mut Stream::new(seed, Purpose::Person, [0xb5, person as u64]));
        // As fast as in the paper's experiments.
        let speed_m_s = random.between(0.6, 0.9);
        let habit = Habit {
            speed_m_s,
            from_s: 0.0,
            until_s: f64::INFINITY,
            repeat: Repeat::Loop,
            heading_rad: 0.0,
            turn_rad_s: 0.0,
            sway_m: 0.0,
            shift_m: 0.0,
            shift_every_s: [DURATION_S; 2],
        };
        Wanderer { body, points, habit }
    };
    (0..people).map(one).collect()
}

/// Compares the places of IDs with the truth as silences end.
struct Judge {
    ids: Vec<Watched>,
    silences: Silences,
}

/// An ID.
#[derive(Clone, Copy)]
struct Watched {
    read_s: f64,
    is_right: bool,
    /// Since when it has to be right again, s.
    since_s: Option<f64>,
}

impl Judge {
    fn new(people: usize) -> Self {
        let watched = Watched { read_s: f64::INFINITY, is_right: false, since_s: None };
        Self { ids: vec![watched; people], silences: Silences::default() }
    }

    fn read(&mut self, id: usize, at_s: f64) {
        let Some(watched) = self.ids.get_mut(id) else { return };
        if at_s - watched.read_s >= LEAST_S && at_s >= SETTLED_S && watched.since_s.is_none() {
            self.silences.times += 1;
            self.silences.kept += u64::from(watched.is_right);
            watched.since_s = Some(at_s);
        }
        watched.read_s = at_s;
    }

    fn look(&mut self, at_s: f64, truth: &[Point], found: &[Option<Point>]) {
        for (id, (watched, found)) in self.ids.iter_mut().zip(found).enumerate() {
            let off = |to: &Point| found.map_or(f64::INFINITY, |found| (found - *to).length());
            let own = truth.get(id).map_or(f64::INFINITY, off);
            let nearest = truth.iter().map(off).fold(f64::INFINITY, f64::min);
            watched.is_right = own < RIGHT_M && own <= nearest;
            let Some(since_s) = watched.since_s else { continue };
            if watched.is_right {
                self.silences.back += u64::from(at_s - since_s <= BACK_S);
                self.silences.longest_s = self.silences.longest_s.max(at_s - since_s);
                watched.since_s = None;
            }
        }
    }

    fn silences(self) -> Silences {
        // A person who is awaited when the run ends was not late yet.
        let awaited = self.ids.iter().filter(|watched| watched.since_s.is_some()).count() as u64;
        Silences { times: self.silences.times - awaited, ..self.silences }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_stay_on_the_floor() {
        let tracks = simulate(&wanderers(4, 3), &[], 120.0);
        for tenth in 0..1190 {
            for track in &tracks {
                let at = track.stance(0.1 * f64::from(tenth)).unwrap().at;
                assert!(at.x.abs() < HALF_M && at.y.abs() < HALF_M, "{at:?}");
            }
        }
    }

    #[test]
    fn a_silence_is_mended_within_a_second_or_late() {
        let mut judge = Judge::new(2);
        let truth = [Point::new(0.0, 0.0), Point::new(1.0, 0.0)];
        let [own, other] = truth.map(Some);
        (0..2).for_each(|id| judge.read(id, 6.0));
        judge.look(6.1, &truth, &[own, other]);
        // Both silent for 4 s: the first one's name is with the other all the time, the second one's just before it is read.
        judge.look(9.9, &truth, &[other, other]);
        (0..2).for_each(|id| judge.read(id, 10.0));
        judge.look(10.1, &truth, &[other, own]);
        judge.look(10.9, &truth, &[None, other]);
        judge.look(11.5, &truth, &[own, own]);
        // Half a second is no silence, and who is awaited at the end is not late yet.
        judge.read(0, 10.5);
        judge.read(1, 20.0);
        let Silences { times, kept, back, longest_s } = judge.silences();
        assert_eq!((times, kept, back), (2, 1, 1));
        assert!((longest_s - 1.5).abs() < 1e-9, "{longest_s}");
    }
}
