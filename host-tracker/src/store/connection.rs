//! The database, opened for writing.

use std::path::Path as File;

use rusqlite::Connection;

use super::error::StoreError;
use super::{raw_rows, schema};
use crate::owned_file;

/// Opens the file, or makes it, with all its tables. One that root makes, as by `calibrate --db`, belongs to the owner of its folder:
/// the service writes it later.
///
/// # Errors
/// It cannot be opened or written, is no database, that of another program, or was made by a newer version.
pub(super) fn open(file: &File) -> Result<Connection, StoreError> {
    let failed = |error| StoreError::Sqlite { file: file.to_path_buf(), error };
    // Where it cannot be made, SQLite says why.
    let _ = owned_file::make(file);
    let mut connection = Connection::open(file).map_err(failed)?;
    schema::prepare(&mut connection)
        .map_err(failed)?
        .map_err(|error| StoreError::Unfit { file: file.to_path_buf(), error })?;
    Ok(connection)
}

/// Opens the file for a program that writes without being a tracker; raw scans that have expired by `now_ms` are
/// deleted.
///
/// # Errors
/// As [`open`].
pub(super) fn open_and_expire(file: &File, now_ms: u64) -> Result<Connection, StoreError> {
    let connection = open(file)?;
    raw_rows::forget_all(&connection, now_ms)
        .map_err(|error| StoreError::Sqlite { file: file.to_path_buf(), error })?;
    Ok(connection)
}
