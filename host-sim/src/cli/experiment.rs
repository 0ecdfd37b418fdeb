//! `kehai-sim experiment`: tables of trackers in simulated scenes, the pages that show them, and the check of both.

use std::collections::BTreeSet;
use std::error::Error;
use std::fs::File;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use host_sim::baselines::Choice;
use host_sim::experiment::jobs::Runs;
use host_sim::experiment::plan::Table;
use host_sim::experiment::summary::{Layout, markdown};
use host_sim::experiment::{cases, findings, line, pages, results, table, worlds};
use host_sim::run::Conditions;
use host_sim::world::variation::Letter;

use super::runs::{bar, seeds};

/// Run a table of experiments: scenes × people × seeds × trackers, on all cores
///
/// The same table and seeds give the same figures on every machine.
#[derive(Debug, Args)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "Examples:
  kehai-sim experiment door --out tables        the first table, and its picture
  kehai-sim experiment ideas --seeds 0-39       what each idea is worth, on development seeds
  kehai-sim experiment door --seeds 0-9 --tracker kehai --tracker lee
  cargo figures pages                           print every table of docs/ anew; goes on where it was cut
  cargo figures check                           run some of their seeds again, and compare"
)]
pub struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,

    /// The table
    #[arg(value_enum, required = true)]
    table: Option<Table>,

    /// First and last seed [default: the table's own, from 10000 on]; all below 10200 are development seeds
    #[arg(long, value_name = "FIRST-LAST", value_parser = seeds)]
    seeds: Option<RangeInclusive<u64>>,

    /// Trackers in the place of the table's own
    #[arg(long, value_name = "NAME")]
    tracker: Vec<Choice>,

    /// Network and clocks of the door area's tables: ideal, lan or disturbed
    #[arg(long, value_name = "NAME", default_value = "lan", value_parser = super::scene::conditions)]
    network: Conditions,

    /// Write TABLE.csv and TABLE.md to this folder; of door areas TABLE.svg, of others TABLE-runs.csv with every run
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Print the tables of docs/ anew: the pages, and beside them every figure and the digest of every run
    ///
    /// To be run with cargo, in a working tree in which everything but docs/ is committed: so what is built is what
    /// the tables name. Results are kept under target/experiments until the next commit; a run that was cut goes on.
    Pages(Docs),
    /// Play recordings of another world, with its truth, through trackers: a table of its conditions
    Cases {
        /// The folder that holds a folder for each case
        folder: PathBuf,
        /// Only cases whose names begin so [default: all]
        #[arg(long, value_name = "PREFIX")]
        only: Vec<String>,
        /// The trackers [default: kehai]
        #[arg(long, value_name = "NAME")]
        tracker: Vec<Choice>,
        /// Write cases.csv and cases.md to this folder
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Run the door area in worlds that disagree, and say which figures differ between them
    ///
    /// Other bodies, other crowds, black clothes, a site file a little wrong. A figure differs when its interval at 95 %
    /// lies apart from that of the world in which the tracker was developed.
    Worlds {
        /// Only these worlds, beside the own one [default: all]
        #[arg(long, value_name = "NAME")]
        only: Vec<String>,
        /// How people come and wait: D, H, P, T
        #[arg(long, value_name = "LETTER", default_values = ["D", "H"])]
        condition: Vec<Letter>,
        /// How many people
        #[arg(long, value_name = "N", default_values = ["3", "5", "7"])]
        people: Vec<usize>,
        /// First and last seed
        #[arg(long, value_name = "FIRST-LAST", default_value = "0-39", value_parser = seeds)]
        seeds: RangeInclusive<u64>,
        /// The trackers [default: kehai]
        #[arg(long, value_name = "NAME")]
        tracker: Vec<Choice>,
        /// Write worlds.csv, worlds-runs.csv and worlds.md to this folder
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    Counts(super::counts::Arguments),
    /// Run some seeds of every table of docs/ again, and fail if any run comes out otherwise than on its page
    Check {
        #[command(flatten)]
        docs: Docs,
        /// Only seeds that are multiples of this are run again
        #[arg(long, value_name = "N", default_value = "25", value_parser = clap::value_parser!(u64).range(1..))]
        every: u64,
    },
}

#[derive(Debug, Args)]
struct Docs {
    /// Only these tables [default: all; check then wants all but the floor's of one commit]
    #[arg(value_enum)]
    tables: Vec<Table>,

    /// The folder of the pages
    #[arg(long, value_name = "DIR", default_value = "docs")]
    docs: PathBuf,

    /// First and last seed of every table, to try it [default: each table's own]
    #[arg(long, value_name = "FIRST-LAST", value_parser = seeds)]
    seeds: Option<RangeInclusive<u64>>,
}

/// Does it.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    match (&arguments.command, arguments.table) {
        (Some(Command::Pages(docs)), _) => docs.print(),
        (Some(Command::Check { docs, every }), _) => docs.check(*every),
        (Some(Command::Cases { folder, only, tracker, out }), _) => {
            cases(folder, only, tracker, out.as_deref())
        }
        (Some(Command::Worlds { only, condition, people, seeds, tracker, out }), _) => {
            let trackers = if tracker.is_empty() { vec![Choice::default()] } else { tracker.clone() };
            let plan = worlds::Plan {
                only: only.clone(),
                conditions: condition.clone(),
                people: people.clone(),
                seeds: seeds.clone(),
                trackers,
            };
            worlds(&plan, out.as_deref())
        }
        (Some(Command::Counts(counts)), _) => super::counts::run(counts),
        (None, Some(table)) => table.each().into_iter().try_for_each(|table| one(arguments, table)),
        (None, None) => Err("which table?".into()),
    }
}

/// Plays the cases in a folder, prints their table, and writes its files.
fn cases(
    folder: &Path,
    only: &[String],
    trackers: &[Choice],
    out: Option<&Path>,
) -> Result<(), Box<dyn Error>> {
    let own = [Choice::default()];
    let trackers = if trackers.is_empty() { &own } else { trackers };
    let bar = bar("cases")?;
    let rows = cases::run(&cases::find(folder, only)?, trackers, &bar)?;
    bar.finish_and_clear();
    let lines = table::lines(&rows);
    let text = markdown(&lines, Layout::AsRun);
    print!("{text}");
    let Some(folder) = out else { return Ok(()) };
    std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let path = folder.join("cases.csv");
    let file = File::create(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    line::write(&lines, file)?;
    Ok(std::fs::write(folder.join("cases.md"), &text)?)
}

/// Runs the worlds, prints their table and what differs, and writes the files.
fn worlds(plan: &worlds::Plan, out: Option<&Path>) -> Result<(), Box<dyn Error>> {
    let runs = Runs { bar: bar("worlds")?, ..Runs::default() };
    let pooled = worlds::run(plan, &runs)?;
    runs.bar.finish_and_clear();
    let lines = findings::lines(&pooled);
    let text = markdown(&lines, Layout::AsRun);
    print!("{text}");
    println!();
    let differences = worlds::differences(&lines);
    for difference in &differences {
        println!("{difference}");
    }
    println!("{} figures differ from the own world's by more than their intervals", differences.len());
    let Some(folder) = out else { return Ok(()) };
    std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let create = |name: &str| {
        let path = folder.join(name);
        File::create(&path).map_err(|error| format!("{}: {error}", path.display()))
    };
    line::write(&lines, create("worlds.csv")?)?;
    findings::write_runs(&pooled, create("worlds-runs.csv")?)?;
    Ok(std::fs::write(folder.join("worlds.md"), &text)?)
}

/// Runs one table, prints it, and writes its files.
fn one(arguments: &Arguments, table: Table) -> Result<(), Box<dyn Error>> {
    let Arguments { tracker, seeds, network, out, .. } = arguments;
    let runs = Runs { bar: bar(table)?, ..Runs::default() };
    let results = results::run(table, tracker, seeds.as_ref(), *network, &runs)?;
    runs.bar.finish_and_clear();
    let text = markdown(&results.lines, Layout::AsRun);
    print!("{text}");
    let Some(folder) = out else { return Ok(()) };
    std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let path = |ending: &str| folder.join(format!("{table}{ending}"));
    let create = |path: &Path| File::create(path).map_err(|error| format!("{}: {error}", path.display()));
    line::write(&results.lines, create(&path(".csv"))?)?;
    std::fs::write(path(".md"), &text)?;
    if let Some(runs) = &results.runs_csv {
        std::fs::write(path("-runs.csv"), runs)?;
    }
    if !results.rows.is_empty() {
        std::fs::write(path(".svg"), results.picture())?;
    }
    Ok(())
}

impl Docs {
    fn tables(&self) -> Vec<Table> {
        if self.tables.is_empty() {
            pages::tables().collect()
        } else {
            self.tables.iter().flat_map(|table| table.each()).collect()
        }
    }

    fn print(&self) -> Result<(), Box<dyn Error>> {
        if std::env::var_os("CARGO").is_none() {
            return Err(format!(
                "start it with cargo, so that it is built from what it names: {}",
                pages::COMMAND
            )
            .into());
        }
        let (commit, tables) = (pages::commit(&self.docs)?, self.tables());
        // Before an hour is spent.
        pages::have_places(&self.docs, &tables)?;
        let kept = Path::new("target/experiments").join(&commit);
        let print = |table: &Table| -> Result<_, Box<dyn Error>> {
            let runs = Runs { kept: Some(kept.clone()), bar: bar(*table)?, ..Runs::default() };
            let results = results::run(*table, &[], self.seeds.as_ref(), Conditions::LAN, &runs)?;
            runs.bar.finish_and_clear();
            println!("{table}: {} runs", runs.bar.position());
            Ok(results)
        };
        let all = tables.iter().map(print).collect::<Result<Vec<_>, _>>()?;
        if pages::commit(&self.docs)? != commit {
            return Err(format!("another commit than {commit} was checked out meanwhile").into());
        }
        for (table, results) in tables.iter().zip(&all) {
            pages::write(&self.docs, *table, results, &commit)?;
        }
        println!("written: {} tables of commit {commit} in {}", tables.len(), self.docs.display());
        Ok(())
    }

    fn check(&self, every: u64) -> Result<(), Box<dyn Error>> {
        let (mut faults, mut commits) = (Vec::new(), BTreeSet::new());
        for table in self.tables() {
            let written = match pages::read(&self.docs, table) {
                Ok(written) => written,
                Err(fault) => {
                    faults.push(fault);
                    continue;
                }
            };
            if !pages::is_apart(table) {
                commits.extend(written.commits().iter().cloned());
            }
            let runs = Runs { every, bar: bar(table)?, ..Runs::default() };
            let again = results::run(table, &[], self.seeds.as_ref(), Conditions::LAN, &runs)?;
            runs.bar.finish_and_clear();
            let differences = written.differences(&again);
            println!("{table}: {} runs again, {} rows otherwise", runs.bar.position(), differences.len());
            faults.extend(differences.into_iter().map(|difference| format!("{table}: {difference}")));
        }
        if commits.len() > 1 {
            let commits: Vec<String> = commits.into_iter().collect();
            faults.push(format!("tables of several commits: {}", commits.join(", ")));
        }
        if faults.is_empty() {
            return Ok(());
        }
        faults.iter().for_each(|fault| println!("{fault}"));
        Err(format!(
            "{} rows or pages are not what comes out; if that is meant: {}",
            faults.len(),
            pages::COMMAND
        )
        .into())
    }
}
