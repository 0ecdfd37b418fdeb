//! Is the crowd before the door as hard to see as the reference world's? Shares of runs in which no person
//! is occluded from both sensors for more than two seconds while all wait.
//!
//! ```text
//!   all in ───────── 10 s ───────── door opens        hidden: fewer than 3 beams from either sensor
//!   seen   ▮▮▮▮▯▯▯▮▮▮▮▮▮▮▮▮▮▮▮▮▯▯▮▮▮▮▮▮▮▮▮▮▮           longest gap ≤ 2 s: no person lost
//! ```
#![allow(missing_docs, reason = "a test program")]

use host_sim::world::World;
use host_sim::world::gathering::{Condition, GatheringSpec};
use host_sim::world::scene::Scene;

/// A person hit by fewer beams is occluded.
const LEAST_BEAMS: u32 = 3;
const LONGEST_GAP_S: f64 = 2.0;
/// Two hundred runs give 90, 66, 26 and 22 %.
const RUNS: u64 = 60;
/// The reference has 25 runs itself.
const TOLERANCE: f64 = 0.15;

/// Whether no person is occluded for too long.
fn everybody_is_seen(condition: Condition, people: usize, seed: u64) -> bool {
    let mut scene = Scene::load("door-area").unwrap();
    scene.gathering = Some(GatheringSpec { condition, people, ..scene.gathering.unwrap() });
    let world = World::new(&scene, seed);
    let events = world.events().unwrap();
    let mut sights: Vec<(u64, Vec<bool>)> = Vec::new();
    for (_, sensor) in world.sensors() {
        let period_us = u64::from(sensor.clock().period_us);
        let scan = |time_s: f64| (time_s * 1e6) as u64 / period_us;
        for index in scan(events.all_in_s)..scan(events.door_opens_s) {
            let revolution = sensor.revolution(index);
            let seen = sensor.beams_on_people(revolution).iter().map(|beams| *beams >= LEAST_BEAMS).collect();
            sights.push((revolution.start_us, seen));
        }
    }
    sights.sort();
    let longest_gap_us = |person: usize| {
        let seen = sights.iter().filter(|(_, seen)| seen[person]).map(|(at_us, _)| *at_us);
        let times: Vec<u64> = [(events.all_in_s * 1e6) as u64]
            .into_iter()
            .chain(seen)
            .chain([(events.door_opens_s * 1e6) as u64])
            .collect();
        times.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).max().unwrap_or(u64::MAX)
    };
    (0..people).all(|person| longest_gap_us(person) as f64 <= LONGEST_GAP_S * 1e6)
}

fn share(condition: Condition, people: usize) -> f64 {
    (0..RUNS).filter(|seed| everybody_is_seen(condition, people, *seed)).count() as f64 / RUNS as f64
}

#[test]
fn a_dense_crowd_hides_people_as_often_as_in_the_reference_world() {
    let reference = [(4, 0.80), (5, 0.52), (6, 0.20), (7, 0.32)];
    let found = std::thread::scope(|scope| {
        let runs = reference.map(|(people, _)| scope.spawn(move || share(Condition::Dense, people)));
        runs.map(|run| run.join().unwrap())
    });
    for ((people, reference), share) in reference.into_iter().zip(found) {
        let percent = |share: f64| 100.0 * share;
        println!(
            "dense, {people} people: none hidden > 2 s in {:.0} % of {RUNS} runs (reference {:.0} %)",
            percent(share),
            percent(reference)
        );
        assert!((share - reference).abs() <= TOLERANCE, "{people} people");
    }
}
