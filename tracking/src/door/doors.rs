//! All doors of a site: tracks, time and messages in; outputs out.
//!
//! ```text
//!   zones, tracks, silent devices ─ observe ─▶ ╭───────╮ ─▶ DoorLine: how each door is, for the same snapshot
//!   message ─────────────────────── tell ────▶ │ doors │ ─▶ Output: lock, alarm, passage, refusal
//!   nothing but time ────────────── pass_time ▶╰───────╯
//! ```
//!
//! No I/O and no clock of its own. Without observations the machines still get the time, so that a dead tracker becomes
//! trouble.

use serde::{Deserialize, Serialize};

use super::MODULE_LOST_S;
use super::event::{Action, Event, Seen};
use super::inbox::{Inbox, Input, NotTaken};
use super::machine::{DoorLine, Machine};
use super::names::Names;
use super::passage::Passage;
use super::terms::{Alarm, Card, Lock, Refusal, Trouble};
use crate::follower::Estimate;
use crate::geometry::{Point, distance_to_segment};
use crate::site::{Module, Site, door};
use crate::tracker::TrackId;

/// A device farther from a door's line than this does not watch it, m.
const WATCHES_M: f64 = 8.0;

/// Passages that are shown.
const PASSAGES: usize = 50;

/// The same moment on two clocks.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Now {
    /// s on a clock that never goes back.
    pub steady_s: f64,
    /// ms since 1970.
    pub unix_ms: u64,
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

/// What a door puts out; lock and alarm again and again until they are acknowledged.
#[derive(Clone, Debug, PartialEq)]
pub enum Output {
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
}

/// One door.
#[derive(Debug)]
struct Unit {
    door: door::Door,
    machine: Machine,
    inbox: Inbox,
    names: Names,
    /// All tracks of the newest observation.
    people: Vec<(TrackId, Point)>,
    passages: Vec<Passed>,
    /// Devices that watch it, by their names.
    watched_by: Vec<String>,
}

/// All doors of a site.
#[derive(Debug, Default)]
pub struct Doors {
    units: Vec<Unit>,
}

impl Doors {
    /// The doors of a site.
    #[must_use]
    pub fn new(site: &Site) -> Self {
        let mut doors = Self::default();
        doors.change_site(site);
        doors
    }

    /// Goes on with another site; a door that is as it was goes on.
    pub fn change_site(&mut self, site: &Site) {
        let mut before = std::mem::take(&mut self.units);
        for door in &site.doors {
            let watched_by = watching(door, site);
            let known = before.iter().position(|unit| unit.door == *door && unit.watched_by == watched_by);
            let unit = known.map(|index| before.swap_remove(index)).or_else(|| {
                Some(Unit {
                    machine: Machine::new(door, site)?,
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

    /// Shows every door what the tracker knows. `silent_s` is for how long a device has been silent, s; none: it is not
    /// there.
    pub fn observe(
        &mut self,
        estimate: &Estimate,
        silent_s: impl Fn(&str) -> Option<f64>,
        now: Now,
        outputs: &mut Vec<Output>,
    ) {
        let is_lost = |name: &String| silent_s(name).is_none_or(|silent_s| silent_s > MODULE_LOST_S);
        for unit in &mut self.units {
            unit.people = estimate.tracks.iter().map(|track| (track.id, track.at)).collect();
            let trouble = unit.watched_by.iter().any(is_lost).then_some(Trouble::ModuleLost);
            let event = Event::Seen(Seen::of(&estimate.tracks, estimate.zones.get(&unit.door.zone), trouble));
            unit.turn(event, now, outputs);
        }
    }

    /// Tells every door the time.
    pub fn pass_time(&mut self, now: Now, outputs: &mut Vec<Output>) {
        for unit in &mut self.units {
            unit.turn(Event::Time, now, outputs);
        }
    }

    /// Hands a message to a door; `hash` makes of a card what may be kept of it.
    ///
    /// # Errors
    /// Why it changed nothing.
    pub fn tell(
        &mut self,
        door: &str,
        input: Input,
        bytes: &[u8],
        hash: impl FnOnce(&str) -> Card,
        now: Now,
        outputs: &mut Vec<Output>,
    ) -> Result<(), Why> {
        let unit = self.units.iter_mut().find(|unit| unit.door.name == door);
        let unit = unit.ok_or_else(|| Why::NoDoor(door.to_owned()))?;
        let event = unit.inbox.take(input, bytes, now.unix_ms, hash)?;
        unit.step(event, now, outputs)
    }

    /// How every door is.
    pub fn lines(&self) -> impl Iterator<Item = DoorLine> {
        self.units.iter().map(Unit::line)
    }

    /// How every door is, with its last passages.
    pub fn states(&self, unix_ms: u64) -> impl Iterator<Item = DoorState> {
        let state =
            move |unit: &Unit| DoorState { line: unit.line(), unix_ms, passages: unit.passages.clone() };
        self.units.iter().map(state)
    }
}

impl Unit {
    fn turn(&mut self, event: Event, now: Now, outputs: &mut Vec<Output>) {
        // Time and tracks are never refused.
        let _ = self.step(event, now, outputs);
        self.names.see(&self.people, now.steady_s);
    }

    fn step(&mut self, event: Event, now: Now, outputs: &mut Vec<Output>) -> Result<(), Why> {
        let mut refused = Ok(());
        for action in self.machine.step(event, now.steady_s) {
            let door = self.door.name.clone();
            match action {
                Action::Refused(why) => refused = Err(Why::Refused(why)),
                Action::Lock { id, lock } => outputs.push(Output::Lock { door, id, lock }),
                Action::Alarm { id, alarm } => outputs.push(Output::Alarm { door, id, alarm }),
                Action::Named { card, likelihoods } => {
                    // The machine's own are likelihoods; anything else would change nothing.
                    let _ = self.names.shown(card, &likelihoods);
                }
                Action::Passage(passage) => {
                    let passed = Passed::new(*passage, now);
                    self.passages.insert(0, passed.clone());
                    self.passages.truncate(PASSAGES);
                    outputs.push(Output::Passage(Box::new(passed)));
                }
            }
        }
        refused
    }

    fn line(&self) -> DoorLine {
        DoorLine { names: self.names.told(), ..self.machine.line() }
    }
}

impl Passed {
    fn new(passage: Passage, now: Now) -> Self {
        let at_ms = |at_s: f64| now.unix_ms.saturating_sub(((now.steady_s - at_s).max(0.0) * 1000.0) as u64);
        Self { begun_ms: at_ms(passage.begun_s), ended_ms: at_ms(passage.ended_s), passage }
    }
}

/// The devices that watch a door, by their names.
fn watching(door: &door::Door, site: &Site) -> Vec<String> {
    let (from, to) = door.ends();
    let near = |module: &&Module| distance_to_segment(Point::new(module.x, module.y), from, to) < WATCHES_M;
    site.modules.iter().filter(near).map(|module| module.name.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::door::transition::Phase;

    const SITE: &str = r#"
        [[module]]
        name = "left"
        x = 0.0
        y = 0.0
        [[zone]]
        name = "area"
        polygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
        [[door]]
        name = "front"
        zone = "area"
        line = [[-0.5, 1], [0.5, 1]]
        fail = "secure"
    "#;

    fn now(steady_s: f64) -> Now {
        Now { steady_s, unix_ms: 1_700_000_000_000 + (steady_s * 1e3) as u64 }
    }

    fn well() -> Estimate {
        let zone = r#"{"count":0,"p":[1.0],"seen_share":1.0,"state":"known"}"#;
        let zones = [("area".to_owned(), serde_json::from_str(zone).unwrap())].into();
        Estimate { t_s: 0.0, tracks: Vec::new(), zones }
    }

    fn phase(doors: &Doors) -> Phase {
        doors.lines().next().unwrap().phase
    }

    #[test]
    fn the_line_of_an_observation_is_that_after_it() {
        let mut doors = Doors::new(&toml::from_str(SITE).unwrap());
        let mut outputs = Vec::new();
        for tenth in 0..=20 {
            assert_eq!(phase(&doors), Phase::Failed, "{tenth}");
            doors.observe(&well(), |_| Some(0.0), now(f64::from(tenth) * 0.1), &mut outputs);
        }
        assert_eq!(
            phase(&doors),
            Phase::Idle,
            "well for 2 s: said with the very observation that makes it so"
        );
        doors.observe(&well(), |_| Some(1.1), now(2.1), &mut outputs);
        assert_eq!(phase(&doors), Phase::Failed, "the device that watches it is silent");
    }

    #[test]
    fn time_alone_makes_a_door_fail() {
        let mut doors = Doors::new(&toml::from_str(SITE).unwrap());
        let mut outputs = Vec::new();
        for tenth in 0..=20 {
            doors.observe(&well(), |_| Some(0.0), now(f64::from(tenth) * 0.1), &mut outputs);
        }
        doors.pass_time(now(2.9), &mut outputs);
        assert_eq!(phase(&doors), Phase::Idle);
        outputs.clear();
        doors.pass_time(now(3.1), &mut outputs);
        assert_eq!(phase(&doors), Phase::Failed);
        assert!(
            outputs.iter().any(|output| matches!(output, Output::Alarm { alarm: Some(Alarm::Trouble), .. }))
        );
    }
}
