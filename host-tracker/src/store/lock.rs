//! One tracker a database: a lock file beside it, `hall.db-lock`, which the system frees when its process ends.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use crate::owned_file;

const END: &str = "-lock";

/// A process that is just ending lets go within this time, and a child that is being started, which holds what its parent holds until
/// its own program runs.
const SOON: Duration = Duration::from_secs(1);

/// Between two tries.
const AGAIN: Duration = Duration::from_millis(20);

/// Held as long as the database is written.
#[derive(Debug)]
pub(crate) struct Lock(File);

/// Another tracker has it.
pub(crate) struct Taken;

/// Takes the lock; none where no lock file can be made, as on a disk that is read-only or full.
///
/// # Errors
/// [`Taken`].
pub(crate) fn acquire(database: &Path) -> Result<Option<Lock>, Taken> {
    let options = OpenOptions::new().write(true).create(true).truncate(false).clone();
    let Ok(file) = options.open(beside(database, END)) else { return Ok(None) };
    match file.try_lock() {
        Ok(()) => {
            // Made by root for a service, it must be the service's to take.
            let given = owned_file::folder_of(database).and_then(|folder| owned_file::give(&file, &folder));
            Ok(Some(Lock(file)).filter(|_| given.is_ok()))
        }
        Err(TryLockError::WouldBlock) => Err(Taken),
        // A file system without locks.
        Err(TryLockError::Error(_)) => Ok(None),
    }
}

/// Whether a tracker has the lock, without making one; none if the system does not say.
pub(crate) fn is_taken(database: &Path) -> Option<bool> {
    let file = match File::open(beside(database, END)) {
        Ok(file) => file,
        Err(error) if error.kind() == ErrorKind::NotFound => return Some(false),
        Err(_) => return None,
    };
    match file.try_lock_shared() {
        Ok(()) => Some(false),
        Err(TryLockError::WouldBlock) => Some(true),
        Err(TryLockError::Error(_)) => None,
    }
}

/// As [`acquire`], but a lock that is about to be free is waited for, a second at most.
///
/// # Errors
/// [`Taken`].
pub(crate) fn acquire_soon(database: &Path) -> Result<Option<Lock>, Taken> {
    let begun = Instant::now();
    loop {
        match acquire(database) {
            Err(Taken) if begun.elapsed() < SOON => thread::sleep(AGAIN),
            other => return other,
        }
    }
}

impl Lock {
    /// Notes that the database beside it is a tracker's.
    pub(super) fn mark(&mut self) {
        // Without it a later damage is only told from a foreign file by less.
        let _ = self.0.write_all(b"kehai-tracker\n");
    }
}

/// Whether a tracker has ever used this database.
pub(super) fn was_used(database: &Path) -> bool {
    fs::metadata(beside(database, END)).is_ok_and(|lock| lock.len() > 0)
}

/// Takes away the lock file of a database that was refused.
pub(super) fn remove_unused(database: &Path) {
    if !was_used(database) {
        let _ = fs::remove_file(beside(database, END));
    }
}

/// The file's name with this at its end.
pub(crate) fn beside(file: &Path, end: &str) -> PathBuf {
    let mut name = OsString::from(file.as_os_str());
    name.push(end);
    name.into()
}
