//! How many are counted, and whether that is right: at every moment, and for a trial as a whole.
//!
//! ```text
//! all in                        door opens
//!   │ 4 4 4 5 4 4 4 … 4 4 4 3 4 4 │      true number: 4
//!   │                └── 3 s ─────┘      success: the most frequent number here is 4
//!   └──── steady: right in 95 % of ──────┘
//! ```
//!
//! The number is that of confirmed and occluded tracks inside the area, by where each of them is said to be.

use std::collections::BTreeMap;
use std::ops::{AddAssign, Range};

use kehai_tracking::tracker::LifeCycle;

use serde::{Deserialize, Serialize};

use super::frame::{Frame, share};
use super::region::Region;

/// Length of the piece that decides about success, s.
pub const DECIDING_S: f64 = 3.0;
/// Share of the time a steady count is right.
pub const STEADY_SHARE: f64 = 0.95;
/// Times come in steps of 0.1 s and are not exact: this much before a limit is the limit, s.
const TIME_SLACK_S: f64 = 1e-6;

/// The counts of one run.
#[derive(Clone, Debug)]
pub struct CountLog {
    area: Option<Region>,
    tentative: bool,
    counts: Vec<Count>,
}

/// The count at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Count {
    /// s.
    pub t_s: f64,
    /// People there.
    pub truth: usize,
    /// Tracks there.
    pub counted: usize,
}

/// Sums over frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tally {
    /// Frames.
    pub frames: u64,
    /// Of those, with the right number.
    pub exact: u64,
    /// People too many, frame by frame.
    pub over: u64,
    /// People too few, frame by frame.
    pub under: u64,
}

impl CountLog {
    /// Counts in this area, or everywhere; tentative tracks too if wanted.
    #[must_use]
    pub const fn new(area: Option<Region>, tentative: bool) -> Self {
        Self { area, tentative, counts: Vec::new() }
    }

    /// Adds a frame.
    pub fn frame(&mut self, frame: &Frame) {
        let inside = |place| self.area.is_none_or(|area| area.contains(place));
        let counts = |state| self.tentative || state != LifeCycle::Tentative;
        let truth = frame.truth.iter().filter(|person| inside(person.at)).count();
        let counted = frame.tracks.iter().filter(|track| counts(track.state) && inside(track.at)).count();
        self.counts.push(Count { t_s: frame.t_s, truth, counted });
    }

    /// All of them, in the order of time.
    #[must_use]
    pub fn counts(&self) -> &[Count] {
        &self.counts
    }

    /// Those from the start to before the end.
    fn within(&self, span_s: &Range<f64>) -> impl Iterator<Item = &Count> {
        let (from_s, to_s) = (span_s.start - TIME_SLACK_S, span_s.end - TIME_SLACK_S);
        self.counts.iter().filter(move |count| from_s <= count.t_s && count.t_s < to_s)
    }

    /// The most frequent number, the smallest of several; none without a frame in that time.
    #[must_use]
    pub fn most_frequent(&self, span_s: &Range<f64>) -> Option<usize> {
        let mut frames: BTreeMap<usize, usize> = BTreeMap::new();
        for count in self.within(span_s) {
            *frames.entry(count.counted).or_default() += 1;
        }
        frames.into_iter().rev().max_by_key(|&(_, frames)| frames).map(|(counted, _)| counted)
    }

    /// The most frequent true number; none without a frame in that time.
    #[must_use]
    pub fn most_true(&self, span_s: &Range<f64>) -> Option<usize> {
        let mut frames: BTreeMap<usize, usize> = BTreeMap::new();
        for count in self.within(span_s) {
            *frames.entry(count.truth).or_default() += 1;
        }
        frames.into_iter().rev().max_by_key(|&(_, frames)| frames).map(|(truth, _)| truth)
    }

    /// Whether the most frequent number of the last 3 s before `opens_s` is `people`.
    #[must_use]
    pub fn success(&self, opens_s: f64, people: usize) -> bool {
        self.most_frequent(&(opens_s - DECIDING_S..opens_s)) == Some(people)
    }

    /// Share of the frames with the right number.
    #[must_use]
    pub fn exact_share(&self, span_s: &Range<f64>) -> Option<f64> {
        let frames = self.within(span_s).count();
        let exact = self.within(span_s).filter(|count| count.counted == count.truth).count();
        share(exact as f64, frames as f64)
    }

    /// Whether the number is right in 95 % of the frames.
    #[must_use]
    pub fn steady(&self, span_s: &Range<f64>) -> bool {
        self.exact_share(span_s).is_some_and(|share| share >= STEADY_SHARE)
    }

    /// How long after `from_s` the number is `people` for the first time, s.
    #[must_use]
    pub fn delay_s(&self, from_s: f64, people: usize) -> Option<f64> {
        self.within(&(from_s..f64::INFINITY))
            .find(|count| count.counted == people)
            .map(|count| (count.t_s - from_s).max(0.0))
    }

    /// The sums.
    #[must_use]
    pub fn tally(&self) -> Tally {
        let mut tally = Tally { frames: self.counts.len() as u64, ..Tally::default() };
        for count in &self.counts {
            tally.exact += u64::from(count.counted == count.truth);
            tally.over += count.counted.saturating_sub(count.truth) as u64;
            tally.under += count.truth.saturating_sub(count.counted) as u64;
        }
        tally
    }
}

impl AddAssign<&Self> for Tally {
    fn add_assign(&mut self, other: &Self) {
        self.frames += other.frames;
        self.exact += other.exact;
        self.over += other.over;
        self.under += other.under;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(counted: &[usize]) -> CountLog {
        let mut log = CountLog::new(None, false);
        log.counts = counted
            .iter()
            .enumerate()
            .map(|(index, &counted)| Count { t_s: index as f64 * 0.1, truth: 4, counted })
            .collect();
        log
    }

    #[test]
    fn the_last_three_seconds_decide() {
        let mut counts = vec![7; 20];
        counts.extend([4; 16]);
        counts.extend([5; 14]);
        counts.extend([7; 40]);
        let log = log(&counts);
        assert!(log.success(5.0, 4) && !log.success(5.0, 5));
        assert!(!log.success(5.3, 4), "13 of 4, 14 of 5");
        assert!(!log.success(100.0, 0), "no frame, no success");
        assert_eq!(log.most_frequent(&(4.9..5.1)), Some(5), "the smaller of two");
    }

    #[test]
    fn steady_is_right_in_19_of_20() {
        let mut counts = vec![4; 20];
        counts[3] = 5;
        assert!(log(&counts).steady(&(0.0..2.0)));
        assert_eq!(log(&counts).exact_share(&(0.0..2.0)), Some(0.95));
        counts[19] = 3;
        assert!(!log(&counts).steady(&(0.0..2.0)));
        assert_eq!(log(&counts).tally(), Tally { frames: 20, exact: 18, over: 1, under: 1 });
        assert!(!log(&counts).steady(&(5.0..6.0)), "nothing is known of that time");
    }

    #[test]
    fn the_delay_is_from_the_event_to_the_right_number() {
        let log = log(&[0, 4, 4, 0, 0, 0]);
        assert!(log.delay_s(0.1, 0).is_some_and(|delay_s| (delay_s - 0.2).abs() < 1e-9));
        assert_eq!(log.delay_s(0.0, 9), None);
    }
}
