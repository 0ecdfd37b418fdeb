//! A sign: an identity that was read, when, and where; and why a sign is not taken.
//!
//! ```text
//!   Place      ◌ 2σ of the reading      a camera, a locating tag
//!   Near       (  reach  )              a card reader, a beacon
//!   Somewhere  read in the building: it is here, and nothing says where
//! ```

use nalgebra::Matrix2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::card::Card;
use crate::geometry::Point;
use crate::site::FARTHEST_M;

/// Largest spread of a reading along an axis, m: beyond it, it says nothing about where.
const SIGMA_MAX_M: f64 = 100.0;

/// An identity that was read.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sign {
    /// Whose.
    pub card: Card,
    /// When, s on the clock of the tracks.
    pub at_s: f64,
    /// Where.
    pub read: Read,
}

/// Where it was read.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Read {
    /// At a place.
    Place {
        /// The place.
        at: Point,
        /// How well it is known: xx, xy, yy, m².
        covariance_m2: [f64; 3],
    },
    /// By a reader that reads what comes near it.
    Near {
        /// The reader's place.
        at: Point,
        /// How far it reads, m.
        reach_m: f64,
    },
    /// Somewhere in the site.
    Somewhere,
}

impl Read {
    /// The place and its covariance; none of what was read somewhere.
    ///
    /// # Errors
    /// It is no place.
    pub fn gaussian(&self) -> Result<Option<(Point, Matrix2<f64>)>, NotTaken> {
        let (at, [xx, xy, yy]) = match *self {
            Self::Somewhere => return Ok(None),
            Self::Place { at, covariance_m2 } => (at, covariance_m2),
            // Of a normal distribution in the plane 86 % lie within two sigmas.
            Self::Near { at, reach_m } => (at, [0.25 * reach_m * reach_m, 0.0, 0.25 * reach_m * reach_m]),
        };
        for metres in [at.x, at.y] {
            if metres.is_nan() || metres.abs() > FARTHEST_M {
                return Err(NotTaken::NoPlace(format!(
                    "{metres} is no place: metres, at most {FARTHEST_M} from the origin"
                )));
            }
        }
        let most_m2 = SIGMA_MAX_M * SIGMA_MAX_M;
        let is_variance = |variance_m2: f64| (0.0..=most_m2).contains(&variance_m2);
        if !is_variance(xx) || !is_variance(yy) || xy.is_nan() || xy * xy > xx * yy * (1.0 + 1e-9) {
            return Err(NotTaken::NoPlace(format!(
                "its spread must be from 0 to {SIGMA_MAX_M} m; leave the place out if it is not known"
            )));
        }
        Ok(Some((at, Matrix2::new(xx, xy, xy, yy))))
    }
}

/// Why a sign changes nothing.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum NotTaken {
    /// The message says something else, or nothing.
    #[error("malformed: {0}")]
    Malformed(String),
    /// The site has no reader of that name.
    #[error("there is no reader \"{0}\" in the site")]
    NoReader(String),
    /// What it says of its place cannot be.
    #[error("no place: {0}")]
    NoPlace(String),
    /// It was read too long ago.
    #[error("late: it was read {0:.1} s ago, at most 2 s are taken; is the sender's clock right?")]
    Late(f64),
    /// It is from the future.
    #[error("its time is {0:.1} s ahead of this machine's clock: set the sender's clock, or leave at_ms out")]
    Ahead(f64),
    /// Nothing is known of the tracks at its time.
    #[error("the tracker said nothing at that time: is it running?")]
    Untracked,
    /// All places for IDs are taken by others that were read lately.
    #[error("too many IDs were read within the last hour: it is not followed")]
    Full,
}

/// Signs since the start, by what became of them.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct SignCounts {
    /// Used.
    pub taken: u64,
    /// Malformed.
    pub malformed: u64,
    /// Of a reader that the site does not have.
    pub no_reader: u64,
    /// At no place.
    pub no_place: u64,
    /// Read too long ago, or in the future.
    pub late: u64,
    /// No tracks were known at their time.
    pub untracked: u64,
    /// There were too many IDs.
    pub full: u64,
}

impl SignCounts {
    /// One more.
    pub fn count<T>(&mut self, taken: &Result<T, NotTaken>) {
        let count = match taken {
            Ok(_) => &mut self.taken,
            Err(NotTaken::Malformed(_)) => &mut self.malformed,
            Err(NotTaken::NoReader(_)) => &mut self.no_reader,
            Err(NotTaken::NoPlace(_)) => &mut self.no_place,
            Err(NotTaken::Late(_) | NotTaken::Ahead(_)) => &mut self.late,
            Err(NotTaken::Untracked) => &mut self.untracked,
            Err(NotTaken::Full) => &mut self.full,
        };
        *count += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_place_is_said_in_one_line() {
        let said = |x: f64, covariance_m2| {
            Read::Place { at: Point::new(x, 0.0), covariance_m2 }.gaussian().unwrap_err().to_string()
        };
        let round = [0.01, 0.0, 0.01];
        assert_eq!(said(f64::NAN, round), "no place: NaN is no place: metres, at most 10000 from the origin");
        assert!(said(f64::INFINITY, round).contains("inf is no place"));
        assert!(said(-10_001.0, round).contains("-10001 is no place"));
        for bad in [
            [-1.0, 0.0, 1.0],
            [f64::NAN, 0.0, 1.0],
            [1.0, f64::NAN, 1.0],
            [1.0, 1.1, 1.0],
            [1.0, 0.0, 1e9],
            [f64::INFINITY, 0.0, 1.0],
        ] {
            assert!(said(0.0, bad).contains("its spread must be from 0 to 100 m"), "{bad:?}");
        }
        let near = Read::Near { at: Point::new(1.0, 2.0), reach_m: 2.0 }.gaussian().unwrap().unwrap();
        assert_eq!(near, (Point::new(1.0, 2.0), Matrix2::identity()));
        assert_eq!(Read::Somewhere.gaussian(), Ok(None));
        assert!(Read::Near { at: Point::default(), reach_m: f64::NAN }.gaussian().is_err());
    }
}
