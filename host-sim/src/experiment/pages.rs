//! Writes all tables into the pages of the documentation, and looks whether they are still what comes out.
//!
//! ```text
//!   results ─┬─▶ docs/tables/TABLE.csv, TABLE-seeds.csv      every figure; the digest of every run
//!            └─▶ docs/PAGE.md    <!-- table: TABLE -->
//!                                | … |                       everything between the two comments is replaced
//!                                <!-- end: TABLE -->
//!
//!   check:  TABLE.csv ─▶ section ─ = ─ page       nothing was written by hand, all tables but those apart are of one commit
//!           TABLE-seeds.csv ─ = ─ some seeds run again, digest by digest
//! ```
//!
//! A run is the same on every machine, so the check has no false alarms. It misses a run that comes out otherwise
//! with a probability of 2⁻¹⁶; what changes only one run in n is found if the seeds that are run again hold it.

use std::collections::BTreeSet;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::line::{self, ByRow, Digests, Line};
use super::plan::Table;
use super::results::Results;
use super::summary::{Layout, markdown};

/// The command that writes them.
pub const COMMAND: &str = "cargo figures pages";

/// A page and its tables, in its order.
#[derive(Clone, Copy, Debug)]
pub struct Page {
    /// Its file in the folder of the documentation.
    pub file: &'static str,
    /// Its tables.
    pub tables: &'static [Table],
    /// They are printed apart from all others, and may name another commit.
    pub apart: bool,
}

/// All pages with tables.
pub const PAGES: [Page; 4] = [
    Page { file: "accuracy.md", tables: &Table::EACH, apart: false },
    // Nothing but floors and tags has a part in it.
    Page { file: "accuracy.md", tables: &[Table::Floor], apart: true },
    Page { file: "door.md", tables: &[Table::Passages, Table::PaperA], apart: false },
    Page { file: "calibration.md", tables: &[Table::Poses], apart: false },
];

/// Every table of every page.
pub fn tables() -> impl Iterator<Item = Table> {
    PAGES.iter().flat_map(|page| page.tables).copied()
}

/// Whether it may name another commit than all others.
#[must_use]
pub fn is_apart(table: Table) -> bool {
    PAGES.iter().any(|page| page.apart && page.tables.contains(&table))
}

const fn layout(table: Table) -> Layout {
    match table {
        Table::Door | Table::Thighs | Table::Pairs => Layout::Crowd,
        Table::Ideas => Layout::Ablation,
        Table::PaperA => Layout::Conditions,
        Table::Leaving | Table::Touching | Table::Standing | Table::Chairs | Table::Carried | Table::Home => {
            Layout::Compared
        }
        Table::All
        | Table::Clutter
        | Table::Disturbed
        | Table::Entrance
        | Table::Passages
        | Table::Poses
        | Table::FloorPoses
        | Table::Floor
        | Table::FloorAndModules
        | Table::Lines
        | Table::HomeHard => Layout::AsRun,
    }
}

/// What stands on the page: the summary, and where it comes from.
fn section(table: Table, lines: &[Line]) -> String {
    let first = lines.iter().map(|line| line.first_seed).min().unwrap_or(0);
    let last = lines.iter().map(|line| line.last_seed).max().unwrap_or(0);
    let commit = lines.first().map_or("", |line| &line.commit);
    format!(
        "{}\n\nPrinted at commit `{commit}` by `{COMMAND}`; seeds {first} to {last}; every figure: \
         [{table}.csv](tables/{table}.csv).",
        markdown(lines, layout(table)).trim_end()
    )
}

/// Puts `text` between the comments of `table`; None where the page has no such pair.
fn fill(page: &str, table: Table, text: &str) -> Option<String> {
    let (before, _, after) = parts(page, table)?;
    Some(format!("{before}{text}\n{after}"))
}

/// What stands before, between and after the comments of `table`, comments not between.
fn parts(page: &str, table: Table) -> Option<(&str, &str, &str)> {
    let (begin, end) = (format!("<!-- table: {table} -->\n"), format!("<!-- end: {table} -->"));
    let from = page.find(&begin)? + begin.len();
    let to = from + page.get(from..)?.find(&end)?;
    Some((page.get(..from)?, page.get(from..to)?, page.get(to..)?))
}

/// The commit that is checked out in the repository around `docs`.
///
/// # Errors
/// One line: `docs` is in no repository, or a change outside `docs` is not committed.
pub fn commit(docs: &Path) -> Result<String, String> {
    let git = |arguments: &[&str]| {
        let output = Command::new("git").arg("-C").arg(docs).args(arguments).output();
        let output = output.map_err(|error| format!("git: {error}"))?;
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
        if output.status.success() { Ok(text(&output.stdout)) } else { Err(text(&output.stderr)) }
    };
    let changed = git(&["status", "--porcelain", "--", ":(top)", ":(exclude,top)docs"])?;
    if let Some(file) = changed.lines().next() {
        let file = file.trim_start().split_once(' ').map_or(file, |(_, name)| name.trim_start());
        return Err(format!("{file} is in no commit: tables name the commit that printed them"));
    }
    git(&["rev-parse", "--short=10", "HEAD"])
}

fn csv(docs: &Path, table: Table, ending: &str) -> PathBuf {
    docs.join("tables").join(format!("{table}{ending}"))
}

/// Looks whether every one of these tables has its place in its page.
///
/// # Errors
/// One line: which has none.
pub fn have_places(docs: &Path, wanted: &[Table]) -> Result<(), String> {
    for page in PAGES {
        let path = docs.join(page.file);
        let text = std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        for table in page.tables.iter().filter(|table| wanted.contains(table)) {
            if parts(&text, *table).is_none() {
                let (path, table) = (path.display(), table.to_string());
                return Err(format!(
                    "{path}: no place for {table}: add <!-- table: {table} --> and <!-- end: {table} -->"
                ));
            }
        }
    }
    Ok(())
}

/// Writes a table: its two files, its section of the page, and the picture if it has one.
///
/// # Errors
/// A file cannot be read or written, or the page has no place for it.
pub fn write(docs: &Path, table: Table, results: &Results, commit: &str) -> Result<(), String> {
    let named = |line: &Line| Line { commit: commit.to_owned(), ..line.clone() };
    let lines: Vec<Line> = results.lines.iter().map(named).collect();
    let digests = line::written(&line::digests(&results.runs), commit);
    std::fs::create_dir_all(docs.join("tables")).map_err(|error| format!("{}: {error}", docs.display()))?;
    let create = |path: &Path| File::create(path).map_err(|error| format!("{}: {error}", path.display()));
    let path = csv(docs, table, ".csv");
    line::write(&lines, create(&path)?).map_err(|error| format!("{}: {error}", path.display()))?;
    let path = csv(docs, table, "-seeds.csv");
    line::write(&digests, create(&path)?).map_err(|error| format!("{}: {error}", path.display()))?;
    for page in PAGES.iter().filter(|page| page.tables.contains(&table)) {
        let path = docs.join(page.file);
        let named = |error: std::io::Error| format!("{}: {error}", path.display());
        let before = std::fs::read_to_string(&path).map_err(named)?;
        let after = fill(&before, table, &section(table, &lines));
        let after = after.ok_or_else(|| format!("{}: no place for {table}", path.display()))?;
        std::fs::write(&path, after).map_err(named)?;
    }
    if table == Table::Door {
        let path = docs.join("images").join("accuracy.svg");
        let written = path.parent().map_or(Ok(()), std::fs::create_dir_all);
        let written = written.and_then(|()| std::fs::write(&path, results.picture()));
        written.map_err(|error| format!("{}: {error}", path.display()))?;
    }
    Ok(())
}

/// A table as it was written.
#[derive(Clone, Debug)]
pub struct Written {
    lines: Vec<Line>,
    digests: ByRow,
    commits: BTreeSet<String>,
}

/// Reads the files of a table, and compares them with its page.
///
/// # Errors
/// One line: a file is missing, is no table, or the page says something else.
pub fn read(docs: &Path, table: Table) -> Result<Written, String> {
    fn rows<T: serde::de::DeserializeOwned>(path: &Path) -> Result<Vec<T>, String> {
        let file =
            File::open(path).map_err(|error| format!("{}: {error}; print it: {COMMAND}", path.display()))?;
        line::read(file).map_err(|error| format!("{}: {error}", path.display()))
    }
    let lines: Vec<Line> = rows(&csv(docs, table, ".csv"))?;
    let digests: Vec<Digests> = rows(&csv(docs, table, "-seeds.csv"))?;
    for page in PAGES.iter().filter(|page| page.tables.contains(&table)) {
        let path = docs.join(page.file);
        let text = std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        let own = parts(&text, table).map(|parts| parts.1.trim_end());
        if own != Some(section(table, &lines).as_str()) {
            let (page, table) = (path.display(), table.to_string());
            return Err(format!(
                "{page}: what stands at {table} is not what tables/{table}.csv says; {COMMAND}"
            ));
        }
    }
    let commits = lines.iter().map(|line| &line.commit).chain(digests.iter().map(|row| &row.commit));
    let commits = commits.cloned().collect();
    Ok(Written { lines, digests: line::parsed(&digests)?, commits })
}

impl Written {
    /// The commits that are named in it.
    #[must_use]
    pub const fn commits(&self) -> &BTreeSet<String> {
        &self.commits
    }

    /// Rows in which `again`, results of some of the same seeds, differs: one line each.
    #[must_use]
    pub fn differences(&self, again: &Results) -> Vec<String> {
        let (mut differences, rerun) = (Vec::new(), line::digests(&again.runs));
        for ((row, tracker), seeds) in &rerun {
            let name = if tracker.is_empty() { row.clone() } else { format!("{row}, {tracker}") };
            let Some(before) = self.digests.get(&(row.clone(), tracker.clone())) else {
                differences.push(format!("{name}: not on the page"));
                continue;
            };
            let changed: Vec<String> = seeds
                .iter()
                .filter(|(seed, digest)| before.get(seed) != Some(digest))
                .map(|(seed, _)| seed.to_string())
                .collect();
            if !changed.is_empty() {
                let figures = figures(&self.lines, &again.lines, row, tracker);
                let (number, of, seeds) = (changed.len(), seeds.len(), changed.join(", "));
                differences
                    .push(format!("{name}: {number} of {of} runs are otherwise (seeds {seeds}); {figures}"));
            }
        }
        let gone = self.digests.keys().filter(|row| !rerun.contains_key(*row));
        differences
            .extend(gone.map(|(row, tracker)| format!("{row}, {tracker}: on the page, but no longer run")));
        differences
    }
}

/// The first figures of a row, on the page and again.
fn figures(page: &[Line], again: &[Line], row: &str, tracker: &str) -> String {
    let own = |line: &&Line| line.row == row && line.tracker == tracker;
    let words = page.iter().filter(own).zip(again.iter().filter(own)).take(5).map(|(page, again)| {
        format!("{}: {} in these, {} on the page", page.figure, again.printed, page.printed)
    });
    words.collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::super::line::{Heading, Run};
    use super::*;

    #[test]
    fn only_what_is_between_the_comments_changes() {
        let page = "a\n<!-- table: door -->\nold\n<!-- end: door -->\nb\n<!-- table: ideas -->\n<!-- end: ideas -->\n";
        let filled = fill(page, Table::Door, "| new |").unwrap();
        assert_eq!(filled, page.replace("old", "| new |"));
        assert_eq!(fill(&filled, Table::Door, "old").unwrap(), page);
        assert_eq!(fill(page, Table::Poses, ""), None);
        assert_eq!(fill("<!-- table: door -->\n", Table::Door, ""), None);
    }

    #[test]
    fn every_table_has_its_place_and_every_page_says_first_what_it_does_not_show() {
        let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
        let all: Vec<Table> = tables().collect();
        have_places(&docs, &all).unwrap();
        assert_eq!(all.len(), Table::EACH.len() + 4);
        for page in PAGES {
            let text = std::fs::read_to_string(docs.join(page.file)).unwrap();
            let head: String = text.lines().take(10).collect::<Vec<_>>().join(" ");
            for words in ["does not show", "own world", "development seeds"] {
                assert!(head.contains(words), "the first ten lines of {} lack \"{words}\"", page.file);
            }
        }
    }

    /// Results of a row of 200 seeds, of which every one that `worse` names is wrong.
    fn results(row: &str, worse: impl Fn(u64) -> bool, every: usize) -> Results {
        let seeds: Vec<u64> = (10_000..10_200).step_by(every).collect();
        let right = seeds.iter().filter(|seed| !worse(**seed)).count() as u64;
        let heading = Heading {
            row: row.into(),
            tracker: "kehai".into(),
            seeds: (10_000, 10_199),
            runs: seeds.len() as u64,
        };
        let run = |seed: &u64| Run {
            row: row.into(),
            tracker: "kehai".into(),
            seed: *seed,
            figures: format!("right {}\n", worse(*seed)),
        };
        let lines = vec![heading.share("right, %", right, seeds.len() as u64)];
        Results { lines, runs: seeds.iter().map(run).collect(), ..Results::default() }
    }

    #[test]
    fn a_table_is_written_with_its_commit_and_any_run_that_changes_is_named() {
        let docs = std::env::temp_dir().join(format!("kehai-pages-{}", std::process::id()));
        std::fs::create_dir_all(&docs).unwrap();
        let page = docs.join("calibration.md");
        std::fs::write(&page, "a\n<!-- table: poses -->\n<!-- end: poses -->\nb\n").unwrap();
        write(&docs, Table::Poses, &results("home", |seed| seed == 10_025, 1), "abc123").unwrap();
        let text = std::fs::read_to_string(&page).unwrap();
        assert!(text.contains("| home | 200 | 99.5 [97–100] |"), "{text}");
        assert!(
            text.contains("Printed at commit `abc123` by `cargo figures pages`; seeds 10000 to 10199"),
            "{text}"
        );
        let written = read(&docs, Table::Poses).unwrap();
        assert_eq!(written.commits().iter().map(String::as_str).collect::<Vec<_>>(), ["abc123"]);
        assert_eq!(written.differences(&results("home", |seed| seed == 10_025, 25)), Vec::<String>::new());
        // Three runs of a hundred fail that did not, in one of the seeds that are run again.
        let worse = results("home", |seed| seed % 33 == 1 || seed == 10_025, 25);
        assert_eq!(
            written.differences(&worse),
            ["home, kehai: 1 of 8 runs are otherwise (seeds 10000); right, %: 75 [41–93] in these, \
                 99.5 [97–100] on the page"]
        );
        let other = written.differences(&results("flat", |_| false, 25));
        assert_eq!(other, ["flat, kehai: not on the page", "home, kehai: on the page, but no longer run"]);
        // A figure is improved by hand.
        std::fs::write(&page, text.replace("99.5", "100")).unwrap();
        assert!(read(&docs, Table::Poses).unwrap_err().contains("is not what tables/poses.csv says"));
        std::fs::remove_dir_all(&docs).unwrap();
    }
}
