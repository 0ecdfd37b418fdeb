//! `kehai-tracker export`: what a database holds, as CSV or Parquet.

use std::path::PathBuf;

use clap::Args;
use host_tracker::store::export::{Format, export};
use host_tracker::store::raw;
use kehai_tracking::snapshot::unix_ms;

use super::failure::Failure;
use super::output::print;

/// Write what happened as CSV or Parquet files: paths, counts, events, modules' places and health
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker export door.db --out yesterday --hours 24
  kehai-tracker export door.db --out all --format parquet")]
pub struct Arguments {
    /// From kehai-tracker run --db
    #[arg(value_name = "FILE")]
    db: PathBuf,

    /// Folder for the files, made if missing
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

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
    for file in export(&arguments.db, &arguments.out, (from_ms, now_ms), arguments.format)? {
        print(file.display())?;
    }
    Ok(())
}
