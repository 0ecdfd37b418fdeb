//! `kehai-sim experiment`: tables of trackers in simulated scenes, from one command.

use std::error::Error;
use std::fs::File;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use clap::Args;
use host_sim::experiment::plan::{Table, Work};
use host_sim::experiment::{Row, findings, page, passages, picture, poses, runner, table};
use host_sim::run::{Conditions, Options};
use host_tracker::trackers::Choice;
use indicatif::{ProgressBar, ProgressStyle};

/// Run a table of experiments: scenes × people × seeds × trackers, on all cores
///
/// The same table and seeds give the same figures on every machine.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-sim experiment all --out tables --docs docs/accuracy.md       every figure of that page
  kehai-sim experiment door --out tables        the first table, and its picture
  kehai-sim experiment ideas --seeds 0-39       what each idea is worth, on development seeds
  kehai-sim experiment passages --docs docs/door.md      the guarded door
  kehai-sim experiment paper-a --docs docs/door.md       paper A's experiment from end to end
  kehai-sim experiment door --seeds 0-9 --tracker kehai --tracker lee")]
pub struct Arguments {
    /// The table
    #[arg(value_enum)]
    table: Table,

    /// First and last seed [default: the table's own, from 10000 on]; 10000-10199 are held out: tune on none of them
    #[arg(long, value_name = "FIRST-LAST", value_parser = seeds)]
    seeds: Option<RangeInclusive<u64>>,

    /// Trackers in the place of the table's own
    #[arg(long, value_name = "NAME")]
    tracker: Vec<Choice>,

    /// Network and clocks of the door area's tables: ideal, lan or disturbed
    #[arg(long, value_name = "NAME", default_value = "lan", value_parser = super::scene::conditions)]
    network: Conditions,

    /// Write TABLE.csv and TABLE.md to this folder; the door area's picture TABLE.svg, every run of others TABLE-runs.csv
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Write the tables into this page, each between its two comments, and door's picture to images/accuracy.svg beside it
    #[arg(long, value_name = "FILE.md")]
    docs: Option<PathBuf>,
}

fn seeds(text: &str) -> Result<RangeInclusive<u64>, String> {
    let bounds =
        text.split_once('-').and_then(|(first, last)| Some((first.parse().ok()?, last.parse().ok()?)));
    match bounds {
        Some((first, last)) if first <= last => Ok(first..=last),
        _ => Err("first and last seed, as in 10000-10199".into()),
    }
}

/// Does it.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    if let Some(page) = &arguments.docs {
        // Before an hour is spent.
        arguments.table.each().iter().try_for_each(|table| fill(page, *table, None))?;
    }
    if let Some(folder) = &arguments.out {
        std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    for table in arguments.table.each() {
        let text = match table.work(&arguments.tracker, arguments.seeds.as_ref()) {
            Work::Door(cases, seeds) => {
                let bar = bar(table, cases.len() as u64 * seeds.clone().count() as u64)?;
                let options = Options { conditions: arguments.network, ..Options::default() };
                let rows = runner::run(&cases, &seeds, &options, || bar.inc(1))?;
                bar.finish_and_clear();
                format!("{}Seeds {} to {}.\n", door(arguments, table, &rows)?, seeds.start(), seeds.end())
            }
            Work::Passages(tables, seeds) => {
                let choice = arguments.tracker.first().copied().unwrap_or_default();
                let runs =
                    tables.iter().map(|rows| rows.len() as u64).sum::<u64>() * seeds.clone().count() as u64;
                let bar = bar(table, runs)?;
                let mut text = String::new();
                let mut all = Vec::new();
                for rows in &tables {
                    let pooled = passages::table(rows, &seeds, choice, || bar.inc(1))?;
                    text.push_str(&findings::markdown(&pooled));
                    text.push('\n');
                    all.extend(pooled);
                }
                bar.finish_and_clear();
                if let Some(folder) = &arguments.out {
                    findings::write_runs(&all, create(folder, table, "-runs.csv")?)?;
                }
                format!("{text}Seeds {} to {}.\n", seeds.start(), seeds.end())
            }
            Work::Poses(seeds) => {
                let bar = bar(table, poses::runs(&seeds))?;
                let found = poses::run(&seeds, || bar.inc(1))?;
                bar.finish_and_clear();
                if let Some(folder) = &arguments.out {
                    std::fs::write(folder.join(format!("{table}.csv")), found.csv())?;
                }
                format!("{}\nSeeds {} to {}.\n", found.markdown(), seeds.start(), seeds.end())
            }
            Work::Trials(trials) => {
                let runs = trials.iter().map(|trial| trial.seeds.clone().count() as u64).sum();
                let bar = bar(table, runs)?;
                let all = runner::run_trials(&trials, || bar.inc(1))?;
                bar.finish_and_clear();
                if let Some(folder) = &arguments.out {
                    findings::write_csv(&all, create(folder, table, ".csv")?)?;
                    findings::write_runs(&all, create(folder, table, "-runs.csv")?)?;
                }
                let first = trials.iter().map(|trial| *trial.seeds.start()).min().unwrap_or(0);
                format!("{}\nSeeds from {first} on.\n", findings::markdown(&all))
            }
        };
        println!("{text}");
        if let Some(folder) = &arguments.out {
            std::fs::write(folder.join(format!("{table}.md")), &text)?;
        }
        if let Some(page) = &arguments.docs {
            fill(page, table, Some(&text))?;
        }
    }
    Ok(())
}

/// Writes a table of door areas; its Markdown.
fn door(arguments: &Arguments, table: Table, rows: &[Row]) -> Result<String, Box<dyn Error>> {
    let picture = || picture::draw(rows, "People counted right, by number of people").to_string();
    if let Some(folder) = &arguments.out {
        table::write_csv(rows, create(folder, table, ".csv")?)?;
        std::fs::write(folder.join(format!("{table}.svg")), picture())?;
    }
    if let (Some(page), Table::Door) = (&arguments.docs, table) {
        let folder = page.with_file_name("images");
        std::fs::create_dir_all(&folder)?;
        std::fs::write(folder.join("accuracy.svg"), picture())?;
    }
    let dense = if table == Table::Door { table::dense_markdown(rows) } else { String::new() };
    Ok(format!("{}{dense}\n{}", table::success_markdown(rows), table::figures_markdown(rows)))
}

fn bar(table: Table, runs: u64) -> Result<ProgressBar, Box<dyn Error>> {
    let bar = ProgressBar::new(runs);
    bar.set_style(ProgressStyle::with_template("{prefix:9} {bar:40} {pos}/{len} runs, {eta} left")?);
    bar.set_prefix(table.to_string());
    Ok(bar)
}

fn create(folder: &Path, table: Table, ending: &str) -> Result<File, String> {
    let path = folder.join(format!("{table}{ending}"));
    File::create(&path).map_err(|error| format!("{}: {error}", path.display()))
}

/// Puts a table in its place in the page; without a text, only looks whether there is one.
fn fill(page: &Path, table: Table, text: Option<&str>) -> Result<(), String> {
    let name = page.display();
    let before = std::fs::read_to_string(page).map_err(|error| format!("{name}: {error}"))?;
    let after = page::fill(&before, &table.to_string(), text.unwrap_or(""));
    let after = after.ok_or_else(|| {
        format!("{name}: no place for {table}: add <!-- table: {table} --> and <!-- end: {table} -->")
    })?;
    match text {
        Some(_) => std::fs::write(page, after).map_err(|error| format!("{name}: {error}")),
        None => Ok(()),
    }
}
