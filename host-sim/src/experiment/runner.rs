//! Runs a plan on all cores. The order in which runs end changes nothing in the table.
//!
//! ```text
//!   case × seed ─▶ world, sensors, modules once ─▶ datagrams ─┬─▶ tracker ─▶ scorer ─▶ Outcome
//!                                                             └─▶ tracker ─▶ scorer ─▶ Outcome
//! ```

use std::collections::BTreeMap;
use std::error::Error;
use std::ops::RangeInclusive;

use crate::baselines::Choice;

use super::findings::{Figures, Pooled, owned};
use super::jobs::Runs;
use super::line::Run;
use super::log::Log;
use super::plan::Case;
use super::table::{Outcome, Row};
use super::trial::{Trial, counted, judged};
use crate::run::{Conditions, Options, Record};
use crate::score::{Estimate, Frame, Scorer, Settings, Target};

/// Runs every case with every seed and each of its trackers: the rows, and what every run gave. `name` is that of
/// the file in which results are kept.
///
/// # Errors
/// The first fault of a scene or of the simulation.
pub fn run(
    name: &str,
    cases: &[Case],
    seeds: &RangeInclusive<u64>,
    options: &Options,
    runs: &Runs,
) -> Result<(Vec<Row>, Vec<Run>), Box<dyn Error>> {
    let scenes = cases.iter().map(Case::build).collect::<Result<Vec<_>, _>>()?;
    let jobs: Vec<(usize, u64)> =
        (0..cases.len()).flat_map(|case| seeds.clone().map(move |seed| (case, seed))).collect();
    let outcomes: BTreeMap<(usize, u64), Vec<Outcome>> = runs.results(name, &jobs, |(case, seed)| {
        let Case { scene, people, trackers, .. } = &cases[case];
        let record = Record::of(&scenes[case], seed, options)
            .map_err(|error| format!("{scene}, {people} people, seed {seed}: {error}"))?;
        Ok(trackers.iter().map(|choice| judge(&record, *choice)).collect())
    })?;
    let (mut rows, mut all) = (Vec::new(), Vec::new());
    for (index, case) in cases.iter().enumerate() {
        for (tracker, choice) in case.trackers.iter().enumerate() {
            let cell = case.cell(*choice, scenes[index].site.modules.len());
            let own = outcomes.range((index, 0)..=(index, u64::MAX));
            let outcome = |((_, seed), outcomes): (&(usize, u64), &Vec<Outcome>)| {
                Some((*seed, outcomes.get(tracker)?.clone()))
            };
            let own: Vec<(u64, Outcome)> = own.filter_map(outcome).collect();
            all.extend(own.iter().map(|(seed, outcome)| Row::run(&cell, *seed, outcome)));
            rows.push(Row::new(cell, &own));
        }
    }
    Ok((rows, all))
}

/// Runs every trial with its seeds and each of its trackers.
///
/// # Errors
/// The first fault of a scene or of the simulation.
pub fn run_trials(name: &str, trials: &[Trial], runs: &Runs) -> Result<Vec<Pooled>, Box<dyn Error>> {
    let scenes = trials.iter().map(Trial::build).collect::<Result<Vec<_>, _>>()?;
    let seeds = |index: usize| trials[index].seeds.clone().map(move |seed| (index, seed));
    let jobs: Vec<(usize, u64)> = (0..trials.len()).flat_map(seeds).collect();
    let findings: BTreeMap<(usize, u64), Vec<Figures>> = runs.results(name, &jobs, |(index, seed)| {
        let trial = &trials[index];
        let record = |conditions: &Conditions| {
            let options = Options { conditions: *conditions, ..Options::default() };
            Record::of(&scenes[index], seed, &options)
                .map_err(|error| format!("{}, seed {seed}: {error}", trial.name))
        };
        let records = trial.networks.iter().map(record).collect::<Result<Vec<Record>, String>>()?;
        let judge = |choice: &Choice| {
            let log = |record| Log::of(record, *choice, trial.region);
            owned(trial.rule.judge(&records.iter().map(log).collect::<Vec<_>>()))
        };
        Ok(trial.trackers.iter().map(judge).collect())
    })?;
    let mut all = Vec::new();
    for (index, trial) in trials.iter().enumerate() {
        for (tracker, choice) in trial.trackers.iter().enumerate() {
            let own = findings.range((index, 0)..=(index, u64::MAX));
            let runs = own.filter_map(|((_, seed), findings)| Some((*seed, findings.get(tracker)?.clone())));
            all.push(Pooled { trial: trial.name.into(), tracker: choice.to_string(), runs: runs.collect() });
        }
    }
    Ok(all)
}

/// One run of the door area through one tracker.
#[must_use]
pub fn judge(record: &Record, choice: Choice) -> Outcome {
    let settings = Settings { region: Some(judged()), area: Some(counted()), ..Settings::default() };
    judge_in(record, choice, settings)
}

/// One run through one tracker, judged as `settings` say. Without a door nothing is said of its count.
#[must_use]
pub fn judge_in(record: &Record, choice: Choice, settings: Settings) -> Outcome {
    let mut scorer = Scorer::new(settings);
    record.follow(choice, |site_tracker, moment| {
        let truth: Vec<Target> = moment.people.iter().map(Target::from).collect();
        let tracks: Vec<Estimate> = site_tracker.tracks(moment.t).iter().map(Estimate::from).collect();
        scorer.frame(&Frame { t_s: moment.t, truth: &truth, tracks: &tracks });
    });
    Outcome::of(scorer, record.events.as_ref())
}
