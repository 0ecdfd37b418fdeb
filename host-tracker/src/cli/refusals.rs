//! Messages to doors that were refused, for the log.

use std::collections::BTreeMap;
use std::time::Instant;

use host_tracker::log_limit::LogLimit;
use kehai_tracking::door::doors::Output;

/// Of each door one line in a while: a client of the broker may send any number of messages.
#[derive(Default)]
pub(super) struct Refusals(BTreeMap<String, LogLimit>);

impl Refusals {
    /// Logs what of these is to be logged now.
    pub(super) fn log(&mut self, outputs: &[Output]) {
        for output in outputs {
            if let Output::NotTaken { door, why } = output
                && let Some(line) = self.line(door, why, Instant::now())
            {
                tracing::warn!("{line}");
            }
        }
    }

    /// What is to be logged of one more message, if it is time.
    fn line(&mut self, door: &str, why: &str, now: Instant) -> Option<String> {
        Some(match self.0.entry(door.to_owned()).or_default().note(now)? {
            1 => format!("door {door}: {why}"),
            times => format!("door {door}: {why}; {times} messages since the last line"),
        })
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_flood_of_refused_messages_is_one_line_of_each_door_in_a_while() {
        let (mut refusals, now) = (Refusals::default(), Instant::now());
        let first = refusals.line("front", "late", now);
        assert_eq!(first.as_deref(), Some("door front: late"));
        for _ in 0..100 {
            assert_eq!(refusals.line("front", "late", now), None);
        }
        assert_eq!(refusals.line("back", "late", now).as_deref(), Some("door back: late"), "another one");
        let later = refusals.line("front", "repeated", now + Duration::from_secs(10));
        assert_eq!(later.as_deref(), Some("door front: repeated; 101 messages since the last line"));
    }
}
