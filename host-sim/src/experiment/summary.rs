//! The summary of a table as it stands on its page, from the lines of the full table.
//!
//! ```text
//! | door area, D: counted right, % of runs | 1            | 2  …       conditions, the worst one first:
//! | kehai                                  | 100 [98–100] |            trackers down, people across
//! | lee                                    | 98 [95–99]   |
//!
//! | kehai, door area, D                    | 1            | 2  …       our own other figures
//! | IDF1                                   | 1.000        |
//! ```

use std::fmt::Write as _;

use super::line::{COUNTED_RIGHT, Line, percent};
use super::paper::{PAPER_A_NAME, PAPER_A_SUCCESSES, PAPER_A_TRIALS};
use crate::world::variation::Letter;

/// How a summary is laid out.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Layout {
    /// For each condition all trackers by count success, the paper's beside them, and our own other figures; people
    /// across.
    Crowd,
    /// Trackers down, people across; in each cell count success and IDF1.
    Ablation,
    /// For each condition the figures of the only tracker; people across.
    Conditions,
    /// A line for each row, the worst one first: all figures of our tracker, the first one of every other.
    Compared,
    /// A line for each row and tracker, in the order of the run.
    AsRun,
}

/// The summary of these lines.
#[must_use]
pub fn markdown(lines: &[Line], layout: Layout) -> String {
    let rows = rows(lines);
    match layout {
        Layout::Crowd => crowd(&rows),
        Layout::Ablation => ablation(&rows),
        // The first figure is the paper's.
        Layout::Conditions => conditions(&rows, 1).iter().map(|rows| by_people(rows, 0)).collect(),
        Layout::Compared => compared(&rows),
        Layout::AsRun => as_run(&rows),
    }
}

/// All lines of one row and one tracker.
#[derive(Clone, Copy)]
struct Row<'a> {
    lines: &'a [Line],
    first: &'a Line,
    title: Title<'a>,
}

/// The title of a row, by its parts: `door area, H, 7`.
#[derive(Clone, Copy)]
struct Title<'a> {
    /// The scene with its condition.
    scene: &'a str,
    /// How people come and wait, where the title says so.
    condition: Option<Letter>,
    /// The number of people, as it is written.
    people: &'a str,
}

impl<'a> Title<'a> {
    fn of(row: &'a str) -> Self {
        let (scene, people) = row.rsplit_once(", ").unwrap_or((row, ""));
        let condition = scene.rsplit_once(", ").and_then(|(_, letter)| letter.parse().ok());
        Self { scene, condition, people }
    }

    fn number(self) -> Option<usize> {
        self.people.parse().ok()
    }
}

impl<'a> Row<'a> {
    fn cell(self, figure: &str) -> &'a str {
        self.lines.iter().find(|line| line.figure == figure).map_or("–", |line| line.printed.as_str())
    }

    /// By what rows are compared: the first figure, where it is known.
    fn value(self) -> f64 {
        self.first.value.unwrap_or(f64::INFINITY)
    }

    fn names(self) -> Vec<&'a str> {
        self.lines.iter().map(|line| line.figure.as_str()).collect()
    }
}

fn rows(lines: &[Line]) -> Vec<Row<'_>> {
    let same = |one: &Line, other: &Line| one.row == other.row && one.tracker == other.tracker;
    let row = |lines| {
        let first = <[Line]>::first(lines)?;
        Some(Row { lines, first, title: Title::of(&first.row) })
    };
    lines.chunk_by(same).filter_map(row).collect()
}

/// The trackers, in the order of their first row: ours is the first.
fn trackers<'a>(rows: &[Row<'a>]) -> Vec<&'a str> {
    let mut names: Vec<&str> = Vec::new();
    for row in rows {
        if !names.contains(&row.first.tracker.as_str()) {
            names.push(&row.first.tracker);
        }
    }
    names
}

/// The rows of each condition together: first the one in which the figure at `by` of our tracker is lowest.
fn conditions<'a>(rows: &[Row<'a>], by: usize) -> Vec<Vec<Row<'a>>> {
    let mut groups: Vec<Vec<Row>> = Vec::new();
    for row in rows {
        match groups.iter_mut().find(|group| group[0].title.scene == row.title.scene) {
            Some(group) => group.push(*row),
            None => groups.push(vec![*row]),
        }
    }
    let worst = |group: &Vec<Row>| {
        let ours = group.iter().filter(|row| row.first.tracker == group[0].first.tracker);
        let values = ours.filter_map(|row| row.lines.get(by)?.value);
        values.fold(f64::INFINITY, f64::min)
    };
    groups.sort_by(|one, other| worst(one).total_cmp(&worst(other)));
    groups
}

/// One line of a Markdown table.
fn line(text: &mut String, first: &str, cells: &[&str]) {
    let _ = writeln!(
        text,
        "| {} | {} |",
        escaped(first),
        cells.iter().map(|cell| escaped(cell)).collect::<Vec<_>>().join(" | ")
    );
}

/// The head of a table and the rule under it.
fn head(text: &mut String, first: &str, cells: &[&str]) {
    line(text, first, cells);
    let _ = writeln!(text, "|---|{}", "--:|".repeat(cells.len()));
}

fn escaped(text: &str) -> String {
    text.replace('|', "\\|")
}

/// The numbers of people in these rows, in their order.
fn people<'a>(rows: &[Row<'a>]) -> Vec<&'a str> {
    let mut people: Vec<&str> = Vec::new();
    for row in rows {
        if !people.contains(&row.title.people) {
            people.push(row.title.people);
        }
    }
    people
}

fn crowd(rows: &[Row]) -> String {
    let mut text = String::new();
    for rows in conditions(rows, 0) {
        let (scene, people) = (rows[0].title.scene, people(&rows));
        head(&mut text, &format!("{scene}: {COUNTED_RIGHT}"), &people);
        for tracker in trackers(&rows) {
            line(&mut text, tracker, &cells(&rows, tracker, &people, COUNTED_RIGHT));
        }
        let paper: Vec<String> = people.iter().map(|number| of_paper(number)).collect();
        line(&mut text, PAPER_A_NAME, &paper.iter().map(String::as_str).collect::<Vec<_>>());
        text.push('\n');
        let ours: Vec<Row> =
            rows.iter().filter(|row| row.first.tracker == rows[0].first.tracker).copied().collect();
        text.push_str(&by_people(&ours, 1));
    }
    text.push_str(&dense(rows));
    text
}

/// The paper's figure for this number of people.
fn of_paper(people: &str) -> String {
    let index = people.parse::<usize>().ok().and_then(|number| number.checked_sub(1));
    let right = index.and_then(|index| PAPER_A_SUCCESSES.get(index));
    right.map_or("–".into(), |right| percent(*right, PAPER_A_TRIALS))
}

/// The cells of a tracker for every number of people.
fn cells<'a>(rows: &[Row<'a>], tracker: &str, people: &[&str], figure: &str) -> Vec<&'a str> {
    let of =
        |number: &&str| rows.iter().find(|row| row.first.tracker == tracker && row.title.people == *number);
    people.iter().map(|number| of(number).map_or("–", |row| row.cell(figure))).collect()
}

/// The figures of one tracker in one condition from the `skipped`th on, people across.
fn by_people(rows: &[Row], skipped: usize) -> String {
    let Some(first) = rows.first() else { return String::new() };
    let (mut text, people, tracker) = (String::new(), people(rows), first.first.tracker.as_str());
    head(&mut text, &format!("{tracker}, {}", first.title.scene), &people);
    for figure in first.names().into_iter().skip(skipped) {
        line(&mut text, figure, &cells(rows, tracker, &people, figure));
    }
    text.push('\n');
    text
}

/// A sentence on condition H with five to seven people together, by which worlds are compared.
fn dense(rows: &[Row]) -> String {
    let own = |tracker: &str| {
        let dense = rows.iter().filter(|row| {
            let is_dense = row.title.condition == Some(Letter::H);
            row.first.tracker == tracker && is_dense && matches!(row.title.number(), Some(5..=7))
        });
        let right = |line: &Line| (line.value.unwrap_or(0.0) * line.runs as f64 / 100.0).round() as u64;
        let (right, runs) =
            dense.fold((0, 0), |(yes, of), row| (yes + right(row.first), of + row.first.runs));
        (runs > 0).then(|| format!("`{tracker}` {}", percent(right, runs)))
    };
    let words: Vec<String> = trackers(rows).into_iter().filter_map(own).collect();
    if words.is_empty() {
        return String::new();
    }
    format!("H, five to seven people together: {}.\n", words.join(", "))
}

fn ablation(rows: &[Row]) -> String {
    let mut text = String::new();
    for rows in conditions(rows, 0) {
        let people = people(&rows);
        head(&mut text, &format!("{}: {COUNTED_RIGHT} · IDF1", rows[0].title.scene), &people);
        for tracker in trackers(&rows) {
            let right = cells(&rows, tracker, &people, COUNTED_RIGHT);
            let idf1 = cells(&rows, tracker, &people, "IDF1");
            let both: Vec<String> =
                right.iter().zip(idf1).map(|(right, idf1)| format!("{right} · {idf1}")).collect();
            line(&mut text, tracker, &both.iter().map(String::as_str).collect::<Vec<_>>());
        }
        text.push('\n');
    }
    text
}

fn compared(rows: &[Row]) -> String {
    let names = trackers(rows);
    let Some((ours, others)) = names.split_first() else { return String::new() };
    let mut own: Vec<&Row> = rows.iter().filter(|row| row.first.tracker == *ours).collect();
    own.sort_by(|one, other| one.value().total_cmp(&other.value()));
    let mut text = String::new();
    let Some(figures) = own.first().map(|row| row.names()) else { return text };
    let heading = |(index, figure): (usize, &&str)| {
        if index == 0 && !others.is_empty() { format!("{figure}: {ours}") } else { (*figure).to_owned() }
    };
    let headings: Vec<String> =
        std::iter::once("runs".to_owned())
            .chain(figures.iter().take(1).enumerate().map(heading))
            .chain(others.iter().map(ToString::to_string))
            .chain(figures.iter().skip(1).map(|figure| {
                if others.is_empty() { (*figure).to_owned() } else { format!("{ours}: {figure}") }
            }))
            .collect();
    head(&mut text, "", &headings.iter().map(String::as_str).collect::<Vec<_>>());
    for row in own {
        let runs = row.first.runs.to_string();
        let of = |other: &&str| {
            let same =
                |candidate: &&Row| candidate.first.row == row.first.row && candidate.first.tracker == **other;
            rows.iter().find(same).map_or("–", |row| row.first.printed.as_str())
        };
        let cells: Vec<&str> = std::iter::once(runs.as_str())
            .chain(figures.iter().take(1).map(|figure| row.cell(figure)))
            .chain(others.iter().map(of))
            .chain(figures.iter().skip(1).map(|figure| row.cell(figure)))
            .collect();
        line(&mut text, &row.first.row, &cells);
    }
    text.push('\n');
    text
}

fn as_run(rows: &[Row]) -> String {
    let mut text = String::new();
    for part in rows.chunk_by(|one, other| one.names() == other.names()) {
        let single = trackers(rows).len() == 1;
        let names = part[0].names();
        let titles: &[&str] = if single { &["runs"] } else { &["", "runs"] };
        head(&mut text, "", &[titles, &names].concat());
        for row in part {
            let runs = row.first.runs.to_string();
            let first: Vec<&str> = if single { vec![&runs] } else { vec![&row.first.tracker, &runs] };
            let cells: Vec<&str> = row.lines.iter().map(|line| line.printed.as_str()).collect();
            line(&mut text, &row.first.row, &[first, cells].concat());
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::line::Heading;
    use super::*;

    fn row(name: &str, tracker: &str, right: u64) -> Vec<Line> {
        let heading = Heading { row: name.into(), tracker: tracker.into(), seeds: (0, 199), runs: 200 };
        vec![heading.share(COUNTED_RIGHT, right, 200), heading.line("IDF1", Some(0.9), "0.900".into())]
    }

    #[test]
    fn the_worst_condition_stands_first_and_the_paper_below_ours() {
        let lines = [
            row("hall, H, 1", "kehai", 200),
            row("hall, H, 1", "lee", 10),
            row("hall, H, 7", "kehai", 199),
            row("hall, H, 7", "lee", 12),
            row("hall, D, 1", "kehai", 200),
            row("hall, D, 7", "kehai", 185),
        ];
        let text = markdown(&lines.concat(), Layout::Crowd);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "| hall, D: counted right, % of runs | 1 | 7 |", "{text}");
        assert_eq!(lines[2], "| kehai | 100 [98–100] | 92.5 [88–95] |");
        assert_eq!(lines[3], "| paper A, Table 1 | 100 [72–100] | 10 [2–40] |");
        assert_eq!(lines[5], "| kehai, hall, D | 1 | 7 |");
        assert_eq!(lines[7], "| IDF1 | 0.900 | 0.900 |");
        assert_eq!(lines[9], "| hall, H: counted right, % of runs | 1 | 7 |");
        assert_eq!(lines[12], "| lee | 5 [3–9] | 6 [3–10] |");
        assert_eq!(
            lines.last(),
            Some(&"H, five to seven people together: `kehai` 99.5 [97–100], `lee` 6 [3–10].")
        );
    }

    #[test]
    fn what_is_compared_stands_in_one_line_the_worst_first() {
        let lines = [
            row("backpack", "kehai", 200),
            row("backpack", "a|b", 150),
            row("suitcase", "kehai", 20),
            row("suitcase", "a|b", 0),
        ];
        let text = markdown(&lines.concat(), Layout::Compared);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "|  | runs | counted right, % of runs: kehai | a\\|b | kehai: IDF1 |", "{text}");
        assert_eq!(lines[2], "| suitcase | 200 | 10 [7–15] | 0 [0–2] | 0.900 |");
        assert_eq!(lines[3], "| backpack | 200 | 100 [98–100] | 75 [69–80] | 0.900 |");
    }

    #[test]
    fn other_figures_get_a_heading_of_their_own() {
        let heading = Heading { row: "held open".into(), tracker: "kehai".into(), seeds: (0, 1), runs: 2 };
        let lines = [
            row("in file", "kehai", 100),
            row("side by side", "kehai", 50),
            vec![heading.share("late, %", 1, 2)],
        ];
        let text = markdown(&lines.concat(), Layout::AsRun);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "|  | runs | counted right, % of runs | IDF1 |", "{text}");
        assert_eq!(lines[3], "| side by side | 200 | 25 [20–31] | 0.900 |");
        assert_eq!(lines[5], "|  | runs | late, % |");
        let two = [row("in file", "kehai", 100), row("in file", "lee", 50)].concat();
        assert!(markdown(&two, Layout::AsRun).contains("| in file | lee | 200 | 25 [20–31] |"));
    }

    #[test]
    fn an_idea_is_judged_by_both_figures() {
        let text = markdown(
            &[row("hall, H, 5", "kehai", 200), row("hall, H, 5", "without", 100)].concat(),
            Layout::Ablation,
        );
        assert!(text.contains("| without | 50 [43–57] · 0.900 |"), "{text}");
    }
}
