//! An alarm that begins, is acknowledged or ends, as a line of a log.

use kehai_tracking::alarm::Severity;
use kehai_tracking::alarm_list::Became;

use super::message::{Level, Log, Time};
use crate::alarm_handle::AlarmChange;

/// Its line, of `at_ns`, since 1970.
pub fn log(change: &AlarmChange, at_ns: u64) -> Log {
    let alarm = &change.alarm;
    let (level, what) = match (change.became, alarm.severity) {
        (Became::Raised, Severity::Failed) => (Level::Error, "begins"),
        (Became::Raised, Severity::Degraded) => (Level::Warning, "begins"),
        (Became::Raised, Severity::Notice) => (Level::Info, "begins"),
        (Became::Acknowledged, _) => (Level::Info, "is acknowledged"),
        (Became::Ended, _) => (Level::Info, "ends"),
    };
    let message = format!("{} {what}: {}", alarm.cause.name(), alarm.text);
    Log::new(Time::of_ns(at_ns), level, alarm.source().to_string(), message)
}
