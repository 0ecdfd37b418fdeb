//! The door itself: events and `now` in, actions out.
//!
//! ```text
//!   step(event, now) = what time has brought ─▶ the event ─▶ outputs that are due
//!
//!   lock:  unlocked │ failed, and the site says "safe" ─▶ unlocked
//!          a person has asked to leave                 ─▶ exit
//!          everything else                             ─▶ locked
//! ```
//!
//! It unlocks only from `checking`, when P(count = number entered) has been at least [`SURE`] and the share of the zone
//! that was seen at least [`SEEN`], for [`STEADY_S`] on end, with no two lines farther apart than [`BREAK_S`].

mod inputs;
mod leaf;
mod line;
mod orders;
mod site;
mod trust;
mod watch;

pub use line::DoorLine;

use crate::door::cards::Cards;
use crate::door::crossing::Doorway;
use crate::door::event::{Action, Event, Seen};
use crate::door::passage::Outcome;
use crate::door::progress::Progress;
use crate::door::prompt::Prompt;
use crate::door::terms::{Alarm, Card, EndsWith, Lock, Refusal, Trouble};
use crate::door::transition::{Cause, Phase};
use crate::occupancy::KNOWN_SHARE;
use crate::site::Site;
use crate::site::door::{Door, Fail};
use leaf::Leaf;
use orders::Orders;
use site::doorway;
use trust::{Certainty, Trust};

/// Least probability that the number entered is the count.
pub const SURE: f64 = 0.95;

/// Least share of the zone that was seen in the last 2 s: from here on a zone is known.
pub const SEEN: f64 = KNOWN_SHARE;

/// Both must hold for so long without a break, s: five lines, so that no flicker of the count opens a door.
pub const STEADY_S: f64 = 0.5;

/// Lines farther apart than this are a break, s: they come each tenth of a second, one of them may be missing, and the next be half
/// of that late.
pub const BREAK_S: f64 = 0.25;

/// After so long without a line from the tracker nothing is known, s.
pub const NO_FRAMES_S: f64 = 1.0;

/// Trouble must be over for so long, s.
pub const SETTLED_S: f64 = 2.0;

/// The leaf must be shut for so long before a passage is over, s: what the tracker knows is up to 0.3 s old.
const SHUT_S: f64 = 0.5;

/// With less of the zone seen than this, a person could come in unnoticed.
const BLIND: f64 = 0.3;

/// To be blind for so long is trouble, s.
const BLIND_S: f64 = 2.0;

/// Why there is an alarm of a person who may be one of a group that was let in before all was known again.
const LET_IN_BEFORE: &str = "a person went in; whether the door had let them in before is not known";

/// A door.
#[derive(Clone, Debug)]
pub struct Machine {
    door: Door,
    doorway: Doorway,
    phase: Phase,
    since_s: f64,
    now_s: f64,
    progress: Option<Progress>,
    passages: u64,
    cards: Cards,
    orders: Orders,
    /// The alarm that stands until its own end, whatever trouble there is meanwhile.
    standing: Option<Alarm>,
    trust: Trust,
    count: Certainty,
    seen: Option<(f64, Seen)>,
    leaf: Leaf,
    /// A passage of the process before, or one that has ended in trouble, may still be under way: since then the leaf has not been
    /// shut, that is known.
    of_before: bool,
    exit_until_s: f64,
    /// When a track was lost in the doorway before the line while none was let in, s.
    lost_s: f64,
    /// Another door of the zone has a passage under way: the people before this one may be counted for that one.
    zone_is_taken: bool,
    prompt: Prompt,
    taken: Vec<(Phase, Cause, Phase)>,
}

impl Machine {
    /// A door of a site, locked or not as it fails, until the tracker has been well for 2 s. Its orders are numbered
    /// from `first_id`. None without its zone.
    #[must_use]
    pub fn new(door: &Door, site: &Site, first_id: u64) -> Option<Self> {
        let mut machine = Self {
            doorway: doorway(door, site)?,
            door: door.clone(),
            phase: Phase::Failed,
            since_s: 0.0,
            now_s: 0.0,
            progress: None,
            passages: 0,
            cards: Cards::default(),
            orders: Orders::new(first_id),
            standing: None,
            trust: Trust::starting(door.fail),
            count: Certainty::new(),
            seen: None,
            leaf: Leaf::unknown(),
            of_before: true,
            exit_until_s: f64::NEG_INFINITY,
            lost_s: f64::NEG_INFINITY,
            zone_is_taken: false,
            prompt: Prompt::Starting,
            taken: Vec::new(),
        };
        machine.orders.lock.set(machine.wanted());
        Some(machine)
    }

    /// Whether a card was taken, and its group has not gone in yet.
    #[must_use]
    pub const fn has_group(&self) -> bool {
        matches!(self.phase, Phase::Asked | Phase::Checking | Phase::Unlocked | Phase::Closing)
    }

    /// Notes whether another door of the zone has a group: no card is taken meanwhile.
    pub const fn take_zone(&mut self, is_taken: bool) {
        self.zone_is_taken = is_taken;
    }

    /// Takes an event at `now_s`, s on any steady clock; a time before the last one counts as that.
    pub fn step(&mut self, event: Event, now_s: f64) -> Vec<Action> {
        if now_s > self.now_s {
            self.now_s = now_s;
        }
        let mut actions = Vec::new();
        self.pass_time(&mut actions);
        match event {
            Event::Card(card) => self.card(card, &mut actions),
            Event::Number(number) => self.number(number, &mut actions),
            Event::Contact(contact) => self.leaf.report(contact, self.now_s),
            Event::Exit => self.exit_until_s = self.now_s + self.door.exit_s,
            Event::Seen(seen) => self.observe(seen, &mut actions),
            Event::LockReady(nonce) => self.orders.lock_is_ready(nonce),
            Event::LockTaken(id) => {
                refuse(self.orders.lock.acknowledge(id), Refusal::OldAcknowledgement, &mut actions);
            }
            Event::AlarmTaken(id) => {
                refuse(self.orders.alarm.acknowledge(id), Refusal::OldAcknowledgement, &mut actions);
            }
            Event::Reset => self.reset(&mut actions),
            Event::Time => {}
        }
        self.say(&mut actions);
        actions
    }

    fn say(&mut self, actions: &mut Vec<Action>) {
        let lock = self.wanted();
        self.orders.lock.set(lock);
        self.orders.alarm.set(match self.phase {
            Phase::Failed => Some(Alarm::Trouble),
            _ => self.standing,
        });
        self.orders.say(self.now_s, actions);
    }

    /// Where it is.
    #[must_use]
    pub const fn phase(&self) -> Phase {
        self.phase
    }

    /// What the lock is to be.
    #[must_use]
    pub const fn lock(&self) -> Lock {
        self.orders.lock.value()
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.door.name
    }

    /// The zone before it.
    #[must_use]
    pub fn zone(&self) -> &str {
        &self.door.zone
    }

    /// The transitions since they were asked for last.
    pub fn transitions(&mut self) -> Vec<(Phase, Cause, Phase)> {
        std::mem::take(&mut self.taken)
    }

    fn wanted(&self) -> Lock {
        match self.phase {
            Phase::Unlocked => Lock::Unlocked,
            Phase::Failed if self.trust.fail == Fail::Safe => Lock::Unlocked,
            _ if self.now_s < self.exit_until_s => Lock::Exit,
            _ => Lock::Locked,
        }
    }

    fn go(&mut self, cause: Cause, to: Phase, prompt: Prompt) {
        // A running door never reads them: the last few are enough for a reader.
        if self.taken.len() >= 64 {
            self.taken.clear();
        }
        self.taken.push((self.phase, cause, to));
        self.phase = to;
        self.since_s = self.now_s;
        self.count.match_since_s = None;
        self.prompt = prompt;
    }

    /// What time alone brings.
    fn pass_time(&mut self, actions: &mut Vec<Action>) {
        let passed_s = self.now_s - self.since_s;
        self.forget_held_open();
        let silent = self.seen.as_ref().is_none_or(|(at_s, _)| self.now_s - at_s > NO_FRAMES_S);
        if silent && self.phase != Phase::Failed {
            self.fail(Trouble::NoFrames, actions);
            return;
        }
        if silent {
            self.trouble_lasts();
        }
        match self.phase {
            Phase::Asked if passed_s >= self.door.ask_s => {
                self.end(Outcome::GaveUp, "no number was entered", actions);
                self.go(Cause::Timeout, Phase::Idle, Prompt::Ready);
            }
            Phase::Checking if passed_s >= self.door.check_s => self.mismatch(actions),
            Phase::Unlocked => {
                let more = self.progress.as_ref().map_or(0, |progress| progress.let_in.saturating_sub(1));
                if passed_s >= self.door.pass_s + self.door.next_s * more as f64 {
                    self.go(Cause::Timeout, Phase::Closing, Prompt::Closing);
                }
            }
            _ => {}
        }
        let open_since_s = match self.phase {
            Phase::Closing => Some(self.since_s),
            Phase::Idle | Phase::Asked | Phase::Checking => self.leaf.open_since_s,
            _ => None,
        };
        // A person who leaves has the time for it.
        let open_s = open_since_s.map(|since_s| self.now_s - since_s.max(self.exit_until_s));
        if open_s.is_some_and(|open_s| open_s >= self.door.close_s) {
            if self.phase != Phase::Closing {
                self.end(Outcome::HeldOpen, "the leaf does not shut", actions);
            }
            self.standing = Some(Alarm::HeldOpen);
            self.go(Cause::HeldOpen, Phase::HeldOpen, Prompt::LetShut);
        }
    }

    /// A leaf that is shut during trouble is not held open any more.
    fn forget_held_open(&mut self) {
        let waits = self.standing.is_some_and(|alarm| alarm.ends_with() == EndsWith::ShutLeaf);
        if self.phase == Phase::Failed && waits && self.leaf.is_shut(SHUT_S, self.now_s) {
            self.standing = None;
        }
    }

    fn observe(&mut self, seen: Seen, actions: &mut Vec<Action>) {
        let blind = seen.seen_share < BLIND;
        let blind_s = self.trust.blind_s(blind, self.now_s);
        let trouble = seen.trouble.or((blind && blind_s >= BLIND_S).then_some(Trouble::Unseen));
        let crossings = self.doorway.observe(&seen.bodies, self.now_s);
        self.doubt(&seen.bodies);
        if self.seen.as_ref().is_some_and(|(at_s, _)| self.now_s - at_s > BREAK_S) {
            self.count.interrupt(self.now_s);
        }
        self.seen = Some((self.now_s, seen));
        match trouble {
            Some(trouble) if self.phase == Phase::Failed => {
                self.trust.trouble = Some(trouble);
                self.trouble_lasts();
            }
            Some(trouble) => self.fail(trouble, actions),
            None if self.phase == Phase::Failed => {
                self.note_entry(&crossings, actions);
                self.recover(blind);
            }
            None => self.watch(&crossings, actions),
        }
    }

    /// Trouble that outlasts a change of the site is no longer that of the change: the lock does what the site says.
    fn trouble_lasts(&mut self) {
        self.trust.well_since_s = None;
        if self.now_s >= self.count.not_before_s {
            self.trust.fail = self.door.fail;
        }
    }

    fn recover(&mut self, blind: bool) {
        if blind {
            self.trust.well_since_s = None;
            return;
        }
        let well_since_s = *self.trust.well_since_s.get_or_insert(self.now_s);
        if self.now_s - well_since_s < SETTLED_S {
            return;
        }
        self.trust.trouble = None;
        self.leaf.begin_anew(self.now_s);
        match self.standing.map(Alarm::ends_with) {
            Some(EndsWith::Reset) => self.go(Cause::StillAlarmed, Phase::Alarmed, Prompt::Called),
            Some(EndsWith::ShutLeaf) => self.go(Cause::StillAlarmed, Phase::HeldOpen, Prompt::LetShut),
            Some(EndsWith::Recovery) | None => self.go(Cause::Recovered, Phase::Idle, Prompt::Ready),
        }
    }

    fn fail(&mut self, trouble: Trouble, actions: &mut Vec<Action>) {
        self.trust.fail = self.door.fail;
        self.trust.trouble = Some(trouble);
        self.trust.well_since_s = None;
        self.of_before |= self.progress.as_ref().is_some_and(|progress| progress.let_in > 0);
        self.end(Outcome::Trouble, "what happens at the door was not known any more", actions);
        self.go(Cause::Trouble, Phase::Failed, Prompt::OutOfOrder);
    }

    fn alarmed(&mut self, alarm: Alarm, card: Option<Card>, actions: &mut Vec<Action>) {
        let cause = match alarm {
            Alarm::Followed => Cause::Followed,
            Alarm::RanIn => Cause::RanIn,
            Alarm::TurnedBack => Cause::TurnedBack,
            Alarm::PassedBack => Cause::PassedBack,
            Alarm::HeldOpen => Cause::HeldOpen,
            Alarm::WentIn | Alarm::Trouble => Cause::WentIn,
        };
        self.stand(alarm, card, actions);
        self.go(cause, Phase::Alarmed, Prompt::Called);
    }

    /// An alarm stands from now on, and the passage under way ends with it, or one without a card.
    fn stand(&mut self, alarm: Alarm, card: Option<Card>, actions: &mut Vec<Action>) {
        if self.progress.is_none() {
            self.passages += 1;
            self.progress = Some(Progress::new(&self.door.name, self.passages, self.now_s, card));
        }
        self.standing = Some(alarm);
        if let Some(progress) = &mut self.progress {
            progress.passage.alarm = Some(alarm);
        }
        let reason = match alarm {
            Alarm::WentIn if self.of_before => LET_IN_BEFORE,
            _ => alarm.words(),
        };
        self.end(Outcome::Alarmed, reason, actions);
    }

    /// Ends the passage under way, if there is one.
    fn end(&mut self, outcome: Outcome, reason: &str, actions: &mut Vec<Action>) {
        let Some(progress) = self.progress.take() else { return };
        let mut passage = progress.passage;
        // A track that was lost in the doorway went in, too, if all did; through a leaf that has not moved none did.
        let has_moved = self.leaf.since_s > passage.begun_s;
        let went_in = outcome == Outcome::Complete && has_moved || !passage.through.is_empty();
        if let Some(card) = passage.card.filter(|_| went_in) {
            self.cards.went_in(card, self.now_s, self.door.passback_s);
        }
        passage.ended_s = self.now_s;
        passage.outcome = outcome;
        reason.clone_into(&mut passage.reason);
        actions.push(Action::Passage(Box::new(passage)));
    }
}

fn refuse(is_good: bool, why: Refusal, actions: &mut Vec<Action>) {
    if !is_good {
        actions.push(Action::Refused(why));
    }
}
