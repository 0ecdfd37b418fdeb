//! A depth camera beside an entrance, and the people who pass it.
//!
//! ```text
//!     y = 4 m ◀── people of both directions, by a Poisson process ──▶ y = −4 m
//!   5 m ┆ ╲    ○→             ╱ ┆
//!       ┆   ╲        ←○○    ╱   ┆        cast: who comes when, how tall, with whom, with what bag
//!   1 m ┆     ╲   ○→      ╱     ┆        walk: where they are, frame by frame
//!             59° ╲     ╱                stack: a body as ellipses over each other
//!                   ◩ 1 m up             image: depths and whose each pixel is; flaws: what the camera adds
//! ```
//!
//! After Ukyo et al. (docs/bibliography.md, D): optics, height, rate and number of frames are theirs, and people come
//! as often as there. [`labels`] says which people a segment holds.

#[cfg(test)]
mod blind;
pub mod cast;
mod flaws;
pub mod gate;
pub mod image;
pub mod judge;
pub mod labels;
pub mod lasers;
pub mod live;
pub mod pacing;
pub mod soles;
pub mod stack;
pub mod tags;
pub mod walk;

use kehai_depth::background::{Background, FRAMES as LEARNING_FRAMES, Learner};
use kehai_depth::camera::Camera;
use kehai_depth::frame::Frame;

use crate::world::geometry::Point;
use flaws::Flaws;
use image::{Image, Whose};
use stack::Stack;
use walk::Walk;

/// The paper's camera: 59° across, 46° up and down, 1 m above the floor and level with it, 5 frames a second.
pub const CAMERA: Camera = Camera {
    width: 320,
    height: 240,
    fov_deg: 59.0,
    height_m: 1.0,
    pitch_deg: 0.0,
    frames_per_s: 5.0,
    above_m: None,
};

/// Frames of a run, as many as were labelled in the paper.
pub const FRAMES: usize = 851;

/// Share of a body's pixels that must be seen for the person to be judged: of less it cannot be told by eye either whose
/// it is, and the paper's labels were set by eye.
const JUDGED_SHARE: f64 = 0.25;

/// Depth up to which people are judged, m: where the camera's reach ends, half of a body still lies within it.
const JUDGED_M: f64 = 4.8;

/// A person in a frame.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Present {
    /// Number of the person in the run.
    pub person: u16,
    /// Middle of the body, m: x forward and y left of the camera.
    pub at: Point,
    /// Share of the body's pixels that nothing hides, of those within the image.
    pub share: f64,
    /// Whether a tracker is judged by this person in this frame.
    pub is_judged: bool,
}

/// A frame and its truth.
#[derive(Clone, PartialEq, Debug)]
pub struct Shot {
    /// What the camera hands out.
    pub frame: Frame,
    /// Whose each pixel is, row by row.
    pub whose: Vec<Whose>,
    /// The people within the image, at least by a pixel when nothing hides them.
    pub people: Vec<Present>,
}

/// A run: the same seed gives the same bytes.
#[derive(Clone, Debug)]
pub struct Entrance {
    walk: Walk,
    flaws: Flaws,
    empty: Image,
}

impl Entrance {
    /// The run of a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self::lasting(seed, FRAMES)
    }

    /// A run of so many frames.
    #[must_use]
    pub fn lasting(seed: u64, frames: usize) -> Self {
        Self { walk: Walk::lasting(seed, frames), flaws: Flaws::new(seed), empty: Image::empty() }
    }

    /// A run of so many frames with so many people who come in, walk up and down in view, and stay.
    #[must_use]
    pub fn pacing(people: u16, frames: usize) -> Self {
        Self { walk: Walk::pacing(people, frames), ..Self::lasting(1, 0) }
    }

    /// Where the people's soles are, drawn by a seed.
    #[must_use]
    pub fn soles(&self, seed: u64) -> soles::Soles {
        soles::Soles::new(&self.walk, seed)
    }

    /// What the camera sees without people.
    #[must_use]
    pub fn background(&self) -> Option<Background> {
        let mut learner = Learner::default();
        let still = |number: usize| self.flaws.frame(&self.empty, (FRAMES + number) as u64);
        (0..LEARNING_FRAMES).find_map(|number| learner.push(still(number)?))
    }

    /// The people at a time, s since the first frame.
    #[must_use]
    pub fn people_at(&self, at_s: f64) -> Vec<walk::Moment> {
        self.walk.at(at_s)
    }

    /// What the camera hands out at a time, as its frame of this number.
    pub(crate) fn frame_at(&self, at_s: f64, number: u64) -> Option<Frame> {
        let mut image = self.empty.clone();
        for walker in &self.people_at(at_s) {
            image.add(&Stack::person(walker), Whose::Person(walker.person));
            if let Some(bag) = Stack::bag(walker) {
                image.add(&bag, Whose::Bag);
            }
        }
        self.flaws.frame(&image, number)
    }

    /// A frame; None after the last.
    #[must_use]
    pub fn shot(&self, number: usize) -> Option<Shot> {
        let moment = self.walk.moment(number)?;
        let mut image = self.empty.clone();
        let mut alone = Vec::new();
        for walker in &moment {
            alone.push(image.add(&Stack::person(walker), Whose::Person(walker.person)));
            if let Some(bag) = Stack::bag(walker) {
                image.add(&bag, Whose::Bag);
            }
        }
        let people = moment.iter().zip(alone).filter_map(|(walker, alone)| {
            let seen = image.pixels(Whose::Person(walker.person));
            let share = seen as f64 / alone.max(1) as f64;
            let is_inside = walker.at.x > 0.3
                && walker.at.x < JUDGED_M
                && walker.at.y.abs() < walker.at.x * f64::from(CAMERA.fov_deg / 2.0).to_radians().tan();
            let is_judged = is_inside && share >= JUDGED_SHARE;
            (alone > 0).then_some(Present { person: walker.person, at: walker.at, share, is_judged })
        });
        let people = people.collect();
        Some(Shot { frame: self.flaws.frame(&image, number as u64)?, whose: image.whose, people })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_gives_the_same_frames_and_another_seed_others() {
        let shot = |seed| Entrance::new(seed).shot(100).unwrap();
        assert_eq!(shot(3), shot(3));
        assert_ne!(shot(3).frame, shot(4).frame);
        assert_eq!(Entrance::new(3).shot(FRAMES), None);
    }

    #[test]
    fn people_come_as_often_as_in_the_paper_and_at_most_five_are_in_view() {
        let (mut people, mut most) = (std::collections::BTreeMap::new(), [0; 6]);
        for seed in 0..4 {
            let entrance = Entrance::new(seed);
            for number in (0..FRAMES).step_by(2) {
                let shot = entrance.shot(number).unwrap();
                let judged: Vec<u16> =
                    shot.people.iter().filter(|one| one.is_judged).map(|one| one.person).collect();
                most[judged.len()] += 1;
                for person in &judged {
                    let at_once = people.entry((seed, *person)).or_insert(0);
                    *at_once = judged.len().max(*at_once);
                }
            }
        }
        // 32 people, or 40 by its tables, of which 6, 11, 14 and 9 saw at most one to four at a time.
        let each = people.len() / 4;
        let share =
            |at_once: usize| people.values().filter(|most| **most == at_once).count() * 100 / people.len();
        let shares = [share(1), share(2), share(3), share(4) + share(5)];
        assert!((28..=48).contains(&each), "{each} people a run, {shares:?} %, {most:?}");
        assert!(shares[0] < 30 && shares[1] > 15 && shares[2] > 15 && shares[3] > 10, "{shares:?} %, {each}");
    }
}
