//! Tables of the guarded door: passages by rule, and paper A's experiment from end to end.
//!
//! ```text
//!   rule or number of people × seed ─▶ passage::run ─▶ Report ─▶ named figures, pooled ─▶ docs/door.md
//! ```

use std::collections::BTreeMap;
use std::error::Error;
use std::ops::RangeInclusive;

use crate::baselines::Choice;
use kehai_tracking::door::{Alarm, Outcome};

use super::figure::{Figure, Finding};
use super::findings::{Figures, Pooled, owned};
use super::jobs::Runs;
use super::paper::{PAPER_A_SUCCESSES, PAPER_A_TRIALS};
use crate::passage::{Load, Plan, Report, Rule, run};
use crate::world::gathering::Condition;

/// A row of a table.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    name: &'static str,
    rule: Rule,
    /// So many people; groups of one to three in turn without it.
    people: Option<usize>,
    condition: Condition,
    load: Option<Load>,
    judged_as: Judgement,
}

/// The kind of figures reported for the passages of a row.
#[derive(Clone, Copy, Debug)]
enum Judgement {
    Tailgater,
    Other,
    Paper,
}

/// Tailgaters: the share missed, and the delay of the alarms.
#[must_use]
pub fn tailgaters() -> Vec<Row> {
    rows(
        &[
            ("gap over 0.6 m", Rule::GapWide),
            ("gap 0.3–0.6 m", Rule::GapNarrow),
            ("touching, in file", Rule::InFile),
            ("side by side", Rule::SideBySide),
            ("running in", Rule::RunsIn),
        ],
        Judgement::Tailgater,
    )
}

/// Tailgaters behind one person with a load, at three gaps.
#[must_use]
pub fn behind_loads() -> Vec<Row> {
    let row = |(name, rule, load)| Row {
        name,
        rule,
        people: Some(1),
        condition: Condition::Spread,
        load: Some(load),
        judged_as: Judgement::Tailgater,
    };
    [
        ("gap 0.3–0.6 m, wheelchair", Rule::GapNarrow, Load::Wheelchair),
        ("touching, in file, wheelchair", Rule::InFile, Load::Wheelchair),
        ("side by side, wheelchair", Rule::SideBySide, Load::Wheelchair),
        ("gap 0.3–0.6 m, suitcase", Rule::GapNarrow, Load::Suitcase),
        ("touching, in file, suitcase", Rule::InFile, Load::Suitcase),
        ("side by side, suitcase", Rule::SideBySide, Load::Suitcase),
        ("gap 0.3–0.6 m, pushchair", Rule::GapNarrow, Load::Pushchair),
        ("touching, in file, pushchair", Rule::InFile, Load::Pushchair),
        ("side by side, pushchair", Rule::SideBySide, Load::Pushchair),
    ]
    .map(row)
    .into()
}

/// One person with a load; the number entered is 1.
#[must_use]
pub fn loads() -> Vec<Row> {
    let row = |(name, load)| Row {
        name,
        rule: Rule::Honest,
        people: Some(1),
        condition: Condition::Spread,
        load: Some(load),
        judged_as: Judgement::Other,
    };
    [("wheelchair", Load::Wheelchair), ("suitcase", Load::Suitcase), ("pushchair", Load::Pushchair)]
        .map(row)
        .into()
}

/// Groups of one to seven people in conditions D and H, judged as every honest group is.
#[must_use]
pub fn groups() -> Vec<Row> {
    paper().into_iter().map(|row| Row { judged_as: Judgement::Other, ..row }).collect()
}

/// Everything else that happens at a door.
#[must_use]
pub fn others() -> Vec<Row> {
    rows(
        &[
            ("honest group", Rule::Honest),
            ("wrong number entered", Rule::WrongNumber),
            ("one turns back", Rule::TurnsBack),
            ("card passed back", Rule::CardBack),
            ("module lost mid-passage", Rule::ModuleLost),
            ("held open", Rule::HeldOpen),
        ],
        Judgement::Other,
    )
}

/// Paper A's experiment: one to seven people, in conditions D and H.
#[must_use]
pub fn paper() -> Vec<Row> {
    const NAMES: [[&str; 7]; 2] = [
        ["D, 1", "D, 2", "D, 3", "D, 4", "D, 5", "D, 6", "D, 7"],
        ["H, 1", "H, 2", "H, 3", "H, 4", "H, 5", "H, 6", "H, 7"],
    ];
    let of = |condition: Condition, names: [&'static str; 7]| {
        let row = move |(index, name)| Row {
            name,
            rule: Rule::Honest,
            people: Some(index + 1),
            condition,
            load: None,
            judged_as: Judgement::Paper,
        };
        names.into_iter().enumerate().map(row)
    };
    of(Condition::Spread, NAMES[0]).chain(of(Condition::Dense, NAMES[1])).collect()
}

/// Groups of one, two and three in turn.
fn rows(named: &[(&'static str, Rule)], judged_as: Judgement) -> Vec<Row> {
    let row = |&(name, rule): &(&'static str, Rule)| Row {
        name,
        rule,
        people: None,
        condition: Condition::Spread,
        load: None,
        judged_as,
    };
    named.iter().map(row).collect()
}

impl Row {
    fn plan(&self, seed: u64) -> Plan {
        let plan = Plan { condition: self.condition, load: self.load, ..Plan::of(self.rule, seed) };
        self.people.map_or(plan, |people| Plan { people, ..plan })
    }
}

/// Runs all rows with all seeds. `name` is that of the file in which results are kept.
///
/// # Errors
/// A fault of the simulation.
pub fn table(
    name: &str,
    rows: &[Row],
    seeds: &RangeInclusive<u64>,
    choice: Choice,
    runs: &Runs,
) -> Result<Vec<Pooled>, Box<dyn Error>> {
    let jobs: Vec<(usize, u64)> =
        (0..rows.len()).flat_map(|row| seeds.clone().map(move |seed| (row, seed))).collect();
    let findings: BTreeMap<(usize, u64), Figures> = runs.results(name, &jobs, |(row, seed)| {
        let Some(row) = rows.get(row) else { return Ok(Vec::new()) };
        let plan = row.plan(seed);
        let report = run(plan, seed, choice)?;
        Ok(owned(finding(row, &plan, &report)))
    })?;
    let pooled = |(index, row): (usize, &Row)| {
        let own = findings.range((index, 0)..=(index, u64::MAX));
        let runs = own.map(|((_, seed), finding)| (*seed, finding.clone())).collect();
        Pooled { trial: row.name.to_owned(), tracker: choice.to_string(), runs }
    };
    Ok(rows.iter().enumerate().map(pooled).collect())
}

/// A share of the runs that count.
const fn share(yes: bool, counts: bool) -> Figure {
    Figure::Share { yes: (yes && counts) as u64, of: counts as u64 }
}

fn finding(row: &Row, plan: &Plan, report: &Report) -> Finding {
    match row.judged_as {
        Judgement::Tailgater => tailgater(report),
        Judgement::Other => other(row.rule, plan, report),
        Judgement::Paper => paper_figures(plan, report),
    }
}

/// An alarm later than this is late, s.
const IN_TIME_S: f64 = 1.0;

fn tailgater(report: &Report) -> Finding {
    let entered = report.extra_in_s.is_some();
    // An alarm before the crossing began was raised for something else.
    let alarm_s = report.alarm.map(|(alarm_s, _)| alarm_s);
    let own_s = alarm_s.zip(report.extra_begins_s).filter(|(alarm_s, begins_s)| alarm_s >= begins_s);
    let delay_s = report.extra_in_s.zip(own_s).map(|(in_s, (alarm_s, _))| alarm_s - in_s);
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
        ("unlocked at the first number, %", Figure::of(unlocked && report.asked_again == 0)),
        ("unlocked, %", Figure::of(unlocked)),
        ("asked again, a passage", Figure::mean(f64::from(report.asked_again), 2)),
        ("false alarms, %", share(false_alarm, matches!(rule, Rule::Honest | Rule::WrongNumber))),
    ]
}

fn paper_figures(plan: &Plan, report: &Report) -> Finding {
    let people = plan.people;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alarm_before_the_crossing_began_does_not_notice_the_tailgater() {
        let missed = |alarm_s| {
            let alarm = Some((alarm_s, Alarm::RanIn));
            let report =
                Report { extra_begins_s: Some(20.0), extra_in_s: Some(22.0), alarm, ..Report::default() };
            tailgater(&report)[0].clone()
        };
        let is = |missed| ("missed, % of runs", Figure::of(missed));
        assert_eq!([19.9, 20.0, 23.0, 23.1].map(missed), [true, false, false, true].map(is));
    }
}
