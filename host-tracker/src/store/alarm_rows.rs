//! Alarms in the database: a row each, written again when it is acknowledged and when it ends.

use rusqlite::{Connection, Row, Transaction, params};
use serde_json::json;

use super::numbers::integer;
use kehai_tracking::alarm_list::{About, ListedAlarm};

/// The table: beside the others, so that a file of before has it, too.
pub const ALARMS: &str = "
CREATE TABLE IF NOT EXISTS alarm (
    alarm INTEGER PRIMARY KEY,
    source TEXT NOT NULL,
    subject TEXT NOT NULL,
    name TEXT NOT NULL,
    severity TEXT NOT NULL,
    text TEXT NOT NULL,
    since_ms INTEGER NOT NULL,
    until_ms INTEGER,
    acknowledged_by TEXT,
    acknowledged_ms INTEGER
);
CREATE INDEX IF NOT EXISTS alarm_until ON alarm (until_ms);
";

/// Those that stood when the file was written last, and those that ended after a time.
pub const ASKED: &str = "SELECT alarm, source, subject, name, severity, text, since_ms, until_ms, acknowledged_by, \
    acknowledged_ms FROM alarm WHERE until_ms IS NULL OR until_ms >= ?1";

pub fn write(transaction: &Transaction<'_>, alarm: &ListedAlarm) -> rusqlite::Result<()> {
    let source = match alarm.about {
        About::Tracker => "tracker",
        About::Module => "module",
        About::Door => "door",
        About::Zone => "zone",
        About::Area => "area",
    };
    let severity = serde_json::to_value(alarm.severity).unwrap_or_default();
    transaction
        .prepare_cached(
            "INSERT OR REPLACE INTO alarm (alarm, source, subject, name, severity, text, since_ms, until_ms,
                acknowledged_by, acknowledged_ms) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)",
        )?
        .execute(params![
            integer(alarm.id),
            source,
            alarm.of,
            alarm.cause.name(),
            severity.as_str().unwrap_or_default(),
            alarm.text,
            integer(alarm.since_ms),
            alarm.until_ms.map(integer),
            alarm.acknowledged.as_ref().map(|seen| &seen.by),
            alarm.acknowledged.as_ref().map(|seen| integer(seen.at_ms)),
        ])?;
    Ok(())
}

/// Those that stand, and those that ended at `from_ms` or later. What cannot be understood is left out.
pub fn read(connection: &Connection, from_ms: u64) -> rusqlite::Result<Vec<ListedAlarm>> {
    let mut asked = connection.prepare_cached(ASKED)?;
    let alarms = asked.query_map(params![integer(from_ms)], alarm)?.collect::<rusqlite::Result<Vec<_>>>()?;
    Ok(alarms.into_iter().flatten().collect())
}

fn alarm(row: &Row<'_>) -> rusqlite::Result<Option<ListedAlarm>> {
    let text = |column: usize| row.get::<_, String>(column);
    let time = |column: usize| row.get::<_, Option<i64>>(column);
    let acknowledged = row.get::<_, Option<String>>(8)?.zip(time(9)?);
    let written = json!({
        "id": row.get::<_, i64>(0)?,
        "source": text(1)?,
        "of": text(2)?,
        "name": text(3)?,
        "severity": text(4)?,
        "text": text(5)?,
        "since_ms": time(6)?,
        "until_ms": time(7)?,
        "acknowledged": acknowledged.map(|(by, at_ms)| json!({ "by": by, "at_ms": at_ms })),
    });
    Ok(serde_json::from_value(written).ok())
}
