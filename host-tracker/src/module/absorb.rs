//! A thing that a module sees, and that stays, becomes a part of its background.
//!
//! ```text
//!   report ─▶ things that stand out: bearing, range, still for so long ─▶ one of them ─▶ absorbed
//! ```
//!
//! Only what has been still for five seconds is absorbed: a person who stops to look moves within less.

use std::time::{Duration, Instant};

use kehai::background::Absorb;
use kehai::candidate::Candidate;
use kehai::wire::{Message, Report, Request, SensorInfo};
use schemars::JsonSchema;
use serde::Serialize;

use super::ModuleError;
use crate::net::client::{Client, Reaction};

/// A module that reports at all does so within this: its slowest sensor measures once a second.
const PATIENCE: Duration = Duration::from_secs(5);

/// Time for which a thing must not have moved, 0.1 s: a person who stops to look moves within less.
const STILL_DS: u16 = 50;

/// A thing's ranges may differ by this much from those of the report, mm: five times the range noise.
const MARGIN_MM: u16 = 50;

/// What a step is in degrees.
#[derive(Clone, Copy, Debug)]
struct Turn {
    front_step: u16,
    steps_per_turn: u16,
}

impl Turn {
    fn of(sensor: &SensorInfo<'_>) -> Self {
        Self { front_step: sensor.front_step, steps_per_turn: sensor.steps_per_turn.max(1) }
    }

    fn bearing_deg(self, step: u16) -> f64 {
        (f64::from(step) - f64::from(self.front_step)) * 360.0 / f64::from(self.steps_per_turn)
    }
}

/// A thing that stands out from the background.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Thing {
    wish: Absorb,
    first_deg: f64,
    last_deg: f64,
    range_m: f64,
    still_s: f64,
    is_still: bool,
}

impl Thing {
    fn new(candidate: &Candidate, sequence: u32, turn: Turn) -> Self {
        let contour_mm = (0..candidate.contour.len()).filter_map(|point| candidate.contour_mm(point));
        let others_mm = [candidate.first_mm, candidate.mid_mm, candidate.last_mm];
        let farthest_mm = contour_mm.chain(others_mm).max().unwrap_or(candidate.near_mm);
        let wish = Absorb {
            sequence,
            first_step: candidate.first_step,
            last_step: candidate.last_step,
            nearest_mm: candidate.near_mm.saturating_sub(MARGIN_MM),
            farthest_mm: farthest_mm.saturating_add(MARGIN_MM),
        };
        Self {
            wish,
            first_deg: turn.bearing_deg(candidate.first_step),
            last_deg: turn.bearing_deg(candidate.last_step),
            range_m: f64::from(candidate.near_mm) * 1e-3,
            still_s: f64::from(candidate.static_ds) * 0.1,
            is_still: candidate.static_ds >= STILL_DS,
        }
    }

    fn middle_deg(&self) -> f64 {
        (self.first_deg + self.last_deg) / 2.0
    }
}

impl std::fmt::Display for Thing {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.0}° at {:.2} m, still for {:.1} s", self.middle_deg(), self.range_m, self.still_s)
    }
}

/// What was absorbed.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Absorbed {
    /// Its middle, degrees from the module's front, counter-clockwise.
    pub bearing_deg: f64,
    /// How far it is, m.
    pub range_m: f64,
    /// How many beams see the new background.
    pub beams: u16,
    /// The background's version after that.
    pub background_version: u16,
}

/// What stands out from the background, for people.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Thing")]
pub struct Seen {
    /// Its middle, degrees from the module's front, counter-clockwise.
    pub bearing_deg: f64,
    /// How far it is, m.
    pub range_m: f64,
    /// For how long it has not moved, s.
    pub still_s: f64,
    /// Whether that is long enough to be absorbed.
    pub is_still: bool,
}

/// What stands out from the background now.
///
/// # Errors
/// [`ModuleError`].
pub fn things(client: &mut Client) -> Result<Vec<Seen>, ModuleError> {
    let turn = turn(client)?;
    let thing = |thing: &Thing| Seen {
        bearing_deg: thing.middle_deg(),
        range_m: thing.range_m,
        still_s: thing.still_s,
        is_still: thing.is_still,
    };
    Ok(seen(client, turn)?.iter().map(thing).collect())
}

/// Absorbs the thing at this bearing, degrees; without one, the only thing there is.
///
/// # Errors
/// [`ModuleError`].
pub fn absorb(client: &mut Client, bearing: Option<f64>) -> Result<Absorbed, ModuleError> {
    let turn = turn(client)?;
    let thing = choose(&seen(client, turn)?, bearing).map_err(ModuleError::NotAbsorbed)?;
    let (beams, background_version) =
        client.ask(Request::Absorb(thing.wish), |_, message| match message {
            Message::Absorbed { beams, background_version, .. } => Some((*beams, *background_version)),
            _ => None,
        })?;
    Ok(Absorbed { bearing_deg: thing.middle_deg(), range_m: thing.range_m, beams, background_version })
}

fn turn(client: &mut Client) -> Result<Turn, ModuleError> {
    let turn = client.ask(Request::Info, |_, message| match message {
        Message::Info(info) => Some(info.sensor.as_ref().map(Turn::of)),
        _ => None,
    })?;
    turn.ok_or(ModuleError::NoSensor)
}

/// What stands out in the next report.
fn seen(client: &mut Client, turn: Turn) -> Result<Vec<Thing>, ModuleError> {
    let of = |report: &Report<'_>| {
        report.candidates.iter().map(|one| Thing::new(&one, report.head.sequence, turn)).collect()
    };
    let seen = client.watch(Some(Instant::now() + PATIENCE), |message| match message {
        Message::Report(report) => Some(Reaction::Done(of(report))),
        _ => None,
    })?;
    seen.ok_or(ModuleError::NoReports)
}

/// The thing that is meant.
fn choose(things: &[Thing], bearing: Option<f64>) -> Result<Thing, String> {
    let list = || things.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ");
    let thing = match (things, bearing) {
        ([], _) => {
            return Err("nothing stands out from the background: there is nothing to absorb".to_owned());
        }
        ([thing], None) => *thing,
        (_, None) => {
            return Err(format!("{} things stand out: {}; choose one by its bearing", things.len(), list()));
        }
        (_, Some(bearing)) => {
            let there = |thing: &&Thing| (thing.first_deg..=thing.last_deg).contains(&bearing);
            let found = things.iter().find(there);
            *found.ok_or_else(|| format!("nothing stands out at {bearing}°, but: {}", list()))?
        }
    };
    if thing.is_still {
        Ok(thing)
    } else {
        let still_s = f64::from(STILL_DS) * 0.1;
        Err(format!("it moves ({thing}): only what has been still for {still_s:.0} s is absorbed"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const URG: Turn = Turn { front_step: 384, steps_per_turn: 1024 };

    fn thing(first_step: u16, static_ds: u16) -> Thing {
        let candidate = Candidate {
            first_step,
            last_step: first_step + 60,
            first_mm: 950,
            mid_mm: 900,
            last_mm: 1000,
            near_mm: 890,
            static_ds,
            ..Candidate::default()
        };
        Thing::new(&candidate, 7, URG)
    }

    #[test]
    fn a_thing_is_absorbed_with_its_steps_and_ranges() {
        let chair = thing(354, 60);
        assert_eq!(choose(&[chair], None), Ok(chair));
        let wish =
            Absorb { sequence: 7, first_step: 354, last_step: 414, nearest_mm: 840, farthest_mm: 1050 };
        assert_eq!(chair.wish, wish);
        assert_eq!(chair.to_string(), "0° at 0.89 m, still for 6.0 s");
    }

    #[test]
    fn one_of_several_is_chosen_by_its_bearing() {
        let (left, right) = (thing(500, 60), thing(200, 60));
        let refused = choose(&[right, left], None).unwrap_err();
        assert!(
            refused.starts_with("2 things stand out: -54° at 0.89 m, still for 6.0 s; 51° at"),
            "{refused}"
        );
        assert_eq!(choose(&[right, left], Some(50.0)), Ok(left));
        assert!(
            choose(&[right, left], Some(0.0)).unwrap_err().starts_with("nothing stands out at 0°, but: ")
        );
        assert!(choose(&[], Some(0.0)).unwrap_err().starts_with("nothing stands out from the background"));
    }

    #[test]
    fn what_moves_is_not_absorbed() {
        let refused = choose(&[thing(354, 49)], None).unwrap_err();
        assert_eq!(
            refused,
            "it moves (0° at 0.89 m, still for 4.9 s): only what has been still for 5 s is absorbed"
        );
    }
}
