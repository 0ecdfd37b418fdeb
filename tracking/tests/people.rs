//! People stand and walk in a room while clocks, hosts and modules go wrong: they are counted right, or it is not known.
#![allow(missing_docs, reason = "a test program")]

#[path = "intake/attack.rs"]
mod attack;
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
mod world;

use fake::{Fake, id};
use kehai::wire::Identity;
use kehai_tracking::jsonl::ZoneKnown;
use scene::{BEAMS, People};
use times::SECOND_US;
use world::World;

const BOTH: People = People { stands: true, walks: true };

/// A room that has been watched for ten seconds.
fn watched(people: People) -> World {
    let mut world = World::new(people, 1);
    world.seconds(10);
    world
}

/// Both people are counted or nothing is known, at every moment of so many seconds; and at the end they are counted.
fn are_counted_or_it_is_not_known(world: &mut World, seconds: u64) {
    for tenth in 0..10 * seconds {
        world.tenth();
        let zone = world.zone();
        assert!(
            zone.state() != ZoneKnown::Known || zone.count() == Some(world.people.count()),
            "{tenth}: {zone:?}"
        );
    }
    let zone = world.zone();
    assert_eq!((zone.state(), zone.count()), (ZoneKnown::Known, Some(world.people.count())));
}

#[test]
fn people_in_an_undisturbed_room_are_counted_from_the_beginning() {
    for (stands, walks) in [(false, false), (true, false), (false, true), (true, true)] {
        are_counted_or_it_is_not_known(&mut World::new(People { stands, walks }, 1), 60);
    }
}

#[test]
fn f1_a_host_that_slept_for_ten_minutes() {
    let mut world = watched(BOTH);
    world.suspend([0; 3]);
    are_counted_or_it_is_not_known(&mut world, 60);
}

#[test]
fn f1_the_clocks_of_both_modules_jump_by_ten_minutes() {
    let mut world = watched(BOTH);
    world.jump([0, 3, 10]);
    world.jump([1, 3, 10]);
    are_counted_or_it_is_not_known(&mut world, 60);
}

#[test]
fn f1_the_clocks_of_two_modules_are_six_seconds_apart() {
    let mut world = World::new(BOTH, 1);
    let [left, right] = &world.honest;
    assert_eq!(right.fake.offset_us - left.fake.offset_us, 6 * SECOND_US as i64);
    are_counted_or_it_is_not_known(&mut world, 60);
}

#[test]
fn f3_the_flash_of_a_module_was_erased() {
    let mut world = watched(BOTH);
    world.restart([0; 3]);
    assert_eq!(world.honest[0].fake.identity.boot, 1);
    are_counted_or_it_is_not_known(&mut world, 60);
    assert_eq!(world.registry.update_lines(world.site_tracker.sessions_mut(), world.now_us).len(), 3);
}

#[test]
fn f4_a_module_was_swapped_for_another_of_the_same_name() {
    let mut world = watched(BOTH);
    let identity = Identity { module: id(7), boot: 3 };
    let offset_us = -(world.now_us as i64) + 200_000;
    world.honest[0].fake = Fake { identity, offset_us, parts: BEAMS, ..Fake::new(7, 3, "left") };
    world.judge.disturbed_us = world.now_us;
    are_counted_or_it_is_not_known(&mut world, 60);
    let lines = world.registry.update_lines(world.site_tracker.sessions_mut(), world.now_us);
    assert!(lines.iter().any(|line| line.name == "left" && line.id == id(7).to_string()), "{lines:?}");
}
