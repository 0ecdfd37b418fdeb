//! The papers' trackers, and ours, follow one person through simulated worlds, from the sensors' bytes on.
#![allow(missing_docs, reason = "a test program")]

use std::fmt;

use host_sim::run::{Options, Record};
use host_sim::world::body::Section;
use host_sim::world::scene::Scene;
use host_sim::world::variation::{Letter, Variation};
use kehai_tracking::geometry::Point;
use kehai_tracking::tracker::LifeCycle;

/// Farther away than this a track is not on the person, m: the frame is lost.
const LOST_M: f64 = 0.5;

/// With fewer beams than this from every sensor, a person need not be detected.
const VISIBLE_BEAMS: u32 = 10;

#[derive(Debug, Default)]
struct Followed {
    frames: u32,
    lost: u32,
    sum_m: f64,
    /// Confirmed tracks that were not on a person, summed over the frames.
    ghosts: u32,
    identities: Vec<u64>,
}

impl Followed {
    fn mean_m(&self) -> f64 {
        self.sum_m / f64::from((self.frames - self.lost).max(1))
    }
}

impl fmt::Display for Followed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { frames, lost, ghosts, identities, .. } = self;
        let (mean_mm, identities) = (self.mean_m() * 1000.0, identities.len());
        write!(f, "{mean_mm:.0} mm, {lost} of {frames} lost, {ghosts} ghosts, {identities} identities")
    }
}

/// Follows the only person of a run. Frames count from the first at which they are seen inside `region`.
fn follow(record: &Record, tracker: &str, region: impl Fn(Point) -> bool) -> Followed {
    let mut followed = Followed::default();
    let mut seen_since_s = None;
    record.follow(tracker.parse().unwrap(), |site_tracker, moment| {
        let mut tracks = site_tracker.tracks(moment.t);
        tracks.retain(|track| track.state != LifeCycle::Tentative);
        let [person] = moment.people.as_slice() else {
            assert!(moment.people.is_empty());
            followed.ghosts +=
                tracks.iter().filter(|track| track.state == LifeCycle::Confirmed).count() as u32;
            return;
        };
        let place = Point::new(person.x, person.y);
        let distance_m = |at: Point| (at - place).length();
        let away = tracks.iter().filter(|track| region(track.at) && distance_m(track.at) > LOST_M).count();
        followed.ghosts += away as u32;
        if person.beams < VISIBLE_BEAMS || !region(place) {
            return;
        }
        // A tracker needs up to a second and a half to confirm a person.
        if moment.t - *seen_since_s.get_or_insert(moment.t) < 1.5 {
            return;
        }
        followed.frames += 1;
        let nearest = tracks.iter().min_by(|one, two| distance_m(one.at).total_cmp(&distance_m(two.at)));
        match nearest.filter(|track| distance_m(track.at) <= LOST_M) {
            Some(track) => {
                followed.sum_m += distance_m(track.at);
                if !followed.identities.contains(&track.id) {
                    followed.identities.push(track.id);
                }
            }
            None => followed.lost += 1,
        }
    });
    followed
}

/// The door area's passage.
fn passage(place: Point) -> bool {
    place.x.abs() < 1.0 && (-1.4..0.9).contains(&place.y)
}

fn door_area(letter: Letter, seed: u64) -> Record {
    let mut scene = Scene::load("door-area").unwrap();
    let (people, condition) = (Some(1), Some(letter));
    scene.vary(&Variation { people, condition, ..Variation::default() }).unwrap();
    Record::of(&scene, seed, &Options::default()).unwrap()
}

#[test]
fn both_papers_trackers_follow_one_person_before_a_door() {
    for seed in [0, 1] {
        let record = door_area(Letter::D, seed);
        for tracker in ["lee", "particle"] {
            let followed = follow(&record, tracker, passage);
            println!("{tracker}, seed {seed}: {followed}");
            assert!(followed.frames > 100, "{tracker}: {followed}");
            assert_eq!(followed.lost, 0, "{tracker}: {followed}");
            assert!(followed.mean_m() < 0.1, "{tracker}: {followed}");
            assert_eq!(followed.identities.len(), 1, "{tracker}: {followed}");
        }
        let [first, again] = [0, 1].map(|_| follow(&record, "particle", passage).sum_m);
        assert_eq!(first, again);
    }
}

#[test]
fn of_the_two_only_the_particle_filter_follows_thighs() {
    let record = door_area(Letter::T, 2);
    let [lee, particle] = ["lee", "particle"].map(|tracker| follow(&record, tracker, passage));
    println!("lee: {lee}\nparticle: {particle}");
    assert!(particle.lost == 0 && particle.mean_m() < 0.1, "{particle}");
    assert!(lee.lost > 20, "{lee}");
}

#[test]
fn the_inhabitant_of_a_furnished_home_is_never_lost() {
    let inside = |place: Point| place.x.abs() < 2.9 && place.y.abs() < 2.4;
    for section in [Section::Torso, Section::Thighs] {
        let mut scene = Scene::load("home").unwrap();
        scene.vary(&Variation { section: Some(section), ..Variation::default() }).unwrap();
        let record = Record::of(&scene, 0, &Options::default()).unwrap();
        let [lee, particle, ours] =
            ["lee", "particle", "kehai"].map(|tracker| follow(&record, tracker, inside));
        println!("{section:?}\nlee: {lee}\nparticle: {particle}\nkehai: {ours}");
        assert!(ours.lost == 0 && ours.mean_m() < 0.08 && ours.identities.len() == 1, "{ours}");
        assert!(particle.frames > 600 && particle.lost == 0, "{particle}");
        assert!(particle.mean_m() < 0.1 && particle.identities.len() == 1, "{particle}");
        assert!(section == Section::Thighs || (lee.lost == 0 && lee.mean_m() < 0.1), "{lee}");
    }
}
