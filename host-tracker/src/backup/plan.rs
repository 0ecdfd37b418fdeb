//! What remains to be done once everything is beside its place: on disk first, so that a kill in the midst is gone on with.
//!
//! ```text
//!   .site.toml.restore, .site.db.restore, …   all on disk
//!   .site.toml.restore-plan                   written: from here on it is done, whatever happens
//!   site.keys.before-restore                  the keys of another site that were there, renamed
//!   site.toml, site.db, …                     renamed, one after the other; the log of the old database removed before
//!   .site.toml.restore-plan                   removed
//! ```
//!
//! Each step may be done again. Who starts to use the site calls [`finish`] first, so that nothing reads a mix.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::archive::file_beside;
use super::error::{BackupError, of};
use crate::owned_file;
use crate::store::lock::{self, Lock, beside};

/// The file of a plan.
pub(super) fn file_of(site: &Path) -> PathBuf {
    file_beside(site, "restore-plan")
}

/// Where a file waits for its turn.
pub(super) fn waiting(file: &Path) -> PathBuf {
    file_beside(file, "restore")
}

/// What is to be done.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub(super) struct Plan {
    /// Files that come into their places.
    pub put: Vec<PathBuf>,
    /// The database, if it is one of them.
    pub database: Option<PathBuf>,
    /// Files in the places of some of them that are kept, and under which names.
    #[serde(default)]
    pub aside: Vec<(PathBuf, PathBuf)>,
    /// Files that go.
    pub removed: Vec<PathBuf>,
}

/// A step of it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) enum Step {
    /// The database's log and index go, while the new one still waits.
    ClearLog(PathBuf),
    /// A file is kept under another name, while the one for its place still waits.
    SetAside(PathBuf, PathBuf),
    /// A file comes into its place, if it still waits.
    Put(PathBuf),
    /// A file goes.
    Remove(PathBuf),
}

impl Plan {
    /// Its steps, in their order.
    pub(super) fn steps(&self) -> Vec<Step> {
        let log = self.database.iter().cloned().map(Step::ClearLog);
        let aside = self.aside.iter().cloned().map(|(file, name)| Step::SetAside(file, name));
        let put = self.put.iter().cloned().map(Step::Put);
        log.chain(aside).chain(put).chain(self.removed.iter().cloned().map(Step::Remove)).collect()
    }

    /// Writes it: from then on it will be done.
    pub(super) fn commit(&self, site: &Path) -> Result<(), BackupError> {
        let file = file_of(site);
        let text = serde_json::to_vec(self).map_err(|error| of(&file)(error.into()))?;
        owned_file::folder_of(&file)
            .and_then(|folder| owned_file::write(&file, &folder, &text))
            .map_err(of(&file))
    }

    /// Does it, and removes it.
    pub(super) fn finish(&self, site: &Path) -> Result<(), BackupError> {
        for step in self.steps() {
            step.take()?;
        }
        for file in self.put.iter().chain(&self.removed) {
            owned_file::sync_folder_of(file);
        }
        let file = file_of(site);
        removed(&file)?;
        owned_file::sync_folder_of(&file);
        Ok(())
    }
}

impl Step {
    /// Takes it, or finds that it was taken.
    pub(super) fn take(&self) -> Result<(), BackupError> {
        match self {
            Self::ClearLog(database) if waiting(database).exists() => {
                removed(&beside(database, "-wal"))?;
                removed(&beside(database, "-shm"))
            }
            // The new database has a log of its own by now.
            Self::ClearLog(_) => Ok(()),
            Self::SetAside(file, name) if waiting(file).exists() => renamed(file, name),
            // What is there now is the new one.
            Self::SetAside(..) => Ok(()),
            Self::Put(file) => renamed(&waiting(file), file),
            Self::Remove(file) => removed(file),
        }
    }
}

/// Renames a file that may have been renamed already.
fn renamed(from: &Path, to: &Path) -> Result<(), BackupError> {
    match fs::rename(from, to) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(of(to)(error)),
        Ok(()) | Err(_) => Ok(()),
    }
}

pub(super) fn removed(file: &Path) -> Result<(), BackupError> {
    match fs::remove_file(file) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(of(file)(error)),
        Ok(()) | Err(_) => Ok(()),
    }
}

/// Keeps trackers away from a database; none where there is no lock to be had.
pub(super) fn hold(database: Option<&Path>) -> Result<Option<Lock>, BackupError> {
    let Some(database) = database else { return Ok(None) };
    lock::acquire_soon(database).map_err(|lock::Taken| BackupError::Running(database.to_path_buf()))
}

/// Why the plan of a site is not known.
fn unread(site: &Path, file: &Path, error: io::Error) -> BackupError {
    match error.kind() {
        io::ErrorKind::PermissionDenied => BackupError::Denied(site.to_path_buf()),
        _ => of(file)(error),
    }
}

/// Goes on with what was killed while it restored this site; true if there was something.
///
/// # Errors
/// A file cannot be put into its place, the restoration is still at work, or the site may not be read.
pub fn finish(site: &Path) -> Result<bool, BackupError> {
    let file = file_of(site);
    let text = match fs::read(&file) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        Err(error) => return Err(unread(site, &file, error)),
    };
    let plan: Plan = serde_json::from_slice(&text).map_err(|error| of(&file)(error.into()))?;
    let _lock = hold(plan.database.as_deref())?;
    plan.finish(site)?;
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_site_that_may_not_be_read_is_named_and_not_its_plan() {
        let site = Path::new("/etc/kehai/site.toml");
        let said = |kind: io::ErrorKind| unread(site, &file_of(site), kind.into()).to_string();
        assert_eq!(
            said(io::ErrorKind::PermissionDenied),
            "/etc/kehai/site.toml: may not be read: ask as root (sudo), or name another with --site"
        );
        assert!(said(io::ErrorKind::IsADirectory).starts_with("/etc/kehai/.site.toml.restore-plan: "));
    }
}
