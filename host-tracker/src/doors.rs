//! The doors of a running tracker: shared by the tracking loop, the sources of messages, and a watchdog.
//!
//! ```text
//!   tracking loop ─ observe, before each snapshot ─▶ ╭───────╮ ─▶ lines      for that snapshot
//!   HTTP, MQTT ──── tell, post ────────────────────▶ │ doors │ ─▶ outputs    each one: lock, alarm, passage
//!   watchdog ────── pass_time, every 50 ms ────────▶ ╰───────╯
//! ```
//!
//! Each of them holds the lock for some microseconds. The watchdog makes trouble of a dead tracking loop.

use std::collections::hash_map::RandomState;
use std::hash::BuildHasher;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use parking_lot::{Mutex, MutexGuard};

use crate::clock::HostClock;
use crate::store::card::plain;
use crate::supervise::Worker;
use crate::tracker_alarms::TrackerAlarms;
use kehai_tracking::alarm_list::ListedAlarm;
use kehai_tracking::door::doors::{DoorState, Doors, InUse, Output, Watcher, Why};
use kehai_tracking::door::inbox::Input;
use kehai_tracking::door::machine::DoorLine;
use kehai_tracking::door::{Card, LockOrder};
use kehai_tracking::estimate::Estimate;
use kehai_tracking::now::Now;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{ModuleLine, unix_ms};

/// Between two times that the watchdog passes to the doors: a twentieth of the time without tracks that is trouble.
const WATCH: Duration = Duration::from_millis(50);

/// Makes of a card what may be kept of it.
pub type Hash = Box<dyn Fn(&str) -> Card + Send>;

/// Seconds on a clock that never goes back.
pub type Clock = Box<dyn Fn() -> f64 + Send>;

/// The doors of the site in use. Clones are the same doors.
#[derive(Clone)]
pub struct DoorHandle(Arc<Mutex<Shared>>);

struct Shared {
    doors: Doors,
    clock: Clock,
    hash: Hash,
    listeners: Vec<Sender<Output>>,
}

impl std::fmt::Debug for DoorHandle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("DoorHandle").finish_non_exhaustive()
    }
}

impl DoorHandle {
    /// The doors of a site. `hash` makes of a card what may be kept of it; without one it is a hash by a key that is lost
    /// with the process.
    #[must_use]
    pub fn new(site: &Site, hash: Option<Hash>) -> Self {
        let clock = HostClock::start();
        Self::timed(Box::new(move || clock.now_us() as f64 * 1e-6), site, hash)
    }

    /// The same by another clock, as that of a test.
    #[must_use]
    pub fn timed(clock: Clock, site: &Site, hash: Option<Hash>) -> Self {
        let hash = hash.unwrap_or_else(by_process);
        let shared = Shared { doors: Doors::new(site, first_id()), clock, hash, listeners: Vec::new() };
        Self(Arc::new(Mutex::new(shared)))
    }

    /// Goes on with the alarms of doors that stood when an earlier process ended.
    pub fn resume(&self, alarms: &[ListedAlarm]) {
        self.lock().doors.resume(alarms.iter().filter_map(ListedAlarm::of_door));
    }

    /// Whether the site may be changed now.
    ///
    /// # Errors
    /// Which door is in use.
    pub fn may_change_site(&self) -> Result<(), InUse> {
        self.lock().doors.may_change_site()
    }

    /// Goes on with another site.
    pub fn change_site(&self, site: &Site) {
        self.lock().step(|doors, _, now, outputs| doors.change_site(site, now, outputs));
    }

    /// Shows the doors what is known, and says how they are after that: both belong to the same snapshot.
    #[must_use]
    pub fn observe(&self, estimate: &Estimate, modules: &[ModuleLine]) -> Vec<DoorLine> {
        let watcher = |name: &str| {
            let module = modules.iter().find(|module| module.name == name)?;
            Some(Watcher { unused_s: module.unused_s?, has_key: module.is_sealed })
        };
        let mut shared = self.lock();
        shared.step(|doors, _, now, outputs| doors.observe(estimate, watcher, now, outputs));
        shared.doors.lines().collect()
    }

    /// Tells the doors the time.
    pub fn pass_time(&self) {
        self.lock().step(|doors, _, now, outputs| doors.pass_time(now, outputs));
    }

    /// Hands a message to a door; what its lock is to be, if the message has made it say so.
    ///
    /// # Errors
    /// Why it changed nothing.
    pub fn tell(&self, door: &str, input: Input, bytes: &[u8]) -> Result<Option<LockOrder>, Why> {
        self.lock().step(|doors, hash, now, outputs| {
            doors.tell(door, input, bytes, hash, now, outputs)?;
            let order = |output: &Output| match output {
                Output::Lock { door: name, order } if name == door => Some(*order),
                _ => None,
            };
            Ok(outputs.iter().rev().find_map(order))
        })
    }

    /// Hands a message to a door; why it changed nothing is an output.
    pub fn post(&self, door: &str, input: Input, bytes: &[u8]) {
        self.lock().step(|doors, hash, now, outputs| {
            if let Err(why) = doors.tell(door, input, bytes, hash, now, outputs) {
                outputs.push(Output::NotTaken { door: door.to_owned(), why: why.to_string() });
            }
        });
    }

    /// The doors, as they are now.
    #[must_use]
    pub fn states(&self) -> Vec<DoorState> {
        self.lock().doors.states(unix_ms()).collect()
    }

    /// All outputs from now on.
    #[must_use]
    pub fn listen(&self) -> Receiver<Output> {
        let (sender, receiver) = channel();
        self.lock().listeners.push(sender);
        receiver
    }

    fn lock(&self) -> MutexGuard<'_, Shared> {
        self.0.lock()
    }
}

impl Shared {
    /// Does something with the doors, and passes their outputs on to the listeners.
    fn step<T>(&mut self, act: impl FnOnce(&mut Doors, &Hash, Now, &mut Vec<Output>) -> T) -> T {
        let now = Now { steady_s: (self.clock)(), unix_ms: unix_ms() };
        let mut outputs = Vec::new();
        let result = act(&mut self.doors, &self.hash, now, &mut outputs);
        for output in outputs {
            self.listeners.retain(|listener| listener.send(output.clone()).is_ok());
        }
        result
    }
}

/// A thread that passes the time to the doors, whatever the tracking loop does. It ends when dropped.
#[derive(Debug)]
pub struct Watchdog {
    _thread: Worker,
}

impl Watchdog {
    /// Watches over these doors.
    ///
    /// # Errors
    /// There is no thread for it.
    pub fn start(doors: DoorHandle, alarms: TrackerAlarms) -> std::io::Result<Self> {
        let work = move |stop: &AtomicBool| {
            while !stop.load(Ordering::Relaxed) {
                doors.pass_time();
                std::thread::sleep(WATCH);
            }
            Ok(())
        };
        Ok(Self { _thread: Worker::start("doors", alarms, work)? })
    }
}

/// Number of the first output of this process: seconds since 1970, and room for a million outputs each of them.
fn first_id() -> u64 {
    (unix_ms() / 1000) << 20
}

/// Hashes by a key that is lost with the process.
pub(crate) fn by_process() -> Hash {
    let keys = [RandomState::new(), RandomState::new()];
    Box::new(move |card| {
        let card = plain(card);
        let [high, low] = [0, 1].map(|half: usize| keys.get(half).map_or(0, |key| key.hash_one(&card)));
        Card(u128::from(high) << 64 | u128::from(low))
    })
}
