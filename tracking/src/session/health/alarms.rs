//! What is wrong with a module, in words: when an alarm is raised, when it is cleared, and what it says.
//!
//! ```text
//!   condition  ▁▁▁▁█▁▁████████████▁███▁▁▁▁▁▁▁▁▁
//!   alarm      ▁▁▁▁▁▁▁▁▁▁▁▁█████████████████▁▁▁
//!                    └ raise ┘           └clear┘
//! ```
//!
//! | name | raised when |
//! |---|---|
//! | `silent` | nothing came for 3 s, or it has never answered |
//! | `sensor` | the sensor says so, or has not measured for 20 s |
//! | `line` | over a minute, one scan in fifty came damaged from the sensor |
//! | `covered` | over 60° or a quarter of the view, the background was not seen for a minute |
//! | `slow` | for 10 s, less than 80 % of the scans arrived |
//! | `clock-off` | for 10 s, times are uncertain by more than 20 ms, or reports seem late or early |
//! | `dirty` | over a minute, 15 % of the beams returned nothing usable |
//! | `store` | the module cannot store |
//! | `background` | there is none, or it cannot be learned |
//! | `suspect` | the background holds what has the shape of a person |
//! | `watchdog` | the last start was the watchdog's |
//! | `panels` | panels of a floor do not work |
//! | `floor-size` | a floor has other columns or rows than the site says |

use kehai::wire::{Alarms, HealthHead, SensorCode};

use super::doubt::Doubt;
use super::panels::Panels;
use super::statistics::{RATE_US, Statistics};
use crate::alarm::{AlarmKind, AlarmLine};
use crate::explain::alarm::{AlarmCondition, Measured, Unit};
use crate::figures::seconds;
use crate::observation::LATE_S;

const SECOND_US: u64 = 1_000_000;

/// After so long without a datagram a module is silent, µs: two of its healths were lost.
pub const SILENT_US: u64 = 3 * SECOND_US;

/// So long after it was first asked for it must have answered, µs.
const FIRST_US: u64 = 5 * SECOND_US;

/// Time for a sensor to be found, at every speed there is, and set up, µs.
const SENSOR_US: u64 = 20 * SECOND_US;

/// Share of the expected rate under which a module is slow, and from which on it no longer is.
const SLOW: (f64, f64) = (0.8, 0.9);

/// Uncertainty of times from which on people are misplaced: 3 cm at 1.5 m/s, s.
const CLOCK_S: f64 = 0.020;

/// How much earlier than it was taken a scan may seem to arrive, s: three times what clocks are off by at first.
const EARLY_S: f64 = 0.060;

/// Angle over which the background is contradicted, rad: a person at 0.4 m covers 57°.
const COVERED_RAD: f64 = 60.0 * std::f64::consts::PI / 180.0;

/// The same, as a share of a narrow view.
const COVERED_SHARE: f64 = 0.25;

/// Share of the beams that return nothing usable, to raise and to clear.
const DIRTY: (f64, f64) = (0.15, 0.10);

/// Conditions must hold for so long before they are alarms, µs: what passes within seconds needs no repair.
const FAULT_US: u64 = 2 * SECOND_US;
const LINE_US: u64 = 10 * SECOND_US;
const SLOW_US: u64 = 10 * SECOND_US;
const CLOCK_US: u64 = 10 * SECOND_US;
const BACKGROUND_US: u64 = 60 * SECOND_US;

/// Share of damaged scans, to raise and to clear: losing one in fifty costs nothing yet, but a good line loses none.
const LINE: (f64, f64) = (0.02, 0.01);

/// Everything an alarm is decided on.
#[derive(Debug)]
pub struct Facts<'a> {
    pub now_us: u64,
    /// Its name in the site.
    pub name: &'a str,
    /// When it was first asked for.
    pub since_us: u64,
    pub last_heard_us: Option<u64>,
    /// Whether the host wants its reports.
    pub is_subscribed: bool,
    pub health: Option<&'a HealthHead>,
    /// Shapes of people in its background, as it lists them.
    pub shapes: usize,
    /// Those of them that are known where, and not to be furniture.
    pub suspects: usize,
    /// Scans a second that its sensor makes.
    pub expected_hz: Option<f64>,
    pub statistics: &'a Statistics,
    pub doubt: Option<&'a Doubt>,
    /// Whether it hangs head down.
    pub upside_down: bool,
    /// Of a floor: its panels.
    pub panels: Option<&'a Panels>,
    pub jitter_s: Option<f64>,
    /// How old the newest report seemed when it arrived, the scan's own time taken off, s.
    pub age_s: Option<f64>,
}

/// An alarm on its way up or down.
#[derive(Clone, Copy, Debug, Default)]
struct Alarm {
    on: bool,
    /// Since when the condition has been other than the alarm.
    since_us: Option<u64>,
}

impl Alarm {
    /// Whether it is on, after `holds` at `now_us`.
    fn step(&mut self, holds: bool, now_us: u64, raise_us: u64, clear_us: u64) -> bool {
        if holds == self.on {
            self.since_us = None;
            return self.on;
        }
        let since_us = *self.since_us.get_or_insert(now_us);
        let wait_us = if holds { raise_us } else { clear_us };
        if now_us.saturating_sub(since_us) >= wait_us {
            (self.on, self.since_us) = (holds, None);
        }
        self.on
    }

    /// What it is decided on, of a condition that holds or not.
    fn condition(self, kind: AlarmKind, now_us: u64, raise_us: u64, holds: Holds) -> AlarmCondition {
        let Holds { holds, measured } = holds;
        let for_s = self.since_us.map_or(0.0, |since_us| seconds(since_us, now_us));
        AlarmCondition { kind, is_on: self.on, holds, measured, for_s, raise_s: raise_us as f64 * 1e-6 }
    }

    /// `raise` from below, `clear` from above.
    fn bound(self, (raise, clear): (f64, f64)) -> f64 {
        if self.on { clear } else { raise }
    }
}

/// Whether the condition of an alarm holds, and by which figure.
#[derive(Clone, Copy, Debug)]
struct Holds {
    holds: bool,
    measured: Option<Measured>,
}

impl Holds {
    const fn simply(holds: bool) -> Self {
        Self { holds, measured: None }
    }

    const fn by(holds: bool, value: f64, limit: f64, unit: Unit) -> Self {
        Self { holds, measured: Some(Measured { value, limit, unit }) }
    }
}

/// All alarms of a device.
#[derive(Clone, Debug, Default)]
pub struct AlarmSet {
    sensor: Alarm,
    fault: Alarm,
    line: Alarm,
    covered: Alarm,
    slow: Alarm,
    clock: Alarm,
    dirty: Alarm,
    store: Alarm,
    background: Alarm,
}

impl AlarmSet {
    /// What is wrong now, worst first. A module that is silent says nothing about itself: its other alarms end. So do those of one
    /// that is not subscribed to, as it sends neither reports nor health.
    pub fn update(&mut self, facts: &Facts<'_>) -> Vec<AlarmLine> {
        if let Some(text) = silent(facts) {
            *self = Self::default();
            return text.into_iter().map(|text| AlarmLine::new(AlarmKind::Silent, text)).collect();
        }
        if !facts.is_subscribed {
            *self = Self::default();
            return Vec::new();
        }
        let mut lines = Vec::new();
        let mut add = |kind, text: Option<String>| lines.extend(text.map(|text| AlarmLine::new(kind, text)));
        add(AlarmKind::Sensor, self.sensor(facts));
        add(AlarmKind::Line, self.line(facts));
        add(AlarmKind::Covered, self.covered(facts));
        add(AlarmKind::Slow, self.slow(facts));
        add(AlarmKind::ClockOff, self.clock(facts));
        add(AlarmKind::Dirty, self.dirty(facts));
        add(AlarmKind::Store, self.store(facts));
        add(AlarmKind::Background, self.background(facts));
        add(AlarmKind::Suspect, suspect(facts));
        add(AlarmKind::Watchdog, watchdog(facts));
        add(AlarmKind::FloorSize, facts.panels.and_then(Panels::misfit));
        add(AlarmKind::Panels, facts.panels.and_then(Panels::fault));
        lines.sort_by_key(|line| std::cmp::Reverse(line.severity));
        lines
    }

    /// What an alarm is decided on, as `update` has just decided; none where nothing is measured for it.
    pub fn condition(&self, kind: AlarmKind, facts: &Facts<'_>) -> Option<AlarmCondition> {
        let now_us = facts.now_us;
        if kind == AlarmKind::Silent {
            return Some(silent_condition(facts));
        }
        // A module that is silent, or not subscribed to, says nothing about itself.
        if silent(facts).is_some() || !facts.is_subscribed {
            return None;
        }
        let of = |alarm: Alarm, raise_us, holds| Some(alarm.condition(kind, now_us, raise_us, holds));
        let at_once = |holds| {
            Some(Alarm { on: holds, since_us: None }.condition(kind, now_us, 0, Holds::simply(holds)))
        };
        match kind {
            AlarmKind::Sensor => {
                let code = facts.health?.sensor.code;
                let (alarm, raise_us) =
                    if is_faulty(code) { (self.fault, FAULT_US) } else { (self.sensor, SENSOR_US) };
                of(alarm, raise_us, Holds::simply(is_faulty(code) || is_idle(code)))
            }
            AlarmKind::Line => of(self.line, LINE_US, self.line_holds(facts)),
            AlarmKind::Covered => of(self.covered, 0, self.covered_holds(facts.doubt?)),
            AlarmKind::Slow => of(self.slow, SLOW_US, self.slow_holds(facts)?),
            AlarmKind::ClockOff => of(self.clock, CLOCK_US, clock_holds(facts)),
            AlarmKind::Dirty => of(self.dirty, 0, self.dirty_holds(facts.doubt?)),
            AlarmKind::Store => of(self.store, 0, Holds::simply(says(facts, Alarms::STORE_FAILED))),
            AlarmKind::Background => {
                of(self.background, BACKGROUND_US, Holds::simply(has_no_background(facts.health?)))
            }
            AlarmKind::Suspect => at_once(suspect(facts).is_some()),
            AlarmKind::Watchdog => at_once(watchdog(facts).is_some()),
            AlarmKind::FloorSize => at_once(facts.panels?.misfit().is_some()),
            AlarmKind::Panels => at_once(facts.panels?.fault().is_some()),
            _ => None,
        }
    }

    fn line_holds(&self, facts: &Facts<'_>) -> Holds {
        let (share, limit) = (facts.statistics.damaged_share(), self.line.bound(LINE));
        Holds::by(share > limit, share, limit, Unit::DamagedShare)
    }

    fn covered_holds(&self, doubt: &Doubt) -> Holds {
        let (lost_rad, view_rad) = doubt.lost_rad();
        let limit_rad = COVERED_RAD.min(COVERED_SHARE * view_rad);
        let bound_rad = self.covered.bound((limit_rad, 0.5 * limit_rad));
        Holds::by(lost_rad > bound_rad, lost_rad.to_degrees(), bound_rad.to_degrees(), Unit::CoveredDeg)
    }

    fn slow_holds(&self, facts: &Facts<'_>) -> Option<Holds> {
        let (expected_hz, health) = (facts.expected_hz?, facts.health?);
        let measures = health.sensor.code == SensorCode::Streaming && !health.storing;
        let (_, arrived_hz) = facts.statistics.rates_hz();
        let known = facts.statistics.span_us() >= RATE_US;
        let bound_hz = self.slow.bound(SLOW) * expected_hz;
        Some(Holds::by(measures && known && arrived_hz < bound_hz, arrived_hz, bound_hz, Unit::ScansHz))
    }

    fn dirty_holds(&self, doubt: &Doubt) -> Holds {
        let (share, limit) = (doubt.missing_share(), self.dirty.bound(DIRTY));
        Holds::by(share > limit && !self.covered.on, share, limit, Unit::MissingShare)
    }

    fn sensor(&mut self, facts: &Facts<'_>) -> Option<String> {
        let health = facts.health?;
        let code = health.sensor.code;
        let fault = self.fault.step(is_faulty(code), facts.now_us, FAULT_US, 0);
        let silent = self.sensor.step(is_idle(code), facts.now_us, SENSOR_US, 0);
        if !fault && !silent {
            return None;
        }
        let advice = match code {
            SensorCode::Searching | SensorCode::Stalled => "check the sensor's power and its cable",
            SensorCode::Abnormal => "clean its window, let it cool down, then switch it off and on",
            SensorCode::TooLarge => "set a cluster, or first_step and last_step, so that it fits",
            SensorCode::Unusable | SensorCode::Refused => {
                "switch it off and on; if that does not help, replace it"
            }
            _ => "wait, or switch it off and on",
        };
        Some(format!("{code}: {advice}"))
    }

    fn line(&mut self, facts: &Facts<'_>) -> Option<String> {
        let share = facts.statistics.damaged_share();
        let holds = self.line_holds(facts).holds;
        self.line.step(holds, facts.now_us, LINE_US, 0).then(|| {
            let percent = share * 100.0;
            format!("{percent:.0} % of the sensor's scans arrive damaged: check its cable, and keep it off motors and mains")
        })
    }

    fn covered(&mut self, facts: &Facts<'_>) -> Option<String> {
        let doubt = facts.doubt?;
        let (lost_rad, _) = doubt.lost_rad();
        let holds = self.covered_holds(doubt).holds;
        self.covered.step(holds, facts.now_us, 0, 0).then(|| {
            let (first, last) = doubt.lost_between_rad().unwrap_or_default();
            // Of a module that hangs head down, the sensor's left is on the right.
            let (first, last) = if facts.upside_down { (-last, -first) } else { (first, last) };
            format!(
                "over {:.0}°, between {:.0}° and {:.0}° from ahead, it has not seen its background for a minute: something \
                 stands before it, or it was moved; if the room has changed, kehai-tracker module learn {}",
                lost_rad.to_degrees(),
                first.to_degrees(),
                last.to_degrees(),
                quoted(facts.name),
            )
        })
    }

    fn slow(&mut self, facts: &Facts<'_>) -> Option<String> {
        let expected_hz = facts.expected_hz?;
        let (taken_hz, arrived_hz) = facts.statistics.rates_hz();
        let holds = self.slow_holds(facts)?.holds;
        if !self.slow.step(holds, facts.now_us, SLOW_US, 5 * SECOND_US) {
            return None;
        }
        let what = format!("{arrived_hz:.1} of {expected_hz:.1} scans a second arrive");
        Some(if taken_hz < SLOW.1 * expected_hz {
            format!("{what}: the sensor or its line is too slow; raise the line's speed, or set a cluster")
        } else {
            format!("{what}, the others get lost on the network: check cables, switch and Wi-Fi on the way")
        })
    }

    fn clock(&mut self, facts: &Facts<'_>) -> Option<String> {
        let jitter_s = facts.jitter_s.unwrap_or(0.0);
        let age_s = facts.age_s.unwrap_or(0.0);
        let odd = is_odd(age_s);
        if !self.clock.step(clock_holds(facts).holds, facts.now_us, CLOCK_US, 10 * SECOND_US) {
            return None;
        }
        Some(if age_s > LATE_S {
            format!(
                "its reports arrive {:.0} ms late and are not used: the network on the way is overloaded",
                age_s * 1e3
            )
        } else if odd {
            format!("its reports seem to come {:.0} ms before they were made: restart it", -age_s * 1e3)
        } else if jitter_s > CLOCK_S {
            format!(
                "its time is known to {:.0} ms only: the network on the way delays unevenly",
                jitter_s * 1e3
            )
        } else {
            "its sensor's clock cannot be followed to 20 ms: check the sensor's line".to_owned()
        })
    }

    fn dirty(&mut self, facts: &Facts<'_>) -> Option<String> {
        let share = facts.doubt?.missing_share();
        let holds = self.dirty_holds(facts.doubt?).holds;
        self.dirty.step(holds, facts.now_us, 0, 0).then(|| {
            let percent = share * 100.0;
            format!("{percent:.0} % of its beams return nothing usable: clean its window; if it is clean, let it learn anew")
        })
    }

    fn store(&mut self, facts: &Facts<'_>) -> Option<String> {
        self.store.step(says(facts, Alarms::STORE_FAILED), facts.now_us, 0, 0).then(|| {
            "it cannot store settings and background: after a restart it learns anew; replace its board"
                .to_owned()
        })
    }

    fn background(&mut self, facts: &Facts<'_>) -> Option<String> {
        let health = facts.health?;
        if !self.background.step(has_no_background(health), facts.now_us, BACKGROUND_US, 0) {
            return None;
        }
        Some(match health.learning.and_then(|learning| learning.moved) {
            Some((first, last)) => format!(
                "it cannot learn its background, because something moves at steps {first} to {last}: leave its view for a minute"
            ),
            None => format!(
                "it has no background and sees no people: leave its view, then kehai-tracker module learn {}",
                quoted(facts.name)
            ),
        })
    }
}

const fn is_faulty(code: SensorCode) -> bool {
    matches!(code, SensorCode::Abnormal | SensorCode::TooLarge | SensorCode::Unusable | SensorCode::Refused)
}

const fn is_idle(code: SensorCode) -> bool {
    !matches!(code, SensorCode::Streaming | SensorCode::Paused)
}

fn is_odd(age_s: f64) -> bool {
    !(-EARLY_S..=LATE_S).contains(&age_s)
}

fn clock_holds(facts: &Facts<'_>) -> Holds {
    let jitter_s = facts.jitter_s.unwrap_or(0.0);
    let odd = is_odd(facts.age_s.unwrap_or(0.0));
    let holds = says(facts, Alarms::CLOCK_UNCERTAIN) || jitter_s > CLOCK_S || odd;
    Holds::by(holds, jitter_s, CLOCK_S, Unit::ClockS)
}

/// Whether the device itself says so.
fn says(facts: &Facts<'_>, alarm: Alarms) -> bool {
    facts.health.is_some_and(|health| health.alarms.has(alarm))
}

fn has_no_background(health: &HealthHead) -> bool {
    let measures = health.sensor.code == SensorCode::Streaming;
    let none = health.alarms.has(Alarms::NO_BACKGROUND) && health.learning.is_none();
    measures && (none || health.alarms.has(Alarms::LEARNING_WAITS))
}

fn silent_condition(facts: &Facts<'_>) -> AlarmCondition {
    let (since_us, limit_us) =
        facts.last_heard_us.map_or((facts.since_us, FIRST_US), |last_us| (last_us, SILENT_US));
    let (value, limit) = (seconds(since_us, facts.now_us), limit_us as f64 * 1e-6);
    let is_on = silent(facts).flatten().is_some();
    let measured = Some(Measured { value, limit, unit: Unit::SilentS });
    AlarmCondition { kind: AlarmKind::Silent, is_on, holds: is_on, measured, for_s: value, raise_s: limit }
}

/// Some(None): silent, but not for long enough to be said.
fn silent(facts: &Facts<'_>) -> Option<Option<String>> {
    let Some(last_us) = facts.last_heard_us else {
        let asked_us = facts.now_us.saturating_sub(facts.since_us);
        return Some((asked_us >= FIRST_US).then(|| {
            "it has not been found: is it switched on and in this network? kehai-tracker module list shows what is there"
                .to_owned()
        }));
    };
    let silent_us = facts.now_us.saturating_sub(last_us);
    (silent_us >= SILENT_US).then(|| {
        Some("nothing is heard of it any more: check its power, its cable and the switch".to_owned())
    })
}

fn suspect(facts: &Facts<'_>) -> Option<String> {
    let health = facts.health?;
    let is_furniture = facts.shapes > 0 && facts.suspects == 0;
    (health.alarms.has(Alarms::SUSPECTS) && !is_furniture).then(|| {
        format!(
            "its background holds {} with the shape of a person: if a person stood there, kehai-tracker module learn {}; if it is \
             furniture, say so on the map",
            if facts.suspects <= 1 { "something".to_owned() } else { format!("{} things", facts.suspects) },
            quoted(facts.name)
        )
    })
}

fn watchdog(facts: &Facts<'_>) -> Option<String> {
    facts.health?.alarms.has(Alarms::WATCHDOG).then(|| {
        "its firmware hung and its watchdog started it anew; kehai-tracker module restart ends this alarm"
            .to_owned()
    })
}

/// As a shell takes it.
fn quoted(name: &str) -> String {
    let plain = |letter: char| letter.is_alphanumeric() || matches!(letter, '-' | '_' | ':' | '.');
    if !name.is_empty() && name.chars().all(plain) { name.to_owned() } else { format!("'{name}'") }
}
