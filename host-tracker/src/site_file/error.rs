//! Why a site file is not loaded or saved.

use std::io;

use kehai_tracking::door::doors::InUse;
use kehai_tracking::site::SiteError;
use kehai_tracking::site::merge::Merged;

use super::Kept;

/// Why a site file cannot be used, in one line.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// It is missing, unreadable or no text.
    #[error("{file}: {error}")]
    Unreadable {
        /// The file.
        file: String,
        /// What the system says.
        error: io::Error,
    },
    /// It is no site.
    #[error(transparent)]
    Wrong(#[from] SiteError),
}

/// Why a site was not saved; nothing has changed then.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// It contradicts itself.
    #[error("{0}")]
    Wrong(String),
    /// It was made from another revision, and cannot be merged, as what it was made from was not sent.
    #[error("the site was changed meanwhile (revision {now}, this one was made from {from}): load it again")]
    Changed {
        /// What it was made from.
        from: u64,
        /// What it is now.
        now: u64,
    },
    /// It was made from another revision, and the user has to decide.
    #[error("{why}")]
    Conflict {
        /// What is to be decided, in words.
        why: String,
        /// The site in use.
        now: Box<Kept>,
        /// Both edits in one, and what both have changed.
        merged: Box<Merged>,
        /// What was changed meanwhile.
        theirs: Vec<String>,
    },
    /// It is put together from the sites of areas.
    #[error("this site is put together from its areas: change it on the map of the area")]
    Together,
    /// The file was changed by hand, and what to do.
    #[error("the file was changed by hand meanwhile: {0}")]
    ChangedOnDisk(String),
    /// A door is in use.
    #[error(transparent)]
    InUse(#[from] InUse),
    /// The disk.
    #[error("{file} cannot be saved: {error}")]
    Failed {
        /// The file.
        file: String,
        /// What the system says.
        error: io::Error,
    },
}
