//! `kehai-tracker backup`: everything that a tracker needs to go on, as one file.

use std::path::PathBuf;

use clap::Args;
use host_tracker::backup::{self, Part};
use host_tracker::store::raw;
use kehai_tracking::snapshot::unix_ms;

use super::failure::Failure;
use super::output::print;
use super::service::Place;

/// Keep a copy of the site, its pictures, users, keys, certificate and database in one file
///
/// A tracker may run meanwhile. Raw scans are left out: they lie in the database and nowhere else.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  sudo kehai-tracker backup kehai.tar.gz                 the service of this machine
  kehai-tracker backup home.tar.gz --site home.toml --db home.db")]
pub struct Arguments {
    /// The file to be made, for its owner alone: it holds secrets
    #[arg(value_name = "FILE.tar.gz")]
    archive: PathBuf,

    #[command(flatten)]
    place: Place,

    /// Also the key of cards: with it and the database, numbers of cards can be tried out
    #[arg(long)]
    with_card_key: bool,

    /// Replace a file that is there
    #[arg(long)]
    force: bool,
}

/// Makes it, and says what is in it.
///
/// # Errors
/// One line.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { archive, place, with_card_key, force } = arguments;
    if let Some(file) = place.named_database() {
        let missing = |error| {
            format!(
                "{}: {error}; without --db it is the one beside the site, if there is one",
                file.display()
            )
        };
        std::fs::metadata(file).map_err(missing)?;
    }
    let places = place.places()?;
    if let Some(file) = &places.keys {
        let missing = |error| format!("{}: {error}; the keys of modules are to be there", file.display());
        std::fs::metadata(file).map_err(missing)?;
    }
    if backup::finish(&places.site)? {
        tracing::warn!("a restoration that was interrupted is finished");
    }
    if let Some(file) = places.database.as_deref().filter(|file| file.exists())
        && let Err(error) = raw::forget_expired(file, unix_ms())
    {
        tracing::warn!("raw scans that have expired are not deleted: {error}");
    }
    let made = backup::make(&places, *with_card_key, archive, *force)?;
    let names =
        |parts: &mut dyn Iterator<Item = &Part>| parts.map(|part| part.name()).collect::<Vec<_>>().join(", ");
    let (file, bytes) = (archive.display(), made.bytes);
    print(format_args!("{file}: {bytes} bytes: {}", names(&mut made.parts.iter())))?;
    let secrets = names(&mut made.parts.iter().filter(|part| part.is_secret()));
    if !secrets.is_empty() {
        print(format_args!("it holds secrets ({secrets}): its mode is 0600; keep it as you keep a key"))?;
    }
    if !made.parts.contains(&Part::Database) {
        let database = places.database.unwrap_or_default();
        print(format_args!("without a database: there is no {}; --db says where it is", database.display()))?;
    }
    Ok(())
}
