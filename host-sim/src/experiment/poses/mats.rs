//! A floor before the first module, and what it reads of a person who walks.
//!
//! ```text
//!   module ◩ ▶      ┌─────────┐      2.1 m square, its middle 1.5 to 2.2 m ahead, turned by any angle
//!                   │  ▭   ▭  │
//!                   └─────────┘
//! ```

use kehai::floor::READING_US;
use kehai_tracking::floor::Reading;
use kehai_tracking::geometry::{Point, Pose};
use kehai_tracking::site::Site;
use kehai_tracking::site::floor::Floor as Mat;

use crate::floor::crowd::Crowd;
use crate::floor::panels::{FloorReader, PITCH_M};
use crate::run::Run;
use crate::world::random::{Purpose, Stream};

/// Panels along a side.
const SIDE: u8 = 26;

/// Half a side, m.
pub const HALF_M: f64 = 0.5 * SIDE as f64 * PITCH_M;

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
    readers: Vec<FloorReader>,
    crowd: Crowd,
    next_us: u64,
}

impl Mats {
    /// Those of this site.
    pub fn new(site: &Site, people: usize) -> Self {
        Self { readers: FloorReader::all(site), crowd: Crowd::new(people), next_us: READING_US }
    }

    /// What they read up to a time.
    pub fn until(&mut self, run: &Run, now_us: u64) -> Vec<Reading> {
        let mut readings = Vec::new();
        if self.readers.is_empty() {
            return readings;
        }
        while self.next_us <= now_us {
            self.crowd.follow(run.world().people(), self.next_us);
            let (soles, at_s) = (self.crowd.soles(), self.next_us as f64 * 1e-6);
            readings.extend(self.readers.iter_mut().map(|reader| reader.read(&soles, at_s)));
            self.next_us += READING_US;
        }
        readings
    }
}
