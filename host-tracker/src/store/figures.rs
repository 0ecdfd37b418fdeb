//! What happened, by the hour: crossings of lines, people and stays in zones, and for how long nothing is known.
//!
//! ```text
//!   from ├────── bin ──────┼────── bin ──────┤ to
//!   line   in 12  out 9      in –  out –        –: a bin in which nothing was known, never 0
//!          unknown 0 s       unknown 3600 s              and a 0 only of a bin of which all was known
//!   zone   mean, most        of the time in which the count was known
//!          stays, median     of those that ended in the bin
//!   one sweep: each change, crossing and stay is looked at once, and goes to its bins
//!   lives ━━━━━━━━━━━━━━━━━━━━━━━┥    beyond: no tracker ran, so nothing was known
//! ```

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::event::{Event, EventKind};
use super::reader::Reader;
use kehai_tracking::lines::Direction;
use kehai_tracking::occupancy::ZoneKnown;

/// Most bins: a month of hours, and more.
pub const BINS_MAX: u64 = 1000;

/// A stay that began longer before the first bin is left out, ms: a day.
pub(super) const STAY_MS: u64 = 86_400_000;

/// All bins, one after the other.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Figures {
    /// The bins.
    pub bins: Vec<Bin>,
}

/// A part of the time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "FiguresBin")]
pub struct Bin {
    /// When it begins, ms since 1970.
    pub from_ms: u64,
    /// When it ends.
    pub to_ms: u64,
    /// Each counting line, by its name.
    pub lines: BTreeMap<String, LineFigures>,
    /// Each zone, by its name.
    pub zones: BTreeMap<String, ZoneFigures>,
}

/// A line within a bin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct LineFigures {
    /// Inward; none if no person was seen to cross and the line was not seen all the time.
    #[serde(rename = "in")]
    pub inward: Option<u32>,
    /// Outward; none if no person was seen to cross and the line was not seen all the time.
    #[serde(rename = "out")]
    pub outward: Option<u32>,
    /// For how long not all of the line was seen, s.
    pub unknown_s: f64,
}

/// A zone within a bin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct ZoneFigures {
    /// People, the mean over the time in which their number was known; none without such a time, or if that would be 0 and their
    /// number was not known all the time.
    pub mean: Option<f64>,
    /// The most at once; none likewise.
    pub most: Option<u32>,
    /// People who entered; none if no person was seen to enter and not all of the zone was known all the time.
    pub entered: Option<u32>,
    /// Stays that ended; none likewise.
    pub stays: Option<u32>,
    /// Their median, s; none without any.
    pub dwell_s: Option<f64>,
    /// For how long the number of people was not known, s.
    pub unknown_s: f64,
}

/// A person's stay in a zone.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Stay {
    /// The zone.
    pub zone: String,
    /// The track.
    pub track: u64,
    /// When it entered, ms since 1970.
    pub begun_ms: u64,
    /// When it left, or was lost.
    pub ended_ms: u64,
}

/// From some time on a value holds; none: it is not known.
type Change<T> = (u64, Option<T>);

/// People in a zone.
#[derive(Clone, Copy, Debug)]
struct Counted {
    count: u32,
    /// All of the zone is known: else there are at least so many.
    is_whole: bool,
}

/// A figure; 0 is only said of a time of which all is known, as 0 people are of a zone of which all is.
fn said<T: Default + PartialEq>(figure: T, is_all_known: bool) -> Option<T> {
    (is_all_known || figure != T::default()).then_some(figure)
}

/// The edges of the bins of `bin_ms` from `from_ms` to `to_ms`, at most [`BINS_MAX`] bins; the last may be shorter.
#[must_use]
pub fn edges((from_ms, to_ms): (u64, u64), bin_ms: u64) -> Vec<u64> {
    let bin_ms = bin_ms.max(1);
    let starts = (0..BINS_MAX).map(|bin| from_ms.saturating_add(bin * bin_ms));
    let mut edges: Vec<u64> = starts.take_while(|start_ms| *start_ms < to_ms).collect();
    edges.extend(edges.last().map(|last_ms| last_ms.saturating_add(bin_ms).min(to_ms)));
    edges
}

/// The time between these edges, which grow, in a bin between each and the next. The last one ends where a tracker that runs has
/// written to.
///
/// # Errors
/// What SQLite says.
pub fn figures(reader: &Reader, edges_ms: &[u64]) -> rusqlite::Result<Figures> {
    let (Some(&from_ms), Some(&to_ms)) = (edges_ms.first(), edges_ms.last()) else {
        return Ok(Figures::default());
    };
    let edges_ms = &until(edges_ms, reader.until_ms(to_ms)?);
    let bins = Bins(edges_ms);
    let before_ms = from_ms.saturating_sub(STAY_MS);
    let lives = reader.lives(before_ms, to_ms)?;
    let mut zones: BTreeMap<String, Vec<Change<Counted>>> = BTreeMap::new();
    for row in reader.counts(from_ms, to_ms)? {
        let is_whole = row.state == ZoneKnown::Known;
        let counted = row.count.map(|count| Counted { count, is_whole });
        zones.entry(row.zone).or_default().push((row.at_ms, counted));
    }
    let mut lines: BTreeMap<String, Vec<Change<()>>> = BTreeMap::new();
    for row in reader.line_states(from_ms, to_ms)? {
        let is_known = (row.state == ZoneKnown::Known).then_some(());
        lines.entry(row.line).or_default().push((row.at_ms, is_known));
    }
    let mut crossed: BTreeMap<String, Vec<(u64, Direction)>> = BTreeMap::new();
    for row in reader.crossings(from_ms, to_ms)? {
        crossed.entry(row.line).or_default().push((row.at_ms, row.direction));
    }
    let events = reader.events(before_ms, to_ms)?;
    let mut ended: BTreeMap<String, Vec<Stay>> = BTreeMap::new();
    for stay in stays(&events, &lives) {
        ended.entry(stay.zone.clone()).or_default().push(stay);
    }
    let mut entered: BTreeMap<&str, Vec<u64>> = BTreeMap::new();
    for event in events.iter().filter(|event| event.kind == EventKind::Enter) {
        entered.entry(&event.subject).or_default().push(event.at_ms);
    }
    let spans = edges_ms.windows(2).map(|span| Bin { from_ms: span[0], to_ms: span[1], ..Bin::default() });
    let mut found = Figures { bins: spans.collect() };
    for (name, changes) in &lines {
        let own = crossed.get(name).map_or(&[][..], Vec::as_slice);
        for (bin, line) in found.bins.iter_mut().zip(of_line(changes, own, &lives, bins)) {
            bin.lines.insert(name.clone(), line);
        }
    }
    for (name, changes) in &zones {
        let stays = ended.get(name).map_or(&[][..], Vec::as_slice);
        let entered = entered.get(name.as_str()).map_or(&[][..], Vec::as_slice);
        for (bin, zone) in found.bins.iter_mut().zip(of_zone(changes, (entered, stays), &lives, bins)) {
            bin.zones.insert(name.clone(), zone);
        }
    }
    Ok(found)
}

/// Edges up to a time after the first of them.
fn until(edges_ms: &[u64], until_ms: u64) -> Vec<u64> {
    let before = edges_ms.partition_point(|edge_ms| *edge_ms < until_ms);
    match edges_ms.get(..before) {
        Some([]) | None => edges_ms.to_vec(),
        Some(before) => [before, &[until_ms]].concat(),
    }
}

/// Bins, by their edges.
#[derive(Clone, Copy, Debug)]
struct Bins<'a>(&'a [u64]);

impl Bins<'_> {
    fn len(self) -> usize {
        self.0.len().saturating_sub(1)
    }

    /// The bin that a time is in.
    fn at(self, at_ms: u64) -> Option<usize> {
        let bin = self.0.partition_point(|edge_ms| *edge_ms <= at_ms).checked_sub(1)?;
        (bin < self.len()).then_some(bin)
    }

    fn long_ms(self, bin: usize) -> u64 {
        self.0.get(bin + 1).zip(self.0.get(bin)).map_or(0, |(end_ms, begin_ms)| end_ms - begin_ms)
    }

    /// Calls `each` with every bin that a span touches, and for how long, ms.
    fn share(self, (start_ms, end_ms): (u64, u64), mut each: impl FnMut(usize, u64)) {
        let first = self.0.partition_point(|edge_ms| *edge_ms <= start_ms).saturating_sub(1);
        for (bin, span) in self.0.windows(2).enumerate().skip(first) {
            if span[0] >= end_ms {
                break;
            }
            let long_ms = end_ms.min(span[1]).saturating_sub(start_ms.max(span[0]));
            if long_ms > 0 {
                each(bin, long_ms);
            }
        }
    }
}

fn of_line(
    changes: &[Change<()>],
    crossed: &[(u64, Direction)],
    lives: &[(u64, u64)],
    bins: Bins<'_>,
) -> Vec<LineFigures> {
    let mut known_ms = vec![0; bins.len()];
    pieces(changes, lives, |span, ()| bins.share(span, |bin, long_ms| known_ms[bin] += long_ms));
    let mut counts = vec![[0_u32; 2]; bins.len()];
    for (at_ms, direction) in crossed {
        if let Some(bin) = bins.at(*at_ms) {
            let [inward, outward] = &mut counts[bin];
            *match direction {
                Direction::In => inward,
                Direction::Out => outward,
            } += 1;
        }
    }
    let line = |(bin, (known_ms, [inward, outward])): (usize, (u64, [u32; 2]))| {
        // A line that is seen in part still counts some people; a count of 0 is not known then.
        let unknown_ms = bins.long_ms(bin) - known_ms;
        LineFigures {
            inward: said(inward, unknown_ms == 0),
            outward: said(outward, unknown_ms == 0),
            unknown_s: seconds(unknown_ms),
        }
    };
    known_ms.into_iter().zip(counts).enumerate().map(line).collect()
}

/// A zone within a bin, as it is added up.
#[derive(Clone, Debug, Default)]
struct Sum {
    known_ms: u64,
    /// Of that: in which all of the zone was.
    whole_ms: u64,
    people_ms: u64,
    most: Option<u32>,
    entered: u32,
    stays_ms: Vec<u64>,
}

fn of_zone(
    changes: &[Change<Counted>],
    (entered, stays): (&[u64], &[Stay]),
    lives: &[(u64, u64)],
    bins: Bins<'_>,
) -> Vec<ZoneFigures> {
    let mut sums = vec![Sum::default(); bins.len()];
    pieces(changes, lives, |span, Counted { count, is_whole }| {
        bins.share(span, |bin, long_ms| {
            let sum = &mut sums[bin];
            sum.known_ms += long_ms;
            sum.whole_ms += if is_whole { long_ms } else { 0 };
            sum.people_ms += u64::from(count) * long_ms;
            sum.most = sum.most.max(Some(count));
        });
    });
    for bin in entered.iter().filter_map(|at_ms| bins.at(*at_ms)) {
        sums[bin].entered += 1;
    }
    for stay in stays {
        if let Some(bin) = bins.at(stay.ended_ms) {
            sums[bin].stays_ms.push(stay.ended_ms.saturating_sub(stay.begun_ms));
        }
    }
    let zone = |(bin, sum): (usize, Sum)| {
        let Sum { known_ms, whole_ms, people_ms, most, entered, mut stays_ms } = sum;
        stays_ms.sort_unstable();
        let long_ms = bins.long_ms(bin);
        let (is_known, is_whole) = (known_ms == long_ms, whole_ms == long_ms);
        let mean = (known_ms > 0).then(|| people_ms as f64 / known_ms as f64);
        ZoneFigures {
            mean: mean.and_then(|mean| said(mean, is_known)),
            most: most.and_then(|most| said(most, is_known)),
            entered: said(entered, is_whole),
            stays: said(u32::try_from(stays_ms.len()).unwrap_or(u32::MAX), is_whole),
            dwell_s: median_s(&stays_ms),
            unknown_s: seconds(long_ms - known_ms),
        }
    };
    sums.into_iter().enumerate().map(zone).collect()
}

fn seconds(ms: u64) -> f64 {
    ms as f64 * 1e-3
}

/// Of sorted times.
fn median_s(sorted_ms: &[u64]) -> Option<f64> {
    let middle = sorted_ms.len() / 2;
    let upper = *sorted_ms.get(middle)?;
    let lower =
        if sorted_ms.len().is_multiple_of(2) { *sorted_ms.get(middle.checked_sub(1)?)? } else { upper };
    Some((seconds(lower) + seconds(upper)) / 2.0)
}

/// Calls `each` with every span in which a value was known. What was known holds until it changes, and no longer than the life
/// of the tracker that said it. Both in order of time.
fn pieces<T: Copy>(changes: &[Change<T>], lives: &[(u64, u64)], mut each: impl FnMut((u64, u64), T)) {
    for &(begun_ms, ended_ms) in lives {
        let first = changes.partition_point(|(at_ms, _)| *at_ms < begun_ms);
        let last = changes.partition_point(|(at_ms, _)| *at_ms <= ended_ms);
        let own = changes.get(first..last).unwrap_or_default();
        let ends = own.iter().skip(1).map(|(at_ms, _)| *at_ms).chain([ended_ms]);
        for (&(at_ms, value), end_ms) in own.iter().zip(ends) {
            if let Some(value) = value
                && at_ms < end_ms
            {
                each((at_ms, end_ms), value);
            }
        }
    }
}

/// Stays, by who entered and left; `events` in order of time. A track that no tracker has seen leave has no stay.
#[must_use]
pub fn stays(events: &[Event], lives: &[(u64, u64)]) -> Vec<Stay> {
    let mut inside: BTreeMap<(&str, u64), u64> = BTreeMap::new();
    let mut stays = Vec::new();
    let life = |at_ms: u64| lives.partition_point(|(begun_ms, _)| *begun_ms <= at_ms);
    for event in events {
        let Some(track) = event.track else { continue };
        let key = (event.subject.as_str(), track);
        match event.kind {
            EventKind::Enter => {
                inside.insert(key, event.at_ms);
            }
            EventKind::Leave => {
                let begun_ms = inside.remove(&key).filter(|begun_ms| life(*begun_ms) == life(event.at_ms));
                let zone = event.subject.clone();
                stays.extend(begun_ms.map(|begun_ms| Stay { zone, track, begun_ms, ended_ms: event.at_ms }));
            }
            _ => {}
        }
    }
    stays
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn event(kind: &str, at_ms: u64, track: u64) -> Event {
        Event::new(at_ms, EventKind::named(kind), "hall", "").of(Some(track))
    }

    #[test]
    fn a_bin_in_which_nothing_was_known_has_no_counts_rather_than_none() {
        let changes = [(0, Some(())), (1500, None), (4000, Some(()))];
        let crossed =
            [(100, Direction::In), (1200, Direction::Out), (1300, Direction::In), (2500, Direction::In)];
        let edges = edges((0, 6000), 1000);
        let found = of_line(&changes, &crossed, &[(0, 5000)], Bins(&edges));
        let of = |from_ms: usize| found[from_ms / 1000];
        let line = |inward, outward, unknown_s| LineFigures { inward, outward, unknown_s };
        assert_eq!(of(0), line(Some(1), Some(0), 0.0));
        assert_eq!(of(1000), line(Some(1), Some(1), 0.5));
        assert_eq!(until(&edges, 5500), [0, 1000, 2000, 3000, 4000, 5000, 5500]);
        assert_eq!([until(&edges, 6000), until(&edges, 0)], [edges.clone(), edges.clone()]);
        assert_eq!(of(2000), line(Some(1), None, 1.0), "one was seen through a gap");
        assert_eq!(of(3000), line(None, None, 1.0));
        assert_eq!(of(4000), line(Some(0), Some(0), 0.0));
        assert_eq!(of(5000), line(None, None, 1.0), "no tracker runs");
    }

    /// As long as people are counted all of the zone is known.
    fn whole(changes: &[Change<u32>]) -> Vec<Change<Counted>> {
        let counted = |count| Counted { count, is_whole: true };
        changes.iter().map(|(at_ms, count)| (*at_ms, count.map(counted))).collect()
    }

    #[test]
    fn nobody_is_only_said_of_a_time_of_which_all_is_known() {
        let lives = [(0, 4000)];
        let edges = edges((0, 5000), 1000);
        let of = |changes: &[Change<Counted>]| {
            let found = of_zone(changes, (&[], &[]), &lives, Bins(&edges));
            found.iter().map(|zone| (zone.mean, zone.most, zone.entered, zone.stays)).collect::<Vec<_>>()
        };
        let (none, nothing) = ((Some(0.0), Some(0), Some(0), Some(0)), (None, None, None, None));
        let changes = whole(&[(0, Some(0)), (1999, None), (2001, Some(0))]);
        assert_eq!(of(&changes), [none, nothing, nothing, none, nothing], "a ms is missing twice");
        // While a part of a zone is known, people in it are known, but not that none came.
        let part = Counted { count: 2, is_whole: false };
        assert_eq!(of(&[(0, Some(part))])[0], (Some(2.0), Some(2), None, None));
    }

    #[test]
    fn the_mean_is_over_the_time_in_which_people_were_counted() {
        let changes = whole(&[(0, Some(2)), (250, Some(4)), (500, None)]);
        let stay = |begun_ms, ended_ms| Stay { zone: "hall".into(), track: 1, begun_ms, ended_ms };
        let stays = [stay(0, 300), stay(0, 900), stay(0, 1100)];
        let edges = edges((0, 2000), 1000);
        let found = of_zone(&changes, (&[0, 0, 1600], &stays), &[(0, 2000)], Bins(&edges));
        let [zone, later] = found[..] else { panic!("{found:?}") };
        assert_eq!((zone.mean, zone.most, zone.unknown_s), (Some(3.0), Some(4), 0.5));
        assert_eq!((zone.stays, zone.dwell_s, zone.entered), (Some(2), Some(0.6), Some(2)));
        assert_eq!((later.mean, later.most, later.dwell_s, later.entered), (None, None, Some(1.1), Some(1)));
    }

    #[test]
    fn a_stay_is_from_entering_to_leaving_under_one_tracker() {
        let events = [
            event("enter", 10, 1),
            event("enter", 20, 2),
            event("leave", 30, 1),
            // A track of another run under the same number.
            event("leave", 130, 2),
            event("enter", 140, 2),
            event("leave", 150, 2),
        ];
        let found = stays(&events, &[(0, 90), (100, 200)]);
        let times: Vec<(u64, u64, u64)> =
            found.iter().map(|stay| (stay.track, stay.begun_ms, stay.ended_ms)).collect();
        assert_eq!(times, [(1, 10, 30), (2, 140, 150)]);
    }

    /// The value at a time, as it is defined: of the newest change in the life of the tracker that runs then.
    fn value_at<T: Copy>(changes: &[Change<T>], lives: &[(u64, u64)], at_ms: u64) -> Option<T> {
        let (begun_ms, _) =
            lives.iter().find(|(begun_ms, ended_ms)| (*begun_ms..*ended_ms).contains(&at_ms))?;
        changes.iter().rfind(|(changed_ms, _)| (*begun_ms..=at_ms).contains(changed_ms))?.1
    }

    proptest! {
        #[test]
        fn one_sweep_finds_what_a_look_at_every_millisecond_finds(
            times in prop::collection::vec((1..40_u64, prop::option::of(0..4_u32)), 0..12),
            gaps in prop::collection::vec((1..60_u64, 1..40_u64), 0..4),
            crossed in prop::collection::vec((0..230_u64, any::<bool>()), 0..20),
            widths in prop::collection::vec(1..50_u64, 1..6),
            from_ms in 0..60_u64,
        ) {
            let mut at_ms = 0;
            let changes: Vec<Change<u32>> = times.iter().map(|(after_ms, value)| { at_ms += after_ms; (at_ms, *value) }).collect();
            let mut end_ms = 0;
            let lives: Vec<(u64, u64)> = gaps.iter().map(|(long_ms, gap_ms)| {
                let begun_ms = end_ms + gap_ms;
                end_ms = begun_ms + long_ms;
                (begun_ms, end_ms)
            }).collect();
            let mut edge_ms = from_ms;
            let edges: Vec<u64> = std::iter::once(from_ms).chain(widths.iter().map(|width_ms| { edge_ms += width_ms; edge_ms })).collect();
            let zones = of_zone(&whole(&changes), (&[], &[]), &lives, Bins(&edges));
            let known: Vec<Change<()>> = changes.iter().map(|(at_ms, value)| (*at_ms, value.map(|_| ()))).collect();
            let crossed: Vec<(u64, Direction)> = crossed.iter().map(|(at_ms, inward)| (*at_ms, if *inward { Direction::In } else { Direction::Out })).collect();
            let lines = of_line(&known, &crossed, &lives, Bins(&edges));
            for ((span, zone), line) in edges.windows(2).zip(zones).zip(lines) {
                let values: Vec<u32> = (span[0]..span[1]).filter_map(|at_ms| value_at(&changes, &lives, at_ms)).collect();
                let unknown_s = seconds(span[1] - span[0] - values.len() as u64);
                let is_known = unknown_s == 0.0;
                let most = values.iter().max().copied().filter(|most| is_known || *most > 0);
                prop_assert_eq!((zone.most, zone.unknown_s, line.unknown_s), (most, unknown_s, unknown_s));
                let mean = (!values.is_empty()).then(|| f64::from(values.iter().sum::<u32>()) / values.len() as f64);
                let mean = mean.filter(|mean| is_known || *mean > 0.0);
                prop_assert!((zone.mean.unwrap_or(-1.0) - mean.unwrap_or(-1.0)).abs() < 1e-9, "{:?} {:?}", zone, mean);
                let count = |wanted| crossed.iter().filter(|(at_ms, direction)| (span[0]..span[1]).contains(at_ms) && *direction == wanted).count() as u32;
                let (inward, outward) = (count(Direction::In), count(Direction::Out));
                let known = |count: u32| (is_known || count > 0).then_some(count);
                prop_assert_eq!((line.inward, line.outward), (known(inward), known(outward)));
            }
        }
    }

    #[test]
    fn edges_go_on_to_the_end() {
        assert_eq!(edges((10, 35), 10), [10, 20, 30, 35]);
        assert_eq!(edges((10, 10), 10), [0; 0]);
        assert_eq!(edges((0, u64::MAX), 1).len() as u64, BINS_MAX + 1);
    }
}
