//! CLEAR MOT (Bernardin and Stiefelhagen 2008), and what its pairs say about errors and covariances.
//!
//! ```text
//! frame k−1   person 1 ── track 5        kept while within the gate, however long ago it was
//! frame k     person 1 ── track 5
//!             person 2 ── track 7        the others: as many pairs as possible, then the nearest
//! MOTA = 1 − (misses + false + switches) / people       MOTP = mean distance of the pairs
//! ```
//!
//! As py-motmetrics counts: a person that is paired with another track than last time is a switch, also
//! after a gap. The errors and the NEES are those of the pairs: none is larger than the gate.

use std::ops::AddAssign;

use serde::{Deserialize, Serialize};

use super::assign;
use super::frame::{Estimate, Judged, Target, VISIBLE_BEAMS, share};

/// 95 % of the χ² distribution with two degrees of freedom lie below this: −2 ln 0.05.
const CHI_SQUARE_95: f64 = 5.991_464_547_107_98;

/// Judges one run.
#[derive(Clone, Debug, Default)]
pub struct Clear {
    /// By person: the track it was last.
    last: Vec<Option<usize>>,
    tally: Tally,
}

/// Sums over frames.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tally {
    /// Frames.
    pub frames: u64,
    /// People, frame by frame.
    pub people: u64,
    /// Tracks, frame by frame.
    pub tracks: u64,
    /// Pairs.
    pub matches: u64,
    /// Pairs with another track than the person's last.
    pub switches: u64,
    /// Sum of the distances of the pairs, m.
    pub distance_m: f64,
    /// People with no track at all within the gate.
    pub lost: u64,
    /// Errors of people that some sensor sees well.
    pub visible: Errors,
    /// Errors of the others whose beams were counted.
    pub hidden: Errors,
    /// Whether the covariances are honest.
    pub nees: Nees,
}

/// Squared errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Pairs.
    pub pairs: u64,
    /// Sum of the squared distances, m².
    pub square_m2: f64,
}

/// Normalised estimation errors squared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Nees {
    /// Pairs with a covariance.
    pub pairs: u64,
    /// Of those, inside the ellipse that should hold 95 %.
    pub inside: u64,
    /// Pairs with an invalid covariance (not positive definite): they count as outside, and are not in the sum.
    pub improper: u64,
    /// Sum over the proper ones; 2 each is right.
    pub sum: f64,
}

impl Clear {
    /// Adds a frame and returns its pairs, by their indices in it.
    pub fn frame(
        &mut self,
        judged: &Judged,
        truth: &[Target],
        tracks: &[Estimate],
        gate_m: f64,
    ) -> Vec<(usize, usize)> {
        let near = |person: usize, track: usize| judged.distance_m(person, track) <= gate_m;
        let mut matches = self.kept(judged, &near);
        let free = |place: usize, taken: &dyn Fn(&(usize, usize)) -> usize| {
            !matches.iter().any(|pair| taken(pair) == place)
        };
        let people: Vec<usize> = (0..truth.len()).filter(|&place| free(place, &|pair| pair.0)).collect();
        let others: Vec<usize> = (0..tracks.len()).filter(|&place| free(place, &|pair| pair.1)).collect();
        let new = assign::nearest(people.len(), others.len(), |row, column| {
            let (person, track) = (people[row], others[column]);
            near(person, track).then(|| judged.distance_m(person, track))
        });
        for (row, column) in new {
            let (person, track) = (people[row], others[column]);
            let last = &mut self.last[judged.people[person]];
            self.tally.switches += u64::from(last.is_some());
            *last = Some(judged.tracks[track]);
            matches.push((person, track));
        }
        matches.sort_unstable();

        let tally = &mut self.tally;
        tally.frames += 1;
        tally.people += truth.len() as u64;
        tally.tracks += tracks.len() as u64;
        tally.matches += matches.len() as u64;
        tally.lost += (0..truth.len())
            .filter(|&person| !(0..tracks.len()).any(|track| near(person, track)))
            .count() as u64;
        for &(person, track) in &matches {
            tally.pair(&truth[person], &tracks[track], judged.distance_m(person, track));
        }
        matches
    }

    /// Pairs that continue: each person's last track, if it is in this frame and within the gate. A switch is counted
    /// only for the other people: they are paired anew, and so never with their last track.
    fn kept(&mut self, judged: &Judged, near: &dyn Fn(usize, usize) -> bool) -> Vec<(usize, usize)> {
        let mut matches: Vec<(usize, usize)> = Vec::new();
        for (person, &index) in judged.people.iter().enumerate() {
            if self.last.len() <= index {
                self.last.resize(index + 1, None);
            }
            let Some(last) = self.last[index] else { continue };
            let Some(track) = judged.tracks.iter().position(|&track| track == last) else { continue };
            if near(person, track) && !matches.iter().any(|pair| pair.1 == track) {
                matches.push((person, track));
            }
        }
        matches
    }

    /// The sums.
    #[must_use]
    pub fn tally(self) -> Tally {
        self.tally
    }
}

impl Tally {
    fn pair(&mut self, person: &Target, track: &Estimate, distance_m: f64) {
        self.distance_m += distance_m;
        match person.beams {
            Some(beams) if beams >= VISIBLE_BEAMS => self.visible.add(distance_m),
            Some(_) => self.hidden.add(distance_m),
            None => {}
        }
        if let Some(covariance_m2) = track.covariance_m2 {
            let error = track.at - person.at;
            self.nees.add([error.x, error.y], covariance_m2);
        }
    }

    /// People that no track stands for.
    #[must_use]
    pub const fn misses(&self) -> u64 {
        self.people - self.matches
    }

    /// Tracks without a person.
    #[must_use]
    pub const fn false_tracks(&self) -> u64 {
        self.tracks - self.matches
    }
}

impl Errors {
    fn add(&mut self, distance_m: f64) {
        self.pairs += 1;
        self.square_m2 += distance_m * distance_m;
    }

    /// Root of the mean square, m.
    #[must_use]
    pub fn rms_m(&self) -> Option<f64> {
        share(self.square_m2, self.pairs as f64).map(f64::sqrt)
    }
}

impl Nees {
    fn add(&mut self, [x, y]: [f64; 2], [xx, xy, yy]: [f64; 3]) {
        self.pairs += 1;
        let determinant = xx * yy - xy * xy;
        if !(xx > 0.0 && determinant > 0.0) {
            self.improper += 1;
            return;
        }
        let nees = (yy * x * x - 2.0 * xy * x * y + xx * y * y) / determinant;
        self.inside += u64::from(nees <= CHI_SQUARE_95);
        self.sum += nees;
    }
}

impl AddAssign<&Self> for Tally {
    fn add_assign(&mut self, other: &Self) {
        self.frames += other.frames;
        self.people += other.people;
        self.tracks += other.tracks;
        self.matches += other.matches;
        self.switches += other.switches;
        self.distance_m += other.distance_m;
        self.lost += other.lost;
        for (own, other) in [(&mut self.visible, &other.visible), (&mut self.hidden, &other.hidden)] {
            own.pairs += other.pairs;
            own.square_m2 += other.square_m2;
        }
        self.nees.pairs += other.nees.pairs;
        self.nees.inside += other.nees.inside;
        self.nees.improper += other.nees.improper;
        self.nees.sum += other.nees.sum;
    }
}
