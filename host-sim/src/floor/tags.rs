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

use std::collections::BTreeMap;

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

/// A tag that is covered from time to time is so for so long, and not for so long in between, s.
const COVERED_S: [f64; 2] = [1.0, 60.0];
const SHOWN_S: [f64; 2] = [5.0, 15.0];

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
    /// Of each person in view, since when, s.
    seen_s: BTreeMap<u64, f64>,
    /// The homography's error: off, and growing along each axis, m and m/m.
    error: [Point; 3],
    random: Stream,
    next_s: f64,
}

impl Camera {
    /// A camera at this place in the plan.
    #[must_use]
    pub fn new(at: Point, seed: u64) -> Self {
        let mut random = Stream::new(seed, Purpose::Noise, [0xb, 0]);
        let mut pair = |size: f64| Point::new(random.normal(), random.normal()) * size;
        let error = [pair(HOMOGRAPHY_M * 0.5), pair(HOMOGRAPHY_M * 0.5), pair(HOMOGRAPHY_M * 0.5)];
        let next_s = PERIOD_S * random.uniform();
        Self { at, seen_s: BTreeMap::new(), error, random, next_s }
    }

    /// When it reads next, s.
    #[must_use]
    pub const fn next_s(&self) -> f64 {
        self.next_s
    }

    /// What it reads now, of the people in view: number of the tag, where the body is, and which way it walks. The next
    /// reading is due a period later.
    pub fn read(&mut self, people: &[(u64, Point, Point)]) -> Vec<Tag> {
        let now_s = self.next_s;
        self.next_s += PERIOD_S;
        self.seen_s.retain(|id, _| people.iter().any(|(there, ..)| there == id));
        let mut tags = Vec::new();
        for &(id, body, ahead) in people {
            // Facing away, the tag is worn on the back: each wears two.
            let to_camera = self.at - body;
            let facing = if ahead.dot(to_camera) < 0.0 { ahead * -1.0 } else { ahead };
            let tag = body + facing * WORN_M;
            let hides = |other: &Point| {
                (*other - self.at).length() < to_camera.length()
                    && distance_to_segment(*other, self.at, tag) < HIDES_M
            };
            let others = people.iter().filter(|(other, ..)| *other != id);
            let found = if others.map(|(_, other, _)| other).any(hides) {
                self.seen_s.remove(&id);
                false
            } else {
                now_s - *self.seen_s.entry(id).or_insert(now_s) >= FOUND_S
            };
            // Drawn in any case, so that what is hidden changes nothing else.
            let (lost, noise) =
                (self.random.chance(LOST), Point::new(self.random.normal(), self.random.normal()) * NOISE_M);
            if found && !lost {
                let [off, along_x, along_y] = self.error;
                let at = tag + off + along_x * tag.x + along_y * tag.y + noise;
                tags.push(Tag { id, at });
            }
        }
        tags
    }
}

/// A tag that is covered from time to time.
#[derive(Clone, Debug)]
pub struct Covered {
    random: Stream,
    /// From when it is covered, and until when, s.
    from_s: f64,
    until_s: f64,
}

impl Covered {
    /// A person's, by a run's seed; not before `begin_s`.
    #[must_use]
    pub fn new(begin_s: f64, (seed, person): (u64, u64)) -> Self {
        let random = Stream::new(seed, Purpose::Noise, [0xb5, person]);
        Self { random, from_s: begin_s, until_s: begin_s }
    }

    /// Whether it can be read; the time goes on from question to question.
    pub fn shows(&mut self, at_s: f64) -> bool {
        while at_s >= self.until_s {
            self.from_s = self.until_s + self.random.between(SHOWN_S[0], SHOWN_S[1]);
            self.until_s = self.from_s + self.random.between(COVERED_S[0], COVERED_S[1]);
        }
        at_s < self.from_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_stands_behind_another_is_read_again_half_a_second_after() {
        let mut camera = Camera::new(Point::new(0.0, -3.0), 1);
        let front = (1, Point::new(0.0, 0.0), Point::new(1.0, 0.0));
        let mut first = None;
        for reading in 0..60 {
            let behind = (2, Point::new(if reading < 30 { 0.1 } else { 1.0 }, 1.0), Point::new(1.0, 0.0));
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
            let mut camera = Camera::new(Point::new(0.0, -3.0), seed);
            for _ in 0..100 {
                // Half towards the camera: the tag on the chest is read.
                for tag in camera.read(&[(1, Point::new(-0.3, 0.2), Point::new(1.0, 0.0))]) {
                    let off = tag.at - Point::new(WORN_M - 0.3, 0.2);
                    sums = (sums.0 + off.dot(off), sums.1 + 1);
                }
            }
        }
        let deviation_m = (0.5 * sums.0 / f64::from(sums.1)).sqrt();
        assert!((0.025..0.055).contains(&deviation_m), "{deviation_m}");
        assert!((3500..3700).contains(&sums.1), "{}", sums.1);
    }

    #[test]
    fn a_tag_is_covered_for_up_to_a_minute_at_a_time() {
        let mut tag = Covered::new(5.0, (3, 0));
        let shown: Vec<bool> = (0..120_000).map(|hundredth| tag.shows(0.01 * f64::from(hundredth))).collect();
        let spans = shown.chunk_by(|one, other| one == other).map(|span| (span[0], 0.01 * span.len() as f64));
        let spans: Vec<(bool, f64)> = spans.collect();
        for (is_shown, for_s) in &spans[1..spans.len() - 1] {
            let [least_s, most_s] = if *is_shown { SHOWN_S } else { COVERED_S };
            assert!((least_s - 0.02..most_s + 0.02).contains(for_s), "{is_shown} for {for_s} s");
        }
        assert!((45..75).contains(&spans.len()), "{}", spans.len());
    }
}
