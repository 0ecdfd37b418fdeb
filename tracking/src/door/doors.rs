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

use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::MODULE_LOST_S;
use super::event::{Action, Event, LockOrder, Seen};
use super::inbox::{Inbox, Input, NotTaken};
use super::machine::{DoorLine, Machine};
use super::names::Names;
use super::passage::Passage;
use super::terms::{Alarm, Card, Refusal, Trouble};
use super::transition::Phase;
use crate::estimate::Estimate;
use crate::floor::Plan;
use crate::geometry::{Point, distance_to_segment, inside};
use crate::now::Now;
use crate::site::floor::Floor;
use crate::site::{Site, Zone, door};
use crate::tracker::TrackState;

/// A module nearer to a door's line or zone than this watches it, m: as far as sensors of the UHG-08LX's range reach. The site
/// does not say which sensor a module has.
const WATCHES_M: f64 = 8.0;

/// Passages that are shown.
const PASSAGES: usize = 50;

/// How a device that watches a door is.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Watcher {
    /// For how long no report of it was used, s.
    pub unused_s: f64,
    /// Only a holder of its key can speak for it.
    pub has_key: bool,
}

/// A door, and its last passages.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
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
        /// What, and for how long.
        order: LockOrder,
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

/// Why the site is not changed now: a door is in use.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error(
    "door \"{door}\" is {phase}: a site is changed while its doors are idle, and open for no person who \
     leaves; try again, or reset the alarm"
)]
pub struct InUse {
    /// The door.
    pub door: String,
    /// Where it is.
    pub phase: Phase,
}

/// One door.
#[derive(Debug)]
struct Unit {
    door: door::Door,
    machine: Machine,
    inbox: Inbox,
    names: Names,
    /// All tracks of the newest observation, the same for every door.
    tracks: Arc<[TrackState]>,
    passages: Vec<Passed>,
    /// Devices that watch it, by their names.
    watched_by: Vec<String>,
}

/// All doors of a site.
#[derive(Debug)]
pub struct Doors {
    units: Vec<Unit>,
    /// Number of the first output of a door.
    first_id: u64,
}

impl Doors {
    /// The doors of a site. Outputs are numbered from `first_id`: another one for each start of a process, so that no
    /// acknowledgement of an earlier one counts.
    #[must_use]
    pub fn new(site: &Site, first_id: u64) -> Self {
        let units = site.doors.iter().filter_map(|door| Unit::new(door, site, first_id)).collect();
        Self { units, first_id }
    }

    /// Goes on with the alarms of an earlier process that stood when it ended. Those of doors that the site no longer has are over.
    pub fn resume<'a>(&mut self, alarms: impl IntoIterator<Item = (&'a str, Alarm)>) {
        for (door, alarm) in alarms {
            if let Some(unit) = self.units.iter_mut().find(|unit| unit.door.name == door) {
                unit.machine.resume(alarm);
            }
        }
    }

    /// Whether the site may be changed now: the line or the zone of a door in use may not move under a passage.
    ///
    /// # Errors
    /// Which door is in use.
    pub fn may_change_site(&self) -> Result<(), InUse> {
        match self.units.iter().find(|unit| !unit.machine.may_change()) {
            Some(unit) => Err(InUse { door: unit.door.name.clone(), phase: unit.machine.phase() }),
            None => Ok(()),
        }
    }

    /// Goes on with another site: doors go on under their names, with their alarms; one that is gone locks, and one that comes is
    /// locked.
    pub fn change_site(&mut self, site: &Site, now: Now, outputs: &mut Vec<Output>) {
        let mut before = std::mem::take(&mut self.units);
        for door in &site.doors {
            let known = before.iter().position(|unit| unit.door.name == door.name);
            if let Some(mut unit) = known.map(|index| before.swap_remove(index)) {
                let mut actions = Vec::new();
                if unit.machine.change_site(door, site, &mut actions) {
                    unit.door = door.clone();
                    unit.watched_by = watching(door, site);
                    unit.tracks = Arc::default();
                    // Nothing that was asked for can be refused here.
                    let _ = unit.put_out(actions, now, outputs);
                    self.units.push(unit);
                } else {
                    before.push(unit);
                }
                continue;
            }
            let Some(mut unit) = Unit::new(door, site, self.first_id) else { continue };
            unit.machine.added(now.steady_s);
            self.units.push(unit);
        }
        for mut unit in before {
            let actions = unit.machine.retire();
            let _ = unit.put_out(actions, now, outputs);
        }
    }

    /// Shows every door what the tracker knows, and how each device that watches it is; none: it is not there.
    pub fn observe(
        &mut self,
        estimate: &Estimate,
        watcher: impl Fn(&str) -> Option<Watcher>,
        now: Now,
        outputs: &mut Vec<Output>,
    ) {
        let is_lost = |name: &String| watcher(name).is_none_or(|watcher| watcher.unused_s > MODULE_LOST_S);
        let has_key = |name: &String| watcher(name).is_some_and(|watcher| watcher.has_key);
        if self.units.is_empty() {
            return;
        }
        let tracks: Arc<[TrackState]> = estimate.tracks.as_slice().into();
        for unit in &mut self.units {
            unit.tracks = Arc::clone(&tracks);
            let believes_all = unit.door.without_keys || unit.watched_by.iter().all(has_key);
            let trouble = if unit.watched_by.is_empty() || unit.watched_by.iter().any(is_lost) {
                Some(Trouble::ModuleLost)
            } else {
                (!believes_all).then_some(Trouble::NoKey)
            };
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
        let place = self.units.iter().position(|unit| unit.door.name == door);
        let (before, rest) = self.units.split_at_mut(place.unwrap_or(0));
        let found = rest.split_first_mut().filter(|_| place.is_some());
        let (unit, after) = found.ok_or_else(|| Why::NoDoor(door.to_owned()))?;
        let event = unit.inbox.read(input, bytes, now, hash)?;
        let mut others = before.iter().chain(after.iter()).filter(|other| other.door.zone == unit.door.zone);
        let is_taken = others.any(|other| other.machine.has_group());
        unit.machine.take_zone(is_taken);
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
    fn new(door: &door::Door, site: &Site, first_id: u64) -> Option<Self> {
        Some(Self {
            machine: Machine::new(door, site, first_id)?,
            door: door.clone(),
            inbox: Inbox::default(),
            names: Names::default(),
            tracks: Arc::default(),
            passages: Vec::new(),
            watched_by: watching(door, site),
        })
    }

    fn turn(&mut self, event: Event, now: Now, outputs: &mut Vec<Output>) {
        // Time and tracks are never refused.
        let _ = self.step(event, now, outputs);
        self.names.follow(&self.tracks, now.steady_s);
    }

    fn step(&mut self, event: Event, now: Now, outputs: &mut Vec<Output>) -> Result<(), Why> {
        let actions = self.machine.step(event, now.steady_s);
        self.put_out(actions, now, outputs)
    }

    fn put_out(&mut self, actions: Vec<Action>, now: Now, outputs: &mut Vec<Output>) -> Result<(), Why> {
        let mut refused = Ok(());
        for action in actions {
            let door = self.door.name.clone();
            match action {
                Action::Refused(why) => refused = Err(Why::Refused(why)),
                Action::Lock(order) => outputs.push(Output::Lock { door, order }),
                Action::Alarm { id, alarm } => outputs.push(Output::Alarm { door, id, alarm }),
                Action::Named { card, reader, by } => {
                    let may_be = self.tracks.iter().filter(|track| by.contains(&track.id));
                    self.names.show(card, may_be, reader);
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

/// The devices that watch a door, by their names: modules near its line or its zone, and floors with a panel in the zone. Where
/// there are none, all of the site: which of them sees so far is not known, and none of them may be silent or forged then.
fn watching(door: &door::Door, site: &Site) -> Vec<String> {
    let (from, to) = door.ends();
    let zone = site.zones.iter().find(|zone| zone.name == door.zone);
    let is_near = |at: Point| {
        distance_to_segment(at, from, to) < WATCHES_M
            || zone.is_some_and(|zone| zone.apart_m((at, at)) < WATCHES_M)
    };
    let corners = zone.map_or_else(Vec::new, Zone::corners);
    let is_under = |floor: &Floor| {
        let plan = Plan::from(floor);
        (0..plan.panels()).any(|panel| inside(plan.middle(panel), &corners))
    };
    let placed = site.modules.iter().filter(|module| module.placed);
    let near = placed.filter(|module| is_near(module.pose().at)).map(|module| &module.name);
    let under = site.floors.iter().filter(|floor| is_under(floor)).map(|floor| &floor.name);
    let watching: Vec<String> = near.chain(under).cloned().collect();
    if watching.is_empty() { site.placed().map(str::to_owned).collect() } else { watching }
}

#[cfg(test)]
mod tests;
