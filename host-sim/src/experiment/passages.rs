//! Tables of the guarded door: passages by rule, and paper A's experiment from end to end.
//!
//! ```text
//!   rule or number of people × seed ─▶ passage::run ─▶ Report ─▶ named figures, pooled ─▶ docs/door.md
//! ```

use std::error::Error;
use std::ops::RangeInclusive;

use host_tracker::door::{Alarm, Outcome};
use host_tracker::trackers::Choice;

use super::cores::on_all_cores;
use super::findings::{Figure, Pooled};
use super::paper::{PAPER_A_SUCCESSES, PAPER_A_TRIALS};
use super::rules::Finding;
use crate::passage::{Plan, Report, Rule, run};
use crate::world::gathering::Condition;

/// A row of a table.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    name: &'static str,
    rule: Rule,
    /// So many people; groups of one to three in turn without it.
    people: Option<usize>,
    condition: Condition,
}

/// Tailgaters: missed, and how late they are told of.
#[must_use]
pub fn tailgaters() -> Vec<Row> {
    rows(&[
        ("gap over 0.6 m", Rule::GapWide),
        ("gap 0.3–0.6 m", Rule::GapNarrow),
        ("touching, in file", Rule::InFile),
        ("side by side", Rule::SideBySide),
        ("running in", Rule::RunsIn),
    ])
}

/// Everything else that happens at a door.
#[must_use]
pub fn others() -> Vec<Row> {
    rows(&[
        ("honest group", Rule::Honest),
        ("wrong number entered", Rule::WrongNumber),
        ("one turns back", Rule::TurnsBack),
        ("card passed back", Rule::CardBack),
        ("module lost mid-passage", Rule::ModuleLost),
        ("held open", Rule::HeldOpen),
    ])
}

/// Paper A's experiment: one to seven people, in conditions D and H.
#[must_use]
pub fn paper() -> Vec<Row> {
    const NAMES: [[&str; 7]; 2] = [
        ["D, 1", "D, 2", "D, 3", "D, 4", "D, 5", "D, 6", "D, 7"],
        ["H, 1", "H, 2", "H, 3", "H, 4", "H, 5", "H, 6", "H, 7"],
    ];
    let of = |condition: Condition, names: [&'static str; 7]| {
        let row = move |(index, name)| Row { name, rule: Rule::Honest, people: Some(index + 1), condition };
        names.into_iter().enumerate().map(row)
    };
    of(Condition::Spread, NAMES[0]).chain(of(Condition::Dense, NAMES[1])).collect()
}

fn rows(named: &[(&'static str, Rule)]) -> Vec<Row> {
    let row =
        |&(name, rule): &(&'static str, Rule)| Row { name, rule, people: None, condition: Condition::Spread };
    named.iter().map(row).collect()
}

impl Row {
    fn plan(&self, seed: u64) -> Plan {
        let plan = Plan { condition: self.condition, ..Plan::of(self.rule, seed) };
        self.people.map_or(plan, |people| Plan { people, ..plan })
    }
}

/// Runs all rows with all seeds; `done` is told of every finished passage.
///
/// # Errors
/// A fault of the simulation.
pub fn table(
    rows: &[Row],
    seeds: &RangeInclusive<u64>,
    choice: Choice,
    done: impl Fn() + Sync,
) -> Result<Vec<Pooled>, Box<dyn Error>> {
    let jobs: Vec<(usize, u64)> =
        (0..rows.len()).flat_map(|row| seeds.clone().map(move |seed| (row, seed))).collect();
    let findings = on_all_cores(&jobs, |(row, seed)| {
        let Some(row) = rows.get(row) else { return Ok(Vec::new()) };
        let plan = row.plan(seed);
        let report = run(plan, seed, choice)?;
        done();
        Ok(finding(row, &plan, &report))
    })?;
    let pooled = |(index, row): (usize, &Row)| {
        let own = findings.range((index, 0)..=(index, u64::MAX));
        let runs = own.map(|((_, seed), finding)| (*seed, finding.clone())).collect();
        Pooled { trial: row.name.to_owned(), tracker: choice.to_string(), runs }
    };
    Ok(rows.iter().enumerate().map(pooled).collect())
}

/// A share of those runs only that it can be said of.
const fn share(yes: bool, counts: bool) -> Figure {
    Figure::Share { yes: (yes && counts) as u64, of: counts as u64 }
}

fn finding(row: &Row, plan: &Plan, report: &Report) -> Finding {
    match (row.people, row.rule) {
        (Some(people), _) => paper_figures(people, plan, report),
        (None, Rule::GapWide | Rule::GapNarrow | Rule::InFile | Rule::SideBySide | Rule::RunsIn) => {
            tailgater(report)
        }
        (None, rule) => other(rule, plan, report),
    }
}

/// An alarm later than this is late, s.
const IN_TIME_S: f64 = 1.0;

fn tailgater(report: &Report) -> Finding {
    let entered = report.extra_in_s.is_some();
    let delay_s = report.extra_in_s.zip(report.alarm).map(|(in_s, (alarm_s, _))| alarm_s - in_s);
    let in_time = delay_s.is_some_and(|delay_s| delay_s <= IN_TIME_S);
    let kept_out_by = |alarm: bool| !entered && report.alarm.is_some() == alarm;
    vec![
        ("missed, % of runs", Figure::of(entered && !in_time)),
        ("went in, alarm within 1 s", Figure::of(entered && in_time)),
        ("kept out, with alarm", Figure::of(kept_out_by(true))),
        ("kept out, not let in at all", Figure::of(kept_out_by(false))),
        ("missed, % of those who went in", share(!in_time, entered)),
        (
            "alarm after the crossing, s",
            Figure::Mean { values: delay_s.into_iter().collect(), digits: 2, shares: false },
        ),
    ]
}

fn other(rule: Rule, plan: &Plan, report: &Report) -> Finding {
    let complete = report.passages.iter().any(|passage| passage.outcome == Outcome::Complete);
    let alarm = report.alarm.map(|(_, alarm)| alarm);
    let unlocked = report.unlocked_s.is_some();
    let (wanted, false_alarm) = match rule {
        Rule::Honest => (complete && report.members_in == plan.people, alarm.is_some()),
        Rule::WrongNumber => (!unlocked, alarm.is_some()),
        Rule::TurnsBack => (matches!(alarm, Some(Alarm::TurnedBack | Alarm::HeldOpen)), false),
        Rule::CardBack => (alarm == Some(Alarm::PassedBack) && report.extra_in_s.is_none(), false),
        Rule::ModuleLost => {
            (report.lost_noticed_s.is_some_and(|late_s| late_s <= 1.5) && report.lost_locked, false)
        }
        _ => (alarm == Some(Alarm::HeldOpen), false),
    };
    vec![
        ("as it should, %", Figure::of(wanted)),
        ("unlocked, %", Figure::of(unlocked)),
        ("asked again, a passage", Figure::mean(f64::from(report.asked_again), 2)),
        ("false alarms, %", share(false_alarm, matches!(rule, Rule::Honest | Rule::WrongNumber))),
    ]
}

fn paper_figures(people: usize, plan: &Plan, report: &Report) -> Finding {
    let complete = report.passages.iter().any(|passage| passage.outcome == Outcome::Complete);
    let all_in = complete && report.members_in == plan.people && report.alarm.is_none();
    let unlocked = report.unlocked_s.is_some();
    let paper = people.checked_sub(1).and_then(|index| PAPER_A_SUCCESSES.get(index)).copied().unwrap_or(0);
    vec![
        (
            "paper A counts right, %",
            Figure::Mean {
                values: vec![100.0 * paper as f64 / PAPER_A_TRIALS as f64],
                digits: 0,
                shares: false,
            },
        ),
        ("unlocked at the first number, %", Figure::of(unlocked && report.asked_again == 0)),
        ("unlocked at all, %", Figure::of(unlocked)),
        ("all in, locked, no alarm, %", Figure::of(all_in)),
        ("wrong: one too few believed, %", share(report.low_accepted, people > 1)),
        ("wrong: alarm, %", Figure::of(report.alarm.is_some())),
    ]
}
