//! What befalls a module in the middle of a scene: somebody knocks it, takes it away from its place, or hangs a coat over it.
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

/// What happens.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Kind {
    /// It is turned to the left, by so many degrees.
    Turned(f64),
    /// It is moved, by x and y in the site, m.
    Moved(f64, f64),
    /// It is lifted by so much, m.
    Lifted(f64),
    /// Something is put over it.
    Covered,
}

/// What befalls which module, and when.
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
    /// Where the module is from then on.
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

    /// What stands before it from then on: a ring of cloth, in eight pieces.
    pub fn cover(&self, at: Point) -> impl Iterator<Item = Thing> + use<> {
        let covered = self.kind == Kind::Covered;
        let corner = move |number: u32| at + Point::towards(f64::from(number) * TAU / 8.0) * COVER_M;
        (0..8).filter(move |_| covered).map(move |number| {
            let outline = Outline::Segment(corner(number), corner(number + 1));
            Thing { outline, reflectance: 0.3, low_m: 0.0, high_m: 3.0, mirror: false }
        })
    }
}
