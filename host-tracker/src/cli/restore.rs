//! `kehai-tracker restore`: goes on where a backup was made.

use std::path::PathBuf;

use clap::Args;
use host_tracker::backup;
use jiff::Timestamp;

use super::failure::Failure;
use super::output::print;
use super::service::Place;

/// Bring back what kehai-tracker backup has kept: all of it, or nothing
///
/// Everything is checked before anything changes. A tracker must not run there meanwhile. If it is interrupted, the next start
/// goes on with it.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  sudo systemctl stop kehai-tracker && sudo kehai-tracker restore kehai.tar.gz --force && sudo systemctl start kehai-tracker
  kehai-tracker restore home.tar.gz --site elsewhere/home.toml")]
pub struct Arguments {
    /// What kehai-tracker backup has made
    #[arg(value_name = "FILE.tar.gz")]
    archive: PathBuf,

    #[command(flatten)]
    place: Place,

    /// Replace what is there: site, users, database. Keys of modules that were claimed or rotated since stay
    #[arg(long)]
    force: bool,
}

/// Restores, and says what.
///
/// # Errors
/// One line; nothing has changed then.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { archive, place, force } = arguments;
    let places = place.places()?;
    let restored = backup::restore(archive, &places, *force)?;
    let made = i64::try_from(restored.made_ms).ok().and_then(|ms| Timestamp::from_millisecond(ms).ok());
    let (made, program) = (made.unwrap_or_default(), restored.program);
    let names: Vec<String> = restored.parts.iter().map(|part| part.name()).collect();
    let site = places.site.display();
    print(format_args!("{site}: as kehai-tracker {program} kept it at {made}: {}", names.join(", ")))?;
    if let Some(kept) = restored.keys_before {
        print(format_args!(
            "the keys that were there have another secret: modules that were claimed with them need {}",
            kept.display()
        ))?;
    }
    Ok(())
}
