//! A long time at a glance: how many people there were in each small part of it, and what went wrong.
//!
//! ```text
//!   from ├──────┬──────┬──────┬──────┬──────┬──────┤ to
//!   bins │  2   │  3   │  0   │ null │ null │  1   │   most people at once in the zones that count
//!   lives ━━━━━━━━━━━━━━━━━━━━━━━┥           ┝━━━━━━━   null: no tracker ran, or nothing was known of any zone
//!   events                 ▲ alarm           ▲ started
//! ```

use std::collections::BTreeMap;

use serde::Serialize;

use super::reader::{Count, Reader};
use super::row::Event;

/// Most bins of an overview: more than a wide screen has room for.
pub const BINS_MAX: usize = 1000;

/// Most events of an overview; of more, the newest.
pub const EVENTS_MAX: usize = 500;

/// Events that are too many to be shown of a long time: the counts show how people moved between zones.
const SMALL: [&str; 3] = ["enter", "leave", "state"];

/// A time at a glance.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Overview {
    /// When it begins, ms since 1970.
    pub from_ms: u64,
    /// When it ends.
    pub to_ms: u64,
    /// The first time there is something of; absent while the database is empty.
    pub first_ms: Option<u64>,
    /// The most people at once in each bin.
    pub bins: Vec<Option<u32>>,
    /// What happened, without comings and goings.
    pub events: Vec<Event>,
    /// Events there was no room for.
    pub left_out: usize,
}

/// The time from `from_ms` to `to_ms` in so many bins; people are counted in the zones that `counts`.
///
/// # Errors
/// What SQLite says.
pub fn overview(
    reader: &Reader,
    (from_ms, to_ms): (u64, u64),
    bins: usize,
    counts: impl Fn(&str) -> bool,
) -> rusqlite::Result<Overview> {
    let mut rows = reader.counts(from_ms, to_ms)?;
    rows.retain(|row| counts(&row.zone));
    // Those from before `from_ms` come zone by zone.
    rows.sort_by_key(|row| row.at_ms);
    let bins = binned(&rows, &reader.lives(from_ms, to_ms)?, (from_ms, to_ms), bins.clamp(1, BINS_MAX));
    let mut events = reader.events(from_ms, to_ms)?;
    events.retain(|event| !SMALL.contains(&event.kind.as_str()));
    let left_out = events.len().saturating_sub(EVENTS_MAX);
    events.drain(..left_out);
    let first_ms = reader.span_ms()?.map(|(first_ms, _)| first_ms);
    Ok(Overview { from_ms, to_ms, first_ms, bins, events, left_out })
}

/// Rows in order of time.
fn binned(
    rows: &[Count],
    lives: &[(u64, u64)],
    (from_ms, to_ms): (u64, u64),
    bins: usize,
) -> Vec<Option<u32>> {
    let whole_ms = to_ms.saturating_sub(from_ms).max(1);
    let edge_ms = |bin: usize| from_ms + (whole_ms as f64 * bin as f64 / bins as f64) as u64;
    let mut zones: BTreeMap<&str, Option<u32>> = BTreeMap::new();
    let mut rows = rows.iter().peekable();
    // Of none it is only known that they are not there if that is known of every zone.
    let known = |zones: &BTreeMap<&str, Option<u32>>| {
        let found = zones.values().flatten().copied().reduce(|one, other| one + other)?;
        (found > 0 || zones.values().all(Option::is_some)).then_some(found)
    };
    (0..bins)
        .map(|bin| {
            let (begin_ms, end_ms) = (edge_ms(bin), edge_ms(bin + 1));
            let mut most: Option<u32> = None;
            loop {
                let next = rows.next_if(|row| row.at_ms < end_ms);
                // What held when the bin began holds until the first change within it.
                if next.is_none_or(|row| row.at_ms > begin_ms) {
                    most = most.max(known(&zones));
                }
                let Some(row) = next else { break };
                zones.insert(&row.zone, row.count);
            }
            let alive = lives.iter().any(|&(begun_ms, ended_ms)| begun_ms < end_ms && ended_ms >= begin_ms);
            most.filter(|_| alive)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(zone: &str, at_ms: u64, count: u32, state: &str) -> Count {
        let count = (state == "known").then_some(count);
        Count { zone: zone.into(), at_ms, count, state: state.into() }
    }

    #[test]
    fn a_bin_holds_the_most_people_at_once() {
        let rows = [
            count("hall", 50, 2, "known"),
            count("study", 120, 1, "known"),
            count("hall", 130, 0, "partly"),
            count("hall", 310, 4, "known"),
            count("hall", 320, 1, "known"),
        ];
        let bins = binned(&rows, &[(0, 1000)], (100, 500), 4);
        assert_eq!(bins, [Some(3), Some(1), Some(5), Some(2)]);
    }

    #[test]
    fn none_in_one_zone_is_not_none_while_another_is_not_known() {
        let rows =
            [count("hall", 0, 0, "known"), count("study", 0, 0, "unknown"), count("study", 60, 0, "known")];
        assert_eq!(binned(&rows, &[(0, 200)], (10, 110), 2), [None, Some(0)]);
    }

    #[test]
    fn what_nobody_knew_is_not_zero() {
        let rows =
            [count("hall", 0, 2, "known"), count("hall", 150, 0, "unknown"), count("hall", 350, 0, "known")];
        // No tracker ran from 420 to 510.
        let bins = binned(&rows, &[(0, 420), (510, 900)], (0, 600), 6);
        assert_eq!(bins, [Some(2), Some(2), None, Some(0), Some(0), Some(0)]);
        let bins = binned(&rows, &[(0, 410), (501, 900)], (410, 510), 10);
        assert_eq!(bins, [Some(0), None, None, None, None, None, None, None, None, Some(0)]);
        assert_eq!(binned(&[], &[], (5, 5), 1), [None]);
    }
}
