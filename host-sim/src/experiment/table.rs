//! Results of the door area: a row for each scene, number of people and tracker.
//!
//! ```text
//!   Outcome (seed 10000) + Outcome (seed 10001) + … ─▶ Row: count success, and the scores of all runs pooled ─▶ lines
//! ```

use serde::{Deserialize, Serialize};

use super::line::{COUNTED_RIGHT, Heading, Line, Run, text};
use crate::score::statistics::{Interval, wilson};
use crate::score::{Scorer, Tally};
use crate::world::Events;

/// Fields common to all runs of a row.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Cell {
    /// Name of the scene, its condition included.
    pub scene: String,
    /// How many sensors watch.
    pub sensors: u32,
    /// Number of people.
    pub people: u32,
    /// Name of the tracker.
    pub tracker: String,
}

/// Result of one run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Outcome {
    /// Whether a door opened: without one nothing is said of the count.
    pub has_door: bool,
    /// Whether the people were counted right.
    pub success: bool,
    /// Whether they were counted right nearly all the time.
    pub steady: bool,
    /// Whether the area was found empty soon after the last one had left.
    pub emptied: bool,
    /// Everything else.
    pub tally: Tally,
}

/// The area must be found empty so soon after the last one has left, s.
const EMPTY_S: f64 = 3.0;

impl Outcome {
    /// Of a run that has ended. Without a door, as `events` say, nothing is said of its count.
    #[must_use]
    pub fn of(scorer: Scorer, events: Option<&Events>) -> Self {
        let (tally, counts) = scorer.finish();
        let Some(events) = events else {
            return Self { has_door: false, success: false, steady: false, emptied: false, tally };
        };
        let present = counts.most_true(&(events.door_opens_s - 3.0..events.door_opens_s)).unwrap_or(0);
        Self {
            has_door: true,
            success: counts.success(events.door_opens_s, present),
            steady: counts.steady(&(events.all_in_s..events.door_opens_s)),
            emptied: counts.delay_s(events.empty_s, 0).is_some_and(|delay_s| delay_s <= EMPTY_S),
            tally,
        }
    }
}

/// A row. Figures that nothing can be said about are empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// Name of the scene, its condition included.
    pub scene: String,
    /// How many sensors watch.
    pub sensors: u32,
    /// Number of people.
    pub people: u32,
    /// Name of the tracker.
    pub tracker: String,
    /// First and last seed.
    pub seeds: (u64, u64),
    /// How many runs.
    pub runs: u64,
    /// In how many of them a door opened.
    pub doors: u64,
    /// In how many of those the people were counted right.
    pub successes: u64,
    /// Wilson's interval of that share at 95 %: lower end.
    pub success_low: f64,
    /// Upper end.
    pub success_high: f64,
    /// In how many runs the count was right nearly all the time.
    pub steady: u64,
    /// In how many the area was found empty soon after the last one had left.
    pub emptied: u64,
    /// Share of the frames with the right count.
    pub exact_count_rate: Option<f64>,
    /// IDF1, pooled as all that follow.
    pub idf1: Option<f64>,
    /// MOTA.
    pub mota: Option<f64>,
    /// MOTP, m.
    pub motp_m: Option<f64>,
    /// Changes of a person's track (identity switches).
    pub id_switches: u64,
    /// HOTA.
    pub hota: Option<f64>,
    /// GOSPA, m.
    pub gospa_m: Option<f64>,
    /// Root mean square error of the people well seen, m.
    pub rms_visible_m: Option<f64>,
    /// Root mean square error of the hidden, m.
    pub rms_hidden_m: Option<f64>,
    /// Share of the errors inside the ellipse that should hold 95 %.
    pub nees_coverage: Option<f64>,
}

impl Row {
    /// The row of these runs, each with its seed.
    #[must_use]
    pub fn new(cell: Cell, runs: &[(u64, Outcome)]) -> Self {
        let mut tally = Tally::default();
        for (_, run) in runs {
            tally += &run.tally;
        }
        let figures = tally.figures();
        let number = |wanted: fn(&Outcome) -> bool| runs.iter().filter(|(_, run)| wanted(run)).count() as u64;
        let seeds = runs.first().zip(runs.last()).map(|(first, last)| (first.0, last.0));
        let (doors, successes) = (number(|run| run.has_door), number(|run| run.success));
        let Interval { low, high } = wilson(successes, doors);
        Self {
            scene: cell.scene,
            sensors: cell.sensors,
            people: cell.people,
            tracker: cell.tracker,
            seeds: seeds.unwrap_or_default(),
            runs: runs.len() as u64,
            doors,
            successes,
            success_low: low,
            success_high: high,
            steady: number(|run| run.steady),
            emptied: number(|run| run.emptied),
            exact_count_rate: figures.exact_count_rate,
            idf1: figures.idf1,
            mota: figures.mota,
            motp_m: figures.motp_m,
            id_switches: figures.id_switches,
            hota: figures.hota,
            gospa_m: figures.gospa_m,
            rms_visible_m: figures.rms_visible_m,
            rms_hidden_m: figures.rms_hidden_m,
            nees_coverage: figures.nees_coverage,
        }
    }

    /// Share of the runs in which the people were counted right.
    #[must_use]
    pub fn success(&self) -> f64 {
        self.successes as f64 / self.doors.max(1) as f64
    }

    /// Every figure.
    #[must_use]
    pub fn lines(&self) -> Vec<Line> {
        let heading = Heading {
            row: format!("{}, {}", self.scene, self.people),
            tracker: self.tracker.clone(),
            seeds: self.seeds,
            runs: self.runs,
        };
        let share = |name: &str, runs: u64| {
            if self.doors == 0 {
                heading.line(name, None, "–".into())
            } else {
                heading.share(name, runs, self.doors)
            }
        };
        let mut lines = vec![
            share(COUNTED_RIGHT, self.successes),
            share("steady, % of runs", self.steady),
            share("empty in 3 s, % of runs", self.emptied),
        ];
        let switches = (self.runs > 0).then(|| self.id_switches as f64 / self.runs as f64);
        for (name, value, times, digits) in [
            ("right, % of the time", self.exact_count_rate, 100.0, 1),
            ("IDF1", self.idf1, 1.0, 3),
            ("HOTA", self.hota, 1.0, 3),
            ("MOTA", self.mota, 1.0, 3),
            ("MOTP, cm", self.motp_m, 100.0, 1),
            ("switches a run", switches, 1.0, 2),
            ("GOSPA, cm", self.gospa_m, 100.0, 1),
            ("RMS error of the visible, cm", self.rms_visible_m, 100.0, 1),
            ("RMS error of the hidden, cm", self.rms_hidden_m, 100.0, 1),
            ("errors in the 95 % ellipse, %", self.nees_coverage, 100.0, 1),
        ] {
            let value = value.map(|value| value * times);
            let printed = value.map_or("–".into(), |value| format!("{value:.digits$}"));
            lines.push(heading.line(name, value, printed));
        }
        lines
    }

    /// What one run gave.
    pub(super) fn run(cell: &Cell, seed: u64, outcome: &Outcome) -> Run {
        let lines = Self::new(cell.clone(), &[(seed, outcome.clone())]).lines();
        let figures = text(lines.iter().map(|line| (line.figure.as_str(), line.value)));
        let (row, tracker) =
            lines.into_iter().next().map(|line| (line.row, line.tracker)).unwrap_or_default();
        Run { row, tracker, seed, figures }
    }

    /// What stands over the rows of the same scene and sensors.
    #[must_use]
    pub fn heading(&self) -> String {
        let ending = if self.sensors == 1 { "" } else { "s" };
        format!("{}, {} sensor{ending}", self.scene, self.sensors)
    }
}

/// The lines of these rows in the full table.
#[must_use]
pub fn lines(rows: &[Row]) -> Vec<Line> {
    rows.iter().flat_map(Row::lines).collect()
}

/// The rows of each scene and its sensors together, in the order of their first row.
#[must_use]
pub fn by_scene(rows: &[Row]) -> Vec<Vec<&Row>> {
    let mut groups: Vec<Vec<&Row>> = Vec::new();
    for row in rows {
        match groups.iter_mut().find(|group| group[0].heading() == row.heading()) {
            Some(group) => group.push(row),
            None => groups.push(vec![row]),
        }
    }
    groups
}

/// The trackers in the order of their first row.
#[must_use]
pub fn trackers<'a>(rows: &[&'a Row]) -> Vec<&'a str> {
    let mut names: Vec<&str> = Vec::new();
    for row in rows {
        if !names.contains(&row.tracker.as_str()) {
            names.push(&row.tracker);
        }
    }
    names
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A row with these successes of 200.
    pub fn row(scene: &str, people: u32, tracker: &str, successes: u64) -> Row {
        let run = |success| Outcome {
            has_door: true,
            success,
            steady: false,
            emptied: true,
            tally: Tally::default(),
        };
        let runs: Vec<(u64, Outcome)> = (0..200).map(|seed| (seed, run(seed < successes))).collect();
        let cell = Cell { scene: scene.into(), sensors: 2, people, tracker: tracker.into() };
        Row::new(cell, &runs)
    }

    #[test]
    fn a_row_counts_its_runs() {
        let row = row("hall", 3, "kehai", 150);
        assert_eq!((row.runs, row.successes, row.steady, row.success()), (200, 150, 0, 0.75));
        assert!(row.success_low < 0.75 && 0.75 < row.success_high);
        let lines = row.lines();
        assert_eq!((lines[0].row.as_str(), lines[0].printed.as_str()), ("hall, 3", "75 [69–80]"));
        assert_eq!((lines[0].first_seed, lines[0].last_seed, lines[0].of), (0, 199, Some(200)));
        assert_eq!(
            (lines[4].figure.as_str(), lines[4].value, lines[4].printed.as_str()),
            ("IDF1", None, "–")
        );
    }
}
