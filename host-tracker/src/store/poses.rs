//! The history of poses: a row for every module whose place was found or changed, and how.

use std::path::Path;
use std::time::Duration;

use rusqlite::{Connection, params};

use super::schema;
use crate::geometry::Pose;

/// Writes where modules are from `at_ms` on into a database, made if missing; `source` says how that is known.
///
/// # Errors
/// One line: the database cannot be opened, is a newer version's, or not be written.
pub fn keep_poses(file: &Path, at_ms: u64, poses: &[(String, Pose)], source: &str) -> Result<(), String> {
    let name = file.display();
    let told = |error: rusqlite::Error| format!("{name}: {error}");
    let mut connection = Connection::open(file).map_err(told)?;
    connection.busy_timeout(Duration::from_secs(5)).map_err(told)?;
    schema::prepare(&mut connection).map_err(told)?.map_err(|newer| format!("{name}: {newer}"))?;
    let transaction = connection.transaction().map_err(told)?;
    for (module, pose) in poses {
        let at_ms = i64::try_from(at_ms).unwrap_or(i64::MAX);
        transaction
            .execute(
                "INSERT OR REPLACE INTO pose (at_ms, module, x_m, y_m, yaw_deg, source) VALUES (?, ?, ?, ?, ?, ?)",
                params![at_ms, module, pose.at.x, pose.at.y, pose.yaw_rad.to_degrees(), source],
            )
            .map_err(told)?;
    }
    transaction.commit().map_err(told)
}

/// Everything kept of a module's places, oldest first: when, where, and how that was known.
///
/// # Errors
/// As [`keep_poses`].
pub fn poses_of(file: &Path, module: &str) -> Result<Vec<(u64, Pose, String)>, String> {
    let told = |error: rusqlite::Error| format!("{}: {error}", file.display());
    let connection = Connection::open(file).map_err(told)?;
    let mut rows = connection
        .prepare("SELECT at_ms, x_m, y_m, yaw_deg, source FROM pose WHERE module = ? ORDER BY at_ms")
        .map_err(told)?;
    let row = |row: &rusqlite::Row<'_>| {
        let at_ms: i64 = row.get(0)?;
        let at = crate::geometry::Point::new(row.get(1)?, row.get(2)?);
        let yaw_deg: f64 = row.get(3)?;
        Ok((u64::try_from(at_ms).unwrap_or(0), Pose { at, yaw_rad: yaw_deg.to_radians() }, row.get(4)?))
    };
    rows.query_map([module], row).map_err(told)?.collect::<Result<Vec<_>, _>>().map_err(told)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    #[test]
    fn every_place_a_module_had_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("home.db");
        let pose = |x| Pose { at: Point::new(x, 2.0), yaw_rad: 0.5 };
        keep_poses(&file, 1000, &[("hall".into(), pose(1.0)), ("attic".into(), pose(9.0))], "walk").unwrap();
        keep_poses(&file, 2000, &[("hall".into(), pose(1.5))], "map").unwrap();
        let kept = poses_of(&file, "hall").unwrap();
        assert_eq!(
            kept.iter().map(|row| (row.0, row.1.at.x, row.2.as_str())).collect::<Vec<_>>(),
            [(1000, 1.0, "walk"), (2000, 1.5, "map")]
        );
    }
}
