//! A door with all that is around it: devices with clocks of their own, a transport that delays, repeats and loses, a lock
//! with a lease, a tracker that dies, sleeps and gets other sites. A row of bytes decides what happens.
//!
//! ```text
//!   devices ─▶ transport ─▶ inbox ─▶ machine ─▶ transport ─▶ lock
//!   card, number, contact,   0 to 20 s late,     0 to 20 s late,   open for as long as it is told,
//!   exit, reset; forged ones twice, or never     twice, or never   from its own clock
//! ```
//!
//! What must hold at each twentieth of a second:
//!
//! - the door unlocks only when the tracker has said for half a second that the number entered is the count;
//! - the lock is unlocked at most 2 s after the door was, whatever the transport did;
//! - after a request to leave that arrived, the door is open for as long as the site says, and so is the lock while the
//!   transport is in time;
//! - an alarm outlives each change of the site and each death of the tracker, and no change unlocks;
//! - the door is never unlocked before its contact has said how the leaf is.

use std::collections::BTreeMap;

use kehai_tracking::door::doors::{Doors, Output, Watcher};
use kehai_tracking::door::inbox::Input;
use kehai_tracking::door::{Alarm, Card, Contact, DoorLine, Lock, LockOrder, Phase};
use kehai_tracking::estimate::Estimate;
use kehai_tracking::geometry::Point;
use kehai_tracking::jsonl::{ZoneKnown, ZoneLine};
use kehai_tracking::now::Now;
use kehai_tracking::occupancy::Found;
use kehai_tracking::site::Site;
use kehai_tracking::tracker::{LifeCycle, Origin, TrackState};

use super::lock::{LockDevice, READY_S};

const SITE: &str = "
[[module]]
name = \"left\"
x = -1.5
y = 1.0

[[zone]]
name = \"area\"
polygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
secure = true

[[door]]
name = \"front\"
zone = \"area\"
line = [[-0.45, 1.0], [0.45, 1.0]]
fail = \"secure\"
ask_s = 5
pass_s = 4
close_s = 4
passback_s = 5
";

const TICK_S: f64 = 0.05;
const EXIT_S: f64 = 5.0;
/// The time a person has for the way in, and for the number: as the site says.
const PASS_S: f64 = 4.0 + 3.0 * 6.0;
/// The lock is unlocked at most so long after the door was, s.
const OVER_S: f64 = 2.0;
/// A forged number takes the lock's own place until the lock says its next one, s.
const LOCK_LATE_S: f64 = READY_S + 2.0 * TICK_S;
/// More say nothing new.
const STEPS: usize = 200;

/// Where people stand: before the zone, in it, at the line, beyond it.
const SPOTS: [[f64; 2]; 6] = [[0.0, -1.6], [-0.4, 0.0], [0.4, 0.1], [0.0, 0.85], [0.0, 1.3], [0.2, 2.0]];

/// Something under way, and when it arrives, s.
struct Mail<T>(f64, T);

/// How long a message is under way, s; none: it is lost.
fn delay_s(choice: u8) -> Option<f64> {
    [Some(0.0), Some(0.0), Some(0.05), Some(0.4), Some(3.0), Some(20.0), None, Some(0.0)]
        [usize::from(choice % 8)]
}

struct World {
    now_s: f64,
    /// The tracker's wall clock minus the true one, ms; and the devices'.
    clock_ms: i64,
    devices_ms: i64,
    doors: Option<Doors>,
    starts: u64,
    /// What the database has: the alarms that stand.
    kept: Vec<Alarm>,
    site: Site,
    people: BTreeMap<u64, Point>,
    /// Whether the tracker sees the zone, and the module is used.
    sees: bool,
    hears_module: bool,
    number: u64,
    to_door: Vec<Mail<(Input, String)>>,
    to_lock: Vec<Mail<LockOrder>>,
    orders_late: u8,
    lock: LockDevice,
    judge: Judge,
}

/// What was seen, and what must follow.
#[derive(Default)]
struct Judge {
    /// Since when the number entered is the count, s.
    match_since_s: Option<f64>,
    was: Option<(Phase, Option<Alarm>)>,
    unlocked_since_s: Option<f64>,
    unlocked_s: Option<f64>,
    exit_s: Option<f64>,
    /// The alarm that stands, whether trouble hides it or not.
    standing: Option<Alarm>,
    /// Since when orders arrive in time, s.
    prompt_since_s: f64,
    happened: Happened,
}

/// What the row of bytes has led to.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Happened {
    /// The door was unlocked, and the lock with it.
    pub unlocked: bool,
    /// The lock was open for a person who leaves.
    pub left: bool,
    /// An alarm stood when the tracker was killed, and when it had started again.
    pub restored: bool,
}

impl World {
    fn new() -> Self {
        let mut world = Self {
            now_s: 100.0,
            clock_ms: 0,
            devices_ms: 0,
            doors: None,
            starts: 0,
            kept: Vec::new(),
            site: Site::parse("site", SITE).unwrap(),
            people: BTreeMap::new(),
            sees: true,
            hears_module: true,
            number: 0,
            to_door: Vec::new(),
            to_lock: Vec::new(),
            orders_late: 0,
            lock: LockDevice::default(),
            judge: Judge { prompt_since_s: 100.0, ..Judge::default() },
        };
        world.start();
        world
    }

    fn start(&mut self) {
        self.starts += 1;
        let mut doors = Doors::new(&self.site, self.starts << 20);
        doors.resume(self.kept.iter().map(|alarm| ("front", *alarm)));
        self.doors = Some(doors);
        let line = self.line().unwrap();
        let stood = self.kept.iter().copied().find(|alarm| *alarm != Alarm::Trouble);
        assert_eq!(line.standing, stood, "after a restart: {line:?}");
        self.judge.standing = stood;
        self.judge.happened.restored |= stood.is_some();
    }

    fn kill(&mut self) {
        if let Some(line) = self.line() {
            self.kept = line.alarm.into_iter().chain(line.standing).collect();
        }
        self.doors = None;
        let Judge { unlocked_s, prompt_since_s, happened, .. } = self.judge;
        self.judge = Judge { unlocked_s, prompt_since_s, happened, ..Judge::default() };
    }

    fn now(&self) -> Now {
        let true_ms = 1_700_000_000_000 + (self.now_s * 1e3) as i64;
        Now { steady_s: self.now_s, unix_ms: (true_ms + self.clock_ms) as u64 }
    }

    /// A device sends this with a right number and its own time.
    fn send(&mut self, input: Input, fields: &str, choice: u8) {
        self.number += 1;
        let at_ms = 1_700_000_000_000 + (self.now_s * 1e3) as i64 + self.devices_ms;
        let text = format!("{{\"id\": {}, \"at_ms\": {at_ms}{fields}}}", self.number);
        self.post(input, text, choice);
    }

    fn post(&mut self, input: Input, text: String, choice: u8) {
        let Some(delay_s) = delay_s(choice) else { return };
        if choice & 0x80 != 0 {
            self.to_door.push(Mail(self.now_s + delay_s + 0.3, (input, text.clone())));
        }
        self.to_door.push(Mail(self.now_s + delay_s, (input, text)));
    }

    fn estimate(&self) -> Estimate {
        let track = |(&id, &at): (&u64, &Point)| TrackState {
            id,
            at,
            velocity: Point::new(0.0, 0.5),
            covariance_m2: [0.01, 0.0, 0.01],
            state: LifeCycle::Confirmed,
            existence: 1.0,
            reason: "",
            origin: Origin::Entered,
        };
        let tracks = self.people.iter().map(track).collect();
        let inside = self.count();
        let mut p = vec![0.0; inside + 1];
        p[inside] = 1.0;
        let (seen_share, state) = if self.sees { (1.0, ZoneKnown::Known) } else { (0.0, ZoneKnown::Unknown) };
        let zone = ZoneLine::new(Found::inside(inside as u32, p), seen_share, state);
        let zones = [("area".to_owned(), zone)].into();
        Estimate { t_s: self.now_s, tracks, zones, ..Estimate::default() }
    }

    fn count(&self) -> usize {
        self.people.values().filter(|at| at.y.abs() < 1.0).count()
    }

    fn take(&mut self, outputs: Vec<Output>) {
        for output in outputs {
            let Output::Lock { order, .. } = output else { continue };
            let Some(late_s) = delay_s(self.orders_late) else { continue };
            if self.orders_late & 0x80 != 0 {
                self.to_lock.push(Mail(self.now_s + late_s + 0.7, order));
            }
            self.to_lock.push(Mail(self.now_s + late_s, order));
        }
    }

    fn line(&self) -> Option<DoorLine> {
        self.doors.as_ref()?.lines().next()
    }

    /// A twentieth of a second; frames come each second one.
    fn tick(&mut self, has_frame: bool) {
        self.now_s += TICK_S;
        let now = self.now();
        if let Some(number) = self.lock.ready(self.now_s) {
            self.post(Input::LockReady, format!("{{\"nonce\": {number}}}"), self.orders_late);
        }
        let mut outputs = Vec::new();
        let (due, later) =
            std::mem::take(&mut self.to_door).into_iter().partition(|mail| mail.0 <= self.now_s);
        self.to_door = later;
        let estimate = self.estimate();
        if let Some(doors) = &mut self.doors {
            for Mail(_, (input, text)) in due {
                let told = doors.tell(
                    "front",
                    input,
                    text.as_bytes(),
                    |card| Card(card.len() as u128),
                    now,
                    &mut outputs,
                );
                if input == Input::Reset && told.is_ok() {
                    self.judge.standing = None;
                }
                if input == Input::Exit {
                    assert_eq!(told, Ok(()), "a request to leave: {text}");
                    self.judge.exit_s = Some(self.now_s);
                }
            }
            let watcher = self.hears_module.then_some(Watcher { unused_s: 0.0, has_key: true });
            if has_frame {
                doors.observe(&estimate, |_| watcher, now, &mut outputs);
            } else {
                doors.pass_time(now, &mut outputs);
            }
        }
        self.take(outputs);
        let (due, later) =
            std::mem::take(&mut self.to_lock).into_iter().partition(|mail| mail.0 <= self.now_s);
        self.to_lock = later;
        due.into_iter().for_each(|Mail(_, order): Mail<LockOrder>| self.lock.hear(order));
        let line = self.line();
        if has_frame || self.doors.is_none() {
            self.judge.count(line.as_ref(), self.sees && self.hears_module, self.count(), self.now_s);
        }
        self.judge.judge(line.as_ref(), self.lock.state(self.now_s), self.now_s);
    }

    fn wait(&mut self, seconds: f64) {
        for tick in 0..(seconds / TICK_S) as u32 {
            self.tick(tick % 2 == 0);
        }
    }

    /// The site is changed as the map changes it: refused while the door is in use, and done a moment later.
    fn change(&mut self, what: u8) {
        let (is_race, what) = (what & 0x80 != 0, what % 4);
        let Some(doors) = &self.doors else { return };
        if doors.may_change_site().is_err() && !is_race {
            return;
        }
        let text = match what {
            0 => SITE.to_owned(),
            1 => SITE.replace("[-1, 1]]", "[-1, 1], [-2, 0]]"),
            2 => SITE.replace("\"secure\"", "\"safe\""),
            _ => SITE.replace("x = -1.5", "x = -1.4"),
        };
        self.site = Site::parse("site", &text).unwrap();
        let (before, now) = (self.line(), self.now());
        let mut outputs = Vec::new();
        if let Some(doors) = &mut self.doors {
            doors.change_site(&self.site, now, &mut outputs);
        }
        self.take(outputs);
        let after = self.line();
        if let (Some(before), Some(after)) = (before, after) {
            let stands = !matches!(before.alarm, None | Some(Alarm::Trouble | Alarm::HeldOpen));
            assert!(!stands || after.alarm == before.alarm, "{:?} is forgotten: {after:?}", before.alarm);
            assert_ne!(after.lock, Lock::Unlocked, "after a change: {after:?}");
            assert!(after.lock_id >= before.lock_id, "{after:?}");
        }
        // Back at once: what the door does when it fails is the site's wish, and not judged here.
        if what == 2 {
            self.change(0x80);
        }
    }

    fn step(&mut self, [what, how]: [u8; 2]) {
        match what % 24 {
            0 | 1 => self.send(
                Input::Card,
                if how & 0x40 == 0 { ", \"card\": \"a\"" } else { ", \"card\": \"bb\"" },
                how,
            ),
            2 | 3 => {
                let number = if how & 0x40 == 0 { self.count() } else { usize::from(how % 5) };
                self.send(Input::Number, &format!(", \"number\": {number}"), how);
            }
            4 => self.send(Input::Contact, ", \"contact\": \"open\"", how),
            5 => self.send(Input::Contact, ", \"contact\": \"shut\"", how),
            6 => self.send(Input::Exit, "", how),
            7 => self.send(Input::Reset, "", how),
            8 => {
                // Anything, by anybody: no true number of the lock among it.
                let (input, _) = Input::NAMED[usize::from(how) % Input::NAMED.len()];
                let text = [
                    format!(
                        "{{\"id\": {}, \"at_ms\": {}, \"contact\": \"shut\"}}",
                        u64::MAX,
                        self.now().unix_ms
                    ),
                    format!("{{\"id\": 1, \"at_ms\": {}, \"number\": 1}}", self.now().unix_ms + 4900),
                    format!("{{\"nonce\": {how}}}"),
                    format!("{{\"taken\": {}}}", self.starts << 20 | u64::from(how)),
                    String::new(),
                ];
                self.post(input, text[usize::from(how) % text.len()].clone(), 0);
            }
            9..=14 => {
                let id = u64::from(what % 24) % 3 + 1;
                self.people.insert(id, SPOTS[usize::from(how) % SPOTS.len()].into());
                self.wait(0.2);
            }
            15 => drop(self.people.remove(&(u64::from(how) % 3 + 1))),
            16 => self.sees = how % 4 != 0,
            17 => self.hears_module = how % 4 != 0,
            18 => self.change(how),
            19 => match how % 4 {
                0 => self.kill(),
                1 => {
                    self.lock.restart();
                    self.judge.prompt_since_s = self.judge.prompt_since_s.max(self.now_s);
                }
                // The machine sleeps, and everything with it but time and the lock.
                2 => {
                    self.now_s += f64::from(how) * 4.0;
                    self.judge.exit_s = None;
                    self.judge.prompt_since_s = self.judge.prompt_since_s.max(self.now_s);
                }
                _ => {
                    if self.doors.is_none() {
                        self.start();
                    }
                }
            },
            20 => match how % 3 {
                0 => self.clock_ms = i64::from(how) * 1000 - 100_000,
                1 => self.devices_ms = 6000,
                _ => (self.clock_ms, self.devices_ms) = (0, 0),
            },
            21 => {
                self.orders_late = how;
                self.judge.prompt_since_s = f64::INFINITY;
            }
            22 => {
                self.orders_late = 0;
                // What is under way is forgotten, else it would go on for 20 s.
                self.to_door.clear();
                self.to_lock.clear();
                self.judge.prompt_since_s = self.now_s + 1.0;
            }
            _ => {}
        }
        self.wait(f64::from(how % 16) * 0.2);
    }
}

impl Judge {
    /// Notes whether the tracker said that the number entered is the count.
    fn count(&mut self, line: Option<&DoorLine>, is_known: bool, count: usize, now_s: f64) {
        let matches = line.is_some_and(|line| line.entered as usize == count && count > 0) && is_known;
        self.match_since_s = if matches { self.match_since_s.or(Some(now_s)) } else { None };
    }

    fn judge(&mut self, line: Option<&DoorLine>, lock: Lock, now_s: f64) {
        let phase = line.map(|line| line.phase);
        if phase == Some(Phase::Unlocked) {
            if self.was.is_none_or(|(was, _)| was != Phase::Unlocked) {
                let since_s = self.match_since_s.expect("unlocked while the number was not the count");
                assert!(now_s - since_s > 0.4, "unlocked after {} s", now_s - since_s);
                assert!(
                    line.is_some_and(|line| line.contact.is_some()),
                    "unlocked, and the leaf is not known"
                );
                self.unlocked_since_s = Some(now_s);
            }
            let for_s = now_s - self.unlocked_since_s.unwrap();
            assert!(for_s < PASS_S + 1.0, "unlocked for {for_s} s");
            self.unlocked_s = Some(now_s);
        }
        self.happened.unlocked |= lock == Lock::Unlocked;
        self.happened.left |= lock == Lock::Exit;
        if lock == Lock::Unlocked {
            let over_s = now_s - self.unlocked_s.expect("the lock is open, the door never was");
            assert!(over_s <= OVER_S, "the lock is open {over_s} s after the door was");
        }
        if let (Some(line), Some(exit_s)) = (line, self.exit_s)
            && now_s - exit_s < EXIT_S - TICK_S
        {
            assert_ne!(line.lock, Lock::Locked, "shut {} s after a request to leave", now_s - exit_s);
            if now_s > exit_s + LOCK_LATE_S && exit_s > self.prompt_since_s + 2.0 {
                assert_ne!(
                    lock,
                    Lock::Locked,
                    "the lock is shut {} s after a request to leave",
                    now_s - exit_s
                );
            }
        }
        if let Some(line) = line {
            let stands = match line.phase {
                Phase::Failed => line.standing,
                _ => line.alarm,
            };
            let is_over = match self.standing {
                None => true,
                Some(Alarm::HeldOpen) => stands.is_some() || line.contact == Some(Contact::Shut),
                Some(_) => stands.is_some(),
            };
            assert!(is_over, "{:?} is over by itself: {line:?}", self.standing);
            self.standing = stands;
        }
        self.was = line.map(|line| (line.phase, line.alarm));
    }
}

/// Lets all of it happen.
pub fn drive(bytes: &[u8]) -> Happened {
    let mut world = World::new();
    world.wait(3.0);
    for step in bytes.chunks_exact(2).take(STEPS) {
        world.step([step[0], step[1]]);
    }
    world.wait(3.0);
    world.judge.happened
}
