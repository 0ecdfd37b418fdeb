//! A copy of the whole database while a tracker writes it, without raw scans: those lie in the database and nowhere else.
//!
//! ```text
//!   FILE ─ VACUUM INTO, one read transaction ─▶ TO ─ raw scans deleted, overwritten ─▶ as it was at that time
//! ```
//!
//! TO is for its owner alone from its first byte on, and so are SQLite's files beside it, which take over its mode.
//!
//! Source: sqlite.org, *VACUUM*, "VACUUM with an INTO clause": the file may be there if it is empty; its writer is never held up, as
//! the file has a write-ahead log.

use std::fs::OpenOptions;
use std::path::Path as File;

use rusqlite::{Connection, OpenFlags};

use super::error::StoreError;
use super::schema;

/// Copies the database into a new file; the number of its layout.
///
/// # Errors
/// It is no database of a tracker or of a newer one, or the copy cannot be written.
pub fn copy(file: &File, to: &File) -> Result<i64, StoreError> {
    let failed = |error| StoreError::Sqlite { file: file.to_path_buf(), error };
    let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let database = Connection::open_with_flags(file, flags).map_err(failed)?;
    database.pragma_update(None, "busy_timeout", 2000).map_err(failed)?;
    let layout = schema::layout(&database)
        .map_err(failed)?
        .map_err(|error| StoreError::Unfit { file: file.to_path_buf(), error })?;
    create(to)?;
    database.execute("VACUUM INTO ?1", [to.to_string_lossy()]).map_err(failed)?;
    drop(database);
    let written = |error| StoreError::Sqlite { file: to.to_path_buf(), error };
    let copy = Connection::open(to).map_err(written)?;
    // Raw scans came with the second layout.
    if layout >= 2 {
        copy.execute_batch("PRAGMA secure_delete = ON; DELETE FROM raw; DELETE FROM raw_request; VACUUM;")
            .map_err(written)?;
    }
    Ok(layout)
}

/// Makes an empty file that its owner alone may read.
fn create(file: &File) -> Result<(), StoreError> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    options.open(file).map(drop).map_err(|error| StoreError::File { file: file.to_path_buf(), error })
}

/// Whether this version can read a database of a layout.
#[must_use]
pub const fn is_known(layout: i64) -> bool {
    layout <= schema::VERSION
}

#[cfg(test)]
mod tests {
    use super::super::connection;
    use super::*;

    #[test]
    fn a_copy_has_what_was_committed_and_no_raw_scans() {
        let folder = tempfile::tempdir().unwrap();
        let (file, to) = (folder.path().join("hall.db"), folder.path().join("copy.db"));
        let writer = connection::open(&file).unwrap();
        writer
            .execute_batch(
                "INSERT INTO run (begun_ms) VALUES (7);
            INSERT INTO raw_request (module, begun_ms, until_ms) VALUES ('hall', 1, 2);
            INSERT INTO raw VALUES (1, 5, 'a scan that shows a person');",
            )
            .unwrap();
        // A transaction that is under way is not in it, and does not hold it up.
        writer.execute_batch("BEGIN IMMEDIATE; INSERT INTO run (begun_ms) VALUES (8);").unwrap();
        let layout = copy(&file, &to).unwrap();
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            assert_eq!(std::fs::metadata(&to).unwrap().permissions().mode() & 0o777, 0o600);
        }
        assert!(is_known(layout) && !is_known(layout + 1));
        let opened = Connection::open(&to).unwrap();
        let count = |table: &str| -> i64 {
            opened.query_row(&format!("SELECT COUNT(*) FROM {table}"), [], |row| row.get(0)).unwrap()
        };
        assert_eq!(["run", "raw", "raw_request"].map(count), [1, 0, 0]);
        let bytes = std::fs::read(&to).unwrap();
        assert!(!bytes.windows(12).any(|part| part == b"shows a pers"), "deleted and overwritten");
        assert!(copy(&file, &to).is_err(), "a file that is there is left as it is");
        assert_eq!(std::fs::read(&to).unwrap(), bytes);
    }

    #[test]
    fn what_is_no_database_of_a_tracker_is_not_copied() {
        let folder = tempfile::tempdir().unwrap();
        let (file, to) = (folder.path().join("letter"), folder.path().join("copy.db"));
        std::fs::write(&file, "Dear Anna, this is a letter and no database at all. ".repeat(30)).unwrap();
        assert!(copy(&file, &to).is_err() && !to.exists());
        assert!(copy(&folder.path().join("missing.db"), &to).is_err());
        assert!(!folder.path().join("missing.db").exists(), "none is made");
    }
}
