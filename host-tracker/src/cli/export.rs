//! `kehai-tracker export`: what a database holds, as CSV or Parquet.

use std::path::{Path, PathBuf};

use clap::Args;
use host_tracker::store::export::partitioned::{self, Whose};
use host_tracker::store::export::{Format, export};
use host_tracker::store::raw;
use kehai_tracking::snapshot::unix_ms;

use super::failure::Failure;
use super::log::say;
use super::output::print;

/// Write what happened as CSV or Parquet files: paths, counts, events, modules' places and health
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker export door.db --out yesterday --hours 24
  kehai-tracker export door.db --out all --format parquet
  kehai-tracker export door.db --partitioned lake --site office --hours 48")]
pub struct Arguments {
    /// From kehai-tracker run --db
    #[arg(value_name = "FILE")]
    db: PathBuf,

    /// Folder for the files, made if missing
    #[arg(long, value_name = "DIR", required_unless_present = "partitioned")]
    out: Option<PathBuf>,

    /// Instead: folder for Parquet files by table, site, area and day, which DuckDB, Polars and Spark read as one table; whole
    /// days, by UTC
    #[arg(long, value_name = "DIR", conflicts_with_all = ["out", "format"])]
    partitioned: Option<PathBuf>,

    /// The site's name, for --partitioned; the database's by default
    #[arg(long, value_name = "NAME", requires = "partitioned", value_parser = named)]
    site: Option<String>,

    /// The name of the part of the site that this tracker follows, for --partitioned
    #[arg(long, value_name = "NAME", requires = "partitioned", value_parser = named, default_value = "main")]
    area: String,

    /// csv or parquet
    #[arg(long, value_name = "FORMAT", default_value_t = Format::default())]
    format: Format,

    /// Only the last so many hours
    #[arg(long, value_name = "N")]
    hours: Option<u64>,
}

/// Exports.
///
/// # Errors
/// One line: what cannot be read or written.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    // Said once: what follows would say it each in its own words.
    if let Err(error) = std::fs::metadata(&arguments.db) {
        return Err(
            format!("{}: {error}; kehai-tracker run --db FILE makes one", arguments.db.display()).into()
        );
    }
    let now_ms = unix_ms();
    if let Err(error) = raw::forget_expired(&arguments.db, now_ms) {
        tracing::warn!("raw scans that have expired are not deleted: {error}");
    }
    let from_ms = arguments.hours.map_or(0, |hours| now_ms.saturating_sub(hours.saturating_mul(3_600_000)));
    if let Some(folder) = &arguments.partitioned {
        return by_day(arguments, folder, (from_ms, now_ms));
    }
    let Some(out) = &arguments.out else { return Ok(()) };
    for file in export(&arguments.db, out, (from_ms, now_ms), arguments.format)? {
        print(file.display())?;
    }
    Ok(())
}

fn by_day(arguments: &Arguments, folder: &Path, span_ms: (u64, u64)) -> Result<(), Failure> {
    let stem = || arguments.db.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let whose = Whose { site: arguments.site.clone().unwrap_or_else(stem), area: arguments.area.clone() };
    let written = partitioned::export(&arguments.db, folder, &whose, span_ms)?;
    for file in &written.files {
        print(file.display())?;
    }
    if !written.left.is_empty() {
        let left = match written.left.len() {
            1 => "1 file of before is left as it is: it has".to_owned(),
            count => format!("{count} files of before are left as they are: they have"),
        };
        say(format_args!(
            "{left} more rows than the database (it has forgotten some, or another tracker writes under the same --site and --area)"
        ));
    }
    Ok(())
}

fn named(name: &str) -> Result<String, String> {
    if name.trim().is_empty() { Err("a name has a letter at least".to_owned()) } else { Ok(name.to_owned()) }
}
