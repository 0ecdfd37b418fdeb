//! The door itself: events and `now` in, actions out.
//!
//! ```text
//!   step(event, now) = what time has brought ─▶ the event ─▶ outputs that are due
//!
//!   lock:  unlocked │ failed, and the site says "safe" ─▶ unlocked
//!          somebody has asked to leave                 ─▶ exit
//!          everything else                             ─▶ locked
//! ```
//!
//! It unlocks only from `checking`, when P(count = number entered) has been at least [`SURE`] and the share of the zone
//! that was seen at least [`SEEN`], for [`STEADY_S`] on end.

use serde::{Deserialize, Serialize};

use super::cards::Cards;
use super::event::{Action, Alarm, Body, Card, Contact, Event, Lock, Refusal, Seen, Trouble};
use super::gate::{Crossing, Gate, is_apart};
use super::names::Name;
use super::output::Output;
use super::passage::Outcome;
use super::progress::Progress;
use super::transition::{Cause, Phase};
use crate::site::Site;
use crate::site_door::{Door, Fail};

/// Least probability that the number entered is the count.
pub const SURE: f64 = 0.95;

/// Least share of the zone that was seen in the last 2 s.
pub const SEEN: f64 = 0.95;

/// Both must hold for so long on end, s: five lines, so that no flicker of the count opens a door.
pub const STEADY_S: f64 = 0.5;

/// Without a line from the tracker for so long nothing is known, s.
pub const NO_FRAMES_S: f64 = 1.0;

/// Trouble must be over for so long, s.
pub const SETTLED_S: f64 = 2.0;

/// Somebody of whom nobody can say that it is somebody, for so long in the zone, s, makes the count unsure; gone for so
/// long, s, it was a shred.
const DOUBT_S: f64 = 0.6;
const DOUBT_GAP_S: f64 = 0.35;

/// The leaf must be shut for so long before a passage is over, s: what the tracker knows is up to 0.3 s old.
const SHUT_S: f64 = 0.5;

/// With less of the zone seen than this, nobody would notice who comes.
const BLIND: f64 = 0.3;

/// Blind for so long is trouble, s.
const BLIND_S: f64 = 2.0;

/// How sure it is that whoever stands nearest to the reader has shown the card, m: an arm's length.
const REACH_M: f64 = 0.6;

/// How a door is, for everybody who shows it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DoorLine {
    /// Its name.
    pub name: String,
    /// Where it is.
    pub phase: Phase,
    /// What the lock is to be.
    pub lock: Lock,
    /// Number of that output, and whether the lock has taken it.
    pub lock_id: u64,
    /// Whether the lock has taken it.
    pub lock_taken: bool,
    /// Why there is an alarm, if there is one.
    pub alarm: Option<Alarm>,
    /// Number of that output.
    pub alarm_id: u64,
    /// Whether the alarm has taken it.
    pub alarm_taken: bool,
    /// What is wrong, while it has failed.
    pub trouble: Option<Trouble>,
    /// Whether the leaf is shut; none: nobody has said.
    pub contact: Option<Contact>,
    /// The number entered last.
    pub entered: u32,
    /// Most people who may be entered.
    pub people_max: u32,
    /// How many have gone through.
    pub through: u32,
    /// Numbers that may still be tried.
    pub tries_left: u32,
    /// Counts passages.
    pub passage: u64,
    /// What the entrant is to do, in words.
    pub prompt: String,
    /// Which track showed which card, so probably.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub names: Vec<Name>,
}

/// A door.
#[derive(Clone, Debug)]
pub struct Machine {
    door: Door,
    gate: Gate,
    phase: Phase,
    since_s: f64,
    now_s: f64,
    progress: Option<Progress>,
    passages: u64,
    cards: Cards,
    lock: Output<Lock>,
    alarm: Output<Option<Alarm>>,
    standing: Option<Alarm>,
    trouble: Option<Trouble>,
    well_since_s: Option<f64>,
    blind_since_s: Option<f64>,
    match_since_s: Option<f64>,
    doubted_s: f64,
    doubt_since_s: Option<f64>,
    seen: Option<(f64, Seen)>,
    contact: Option<Contact>,
    contact_since_s: f64,
    open_since_s: Option<f64>,
    exit_until_s: f64,
    prompt: String,
    taken: Vec<(Phase, Cause, Phase)>,
}

impl Machine {
    /// A door of a site, locked or not as it fails, until the tracker has been well for 2 s. None without its zone.
    #[must_use]
    pub fn new(door: &Door, site: &Site) -> Option<Self> {
        let zone = site.zones.iter().find(|zone| zone.name == door.zone)?;
        let mut machine = Self {
            gate: Gate::new(door.ends(), zone.corners()),
            door: door.clone(),
            phase: Phase::Failed,
            since_s: 0.0,
            now_s: 0.0,
            progress: None,
            passages: 0,
            cards: Cards::default(),
            lock: Output::new(Lock::Locked),
            alarm: Output::new(Some(Alarm::Trouble)),
            standing: None,
            trouble: Some(Trouble::Starting),
            well_since_s: None,
            blind_since_s: None,
            match_since_s: None,
            doubted_s: f64::NEG_INFINITY,
            doubt_since_s: None,
            seen: None,
            contact: None,
            contact_since_s: 0.0,
            open_since_s: None,
            exit_until_s: f64::NEG_INFINITY,
            prompt: "The door is starting: please wait".to_owned(),
            taken: Vec::new(),
        };
        machine.lock.set(machine.wanted());
        Some(machine)
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
            Event::Contact(contact) => self.contact(contact),
            Event::Exit => self.exit_until_s = self.now_s + self.door.exit_s,
            Event::Seen(seen) => self.see(seen, &mut actions),
            Event::LockTaken(id) => refuse(self.lock.take(id), Refusal::OldAcknowledgement, &mut actions),
            Event::AlarmTaken(id) => refuse(self.alarm.take(id), Refusal::OldAcknowledgement, &mut actions),
            Event::Reset => self.reset(&mut actions),
            Event::Time => {}
        }
        self.lock.set(self.wanted());
        self.alarm.set(match self.phase {
            Phase::Failed => Some(Alarm::Trouble),
            Phase::HeldOpen => Some(Alarm::HeldOpen),
            _ => self.standing,
        });
        if let Some((id, lock)) = self.lock.due(self.now_s) {
            actions.push(Action::Lock { id, lock });
        }
        if let Some((id, alarm)) = self.alarm.due(self.now_s) {
            actions.push(Action::Alarm { id, alarm });
        }
        actions
    }

    /// Where it is.
    #[must_use]
    pub const fn phase(&self) -> Phase {
        self.phase
    }

    /// What the lock is to be.
    #[must_use]
    pub const fn lock(&self) -> Lock {
        self.lock.value()
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

    /// How it is.
    #[must_use]
    pub fn line(&self) -> DoorLine {
        let number = |value: usize| u32::try_from(value).unwrap_or(u32::MAX);
        let passage = self.progress.as_ref().map(|progress| &progress.passage);
        DoorLine {
            name: self.door.name.clone(),
            phase: self.phase,
            lock: self.lock.value(),
            lock_id: self.lock.id(),
            lock_taken: self.lock.is_taken(),
            alarm: self.alarm.value(),
            alarm_id: self.alarm.id(),
            alarm_taken: self.alarm.is_taken(),
            trouble: self.trouble,
            contact: self.contact,
            entered: passage.map_or(0, |passage| passage.entered),
            people_max: self.door.people_max,
            through: passage.map_or(0, |passage| number(passage.through.len())),
            tries_left: self.door.tries_max.saturating_sub(passage.map_or(0, |passage| passage.tries)),
            passage: self.passages,
            prompt: self.prompt.clone(),
            names: Vec::new(),
        }
    }

    fn wanted(&self) -> Lock {
        match self.phase {
            Phase::Unlocked => Lock::Unlocked,
            Phase::Failed if self.door.fail == Fail::Safe => Lock::Unlocked,
            _ if self.now_s < self.exit_until_s => Lock::Exit,
            _ => Lock::Locked,
        }
    }

    fn go(&mut self, cause: Cause, to: Phase, prompt: &str) {
        // Nobody asks for them on a running door: the last few are enough for anybody who looks.
        if self.taken.len() >= 64 {
            self.taken.clear();
        }
        self.taken.push((self.phase, cause, to));
        self.phase = to;
        self.since_s = self.now_s;
        self.match_since_s = None;
        self.prompt = prompt.to_owned();
    }

    /// What time alone brings.
    fn pass_time(&mut self, actions: &mut Vec<Action>) {
        let passed_s = self.now_s - self.since_s;
        let silent = self.seen.as_ref().is_none_or(|(at_s, _)| self.now_s - at_s > NO_FRAMES_S);
        if silent && self.phase != Phase::Failed {
            self.fail(Trouble::NoFrames, actions);
            return;
        }
        if silent {
            self.well_since_s = None;
        }
        match self.phase {
            Phase::Asked if passed_s >= self.door.ask_s => {
                self.end(Outcome::GaveUp, "nobody entered a number", actions);
                self.go(Cause::Timeout, Phase::Idle, READY);
            }
            Phase::Checking if passed_s >= self.door.check_s => self.mismatch(actions),
            Phase::Unlocked => {
                let more = self.progress.as_ref().map_or(0, |progress| progress.let_in.saturating_sub(1));
                if passed_s >= self.door.pass_s + self.door.next_s * more as f64 {
                    self.go(Cause::Timeout, Phase::Closing, "The door is closing");
                }
            }
            _ => {}
        }
        let is_long_open = match (self.phase, self.open_since_s) {
            (Phase::Closing, _) => self.now_s - self.since_s >= self.door.close_s,
            (Phase::Idle | Phase::Asked | Phase::Checking, Some(since_s)) => {
                // Somebody who leaves has the time for it.
                self.now_s - since_s.max(self.exit_until_s) >= self.door.close_s
            }
            _ => false,
        };
        if is_long_open {
            if self.phase != Phase::Closing {
                self.end(Outcome::HeldOpen, "the leaf does not shut", actions);
            }
            self.go(Cause::HeldOpen, Phase::HeldOpen, "Please let the door shut");
        }
    }

    fn card(&mut self, card: Card, actions: &mut Vec<Action>) {
        let inside = self.cards.is_inside(card, self.now_s, self.door.passback_s);
        let own = self.progress.as_ref().and_then(|progress| progress.passage.card);
        match self.phase {
            Phase::Idle if inside => self.alarmed(Alarm::PassedBack, Some(card), actions),
            Phase::Idle => {
                self.passages += 1;
                self.progress = Some(Progress::new(&self.door.name, self.passages, self.now_s, Some(card)));
                self.identify(card, actions);
                self.go(Cause::Card, Phase::Asked, "How many people go in?");
            }
            Phase::Asked | Phase::Checking if own == Some(card) => {
                actions.push(Action::Refused(Refusal::SameCard));
            }
            Phase::Unlocked | Phase::Closing | Phase::HeldOpen if inside || own == Some(card) => {
                self.alarmed(Alarm::PassedBack, Some(card), actions);
            }
            Phase::Asked | Phase::Checking | Phase::Unlocked | Phase::Closing => {
                actions.push(Action::Refused(Refusal::Busy));
            }
            Phase::HeldOpen | Phase::Alarmed | Phase::Failed => {
                actions.push(Action::Refused(Refusal::NotNow));
            }
        }
    }

    /// Whoever stands nearest to the reader has shown the card, the surer the nearer and the more alone.
    fn identify(&self, card: Card, actions: &mut Vec<Action>) {
        let Some((_, seen)) = &self.seen else { return };
        let reader = self.door.reader.map_or_else(|| self.gate.middle(), Into::into);
        let weight = |body: &Body| {
            let away = (body.at - reader).length() / REACH_M;
            (body.id, libm::exp(-0.5 * away * away))
        };
        let weights: Vec<(u64, f64)> = seen
            .bodies
            .iter()
            .filter(|body| body.is_sure && self.gate.in_zone(body.at))
            .map(weight)
            .collect();
        let sum: f64 = weights.iter().map(|(_, weight)| weight).sum();
        if sum > f64::MIN_POSITIVE {
            actions.extend(weights.into_iter().map(|(track, weight)| Action::Named {
                track,
                card,
                likelihood: weight / sum,
            }));
        }
    }

    fn number(&mut self, number: u32, actions: &mut Vec<Action>) {
        let refusal = match self.phase {
            Phase::Asked | Phase::Checking if !(1..=self.door.people_max).contains(&number) => {
                Refusal::Number
            }
            Phase::Asked => {
                if let Some(progress) = &mut self.progress {
                    progress.passage.entered = number;
                    progress.passage.tries += 1;
                }
                self.go(Cause::Number, Phase::Checking, "Please wait: counting");
                return;
            }
            Phase::Idle => Refusal::NoCard,
            Phase::Checking | Phase::Unlocked | Phase::Closing => Refusal::Busy,
            Phase::HeldOpen | Phase::Alarmed | Phase::Failed => Refusal::NotNow,
        };
        actions.push(Action::Refused(refusal));
    }

    fn contact(&mut self, contact: Contact) {
        if self.contact != Some(contact) {
            self.contact_since_s = self.now_s;
            self.open_since_s = (contact == Contact::Open).then_some(self.now_s);
        }
        self.contact = Some(contact);
    }

    fn reset(&mut self, actions: &mut Vec<Action>) {
        if self.standing.is_none() {
            actions.push(Action::Refused(Refusal::NoAlarm));
            return;
        }
        self.standing = None;
        self.open_since_s = self.open_since_s.map(|_| self.now_s);
        if self.phase == Phase::Alarmed {
            self.go(Cause::Reset, Phase::Idle, READY);
        }
    }

    fn see(&mut self, seen: Seen, actions: &mut Vec<Action>) {
        let blind = seen.seen_share < BLIND;
        let blind_s = self.now_s - *self.blind_since_s.get_or_insert(self.now_s);
        if !blind {
            self.blind_since_s = None;
        }
        let trouble = seen.trouble.or((blind && blind_s >= BLIND_S).then_some(Trouble::Unseen));
        let crossings = self.gate.see(&seen.bodies, self.now_s);
        self.doubt(&seen.bodies);
        self.seen = Some((self.now_s, seen));
        match trouble {
            Some(trouble) if self.phase == Phase::Failed => {
                self.trouble = Some(trouble);
                self.well_since_s = None;
            }
            Some(trouble) => self.fail(trouble, actions),
            None if self.phase == Phase::Failed => self.recover(blind),
            None => self.watch(&crossings, actions),
        }
    }

    fn recover(&mut self, blind: bool) {
        if blind {
            self.well_since_s = None;
            return;
        }
        let well_since_s = *self.well_since_s.get_or_insert(self.now_s);
        if self.now_s - well_since_s < SETTLED_S {
            return;
        }
        self.trouble = None;
        self.open_since_s = self.open_since_s.map(|_| self.now_s);
        match self.standing {
            Some(_) => self.go(Cause::StillAlarmed, Phase::Alarmed, CALL),
            None => self.go(Cause::Recovered, Phase::Idle, READY),
        }
    }

    fn watch(&mut self, crossings: &[Crossing], actions: &mut Vec<Action>) {
        match self.phase {
            Phase::Checking => self.check(),
            Phase::Unlocked | Phase::Closing | Phase::HeldOpen => self.follow(crossings, actions),
            Phase::Idle | Phase::Asked | Phase::Alarmed | Phase::Failed => {}
        }
        let nobody_let_in = match self.phase {
            Phase::Idle | Phase::Asked | Phase::Checking => true,
            Phase::HeldOpen => self.progress.is_none(),
            _ => false,
        };
        // A track that changes sides of a shut leaf is the tracker's mistake, nobody's entry.
        let is_open = self.contact == Some(Contact::Open);
        if nobody_let_in && is_open && crossings.iter().any(|way| matches!(way, Crossing::Inward(_))) {
            self.alarmed(Alarm::WentIn, None, actions);
        }
        let is_shut = self.contact == Some(Contact::Shut) && self.now_s - self.contact_since_s >= SHUT_S;
        if is_shut && matches!(self.phase, Phase::Closing | Phase::HeldOpen) {
            self.shut(actions);
        }
    }

    /// The leaf has been shut for so long that whoever slipped in is known.
    fn shut(&mut self, actions: &mut Vec<Action>) {
        let is_complete = self.progress.as_ref().is_some_and(Progress::is_complete);
        let (outcome, reason) = match (self.phase, is_complete) {
            (Phase::HeldOpen, _) => (Outcome::HeldOpen, "the leaf did not shut in time"),
            (_, true) => (Outcome::Complete, "all went through"),
            (_, false) => (Outcome::Fewer, "fewer went through than were let in"),
        };
        self.end(outcome, reason, actions);
        self.go(Cause::Shut, Phase::Idle, READY);
    }

    /// Notes whether somebody may be in the zone of whom nobody can say so: who touches another, or crouches.
    fn doubt(&mut self, bodies: &[Body]) {
        let shade = |body: &Body| !body.is_sure && self.gate.in_zone(body.at) && is_apart(body, bodies);
        if bodies.iter().any(shade) {
            self.doubted_s = self.now_s;
            self.doubt_since_s.get_or_insert(self.now_s);
        } else if self.now_s - self.doubted_s > DOUBT_GAP_S {
            self.doubt_since_s = None;
        }
    }

    fn is_in_doubt(&self) -> bool {
        self.doubt_since_s.is_some_and(|since_s| self.now_s - since_s >= DOUBT_S)
    }

    fn check(&mut self) {
        let in_doubt = self.is_in_doubt();
        let (Some((_, seen)), Some(progress)) = (&self.seen, &mut self.progress) else { return };
        let entered = progress.passage.entered;
        let probability = seen.count_p.get(entered as usize).copied().unwrap_or(0.0);
        progress.passage.count_p.clone_from(&seen.count_p);
        progress.passage.seen_share = seen.seen_share;
        if in_doubt || !(probability >= SURE && seen.seen_share >= SEEN) {
            self.match_since_s = None;
            return;
        }
        let since_s = *self.match_since_s.get_or_insert(self.now_s);
        if self.now_s - since_s >= STEADY_S {
            progress.unlock(entered, &seen.bodies, &self.gate);
            self.go(Cause::Match, Phase::Unlocked, "Please go in");
        }
    }

    fn mismatch(&mut self, actions: &mut Vec<Action>) {
        let Some(progress) = &self.progress else { return };
        let passage = &progress.passage;
        let best = passage.count_p.iter().copied().enumerate().max_by(|one, other| one.1.total_cmp(&other.1));
        let text = match best {
            _ if passage.seen_share < SEEN => {
                "Not all of the area is seen: please move a little and enter the number again"
            }
            Some((count, p)) if p >= SURE && count as u32 != passage.entered => {
                "The number does not match: please count again and enter it"
            }
            _ => "The count is not sure yet: please stand a little apart and enter the number again",
        };
        if passage.tries >= self.door.tries_max {
            self.end(Outcome::Refused, "the number never matched the count", actions);
            self.go(
                Cause::TooOften,
                Phase::Idle,
                "The number did not match: please begin again with the card",
            );
        } else {
            self.go(Cause::Mismatch, Phase::Asked, text);
        }
    }

    fn follow(&mut self, crossings: &[Crossing], actions: &mut Vec<Action>) {
        let (Some((_, seen)), Some(progress)) = (&self.seen, &mut self.progress) else { return };
        let crossed = progress.cross(crossings);
        let watched = progress.watch(&seen.bodies, &self.gate, self.now_s);
        // While the leaf closes the next ones may come into the zone, and the group may turn away.
        let alarm = crossed.or(watched.filter(|_| self.phase == Phase::Unlocked));
        let is_complete = progress.is_complete();
        if let Some(alarm) = alarm {
            self.alarmed(alarm, None, actions);
        } else if self.phase == Phase::Unlocked && is_complete {
            self.go(Cause::AllThrough, Phase::Closing, "The door is closing");
        }
    }

    fn fail(&mut self, trouble: Trouble, actions: &mut Vec<Action>) {
        self.trouble = Some(trouble);
        self.well_since_s = None;
        self.end(Outcome::Trouble, "what happens at the door was not known any more", actions);
        self.go(Cause::Trouble, Phase::Failed, "The door is out of order: please call somebody");
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
        if self.progress.is_none() {
            self.passages += 1;
            self.progress = Some(Progress::new(&self.door.name, self.passages, self.now_s, card));
        }
        self.standing = Some(alarm);
        if let Some(progress) = &mut self.progress {
            progress.passage.alarm = Some(alarm);
        }
        self.end(Outcome::Alarmed, words(alarm), actions);
        self.go(cause, Phase::Alarmed, CALL);
    }

    /// Ends the passage under way, if there is one.
    fn end(&mut self, outcome: Outcome, reason: &str, actions: &mut Vec<Action>) {
        let Some(progress) = self.progress.take() else { return };
        let mut passage = progress.passage;
        if let Some(card) = passage.card.filter(|_| !passage.through.is_empty()) {
            self.cards.went_in(card, self.now_s);
        }
        passage.ended_s = self.now_s;
        passage.outcome = outcome;
        reason.clone_into(&mut passage.reason);
        actions.push(Action::Passage(Box::new(passage)));
    }
}

const READY: &str = "Please show your card";
const CALL: &str = "Alarm: somebody has been called";

const fn words(alarm: Alarm) -> &'static str {
    match alarm {
        Alarm::Followed => "more went in than were let in",
        Alarm::RanIn => "somebody came into the zone while the door was unlocked",
        Alarm::TurnedBack => "somebody of the group turned back while the door was unlocked",
        Alarm::PassedBack => "a card that had just gone in was shown again",
        Alarm::WentIn => "somebody went in whom nobody had let in",
        Alarm::HeldOpen => "the leaf does not shut",
        Alarm::Trouble => "what happens at the door is not known",
    }
}

fn refuse(is_good: bool, why: Refusal, actions: &mut Vec<Action>) {
    if !is_good {
        actions.push(Action::Refused(why));
    }
}
