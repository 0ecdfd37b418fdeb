//! The simulation loop of a passage, and its report.
//!
//! ```text
//!   every 0.1 s:  people up to now + 0.35 s ─▶ datagrams up to now ─▶ tracks ─▶ door ─▶ lock, for people from now + 0.35 s on
//! ```
//!
//! Sensors compute a scan up to two revolutions before it is sent, so the world is computed some time ahead. The
//! leaf obeys the door's actions that much later, like a real drive.

use std::sync::Arc;

use crate::baselines::Choice;
use kehai_tracking::door::{
    Action, Alarm, Card, Contact, Event, Lock, Machine, Passage, Phase, Seen, Trouble,
};
use kehai_tracking::site::door::{Door as GuardedDoor, Fail};
use kehai_tracking::site_tracker::SiteTracker;
use parking_lot::Mutex;

use super::cast::{Cast, FROM_S};
use super::{Plan, Rule};
use crate::run::{Options, Run, TICK_US};
use crate::world::crowd::STEP_S;
use crate::world::door::LiveDoor;
use crate::world::geometry::Outline;
use crate::world::moving::Moving;
use crate::world::random::{Purpose, Stream};
use crate::world::scene::Scene;
use crate::world::visit::DOOR_Y_M;
use crate::world::{More, World, obstacles};

/// Time by which the world is computed ahead of the sensors, s: two revolutions and the transmission of a scan.
const AHEAD_S: f64 = 0.35;

/// Time from the last person's arrival to the card, and from the card to the number, s.
const CARD_S: f64 = 0.5;
const NUMBER_S: f64 = 1.5;

/// Time for which a passage is watched after its end, s.
const AFTER_S: f64 = 2.5;

/// No passage is watched for longer, s.
const LONGEST_S: f64 = 80.0;

/// A module that has been silent for so long is lost, s.
const LOST_S: f64 = kehai_tracking::door::MODULE_LOST_S;

/// Outcome of a passage.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Report {
    /// When the door was unlocked first, s.
    pub unlocked_s: Option<f64>,
    /// How often the number was asked for again.
    pub asked_again: u32,
    /// Time from which the extra person was in the zone with the door unlocked: their crossing begins, s.
    pub extra_begins_s: Option<f64>,
    /// Time at which the extra person crossed the line inward, s.
    pub extra_in_s: Option<f64>,
    /// The first alarm but trouble, and when, s.
    pub alarm: Option<(f64, Alarm)>,
    /// How many of the group are in.
    pub members_in: usize,
    /// When the door noticed that a module was lost, s after it was.
    pub lost_noticed_s: Option<f64>,
    /// Whether the lock was locked then.
    pub lost_locked: bool,
    /// The records.
    pub passages: Vec<Passage>,
    /// Whether a number one too low would have unlocked the door as well.
    pub low_accepted: bool,
}

/// The site of all passages: paper A's, and its door.
///
/// # Errors
/// The built-in scene is broken.
pub fn scene() -> Result<Scene, String> {
    let mut scene = Scene::load("passage").map_err(|error| error.to_string())?;
    scene.site.doors.push(GuardedDoor {
        fail: Fail::Secure,
        ..GuardedDoor::new("front", "area", [[-0.45, DOOR_Y_M], [0.45, DOOR_Y_M]])
    });
    scene.site.zones.iter_mut().for_each(|zone| zone.secure = true);
    scene.site.check()?;
    Ok(scene)
}

/// A leaf and the drive that moves it.
struct Leaf {
    live: LiveDoor,
    share: f64,
}

impl Leaf {
    /// One step of 10 ms.
    fn step(&mut self, wants_open: bool, in_doorway: bool) {
        let step = STEP_S / self.live.door.takes_s.max(STEP_S);
        let moved = match (wants_open, in_doorway) {
            (true, _) => step,
            // The light barrier holds it.
            (false, true) => 0.0,
            (false, false) => -step,
        };
        self.share = (self.share + moved).clamp(0.0, 1.0);
        self.live.shares.lock().push(self.share);
    }
}

/// Runs a passage under `seed`.
///
/// # Errors
/// A fault of the simulation, in one line.
pub fn run(plan: Plan, seed: u64, choice: Choice) -> Result<Report, String> {
    let mut scene = scene()?;
    let door = scene.doors.pop().ok_or("the passage has no door")?;
    let walls = obstacles(&scene);
    let (mut cast, people, props) = Cast::new(plan, seed)?;
    let live = LiveDoor { door, shares: Arc::new(Mutex::new(Vec::new())) };
    let mut leaf = Leaf { live: live.clone(), share: 0.0 };
    let props = props.into_iter().map(|prop| Moving::Prop(Box::new(prop)));
    let moving = std::iter::once(Moving::Live(live)).chain(props).collect();
    let world = World::with(&scene, seed, More { people, moving, ..More::default() });
    let mut run = Run::of(world, seed, &Options::default());
    let site = Arc::new(scene.site.clone());
    let mut site_tracker = SiteTracker::new(&site, choice);
    let guarded = site.doors.first().ok_or("the site has no door")?;
    let mut machine = Machine::new(guarded, &site, 1).ok_or("the door has no zone")?;
    let mut entrant = Entrant::new(plan, seed);
    let mut report = Report::default();
    let mut wants_open = false;
    let mut done_s = f64::INFINITY;
    let mut tick = 0;
    loop {
        let now_us = tick * TICK_US;
        let now_s = now_us as f64 * 1e-6;
        if now_s > done_s.min(LONGEST_S) {
            break;
        }
        while cast.now_s() < now_s + AHEAD_S {
            let share = leaf.share;
            let leaf_now = leaf.live.door.outline_at(share);
            let all: Vec<Outline> = walls.iter().copied().chain([leaf_now]).collect();
            cast.step(share, &all);
            leaf.step(wants_open, cast.in_doorway());
            if report.unlocked_s.is_some() && cast.extra_is_in_zone() {
                report.extra_begins_s.get_or_insert(cast.now_s());
            }
        }
        for arrival in run.until(now_us).map_err(|stuck| format!("seed {seed}: {stuck:?}"))? {
            if !entrant.has_lost(usize::from(arrival.module)) {
                site_tracker.receive(&arrival.bytes, arrival.at_us);
            }
        }
        tick += 1;
        // Before the first person comes, only the health of the door is checked.
        if now_s < FROM_S - 3.0 {
            continue;
        }
        let lost = site_tracker
            .sessions()
            .iter()
            .any(|session| now_us.saturating_sub(session.last_report_us()) as f64 * 1e-6 > LOST_S);
        let estimate = site_tracker.estimate(now_s);
        let zone = estimate.zones.get(machine.zone());
        let seen = Seen::of(&estimate.tracks, zone, lost.then_some(Trouble::ModuleLost));
        entrant.low(&seen, now_s);
        let is_shut = leaf.share < 0.02;
        let contact = if is_shut { Contact::Shut } else { Contact::Open };
        let mut events = vec![Event::Contact(contact), Event::Seen(seen)];
        events.extend(entrant.next(&mut cast, machine.phase(), now_s));
        for event in events {
            for action in machine.step(event, now_s) {
                entrant.hear(&action, now_s, &mut report);
                match action {
                    Action::Lock(order) => wants_open = order.lock != Lock::Locked,
                    Action::Passage(passage) => report.passages.push(*passage),
                    _ => {}
                }
            }
        }
        for (_, cause, to) in machine.transitions() {
            match to {
                Phase::Unlocked => entrant.unlocked(now_s, &mut report),
                Phase::Asked if cause == kehai_tracking::door::Cause::Mismatch => {
                    report.asked_again += 1;
                    cast.rearrange();
                }
                Phase::Failed => entrant.noticed(now_s, machine.lock(), &mut report),
                _ => {}
            }
        }
        let over = entrant.is_over(&report, machine.phase(), is_shut);
        if over && done_s.is_infinite() {
            done_s = now_s + AFTER_S;
        }
    }
    report.members_in = cast.members_in().len();
    report.extra_in_s = cast.extra_in_s();
    report.low_accepted = entrant.low_accepted;
    Ok(report)
}

/// The actor that shows the card and enters the number.
struct Entrant {
    plan: Plan,
    card: Card,
    number: u32,
    card_due_s: f64,
    number_due_s: f64,
    shown: u32,
    again_due_s: f64,
    /// A module, and the time from which its datagrams are lost.
    loses: Option<(usize, f64)>,
    after_unlock_s: f64,
    lost: bool,
    /// Since when a number one too low, entered at the same time, would have been plausible.
    low_since_s: Option<f64>,
    low_accepted: bool,
    asked: bool,
    phase: Phase,
}

impl Entrant {
    fn new(plan: Plan, seed: u64) -> Self {
        let mut stream = Stream::new(seed, Purpose::Crowd, [99, 17]);
        let people = plan.people as u32;
        let number = match plan.rule {
            Rule::WrongNumber if people > 1 && seed.is_multiple_of(2) => people - 1,
            Rule::WrongNumber => people + 1,
            _ => people,
        };
        let loses = (plan.rule == Rule::ModuleLost).then_some(((seed % 2) as usize, f64::INFINITY));
        Self {
            plan,
            card: Card(u128::from(seed | 1)),
            number,
            card_due_s: f64::INFINITY,
            number_due_s: f64::INFINITY,
            shown: 0,
            again_due_s: f64::INFINITY,
            loses,
            after_unlock_s: stream.between(0.0, 1.5),
            lost: false,
            low_since_s: None,
            low_accepted: false,
            asked: false,
            phase: Phase::Failed,
        }
    }

    const fn has_lost(&self, module: usize) -> bool {
        self.lost && matches!(self.loses, Some((lost, _)) if lost == module)
    }

    /// The entrant's next actions.
    fn next(&mut self, cast: &mut Cast, phase: Phase, now_s: f64) -> Vec<Event> {
        let mut events = Vec::new();
        self.lost |= self.loses.is_some_and(|(_, from_s)| now_s >= from_s);
        if self.shown == 0 && self.card_due_s.is_infinite() && cast.is_waiting() {
            self.card_due_s = now_s + CARD_S;
        }
        if now_s >= self.card_due_s && phase == Phase::Idle {
            self.card_due_s = f64::INFINITY;
            self.shown += 1;
            self.number_due_s = now_s + NUMBER_S;
            events.push(Event::Card(self.card));
        }
        if phase == Phase::Asked && self.phase == Phase::Checking {
            self.number_due_s = now_s + NUMBER_S;
        }
        self.phase = phase;
        if now_s >= self.number_due_s && phase == Phase::Asked {
            self.number_due_s = f64::INFINITY;
            self.asked = true;
            events.push(Event::Number(self.number));
        }
        // The card comes back to the next person in the hall; they wait until the door is shut.
        if self.plan.rule == Rule::CardBack
            && self.shown == 1
            && !cast.members_in().is_empty()
            && phase == Phase::Idle
        {
            cast.call_next = true;
            if cast.next_is_here() && self.again_due_s.is_infinite() {
                self.again_due_s = now_s + CARD_S;
            }
            if now_s >= self.again_due_s {
                self.shown += 1;
                events.push(Event::Card(self.card));
            }
        }
        events
    }

    /// Tests whether a number one too low would have been accepted by now.
    fn low(&mut self, seen: &Seen, now_s: f64) {
        use kehai_tracking::door::machine::{SEEN, STEADY_S, SURE};
        if !(self.asked && self.phase == Phase::Checking && self.plan.people > 1) {
            self.low_since_s = None;
            return;
        }
        let p = seen.count_p.get(self.plan.people - 1).copied().unwrap_or(0.0);
        if p < SURE || seen.seen_share < SEEN {
            self.low_since_s = None;
            return;
        }
        let since_s = *self.low_since_s.get_or_insert(now_s);
        self.low_accepted |= now_s - since_s >= STEADY_S;
    }

    fn hear(&mut self, action: &Action, now_s: f64, report: &mut Report) {
        if let Action::Alarm { alarm: Some(alarm), .. } = action
            && *alarm != Alarm::Trouble
            && report.alarm.is_none()
        {
            report.alarm = Some((now_s, *alarm));
        }
    }

    fn unlocked(&mut self, now_s: f64, report: &mut Report) {
        report.unlocked_s.get_or_insert(now_s);
        if let Some((_, from_s)) = &mut self.loses {
            *from_s = now_s + self.after_unlock_s;
        }
    }

    fn noticed(&self, now_s: f64, lock: Lock, report: &mut Report) {
        if let Some((_, from_s)) = self.loses.filter(|(_, from_s)| now_s >= *from_s) {
            report.lost_noticed_s = Some(now_s - from_s);
            report.lost_locked = lock == Lock::Locked;
        }
    }

    fn is_over(&self, report: &Report, phase: Phase, is_shut: bool) -> bool {
        match self.plan.rule {
            Rule::CardBack => report.alarm.is_some() || self.shown > 1,
            Rule::HeldOpen => report.alarm.is_some(),
            Rule::ModuleLost => report.lost_noticed_s.is_some(),
            _ => !report.passages.is_empty() && (is_shut || phase == Phase::Alarmed),
        }
    }
}
