//! Files with secrets, beside a site's: for their owner alone, written whole or not at all, and watched for changes.
//!
//! ```text
//!   text ─▶ .NAME.new, mode 0600 ─▶ on disk ─▶ owner of the folder ─▶ NAME
//! ```
//!
//! Written by root for a service, a file belongs to the owner of the site's folder, who may put files there.

use std::fs::{self, File, Metadata};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// By which a change of a file is seen: when it was changed, its length, and which file it is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Stamp(SystemTime, u64, u64);

impl Stamp {
    /// Which state of the file this is; none if it is not there or cannot be asked.
    #[must_use]
    pub fn of(file: &Path) -> Option<Self> {
        let data = fs::metadata(file).ok()?;
        #[cfg(unix)]
        let number = std::os::unix::fs::MetadataExt::ino(&data);
        #[cfg(not(unix))]
        let number = 0;
        Some(Self(data.modified().ok()?, data.len(), number))
    }
}

/// The folder of a file, to lock or to keep on disk.
///
/// # Errors
/// There is none, or it may not be opened.
pub fn folder_of(file: &Path) -> io::Result<File> {
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => File::open(folder),
        _ => File::open("."),
    }
}

/// Where a file is written before it is put in the place of `file`.
#[must_use]
pub fn beside(file: &Path) -> PathBuf {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    file.with_file_name(format!(".{name}.new"))
}

/// Writes `file`, in this folder, for its owner alone.
///
/// # Errors
/// The file is as it was.
pub fn write(file: &Path, folder: &File, text: &[u8]) -> io::Result<()> {
    let beside = beside(file);
    // One that a power cut has left has other rights, perhaps.
    let _ = fs::remove_file(&beside);
    let mut options = File::options();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let written = options.open(&beside).and_then(|mut new| {
        new.write_all(text)?;
        new.sync_all()?;
        give(&new, folder)?;
        fs::rename(&beside, file)
    });
    if written.is_err() {
        // It may not even be there.
        let _ = fs::remove_file(&beside);
        return written;
    }
    log_unsynced(file, folder.sync_all());
    Ok(())
}

/// Brings the folder of a file that was renamed or removed to the disk, where it can be: else that is logged.
pub fn sync_folder_of(file: &Path) {
    log_unsynced(file, folder_of(file).and_then(|folder| folder.sync_all()));
}

/// Logs that the folder of a file which has just changed could not be brought to the disk, as on CIFS and some FUSE file
/// systems. It is no failure: what was to be done there is done, and only a loss of power soon after may bring back what was before.
fn log_unsynced(file: &Path, synced: io::Result<()>) {
    if let Err(error) = synced {
        let file = file.display();
        tracing::warn!(
            "{file}: done, but a loss of power may undo that: its folder cannot be synced: {error}"
        );
    }
}

/// Rights of what shows people's paths, where the user's mask leaves them: not for every user of the machine, as the service's own.
#[cfg(unix)]
pub(crate) const OF_PEOPLE: u32 = 0o640;

/// Makes an empty `file`, which may be there already. One that root makes for a service belongs to the owner of its folder.
///
/// # Errors
/// The system refuses.
pub fn make(file: &Path) -> io::Result<()> {
    let mut options = File::options();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, OF_PEOPLE);
    match options.open(file) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Ok(()),
        made => give(&made?, &folder_of(file)?),
    }
}

/// Gives a file that root has made to the owner of its folder.
///
/// # Errors
/// The system refuses.
pub fn give(file: &File, folder: &File) -> io::Result<()> {
    give_as(file, &folder.metadata()?)
}

/// Gives a file that root has made to the owner of another, as of the file that it replaces.
///
/// # Errors
/// The system refuses.
pub fn give_as(file: &File, other: &Metadata) -> io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::{MetadataExt, fchown};
        // Others than root write in their own folders, or in those of a group that they have in common.
        if file.metadata()?.uid() == 0 && other.uid() != 0 {
            return fchown(file, Some(other.uid()), Some(other.gid()));
        }
    }
    Ok(())
}

/// Gives a file the rights of the one that it replaces, and its owner.
///
/// # Errors
/// The system refuses.
pub fn take_after(file: &File, former: &Metadata) -> io::Result<()> {
    file.set_permissions(former.permissions())?;
    give_as(file, former)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_root_makes_belongs_to_whom_its_folder_does() {
        use std::os::unix::fs::{MetadataExt, chown};
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("home.db");
        // Only root may give files away.
        let may = chown(folder.path(), Some(4242), Some(4243)).is_ok();
        make(&file).unwrap();
        fs::write(&file, "rows").unwrap();
        make(&file).unwrap();
        let data = fs::metadata(&file).unwrap();
        assert_eq!(data.mode() & 0o007, 0, "none but the owner and a group read where people were");
        assert!(!may || (data.uid(), data.gid()) == (4242, 4243));
        assert_eq!(fs::read(&file).unwrap(), b"rows", "one that is there stays as it is");
    }

    #[test]
    fn a_folder_that_cannot_be_synced_is_no_failure() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("home.keys");
        let unsynced = File::open("/dev/null").unwrap();
        assert!(unsynced.sync_all().is_err());
        write(&file, &unsynced, b"new").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"new");
    }
}
