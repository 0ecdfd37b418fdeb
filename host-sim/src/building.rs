//! A simulated building, live: every module of a scene on this PC, in real time.
//!
//! ```text
//!   world ─┬─▶ emulated sensor of each module ─▶ `devices` ──UDP──▶ any tracker
//!          └─▶ feet on the panels of floors ──────┘
//! ```

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;

use kehai::floor::{Bits, Floor};
use kehai_emulator::pc::floor::Panels;
use kehai_emulator::serve::Status;
use kehai_emulator::urg::{Config, Urg};
use kehai_tracking::floor::Plan;

use crate::devices::Devices;
use crate::floor::crowd::Crowd;
use crate::floor::panels::{Broken, reading};
use crate::world::World;
use crate::world::person::Person;
use crate::world::scene::Scene;

/// Called after every turn of a sensor's loop, with the number of its module in the site and the sensor's status.
pub type Watch = Arc<dyn Fn(usize, &Status) + Send + Sync>;

/// A building in which people walk. It ends when it is dropped.
pub struct Building {
    world: World,
    devices: Devices,
}

impl Building {
    /// Switches everything on.
    ///
    /// # Errors
    /// No port or thread is available.
    pub fn start(scene: &Scene, seed: u64) -> io::Result<Self> {
        Self::switched_on(scene, seed, &unwatched(), false)
    }

    /// As [`start`](Self::start), with modules that announce themselves.
    ///
    /// # Errors
    /// As there.
    pub fn announced(scene: &Scene, seed: u64) -> io::Result<Self> {
        Self::switched_on(scene, seed, &unwatched(), true)
    }

    /// As [`start`](Self::start); `watch` is called with the states of the sensors.
    ///
    /// # Errors
    /// As there.
    pub fn watched(scene: &Scene, seed: u64, watch: &Watch) -> io::Result<Self> {
        Self::switched_on(scene, seed, watch, false)
    }

    fn switched_on(scene: &Scene, seed: u64, watch: &Watch, announced: bool) -> io::Result<Self> {
        let world = World::new(scene, seed);
        let mut devices = Devices::new(announced);
        let mut places = Vec::new();
        for (number, (name, sensor)) in world.sensors().iter().cloned().enumerate() {
            let phase_us = sensor.clock().phase_us;
            // TCP knows no bit rate.
            let config = Config { paced: false, ..sensor.config() };
            let watch = Arc::clone(watch);
            let urg = Urg::new(config, Box::new(sensor), phase_us);
            let place = devices.sensor(&name, urg, move |status| watch(number, status))?;
            places.push((name, place));
        }
        for (name, place) in places {
            devices.module(&name, place, None)?;
        }
        for mat in &scene.site.floors {
            let floor = Floor::new(mat.columns, mat.rows);
            let floor = floor.ok_or_else(|| io::Error::other("a floor of the site has too many panels"))?;
            let people = world.people().to_vec();
            let crowd = Crowd::new(people.len());
            devices.floor(&mat.name, floor, Under { people, crowd, plan: Plan::from(mat) })?;
        }
        Ok(Self { world, devices })
    }

    /// Names of the modules and the floors in the site, and where they listen.
    #[must_use]
    pub fn modules(&self) -> &[(String, SocketAddr)] {
        self.devices.listed()
    }

    /// The world.
    #[must_use]
    pub const fn world(&self) -> &World {
        &self.world
    }

    /// Time since it began, s: the world's.
    #[must_use]
    pub fn now_s(&self) -> f64 {
        self.devices.now_s()
    }
}

/// A floor under the people of a world.
struct Under {
    people: Vec<Person>,
    crowd: Crowd,
    plan: Plan,
}

impl Panels for Under {
    fn read(&mut self, at_us: u64) -> Bits {
        self.crowd.follow(&self.people, at_us);
        reading(&self.plan, &self.crowd.soles(), &Broken::default())
    }
}

fn unwatched() -> Watch {
    Arc::new(|_: usize, _: &Status| {})
}
