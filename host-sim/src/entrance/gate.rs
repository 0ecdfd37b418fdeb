//! The entrance with every kind of source, live on this PC: range finders, a depth camera, a floor, and tags that are read.
//!
//! ```text
//!   5.8 m ━━━━━━━━━━━━━━━━ ▽ tags ━━━━━━━━━━━━━━━━━━ right ◩ ━━━
//!              ┌ zone: entrance ────────────────┐
//!     hall     │        ┌──────────┐            │      street      y ◀──┐
//!      ◀──     │        │ mat      │            │       ◀──              ▼ x
//!              └────────└──────────┘────────────┘
//!   0 m   ━━ ◩ left ━━━━━━━ ◪ camera ━━━━━━━━━━━━━━━━━━━━━━━━━━━
//! ```
//!
//! `gate.toml` is its site.

use std::io;
use std::sync::Arc;

use kehai::floor::{Bits, Floor};
use kehai_emulator::pc::floor::Panels;
use kehai_emulator::urg::{Config, Urg};
use kehai_tracking::floor::Plan;
use kehai_tracking::site::Site;
use kehai_tracking::site::reader::Reads;

use super::lasers::Laser;
use super::live::DepthCamera;
use super::soles::Soles;
use super::tags::TagReader;
use super::walk::Moment;
use super::{CAMERA, Entrance};
use crate::devices::Devices;
use crate::floor::gait::Sole;
use crate::floor::panels::{Broken, reading};
use crate::world::geometry::{Point, Pose};

/// What it is, in a sentence.
pub const ABOUT: &str = "an entrance with two range finders, a depth camera, a floor of panels and a reader of tags; people come after \
                         20 s, two of three wear a tag";

/// At first the entrance is empty for so long, s: sixty scans at 5 a second are learned from, and the devices start.
const LEAD_S: f64 = 20.0;

/// People come for so long, s.
const LASTS_S: f64 = 1800.0;

/// The module that is a depth camera.
const DEPTH: &str = "camera";

/// Where the camera that reads tags is, m.
const TAG_CAMERA_M: (f64, f64) = (5.8, 0.0);

const SITE: &str = include_str!("gate.toml");

/// An entrance that people pass. It ends when it is dropped.
pub struct Gate {
    entrance: Arc<Entrance>,
    site: Site,
    devices: Devices,
    tags: TagReader,
}

impl Gate {
    /// Switches everything on, with modules that announce themselves.
    ///
    /// # Errors
    /// No port or thread is available.
    pub fn start(seed: u64) -> io::Result<Self> {
        let site = site()?;
        let frames = (LASTS_S * f64::from(CAMERA.frames_per_s)) as usize;
        let entrance = Arc::new(Entrance::lasting(seed, frames));
        let homography = site.readers.iter().find_map(|reader| match reader.reads {
            Reads::Pixels { homography, .. } => Some(homography),
            Reads::Near { .. } => None,
        });
        let at = Point::new(TAG_CAMERA_M.0, TAG_CAMERA_M.1);
        let tags = homography.and_then(|homography| TagReader::new(at, &homography, seed));
        let tags = tags.ok_or_else(|| io::Error::other("the site has no reader of tags"))?;
        let soles = entrance.soles(seed);
        let mut gate = Self { entrance, site, devices: Devices::new(true), tags };
        gate.modules(seed)?;
        for mat in gate.site.floors.clone() {
            let panels =
                Mat { entrance: Arc::clone(&gate.entrance), soles: soles.clone(), plan: Plan::from(&mat) };
            let floor = Floor::new(mat.columns, mat.rows);
            let floor = floor.ok_or_else(|| io::Error::other("the site's floor has too many panels"))?;
            gate.devices.floor(&mat.name, floor, panels)?;
        }
        Ok(gate)
    }

    fn modules(&mut self, seed: u64) -> io::Result<()> {
        let mut places = Vec::new();
        for (number, module) in (0..).zip(&self.site.modules) {
            // TCP knows no bit rate.
            let unpaced = |config| Config { paced: false, ..config };
            let (urg, sizes) = if module.name == DEPTH {
                let camera = DepthCamera::new(&self.entrance, LEAD_S);
                let camera = camera.ok_or_else(|| io::Error::other("the camera learns no background"))?;
                let (config, sizes) = (camera.config(), camera.sizes());
                (Urg::new(unpaced(config), Box::new(camera), 0), Some(sizes))
            } else {
                let pose = Pose { at: Point::new(module.x, module.y), yaw_rad: module.yaw_deg.to_radians() };
                let laser = Laser::new(Arc::clone(&self.entrance), LEAD_S, pose, (seed, number));
                let (config, phase_us) = laser.config();
                (Urg::new(unpaced(config), Box::new(laser), phase_us), None)
            };
            places.push((module.name.clone(), self.devices.sensor(&module.name, urg, |_| {})?, sizes));
        }
        for (name, place, sizes) in places {
            self.devices.module(&name, place, sizes.map(|sizes| sizes as _))?;
        }
        Ok(())
    }

    /// Its site.
    #[must_use]
    pub const fn site(&self) -> &Site {
        &self.site
    }

    /// Its devices.
    #[must_use]
    pub const fn devices(&self) -> &Devices {
        &self.devices
    }

    /// When it ends, s.
    #[must_use]
    pub const fn duration_s(&self) -> f64 {
        LEAD_S + LASTS_S
    }

    /// The people at a time, s since it began.
    #[must_use]
    pub fn people_at(&self, now_s: f64) -> Vec<Moment> {
        self.entrance.people_at(now_s - LEAD_S)
    }

    /// The camera that reads tags, and what shows it the people at a time, s since the devices began.
    pub fn tags(&self) -> (TagReader, impl Fn(f64) -> Vec<Moment> + Send + 'static) {
        let entrance = Arc::clone(&self.entrance);
        (self.tags.clone(), move |now_s| entrance.people_at(now_s - LEAD_S))
    }
}

pub(super) fn site() -> io::Result<Site> {
    Site::parse("gate.toml", SITE).map_err(io::Error::other)
}

/// The floor.
struct Mat {
    entrance: Arc<Entrance>,
    soles: Soles,
    plan: Plan,
}

impl Panels for Mat {
    fn read(&mut self, at_us: u64) -> Bits {
        let people = self.entrance.people_at(at_us as f64 * 1e-6 - LEAD_S);
        let soles: Vec<Sole> = people.iter().flat_map(|walker| self.soles.of(walker)).collect();
        reading(&self.plan, &soles, &Broken::default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_camera_that_reads_tags_sees_the_mat_and_says_where_a_tag_is() {
        let site = site().unwrap();
        let reads = site.readers[0].reads;
        let Reads::Pixels { homography, .. } = reads else { panic!("{reads:?}") };
        let mut reader = TagReader::new(Point::new(TAG_CAMERA_M.0, TAG_CAMERA_M.1), &homography, 1).unwrap();
        let entrance = Entrance::lasting(1, 500);
        let (mut read, mut wrong) = (0, 0);
        while reader.next_s() < 90.0 {
            let people = entrance.people_at(reader.next_s());
            for reading in reader.read(&people) {
                let at = reads.floor(reading.pixel.0, reading.pixel.1).unwrap();
                let wears = |one: &&Moment| super::super::tags::tag(one.person).as_ref() == Some(&reading.id);
                let bearer = people.iter().find(wears).expect("its bearer is there");
                read += 1;
                wrong += usize::from((bearer.at - at).length() > 0.4);
            }
        }
        assert!(read > 300 && wrong == 0, "{wrong} of {read}");
    }
}
