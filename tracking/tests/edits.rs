//! A site is edited while people are followed: at no moment fewer people are said to be there than are.
#![allow(missing_docs, reason = "a test program")]

#[path = "intake/fake.rs"]
mod fake;
#[path = "intake/judge.rs"]
mod judge;
#[path = "intake/scene.rs"]
mod scene;
#[path = "intake/times.rs"]
mod times;
#[path = "intake/tracker.rs"]
mod tracker;
#[path = "intake/world.rs"]
#[allow(dead_code, reason = "what other tests do in it")]
mod world;

use std::sync::Arc;

use kehai_tracking::occupancy::ZoneKnown;
use kehai_tracking::site::{Module, Site, Wall, Zone};
use scene::{People, ROOM};
use times::SECOND_US;
use world::World;

const BOTH: People = People { stands: true, walks: true };

/// Of a seed from here on no second tracker is asked.
const SEED: u64 = 16;

/// Holds what the site has around `area`, too.
const AROUND: [[f64; 2]; 4] = [[-1.3, -1.3], [1.3, -1.3], [1.3, 1.3], [-1.3, 1.3]];

/// The half of the area in which a person stands, on the same cells.
const HALF: [[f64; 2]; 4] = [[-1.2, -1.2], [0.2, -1.2], [0.2, 1.2], [-1.2, 1.2]];

fn room() -> Site {
    toml::from_str(&format!("{ROOM}[[zone]]\nname = \"around\"\npolygon = {AROUND:?}\n")).unwrap()
}

fn edit(world: &mut World, site: &Site) {
    let site = Arc::new(site.clone());
    site.check().unwrap();
    world.site_tracker.change_site(&site);
    world.registry.change_site(&site, world.site_tracker.sessions_mut());
}

/// One of the edits that leave modules where they are.
fn edited(site: &mut Site, world: &mut World) -> &'static str {
    let random = world.random();
    let pick = |count: u64| ((random >> 8) % count) as usize;
    match random % 7 {
        0 => {
            let name = format!("around-{}", pick(100));
            site.zones
                .iter_mut()
                .filter(|zone| zone.name != "area")
                .for_each(|zone| zone.name = name.clone());
            "another name of a zone"
        }
        1 => {
            site.modules[0].height_m = 0.3 + 0.01 * pick(80) as f64;
            "another height"
        }
        2 => {
            let aside_m = 0.01 * pick(10) as f64;
            let around = AROUND.map(|[x, y]| [x + aside_m, y - aside_m]);
            site.zones
                .iter_mut()
                .filter(|zone| zone.name != "area")
                .for_each(|zone| zone.polygon = around.into());
            "another shape"
        }
        3 => {
            site.zones.retain(|zone| zone.name == "area");
            site.zones.push(zone("new", AROUND.into()));
            "a new zone"
        }
        4 => {
            let points = vec![[-1.6, 1.7], [1.6, 1.7]];
            if site.walls.pop().is_none() {
                site.walls.push(Wall { points, ..toml::from_str("points = [[0, 0], [1, 1]]").unwrap() });
            }
            "a wall"
        }
        5 => {
            site.modules.truncate(2);
            site.modules.push(Module {
                name: format!("third-{}", pick(2)),
                y: 5.0,
                ..site.modules[0].clone()
            });
            "a module that is not there yet"
        }
        _ => "nothing",
    }
}

fn zone(name: &str, polygon: Vec<[f64; 2]>) -> Zone {
    Zone {
        polygon,
        ..toml::from_str(&format!("name = \"{name}\"\npolygon = [[0, 0], [1, 0], [1, 1]]")).unwrap()
    }
}

/// Looks at every zone a tenth of a second later, and says the least that is known of any.
fn look(world: &mut World, what: &str) {
    world.tenth();
    let at_s = world.now_us as f64 * 1e-6;
    for (name, zone) in world.site_tracker.estimate(at_s).zones {
        let is_said = zone.count().is_none_or(|count| count >= BOTH.count());
        assert!(is_said, "{what}: {name}: {zone:?} of {} people", BOTH.count());
    }
}

#[test]
fn no_edit_says_that_fewer_people_are_there() {
    for seed in SEED..SEED + 60 {
        let mut world = World::new(BOTH, seed);
        let mut site = room();
        edit(&mut world, &site);
        world.seconds(10);
        for _ in 0..30 {
            let what = edited(&mut site, &mut world);
            edit(&mut world, &site);
            // The first look is before any module has reported again.
            for tenth in 0..1 + world.random() % 12 {
                look(&mut world, what);
                let area = world.zone();
                assert_eq!(area.state(), ZoneKnown::Known, "{what}, {tenth}");
                assert_eq!(area.count(), Some(BOTH.count()), "{what}, {tenth}");
            }
        }
    }
}

/// Both modules restart and learn the person who stands there, whom no report shows any more.
fn learn(world: &mut World) {
    let now_us = world.now_us;
    for honest in &mut world.honest {
        honest.fake.learned = world.people.seen(honest.pose, now_us);
        honest.fake.identity.boot += 1;
        honest.fake.sequence = 0;
        honest.silent_until_us = now_us + 40 * SECOND_US;
    }
    world.people = People { stands: false, walks: false };
    // The judge knows of no person that no report shows.
    world.judge.disturbed_us = u64::MAX;
    world.seconds(50);
}

#[test]
fn no_edit_says_that_a_person_is_gone_whom_a_gap_may_hide() {
    for seed in SEED..SEED + 4 {
        let mut world = World::new(People { stands: true, walks: false }, seed);
        let mut site = room();
        site.zones[1].polygon = site.zones[0].polygon.clone();
        edit(&mut world, &site);
        world.seconds(10);
        assert_eq!(world.zone().count(), Some(1));
        learn(&mut world);
        for what in ["no edit", "the same", "another name", "another shape"] {
            match what {
                "another name" => site.zones[1].name = what.into(),
                "another shape" => site.zones[1].polygon = HALF.into(),
                _ => {}
            }
            if what != "no edit" {
                edit(&mut world, &site);
            }
            for _ in 0..5 {
                world.tenth();
                let at_s = world.now_us as f64 * 1e-6;
                for (name, zone) in world.site_tracker.estimate(at_s).zones {
                    assert_eq!(zone.state(), ZoneKnown::Partly, "{what}: {name}: {zone:?}");
                }
            }
        }
    }
}

#[test]
fn tracks_keep_their_numbers_over_an_edit() {
    let mut world = World::new(BOTH, SEED);
    world.seconds(10);
    let ids = |world: &mut World| {
        let at_s = world.now_us as f64 * 1e-6;
        world.site_tracker.estimate(at_s).tracks.iter().map(|track| track.id).collect::<Vec<_>>()
    };
    let before = ids(&mut world);
    edit(&mut world, &room());
    world.seconds(2);
    assert_eq!(ids(&mut world), before);
}

#[test]
fn where_a_moved_module_looks_nothing_is_known_until_people_can_have_been_found() {
    let mut world = World::new(BOTH, SEED);
    let mut site = room();
    edit(&mut world, &site);
    world.seconds(10);
    let module = site.modules.iter_mut().find(|module| module.name == "left").unwrap();
    module.y = 0.7;
    world.honest[0].pose.at.y = 0.7;
    world.judge.disturbed_us = world.now_us;
    edit(&mut world, &site);
    // As long as it takes to find people, less the age of the newest scan.
    for _ in 0..12 {
        look(&mut world, "a module was moved");
        assert_eq!(world.zone().state(), ZoneKnown::Unknown);
    }
    world.seconds(3);
    assert_eq!((world.zone().state(), world.zone().count()), (ZoneKnown::Known, Some(2)));
}

#[test]
fn nothing_is_known_by_modules_without_a_place_until_they_have_one() {
    let mut world = World::new(BOTH, SEED);
    let mut site = room();
    site.modules.iter_mut().for_each(|module| module.placed = false);
    edit(&mut world, &site);
    world.seconds(10);
    look(&mut world, "no module is placed");
    let at_s = world.now_us as f64 * 1e-6;
    assert_eq!(
        (world.zone().state(), world.site_tracker.estimate(at_s).tracks.len()),
        (ZoneKnown::Unknown, 0)
    );
    let lines = world.registry.update_lines(world.site_tracker.sessions_mut(), world.now_us);
    assert!(
        lines.iter().any(|line| !line.sees.is_empty()),
        "each says what it sees in its own frame: {lines:?}"
    );
    site.modules.iter_mut().for_each(|module| module.placed = true);
    edit(&mut world, &site);
    world.seconds(4);
    assert_eq!((world.zone().state(), world.zone().count()), (ZoneKnown::Known, Some(2)));
    let lines = world.registry.update_lines(world.site_tracker.sessions_mut(), world.now_us);
    assert!(lines.iter().all(|line| line.sees.is_empty()), "{lines:?}");
}
