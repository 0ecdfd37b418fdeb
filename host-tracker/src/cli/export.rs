//! `kehai-tracker export`: what a database holds, as CSV.

use std::path::PathBuf;

use clap::Args;
use host_tracker::frame::unix_ms;
use host_tracker::store::export::export;

use super::Failure;

/// Write what happened as CSV files: paths, counts, events
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker export door.db --out yesterday --hours 24
  kehai-tracker export door.db --out all")]
pub struct Arguments {
    /// From kehai-tracker run --db
    #[arg(value_name = "FILE")]
    db: PathBuf,

    /// Folder for the files, made if missing
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// Only the last so many hours
    #[arg(long, value_name = "N")]
    hours: Option<u64>,
}

/// Exports.
///
/// # Errors
/// One line: what cannot be read or written.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let now_ms = unix_ms();
    let from_ms = arguments.hours.map_or(0, |hours| now_ms.saturating_sub(hours.saturating_mul(3_600_000)));
    export(&arguments.db, &arguments.out, from_ms, now_ms)?;
    Ok(())
}
