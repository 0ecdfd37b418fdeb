//! Runs a plan on all cores. The order in which runs end changes nothing in the table.
//!
//! ```text
//!   case × seed ─▶ world, sensors, modules once ─▶ datagrams ─┬─▶ tracker ─▶ scorer ─▶ Outcome
//!                                                             └─▶ tracker ─▶ scorer ─▶ Outcome
//! ```

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use host_tracker::follower::Follower;
use host_tracker::geometry::Point;
use host_tracker::trackers::Choice;

use super::plan::Case;
use super::table::{Outcome, Row};
use crate::run::{Options, Record};
use crate::score::{Estimate, Frame, Region, Scorer, Settings, Target};

/// The area must be found empty so soon after the last one has left, s.
const EMPTY_S: f64 = 3.0;

/// Where identities and places are judged, m.
#[must_use]
pub fn judged() -> Region {
    Region::between(Point::new(-2.0, -2.6), Point::new(2.0, 1.0))
}

/// Where people are counted, m.
#[must_use]
pub fn counted() -> Region {
    Region::between(Point::new(-1.0, -1.0), Point::new(1.0, 1.0))
}

/// Runs every case with every seed and each of its trackers; `done` is told of every finished run.
///
/// # Errors
/// The first fault of a scene or of the simulation.
pub fn run(
    cases: &[Case],
    seeds: &RangeInclusive<u64>,
    options: &Options,
    done: impl Fn() + Sync,
) -> Result<Vec<Row>, Box<dyn std::error::Error>> {
    let scenes = cases.iter().map(Case::build).collect::<Result<Vec<_>, _>>()?;
    let jobs: Vec<(usize, u64)> =
        (0..cases.len()).flat_map(|case| seeds.clone().map(move |seed| (case, seed))).collect();
    let next = AtomicUsize::new(0);
    let outcomes: Mutex<BTreeMap<(usize, usize, u64), Outcome>> = Mutex::default();
    let fault: Mutex<Option<String>> = Mutex::default();
    let work = || {
        while let Some(&(case, seed)) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
            let record = match Record::of(&scenes[case], seed, options) {
                Ok(record) => record,
                Err(error) => {
                    let text =
                        format!("{}, {} people, seed {seed}: {error}", cases[case].scene, cases[case].people);
                    *fault.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) = Some(text);
                    return;
                }
            };
            for (tracker, choice) in cases[case].trackers.iter().enumerate() {
                let outcome = judge(&record, *choice);
                let mut outcomes = outcomes.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
                outcomes.insert((case, tracker, seed), outcome);
            }
            done();
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(work);
        }
    });
    if let Some(fault) = fault.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner()) {
        return Err(fault.into());
    }
    let outcomes = outcomes.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    let mut rows = Vec::new();
    for (index, case) in cases.iter().enumerate() {
        for (tracker, choice) in case.trackers.iter().enumerate() {
            let runs: Vec<Outcome> = outcomes
                .range((index, tracker, 0)..=(index, tracker, u64::MAX))
                .map(|(_, outcome)| outcome.clone())
                .collect();
            rows.push(Row::new(case.cell(*choice, scenes[index].site.modules.len()), &runs));
        }
    }
    Ok(rows)
}

/// One run through one tracker.
#[must_use]
pub fn judge(record: &Record, choice: Choice) -> Outcome {
    let mut follower = Follower::new(&Arc::new(record.site.clone()), choice);
    let settings = Settings { region: Some(judged()), area: Some(counted()), ..Settings::default() };
    let mut scorer = Scorer::new(settings);
    let mut arrivals = record.arrivals.iter().peekable();
    for moment in &record.truth {
        while let Some(arrival) = arrivals.next_if(|arrival| arrival.at_us as f64 * 1e-6 <= moment.t) {
            follower.receive(&arrival.bytes, arrival.at_us);
        }
        let truth: Vec<Target> = moment.people.iter().map(Target::from).collect();
        let tracks: Vec<Estimate> = follower.tracks(moment.t).iter().map(Estimate::from).collect();
        scorer.frame(&Frame { t_s: moment.t, truth: &truth, tracks: &tracks });
    }
    let (tally, counts) = scorer.finish();
    let Some(events) = &record.events else {
        return Outcome { success: false, steady: false, emptied: false, tally };
    };
    let present = counts.most_true(&(events.door_opens_s - 3.0..events.door_opens_s)).unwrap_or(0);
    Outcome {
        success: counts.success(events.door_opens_s, present),
        steady: counts.steady(&(events.all_in_s..events.door_opens_s)),
        emptied: counts.delay_s(events.empty_s, 0).is_some_and(|delay_s| delay_s <= EMPTY_S),
        tally,
    }
}
