//! What the tracker itself said at each moment: the zones of its snapshots, and nothing that was made of them later.
//!
//! ```text
//!   snapshots  │    │    │         │    │ ✝          │    │
//!   holds      ├────┼────┼─── 3 s ─┤────┼─── 3 s ─┤  ├────┼──    until the next one, and no longer than 3 s
//!   asked          ╰──────────╯ yes         ╰────────────╯ no: no snapshot holds for a part of it
//! ```
//!
//! A clock that is set back speaks of some times twice: then both must have said it.

use std::collections::BTreeMap;

use kehai_tracking::lines::Direction;
use kehai_tracking::occupancy::ZoneKnown;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::Snapshot;

/// A snapshot without another holds for so long, ms: as the broker and the database have it.
pub const HOLDS_MS: u64 = 3000;

/// What was said of a zone.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Said {
    known: ZoneKnown,
    count: Option<u32>,
}

impl Said {
    fn is_empty(self) -> bool {
        self == Self { known: ZoneKnown::Known, count: Some(0) }
    }
}

/// What was said of a counting line, and whether more had crossed it than a moment before: in, out.
#[derive(Clone, Copy, Debug)]
struct Line {
    known: ZoneKnown,
    totals: [u64; 2],
    has_grown: [bool; 2],
}

/// A snapshot.
#[derive(Clone, Debug)]
pub struct Moment {
    pub unix_ms: u64,
    pub t_s: f64,
    /// Counts the starts of the tracker.
    pub life: u32,
    zones: BTreeMap<String, Said>,
    lines: BTreeMap<String, Line>,
    /// The zones that make the site's total.
    counted: Vec<String>,
    /// The total of a site without zones is said by no zone.
    is_nobody: bool,
}

/// What a surface says is empty, or 0.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum What {
    /// No person is in a zone.
    Zone(String),
    /// No person is there at all.
    Total,
    /// No person has come into a zone, or left it.
    Stays(String),
    /// No person has crossed a line.
    Crossed(String, Direction),
}

/// All moments of a run, in the order in which they were.
#[derive(Debug, Default)]
pub struct Truth(Vec<Moment>);

/// The first of them.
#[derive(Clone, Copy, Debug)]
pub struct Told<'a>(&'a [Moment]);

impl Truth {
    pub fn note(&mut self, snapshot: &Snapshot, site: &Site, life: u32) {
        let zone = |(name, zone): (&String, &kehai_tracking::jsonl::ZoneLine)| {
            (name.clone(), Said { known: zone.state(), count: zone.count() })
        };
        let before = self.0.last().filter(|before| before.life == life);
        let line = |line: &kehai_tracking::lines::CrossedLine| {
            let totals = line.totals().unwrap_or_default();
            let totals = [totals.inward, totals.outward];
            // What was counted before this start is no crossing of now.
            let was = before.and_then(|before| before.lines.get(&line.name)).map_or(totals, |was| was.totals);
            let has_grown = [totals[0] > was[0], totals[1] > was[1]];
            (line.name.clone(), Line { known: line.state, totals, has_grown })
        };
        let moment = Moment {
            unix_ms: snapshot.unix_ms,
            t_s: snapshot.line.t,
            life,
            zones: snapshot.line.zones.iter().map(zone).collect(),
            lines: snapshot.lines.iter().map(line).collect(),
            counted: site.counted().map(|zone| zone.name.clone()).collect(),
            is_nobody: snapshot.total.count == Some(0) && snapshot.total.state == ZoneKnown::Known,
        };
        self.0.push(moment);
    }

    pub fn newest(&self) -> Option<&Moment> {
        self.0.last()
    }

    /// The moment of a life at a time of the tracker's clock, as it is written.
    pub fn at(&self, life: u32, t_s: f64) -> Option<&Moment> {
        self.0.iter().rev().find(|moment| moment.life == life && moment.t_s == t_s)
    }

    /// All moments of a time, as the wall's clock had it.
    pub fn of_unix(&self, unix_ms: u64) -> impl Iterator<Item = &Moment> {
        self.0.iter().filter(move |moment| moment.unix_ms == unix_ms)
    }

    /// All of it.
    pub fn all(&self) -> Told<'_> {
        Told(&self.0)
    }

    /// What was told up to a time of the tracker's clock: what a database can know that was written until then.
    pub fn until(&self, t_s: f64) -> Told<'_> {
        Told(&self.0[..self.0.partition_point(|moment| moment.t_s <= t_s)])
    }

    pub fn span_ms(&self) -> (u64, u64) {
        let times = || self.0.iter().map(|moment| moment.unix_ms);
        (times().min().unwrap_or(0), times().max().unwrap_or(0))
    }
}

impl Told<'_> {
    /// Whether that was known, and said, all the time; else a moment that says otherwise, if there is one.
    pub fn said_over(&self, what: &What, (from_ms, to_ms): (u64, u64)) -> Result<(), Option<&Moment>> {
        let mut spans: Vec<(u64, u64)> = Vec::new();
        for (index, moment) in self.0.iter().enumerate() {
            let holds_ms = moment.unix_ms + HOLDS_MS;
            let next_ms = self.0.get(index + 1).map_or(holds_ms, |next| next.unix_ms);
            // What is said in a millisecond holds to its end, though the clock was set back then.
            let until_ms = next_ms.clamp(moment.unix_ms + 1, holds_ms);
            if until_ms <= from_ms || moment.unix_ms >= to_ms {
                continue;
            }
            if !moment.says(what, moment.unix_ms >= from_ms) {
                // The last of a start holds on if no other tells of that time, as before the clock was set back.
                let is_last = self.0.get(index + 1).is_none_or(|next| next.life != moment.life);
                if is_last && moment.unix_ms < from_ms {
                    continue;
                }
                return Err(Some(moment));
            }
            spans.push((moment.unix_ms, until_ms));
        }
        spans.sort_unstable();
        let covered_ms = spans.iter().fold(from_ms, |covered_ms, (start_ms, end_ms)| {
            if *start_ms <= covered_ms { covered_ms.max(*end_ms) } else { covered_ms }
        });
        if covered_ms >= to_ms { Ok(()) } else { Err(None) }
    }
}

impl Moment {
    /// Whether it is known, and so. `is_begun`: whether what it brought lies within the time that is asked for.
    pub fn says(&self, what: &What, is_begun: bool) -> bool {
        match what {
            What::Zone(name) => self.zones.get(name).is_some_and(|zone| zone.is_empty()),
            What::Total if self.counted.is_empty() => self.is_nobody,
            What::Total => {
                let is_empty = |name| self.zones.get(name).is_some_and(|zone: &Said| zone.is_empty());
                self.counted.iter().all(is_empty)
            }
            What::Stays(name) => self.zones.get(name).is_some_and(|zone| zone.known == ZoneKnown::Known),
            What::Crossed(name, direction) => self.lines.get(name).is_some_and(|line| {
                let has_grown = line.has_grown[usize::from(*direction == Direction::Out)];
                line.known == ZoneKnown::Known && !(is_begun && has_grown)
            }),
        }
    }
}
