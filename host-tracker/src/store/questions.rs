//! The questions to the file. SQLite answers those about a time by way of an index (`Reader::plans`); `LIVES` and `TOTALS` are of all time.
//!
//! ```text
//!   ?1, ?2   from when to when, ms since 1970; of paths the first is earlier by as long as a part of one may be
//!   ?3       of paths from when, of `WATCHED` the state
//!   …_BEFORE the last row of each zone or line before ?1
//! ```

pub const PATHS: &str = "SELECT run, track, points FROM path
    WHERE begun_ms BETWEEN ?1 AND ?2 AND ended_ms >= ?3 ORDER BY run, track, part";
pub const POINTS: &str = "SELECT points FROM path WHERE begun_ms BETWEEN ?1 AND ?2 AND ended_ms >= ?3";
pub const WATCHED: &str = "SELECT module.name, COUNT(*) FROM health
    CROSS JOIN module ON module.module = health.module WHERE health.at_ms BETWEEN ?1 AND ?2 AND state = ?3 GROUP BY module.name";
pub const COUNTS: &str = "SELECT zone.name, count.at_ms, count.count, count.state FROM count
    JOIN zone USING (zone) WHERE count.at_ms BETWEEN ?1 AND ?2 ORDER BY count.at_ms";
pub const COUNTS_BEFORE: &str = "SELECT zone.name, count.at_ms, count.count, count.state FROM zone
    CROSS JOIN count ON count.zone = zone.zone
        AND count.at_ms = (SELECT MAX(at_ms) FROM count WHERE zone = zone.zone AND at_ms < ?1)";
// A run of before layout 2 has no end.
pub const LIVES: &str = "SELECT begun_ms, COALESCE(ended_ms, begun_ms) FROM run";
pub const CARDS: &str = "SELECT at_ms, place, hash FROM card WHERE at_ms BETWEEN ?1 AND ?2 ORDER BY at_ms";
pub const TOTALS: &str = "SELECT at_ms, zones FROM total ORDER BY at_ms";
pub const CROSSINGS: &str = "SELECT line.name, crossing.at_ms, crossing.direction FROM crossing
    JOIN line USING (line) WHERE crossing.at_ms BETWEEN ?1 AND ?2 ORDER BY crossing.at_ms";
pub const LINE_STATES: &str = "SELECT line.name, line_state.at_ms, line_state.state FROM line_state
    JOIN line USING (line) WHERE line_state.at_ms BETWEEN ?1 AND ?2 ORDER BY line_state.at_ms";
pub const LINE_STATES_BEFORE: &str = "SELECT line.name, line_state.at_ms, line_state.state FROM line
    CROSS JOIN line_state ON line_state.line = line.line
        AND line_state.at_ms = (SELECT MAX(at_ms) FROM line_state WHERE line = line.line AND at_ms < ?1)";
pub const EVENTS: &str = "SELECT at_ms, kind, subject, track, text FROM event
    WHERE at_ms BETWEEN ?1 AND ?2 ORDER BY at_ms";
pub const HEALTH: &str =
    "SELECT health.at_ms, module.name, state, scans_hz, lost_share, checksum_errors, unknown_share,
        clock_offset_ms, clock_jitter_ms
    FROM health JOIN module USING (module) WHERE health.at_ms BETWEEN ?1 AND ?2 ORDER BY health.at_ms";
pub const PASSAGES: &str = "SELECT record, (SELECT hash FROM card
        WHERE card.at_ms = passage.begun_ms AND card.place = passage.door)
    FROM passage WHERE begun_ms BETWEEN ?1 AND ?2 ORDER BY begun_ms";
