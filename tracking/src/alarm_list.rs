//! The list of alarms: since when each stands, who has acknowledged it, and which ended within the last day.
//!
//! ```text
//!                ╭────────────────────────── acknowledge ─────────────╮
//!   begins ─▶ unacknowledged ─────────────▶ ended ◀─ ends ── acknowledged
//!                ▲                                │
//!                ╰──────── begins again ──────────╯     as another, unacknowledged
//! ```
//!
//! Alarms come as what is on at each time, in words that may change while they stand. Those of a process that has ended go on
//! if they come up again soon. Time is an argument: what is listed has ms since 1970; how long alarms of before are waited for is
//! measured on a clock that no step of the wall clock moves. Source of the states: ISA-18.2.

use std::collections::VecDeque;
use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::alarm::{Active, AlarmKind, Cause, Severity, Source};
use crate::door;
use crate::now::Now;

/// An alarm that has ended is listed for so long, ms: a day.
pub const LISTED_MS: u64 = 86_400_000;

/// Ended alarms that are listed at most: one that comes and goes each minute leaves as many in half a day.
const ENDED_MAX: usize = 1000;

/// An alarm of before a restart goes on if it comes up within this, s: the slowest is raised after a minute of its cause,
/// and devices are found within seconds.
const RESUME_S: f64 = 120.0;

/// What an alarm is about, without its name.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum About {
    /// The tracker itself.
    #[default]
    Tracker,
    /// A device.
    Module,
    /// A door.
    Door,
    /// A zone.
    Zone,
    /// An area of a large site, or its tracker.
    Area,
}

/// Who has seen an alarm, and when.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Acknowledged {
    /// Who.
    pub by: String,
    /// ms since 1970.
    pub at_ms: u64,
}

/// An alarm, as it is listed and written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ListedAlarm {
    /// Its number: another each time it begins.
    #[serde(default)]
    pub id: u64,
    /// What it is about.
    #[serde(rename = "source", default)]
    pub about: About,
    /// The name of the device, door or zone.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub of: String,
    /// Why, for programs.
    #[serde(rename = "name", default = "unknown")]
    pub cause: Cause,
    /// How much that takes away.
    #[serde(default)]
    pub severity: Severity,
    /// What it is and what to do, in words.
    pub text: String,
    /// When it began, ms since 1970.
    #[serde(default)]
    pub since_ms: u64,
    /// When it ended, ms since 1970; absent while it stands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_ms: Option<u64>,
    /// Who has acknowledged it; absent until then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acknowledged: Option<Acknowledged>,
}

const fn unknown() -> Cause {
    Cause::Fault(AlarmKind::Unknown)
}

impl ListedAlarm {
    /// What it is about.
    #[must_use]
    pub fn source(&self) -> Source {
        match self.about {
            About::Tracker => Source::Tracker,
            About::Module => Source::Device(self.of.clone()),
            About::Door => Source::Door(self.of.clone()),
            About::Zone => Source::Zone(self.of.clone()),
            About::Area => Source::Area(self.of.clone()),
        }
    }

    /// The door and what its alarm is, if this is one of a door, and stands.
    #[must_use]
    pub fn of_door(&self) -> Option<(&str, door::Alarm)> {
        match (self.about, self.cause, self.until_ms) {
            (About::Door, Cause::Door(alarm), None) => Some((&self.of, alarm)),
            _ => None,
        }
    }

    fn new(id: u64, alarm: Active, since_ms: u64) -> Self {
        let (about, of) = match alarm.source {
            Source::Tracker => (About::Tracker, String::new()),
            Source::Device(name) => (About::Module, name),
            Source::Door(name) => (About::Door, name),
            Source::Zone(name) => (About::Zone, name),
            Source::Area(name) => (About::Area, name),
        };
        let (cause, severity, text) = (alarm.cause, alarm.cause.severity(), alarm.text);
        Self { id, about, of, cause, severity, text, since_ms, until_ms: None, acknowledged: None }
    }

    fn is(&self, alarm: &Active) -> bool {
        self.cause == alarm.cause && self.source() == alarm.source
    }
}

impl fmt::Display for ListedAlarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.source(), self.cause.name())
    }
}

/// What became of an alarm.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Became {
    /// It has begun.
    Raised,
    /// A user has acknowledged it.
    Acknowledged,
    /// It is over.
    Ended,
}

/// Why nothing was acknowledged.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum NotAcknowledged {
    /// There is none of this number.
    #[error("there is no alarm {0}")]
    Unknown(u64),
    /// It does not stand any more.
    #[error("alarm {id} ({name}) is over: only one that stands is acknowledged")]
    Over {
        /// Its number.
        id: u64,
        /// What it was.
        name: String,
    },
    /// Another tracker lists it, that of an area.
    #[error(
        "alarm {id} ({name}) is listed by the tracker of an area: open the map of that area and acknowledge it there; that an area is not heard ends by itself once it is heard"
    )]
    Elsewhere {
        /// Its number.
        id: u64,
        /// What it is.
        name: String,
    },
}

/// The alarms that stand, and those that have ended.
#[derive(Clone, Debug)]
pub struct AlarmList {
    standing: Vec<ListedAlarm>,
    /// The newest last.
    ended: VecDeque<ListedAlarm>,
    /// Those of before that may come up again.
    resumed: Vec<ListedAlarm>,
    /// When the process before knew something last, ms since 1970, and until when its alarms may come up again, s on the steady
    /// clock.
    resume: (u64, Option<f64>),
    next_id: u64,
    /// Whether other trackers list these alarms, and take what is acknowledged.
    are_others: bool,
}

impl AlarmList {
    /// Without alarms; the first will have this number.
    #[must_use]
    pub const fn new(first_id: u64) -> Self {
        Self {
            standing: Vec::new(),
            ended: VecDeque::new(),
            resumed: Vec::new(),
            resume: (0, None),
            next_id: first_id,
            are_others: false,
        }
    }

    /// Goes on with the alarms of a process that knew something at `known_ms` last.
    pub fn resume(&mut self, alarms: impl IntoIterator<Item = ListedAlarm>, known_ms: u64) {
        let (standing, mut ended): (Vec<_>, Vec<_>) =
            alarms.into_iter().partition(|alarm| alarm.until_ms.is_none());
        ended.sort_by_key(|alarm| alarm.until_ms);
        let newest = standing.iter().chain(&ended).map(|alarm| alarm.id).max().unwrap_or_default();
        self.next_id = self.next_id.max(newest.saturating_add(1));
        self.resumed = standing;
        self.ended = ended.into();
        self.resume = (known_ms, None);
    }

    /// Those that stood when that process ended, and have not come up again.
    #[must_use]
    pub fn resumed(&self) -> &[ListedAlarm] {
        &self.resumed
    }

    /// Goes on to the alarms that are on now; what has changed. One that goes on in other words has not.
    pub fn observe(
        &mut self,
        now: Now,
        active: impl IntoIterator<Item = Active>,
    ) -> Vec<(Became, ListedAlarm)> {
        let Now { steady_s, unix_ms: now_ms } = now;
        let (known_ms, until_s) = self.resume;
        let until_s = until_s.unwrap_or(steady_s + RESUME_S);
        self.resume = (known_ms, Some(until_s));
        let mut changes = Vec::new();
        let before = std::mem::take(&mut self.standing);
        let mut gone: Vec<Option<ListedAlarm>> = before.into_iter().map(Some).collect();
        for alarm in active {
            // Two devices of one name are one here: the alarm does not say which of them it is.
            if let Some(known) = self.standing.iter_mut().find(|known| known.is(&alarm)) {
                known.text = alarm.text;
                continue;
            }
            let same = |known: &ListedAlarm| known.is(&alarm);
            let known = gone.iter_mut().find(|known| known.as_ref().is_some_and(same)).and_then(Option::take);
            let known = known.or_else(|| {
                let place = self.resumed.iter().position(same)?;
                Some(self.resumed.swap_remove(place))
            });
            if let Some(mut known) = known {
                known.text = alarm.text;
                self.standing.push(known);
                continue;
            }
            let begun = ListedAlarm::new(self.next_id, alarm, now_ms);
            self.next_id = self.next_id.saturating_add(1);
            self.standing.push(begun.clone());
            changes.push((Became::Raised, begun));
        }
        self.standing.sort_by_key(|alarm| (alarm.since_ms, alarm.id));
        let missed = if steady_s >= until_s { std::mem::take(&mut self.resumed) } else { Vec::new() };
        let missed = missed.into_iter().map(|alarm| (alarm, known_ms));
        for (mut alarm, ended_ms) in gone.into_iter().flatten().map(|alarm| (alarm, now_ms)).chain(missed) {
            alarm.until_ms = Some(ended_ms.max(alarm.since_ms));
            self.ended.push_back(alarm.clone());
            changes.push((Became::Ended, alarm));
        }
        self.forget(now_ms);
        changes
    }

    /// Shows the alarms that other trackers list: these stand at `now_ms`, with their numbers; what stood and is not among them has ended.
    pub fn show(&mut self, now_ms: u64, standing: Vec<ListedAlarm>) {
        self.are_others = true;
        let before = std::mem::replace(&mut self.standing, standing);
        for mut alarm in before {
            if self.standing.iter().all(|known| known.id != alarm.id) {
                alarm.until_ms = Some(now_ms.max(alarm.since_ms));
                self.ended.push_back(alarm);
            }
        }
        self.forget(now_ms);
    }

    /// Forgets what ended too long ago, and of too many the oldest.
    fn forget(&mut self, now_ms: u64) {
        while self.ended.len() > ENDED_MAX || self.ended.front().is_some_and(|alarm| is_old(alarm, now_ms)) {
            self.ended.pop_front();
        }
    }

    /// Acknowledges these; all of them or none. The first user who acknowledged one stays noted.
    ///
    /// # Errors
    /// The first that does not stand, or that another tracker lists.
    pub fn acknowledge(
        &mut self,
        ids: &[u64],
        by: &str,
        now_ms: u64,
    ) -> Result<Vec<ListedAlarm>, NotAcknowledged> {
        for &id in ids {
            let standing = self.standing.iter().find(|alarm| alarm.id == id);
            if let Some(alarm) = standing.filter(|_| self.are_others) {
                return Err(NotAcknowledged::Elsewhere { id, name: alarm.to_string() });
            }
            if standing.is_none() {
                let over = self.ended.iter().chain(&self.resumed).find(|alarm| alarm.id == id);
                return Err(over.map_or(NotAcknowledged::Unknown(id), |alarm| NotAcknowledged::Over {
                    id,
                    name: alarm.to_string(),
                }));
            }
        }
        let mut acknowledged = Vec::new();
        for alarm in self.standing.iter_mut().filter(|alarm| ids.contains(&alarm.id)) {
            if alarm.acknowledged.is_none() {
                alarm.acknowledged = Some(Acknowledged { by: by.to_owned(), at_ms: now_ms });
                acknowledged.push(alarm.clone());
            }
        }
        Ok(acknowledged)
    }

    /// Those that stand, the oldest first.
    #[must_use]
    pub fn standing(&self) -> &[ListedAlarm] {
        &self.standing
    }

    /// Those that ended within the last day, the newest first.
    pub fn ended(&self) -> impl Iterator<Item = &ListedAlarm> {
        self.ended.iter().rev()
    }
}

fn is_old(alarm: &ListedAlarm, now_ms: u64) -> bool {
    alarm.until_ms.is_none_or(|until_ms| until_ms.saturating_add(LISTED_MS) < now_ms)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RESUME_MS: u64 = (RESUME_S * 1e3) as u64;

    fn at(unix_ms: u64) -> Now {
        Now { steady_s: unix_ms as f64 / 1e3, unix_ms }
    }

    fn of(source: Source, cause: Cause, text: &str) -> Active {
        Active { source, cause, text: text.into() }
    }

    fn slow(text: &str) -> Active {
        of(Source::Device("left".into()), Cause::Fault(AlarmKind::Slow), text)
    }

    fn held_open() -> Active {
        of(Source::Door("front".into()), Cause::Door(door::Alarm::HeldOpen), "shut it")
    }

    fn became(changes: &[(Became, ListedAlarm)]) -> Vec<(Became, u64)> {
        changes.iter().map(|(became, alarm)| (*became, alarm.id)).collect()
    }

    #[test]
    fn an_alarm_begins_once_and_ends_once_whatever_its_text() {
        let mut list = AlarmList::new(7);
        assert_eq!(became(&list.observe(at(100), [slow("4 of 10")])), [(Became::Raised, 7)]);
        assert_eq!(list.observe(at(200), [slow("3 of 10")]), []);
        let alarm = &list.standing()[0];
        assert_eq!(
            (alarm.text.as_str(), alarm.since_ms, alarm.severity),
            ("3 of 10", 100, Severity::Degraded)
        );
        let other = Active { source: Source::Tracker, ..slow("3 of 10") };
        assert_eq!(became(&list.observe(at(300), [other])), [(Became::Raised, 8), (Became::Ended, 7)]);
        let ended: Vec<_> = list.ended().map(|alarm| (alarm.id, alarm.since_ms, alarm.until_ms)).collect();
        assert_eq!(ended, [(7, 100, Some(300))]);
    }

    #[test]
    fn an_acknowledged_alarm_that_ends_and_comes_again_is_unacknowledged() {
        let mut list = AlarmList::new(1);
        list.observe(at(100), [slow("…"), held_open()]);
        let acknowledged = list.acknowledge(&[1], "anna", 150).unwrap();
        assert_eq!(acknowledged[0].acknowledged, Some(Acknowledged { by: "anna".into(), at_ms: 150 }));
        assert_eq!(list.acknowledge(&[1], "ben", 160), Ok(vec![]), "the first user stays noted");
        list.observe(at(200), [slow("…"), held_open()]);
        assert_eq!(list.standing()[0].acknowledged.as_ref().unwrap().by, "anna");
        list.observe(at(300), [held_open()]);
        list.observe(at(400), [held_open(), slow("…")]);
        let last = list.standing().last().unwrap();
        assert_eq!((last.id, last.since_ms, &last.acknowledged), (3, 400, &None));
        let over = NotAcknowledged::Over { id: 1, name: "module left: slow".into() };
        assert_eq!(list.acknowledge(&[3, 1], "ben", 500), Err(over));
        assert_eq!(list.standing().last().unwrap().acknowledged, None, "all or none");
        assert_eq!(list.acknowledge(&[9], "ben", 500), Err(NotAcknowledged::Unknown(9)));
    }

    #[test]
    fn an_alarm_that_stood_before_a_restart_goes_on_or_ended_with_it() {
        let mut before = AlarmList::new(1);
        before.observe(at(100), [slow("…"), held_open()]);
        before.acknowledge(&[1], "anna", 150).unwrap();
        let mut after = AlarmList::new(1);
        after.resume(before.standing().to_vec(), 900);
        assert_eq!(after.observe(at(1000), []), []);
        assert_eq!(after.standing(), []);
        assert_eq!(after.observe(at(1000 + RESUME_MS - 1), [slow("…")]), []);
        let alarm = &after.standing()[0];
        assert_eq!((alarm.since_ms, alarm.acknowledged.as_ref().unwrap().by.as_str()), (100, "anna"));
        let changes = after.observe(at(1000 + RESUME_MS), [slow("…")]);
        assert_eq!((became(&changes), changes[0].1.until_ms), (vec![(Became::Ended, 2)], Some(900)));
        let raised = after.observe(at(200_000), [slow("…"), held_open()]);
        assert_eq!(became(&raised), [(Became::Raised, 3)], "numbers are not given twice");
    }

    #[test]
    fn an_alarm_of_before_a_restart_goes_on_over_a_step_of_the_clock() {
        for step_ms in [-10_000_i64, 50_000_000] {
            let mut before = AlarmList::new(1);
            before.observe(at(100), [slow("…")]);
            before.acknowledge(&[1], "anna", 150).unwrap();
            let mut after = AlarmList::new(1);
            after.resume(before.standing().to_vec(), 900);
            assert_eq!(after.observe(at(20_000), []), []);
            let stepped =
                |steady_ms: u64| Now { unix_ms: steady_ms.saturating_add_signed(step_ms), ..at(steady_ms) };
            assert_eq!(after.observe(stepped(40_000), []), [], "by {step_ms} ms");
            assert_eq!(after.observe(stepped(41_000), [slow("…")]), [], "by {step_ms} ms");
            assert_eq!(after.standing()[0].acknowledged.as_ref().unwrap().by, "anna");
        }
    }

    #[test]
    fn ended_alarms_are_listed_for_a_day_and_so_many_at_most() {
        let mut list = AlarmList::new(1);
        for time in 0..2 * ENDED_MAX as u64 + 10 {
            list.observe(at(time), (time % 2 == 0).then(held_open));
        }
        assert_eq!(list.ended().count(), ENDED_MAX);
        list.observe(at(LISTED_MS + 2010), []);
        assert_eq!(list.ended().next(), None);
    }

    #[test]
    fn alarms_of_other_trackers_are_shown_with_their_numbers_and_acknowledged_there() {
        let mut area = AlarmList::new(7);
        area.observe(at(100), [slow("…"), held_open()]);
        let mut list = AlarmList::new(1);
        list.show(200, area.standing().to_vec());
        assert_eq!(list.standing(), area.standing());
        let elsewhere = NotAcknowledged::Elsewhere { id: 7, name: "module left: slow".into() };
        let said = elsewhere.to_string();
        assert!(said.contains("module left: slow") && said.contains("open the map of that area"), "{said}");
        assert_eq!(list.acknowledge(&[7], "anna", 250), Err(elsewhere));
        area.observe(at(300), [held_open()]);
        list.show(400, area.standing().to_vec());
        let ended: Vec<_> = list.ended().map(|alarm| (alarm.id, alarm.until_ms)).collect();
        assert_eq!((list.standing().len(), ended), (1, vec![(7, Some(400))]));
        assert!(matches!(list.acknowledge(&[7], "anna", 500), Err(NotAcknowledged::Over { .. })));
    }

    #[test]
    fn a_listed_alarm_survives_being_written_and_read_and_one_of_before_is_read() {
        let mut list = AlarmList::new(1);
        list.observe(at(100), [slow("…"), held_open()]);
        list.acknowledge(&[2], "anna", 150).unwrap();
        for alarm in list.standing() {
            let text = serde_json::to_string(alarm).unwrap();
            assert_eq!(serde_json::from_str::<ListedAlarm>(&text).unwrap(), *alarm, "{text}");
        }
        let old = r#"{"name":"database","severity":"failed","text":"disk full"}"#;
        let old: ListedAlarm = serde_json::from_str(old).unwrap();
        assert_eq!((old.source(), old.cause.name()), (Source::Tracker, "database"));
    }
}
