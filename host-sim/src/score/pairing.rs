//! Which line of the tracks belongs to which line of the truth.
//!
//! ```text
//! truth    0.00  0.04  0.08  0.12  0.16  0.20   …   7.0  7.1     a tracker that has fallen silent
//! tracks   0.00        ╲0.10╱            0.20                     is judged as one without tracks
//! ```
//!
//! A frame is a line of the truth with the line of the tracks nearest to it, at most 0.05 s away. Truth that
//! comes more often is skipped in between; truth more than 0.5 s from any line of the tracks is a frame
//! without tracks, as often as the tracks had lines before: a second of silence weighs as much as one
//! of tracks. Before there were two lines, every line of the truth is. Tracks that no truth is near are skipped.

use kehai_tracking::jsonl::{LineError, TracksLine, TruthLine};

use super::frame::{Estimate, Frame, Target};
use super::scorer::Scorer;

/// Truth and tracks at most this far apart are of one time, s.
const TOGETHER_S: f64 = 0.05;
/// A tracker that reports nothing for longer than this is judged as one without tracks, s.
const SILENCE_S: f64 = 0.5;
/// What computing with decimals may add, s.
const SLACK_S: f64 = 1e-9;

/// How the lines went together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Paired {
    /// Lines of truth with tracks.
    pub frames: u64,
    /// Lines of truth in a silence of the tracker: frames without tracks.
    pub silent: u64,
    /// Lines of truth between those of the tracks.
    pub between: u64,
    /// Lines of tracks that no truth is near.
    pub without_truth: u64,
}

/// How often the tracks have a line, and when the next frame of a silence is due.
#[derive(Clone, Copy, Debug, Default)]
struct Pace {
    gaps_s: f64,
    gaps: u32,
    due_s: f64,
}

impl Pace {
    /// Counts the time between two lines, unless it is a silence.
    fn count(&mut self, gap_s: f64) {
        if (0.0..=SILENCE_S).contains(&gap_s) {
            self.gaps_s += gap_s;
            self.gaps += 1;
        }
    }

    /// Whether a line would have come by `at_s`, had the tracker not fallen silent.
    fn is_due(&mut self, at_s: f64) -> bool {
        let is_due = at_s >= self.due_s - SLACK_S;
        if is_due {
            let interval_s = self.gaps_s / f64::from(self.gaps.max(1));
            let next_s = self.due_s + interval_s;
            self.due_s = if next_s > at_s { next_s } else { at_s + interval_s };
        }
        is_due
    }
}

/// Gives the scorer every frame of two files.
///
/// # Errors
/// The first line that cannot be used.
pub fn score_lines(
    scorer: &mut Scorer,
    truth: impl Iterator<Item = Result<TruthLine, LineError>>,
    tracks: impl Iterator<Item = Result<TracksLine, LineError>>,
) -> Result<Paired, LineError> {
    let mut paired = Paired::default();
    let mut truth = truth.peekable();
    let mut tracks = tracks.peekable();
    // The line of tracks before the next one, and whether it has been used.
    let mut before: Option<(TracksLine, bool)> = None;
    let mut pace = Pace::default();
    while let Some(line) = truth.next().transpose()? {
        // On to the tracks nearest to this time.
        let away_s = |other: &TracksLine| (other.t - line.t).abs();
        while let Some(next) = tracks.next_if(|next| match (next, &before) {
            (Ok(next), Some((before, _))) => away_s(next) < away_s(before),
            _ => true,
        }) {
            let next = next?;
            if let Some((before, used)) = &before {
                paired.without_truth += u64::from(!used);
                pace.count(next.t - before.t);
            }
            before = Some((next, false));
        }
        let away_s = before.as_ref().map_or(f64::INFINITY, |(before, _)| away_s(before));
        let next_is_nearer = match (truth.peek(), &before) {
            (Some(Ok(next)), Some((before, _))) => (next.t - before.t).abs() < away_s,
            _ => false,
        };
        match &mut before {
            Some((before, used)) if away_s <= TOGETHER_S + SLACK_S && !*used && !next_is_nearer => {
                *used = true;
                paired.frames += 1;
                frame(scorer, &line, &before.tracks.iter().map(Estimate::from).collect::<Vec<_>>());
            }
            _ if away_s > SILENCE_S + SLACK_S && pace.is_due(line.t) => {
                paired.silent += 1;
                frame(scorer, &line, &[]);
            }
            _ => paired.between += 1,
        }
    }
    paired.without_truth += u64::from(before.is_some_and(|(_, used)| !used));
    for line in tracks {
        line?;
        paired.without_truth += 1;
    }
    Ok(paired)
}

fn frame(scorer: &mut Scorer, line: &TruthLine, tracks: &[Estimate]) {
    let truth: Vec<Target> = line.people.iter().map(Target::from).collect();
    scorer.frame(&Frame { t_s: line.t, truth: &truth, tracks });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::Settings;
    use kehai_tracking::jsonl::Lines;

    fn paired(truth: &[f64], tracks: &[f64]) -> Paired {
        let truth = truth.iter().map(|&t| Ok(TruthLine { t, people: Vec::new() }));
        let tracks = tracks.iter().map(|&t| Ok(TracksLine { t, ..TracksLine::default() }));
        score_lines(&mut Scorer::new(Settings::default()), truth, tracks).unwrap()
    }

    #[test]
    fn equal_times_go_together() {
        let times: Vec<f64> = (0..40).map(|index| f64::from(index) * 0.1).collect();
        assert_eq!(paired(&times, &times), Paired { frames: 40, ..Paired::default() });
        let late: Vec<f64> = times.iter().map(|t| t + 0.04).collect();
        assert_eq!(paired(&times, &late).frames, 40);
    }

    #[test]
    fn truth_that_comes_more_often_is_skipped_between() {
        let truth: Vec<f64> = (0..=100).map(|index| f64::from(index) * 0.04).collect();
        let tracks: Vec<f64> = (0..=40).map(|index| f64::from(index) * 0.1).collect();
        assert_eq!(paired(&truth, &tracks), Paired { frames: 41, between: 60, ..Paired::default() });
    }

    #[test]
    fn a_tracker_that_falls_silent_sees_no_person() {
        let truth: Vec<f64> = (0..40).map(|index| f64::from(index) * 0.1).collect();
        assert_eq!(
            paired(&truth, &truth[..10]),
            Paired { frames: 10, silent: 25, between: 5, ..Paired::default() }
        );
        assert_eq!(paired(&truth, &[]), Paired { silent: 40, ..Paired::default() });
        assert_eq!(
            paired(&truth[..10], &truth),
            Paired { frames: 10, without_truth: 30, ..Paired::default() }
        );
        assert_eq!(paired(&[], &truth), Paired { without_truth: 40, ..Paired::default() });
    }

    #[test]
    fn a_second_of_silence_weighs_as_much_as_one_of_tracks() {
        let truth: Vec<f64> = (0..=250).map(|index| f64::from(index) * 0.04).collect();
        let tracks: Vec<f64> = (0..=100).map(|index| f64::from(index) * 0.1).collect();
        // Silent from 3 to 7 s: to 6.5 s beyond the first half second.
        let silent: Vec<f64> = tracks.iter().copied().filter(|t| !(3.05..6.95).contains(t)).collect();
        let paired = paired(&truth, &silent);
        assert_eq!((paired.frames, paired.silent), (62, 30), "ten a second: {paired:?}");
        assert_eq!(paired.frames + paired.silent + paired.between, 251);
    }

    #[test]
    fn a_bad_line_of_either_file_ends_it() {
        let good = "{\"t\":0,\"people\":[],\"tracks\":[]}\n";
        for (truth, tracks, file) in [
            ("x", good, "truth:1"),
            (good, "x", "tracks:1"),
            (good, "{\"t\":0,\"tracks\":[]}\nx", "tracks:2"),
        ] {
            let truth = Lines::new(truth.as_bytes(), "truth");
            let tracks = Lines::new(tracks.as_bytes(), "tracks");
            let error = score_lines(&mut Scorer::new(Settings::default()), truth, tracks).unwrap_err();
            assert!(error.to_string().starts_with(file), "{error}");
        }
    }
}
