//! The table of an experiment: a row for each scene, number of people and tracker; as CSV and as Markdown.
//!
//! ```text
//! scene,sensors,people,tracker,runs,successes,success_low,success_high,steady,idf1,…       one row a line
//!
//! | door area H, 2 sensors | 1            | 2            |                                  one row a tracker
//! | kehai                  | 100 [98–100] | 99.5 [97–100]|                                  success in %, Wilson
//! ```

use std::error::Error;
use std::fmt::Write as _;
use std::io::{Read, Write};

use serde::{Deserialize, Serialize};

use super::paper::{PAPER_A_NAME, PAPER_A_SUCCESSES, PAPER_A_TRIALS};
use crate::score::Tally;
use crate::score::statistics::{Interval, wilson};

/// What is the same for all runs of a row.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Cell {
    /// Name of the scene, its condition included.
    pub scene: String,
    /// How many sensors watch.
    pub sensors: u32,
    /// How many people there are.
    pub people: u32,
    /// Name of the tracker.
    pub tracker: String,
}

/// What came of one run.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Whether the people were counted right.
    pub success: bool,
    /// Whether they were counted right nearly all the time.
    pub steady: bool,
    /// Whether the area was found empty soon after the last one had left.
    pub emptied: bool,
    /// Everything else.
    pub tally: Tally,
}

/// A row. Figures that nothing can be said about are empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Name of the scene, its condition included.
    pub scene: String,
    /// How many sensors watch.
    pub sensors: u32,
    /// How many people there are.
    pub people: u32,
    /// Name of the tracker.
    pub tracker: String,
    /// How many runs.
    pub runs: u64,
    /// In how many of them the people were counted right.
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
    /// People who became another track.
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
    /// The row of these runs.
    #[must_use]
    pub fn new(cell: Cell, runs: &[Outcome]) -> Self {
        let mut tally = Tally::default();
        for run in runs {
            tally += &run.tally;
        }
        let figures = tally.figures();
        let number = |wanted: fn(&Outcome) -> bool| runs.iter().filter(|run| wanted(run)).count() as u64;
        let successes = number(|run| run.success);
        let Interval { low, high } = wilson(successes, runs.len() as u64);
        Self {
            scene: cell.scene,
            sensors: cell.sensors,
            people: cell.people,
            tracker: cell.tracker,
            runs: runs.len() as u64,
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
        self.successes as f64 / self.runs.max(1) as f64
    }

    /// What stands over the rows of the same scene and sensors.
    #[must_use]
    pub fn heading(&self) -> String {
        let ending = if self.sensors == 1 { "" } else { "s" };
        format!("{}, {} sensor{ending}", self.scene, self.sensors)
    }
}

/// Writes the rows as CSV.
///
/// # Errors
/// What the writer says.
pub fn write_csv(rows: &[Row], out: impl Write) -> Result<(), Box<dyn Error>> {
    let mut writer = csv::Writer::from_writer(out);
    for row in rows {
        writer.serialize(row)?;
    }
    Ok(writer.flush()?)
}

/// Reads what [`write_csv`] wrote.
///
/// # Errors
/// Where and why a line is no row.
pub fn read_csv(from: impl Read) -> Result<Vec<Row>, Box<dyn Error>> {
    Ok(csv::Reader::from_reader(from).deserialize().collect::<Result<_, _>>()?)
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

/// Count success in % with Wilson's interval: a table for each scene, trackers down, people across, paper A's
/// Table 1 last.
#[must_use]
pub fn success_markdown(rows: &[Row]) -> String {
    let mut text = String::new();
    for group in by_scene(rows) {
        let mut people: Vec<u32> = group.iter().map(|row| row.people).collect();
        people.sort_unstable();
        people.dedup();
        let cells = |cell: &dyn Fn(u32) -> Option<(u64, u64)>| {
            let words =
                |number: &u32| cell(*number).map_or("–".into(), |(right, runs)| percent(right, runs));
            people.iter().map(words).collect::<Vec<_>>().join(" | ")
        };
        let across = people.iter().map(ToString::to_string).collect::<Vec<_>>().join(" | ");
        let _ = writeln!(text, "| {} | {across} |", escaped(&group[0].heading()));
        let _ = writeln!(text, "|---|{}", "--:|".repeat(people.len()));
        for tracker in trackers(&group) {
            let row = |number| group.iter().find(|row| row.tracker == tracker && row.people == number);
            let line = cells(&|number| row(number).map(|row| (row.successes, row.runs)));
            let _ = writeln!(text, "| {} | {line} |", escaped(tracker));
        }
        let line = cells(&|number| {
            let index = (number as usize).checked_sub(1)?;
            PAPER_A_SUCCESSES.get(index).map(|&right| (right, PAPER_A_TRIALS))
        });
        let _ = writeln!(text, "| {PAPER_A_NAME} | {line} |\n");
    }
    text
}

/// All other figures: a table for each scene, a line for each tracker and number of people.
#[must_use]
pub fn figures_markdown(rows: &[Row]) -> String {
    let part = |value: Option<f64>| value.map_or("–".into(), |value| format!("{value:.3}"));
    let centimetres =
        |value: Option<f64>| value.map_or("–".into(), |value| format!("{:.1}", value * 100.0));
    let mut text = String::new();
    for group in by_scene(rows) {
        let _ = writeln!(
            text,
            "| {} | people | runs | steady % | empty in 3 s % | right % of the time | IDF1 | HOTA | MOTA | MOTP cm | switches | \
             GOSPA cm | RMS visible cm | RMS hidden cm | in 95 % ellipse |",
            escaped(&group[0].heading())
        );
        let _ = writeln!(text, "|---|{}", "--:|".repeat(14));
        for row in group {
            let share = |number: u64| 100.0 * number as f64 / row.runs.max(1) as f64;
            let (steady, emptied) = (share(row.steady), share(row.emptied));
            let right = row.exact_count_rate.map_or("–".into(), |rate| format!("{:.1}", rate * 100.0));
            let _ = writeln!(
                text,
                "| {} | {} | {} | {steady:.1} | {emptied:.1} | {right} | {} | {} | {} | {} | {} | {} | {} | {} | {} |",
                escaped(&row.tracker),
                row.people,
                row.runs,
                part(row.idf1),
                part(row.hota),
                part(row.mota),
                centimetres(row.motp_m),
                row.id_switches,
                centimetres(row.gospa_m),
                centimetres(row.rms_visible_m),
                centimetres(row.rms_hidden_m),
                part(row.nees_coverage),
            );
        }
        text.push('\n');
    }
    text
}

/// A sentence for each tracker of condition H: five to seven people together, by which worlds are compared.
#[must_use]
pub fn dense_markdown(rows: &[Row]) -> String {
    let dense: Vec<&Row> =
        rows.iter().filter(|row| row.scene.ends_with(", H") && (5..=7).contains(&row.people)).collect();
    let pooled = |tracker: &&str| {
        let own = || dense.iter().filter(|row| row.tracker == **tracker);
        let (right, runs) = (own().map(|row| row.successes).sum(), own().map(|row| row.runs).sum());
        format!("`{tracker}` {}", percent(right, runs))
    };
    let words: Vec<String> = trackers(&dense).iter().map(pooled).collect();
    if words.is_empty() {
        words.concat()
    } else {
        format!("H, five to seven people together: {}.\n", words.join(", "))
    }
}

/// `98.5 [95.7–99.5]`, without decimals where there are none.
pub(super) fn percent(successes: u64, runs: u64) -> String {
    let Interval { low, high } = wilson(successes, runs);
    let short = |share: f64| {
        let text = format!("{:.1}", share * 100.0);
        text.strip_suffix(".0").map(str::to_owned).unwrap_or(text)
    };
    let rate = successes as f64 / runs.max(1) as f64;
    format!("{} [{:.0}–{:.0}]", short(rate), low * 100.0, high * 100.0)
}

pub(super) fn escaped(text: &str) -> String {
    text.replace('|', "\\|")
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A row with these successes of 200.
    pub fn row(scene: &str, people: u32, tracker: &str, successes: u64) -> Row {
        let run = |success| Outcome { success, steady: false, emptied: true, tally: Tally::default() };
        let runs: Vec<Outcome> = (0..200).map(|index| run(index < successes)).collect();
        let cell = Cell { scene: scene.into(), sensors: 2, people, tracker: tracker.into() };
        Row::new(cell, &runs)
    }

    fn rows() -> Vec<Row> {
        vec![
            row("door area, H", 1, "kehai", 200),
            row("door area, H", 7, "kehai", 185),
            row("door area, H", 7, "lee|38", 40),
            row("hall", 8, "kehai", 0),
        ]
    }

    #[test]
    fn a_table_survives_csv() {
        let mut rows = rows();
        rows[1].idf1 = Some(0.123_456_789);
        let mut file = Vec::new();
        write_csv(&rows, &mut file).unwrap();
        let text = String::from_utf8(file.clone()).unwrap();
        assert!(text.starts_with("scene,sensors,people,tracker,runs,successes,success_low,"), "{text}");
        assert!(text.contains("\n\"door area, H\",2,1,kehai,200,200,0.98"), "{text}");
        assert_eq!(read_csv(file.as_slice()).unwrap(), rows);
        assert!(read_csv(&b"scene,people\nhall,x\n"[..]).is_err());
    }

    #[test]
    fn markdown_puts_the_paper_below_ours() {
        let text = success_markdown(&rows());
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "| door area, H, 2 sensors | 1 | 7 |");
        assert_eq!(lines[1], "|---|--:|--:|");
        assert_eq!(lines[2], "| kehai | 100 [98–100] | 92.5 [88–95] |");
        assert_eq!(lines[3], "| lee\\|38 | – | 20 [15–26] |");
        assert_eq!(lines[4], "| paper A, Table 1 | 100 [72–100] | 10 [2–40] |");
        assert_eq!(lines[8], "| kehai | 0 [0–2] |");
        assert_eq!(lines[9], "| paper A, Table 1 | – |");
        let figures = figures_markdown(&rows());
        let columns = |line: &str| line.replace("\\|", "").matches('|').count();
        assert!(figures.lines().filter(|line| !line.is_empty()).all(|line| columns(line) == 16), "{figures}");
    }

    #[test]
    fn a_row_counts_its_runs() {
        let row = row("hall", 3, "kehai", 150);
        assert_eq!((row.runs, row.successes, row.steady, row.success()), (200, 150, 0, 0.75));
        assert!(row.success_low < 0.75 && 0.75 < row.success_high);
    }
}
