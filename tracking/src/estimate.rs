//! What is known at one time.
//!
//! ```text
//!   SiteTracker::estimate ─▶ Estimate ─┬▶ doors and signs decide by it
//!                                      ╰▶ TracksLine: what is written of it
//! ```

use std::collections::BTreeMap;

use crate::explanation::Explanation;
use crate::jsonl::{TrackLine, TracksLine, ZoneLine};
use crate::lines::Crossing;
use crate::stays::Change;
use crate::tracker::TrackState;

/// What doors and signs decide by, and what lines are written from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Time the tracks are predicted to, s on the host's clock.
    pub t_s: f64,
    /// All tracks, tentative ones included.
    pub tracks: Vec<TrackState>,
    /// What is known of each zone, by its name.
    pub zones: BTreeMap<String, ZoneLine>,
    /// Hypotheses for the tracks that only floors see, the likeliest first; the tracks have its places. None without floors.
    pub explanations: Vec<Explanation>,
    /// Crossings of counting lines since the estimate before.
    pub crossings: Vec<Crossing>,
    /// Entries into zones, and exits from them, since then.
    pub stays: Vec<Change>,
}

impl From<&Estimate> for TracksLine {
    fn from(estimate: &Estimate) -> Self {
        let tracks = estimate.tracks.iter().map(TrackLine::from).collect();
        // To the microsecond, as clocks are: 0.1, not 0.09999999999999999.
        let t = (estimate.t_s * 1e6).round() / 1e6;
        Self { t, tracks, zones: estimate.zones.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::{Estimate, TracksLine};

    #[test]
    fn a_time_is_written_to_the_microsecond() {
        let t_s = 100_000.0 * 1e-6;
        assert_ne!(t_s, 0.1, "what computing in microseconds gives");
        assert_eq!(TracksLine::from(&Estimate { t_s, ..Estimate::default() }).t, 0.1);
    }
}
