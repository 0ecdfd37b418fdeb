//! The same bytes give the same tracks on every machine: digests of what both trackers say of one recording, to compare.
//!
//! ```text
//!   five people, two modules ─▶ datagrams ─┬─▶ kehai     ─▶ tracks every 0.1 s, all their bits ─▶ digest
//!        whole numbers, + − × ÷ √, libm    └─▶ rendering ─▶ …                                  ─▶ digest
//! ```
//!
//! Addition, multiplication, division and roots are exact by IEEE 754; sine, logarithm and the like are what each machine's library
//! makes of them, so all of them are libm's, compiled from its source. `./ci.sh targets` runs this on two architectures, and
//! compares what is printed.
#![allow(missing_docs, reason = "a test program")]

#[path = "intake/fake.rs"]
mod fake;
#[path = "intake/scene.rs"]
#[allow(dead_code, reason = "the people of other tests")]
mod scene;

use std::sync::Arc;

use fake::Fake;
use kehai_tracking::estimate::Estimate;
use kehai_tracking::geometry::{Point, Pose};
use kehai_tracking::site::Site;
use kehai_tracking::site_tracker::SiteTracker;
use kehai_tracking::tracker::rendering::RenderingModel;
use kehai_tracking::tracker::{Ideas, Model};
use scene::{BEAMS, ROOM, silhouettes};

/// Between two reports of a module, and two lines, µs.
const STEP_US: u64 = 100_000;

/// How long it is, µs.
const END_US: u64 = 30_000_000;

/// To and fro along a side of the room, m: where it begins, how far it goes, how long there and back takes, µs, and how late it begins.
struct Walk {
    from: (f64, f64),
    way: (f64, f64),
    turn_us: u64,
    after_us: u64,
}

/// They cross, hide one another, touch and leave the zone.
const WALKS: [Walk; 5] = [
    Walk { from: (-1.5, -0.6), way: (3.0, 0.1), turn_us: 7_300_000, after_us: 0 },
    Walk { from: (0.4, 1.5), way: (-0.3, -2.9), turn_us: 6_100_000, after_us: 1_700_000 },
    Walk { from: (-0.7, 0.5), way: (0.05, 0.02), turn_us: 2_900_000, after_us: 400_000 },
    Walk { from: (-1.4, 0.7), way: (2.7, -1.1), turn_us: 8_900_000, after_us: 3_100_000 },
    Walk { from: (0.6, -1.5), way: (0.1, 1.4), turn_us: 5_300_000, after_us: 12_000_000 },
];

impl Walk {
    fn at(&self, now_us: u64) -> Option<Point> {
        let into_us = now_us.checked_sub(self.after_us)? % self.turn_us;
        let half_us = self.turn_us / 2;
        let share = into_us.min(self.turn_us - into_us) as f64 / half_us as f64;
        Some(Point::new(self.from.0 + self.way.0 * share, self.from.1 + self.way.1 * share))
    }
}

/// The datagrams of two modules with the times of their arrival, µs.
fn datagrams() -> Vec<(u64, Vec<u8>)> {
    let module = |number: u8, name, x: f64, yaw_rad| {
        let fake =
            Fake { parts: BEAMS, offset_us: i64::from(number) * 7_000_000, ..Fake::new(number, 1, name) };
        (fake, Pose { at: Point::new(x, 0.0), yaw_rad })
    };
    let modules = [module(1, "left", -2.0, 0.0), module(2, "right", 2.0, core::f64::consts::PI)];
    let mut all = Vec::new();
    for (number, (mut fake, pose)) in (0..).zip(modules) {
        let met = [vec![fake.info(1)], fake.profile(), vec![fake.subscribed(1, 600, 1000)]].concat();
        all.extend(met.into_iter().map(|bytes| (1000, bytes)));
        for step in 1..END_US / STEP_US {
            let start_us = step * STEP_US + 37_000 * number;
            if step % 10 == 0 {
                all.push((start_us, fake.subscribed(step as u32, start_us - 400, start_us)));
            }
            let people = WALKS.iter().filter_map(|walk| walk.at(start_us + STEP_US / 2));
            let seen = silhouettes(people, pose, BEAMS);
            fake.sequence += 1;
            let report = fake.reported_with(fake.sequence, fake.clock_us(start_us), &seen);
            all.push((start_us + STEP_US, report));
        }
    }
    all.sort_by_key(|(at_us, _)| *at_us);
    all
}

/// FNV-1a of 64 bits.
struct Digest(u64);

impl Digest {
    const fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }

    fn estimate(&mut self, estimate: &Estimate) {
        for track in &estimate.tracks {
            self.add(&track.id.to_le_bytes());
            self.add(&[track.state as u8]);
            let [xx, xy, yy] = track.covariance_m2;
            let (at, velocity) = (track.at, track.velocity);
            for number in [at.x, at.y, velocity.x, velocity.y, xx, xy, yy, track.existence] {
                self.add(&number.to_bits().to_le_bytes());
            }
        }
        for zone in estimate.zones.values() {
            self.add(&zone.count().unwrap_or(u32::MAX).to_le_bytes());
            zone.p().iter().for_each(|p| self.add(&p.to_bits().to_le_bytes()));
        }
    }
}

/// The digest of all that a tracker says, and the most people it counts.
fn follow(model: impl Model + 'static, datagrams: &[(u64, Vec<u8>)]) -> (u64, u32) {
    let site = Arc::new(Site::parse("room", ROOM).unwrap());
    let mut tracker = SiteTracker::new(&site, model);
    let mut datagrams = datagrams.iter().peekable();
    let (mut digest, mut most) = (Digest::new(), 0);
    for line in 1..END_US / STEP_US {
        let now_us = line * STEP_US + 13_000;
        while let Some((at_us, bytes)) = datagrams.next_if(|(at_us, _)| *at_us <= now_us) {
            tracker.receive(bytes, *at_us);
        }
        let estimate = tracker.estimate(now_us as f64 * 1e-6);
        digest.estimate(&estimate);
        most = most.max(estimate.zones.values().filter_map(|zone| zone.count()).max().unwrap_or(0));
    }
    (digest.0, most)
}

#[test]
fn the_same_bytes_give_the_same_tracks() {
    let datagrams = datagrams();
    let mut digest = Digest::new();
    datagrams.iter().for_each(|(_, bytes)| digest.add(bytes));
    println!("digest of {} datagrams {:016x}", datagrams.len(), digest.0);
    judge("kehai-rules", &datagrams, Ideas::default());
    judge("kehai", &datagrams, RenderingModel::default());
}

/// Prints the digest of a tracker's tracks.
#[track_caller]
fn judge(name: &str, datagrams: &[(u64, Vec<u8>)], model: impl Model + Copy + 'static) {
    let (tracks, most) = follow(model, datagrams);
    println!("digest of {name} {tracks:016x}");
    // A recording without people would be the same everywhere, too.
    assert!(most >= 4, "{name} counts {most} at most");
    assert_eq!(follow(model, datagrams).0, tracks, "{name}, again");
}
