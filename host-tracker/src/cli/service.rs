//! The service that the package brings: where its files are.
//!
//! Source: `packaging/debian/kehai-tracker.service`.

use std::path::{Path, PathBuf};

use clap::Args;
use host_tracker::backup::Places;

/// The site of the service.
pub(super) const SITE: &str = "/etc/kehai/site.toml";

/// Its database.
pub(super) const DATABASE: &str = "/var/lib/kehai/site.db";

/// Whose files a command is for.
#[derive(Debug, Args)]
pub(super) struct Place {
    /// The site's file
    #[arg(long, value_name = "FILE.toml", default_value = SITE)]
    site: PathBuf,

    /// The database [default: /var/lib/kehai/site.db; with another --site, that beside it, as home.db beside home.toml]
    #[arg(long, value_name = "FILE")]
    db: Option<PathBuf>,

    /// The keys of the site's modules [default: beside the site file, as SITE.keys]
    #[arg(long, value_name = "FILE", env = "KEHAI_KEYS")]
    keys: Option<PathBuf>,
}

impl Place {
    /// Where everything is.
    pub(super) fn places(&self) -> Places {
        let usual =
            if self.site == Path::new(SITE) { DATABASE.into() } else { self.site.with_extension("db") };
        let database = Some(self.db.clone().unwrap_or(usual));
        Places { site: self.site.clone(), database, keys: self.keys.clone() }
    }
}
