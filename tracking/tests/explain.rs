//! Every reason that the tracker gives for a figure, from a scene in which it is the true one.
#![allow(missing_docs, reason = "a test program")]

#[path = "intake/scene.rs"]
#[allow(dead_code, reason = "the people of other tests")]
mod scene;
#[path = "intake/tracker.rs"]
mod tracker;

use std::sync::Arc;

use kehai::centre::Estimator;
use kehai::scan::Geometry;
use kehai_tracking::explain::glance::Why;
use kehai_tracking::explain::person::{Life, PersonReasons};
use kehai_tracking::explain::words::words;
use kehai_tracking::explain::zone::{Patch, ZoneReasons};
use kehai_tracking::explain::{Question, Reasons, explain};
use kehai_tracking::geometry::Point;
use kehai_tracking::observation::{Detection, Observation, View};
use kehai_tracking::occupancy::ZoneKnown;
use kehai_tracking::site::Site;
use kehai_tracking::site_tracker::SiteTracker;
use kehai_tracking::zones::verdict::{Role, Verdict};
use scene::{BEAMS, silhouettes};
use tracker::tracker;

/// As far as the emulated background is.
const WALLS_M: f64 = 4.5;

/// Two modules, of which the second stands behind the first's back; a sofa that is not in the site hides what is behind it.
const SITE: &str = r#"
    [[module]]
    name = "left"
    x = 0.0
    y = 0.0
    [[wall]]
    points = [[1.0, -1.0], [1.6, -1.0]]
    [[zone]]
    name = "room"
    polygon = [[0.6, -1.6], [3.0, -1.6], [3.0, 1.6], [0.6, 1.6]]
    [[zone]]
    name = "yard"
    polygon = [[-2.0, -0.4], [-1.2, -0.4], [-1.2, 0.4], [-2.0, 0.4]]
    [[zone]]
    name = "far"
    polygon = [[9.0, 0.0], [10.0, 0.0], [10.0, 1.0], [9.0, 1.0]]
    [[line]]
    name = "front"
    from = [2.0, -0.8]
    to = [2.0, 0.8]
"#;

const SOFA: (Point, Point) = (Point::new(1.2, 0.5), Point::new(1.2, 0.9));

struct Room {
    site: Arc<Site>,
    /// Those that stand there, whatever the site file says.
    walls: Vec<(Point, Point)>,
    tracker: SiteTracker,
    tenths: u64,
    bodies: Vec<Point>,
    silent: bool,
}

impl Room {
    fn new() -> Self {
        Self::with("")
    }

    /// With more in its site file than there is.
    fn with(more: &str) -> Self {
        let true_site: Site = toml::from_str(SITE).unwrap();
        let walls = true_site.walls.iter().flat_map(|wall| wall.sides()).chain([SOFA]).collect();
        let site: Arc<Site> = Arc::new(toml::from_str(&format!("{SITE}{more}")).unwrap());
        let tracker = SiteTracker::new(&site, tracker());
        Self { site, walls, tracker, tenths: 0, bodies: Vec::new(), silent: false }
    }

    fn now_s(&self) -> f64 {
        100.0 + self.tenths as f64 * 0.1
    }

    fn tenth(&mut self) {
        self.tenths += 1;
        if !self.silent {
            self.observe();
        }
        self.tracker.estimate(self.now_s());
    }

    fn seconds(&mut self, seconds: f64) {
        (0..(seconds * 10.0) as u64).for_each(|_| self.tenth());
    }

    fn observe(&mut self) {
        let module = &self.site.modules[0];
        let geometry = Geometry::new(BEAMS).unwrap();
        let view = Arc::new(View {
            module: 0,
            pose: module.pose(),
            height_m: module.height_m,
            geometry,
            upside_down: false,
        });
        let start_s = self.now_s() - 0.1;
        let background_mm: Vec<u16> = (0..view.geometry.beams())
            .map(|beam| {
                let forward =
                    Point::towards(module.pose().yaw_rad + f64::from(view.geometry.bearing_rad(beam)));
                let far_m = self
                    .walls
                    .iter()
                    .filter_map(|wall| meets_m(module.pose().at, forward, *wall))
                    .fold(WALLS_M, f64::min);
                (far_m * 1e3) as u16
            })
            .collect();
        let mut empty_mm = background_mm.clone();
        let candidates = silhouettes(self.bodies.iter().copied(), module.pose(), BEAMS);
        for candidate in &candidates {
            for beam in view.geometry.beam(candidate.first_step)..=view.geometry.beam(candidate.last_step) {
                empty_mm[usize::from(beam)] = candidate.near_mm.saturating_sub(60);
            }
        }
        let detections = candidates
            .into_iter()
            .map(|seen| Detection::new(seen, &view, start_s, Estimator::default()))
            .collect();
        self.tracker.observe(&Observation {
            view,
            start_s,
            detections,
            empty_mm,
            background_mm: background_mm.into(),
        });
    }

    fn ask(&self, question: &Question) -> Option<Reasons> {
        explain(self.tracker.facts(question, self.now_s()))
    }

    fn zone(&self, name: &str) -> ZoneReasons {
        match self.ask(&Question::Zone(name.into())) {
            Some(Reasons::Zone(zone)) => zone,
            other => panic!("{other:?}"),
        }
    }

    fn person(&self, id: u64) -> PersonReasons {
        match self.ask(&Question::Person(id)) {
            Some(Reasons::Person(person)) => person,
            other => panic!("{other:?}"),
        }
    }

    fn people(&mut self) -> Vec<u64> {
        self.tracker.estimate(self.now_s()).tracks.iter().map(|track| track.id).collect()
    }
}

/// How far a ray goes until it meets a piece of wall.
fn meets_m(from: Point, forward: Point, (one, other): (Point, Point)) -> Option<f64> {
    let side = other - one;
    let across = forward.cross(side);
    let (along_m, share) = ((one - from).cross(side) / across, (one - from).cross(forward) / across);
    (along_m > 0.0 && (0.0..=1.0).contains(&share)).then_some(along_m)
}

fn patch(zone: &ZoneReasons, is: impl Fn(Why) -> bool) -> &Patch {
    zone.unseen.iter().find(|patch| is(patch.why)).unwrap_or_else(|| panic!("{:#?}", zone.unseen))
}

#[test]
fn what_is_behind_a_sofa_and_behind_a_wall_is_told_apart_and_was_never_seen() {
    let mut room = Room::new();
    room.seconds(5.0);
    let zone = room.zone("room");
    assert_eq!((zone.state, zone.count), (ZoneKnown::Known, Some(0)));
    assert_eq!(zone.verdict, Some(Verdict::Seen));
    assert!((0.8..0.95).contains(&zone.seen_share), "{zone:?}");
    let sofa = patch(&zone, |why| why == Why::Thing);
    assert!(sofa.at[0] > 1.2 && sofa.at[1] > 0.5 && sofa.size > 0.3, "{sofa:?}");
    assert_eq!((sofa.module.as_deref(), sofa.seen_ago_s), (Some("left"), None));
    let wall = patch(&zone, |why| why == Why::Wall);
    assert!(wall.at[1] < -1.0, "{wall:?}");
    let unseen: f64 = zone.unseen.iter().map(|patch| patch.size).sum::<f64>() + zone.unseen_more;
    assert!((unseen / zone.size - (1.0 - zone.seen_share)).abs() < 0.02, "{unseen} of {}", zone.size);
    let said = words(&Reasons::Zone(zone)).join("\n");
    for word in [
        "no person\n",
        "% seen, not:",
        "behind a thing that belongs to the room, from left; never seen",
        "behind a wall",
    ] {
        assert!(said.contains(word), "{said}");
    }
}

#[test]
fn the_wall_that_a_module_hangs_on_hides_nothing_where_the_file_has_it_before_the_module() {
    let mut room = Room::with("[[wall]]\npoints = [[0.01, -3.0], [0.01, 3.0]]");
    room.seconds(5.0);
    let sofa = patch(&room.zone("room"), |why| why == Why::Thing).at;
    assert!(sofa[0] > 1.2 && sofa[1] > 0.5, "{sofa:?}");
}

#[test]
fn behind_the_back_of_a_module_and_farther_than_it_sees_nothing_is_known() {
    let mut room = Room::new();
    room.seconds(5.0);
    let yard = room.zone("yard");
    assert_eq!((yard.state, yard.count, yard.verdict), (ZoneKnown::Unknown, None, Some(Verdict::HardlySeen)));
    let behind = patch(&yard, |why| why == Why::OutOfView);
    assert_eq!((behind.module.as_deref(), behind.seen_ago_s), (None, None));
    let far = room.zone("far");
    assert_eq!(patch(&far, |why| why == Why::TooFar).size, 1.0);
    assert!(words(&Reasons::Zone(far))[0].contains("not known"));
    assert_eq!(room.ask(&Question::Zone("cellar".into())), None);
}

#[test]
fn a_zone_not_looked_at_for_long_enough_begins_and_says_for_how_long() {
    let mut room = Room::new();
    assert_eq!(patch(&room.zone("room"), |why| why == Why::NoModule).module, None);
    room.seconds(1.0);
    let zone = room.zone("room");
    let Some(Verdict::Begins { for_s }) = zone.verdict else { panic!("{zone:?}") };
    assert!((for_s - 0.6).abs() < 0.11 && zone.count.is_none(), "{for_s}");
}

#[test]
fn a_silent_module_is_the_reason_and_it_says_since_when() {
    let mut room = Room::new();
    room.seconds(5.0);
    room.silent = true;
    room.seconds(3.0);
    let zone = room.zone("room");
    assert_eq!((zone.state, zone.verdict), (ZoneKnown::Unknown, Some(Verdict::HardlySeen)));
    let silent = patch(&zone, |why| why == Why::Silent);
    assert!((silent.seen_ago_s.unwrap() - 3.1).abs() < 0.15, "{silent:?}");
    assert!(words(&Reasons::Zone(zone.clone())).join("\n").contains("left says nothing"));
    // What it never saw is behind the sofa, also while it is silent.
    assert_eq!(patch(&zone, |why| why == Why::Thing).seen_ago_s, None);
}

#[test]
fn a_module_that_was_moved_makes_its_zones_unknown_for_a_while() {
    let mut room = Room::new();
    room.seconds(5.0);
    let mut site = (*room.site).clone();
    site.modules[0].yaw_deg = 2.0;
    room.site = Arc::new(site);
    room.tracker.change_site(&Arc::clone(&room.site));
    room.tenth();
    let zone = room.zone("room");
    assert!(matches!(zone.verdict, Some(Verdict::Moved { for_s }) if for_s > 1.0), "{zone:?}");
    room.seconds(2.0);
    assert_eq!(room.zone("room").verdict, Some(Verdict::Seen));
}

#[test]
fn one_person_hides_another_by_name() {
    let mut room = Room::new();
    room.bodies = vec![Point::new(2.6, 0.0)];
    room.seconds(4.0);
    let [hidden] = room.people()[..] else { panic!("one person") };
    let seen = room.person(hidden);
    assert_eq!((seen.life, seen.zones.clone()), (Life::Seen, vec!["room".to_owned()]));
    assert_eq!((seen.modules[0].module.as_str(), seen.modules[0].why), ("left", Why::Seen));
    assert!((seen.born_ago_s.unwrap() - 4.0).abs() < 0.15, "{seen:?}");
    let [x, y] = seen.born_at.unwrap();
    assert!((Point::new(x, y) - Point::new(2.6, 0.0)).length() < 0.3, "{seen:?}");
    // Another steps before him.
    for tenth in 0..40 {
        room.bodies = vec![Point::new(2.6, 0.0), Point::new(1.2, -0.8 + 0.02 * f64::from(tenth))];
        room.tenth();
    }
    room.bodies[1] = Point::new(1.2, 0.0);
    room.seconds(1.0);
    let people = room.people();
    let before = *people.iter().find(|id| **id != hidden).unwrap();
    let person = room.person(hidden);
    assert_eq!(person.life, Life::Hidden, "{person:?}");
    assert_eq!(person.modules[0].why, Why::Person { track: Some(before) }, "{person:?}");
    assert!(person.seen_ago_s.unwrap() > 0.5, "{person:?}");
    let zone = room.zone("room");
    let counted: Vec<u64> = zone
        .inside
        .iter()
        .filter(|one| one.role == Role::Counted && one.is_inside)
        .map(|one| one.track)
        .collect();
    assert_eq!((zone.count, counted), (Some(2), people));
    assert_eq!(
        patch(&zone, |why| matches!(why, Why::Person { .. })).why,
        Why::Person { track: Some(before) }
    );
    let said = words(&Reasons::Person(person)).join("\n");
    assert!(said.contains(&format!("behind person {before}")) && said.contains("is hidden"), "{said}");
    assert_eq!(room.ask(&Question::Person(999)), None);
}

#[test]
fn a_line_says_which_part_of_it_is_not_seen() {
    let mut room = Room::new();
    room.seconds(5.0);
    let ask = |room: &Room| match room.ask(&Question::Line("front".into())) {
        Some(Reasons::Zone(line)) => line,
        other => panic!("{other:?}"),
    };
    let line = ask(&room);
    assert_eq!((line.is_line, line.state, line.size), (true, ZoneKnown::Known, 1.6));
    room.silent = true;
    room.seconds(3.0);
    let line = ask(&room);
    assert_eq!((line.state, line.count), (ZoneKnown::Unknown, None));
    assert!((line.unseen[0].size - 1.6).abs() < 0.01 && line.unseen[0].why == Why::Silent, "{line:?}");
    assert!(words(&Reasons::Zone(line))[0].contains("not seen"));
}

#[test]
fn a_question_changes_nothing() {
    let (mut asked, mut quiet) = (Room::new(), Room::new());
    for tenth in 0..60 {
        for room in [&mut asked, &mut quiet] {
            room.bodies = vec![Point::new(1.0 + 0.02 * f64::from(tenth), 0.2)];
            room.silent = (20..35).contains(&tenth);
            room.tenth();
        }
        for question in [Question::Zone("room".into()), Question::Line("front".into()), Question::Person(1)] {
            asked.ask(&question);
        }
        let now_s = asked.now_s();
        assert_eq!(asked.tracker.estimate(now_s), quiet.tracker.estimate(now_s));
    }
}
