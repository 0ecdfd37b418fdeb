//! Where modules were said to be, since when, and from which source.
//!
//! ```text
//!   site file ──┐
//!   live map  ──┼─▶ PoseRow ─▶ pose (module, at_ms)      only if it is not what was known last of that module
//!   calibrate ──┘
//! ```
//!
//! These few rows are kept for good: with them a path of last year can be compared with where its module was.

use std::path::Path as File;

use rusqlite::{Transaction, params};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::connection::open_and_expire;
use super::error::StoreError;
use super::numbers::integer;
use crate::named::named;
use kehai_tracking::calibration::status::Mounting;
use kehai_tracking::site::Site;

named! {
    /// Where a module's pose comes from, by its name in the database.
    #[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, JsonSchema)]
    #[serde(rename_all = "lowercase")]
    #[schemars(rename = "PoseSource")]
    pub enum Source {
        /// The site's file, at the start of the tracker and after an edit by hand.
        File = "file",
        /// A user, on the live map.
        Map = "map",
        /// The calibration.
        Calibration = "calibration",
    }
}

/// Where a module is from some time on.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseRow {
    /// ms since 1970.
    pub at_ms: u64,
    /// As the site calls it.
    pub module: String,
    /// Its place in the site, m.
    pub x_m: f64,
    /// m.
    pub y_m: f64,
    /// Where its front points, counter-clockwise.
    pub yaw_deg: f64,
    /// Where the pose comes from.
    pub source: Source,
}

impl PoseRow {
    /// Where a site's modules are.
    pub fn of(site: &Site, at_ms: u64, source: Source) -> impl Iterator<Item = Self> + '_ {
        site.modules.iter().filter(|module| module.placed).map(move |module| Self {
            at_ms,
            module: module.name.clone(),
            x_m: module.x,
            y_m: module.y,
            yaw_deg: module.yaw_deg,
            source,
        })
    }
}

/// Notes in `database`, made if missing, where modules are from `at_ms` on. A running tracker notes by itself what its
/// site says; a caller that knows a more exact source, such as the calibration, notes it here first.
///
/// # Errors
/// The database cannot be opened or written.
pub fn note(database: &File, poses: &[Mounting], at_ms: u64, source: Source) -> Result<(), StoreError> {
    let mut connection = open_and_expire(database, at_ms)?;
    let failed = |error| StoreError::Sqlite { file: database.to_path_buf(), error };
    let transaction = connection.transaction().map_err(failed)?;
    for Mounting { name: module, pose, .. } in poses {
        // As a site's file has it: millimetres, hundredths of a degree.
        let [x_m, y_m] = [pose.at.x, pose.at.y].map(|value_m| (value_m * 1e3).round() / 1e3);
        let yaw_deg = (pose.yaw_rad.to_degrees() * 100.0).round() / 100.0;
        let row = PoseRow { at_ms, module: module.clone(), x_m, y_m, yaw_deg, source };
        write(&transaction, &row).map_err(failed)?;
    }
    transaction.commit().map_err(failed)
}

/// Writes a row unless it says what was known last of that module, to the millimetre and a twentieth of a degree as site
/// files have it.
pub(super) fn write(transaction: &Transaction<'_>, row: &PoseRow) -> rusqlite::Result<usize> {
    transaction
        .prepare_cached(
            "INSERT OR REPLACE INTO pose (at_ms, module, x_m, y_m, yaw_deg, source)
             SELECT ?1, ?2, ?3, ?4, ?5, ?6 WHERE NOT EXISTS (
                 SELECT 1 FROM (SELECT * FROM pose WHERE module = ?2 ORDER BY at_ms DESC LIMIT 1)
                 WHERE abs(x_m - ?3) < 0.001 AND abs(y_m - ?4) < 0.001 AND abs(yaw_deg - ?5) < 0.05)",
        )?
        .execute(params![integer(row.at_ms), row.module, row.x_m, row.y_m, row.yaw_deg, row.source.name()])
}
