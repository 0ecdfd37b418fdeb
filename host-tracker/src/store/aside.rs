//! A damaged database, set aside under another name so that a new one can be begun.
//!
//! ```text
//!   hall.db      ─▶ hall.db.damaged-1763850000
//!   hall.db-wal  ─▶ hall.db.damaged-1763850000-wal     for `sqlite3 … .recover`
//! ```
//!
//! Only a database of a tracker is touched. What never was one, a letter that was named by mistake, stays where it is.

use std::fs;
use std::io::{self, Read as _};
use std::path::{Path as File, PathBuf};

use super::lock::{self, beside};

/// Every SQLite file begins so.
const MAGIC: &[u8] = b"SQLite format 3\0";

/// The schema of this store holds it, in the file's first page.
const TABLE: &[u8] = b"CREATE TABLE run";

/// Bytes in which that is looked for: sixteen pages of 4096 bytes, more than the schema takes.
const LOOK: u64 = 16 * 4096;

/// Whether a file that cannot be read was a tracker's, by what the damage has left: the first bytes, the schema, or the
/// lock file that a tracker leaves beside it.
pub(super) fn was_ours(file: &File) -> bool {
    let mut begin = Vec::new();
    let read = fs::File::open(file).and_then(|opened| opened.take(LOOK).read_to_end(&mut begin));
    read.is_ok()
        && (begin.starts_with(MAGIC)
            || begin.windows(TABLE.len()).any(|window| window == TABLE)
            || lock::was_used(file))
}

/// Renames the file, and what SQLite keeps beside it; the new name.
///
/// # Errors
/// It cannot be renamed.
pub(super) fn set_aside(file: &File, now_ms: u64) -> io::Result<PathBuf> {
    let aside = beside(file, &format!(".damaged-{}", now_ms / 1000));
    fs::rename(file, &aside)?;
    for end in ["-wal", "-shm"] {
        match fs::rename(beside(file, end), beside(&aside, end)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
    }
    Ok(aside)
}
