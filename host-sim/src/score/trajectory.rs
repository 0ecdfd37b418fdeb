//! Identification precision and recall of trajectories (paper D, section 5.2).
//!
//! ```text
//! track 5   1 1 1 1 2 2 ·     the person it is most often: 1, in 4 of the 7 frames it lives
//! person 1  5 5 5 5 8 8 ·     the track it most often has: 5, in 4 of the 7 frames it is there
//! precision = mean over the tracks, recall = mean over the people
//! ```
//!
//! The pairs of a frame are those of CLEAR MOT. Every track and every person has the same weight, whatever its
//! lifetime. As in paper D's tables, the figures are also grouped by the largest number of people at once meanwhile.

use std::collections::BTreeMap;
use std::ops::AddAssign;

use serde::{Deserialize, Serialize};

use super::frame::{Ids, Judged, share};

/// Judges one run.
#[derive(Clone, Debug, Default)]
pub struct Trajectories {
    /// Frames in which this person is this track.
    matches: BTreeMap<(usize, usize), u64>,
    /// By person: the most people at once while it was there.
    person_crowd: Vec<usize>,
    /// By track: the most people at once while it lived.
    track_crowd: Vec<usize>,
}

/// Sums over runs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tally {
    /// By the most people at once: tracks.
    pub tracks: BTreeMap<usize, Mean>,
    /// By the most people at once: people.
    pub people: BTreeMap<usize, Mean>,
}

/// A mean in the making.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mean {
    /// How many.
    pub number: u64,
    /// Sum of their shares.
    pub sum: f64,
}

impl Trajectories {
    /// Adds a frame and its pairs, by their indices in it.
    pub fn frame(&mut self, judged: &Judged, matches: &[(usize, usize)]) {
        for &(person, track) in matches {
            *self.matches.entry((judged.people[person], judged.tracks[track])).or_default() += 1;
        }
        let crowd = judged.people.len();
        raise(&mut self.person_crowd, &judged.people, crowd);
        raise(&mut self.track_crowd, &judged.tracks, crowd);
    }

    /// The sums.
    #[must_use]
    pub fn tally(&self, people: &Ids, tracks: &Ids) -> Tally {
        let most = |number: usize, own: &dyn Fn(&(usize, usize)) -> usize| {
            let mut most = vec![0; number];
            for (pair, &frames) in &self.matches {
                let most = &mut most[own(pair)];
                *most = frames.max(*most);
            }
            most
        };
        let by_person = most(people.frames.len(), &|pair| pair.0);
        let by_track = most(tracks.frames.len(), &|pair| pair.1);
        Tally {
            tracks: by_crowd(&by_track, &tracks.frames, &self.track_crowd),
            people: by_crowd(&by_person, &people.frames, &self.person_crowd),
        }
    }
}

fn raise(crowds: &mut Vec<usize>, indices: &[usize], crowd: usize) {
    for &index in indices {
        if crowds.len() <= index {
            crowds.resize(index + 1, 0);
        }
        crowds[index] = crowds[index].max(crowd);
    }
}

fn by_crowd(most: &[u64], frames: &[u64], crowds: &[usize]) -> BTreeMap<usize, Mean> {
    let mut means: BTreeMap<usize, Mean> = BTreeMap::new();
    for ((&most, &frames), &crowd) in most.iter().zip(frames).zip(crowds) {
        let mean = means.entry(crowd).or_default();
        mean.number += 1;
        mean.sum += most as f64 / frames as f64;
    }
    means
}

impl Mean {
    /// The mean over all of them.
    #[must_use]
    pub fn over(means: &BTreeMap<usize, Self>) -> Option<f64> {
        let number: u64 = means.values().map(|mean| mean.number).sum();
        share(means.values().map(|mean| mean.sum).sum(), number as f64)
    }
}

impl AddAssign<&Self> for Tally {
    fn add_assign(&mut self, other: &Self) {
        for (own, other) in [(&mut self.tracks, &other.tracks), (&mut self.people, &other.people)] {
            for (crowd, mean) in other {
                let own = own.entry(*crowd).or_default();
                own.number += mean.number;
                own.sum += mean.sum;
            }
        }
    }
}
