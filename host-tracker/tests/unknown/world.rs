//! A room with three modules of which some are lost now and then, and people who come and go; in a simulated time.
//!
//! ```text
//!                      far (0, 3)
//!                        ▽
//!          ┌─ hall ──────│─────┐                      zones: hall, desk in it; edge, half of it seen;
//!   left ▷ │ desk  front │  edge ┄┄┄┄│  ◁ right       yard, which no module sees
//!   (−2,0) └─────────────│─────┘      (2, 0)
//!                        ▲ people come from the south, below all zones
//! ```

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::Arc;

use kehai::candidate::Candidate;
use kehai_tracking::geometry::{Point, Pose};
use kehai_tracking::jsonl::TracksLine;
use kehai_tracking::lines::Totals;
use kehai_tracking::registry::Registry;
use kehai_tracking::site::Site;
use kehai_tracking::site_tracker::SiteTracker;

use super::fake::Fake;
use super::scene::{BEAMS, silhouettes};
use super::tracker::tracker;

/// Between two scans of a module, and between two snapshots, µs.
pub const TENTH_US: u64 = 100_000;

/// A datagram is on its way so long, µs.
const WAY_US: u64 = 300;

/// A person walks so far in a tenth of a second, m.
const STEP_M: f64 = 0.11;

/// Before the walls, which are 4 m from each module.
const SEEN_M: f64 = 3.8;

/// Where people come from: no module sees as far.
const OUTSIDE: Point = Point::new(0.2, -4.6);

/// What the site is at first.
pub const SITE: &str = r#"
[[module]]
name = "left"
x = -2.0
y = 0.0
[[module]]
name = "right"
x = 2.0
y = 0.0
yaw_deg = 180.0
[[module]]
name = "far"
x = 0.0
y = 3.0
yaw_deg = -90.0
[[zone]]
name = "hall"
polygon = [[-1.2, -1.2], [1.2, -1.2], [1.2, 1.2], [-1.2, 1.2]]
count = true
[[zone]]
name = "desk"
polygon = [[-1.2, -1.2], [0.0, -1.2], [0.0, 0.0], [-1.2, 0.0]]
count = true
[[zone]]
name = "edge"
polygon = [[0.4, -0.8], [4.0, -0.8], [4.0, 0.8], [0.4, 0.8]]
[[zone]]
name = "yard"
polygon = [[7.0, 0.0], [9.0, 0.0], [9.0, 2.0], [7.0, 2.0]]
[[line]]
name = "front"
from = [0.2, -1.0]
to = [0.2, 1.0]
"#;

/// Steele's `SplitMix64`.
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    pub const fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ mixed >> 31
    }

    /// From 0 on, less than `count`.
    pub const fn below(&mut self, count: u64) -> u64 {
        self.next() % count
    }

    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.below(1000) as f64 / 1000.0)
    }
}

/// A module.
#[derive(Debug)]
pub struct Module {
    pub fake: Fake,
    pub pose: Pose,
    /// It says nothing before this time, µs.
    pub silent_until_us: u64,
}

/// A person on the way to a place, who stays there or leaves.
#[derive(Clone, Copy, Debug)]
pub struct Person {
    at: Point,
    to: Point,
    is_leaving: bool,
}

pub struct World {
    pub registry: Registry,
    pub site_tracker: SiteTracker,
    pub modules: Vec<Module>,
    pub people: Vec<Person>,
    pub now_us: u64,
}

fn address(number: usize) -> SocketAddr {
    SocketAddr::from(([192, 168, 7, number as u8 + 1], 4040))
}

impl World {
    pub fn new(site: &Arc<Site>) -> Self {
        let module = |(number, module): (usize, &kehai_tracking::site::Module)| {
            let name = ["left", "right", "far"][number];
            let offset_us = (1 << 33) + 6_000_000 * number as i64;
            let fake = Fake { offset_us, parts: BEAMS, ..Fake::new(number as u8 + 1, 57, name) };
            Module { fake, pose: module.pose(), silent_until_us: 0 }
        };
        let modules: Vec<Module> = site.modules.iter().enumerate().map(module).collect();
        let addresses: Vec<SocketAddr> = (0..modules.len()).map(address).collect();
        Self {
            registry: Registry::new(Arc::clone(site), &addresses),
            site_tracker: SiteTracker::new(site, tracker()),
            modules,
            people: Vec::new(),
            now_us: 10_000_000,
        }
    }

    /// A tracker that begins, with what is taken back of the one before.
    pub fn begin(
        &mut self,
        site: &Arc<Site>,
        restored: Option<&(TracksLine, f64)>,
        lines: &BTreeMap<String, Totals>,
    ) {
        let addresses: Vec<SocketAddr> = (0..self.modules.len()).map(address).collect();
        self.registry = Registry::new(Arc::clone(site), &addresses);
        self.site_tracker = SiteTracker::new(site, tracker());
        if let Some((line, age_s)) = restored {
            self.site_tracker.restore(line, *age_s);
        }
        self.site_tracker.restore_lines(lines);
    }

    pub fn change_site(&mut self, site: &Arc<Site>) {
        // A module that was moved in the site was moved in the room.
        for module in &mut self.modules {
            let placed = site.modules.iter().find(|placed| placed.name == module.fake.name);
            module.pose = placed.map_or(module.pose, kehai_tracking::site::Module::pose);
        }
        self.site_tracker.change_site(site);
        self.registry.change_site(site, self.site_tracker.sessions_mut());
    }

    pub fn comes(&mut self, random: &mut Random) {
        let to = Point::new(random.within(-1.1, 1.5), random.within(-1.1, 1.1));
        self.people.push(Person { at: OUTSIDE, to, is_leaving: false });
    }

    pub fn moves(&mut self, random: &mut Random) {
        let (x, y) = (random.within(-1.1, 1.5), random.within(-1.1, 1.1));
        if let Some(person) = self.people.first_mut() {
            person.to = Point::new(x, y);
        }
    }

    pub fn leaves(&mut self) {
        if let Some(person) = self.people.iter_mut().find(|person| !person.is_leaving) {
            (person.to, person.is_leaving) = (OUTSIDE, true);
        }
    }

    /// People walk for a tenth of a second.
    pub fn walk(&mut self) {
        for person in &mut self.people {
            let way = person.to - person.at;
            let share = (STEP_M / way.length().max(STEP_M)).min(1.0);
            person.at = person.at + way * share;
        }
        self.people.retain(|person| !(person.is_leaving && (person.at - OUTSIDE).length() < STEP_M));
    }

    /// A tenth of a second: people walk, the tracker asks, each module that is there answers and reports a scan.
    pub fn tenth(&mut self) {
        self.walk();
        let mut sent: Vec<(Vec<u8>, SocketAddr)> = Vec::new();
        let sessions = self.site_tracker.sessions_mut();
        self.registry.poll(sessions, self.now_us, |bytes, to| sent.push((bytes.to_vec(), to)));
        let end_us = self.now_us + TENTH_US;
        self.ask(sent);
        let scan_us = end_us - TENTH_US;
        for number in 0..self.modules.len() {
            let module = &mut self.modules[number];
            if self.now_us < module.silent_until_us {
                continue;
            }
            module.fake.sequence = module.fake.sequence.wrapping_add(1);
            let seen = seen(&self.people, module.pose);
            let fake = &module.fake;
            let report = fake.reported_with(fake.sequence, fake.clock_us(scan_us), &seen);
            self.hear(number, &report);
        }
        self.now_us = end_us;
    }

    /// Time passes, and the tracker sleeps: what arrives meanwhile is lost.
    pub fn pass(&mut self) {
        self.walk();
        self.now_us += TENTH_US;
    }

    fn ask(&mut self, mut sent: Vec<(Vec<u8>, SocketAddr)>) {
        while let Some((request, to)) = sent.pop() {
            let Some(number) = (0..self.modules.len()).find(|number| address(*number) == to) else {
                continue;
            };
            self.now_us += WAY_US;
            let module = &self.modules[number];
            if self.now_us < module.silent_until_us {
                continue;
            }
            let t2_us = module.fake.clock_us(self.now_us);
            let answers = module.fake.answers(&request, t2_us);
            self.now_us += WAY_US;
            for answer in answers {
                sent.extend(self.hear(number, &answer));
            }
        }
    }

    /// A datagram arrives; what is asked for in turn.
    fn hear(&mut self, number: usize, bytes: &[u8]) -> Vec<(Vec<u8>, SocketAddr)> {
        let (from, now_us) = (address(number), self.now_us);
        let sessions = self.site_tracker.sessions_mut();
        let Some(datagram) = sessions.decode(bytes) else { return Vec::new() };
        if !self.registry.knows(from) || !self.registry.admit(from, &datagram, sessions, now_us).is_used {
            return Vec::new();
        }
        let observation = self.site_tracker.follow(&datagram, now_us);
        let mut sent = Vec::new();
        let sessions = self.site_tracker.sessions_mut();
        let send = |bytes: &[u8], to| sent.push((bytes.to_vec(), to));
        self.registry.heard(from, &datagram, observation, sessions, now_us, send);
        sent
    }
}

/// The people seen from there: walls are 4 m away, and hide those behind them.
fn seen(people: &[Person], pose: Pose) -> Vec<Candidate> {
    let near = people.iter().map(|person| person.at).filter(|at| (*at - pose.at).length() < SEEN_M);
    silhouettes(near, pose, BEAMS)
}
