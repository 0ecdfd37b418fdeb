//! A camera over the entrance that reads the tags people wear, and says at which pixel.
//!
//! ```text
//!   people ─▶ floor::tags: hidden, found, lost ─▶ places ─(homography, inverted)─▶ pixels ─▶ signs
//! ```
//!
//! Two of three people wear tags. What is read is one more message each, as any other reader would send it.

use nalgebra::{Matrix3, Vector3};

use super::walk::Moment;
use crate::floor::tags::Camera;
use crate::world::geometry::Point;

/// Size of the image, pixels.
const IMAGE_PX: (f64, f64) = (640.0, 480.0);

/// What was read.
#[derive(Clone, PartialEq, Debug)]
pub struct Reading {
    /// On the tag.
    pub id: String,
    /// At which pixel.
    pub pixel: (f64, f64),
}

/// The camera.
#[derive(Clone, Debug)]
pub struct TagReader {
    camera: Camera,
    to_pixels: Matrix3<f64>,
}

/// What is on the tag of a person; every third has none.
#[must_use]
pub fn tag(person: u16) -> Option<String> {
    (person % 3 != 2).then(|| format!("04A22B{person:04X}"))
}

impl TagReader {
    /// A camera at this place of the plan, with the homography of its reader in the site; None if that has no inverse.
    #[must_use]
    pub fn new(at: Point, homography: &[f64; 9], seed: u64) -> Option<Self> {
        let to_pixels = Matrix3::from_row_slice(homography).try_inverse()?;
        Some(Self { camera: Camera::new(at, seed), to_pixels })
    }

    /// When it reads next, s.
    #[must_use]
    pub const fn next_s(&self) -> f64 {
        self.camera.next_s()
    }

    /// What it reads now; the next reading is due a period later.
    pub fn read(&mut self, people: &[Moment]) -> Vec<Reading> {
        let in_view: Vec<(u64, Point, Point)> = people
            .iter()
            .filter(|one| self.pixel(one.at).is_some())
            .map(|one| (u64::from(one.person), one.at, one.ahead))
            .collect();
        let read = self.camera.read(&in_view);
        let reading = |one: crate::floor::tags::Tag| {
            Some(Reading { id: tag(u16::try_from(one.id).ok()?)?, pixel: self.pixel(one.at)? })
        };
        read.into_iter().filter_map(reading).collect()
    }

    /// The pixel that shows a place of the floor; None beside the image.
    fn pixel(&self, at: Point) -> Option<(f64, f64)> {
        let seen = self.to_pixels * Vector3::new(at.x, at.y, 1.0);
        let (u, v) = (seen.x / seen.z, seen.y / seen.z);
        let is_inside = (0.0..IMAGE_PX.0).contains(&u) && (0.0..IMAGE_PX.1).contains(&v);
        is_inside.then_some((u, v))
    }
}
