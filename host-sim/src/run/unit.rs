//! A simulated node: one sensor, its device and the host's side of the session, on a simulated time of its own.
//!
//! ```text
//!   world ─▶ Witness ─▶ Urg ─▶ SCIP bytes ─▶ Driver ─▶ tasks::run ─▶ Way ─▶ Host ─▶ arrivals
//!               └─▶ beams on people           └── the very code of the board ──┘
//! ```
//!
//! Modules share nothing but the world, which is a pure function of the time; so each runs by itself, and
//! what arrives at the host is put in order afterwards.

use std::cell::RefCell;
use std::future::Future;
use std::pin::Pin;
use std::rc::Rc;
use std::sync::Arc;

use embassy_futures::join::join;
use embassy_futures::select::{Either, select};
use kehai::centre::Estimator;
use kehai::device::starts::ShortStarts;
use kehai::device::{About, Module};
use kehai::scan::MAX_BEAMS;
use kehai::sensor::{Driver, LineSettings};
use kehai::store::flash::FlashStore;
use kehai::tasks::{self, Hardware, Notices};
use kehai::wire::ModuleId;
use parking_lot::Mutex;

use super::clock::ModuleClock;
use super::network::Conditions;
use super::way::Way;
use crate::world::random::{Purpose, Stream};
use crate::world::sensor::WorldSensor;
use kehai_emulator::link::{LinkOptions, MemoryLink};
use kehai_emulator::pc::Fed;
use kehai_emulator::pc::amended::{Amend, Amended};
use kehai_emulator::pc::flash::{Flash, PAGE_LEN};
use kehai_emulator::simulated_time::{SimulatedClock, Stuck, block_on_until};
use kehai_emulator::source::{RangeSource, Revolution, SensorGeometry, SourceScan};
use kehai_emulator::urg::{Config, Urg};
use kehai_tracking::session::datagram::Datagram;
use kehai_tracking::session::subscription::Subscription;
use kehai_tracking::session::{Placement, Session};
use kehai_tracking::snapshot::Drops;

/// Pages of a module's store.
const PAGES: usize = 8;
/// Bytes a read of the sensor's line waits for: the driver's own chunk.
const CHUNK_BYTES: usize = 256;

/// How many beams of a scan met each person.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Sight {
    /// When the mirror was at its front, in µs of the world.
    pub at_us: u64,
    /// Beams on each person, in the order of the world's people.
    pub beams: Vec<u32>,
}

/// The latest scans of one sensor, oldest first.
pub type Sights = Arc<Mutex<Vec<Sight>>>;

/// A sensor of the world that keeps the beams on each person, for the truth.
pub struct Witness {
    /// The sensor.
    pub sensor: WorldSensor,
    /// Beams on each person, shared with the [`Unit`].
    pub sights: Sights,
}

impl RangeSource for Witness {
    fn geometry(&self) -> SensorGeometry {
        self.sensor.geometry()
    }

    fn scan(&mut self, revolution: Revolution) -> Option<SourceScan> {
        let (scan, beams) = self.sensor.observe(revolution);
        let at_us = revolution.start_us + u64::from(revolution.period_us) / 2;
        self.sights.lock().push(Sight { at_us, beams });
        Some(scan)
    }
}

/// The identity of module number `index` of a site.
#[must_use]
pub fn module_id(index: usize) -> ModuleId {
    let [.., high, low] = (index as u64 + 1).to_be_bytes();
    ModuleId([0x02, 0x6b, 0x65, 0x68, high, low])
}

/// Parts of a [`Unit`].
pub struct Plan {
    /// Number in the site.
    pub index: usize,
    /// Name in the site.
    pub name: String,
    /// What its sensor measures, and the sensor: `phase_us` is when its mirror passes the front first.
    pub source: Box<dyn RangeSource>,
    pub config: Config,
    pub phase_us: u64,
    /// Beams on each person, if the source counts them.
    pub sights: Sights,
    /// Content of the module's flash at its start.
    pub flash: Flash,
    /// The network, and how clocks run.
    pub conditions: Conditions,
    /// Seed of all that is random.
    pub seed: u64,
    /// What adds to its datagrams.
    pub amend: Option<Arc<dyn Amend>>,
    /// When the module has no power, in µs of the world.
    pub outages_us: Vec<(u64, u64)>,
}

/// Datagrams and when they arrived at the host, in µs of its clock.
type Arrivals = Rc<RefCell<Vec<(u64, Vec<u8>)>>>;

/// A sensor with its module.
pub struct Unit {
    clock: SimulatedClock,
    life: Pin<Box<dyn Future<Output = ()>>>,
    arrivals: Arrivals,
    sights: Sights,
}

impl Unit {
    /// Everything switched on at its own moment.
    #[must_use]
    pub fn new(plan: Plan) -> Self {
        let clock = SimulatedClock::new();
        let arrivals = Arrivals::default();
        let mut stream = Stream::new(plan.seed, Purpose::Network, [plan.index as u64, 0]);
        let start_us = stream.between(0.0, plan.conditions.start_spread_us) as u64;
        let fast_ppm = stream.between(-plan.conditions.drift_ppm, plan.conditions.drift_ppm) as i32;
        let way = Way::new(&clock, plan.conditions, stream);
        let host = converse(clock.clone(), way.clone(), module_id(plan.index), arrivals.clone());
        let paced = plan.config.paced;
        let options = LinkOptions { chunk_bytes: CHUNK_BYTES, ..LinkOptions::default() };
        let board = Board {
            index: plan.index,
            name: plan.name,
            link: MemoryLink::new(&clock, Urg::new(plan.config, plan.source, plan.phase_us), options),
            line: if paced {
                LineSettings::Serial { last_baud: None, wanted_baud: None, fastest_baud: 750_000 }
            } else {
                LineSettings::NoSpeed
            },
            clock: clock.clone(),
            flash: plan.flash,
            way,
            amend: plan.amend,
            start_us,
            fast_ppm,
            outages_us: plan.outages_us,
        };
        let life = Box::pin(async move {
            join(host, board.live()).await;
        });
        Self { clock, life, arrivals, sights: plan.sights }
    }

    /// Simulates up to `until_us`, and returns the datagrams that arrived.
    ///
    /// # Errors
    /// [`Stuck`]: a fault of the simulation.
    pub fn advance(&mut self, until_us: u64) -> Result<Vec<(u64, Vec<u8>)>, Stuck> {
        match block_on_until(&self.clock, until_us, self.life.as_mut()) {
            Ok(()) | Err(Stuck::Late { .. }) => Ok(std::mem::take(&mut *self.arrivals.borrow_mut())),
            Err(stuck) => Err(stuck),
        }
    }

    /// Reads the scans kept so far; those older than `since_us` are dropped.
    pub fn with_sights<T>(&self, since_us: u64, look: impl FnOnce(&[Sight]) -> T) -> T {
        let mut sights = self.sights.lock();
        let old = sights.partition_point(|sight| sight.at_us < since_us);
        sights.drain(..old);
        look(&sights)
    }
}

/// The host's side; never returns. Only its requests matter here: it does not use the reports.
async fn converse(clock: SimulatedClock, way: Way, device: ModuleId, arrivals: Arrivals) {
    let mut session = Session::new(device, Subscription::default());
    let placement = Placement { site: Arc::default(), estimator: Estimator::default() };
    let mut drops = Drops::default();
    loop {
        session.poll(clock.now_us(), |datagram| way.send_to_module(datagram));
        let time = kehai::link::Clock::wait_until(&clock, session.next_us());
        if let Either::First(bytes) = select(way.arrived_at_host(), time).await {
            let now_us = clock.now_us();
            if let Ok(datagram) = Datagram::decode(&bytes) {
                session.receive(&datagram, now_us, &placement, &mut drops);
                session.poll(now_us, |datagram| way.send_to_module(datagram));
            }
            arrivals.borrow_mut().push((now_us, bytes));
        }
    }
}

/// Flash with nothing in it.
#[must_use]
pub fn empty_flash() -> Flash {
    Flash::new(PAGES)
}

/// The store in a module's flash.
#[must_use]
pub fn store(flash: &Flash) -> Option<FlashStore<Flash>> {
    FlashStore::new(flash.clone(), 0..(PAGES * PAGE_LEN) as u32)
}

/// A module's hardware, which outlives its starts.
struct Board {
    index: usize,
    name: String,
    link: MemoryLink,
    line: LineSettings,
    clock: SimulatedClock,
    flash: Flash,
    way: Way,
    amend: Option<Arc<dyn Amend>>,
    start_us: u64,
    fast_ppm: i32,
    outages_us: Vec<(u64, u64)>,
}

impl Board {
    /// The device, from one power cut to the next; never returns.
    async fn live(self) {
        let mut on_us = self.start_us;
        for &(off_us, again_us) in &self.outages_us {
            kehai::link::Clock::wait_until(&self.clock, on_us).await;
            self.way.drop_arrived();
            select(self.starts(), kehai::link::Clock::wait_until(&self.clock, off_us)).await;
            on_us = again_us;
        }
        kehai::link::Clock::wait_until(&self.clock, on_us).await;
        self.way.drop_arrived();
        self.starts().await;
    }

    /// Starts the module again after each restart, while it has power.
    async fn starts(&self) {
        while let Some(store) = store(&self.flash) {
            self.start(store).await;
        }
    }

    async fn start(&self, mut store: FlashStore<Flash>) {
        let clock = ModuleClock::new(&self.clock, self.clock.now_us(), self.fast_ppm);
        let mut module = Box::new(Module::<MAX_BEAMS>::new(About {
            module: module_id(self.index),
            secret: [self.index as u8; 16],
            firmware: env!("CARGO_PKG_VERSION"),
            build: "simulated",
            board: "simulated",
            watchdog_reset: false,
        }));
        tasks::begin(&mut store, &mut module, ShortStarts::default()).await;
        module.rename(&self.name);
        let settings = module.settings().sensor(self.line);
        let mut driver = Box::new(Driver::<_, _, MAX_BEAMS>::new(self.link.clone(), clock.clone(), settings));
        let hardware = Hardware {
            driver: &mut driver,
            line: self.line,
            datagrams: Amended::new(self.way.clone(), self.amend.clone()),
            store,
            watchdog: Fed::default(),
            clock,
            notices: &Notices::new(),
        };
        tasks::run(&mut module, hardware).await;
    }
}
