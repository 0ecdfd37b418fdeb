//! The thread that runs all doors of a site: frames and messages in, outputs out.
//!
//! ```text
//!   frames every 0.1 s ─▶ ╭───────╮ ─▶ lines      the newest: screen, map, MQTT
//!   messages ─▶ inbox ──▶ │ doors │ ─▶ told       each one: lock, alarm, passage ─▶ MQTT, database
//!     ◀── taken, or why not ╰───────╯
//! ```
//!
//! It never waits for anybody. Without frames the machines still get the time, so that a dead tracker is trouble.

use std::collections::hash_map::RandomState;
use std::hash::BuildHasher;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, TrySendError, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use tokio::sync::watch;

use super::MODULE_LOST_S;
use super::event::{Action, Alarm, Card, Event, Lock, Refusal, Seen, Trouble};
use super::inbox::{Inbox, Input, NotTaken};
use super::machine::{DoorLine, Machine};
use super::names::Names;
use super::passage::Passage;
use crate::frame::{Frame, unix_ms};
use crate::geometry::{Point, distance_to_segment};
use crate::site::{self, Site};

/// Between two looks at the time.
const WAIT: Duration = Duration::from_millis(50);

/// Messages that wait: more than any device sends in a second.
const QUEUE: usize = 64;

/// A module farther from a door's line than this does not watch it, m.
const WATCHES_M: f64 = 8.0;

/// Passages that are shown.
const PASSAGES: usize = 50;

/// How the doors are, for whoever makes frames.
#[derive(Clone, Debug, Default)]
pub struct Shown(Arc<Mutex<Vec<DoorLine>>>);

impl Shown {
    fn set(&self, lines: Vec<DoorLine>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = lines;
    }

    /// How they are now.
    #[must_use]
    pub fn lines(&self) -> Vec<DoorLine> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// A door, and its last passages.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DoorState {
    /// How it is.
    #[serde(flatten)]
    pub line: DoorLine,
    /// This machine's time, ms since 1970: for senders to set their stamps by.
    pub unix_ms: u64,
    /// The last passages, newest first.
    pub passages: Vec<Passed>,
}

/// A passage, with its time of day.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Passed {
    /// ms since 1970.
    pub begun_ms: u64,
    /// ms since 1970.
    pub ended_ms: u64,
    /// The record.
    pub passage: Passage,
}

/// What a door tells the world; lock and alarm again and again until they are taken.
#[derive(Clone, Debug, PartialEq)]
pub enum Told {
    /// What the lock is to be.
    Lock {
        /// The door.
        door: String,
        /// Number of the output.
        id: u64,
        /// What it is to be.
        lock: Lock,
    },
    /// What the alarm is to be.
    Alarm {
        /// The door.
        door: String,
        /// Number of the output.
        id: u64,
        /// What for; none: it is over.
        alarm: Option<Alarm>,
    },
    /// A passage is over.
    Passage(Box<Passed>),
    /// A message was not taken.
    NotTaken {
        /// The door.
        door: String,
        /// Why.
        why: String,
    },
}

/// Why a message changed nothing.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum Why {
    /// No such door.
    #[error("there is no door \"{0}\"")]
    NoDoor(String),
    /// The message itself.
    #[error(transparent)]
    NotTaken(#[from] NotTaken),
    /// It is good, but not now.
    #[error("{0}")]
    Refused(Refusal),
    /// Too much at once.
    #[error("too many messages at once: try again")]
    Busy,
}

/// A message, and whom to tell what became of it.
struct Message {
    door: String,
    input: Input,
    bytes: Vec<u8>,
    answer: Option<tokio::sync::oneshot::Sender<Result<(), Why>>>,
}

/// What makes of a card what may be kept of it.
pub type Hash = Box<dyn Fn(&str) -> Card + Send>;

/// Seconds on a clock that never goes back.
pub type Clock = Box<dyn Fn() -> f64 + Send>;

type Listeners = Arc<Mutex<Vec<Sender<Told>>>>;

/// All doors of a site. They end when this is dropped.
#[derive(Debug)]
pub struct Doors {
    desk: DoorDesk,
    listeners: Listeners,
    thread: Option<JoinHandle<()>>,
    stop: Arc<std::sync::atomic::AtomicBool>,
}

/// Where messages are handed in, and the doors can be seen.
#[derive(Clone, Debug)]
pub struct DoorDesk {
    messages: SyncSender<Message>,
    states: watch::Receiver<Arc<Vec<DoorState>>>,
}

impl std::fmt::Debug for Message {
    /// Without what it says: a card may be in it.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Message")
            .field("door", &self.door)
            .field("input", &self.input)
            .finish_non_exhaustive()
    }
}

impl DoorDesk {
    /// The doors, as they are now.
    #[must_use]
    pub fn states(&self) -> Arc<Vec<DoorState>> {
        Arc::clone(&self.states.borrow())
    }

    /// Hands in a message, and waits for what becomes of it.
    ///
    /// # Errors
    /// Why it changed nothing.
    pub async fn tell(&self, door: &str, input: Input, bytes: &[u8]) -> Result<(), Why> {
        let (answer, answered) = tokio::sync::oneshot::channel();
        self.send(door, input, bytes, Some(answer))?;
        answered.await.unwrap_or(Err(Why::Busy))
    }

    /// Hands in a message; what becomes of it is told to whoever listens.
    ///
    /// # Errors
    /// Too many wait.
    pub fn post(&self, door: &str, input: Input, bytes: &[u8]) -> Result<(), Why> {
        self.send(door, input, bytes, None)
    }

    fn send(
        &self,
        door: &str,
        input: Input,
        bytes: &[u8],
        answer: Option<tokio::sync::oneshot::Sender<Result<(), Why>>>,
    ) -> Result<(), Why> {
        let message = Message { door: door.to_owned(), input, bytes: bytes.to_vec(), answer };
        self.messages.try_send(message).map_err(|error| match error {
            TrySendError::Full(_) | TrySendError::Disconnected(_) => Why::Busy,
        })
    }
}

impl Doors {
    /// Runs the doors of the site, and of every site after it. `hash` makes of a card what may be kept of it; without
    /// one it is a hash by a key that is lost with the process.
    ///
    /// # Errors
    /// There is no thread for them.
    pub fn start(
        site: watch::Receiver<Arc<Site>>,
        frames: Receiver<Arc<Frame>>,
        shown: Shown,
        hash: Option<Hash>,
    ) -> std::io::Result<Self> {
        let begun = Instant::now();
        Self::start_by(Box::new(move || begun.elapsed().as_secs_f64()), site, frames, shown, hash)
    }

    /// The same by another clock, as that of a recording or a test, in which time stands still while there are no frames.
    ///
    /// # Errors
    /// There is no thread for them.
    pub fn start_by(
        clock: Clock,
        site: watch::Receiver<Arc<Site>>,
        frames: Receiver<Arc<Frame>>,
        shown: Shown,
        hash: Option<Hash>,
    ) -> std::io::Result<Self> {
        let (messages, coming) = sync_channel(QUEUE);
        let (states_in, states) = watch::channel(Arc::default());
        let listeners = Listeners::default();
        let stop = Arc::new(std::sync::atomic::AtomicBool::new(false));
        let mut work = Work {
            clock,
            units: Vec::new(),
            site,
            listeners: Arc::clone(&listeners),
            states: states_in,
            shown,
            hash: hash.unwrap_or_else(by_process),
        };
        let stopped = Arc::clone(&stop);
        let thread = std::thread::Builder::new().name("doors".into()).spawn(move || {
            work.begin();
            while !stopped.load(std::sync::atomic::Ordering::Relaxed) {
                match coming.recv_timeout(WAIT) {
                    Ok(message) => work.take(message),
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => return,
                }
                work.turn(frames.try_iter().last());
            }
        })?;
        Ok(Self { desk: DoorDesk { messages, states }, listeners, thread: Some(thread), stop })
    }

    /// Where messages are handed in.
    #[must_use]
    pub fn desk(&self) -> DoorDesk {
        self.desk.clone()
    }

    /// Everything the doors tell from now on.
    #[must_use]
    pub fn listen(&self) -> Receiver<Told> {
        let (sender, receiver) = channel();
        self.listeners.lock().unwrap_or_else(PoisonError::into_inner).push(sender);
        receiver
    }
}

impl Drop for Doors {
    fn drop(&mut self) {
        self.stop.store(true, std::sync::atomic::Ordering::Relaxed);
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// Hashes by a key that nobody knows and that is lost with the process.
fn by_process() -> Hash {
    let keys = [RandomState::new(), RandomState::new()];
    Box::new(move |card| {
        let [high, low] = [0, 1].map(|half: usize| keys.get(half).map_or(0, |key| key.hash_one(card)));
        Card(u128::from(high) << 64 | u128::from(low))
    })
}

/// One door.
struct Unit {
    door: site::door::Door,
    machine: Machine,
    inbox: Inbox,
    names: Names,
    /// Everybody, in the newest frame.
    people: Vec<(u64, Point)>,
    passages: Vec<Passed>,
    /// Modules that watch it, by their names.
    watched_by: Vec<String>,
}

struct Work {
    clock: Clock,
    units: Vec<Unit>,
    site: watch::Receiver<Arc<Site>>,
    listeners: Listeners,
    states: watch::Sender<Arc<Vec<DoorState>>>,
    shown: Shown,
    hash: Hash,
}

impl Work {
    /// Doors of the site; one that is as it was goes on.
    fn begin(&mut self) {
        let site = Arc::clone(&self.site.borrow_and_update());
        let mut before = std::mem::take(&mut self.units);
        for door in &site.doors {
            let watched_by = watching(door, &site);
            let known = before.iter().position(|unit| unit.door == *door && unit.watched_by == watched_by);
            let unit = known.map(|index| before.swap_remove(index)).or_else(|| {
                Some(Unit {
                    machine: Machine::new(door, &site)?,
                    door: door.clone(),
                    inbox: Inbox::default(),
                    names: Names::default(),
                    people: Vec::new(),
                    passages: Vec::new(),
                    watched_by,
                })
            });
            self.units.extend(unit);
        }
    }

    fn now_s(&self) -> f64 {
        (self.clock)()
    }

    fn take(&mut self, message: Message) {
        let now_s = self.now_s();
        let result = match self.units.iter_mut().find(|unit| unit.door.name == message.door) {
            None => Err(Why::NoDoor(message.door.clone())),
            Some(unit) => match unit.inbox.take(message.input, &message.bytes, unix_ms(), &self.hash) {
                Err(why) => Err(why.into()),
                Ok(event) => step(unit, event, now_s, &self.listeners),
            },
        };
        match (message.answer, result) {
            (Some(answer), result) => {
                // Who asked may have gone.
                let _ = answer.send(result);
            }
            (None, Err(why)) => {
                tell(&self.listeners, Told::NotTaken { door: message.door, why: why.to_string() });
            }
            (None, Ok(())) => {}
        }
    }

    fn turn(&mut self, frame: Option<Arc<Frame>>) {
        if self.site.has_changed().unwrap_or(false) {
            self.begin();
        }
        let now_s = self.now_s();
        for unit in &mut self.units {
            let event = match frame.as_ref().filter(|frame| frame.unix_ms != 0) {
                None => Event::Time,
                Some(frame) => {
                    let tracks = frame.line.tracks.iter();
                    unit.people = tracks.map(|track| (track.id, Point::new(track.x, track.y))).collect();
                    let trouble = lost(frame, &unit.watched_by).then_some(Trouble::ModuleLost);
                    Event::Seen(Seen::of(&frame.line, &unit.door.zone, trouble))
                }
            };
            // What the tracker says is never refused.
            let _ = step(unit, event, now_s, &self.listeners);
            unit.names.see(&unit.people, now_s);
        }
        let state = |unit: &Unit| DoorState {
            line: DoorLine { names: unit.names.told(), ..unit.machine.line() },
            unix_ms: unix_ms(),
            passages: unit.passages.clone(),
        };
        let states: Vec<DoorState> = self.units.iter().map(state).collect();
        self.shown.set(states.iter().map(|state| state.line.clone()).collect());
        self.states.send_replace(Arc::new(states));
    }
}

fn step(unit: &mut Unit, event: Event, now_s: f64, listeners: &Listeners) -> Result<(), Why> {
    let mut refused = Ok(());
    for action in unit.machine.step(event, now_s) {
        let door = unit.door.name.clone();
        match action {
            Action::Refused(why) => refused = Err(Why::Refused(why)),
            Action::Lock { id, lock } => tell(listeners, Told::Lock { door, id, lock }),
            Action::Alarm { id, alarm } => tell(listeners, Told::Alarm { door, id, alarm }),
            Action::Named { card, likelihoods } => {
                // The machine's own are likelihoods; anything else would change nothing.
                let _ = unit.names.shown(card, &likelihoods);
            }
            Action::Passage(passage) => {
                let ago_ms = |at_s: f64| ((now_s - at_s).max(0.0) * 1000.0) as u64;
                let now_ms = unix_ms();
                let passed = Passed {
                    begun_ms: now_ms.saturating_sub(ago_ms(passage.begun_s)),
                    ended_ms: now_ms.saturating_sub(ago_ms(passage.ended_s)),
                    passage: *passage,
                };
                unit.passages.insert(0, passed.clone());
                unit.passages.truncate(PASSAGES);
                tell(listeners, Told::Passage(Box::new(passed)));
            }
        }
    }
    refused
}

fn tell(listeners: &Listeners, told: Told) {
    let mut listeners = listeners.lock().unwrap_or_else(PoisonError::into_inner);
    listeners.retain(|listener| listener.send(told.clone()).is_ok());
}

/// The modules that watch a door, by their names.
fn watching(door: &site::door::Door, site: &Site) -> Vec<String> {
    let (from, to) = door.ends();
    let near =
        |module: &&site::Module| distance_to_segment(Point::new(module.x, module.y), from, to) < WATCHES_M;
    site.modules.iter().filter(near).map(|module| module.name.clone()).collect()
}

/// Whether one of these modules says nothing, or is not there.
fn lost(frame: &Frame, names: &[String]) -> bool {
    names.iter().any(|name| {
        let module = frame.modules.iter().find(|module| module.name == *name);
        module.and_then(|module| module.silent_s).is_none_or(|silent_s| silent_s > MODULE_LOST_S)
    })
}
