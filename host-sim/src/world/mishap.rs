//! Faults of a device in the middle of a scene: it is knocked, moved from its place, or covered by a coat.
//!
//! ```text
//!   turned        lifted         covered
//!    ╲│╱   ╱      │╱ ▲           (│╱)   a ring of cloth around it, nearer than any wall
//!     ● ─▶ ●╲     ●  │ height     ●
//! ```

use super::geometry::{Outline, Point, Pose};
use super::raycast::Thing;
use std::f64::consts::TAU;

/// Radius of what hides a covered module, m.
const COVER_M: f64 = 0.12;

/// The kind of fault.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Kind {
    /// It is turned to the left, by so many degrees.
    Turned(f64),
    /// It is moved, by x and y in the site, m.
    Moved(f64, f64),
    /// It is lifted by so much, m.
    Lifted(f64),
    /// It is covered.
    Covered,
}

/// A fault of one device, and its time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Mishap {
    /// Number of the module in the site.
    pub module: usize,
    /// When, s.
    pub from_s: f64,
    /// What.
    pub kind: Kind,
}

impl Mishap {
    /// The pose of the device from then on.
    #[must_use]
    pub fn place(&self, pose: Pose, height_m: f64) -> (Pose, f64) {
        match self.kind {
            Kind::Turned(degrees) => {
                (Pose { yaw_rad: pose.yaw_rad + degrees.to_radians(), ..pose }, height_m)
            }
            Kind::Moved(x, y) => (Pose { at: pose.at + Point::new(x, y), ..pose }, height_m),
            Kind::Lifted(by_m) => (pose, height_m + by_m),
            Kind::Covered => (pose, height_m),
        }
    }

    /// The cover: a ring of cloth around the device, in eight pieces.
    pub fn cover(&self, at: Point) -> impl Iterator<Item = Thing> + use<> {
        let covered = self.kind == Kind::Covered;
        let corner = move |number: u32| at + Point::towards(f64::from(number) * TAU / 8.0) * COVER_M;
        (0..8).filter(move |_| covered).map(move |number| {
            let outline = Outline::Segment(corner(number), corner(number + 1));
            Thing { outline, reflectance: 0.3, low_m: 0.0, high_m: 3.0, mirror: false }
        })
    }
}
