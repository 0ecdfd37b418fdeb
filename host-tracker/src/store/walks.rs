//! The paths of tracks as they grow, in parts.
//!
//! ```text
//!   track 7  ●────────●────────●  gone  ●────●        a part is closed after five minutes, and where the track is gone
//!            part 0   part 1            part 2        the open one is handed out again with all that it has by then
//! ```
//!
//! A part has a number of its own also where a track comes back under its number, as a body on a floor does that was for a moment
//! none by the likeliest explanation: in the file it would else replace what was walked before.

use std::collections::BTreeMap;

use super::path::{Path, Place, encode};
use super::row::PathRow;

/// Longest part of a path, ms: what is asked for by time is found in parts that began at most this long before.
pub const PART_MS: u64 = 300_000;

/// For so long the parts of a track that is gone are known, ms: far longer than one comes back.
const GONE_MS: u64 = 600_000;

/// A part, by track and its number from 0.
pub type Part = ((u64, u32), PathRow);

/// The paths of all tracks.
#[derive(Debug, Default)]
pub struct Walks {
    open: BTreeMap<u64, Walk>,
    /// Of tracks that are gone: the number of their next part, and when they were seen last, ms since 1970.
    gone: BTreeMap<u64, (u32, u64)>,
}

#[derive(Debug)]
struct Walk {
    part: u32,
    path: Path,
    changed: bool,
    seen_ms: u64,
}

impl Walks {
    /// A track is at a place; the part that this closes, if it does.
    pub fn see(&mut self, track: u64, place: Place) -> Option<Part> {
        let Self { open, gone } = self;
        let walk = open.entry(track).or_insert_with(|| Walk {
            part: gone.remove(&track).map_or(0, |(part, _)| part),
            path: Path::beginning(place),
            changed: true,
            seen_ms: place.at_ms,
        });
        walk.seen_ms = place.at_ms;
        walk.path.add(place);
        walk.changed = true;
        let (begun_ms, _) = walk.path.span_ms();
        if place.at_ms.saturating_sub(begun_ms) < PART_MS {
            return None;
        }
        let closed = walk.row(track);
        walk.part += 1;
        walk.path = Path::beginning(place);
        closed
    }

    /// Closes the paths of all tracks that were not seen at `at_ms`.
    pub fn end_unseen(&mut self, at_ms: u64) -> Vec<Part> {
        self.gone.retain(|_, (_, seen_ms)| at_ms.saturating_sub(*seen_ms) < GONE_MS);
        self.end(|walk| walk.seen_ms < at_ms)
    }

    /// Closes all paths.
    pub fn end_all(&mut self) -> Vec<Part> {
        self.end(|_| true)
    }

    /// The open parts that have changed since they were asked for last.
    pub fn open(&mut self) -> impl Iterator<Item = Part> {
        self.open.iter_mut().filter_map(|(&track, walk)| walk.row(track))
    }

    fn end(&mut self, is_over: impl Fn(&Walk) -> bool) -> Vec<Part> {
        let over: Vec<u64> =
            self.open.iter().filter(|(_, walk)| is_over(walk)).map(|(&track, _)| track).collect();
        let mut closed = Vec::new();
        for track in over {
            if let Some(mut walk) = self.open.remove(&track) {
                closed.extend(walk.row(track));
                self.gone.insert(track, (walk.part + 1, walk.seen_ms));
            }
        }
        closed
    }
}

impl Walk {
    /// The part that is open, if it has changed since it was asked for last.
    fn row(&mut self, track: u64) -> Option<Part> {
        let (begun_ms, ended_ms) = self.path.span_ms();
        std::mem::take(&mut self.changed)
            .then(|| ((track, self.part), PathRow { begun_ms, ended_ms, points: encode(self.path.places()) }))
    }
}
