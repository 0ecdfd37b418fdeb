//! A whole scene in memory, faster than real time: what a tracker would receive, and the truth beside it.
//!
//! ```text
//!   world ─▶ sensors ─▶ SCIP bytes ─▶ drivers ─▶ pipelines ─▶ datagrams ─▶ network ─▶ Arrival …
//!     └───────────────────────────────────────────────────────────────────────────▶ Moment …
//! ```
//!
//! Every module runs the tasks of the firmware beside an emulated sensor. A simulated host subscribes to each of
//! them with its own clock as T1, renews every second, and asks for info and the background profile; so all that
//! a tracker needs, clock exchanges (T1 in the datagram, T2, T3, and T4 = [`Arrival::at_us`]) included,
//! is in the datagrams. The host's clock is the world's; modules have their own. The same scene, seed and
//! [`Options`] give the same bytes.
//!
//! ```no_run
//! use host_sim::run::{Options, Run};
//! use host_sim::world::scene::Scene;
//! use host_sim::world::variation::Variation;
//!
//! let mut scene = Scene::load("door-area")?;
//! scene.vary(&Variation { people: Some(5), ..Variation::default() })?;
//! let mut run = Run::new(&scene, 10_000, &Options::default());
//! for tick in 0..(run.world().duration_s() * 10.0) as u64 {
//!     for arrival in run.until(tick * 100_000)? {
//!         // tracker.receive(arrival.at_us, &arrival.bytes);
//!     }
//!     let truth = run.moment(tick * 100_000);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | file | what |
//! |---|---|
//! | `unit` | a simulated node: one sensor, its device, and the host's side of the session |
//! | `way`, `network` | the channel between device and host: delay, loss, duplication, reordering |
//! | `clock` | a module's own clock |
//! | `record` | a whole run to and from a file |
//! | `recorded` | recordings in the place of a world |
//! | `copies` | many copies of a site, to measure the cost of a tracker |
//! | `scans` | what the sensors of a world measure, as recordings |
//! | `lines` | candidates, tracks and truth as JSON lines |

pub mod clock;
mod copies;
mod lines;
pub mod network;
pub mod record;
pub mod recorded;
mod scans;
pub(crate) mod unit;
mod way;

pub use network::Conditions;
pub use record::Record;
pub use scans::scans;
pub use unit::module_id;

use serde::{Deserialize, Serialize};

use crate::world::World;
use crate::world::scene::Scene;
use crate::world::sensor::WorldSensor;
use kehai_emulator::simulated_time::Stuck;
use unit::{Plan, Sights, Unit, Witness, empty_flash};

/// Time between two lines of truth, and of tracks.
pub const TICK_US: u64 = 100_000;

/// Scans up to this old decide whether a person is seen, µs.
pub const SIGHT_US: u64 = 200_000;

/// A datagram that reached the host.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Arrival {
    /// When, in µs of the host's clock, which is the world's.
    pub at_us: u64,
    /// Number of its module in the site; the datagram itself says the module's identity.
    pub module: u16,
    /// The datagram.
    pub bytes: Vec<u8>,
}

/// A module of a run.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct ModuleName {
    /// Name in the site, also in its info.
    pub name: String,
    /// Its identity on the wire.
    pub id: [u8; 6],
}

/// Truth at one moment: a line of `truth.jsonl`.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Moment {
    /// Time in seconds of the host's clock.
    pub t: f64,
    /// All people in the world.
    pub people: Vec<SeenPerson>,
}

/// One person of a [`Moment`], in the site's frame.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct SeenPerson {
    /// Number in the scene, from 1.
    pub id: u32,
    /// Middle of the torso, in metres.
    pub x: f64,
    /// Middle of the torso, in metres.
    pub y: f64,
    /// The most beams that met them in one scan of one sensor within the last 0.2 s.
    pub beams: u32,
}

/// A power cut.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Outage {
    /// Number of the module in the site.
    pub module: usize,
    /// When it begins.
    pub from_s: f64,
    /// When the module starts anew; never, by default.
    pub until_s: Option<f64>,
}

/// How a scene is run.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Options {
    /// The network and the clocks.
    pub conditions: Conditions,
    /// Modules that lose their power, in order of time.
    pub outages: Vec<Outage>,
}

/// A scene that is being run.
pub struct Run {
    world: World,
    units: Vec<Unit>,
    modules: Vec<ModuleName>,
    arrivals: Vec<Arrival>,
}

impl Run {
    /// The scene under `seed`, at time 0.
    #[must_use]
    pub fn new(scene: &Scene, seed: u64, options: &Options) -> Self {
        Self::of(World::new(scene, seed), seed, options)
    }

    /// A world under `seed`, at time 0.
    #[must_use]
    pub fn of(world: World, seed: u64, options: &Options) -> Self {
        let outages_us = |index: usize| {
            let own = options.outages.iter().filter(move |outage| outage.module == index);
            let us = |time_s: f64| (time_s.max(0.0) * 1e6) as u64;
            own.map(|outage| (us(outage.from_s), outage.until_s.map_or(u64::MAX, us))).collect()
        };
        let unit = |(index, (name, sensor)): (usize, &(String, WorldSensor))| {
            let sights = Sights::default();
            Unit::new(Plan {
                index,
                name: name.clone(),
                config: sensor.config(),
                phase_us: sensor.clock().phase_us,
                source: Box::new(Witness { sensor: sensor.clone(), sights: sights.clone() }),
                sights,
                flash: empty_flash(),
                amend: None,
                conditions: options.conditions,
                seed,
                outages_us: outages_us(index),
            })
        };
        let units = world.sensors().iter().enumerate().map(unit).collect();
        let module = |(index, (name, _)): (usize, &(String, _))| ModuleName {
            name: name.clone(),
            id: module_id(index).0,
        };
        let modules = world.sensors().iter().enumerate().map(module).collect();
        Self { world, units, modules, arrivals: Vec::new() }
    }

    /// The world it runs in: duration, events, people, sensors.
    #[must_use]
    pub const fn world(&self) -> &World {
        &self.world
    }

    /// The modules, in the order of the site.
    #[must_use]
    pub fn modules(&self) -> &[ModuleName] {
        &self.modules
    }

    /// Lets time pass up to `until_us`; everything that arrived meanwhile, in order of arrival.
    ///
    /// # Errors
    /// [`Stuck`]: a fault of the simulation.
    pub fn until(&mut self, until_us: u64) -> Result<Vec<Arrival>, Stuck> {
        for (module, unit) in (0..).zip(&mut self.units) {
            let arrived = unit.advance(until_us)?;
            self.arrivals.extend(arrived.into_iter().map(|(at_us, bytes)| Arrival { at_us, module, bytes }));
        }
        // The sort keeps what arrived at the same time in the order of modules.
        self.arrivals.sort_by_key(|arrival| arrival.at_us);
        Ok(std::mem::take(&mut self.arrivals))
    }

    /// When the mirror of a module's sensor was at its front in the scans that are kept: those since the last
    /// [`moment`](Self::moment), and of 0.2 s before; µs of the world.
    #[must_use]
    pub fn fronts_us(&self, module: usize) -> Vec<u64> {
        let fronts = |sights: &[unit::Sight]| sights.iter().map(|sight| sight.at_us).collect();
        self.units.get(module).map(|unit| unit.with_sights(0, fronts)).unwrap_or_default()
    }

    /// Truth at `at_us`, which must be the time of the last [`until`](Self::until), and must not decrease.
    #[must_use]
    pub fn moment(&self, at_us: u64) -> Moment {
        let truth = self.world.truth(at_us as f64 * 1e-6);
        let since_us = at_us.saturating_sub(SIGHT_US);
        let mut beams = vec![0; self.world.people().len()];
        for unit in &self.units {
            unit.with_sights(since_us, |sights| {
                for sight in sights.iter().filter(|sight| sight.at_us <= at_us) {
                    for (most, beams) in beams.iter_mut().zip(&sight.beams) {
                        *most = (*most).max(*beams);
                    }
                }
            });
        }
        let with_beams = |person: crate::world::TruePerson| SeenPerson {
            id: person.id as u32,
            x: person.x,
            y: person.y,
            beams: person.id.checked_sub(1).and_then(|index| beams.get(index)).copied().unwrap_or(0),
        };
        Moment { t: truth.t, people: truth.people.into_iter().map(with_beams).collect() }
    }
}
