//! A person of the world: body, trajectory, and what the body does on the way.

use super::body::Body;
use super::motion::Motion;
use super::shape::{Gesture, Gestures};

/// A person of the world.
#[derive(Clone, Debug)]
pub struct Person {
    /// Name in truth; unique.
    pub name: String,
    /// Size and clothes.
    pub body: Body,
    /// Trajectory.
    pub motion: Motion,
    /// The time during which the person crouches.
    pub crouches_s: Option<[f64; 2]>,
    /// What the arms do, if the body's shape has arms of its own.
    pub gestures: Option<Gestures>,
    /// When an arm reaches over a table.
    pub reaches_s: Vec<[f64; 2]>,
}

impl Person {
    /// Their body at `time_s`.
    #[must_use]
    pub fn body_at(&self, time_s: f64) -> Body {
        match self.crouches_s {
            Some([from_s, until_s]) if (from_s..until_s).contains(&time_s) => self.body.crouching(),
            _ if self.reaches_s.iter().any(|[from_s, until_s]| (*from_s..*until_s).contains(&time_s)) => {
                self.body.at(Gesture::Reach)
            }
            _ => self.gestures.map_or(self.body, |gestures| self.body.at(gestures.at(time_s))),
        }
    }
}
