//! A simulated building, live: every module of a scene on this PC, in real time.
//!
//! ```text
//!   world ─▶ emulated sensor ──TCP, SCIP──▶ driver ─▶ pipeline ──UDP──▶ any tracker
//!              a thread each                  a thread each: the tasks of the firmware
//! ```
//!
//! The world's time begins with the building, for every sensor as soon as its thread runs: within a millisecond
//! or two. Modules are announced by DNS-SD if that is asked for, to this machine alone; their addresses are known
//! anyway.

use std::error::Error;
use std::io;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, TcpListener};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::thread::{Builder, JoinHandle};
use std::time::Instant;

use crate::world::World;
use crate::world::scene::Scene;
use crate::world::sensor::WorldSensor;
use kehai_emulator::pc::device::{Beside, PAGES, Pc};
use kehai_emulator::pc::flash::Flash;
use kehai_emulator::pc::line::Place;
use kehai_emulator::pc::reactor::Reactor;
use kehai_emulator::pc::udp::Udp;
use kehai_emulator::serve::{Control, Status, serve_tcp};
use kehai_emulator::urg::{Config, Urg};

/// A port that the system chooses, for this machine alone.
const ANY_PORT: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 0);

/// Called after every turn of a sensor's loop, with the number of its module in the site and the sensor's status.
pub type Watch = Arc<dyn Fn(usize, &Status) + Send + Sync>;

/// A building in which people walk. It ends when it is dropped.
pub struct Building {
    world: World,
    begun: Instant,
    modules: Vec<(String, SocketAddr)>,
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
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
        let stop = Arc::new(AtomicBool::new(false));
        let mut building =
            Self { begun: Instant::now(), modules: Vec::new(), stop, threads: Vec::new(), world };
        let sensors = building.world.sensors().to_vec();
        let mut places = Vec::new();
        for (number, (name, sensor)) in sensors.into_iter().enumerate() {
            let listener = TcpListener::bind(ANY_PORT)?;
            places.push((name.clone(), Place::Tcp(listener.local_addr()?.to_string())));
            let (stop, watch) = (Arc::clone(&building.stop), Arc::clone(watch));
            building.threads.push(Builder::new().name(format!("sensor {name}")).spawn(move || {
                measure(&name, &listener, sensor, &stop, &mut |status| watch(number, status));
            })?);
        }
        for (name, place) in places {
            let address = building.module(&name, place, announced)?;
            building.modules.push((name, address));
        }
        Ok(building)
    }

    /// Switches a module on, and says where it listens.
    fn module(&mut self, name: &str, sensor: Place, announced: bool) -> io::Result<SocketAddr> {
        let (listening, listens) = mpsc::channel();
        let stop = Arc::clone(&self.stop);
        let own_name = name.to_owned();
        self.threads.push(Builder::new().name(format!("module {name}")).spawn(move || {
            let port = match Udp::bind(ANY_PORT, &Reactor::new()) {
                Ok(port) => port,
                Err(error) => return drop(listening.send(Err(error))),
            };
            let _ = listening.send(port.local_addr());
            if let Err(error) = live(&own_name, &sensor, &port, announced, &stop) {
                tracing::error!("module {own_name} has ended: {error}");
            }
        })?);
        listens.recv().unwrap_or_else(|_| Err(io::Error::other("the module's thread has failed")))
    }

    /// Names of the modules in the site, and where they listen.
    #[must_use]
    pub fn modules(&self) -> &[(String, SocketAddr)] {
        &self.modules
    }

    /// The world.
    #[must_use]
    pub const fn world(&self) -> &World {
        &self.world
    }

    /// Time since it began, s: the world's.
    #[must_use]
    pub fn now_s(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }
}

impl Drop for Building {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // A thread that has panicked has already printed its message.
            let _ = thread.join();
        }
    }
}

fn unwatched() -> Watch {
    Arc::new(|_: usize, _: &Status| {})
}

fn measure(
    name: &str,
    listener: &TcpListener,
    sensor: WorldSensor,
    stop: &AtomicBool,
    on_status: &mut dyn FnMut(&Status),
) {
    let phase_us = sensor.clock().phase_us;
    // TCP knows no bit rate.
    let config = Config { paced: false, ..sensor.config() };
    let urg = Urg::new(config, Box::new(sensor), phase_us);
    let mut control = Control { stop, on_status };
    if let Err(error) = serve_tcp(listener, urg, &mut control) {
        tracing::error!("sensor {name} has ended: {error}");
    }
}

/// Start after start, until everything ends.
fn live(
    name: &str,
    sensor: &Place,
    port: &Udp,
    announced: bool,
    stop: &AtomicBool,
) -> Result<(), Box<dyn Error>> {
    let flash = Flash::new(PAGES);
    let pc = Pc {
        beside: Beside::Sensor,
        sensor,
        port,
        flash: &flash,
        name: Some(name),
        unique: None,
        announced,
        amend: None,
    };
    while !stop.load(Ordering::Relaxed) {
        pc.start(stop, |_| {})?;
    }
    Ok(())
}
