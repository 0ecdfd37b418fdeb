//! Why there is no database, and what to do about it.

use std::path::PathBuf;

use super::schema::Unfit;

/// Why there is no database.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// SQLite refuses.
    #[error("{}: {}", file.display(), in_words(error))]
    Sqlite {
        /// The database.
        file: PathBuf,
        /// What SQLite says.
        error: rusqlite::Error,
    },
    /// The database is of another program, of a newer version, or of one that is too old to be read as it is.
    #[error("{}: {error}", file.display())]
    Unfit {
        /// The database.
        file: PathBuf,
        /// Of which.
        error: Unfit,
    },
    /// Another tracker writes it.
    #[error("{}: another tracker keeps what happens there: end it, or choose another file", file.display())]
    Taken {
        /// The database.
        file: PathBuf,
    },
    /// A file beside the database: an export.
    #[error("{}: {error}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// What the system says.
        error: std::io::Error,
    },
}

impl StoreError {
    /// A full or read-only disk, or another process at the file: this may pass. Anything else will not.
    pub(super) fn may_pass(&self) -> bool {
        use rusqlite::ErrorCode as Code;
        let StoreError::Sqlite { error: rusqlite::Error::SqliteFailure(failure, _), .. } = self else {
            return false;
        };
        matches!(
            failure.code,
            Code::DiskFull
                | Code::ReadOnly
                | Code::CannotOpen
                | Code::DatabaseBusy
                | Code::DatabaseLocked
                | Code::SystemIoFailure
                | Code::PermissionDenied
        )
    }
}

/// Whether SQLite says that the file itself is wrong.
pub(super) fn is_damage(error: &rusqlite::Error) -> bool {
    use rusqlite::ErrorCode as Code;
    matches!(error.sqlite_error_code(), Some(Code::NotADatabase | Code::DatabaseCorrupt))
}

/// What SQLite says, and what to do about it.
fn in_words(error: &rusqlite::Error) -> String {
    use rusqlite::ErrorCode as Code;
    let advice = match error.sqlite_error_code() {
        Some(Code::DiskFull) => "make room, or keep fewer days with --keep-days",
        Some(Code::ReadOnly | Code::PermissionDenied) => "the tracker may not write there",
        Some(Code::CannotOpen) => "is the folder there, and may the tracker write in it?",
        Some(Code::SystemIoFailure) => "the disk refuses to be written: is it full, or at its end?",
        Some(Code::DatabaseBusy | Code::DatabaseLocked) => "another program is writing it",
        Some(Code::NotADatabase) => "choose another file",
        _ => return error.to_string(),
    };
    format!("{error}: {advice}")
}
