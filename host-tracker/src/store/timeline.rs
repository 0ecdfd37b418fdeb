//! A long time at a glance: how many people there were in each small part of it, and what went wrong.
//!
//! ```text
//!   from ├──────┬──────┬──────┬──────┬──────┬──────┤ to
//!   bins │  2   │  3   │  0   │ null │ null │  1   │   most people at once in the zones that counted then
//!   lives ━━━━━━━━━━━━━━━━━━━━━━━┥           ┝━━━━━━━   null: no tracker ran, or nothing was known of any zone
//!                          0: no person was found, and that was known all the time
//!   events                 ▲ alarm           ▲ started
//! ```

use std::collections::{BTreeMap, BTreeSet};

use schemars::JsonSchema;
use serde::Serialize;

use super::answers::{Count, TotalOf};
use super::event::Event;
use super::lives::told_within;
use super::reader::Reader;

/// Most bins of an overview: more than a wide screen has room for.
pub const BINS_MAX: usize = 1000;

/// Most events of an overview; of more, the newest.
pub const EVENTS_MAX: usize = 500;

/// A time at a glance.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
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

/// The time from `from_ms` to `to_ms`, or to where a tracker that runs has written to, in so many bins; people are counted in the
/// zones that made the total then. Of times before that was kept, in those of which it is known first.
///
/// # Errors
/// What SQLite says.
pub fn overview(reader: &Reader, (from_ms, to_ms): (u64, u64), bins: usize) -> rusqlite::Result<Overview> {
    let to_ms = Some(reader.until_ms(to_ms)?).filter(|until_ms| *until_ms > from_ms).unwrap_or(to_ms);
    let mut rows = reader.counts(from_ms, to_ms)?;
    // Those from before `from_ms` come zone by zone.
    rows.sort_by_key(|row| row.at_ms);
    let runs = reader.runs()?;
    let lives = told_within(&runs, (from_ms, to_ms));
    let starts: BTreeSet<u64> = runs.into_iter().map(|(begun_ms, _)| begun_ms).collect();
    let starts = |at_ms| starts.contains(&at_ms);
    let totals = reader.totals()?;
    let bins = binned(
        Told { rows: &rows, lives: &lives, totals: &totals },
        starts,
        (from_ms, to_ms),
        bins.clamp(1, BINS_MAX),
    );
    let mut events = reader.events(from_ms, to_ms)?;
    events.retain(|event| !event.kind.is_frequent());
    let left_out = events.len().saturating_sub(EVENTS_MAX);
    events.drain(..left_out);
    let first_ms = reader.span_ms()?.map(|(first_ms, _)| first_ms);
    Ok(Overview { from_ms, to_ms, first_ms, bins, events, left_out })
}

/// From some time on.
#[derive(Clone, Copy)]
enum Change<'a> {
    /// A tracker starts: it knows nothing of what the one before has said, and says all of its zones by its first frame.
    Starts,
    /// One goes on alone after a time that two tell of: it has said all of its zones long ago, and what is read of that time is
    /// of none of both.
    GoesOn,
    /// Other zones make the total.
    Total(&'a TotalOf),
    Row(&'a Count),
}

/// What is told of a time.
#[derive(Clone, Copy)]
struct Told<'a> {
    /// In order of time.
    rows: &'a [Count],
    lives: &'a [(u64, u64)],
    /// In order of time.
    totals: &'a [TotalOf],
}

/// `starts`: whether a tracker started then, of the time a life begins.
fn binned(
    Told { rows, lives, totals }: Told<'_>,
    starts: impl Fn(u64) -> bool,
    (from_ms, to_ms): (u64, u64),
    bins: usize,
) -> Vec<Option<u32>> {
    let whole_ms = to_ms.saturating_sub(from_ms).max(1);
    let edge_ms = |bin: usize| from_ms + (whole_ms as f64 * bin as f64 / bins as f64) as u64;
    let mut zones: BTreeMap<&str, Option<u32>> = BTreeMap::new();
    let begin = |&(begun_ms, _): &(u64, u64)| {
        (begun_ms, if starts(begun_ms) { Change::Starts } else { Change::GoesOn })
    };
    let mut changes: Vec<(u64, Change<'_>)> = lives.iter().map(begin).collect();
    changes.extend(totals.iter().map(|total| (total.at_ms, Change::Total(total))));
    changes.extend(rows.iter().map(|row| (row.at_ms, Change::Row(row))));
    changes.sort_by_key(|(at_ms, change)| (*at_ms, matches!(change, Change::Row(_))));
    let mut changes = changes.into_iter().peekable();
    let mut counted = totals.first().map(|total| &total.zones);
    // Of none it is only known that they are not there if that is known of every zone.
    let known = |zones: &BTreeMap<&str, Option<u32>>, counted: Option<&BTreeSet<String>>| {
        let asked = |zone: &str| counted.is_none_or(|counted| counted.contains(zone));
        let counts = || zones.iter().filter(|(zone, _)| asked(zone)).map(|(_, count)| *count);
        let found = counts().flatten().reduce(|one, other| one + other)?;
        (found > 0 || counts().all(|count| count.is_some())).then_some(found)
    };
    (0..bins)
        .map(|bin| {
            let (begin_ms, end_ms) = (edge_ms(bin), edge_ms(bin + 1));
            let mut most: Option<u32> = None;
            let mut known_ms = 0;
            let mut from_ms = begin_ms;
            loop {
                let next = changes.next_if(|(at_ms, _)| *at_ms < end_ms);
                // What held when the bin began holds until the first change within it.
                let until_ms = next.map_or(end_ms, |(at_ms, _)| at_ms.max(begin_ms));
                if next.is_none_or(|(at_ms, _)| at_ms > begin_ms)
                    && let Some(people) = known(&zones, counted)
                {
                    let alive_ms = alive_ms(lives, (from_ms, until_ms));
                    known_ms += alive_ms;
                    most = most.max((alive_ms > 0).then_some(people));
                }
                from_ms = until_ms;
                match next {
                    None => break,
                    Some((_, Change::Starts)) => zones.clear(),
                    Some((_, Change::GoesOn)) => zones.values_mut().for_each(|count| *count = None),
                    Some((_, Change::Total(total))) => counted = Some(&total.zones),
                    Some((_, Change::Row(row))) => drop(zones.insert(&row.zone, row.count)),
                }
            }
            most.filter(|most| *most > 0 || known_ms >= end_ms - begin_ms)
        })
        .collect()
}

/// For how long of this time a tracker ran, ms.
fn alive_ms(lives: &[(u64, u64)], (from_ms, until_ms): (u64, u64)) -> u64 {
    let within =
        |&(begun_ms, ended_ms): &(u64, u64)| until_ms.min(ended_ms).saturating_sub(from_ms.max(begun_ms));
    lives.iter().map(within).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai_tracking::occupancy::ZoneKnown;

    fn count(zone: &str, at_ms: u64, count: u32, state: ZoneKnown) -> Count {
        let count = (state == ZoneKnown::Known).then_some(count);
        Count { zone: zone.into(), at_ms, count, state }
    }

    /// Of which zones nothing is kept: all of them count.
    fn binned(
        rows: &[Count],
        lives: &[(u64, u64)],
        starts: impl Fn(u64) -> bool,
        span: (u64, u64),
        bins: usize,
    ) -> Vec<Option<u32>> {
        super::binned(Told { rows, lives, totals: &[] }, starts, span, bins)
    }

    fn total(at_ms: u64, zones: &[&str]) -> TotalOf {
        TotalOf { at_ms, zones: zones.iter().map(|zone| (*zone).to_owned()).collect() }
    }

    #[test]
    fn the_past_is_added_up_by_the_zones_that_made_the_total_then() {
        let rows = [
            count("hall", 0, 2, ZoneKnown::Known),
            count("yard", 0, 1, ZoneKnown::Known),
            // Taken away, and drawn.
            count("hall", 210, 0, ZoneKnown::Unknown),
            count("study", 210, 4, ZoneKnown::Known),
        ];
        let bins = |totals: &[TotalOf]| {
            super::binned(Told { rows: &rows, lives: &[(0, 400)], totals }, |_| true, (0, 400), 4)
        };
        let then = [total(0, &["hall"]), total(100, &["hall", "yard"]), total(200, &["study"])];
        assert_eq!(bins(&then), [Some(2), Some(3), Some(4), Some(4)]);
        // Before the first of them nothing else is known than what it says.
        assert_eq!(bins(&then[1..]), [Some(3), Some(3), Some(4), Some(4)]);
        assert_eq!(bins(&[total(250, &["yard"])]), [Some(1); 4]);
        assert_eq!(bins(&[total(0, &[])]), [None; 4], "a site without zones");
    }

    #[test]
    fn a_bin_holds_the_most_people_at_once() {
        let rows = [
            count("hall", 50, 2, ZoneKnown::Known),
            count("study", 120, 1, ZoneKnown::Known),
            count("hall", 130, 0, ZoneKnown::Partly),
            count("hall", 310, 4, ZoneKnown::Known),
            count("hall", 320, 1, ZoneKnown::Known),
        ];
        let bins = binned(&rows, &[(0, 1000)], |_| true, (100, 500), 4);
        assert_eq!(bins, [Some(3), Some(1), Some(5), Some(2)]);
    }

    #[test]
    fn none_in_one_zone_is_not_none_while_another_is_not_known() {
        let rows = [
            count("hall", 0, 0, ZoneKnown::Known),
            count("study", 0, 0, ZoneKnown::Unknown),
            count("study", 60, 0, ZoneKnown::Known),
        ];
        assert_eq!(binned(&rows, &[(0, 200)], |_| true, (10, 110), 2), [None, Some(0)]);
    }

    #[test]
    fn a_zone_that_was_last_heard_of_before_two_told_of_one_time_is_not_known_after_it() {
        let rows = [
            count("hall", 10, 1, ZoneKnown::Known),
            count("yard", 10, 0, ZoneKnown::Unknown),
            count("hall", 250, 0, ZoneKnown::Known),
            count("yard", 350, 0, ZoneKnown::Known),
        ];
        // The clock was set back from 400 to 100, and has come to 200 since.
        let bins = |starts: bool| binned(&rows, &[(0, 100), (200, 400)], |at| starts || at == 0, (0, 400), 4);
        assert_eq!(bins(false), [Some(1), None, None, None]);
        assert_eq!(bins(true)[3], Some(0), "one that starts would have said that there is a yard");
    }

    #[test]
    fn what_nobody_knew_is_not_zero() {
        let rows = [
            count("hall", 0, 2, ZoneKnown::Known),
            count("hall", 150, 0, ZoneKnown::Unknown),
            count("hall", 350, 0, ZoneKnown::Known),
            count("hall", 510, 0, ZoneKnown::Known),
        ];
        // No tracker ran from 480 to 510. From 300 to 350 the count was not known.
        let bins = binned(&rows, &[(0, 480), (510, 900)], |_| true, (0, 700), 7);
        assert_eq!(bins, [Some(2), Some(2), None, None, None, None, Some(0)]);
        let lives = [(0, 419), (501, 900)];
        assert_eq!(
            binned(&rows, &lives, |_| true, (410, 510), 10),
            [None; 10],
            "a ms of the first was not known"
        );
        assert_eq!(binned(&rows, &lives, |_| true, (410, 418), 2), [Some(0), Some(0)]);
        // One that begins has said nothing yet.
        let bins = binned(&rows[..2], &[(0, 160), (200, 900)], |_| true, (0, 400), 4);
        assert_eq!(bins, [Some(2), Some(2), None, None]);
        assert_eq!(binned(&[], &[], |_| true, (5, 5), 1), [None]);
    }
}
