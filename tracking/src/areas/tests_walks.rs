//! Groups who walk over a border, as two trackers have them: each person keeps the number, and is counted exactly once.
//!
//! ```text
//!   west, x < 1 m  ─────────────────────┤
//!                              ├──────── strip ┤
//!                              ├──────────────────────── east, x > −1 m
//! ```

use std::collections::BTreeMap;

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;

use super::tests::{area, both, frame, track};
use crate::jsonl::TrackLine;
use crate::snapshot::Snapshot;
use crate::tracker::LifeCycle;

/// A person who walks from one hall to the other, and how each tracker has them.
struct Walker {
    /// Where at the start, m, and how fast, m/s.
    from: [f64; 2],
    speed: f64,
    /// Into each area this much after its edge, s.
    found_s: [f64; 2],
    /// What each tracker is off by: changes slowly, m.
    off: [[f64; 2]; 2],
}

struct World {
    random: Pcg64Mcg,
    walkers: Vec<Walker>,
    /// What the poses of each area are off by, m.
    posed: [[f64; 2]; 2],
}

impl World {
    fn unit(&mut self) -> f64 {
        self.random.next_u32() as f64 / f64::from(u32::MAX)
    }

    /// About normal.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }

    fn new(seed: u64) -> Self {
        let mut world = Self {
            random: Pcg64Mcg::new(u128::from(seed) << 64 | 1),
            walkers: Vec::new(),
            posed: [[0.0; 2]; 2],
        };
        for area in 0..2 {
            world.posed[area] = [0, 1].map(|_| world.normal() * 0.04);
        }
        let speed = 0.7 + world.unit() * 1.1;
        let ways = if world.unit() < 0.5 { [1.0, -1.0] } else { [1.0, 1.0] };
        let people = 1 + (world.unit() * 4.0) as usize;
        let apart_m = 0.55 + world.unit() * 0.6;
        for person in 0..people {
            let way = ways[person % 2];
            let y = apart_m * person as f64;
            let speed = way * speed * (0.9 + world.unit() * 0.2);
            let found_s = [0, 1].map(|_| 0.3 + world.unit() * 0.5);
            let from = [-4.0 * way + world.normal() * 0.4, y];
            world.walkers.push(Walker { from, speed, found_s, off: [[0.0; 2]; 2] });
        }
        world
    }

    fn at(walker: &Walker, t: f64) -> [f64; 2] {
        [walker.from[0] + walker.speed * t, walker.from[1]]
    }

    /// What the tracker of an area says: the people in its view, and for half a second longer where they would be.
    fn says(&mut self, area: usize, t: f64) -> Vec<TrackLine> {
        let mut tracks = Vec::new();
        for person in 0..self.walkers.len() {
            for axis in 0..2 {
                let noise = self.normal() * 0.02;
                self.walkers[person].off[area][axis] = self.walkers[person].off[area][axis] * 0.9 + noise;
            }
            let walker = &self.walkers[person];
            let sees = |t: f64| {
                let x = Self::at(walker, t)[0];
                if area == 0 { x < 1.0 } else { x > -1.0 }
            };
            let is_found = (0..=2).all(|part| sees(t - walker.found_s[area] * f64::from(part) / 2.0));
            let is_held = sees(t - 0.5) && sees(t - 0.5 - walker.found_s[area]);
            if !is_found && !is_held {
                continue;
            }
            let at = Self::at(walker, t);
            let [x, y] = [0, 1].map(|axis| at[axis] + walker.off[area][axis] + self.posed[area][axis]);
            let speed = walker.speed;
            let state = if sees(t) { LifeCycle::Confirmed } else { LifeCycle::Occluded };
            let vx = speed + self.normal() * 0.1;
            tracks.push(TrackLine { vx, state, ..track(person as u64 + 10, x, y) });
        }
        tracks
    }
}

/// The number by which each walker is shown at the place.
fn numbers(picture: &Snapshot, world: &World, t: f64) -> Vec<Option<u64>> {
    let nearest = |walker: &Walker| {
        let at = World::at(walker, t);
        let far = |track: &&TrackLine| (track.x - at[0]).hypot(track.y - at[1]);
        let nearest = picture.line.tracks.iter().min_by(|a, b| far(a).total_cmp(&far(b)))?;
        (far(&nearest) < 0.4).then_some(nearest.id)
    };
    world.walkers.iter().map(nearest).collect()
}

/// Plays walks of groups over the border until so many people have gone over it; how many have another number after it, and for
/// how long, at most, there were more or fewer shown than there are, s.
fn cross(people: usize, lost_share: f64) -> (usize, f64) {
    let (mut crossed, mut renamed, mut longest_s) = (0, 0, 0.0_f64);
    let mut seed = 0;
    while crossed < people {
        seed += 1;
        let mut world = World::new(seed);
        let (mut campus, site) = both();
        let mut numbers_before: BTreeMap<usize, u64> = BTreeMap::new();
        let mut wrong_s = 0.0;
        let mut count = 10;
        for step in 0..140 {
            let t = f64::from(step) * 0.1;
            let now_us = 10_000_000 + step as u64 * 100_000;
            for (index, name) in ["west", "east"].into_iter().enumerate() {
                let tracks = world.says(index, t);
                count += 1;
                if world.unit() >= lost_share {
                    campus.hear(&area(name), frame(count, tracks), now_us - 50_000 * index as u64);
                }
            }
            let picture = campus.picture(&site, now_us, 1);
            let found = numbers(&picture, &world, t);
            for (person, number) in found.iter().enumerate() {
                let x = World::at(&world.walkers[person], t)[0];
                if x.abs() > 2.5
                    && x.abs() < 3.5
                    && let Some(number) = number
                {
                    let has_crossed = (x > 0.0) == (world.walkers[person].speed > 0.0);
                    if !has_crossed {
                        numbers_before.entry(person).or_insert(*number);
                    } else if let Some(before) = numbers_before.remove(&person) {
                        crossed += 1;
                        renamed += usize::from(before != *number);
                    }
                }
            }
            let is_whole = world.walkers.iter().all(|walker| World::at(walker, t)[0].abs() < 3.5);
            if is_whole && t > 1.5 {
                wrong_s = if picture.line.tracks.len() == world.walkers.len() { 0.0 } else { wrong_s + 0.1 };
                longest_s = longest_s.max(wrong_s);
            }
        }
    }
    (renamed, longest_s)
}

#[test]
fn of_a_thousand_people_who_cross_a_border_none_gets_another_number() {
    let (renamed, longest_s) = cross(1000, 0.0);
    println!(
        "1000 over the border: {renamed} with another number, wrong by one or more for {longest_s:.1} s at most"
    );
    assert_eq!(renamed, 0);
    assert!(longest_s <= 0.35, "{longest_s}");
}

#[test]
fn nor_if_a_third_of_the_frames_is_lost() {
    let (renamed, longest_s) = cross(1000, 0.3);
    println!(
        "1000 over the border with 30 % loss: {renamed} with another number, wrong for {longest_s:.1} s at most"
    );
    assert_eq!(renamed, 0);
}
