//! Simulated scenes: the same bytes for the same seed, and ranges that agree with the truth.
#![allow(missing_docs, reason = "a test program")]

use host_sim::world::World;
use host_sim::world::geometry::Point;
use host_sim::world::scene::Scene;
use kehai_emulator::source::{RangeSource, Revolution};

/// FNV-1a over 64-bit words.
fn hash(words: impl Iterator<Item = u64>) -> u64 {
    words.fold(0xCBF2_9CE4_8422_2325, |hash, word| {
        word.to_le_bytes()
            .iter()
            .fold(hash, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01B3))
    })
}

fn world(name: &str, seed: u64) -> World {
    World::new(&Scene::load(name).unwrap(), seed)
}

/// Every tenth scan of every sensor, and the truth at the same times.
fn fingerprint(world: &World) -> u64 {
    let scans = (0..60).flat_map(|index| {
        let readings = |(_, sensor): &(String, host_sim::world::sensor::WorldSensor)| {
            sensor.readings(sensor.revolution(index * 10)).into_iter().map(u64::from).collect::<Vec<_>>()
        };
        let truth = world.truth(index as f64).people;
        let places =
            truth.into_iter().flat_map(|person| [person.id as u64, person.x.to_bits(), person.y.to_bits()]);
        world.sensors().iter().flat_map(readings).chain(places).collect::<Vec<_>>()
    });
    hash(scans)
}

#[test]
fn a_scene_gives_the_same_bytes_on_every_machine() {
    // Printed by this test; they change only when the world is meant to change.
    let expected = [
        ("demo", 0x068A_1D69_3816_9683),
        ("torso", 0xEDD0_F7EA_2F8F_DD53),
        ("empty", 0xDFF1_8809_20DC_CCA9),
        ("crossing", 0x5B35_EA8C_E5C2_7013),
        ("door-area", 0x1314_3E12_1433_3158),
        ("home", 0xE5F9_ACB9_714B_BE7A),
        ("chair-back", 0xEF2D_48D0_E4BB_DC4F),
        ("movers", 0x7D44_54B6_2B6E_D560),
        ("crouching", 0xBBEA_7CDA_47DA_0552),
    ];
    let found: Vec<(&str, u64)> =
        expected.iter().map(|(name, _)| (*name, fingerprint(&world(name, 1)))).collect();
    println!("{found:#x?}");
    assert_eq!(found, expected);
}

#[test]
fn another_seed_is_another_world_and_the_order_of_questions_does_not_matter() {
    let (first, second) = (world("demo", 1), world("demo", 1));
    assert_ne!(fingerprint(&first), fingerprint(&world("demo", 2)));
    let sensor = |world: &World| world.sensor("wall").unwrap().clone();
    let late = sensor(&first).readings(sensor(&first).revolution(500));
    for index in 0..20 {
        assert!(!sensor(&second).readings(sensor(&second).revolution(index)).is_empty());
    }
    assert_eq!(sensor(&second).readings(sensor(&second).revolution(500)), late);
}

#[test]
fn an_emulated_sensor_gets_the_scan_it_asks_for() {
    let mut sensor = world("door-area", 3).sensor("right").unwrap().clone();
    let revolution = Revolution { start_us: 20_000_000, period_us: 99_800, earliest_us: 0 };
    let scan = sensor.scan(revolution).unwrap();
    assert_eq!((scan.start_us, scan.ready_us), (20_000_000, 20_099_800));
    assert_eq!(scan.ranges_mm.len(), sensor.geometry().steps());
    assert_eq!(sensor.latest(revolution), Some(scan));
}

#[test]
fn every_reading_on_a_person_lies_on_their_body() {
    for seed in 0..3 {
        let world = world("door-area", seed);
        let mut seen_people = 0;
        for (_, sensor) in world.sensors() {
            for index in (150..500).step_by(7) {
                let revolution = sensor.revolution(index);
                let seen = sensor.seen(revolution);
                for (step, seen) in (sensor.geometry().first_step..).zip(seen) {
                    let Some(seen) = seen.filter(|seen| seen.thing >= host_sim::world::raycast::FIRST_PERSON)
                    else {
                        continue;
                    };
                    let number = usize::from(seen.thing - host_sim::world::raycast::FIRST_PERSON);
                    let time_s = (revolution.start_us as f64
                        + f64::from(revolution.period_us) * f64::from(step) / 1024.0)
                        * 1e-6;
                    let person = &world.people()[number];
                    let middle = person.motion.stance(time_s).unwrap().at;
                    let local = Point::towards(sensor.geometry().bearing_rad(step)) * seen.range_m;
                    let distance_m = (sensor.pose().to_site(local) - middle).length();
                    assert!(
                        distance_m < person.body.reach_m(),
                        "{distance_m} m from the middle of {}",
                        person.name
                    );
                    seen_people += 1;
                }
                let beams: u32 = sensor.beams_on_people(revolution).iter().sum();
                let people =
                    sensor.seen(revolution).iter().flatten().filter(|seen| seen.thing >= 0x8000).count();
                assert_eq!(beams as usize, people);
            }
        }
        assert!(seen_people > 5000, "{seen_people} beams met a person");
    }
}

#[test]
fn two_sensors_of_a_site_have_their_own_phase_and_period() {
    let world = world("door-area", 1);
    let clocks: Vec<_> = world.sensors().iter().map(|(_, sensor)| sensor.clock()).collect();
    assert_ne!(clocks[0].phase_us, clocks[1].phase_us);
    assert_ne!(clocks[0].period_us, clocks[1].period_us);
    for clock in clocks {
        assert!(clock.phase_us < 100_000 && (99_500..=99_900).contains(&clock.period_us), "{clock:?}");
    }
}

#[test]
fn no_person_in_the_demo_walks_through_a_person_or_a_thing() {
    for seed in [1, 7] {
        let scene = Scene::load("demo").unwrap();
        let world = World::new(&scene, seed);
        let (mut closest_m, mut nearest_pillar_m, mut in_view) = (f64::INFINITY, f64::INFINITY, 0);
        for tick in 0..3000 {
            let people = world.truth(0.1 * f64::from(tick)).people;
            let at: Vec<Point> = people.iter().map(|person| Point::new(person.x, person.y)).collect();
            for (index, one) in at.iter().enumerate() {
                closest_m =
                    at[..index].iter().map(|other| (*one - *other).length()).fold(closest_m, f64::min);
                nearest_pillar_m = nearest_pillar_m.min((*one - Point::new(-1.2, 2.2)).length());
                in_view += usize::from(one.x.abs() < 2.8 && one.y < 3.7);
            }
        }
        let in_view = in_view as f64 / 3000.0;
        println!(
            "seed {seed}: closest {closest_m:.2} m, pillar {nearest_pillar_m:.2} m, {in_view:.1} people in view"
        );
        assert!(closest_m > 0.33 && nearest_pillar_m > 0.25);
        assert!((1.5..4.0).contains(&in_view));
    }
}

#[test]
fn sensors_that_face_each_other_dazzle_each_other_now_and_then() {
    let mut scene = Scene::load("facing").unwrap();
    let dazzled = world("facing", 1);
    scene.cross_talk = false;
    let plain = World::new(&scene, 1);
    for (with, without) in dazzled.sensors().iter().zip(plain.sensors()) {
        let differs = |index: &u64| {
            let revolution = with.1.revolution(*index);
            with.1.readings(revolution) != without.1.readings(revolution)
        };
        let scans = (0..3000).filter(differs).count();
        assert!((3..150).contains(&scans), "{scans} of 3000 scans");
    }
}
