//! Why there is no backup, or nothing is restored: one line each, whatever bytes of an archive are cited.

use std::io;
use std::path::{Path, PathBuf};

use kehai_tracking::text::printable;

use crate::store::StoreError;

/// Why there is no backup, or nothing is restored.
#[derive(Debug, thiserror::Error)]
pub enum BackupError {
    /// A file is in the way.
    #[error("{} is there already: --force replaces it", .0.display())]
    There(PathBuf),
    /// The system.
    #[error("{}: {error}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// The database cannot be copied.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// It is no backup.
    #[error("{}: this is no backup of kehai-tracker: {}", archive.display(), printable(why))]
    Foreign {
        /// The archive.
        archive: PathBuf,
        /// What it has instead.
        why: String,
    },
    /// It is not whole.
    #[error("{}: this backup is damaged: {}; nothing was changed", archive.display(), printable(why))]
    Damaged {
        /// The archive.
        archive: PathBuf,
        /// What is wrong.
        why: String,
    },
    /// It was made by a newer version.
    #[error("{}: it was made by kehai-tracker {program}, which is newer than this one, {}: use that", archive.display(), env!("CARGO_PKG_VERSION"))]
    Newer {
        /// The archive.
        archive: PathBuf,
        /// Its maker.
        program: String,
    },
    /// A tracker, or another restoration, is at work there.
    #[error("{}: a tracker keeps what happens there: stop it first (sudo systemctl stop kehai-tracker)", .0.display())]
    Running(PathBuf),
    /// This user may not read the site. Its own file is named: no user knows that of the plan.
    #[error("{}: may not be read: ask as root (sudo), or name another with --site", .0.display())]
    Denied(PathBuf),
    /// There is no place for the database.
    #[error("{}: it has a database: --db says where that goes", .0.display())]
    NoPlace(PathBuf),
}

/// An error of the system about a file.
pub(super) fn of(file: &Path) -> impl Fn(io::Error) -> BackupError + '_ {
    move |error| BackupError::File { file: file.to_path_buf(), error }
}
