//! What the pipeline makes of a scan, and what it had to drop.
//!
//! ```text
//!   scan ─▶ candidates  ▪ ▪    in scan order, at most `CANDIDATES`
//!           unseen     ├──┤    where nothing can be said, merged where there are too many
//! ```

use crate::background::Learning;
use crate::candidate::{CANDIDATES, Candidate};
use crate::scan::ScanTime;
use crate::unseen::{UnseenSpan, UnseenSpans};

/// What was dropped or refused since the start. All saturate.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Scans of another geometry than the configured one.
    pub foreign_scans: u32,
    /// Scans with fewer beams than the geometry has.
    pub short_scans: u32,
    /// Candidates that became unseen spans for lack of room.
    pub candidates_over: u32,
    /// Unseen spans merged for lack of room.
    pub spans_merged: u32,
    /// Refused wishes to absorb.
    pub absorbs_refused: u32,
}

/// What the pipeline makes of a scan.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// Counts the scans processed, from 1; also those in which nothing was found.
    pub sequence: u32,
    /// When the scan was taken.
    pub time: ScanTime,
    /// Background version it was judged with; 0: none yet, and nothing was judged.
    pub background_version: u16,
    /// How far learning is.
    pub learning: Learning,
    pub(super) candidates: heapless::Vec<Candidate, CANDIDATES>,
    pub(super) unseen: UnseenSpans,
}

impl Judgement {
    pub(super) const fn new() -> Self {
        Self {
            sequence: 0,
            time: ScanTime { sensor_ms: 0, stamp_us: 0, uncertainty_us: 0 },
            background_version: 0,
            learning: Learning::Idle,
            candidates: heapless::Vec::new(),
            unseen: UnseenSpans::new(),
        }
    }

    /// What stands out from the background, in scan order.
    #[must_use]
    pub fn candidates(&self) -> &[Candidate] {
        &self.candidates
    }

    /// Where nothing can be said.
    #[must_use]
    pub fn unseen(&self) -> &[UnseenSpan] {
        self.unseen.as_slice()
    }
}
