//! A floor before the first module, and what it reads of a person who walks.
//!
//! ```text
//!   module ◩ ▶      ┌─────────┐      2.1 m square, its middle 1.5 to 2.2 m ahead, turned by any angle
//!                   │  ▭   ▭  │
//!                   └─────────┘
//! ```

use kehai::floor::Floor;
use kehai_tracking::floor::{Plan, Reading};
use kehai_tracking::geometry::{Point, Pose};
use kehai_tracking::site::Site;
use kehai_tracking::site::floor::Floor as Mat;

use crate::floor::crowd::Crowd;
use crate::floor::panels::{Broken, reading};
use crate::run::Run;
use crate::world::random::{Purpose, Stream};

/// Panels along a side.
const SIDE: u8 = 26;

/// Side of a panel, m.
const PITCH_M: f64 = 0.08;

/// Half a side, m.
pub const HALF_M: f64 = 0.5 * SIDE as f64 * PITCH_M;

/// Between two readings, µs: 9 Hz.
const READING_US: u64 = 111_111;

/// The floor that a seed lays before a module.
pub fn before(module: &Pose, seed: u64) -> Mat {
    let mut stream = Stream::new(seed, Purpose::Network, [8, 0]);
    let yaw_rad = stream.between(-std::f64::consts::PI, std::f64::consts::PI);
    let at = module.to_site(Point::new(stream.between(1.5, 2.2), stream.between(-0.3, 0.3)));
    let corner = Pose { at, yaw_rad }.to_site(Point::new(-HALF_M, -HALF_M));
    Mat {
        name: "mat".into(),
        x: corner.x,
        y: corner.y,
        yaw_deg: yaw_rad.to_degrees(),
        columns: SIDE,
        rows: SIDE,
        pitch_m: PITCH_M,
    }
}

/// The middle of a floor whose outer corner is there.
pub fn middle(corner: &Pose) -> Point {
    corner.to_site(Point::new(HALF_M, HALF_M))
}

/// The floors of a site, under the people of a run.
pub struct Mats {
    /// Each one's state, and where it is.
    mats: Vec<(Floor, Plan)>,
    crowd: Crowd,
    next_us: u64,
}

impl Mats {
    /// Those of this site.
    pub fn new(site: &Site, people: usize) -> Self {
        let mat = |mat: &Mat| Some((Floor::new(mat.columns, mat.rows)?, Plan::from(mat)));
        let mats = site.floors.iter().filter_map(mat).collect();
        Self { mats, crowd: Crowd::new(people), next_us: READING_US }
    }

    /// What they read up to a time.
    pub fn until(&mut self, run: &Run, now_us: u64) -> Vec<Reading> {
        let mut readings = Vec::new();
        if self.mats.is_empty() {
            return readings;
        }
        while self.next_us <= now_us {
            self.crowd.follow(run.world().people(), self.next_us);
            let (soles, at_s) = (self.crowd.soles(), self.next_us as f64 * 1e-6);
            for (number, (floor, plan)) in self.mats.iter_mut().enumerate() {
                // As many bits as the floor has panels.
                let _ = floor.read(reading(plan, &soles, &Broken::default()).bytes(plan.panels()));
                let (down, faulty) = (floor.pressed(), Vec::new());
                readings.push(Reading { floor: number, plan: *plan, at_s, down, faulty });
            }
            self.next_us += READING_US;
        }
        readings
    }
}
