//! Walks made up here: a walker whose centre is off by a body's shape, seen by modules at known places.

mod floors;
mod hangs;
mod rooms;
mod sessions;
mod walks;

use super::walk::{By, Glimpse, Walk};
use super::*;
use crate::geometry::{Point, wrapped};

const POSES: [(f64, f64, f64); 3] = [(0.0, 0.0, 0.3), (4.0, 1.0, 2.8), (2.0, 4.0, -1.5)];

fn poses() -> Vec<Pose> {
    POSES.iter().map(|&(x, y, yaw_rad)| Pose { at: Point::new(x, y), yaw_rad }).collect()
}

/// Numbers that look random: 0 to 1.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// About normal, one σ.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.next()).sum::<f64>() - 6.0
    }
}

/// Where the walker is: a wide figure of eight.
fn walker(at_s: f64) -> (Point, Point) {
    let place =
        |at_s: f64| Point::new(2.0 + 1.3 * libm::sin(0.7 * at_s), 1.8 + 1.1 * libm::sin(0.43 * at_s + 0.5));
    let velocity = (place(at_s + 0.01) - place(at_s - 0.01)) * 50.0;
    (place(at_s), velocity)
}

/// A walk of so long, seen with this noise; clocks are late by a few milliseconds; `off_m` is what a body does.
fn walk(seconds: u32, noise_m: f64, off_m: f64, seed: u64) -> Walk {
    let mut numbers = Numbers(seed);
    let mut walk = Walk::new(POSES.len());
    for scan in 0..seconds * 10 {
        for (module, pose) in poses().iter().enumerate() {
            let true_s = f64::from(scan) * 0.1 + 0.03 * module as f64;
            let (at, velocity) = walker(true_s);
            let local = pose.to_sensor(at);
            let along = Point::towards(pose.yaw_rad + local.angle_rad());
            let heading = velocity * (1.0 / velocity.length().max(1e-9));
            let cosine = -heading.dot(along);
            let range_m = local.length() + off_m * cosine * cosine + noise_m * numbers.normal();
            let bearing_rad = local.angle_rad() + noise_m * numbers.normal() / local.length();
            let at_s = true_s + 0.005 * module as f64;
            walk.add(seen(module, at_s, (range_m, bearing_rad)));
        }
    }
    walk
}

/// A body that a module saw by its beams, at this range, m, and bearing, rad.
fn seen(module: usize, at_s: f64, (range_m, bearing_rad): (f64, f64)) -> Glimpse {
    Glimpse { module, by: By::Beams, at_s, range_m, bearing_rad, radial_m: 0.04, tangential_m: 0.03 }
}

fn errors(calibration: &Calibration) -> Vec<(f64, f64)> {
    let error = |(placed, truth): (&Placed, Pose)| {
        ((placed.pose.at - truth.at).length(), wrapped(placed.pose.yaw_rad - truth.yaw_rad).abs())
    };
    calibration.modules.iter().zip(poses()).map(error).collect()
}
