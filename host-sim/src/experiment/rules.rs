//! Rules: the requirement on a run, and the figures reported for it.
//!
//! ```text
//!   true number in the zone   1 1 1 0 0 0 0 0 0 0 0 0
//!   counted                   1 1 1 1 1 0 0 0 0 1 0 0
//!                                   └ within ┘└ from here on right in 95 % of the time: it settles
//! ```

use std::collections::{BTreeMap, BTreeSet};

use kehai_tracking::geometry::Point;

use super::figure::{Figure, Finding};
use super::log::{Line, Log};

/// Farther away than this a track is not on the person, m.
const LOST_M: f64 = 0.5;

/// A tracker needs up to so long to confirm a person, s.
const BIRTH_S: f64 = 1.5;

/// A stay in the zone shorter than this is no visit, s.
const VISIT_S: f64 = 3.0;

/// Share of the time that counts as all of it.
const SETTLED_SHARE: f64 = 0.95;

/// Requirement on a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rule {
    /// From the time at which the first person is in the zone, the count is right in this share of the time.
    Steady {
        /// The share.
        share: f64,
    },
    /// The count is right from this time after the last change of the true number, and stays right.
    Settles {
        /// How long, s.
        within_s: f64,
    },
    /// The only person in the zone always has a track within 0.5 m.
    Followed {
        /// So many frames are judged.
        frames: usize,
    },
    /// No track where no person is, and a track for every visitor.
    Undisturbed,
    /// While all are in the zone, the most frequent count is the true one.
    Counted,
    /// IDF1 in the first of two networks, less that in the second.
    Falls,
}

impl Rule {
    /// Judges a run, seen over one network or several.
    #[must_use]
    pub fn judge(self, logs: &[Log]) -> Finding {
        let log = logs.first().map_or(&[][..], |log| &log.lines);
        match self {
            Self::Steady { share } => steady(log, share),
            Self::Settles { within_s } => settles(log, within_s),
            Self::Followed { frames } => followed(logs, frames),
            Self::Undisturbed => undisturbed(log),
            Self::Counted => counted(log),
            Self::Falls => falls(logs),
        }
    }
}

fn percent(lines: &[&Line], wanted: impl Fn(&Line) -> bool) -> f64 {
    100.0 * lines.iter().filter(|line| wanted(line)).count() as f64 / lines.len().max(1) as f64
}

fn right(line: &Line) -> bool {
    line.counted == line.inside
}

fn steady(lines: &[Line], share: f64) -> Finding {
    let lines: Vec<&Line> = lines.iter().skip_while(|line| line.inside == 0).collect();
    let own = percent(&lines, right);
    vec![
        ("right nearly all the time, % of runs", Figure::of(own >= 100.0 * share)),
        ("right, % of the time", Figure::time(own, 2)),
        ("the same, worst run", Figure::Least(own)),
        ("too many, % of the time", Figure::time(percent(&lines, |line| line.counted > line.inside), 2)),
        ("too few, % of the time", Figure::time(percent(&lines, |line| line.counted < line.inside), 2)),
    ]
}

fn settles(lines: &[Line], within_s: f64) -> Finding {
    let mut changes = lines.windows(2).filter(|pair| pair[0].inside != pair[1].inside);
    let change_s = changes.next_back().map_or(0.0, |pair| pair[1].t_s);
    let after: Vec<&Line> = lines.iter().filter(|line| line.t_s >= change_s).collect();
    let first_s = after.iter().find(|line| right(line)).map(|line| line.t_s - change_s);
    let later: Vec<&Line> = after.iter().filter(|line| line.t_s >= change_s + within_s).copied().collect();
    let settled = !later.is_empty() && percent(&later, right) >= 100.0 * SETTLED_SHARE;
    let all: Vec<&Line> = lines.iter().filter(|line| line.t_s < change_s && line.inside > 0).collect();
    vec![
        ("right in time and from then on, % of runs", Figure::of(settled)),
        ("right in time, % of runs", Figure::of(first_s.is_some_and(|first_s| first_s <= within_s))),
        (
            "afterwards too many, % of the time",
            Figure::time(percent(&later, |line| line.counted > line.inside), 1),
        ),
        (
            "afterwards too few, % of the time",
            Figure::time(percent(&later, |line| line.counted < line.inside), 1),
        ),
        ("right before, % of the time", Figure::time(percent(&all, right), 1)),
    ]
}

fn followed(logs: &[Log], frames: usize) -> Finding {
    let Some(log) = logs.first() else { return Vec::new() };
    let alone = |line: &&Line| line.people.len() == 1 && line.inside == 1;
    let from_s = log.lines.iter().find(alone).map_or(0.0, |line| line.t_s + BIRTH_S);
    let judged: Vec<&Line> =
        log.lines.iter().filter(|line| line.t_s >= from_s).filter(alone).take(frames).collect();
    let (mut sum_m, mut found, mut ids) = (0.0, 0_u32, BTreeSet::new());
    for line in &judged {
        let Some(person) = line.people.first() else { continue };
        let nearest = line
            .tracks
            .iter()
            .map(|track| ((track.at - person.at).length(), track.id))
            .min_by(|one, other| one.0.total_cmp(&other.0));
        if let Some((distance_m, id)) = nearest.filter(|(distance_m, _)| *distance_m <= LOST_M) {
            (sum_m, found) = (sum_m + distance_m, found + 1);
            ids.insert(id);
        }
    }
    let lost = judged.len() as f64 - f64::from(found);
    let nees = log.tally.clear.nees;
    // Nothing can be said of the places of a person who was never found: 0 cm would be the best of all.
    let error_cm = (found > 0).then(|| 100.0 * sum_m / f64::from(found));
    let covered = (nees.pairs > 0).then(|| 100.0 * nees.inside as f64 / nees.pairs as f64);
    vec![
        ("no frame lost, % of runs", Figure::of(lost == 0.0 && !judged.is_empty())),
        ("frames", Figure::Sum(judged.len() as f64)),
        ("lost", Figure::Sum(lost)),
        ("mean error, cm", Figure::Mean { values: error_cm.into_iter().collect(), digits: 1, shares: false }),
        (
            "in the 95 % ellipse, %",
            Figure::Mean { values: covered.into_iter().collect(), digits: 1, shares: true },
        ),
        ("identities", Figure::mean(ids.len() as f64, 1)),
        ("right, % of the time", Figure::time(percent(&judged, right), 1)),
    ]
}

fn undisturbed(lines: &[Line]) -> Finding {
    // By track id: lines with this track, and those of them in which it is not on a person.
    let mut lives: BTreeMap<u64, (u32, u32)> = BTreeMap::new();
    for line in lines {
        for track in &line.tracks {
            let none = line.people.iter().all(|person| (person.at - track.at).length() > LOST_M);
            let life = lives.entry(track.id).or_default();
            *life = (life.0 + 1, life.1 + u32::from(none));
        }
    }
    let false_tracks = lives.values().filter(|(lines, none)| 2 * none > *lines).count();
    let hours = lines.last().map_or(0.0, |line| line.t_s / 3600.0);
    let visits = lines.chunk_by(|one, other| (one.inside > 0) == (other.inside > 0));
    let visits = visits.filter(|visit| {
        let length_s = visit.first().zip(visit.last()).map_or(0.0, |(first, last)| last.t_s - first.t_s);
        length_s >= VISIT_S && visit.first().is_some_and(|line| line.inside > 0)
    });
    let near = |line: &Line, at: Point| line.tracks.iter().any(|track| (track.at - at).length() <= LOST_M);
    let born =
        |visit: &[Line]| visit.iter().any(|line| line.people.iter().any(|person| near(line, person.at)));
    let (yes, of) = visits.fold((0, 0), |(yes, of), visit| (yes + u64::from(born(visit)), of + 1));
    vec![
        ("false confirmed tracks", Figure::Sum(false_tracks as f64)),
        ("hours", Figure::Hours(hours)),
        ("visitors found, %", Figure::Share { yes, of }),
    ]
}

fn counted(lines: &[Line]) -> Finding {
    let most = lines.iter().map(|line| line.inside).max().unwrap_or(0);
    let from_s = lines.iter().find(|line| line.inside == most).map_or(0.0, |line| line.t_s + BIRTH_S);
    let lines: Vec<&Line> = lines.iter().filter(|line| line.inside == most && line.t_s >= from_s).collect();
    let mut frames: BTreeMap<usize, usize> = BTreeMap::new();
    lines.iter().for_each(|line| *frames.entry(line.counted).or_default() += 1);
    let mode = frames.into_iter().rev().max_by_key(|(_, frames)| *frames).map_or(0, |(counted, _)| counted);
    vec![
        ("counted right, % of runs", Figure::of(mode == most)),
        ("too many, % of runs", Figure::of(mode > most)),
        ("too few, % of runs", Figure::of(mode < most)),
        ("right, % of the time", Figure::time(percent(&lines, right), 1)),
        ("too many, % of the time", Figure::time(percent(&lines, |line| line.counted > most), 1)),
        ("too few, % of the time", Figure::time(percent(&lines, |line| line.counted < most), 1)),
        ("none, % of the time", Figure::time(percent(&lines, |line| line.counted == 0), 1)),
    ]
}

fn falls(logs: &[Log]) -> Finding {
    let idf1: Vec<f64> = logs.iter().filter_map(|log| log.tally.figures().idf1).collect();
    let [first, second] = *idf1 else { return Vec::new() };
    vec![
        ("IDF1", Figure::mean(first, 3)),
        ("IDF1, disturbed", Figure::mean(second, 3)),
        ("it falls by", Figure::mean(first - second, 3)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::{Estimate, Tally, Target};
    use kehai_tracking::tracker::LifeCycle;

    /// Lines of 0.1 s: so many in the zone, so many counted.
    fn log(numbers: &[(usize, usize)]) -> Log {
        let line = |(index, &(inside, counted)): (usize, &(usize, usize))| Line {
            t_s: index as f64 * 0.1,
            people: Vec::new(),
            tracks: Vec::new(),
            inside,
            counted,
        };
        Log { lines: numbers.iter().enumerate().map(line).collect(), tally: Tally::default() }
    }

    fn yes(finding: &Finding, name: &str) -> bool {
        match &finding.iter().find(|(own, _)| *own == name).unwrap().1 {
            Figure::Share { yes, of } => {
                assert_eq!(*of, 1);
                *yes == 1
            }
            other => panic!("{other:?}"),
        }
    }

    fn repeated(parts: &[(usize, usize, usize)]) -> Vec<(usize, usize)> {
        parts.iter().flat_map(|&(inside, counted, lines)| vec![(inside, counted); lines]).collect()
    }

    #[test]
    fn settling_is_being_right_in_time_and_staying_so() {
        let name = "right in time and from then on, % of runs";
        let judge = |parts: &[_]| Rule::Settles { within_s: 1.0 }.judge(&[log(&repeated(parts))]);
        assert!(yes(&judge(&[(1, 1, 30), (0, 1, 9), (0, 0, 50)]), name));
        assert!(!yes(&judge(&[(1, 1, 30), (0, 1, 20), (0, 0, 50)]), name), "a second too late");
        assert!(!yes(&judge(&[(1, 1, 30), (0, 0, 20), (0, 1, 50)]), name), "right for a while only");
        assert!(!yes(&judge(&[(1, 1, 30), (0, 0, 5)]), name), "nothing is known of the time after");
    }

    #[test]
    fn steady_begins_with_the_first_person() {
        let judge = |parts: &[_]| Rule::Steady { share: 0.99 }.judge(&[log(&repeated(parts))]);
        let name = "right nearly all the time, % of runs";
        assert!(yes(&judge(&[(0, 5, 500), (1, 1, 99), (1, 2, 1)]), name));
        assert!(!yes(&judge(&[(0, 0, 500), (1, 1, 98), (1, 2, 2)]), name));
    }

    #[test]
    fn who_carries_something_is_counted_while_inside() {
        let judge = |parts: &[_]| Rule::Counted.judge(&[log(&repeated(parts))]);
        let finding = judge(&[(0, 4, 90), (1, 0, 15), (1, 1, 10), (1, 2, 11), (0, 1, 80)]);
        assert!(yes(&finding, "too many, % of runs") && !yes(&finding, "counted right, % of runs"));
        assert!(yes(&judge(&[(1, 0, 15), (1, 1, 12), (1, 2, 11)]), "counted right, % of runs"));
    }

    #[test]
    fn a_track_that_is_no_person_most_of_its_life_is_false() {
        let person = Target { id: 1, at: Point::new(0.0, 0.0), beams: None };
        let track =
            |id, x| Estimate { id, at: Point::new(x, 0.0), covariance_m2: None, state: LifeCycle::Confirmed };
        let mut log = log(&[(1, 1); 40]);
        for (index, line) in log.lines.iter_mut().enumerate() {
            line.people = vec![person];
            // A track on the person, a track away from the person for a quarter of its life, and a track elsewhere.
            line.tracks = vec![track(1, 0.1), track(2, if index < 10 { 2.0 } else { 0.0 }), track(3, 3.0)];
        }
        let finding = Rule::Undisturbed.judge(&[log.clone()]);
        assert!(finding.contains(&("false confirmed tracks", Figure::Sum(1.0))), "{finding:?}");
        assert!(finding.contains(&("visitors found, %", Figure::Share { yes: 1, of: 1 })), "{finding:?}");
        log.lines.iter_mut().for_each(|line| line.tracks.clear());
        let finding = Rule::Undisturbed.judge(&[log]);
        assert!(finding.contains(&("visitors found, %", Figure::Share { yes: 0, of: 1 })), "{finding:?}");
    }

    #[test]
    fn a_person_who_is_never_found_has_no_error() {
        let mut log = log(&[(1, 0); 60]);
        log.lines
            .iter_mut()
            .for_each(|line| line.people = vec![Target { id: 1, at: Point::default(), beams: None }]);
        let finding = Rule::Followed { frames: 40 }.judge(&[log]);
        for (name, printed) in [("mean error, cm", "–"), ("in the 95 % ellipse, %", "–"), ("lost", "40")]
        {
            let (_, figure) = finding.iter().find(|(own, _)| *own == name).unwrap();
            assert_eq!(figure.words(), printed, "{name}");
        }
    }
}
