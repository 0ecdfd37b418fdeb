//! The region of evaluation: only people in a rectangle are judged; what to do at its edge.
//!
//! ```text
//!   ┌───────────────┐
//!   │  ●──×  hit    │ ×──●   person outside, its track inside: neither a miss nor false
//!   │           ●───┼─×      person inside, its track outside: a hit
//!   │  ×  false     │  ×     a track alone outside: not judged
//!   └───────────────┘        ● person  × track
//! ```
//!
//! People outside are not judged, and neither are their tracks. All persons and tracks within the gate are
//! paired first: as many as possible, and then the nearest. Of the unpaired tracks, those outside are not judged.

use std::fmt;
use std::str::FromStr;

use kehai_tracking::geometry::Point;
use kehai_tracking::tracker::LifeCycle;

use super::assign;
use super::frame::{Estimate, Frame, Target};

/// A rectangle along the axes. Its edge is outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// Corner with the smaller coordinates, m.
    pub from: Point,
    /// Corner with the larger coordinates, m.
    pub to: Point,
}

impl Region {
    /// The rectangle between two opposite corners.
    #[must_use]
    pub fn between(one: Point, other: Point) -> Self {
        Self {
            from: Point::new(one.x.min(other.x), one.y.min(other.y)),
            to: Point::new(one.x.max(other.x), one.y.max(other.y)),
        }
    }

    /// Whether a place is in it.
    #[must_use]
    pub fn contains(&self, place: Point) -> bool {
        self.from.x < place.x && place.x < self.to.x && self.from.y < place.y && place.y < self.to.y
    }
}

impl fmt::Display for Region {
    /// As it is read.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{},{},{}", self.from.x, self.from.y, self.to.x, self.to.y)
    }
}

impl FromStr for Region {
    type Err = String;

    /// Four numbers: `X,Y,X,Y`, two opposite corners in metres.
    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Option<Vec<f64>> =
            text.split(',').map(|part| part.trim().parse().ok().filter(|n: &f64| n.is_finite())).collect();
        let Some([x, y, u, v]) = numbers.as_deref() else {
            return Err("two opposite corners in metres: X,Y,X,Y".into());
        };
        let region = Self::between(Point::new(*x, *y), Point::new(*u, *v));
        if region.from.x == region.to.x || region.from.y == region.to.y {
            return Err("a rectangle without area".into());
        }
        Ok(region)
    }
}

/// What is judged, and how strictly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// A track farther than this from a person is not that person, m.
    pub gate_m: f64,
    /// Where people and tracks are judged; everywhere without it. See [`crate::score::region`].
    pub region: Option<Region>,
    /// Where people are counted; the region without it.
    pub area: Option<Region>,
    /// Whether tentative tracks are judged as well.
    pub tentative: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { gate_m: 0.5, region: None, area: None, tentative: false }
    }
}

impl Settings {
    /// Whether a track is judged at all.
    fn takes(&self, track: &Estimate) -> bool {
        self.tentative || track.state != LifeCycle::Tentative
    }
}

/// The people and tracks of a frame that are judged.
#[must_use]
pub fn judged(frame: &Frame, settings: &Settings) -> (Vec<Target>, Vec<Estimate>) {
    let tracks: Vec<Estimate> = frame.tracks.iter().filter(|track| settings.takes(track)).copied().collect();
    let Some(region) = settings.region else { return (frame.truth.to_vec(), tracks) };
    let pairs = assign::nearest(frame.truth.len(), tracks.len(), |person, track| {
        let distance_m = (frame.truth[person].at - tracks[track].at).length();
        (distance_m <= settings.gate_m).then_some(distance_m)
    });
    let person_of = |track: usize| pairs.iter().find(|pair| pair.1 == track).map(|pair| frame.truth[pair.0]);
    let tracks = tracks
        .iter()
        .enumerate()
        .filter(|(index, track)| region.contains(person_of(*index).map_or(track.at, |person| person.at)))
        .map(|(_, track)| *track)
        .collect();
    (frame.truth.iter().filter(|person| region.contains(person.at)).copied().collect(), tracks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai_tracking::tracker::LifeCycle;

    fn person(id: u64, x: f64) -> Target {
        Target { id, at: Point::new(x, 0.0), beams: None }
    }

    fn track(id: u64, x: f64) -> Estimate {
        Estimate { id, at: Point::new(x, 0.0), covariance_m2: None, state: LifeCycle::Confirmed }
    }

    fn ids(truth: &[Target], tracks: &[Estimate]) -> (Vec<u64>, Vec<u64>) {
        let settings = Settings { region: Some("-1,-1,1,1".parse().unwrap()), ..Settings::default() };
        let (truth, tracks) = judged(&Frame { t_s: 0.0, truth, tracks }, &settings);
        (truth.iter().map(|p| p.id).collect(), tracks.iter().map(|t| t.id).collect())
    }

    #[test]
    fn a_track_that_belongs_to_a_person_outside_is_not_judged() {
        assert_eq!(ids(&[person(1, 1.1)], &[track(9, 0.9)]), (vec![], vec![]));
        assert_eq!(ids(&[person(1, 0.9)], &[track(9, 1.1)]), (vec![1], vec![9]));
        assert_eq!(ids(&[], &[track(8, 0.9), track(9, 1.1)]), (vec![], vec![8]));
        // Beyond the gate the track belongs to no person, and is judged where it is.
        assert_eq!(ids(&[person(1, 1.45)], &[track(9, 0.9)]), (vec![], vec![9]));
        // Two people, two tracks: each its own.
        assert_eq!(
            ids(&[person(1, 0.9), person(2, 1.2)], &[track(8, 1.05), track(9, 0.8)]),
            (vec![1], vec![9])
        );
    }

    #[test]
    fn tentative_tracks_are_judged_only_when_asked_for() {
        let tracks = [Estimate { state: LifeCycle::Tentative, ..track(1, 0.0) }, track(2, 0.0)];
        let frame = Frame { t_s: 0.0, truth: &[], tracks: &tracks };
        let number = |tentative| judged(&frame, &Settings { tentative, ..Settings::default() }).1.len();
        assert_eq!((number(false), number(true)), (1, 2));
    }

    #[test]
    fn a_region_is_two_corners() {
        let region: Region = "1, -2.6,-2,1".parse().unwrap();
        assert_eq!(region, Region { from: Point::new(-2.0, -2.6), to: Point::new(1.0, 1.0) });
        assert_eq!(region.to_string().parse(), Ok(region));
        assert!(!region.contains(Point::new(1.0, 0.0)) && region.contains(Point::new(0.99, 0.0)));
        for bad in ["1,2,3", "1,2,3,4,5", "1,2,1,4", "a,b,c,d", "nan,0,1,1", ""] {
            assert!(bad.parse::<Region>().is_err(), "{bad:?}");
        }
    }
}
