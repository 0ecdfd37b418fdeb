//! What a scan shows of the walker: no person, one person, or several. One person gives a range-bearing measurement.
//!
//! ```text
//!   ╭──╮  wide and moving: a person      ○ ○  two narrow ones a stride apart: legs, a person
//!   ▔▔▔▔  stands for three seconds: a thing, which stops no calibration
//!
//!   ▪▪  ·                         a floor: feet within a step are one person's; `steps` says where that is, some time later
//!       ·  ▪▪
//! ```

use kehai::candidate::Candidate;

use super::steps::{Middle, Shows};
use super::walk::{By, Glimpse, Scan, Walk};
use crate::floor::Reading;
use crate::geometry::Point;
use crate::observation::{Detection, Observation};

/// A candidate that has stood for so long is furniture, 0.1 s.
const STILL_DS: u16 = 30;

/// Chord of a person, m: from the narrowest torso to one with arms away from it.
const PERSON_M: (f64, f64) = (0.18, 0.75);

/// Two legs are no farther apart, m: a long stride.
const STRIDE_M: f64 = 0.45;

/// How far the middle of two feet in a row is from the middle of a walker, m, one sigma along each axis, as if each slot of the
/// way between had a step of its own: 4 cm by how feet are set, and about five slots are one step.
const FEET_M: f64 = 0.1;

/// The same of a person who stands, turns or sets out, whose body is anywhere between the feet.
const STANCE_M: f64 = 0.25;

impl Walk {
    /// Takes what a module saw in one scan.
    pub fn observe(&mut self, observation: &Observation) {
        let module = observation.view.module;
        self.extend(module, observation.start_s, look(observation, module));
    }

    /// Takes a reading of a floor, which is the module of this number.
    pub fn read(&mut self, module: usize, reading: &Reading) {
        let mut middles = Vec::new();
        let scan = match self.step(module, reading, &mut middles) {
            Shows::Nobody => Scan::Nobody,
            Shows::One => Scan::Later,
            Shows::Several => Scan::Several,
        };
        self.extend(module, reading.at_s, scan);
        for Middle { at, at_s, walks } in middles {
            let sigma_m = if walks { FEET_M } else { STANCE_M };
            self.add(Glimpse {
                module,
                by: By::Panels,
                at_s,
                range_m: at.length(),
                bearing_rad: at.angle_rad(),
                radial_m: sigma_m,
                tangential_m: sigma_m,
            });
        }
    }
}

/// The people that a scan shows.
fn look(observation: &Observation, module: usize) -> Scan {
    let moving = |seen: &&Detection| seen.candidate.static_ds < STILL_DS;
    let (narrow, wide): (Vec<&Detection>, Vec<&Detection>) =
        observation.detections.iter().filter(moving).partition(|seen| seen.width_m < PERSON_M.0);
    let people: Vec<&&Detection> = wide.iter().filter(|seen| seen.width_m <= PERSON_M.1).collect();
    if people.len() < wide.len() || people.len() > 1 {
        return Scan::Several;
    }
    if let Some(person) = people.first() {
        return Scan::One(glimpse(observation, module, person));
    }
    match narrow[..] {
        [one, other] if (one.centre - other.centre).norm() < STRIDE_M => {
            let (one, other) = (glimpse(observation, module, one), glimpse(observation, module, other));
            let middle = (one.place() + other.place()) * 0.5;
            Scan::One(Glimpse {
                at_s: 0.5 * (one.at_s + other.at_s),
                range_m: middle.length(),
                bearing_rad: middle.angle_rad(),
                ..one
            })
        }
        _ => Scan::Nobody,
    }
}

fn glimpse(observation: &Observation, module: usize, seen: &Detection) -> Glimpse {
    let pose = &observation.view.pose;
    let local = pose.to_sensor(Point::new(seen.centre.x, seen.centre.y));
    let ray = Point::towards(pose.yaw_rad + local.angle_rad());
    let along = |direction: Point| {
        let vector = nalgebra::Vector2::new(direction.x, direction.y);
        (vector.transpose() * seen.covariance * vector)[(0, 0)].max(1e-6).sqrt()
    };
    Glimpse {
        module,
        by: By::Beams,
        at_s: seen.at_s,
        range_m: local.length(),
        bearing_rad: local.angle_rad(),
        radial_m: along(ray),
        tangential_m: along(ray.left()),
    }
}

/// Whether a candidate can be a person by what it does: it has moved lately.
#[must_use]
pub fn moves(candidate: &Candidate) -> bool {
    candidate.static_ds < STILL_DS
}
