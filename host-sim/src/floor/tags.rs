//! Where a camera reads the tags that people wear, and when it cannot.
//!
//! ```text
//!            ● behind: hidden while another is within a body's width of the line of sight
//!            ○
//!   camera ◁─┘       found again after half a second in view, then read 9.09 times a second, but for losses
//! ```
//!
//! A place is off by what the calibration of the homography is off, the same for the whole run, by noise, and by where on
//! the body the tag is worn. Source: Ota et al. 2006 (docs/bibliography.md, B), their camera and tags.

use kehai_tracking::geometry::{Point, distance_to_segment};

use crate::world::random::{Purpose, Stream};

/// Between two readings, s: 9.09 Hz.
const PERIOD_S: f64 = 0.11;

/// A tag is found after so long in view, s.
const FOUND_S: f64 = 0.5;

/// Share of the readings that are lost: 8.615 of 9.09 a second remain in the paper.
const LOST: f64 = 0.052;

/// A body hides what is nearer to its middle than this in the plan, m: half a torso's width.
const HIDES_M: f64 = 0.22;

/// Error of the homography at a corner of the floor, m, one sigma along each axis.
const HOMOGRAPHY_M: f64 = 0.03;

/// Noise of a place, m, one sigma: a pixel of a 640 × 480 camera at 4 m, and the swing of the body.
const NOISE_M: f64 = 0.03;

/// From the middle of the body to the tag, m: on the chest.
const WORN_M: f64 = 0.12;

/// A reading.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Tag {
    /// Whose.
    pub id: u64,
    /// Where, by the homography.
    pub at: Point,
}

/// A camera that reads tags.
#[derive(Clone, Debug)]
pub struct Camera {
    at: Point,
    /// Of each person, since when it is in view, s.
    seen_s: Vec<Option<f64>>,
    /// The homography's error: off, and growing along each axis, m and m/m.
    error: [Point; 3],
    random: Stream,
    next_s: f64,
}

impl Camera {
    /// A camera at this place in the plan.
    #[must_use]
    pub fn new(at: Point, people: usize, seed: u64) -> Self {
        let mut random = Stream::new(seed, Purpose::Noise, [0xb, 0]);
        let mut pair = |size: f64| Point::new(random.normal(), random.normal()) * size;
        let error = [pair(HOMOGRAPHY_M * 0.5), pair(HOMOGRAPHY_M * 0.5), pair(HOMOGRAPHY_M * 0.5)];
        let next_s = PERIOD_S * random.uniform();
        Self { at, seen_s: vec![None; people], error, random, next_s }
    }

    /// When it reads next, s.
    #[must_use]
    pub const fn next_s(&self) -> f64 {
        self.next_s
    }

    /// What it reads now, of people at these places who walk this way; the next reading is due a period later.
    pub fn read(&mut self, people: &[(Point, Point)]) -> Vec<Tag> {
        let now_s = self.next_s;
        self.next_s += PERIOD_S;
        let mut tags = Vec::new();
        for (index, &(body, ahead)) in people.iter().enumerate() {
            // Facing away, the tag is worn on the back: each wears two.
            let to_camera = self.at - body;
            let facing = if ahead.dot(to_camera) < 0.0 { ahead * -1.0 } else { ahead };
            let tag = body + facing * WORN_M;
            let hides = |other: &Point| {
                (*other - self.at).length() < to_camera.length()
                    && distance_to_segment(*other, self.at, tag) < HIDES_M
            };
            let others = people.iter().enumerate().filter(|(other, _)| *other != index);
            let hidden = others.map(|(_, (other, _))| other).any(hides);
            let Some(seen_s) = self.seen_s.get_mut(index) else { continue };
            *seen_s = if hidden { None } else { seen_s.or(Some(now_s)) };
            let found = seen_s.is_some_and(|seen_s| now_s - seen_s >= FOUND_S);
            // Drawn in any case, so that what is hidden changes nothing else.
            let (lost, noise) =
                (self.random.chance(LOST), Point::new(self.random.normal(), self.random.normal()) * NOISE_M);
            if found && !lost {
                let [off, along_x, along_y] = self.error;
                let at = tag + off + along_x * tag.x + along_y * tag.y + noise;
                tags.push(Tag { id: index as u64 + 1, at });
            }
        }
        tags
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_stands_behind_another_is_read_again_half_a_second_after() {
        let mut camera = Camera::new(Point::new(0.0, -3.0), 2, 1);
        let front = (Point::new(0.0, 0.0), Point::new(1.0, 0.0));
        let mut first = None;
        for reading in 0..60 {
            let behind = (Point::new(if reading < 30 { 0.1 } else { 1.0 }, 1.0), Point::new(1.0, 0.0));
            let tags = camera.read(&[front, behind]);
            if reading > 6 && reading < 30 {
                assert!(tags.iter().all(|tag| tag.id == 1), "{reading}: {tags:?}");
            }
            if tags.iter().any(|tag| tag.id == 2) {
                first = first.or(Some(reading));
            }
        }
        let first = first.unwrap();
        assert!((34..=37).contains(&first), "0.5 s are five readings: {first}");
    }

    #[test]
    fn places_are_off_by_some_centimetres_and_some_are_lost() {
        let mut sums = (0.0, 0);
        for seed in 0..40 {
            let mut camera = Camera::new(Point::new(0.0, -3.0), 1, seed);
            for _ in 0..100 {
                // Half towards the camera: the tag on the chest is read.
                for tag in camera.read(&[(Point::new(-0.3, 0.2), Point::new(1.0, 0.0))]) {
                    let off = tag.at - Point::new(WORN_M - 0.3, 0.2);
                    sums = (sums.0 + off.dot(off), sums.1 + 1);
                }
            }
        }
        let deviation_m = (0.5 * sums.0 / f64::from(sums.1)).sqrt();
        assert!((0.025..0.055).contains(&deviation_m), "{deviation_m}");
        assert!((3500..3700).contains(&sums.1), "{}", sums.1);
    }
}
