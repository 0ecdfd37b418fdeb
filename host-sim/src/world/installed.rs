//! A site as it was installed: the tracker's site file is a little wrong, as every real one is.
//!
//! ```text
//!   the world         ┌──────┐      the site file    ┌─────┐ .    poses as calibration finds them
//!                     │  ╱   │                       │  ╱    .    walls up to 5 cm off
//!                     └── ───┘                       └── ──┘      one wall or one entry forgotten
//! ```
//!
//! Poses: the median error of the walk is 0.9 cm and 0.07° (docs/calibration.md), so a deviation of 0.8 cm in each
//! axis and 0.1°.

use super::random::{Purpose, Stream};
use super::site::Site;

/// Deviation of a pose, m in each axis, and degrees.
const POSE_M: f64 = 0.008;
const POSE_DEG: f64 = 0.1;

/// How far each end of a wall, and of an entry, is off at most, m in each axis.
const WALL_M: f64 = 0.05;

/// Share of the sites whose zones are not said to be enclosed.
const OPEN_SHARE: f64 = 0.3;

/// The site of the world as the tracker's file has it, under `seed`.
#[must_use]
pub fn installed(site: &Site, seed: u64) -> Site {
    let mut stream = Stream::new(seed, Purpose::Installed, [0, 0]);
    let mut file = site.clone();
    for module in &mut file.modules {
        module.x += POSE_M * stream.normal();
        module.y += POSE_M * stream.normal();
        module.yaw_deg += POSE_DEG * stream.normal();
    }
    let mut off =
        |point: &mut [f64; 2]| point.iter_mut().for_each(|axis| *axis += stream.between(-WALL_M, WALL_M));
    file.walls.iter_mut().flat_map(|wall| wall.points.iter_mut()).for_each(&mut off);
    file.entries.iter_mut().flat_map(|entry| entry.line.iter_mut()).for_each(&mut off);
    let things = file.walls.len() + file.entries.len();
    if things > 0 {
        let forgotten = ((stream.uniform() * things as f64) as usize).min(things - 1);
        match forgotten.checked_sub(file.walls.len()) {
            None => drop(file.walls.remove(forgotten)),
            Some(entry) => drop(file.entries.remove(entry)),
        }
    }
    if stream.chance(OPEN_SHARE) {
        file.zones.iter_mut().for_each(|zone| zone.enclosed = false);
    }
    file
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::scene::Scene;

    #[test]
    fn every_site_is_a_little_wrong_and_lacks_one_thing() {
        let site = Scene::load("door-area").unwrap().site;
        let things = |site: &Site| site.walls.len() + site.entries.len();
        let mut open = 0;
        for seed in 0..50 {
            let file = installed(&site, seed);
            assert_eq!(file, installed(&site, seed));
            assert_eq!(things(&file) + 1, things(&site), "seed {seed}");
            for (one, other) in file.modules.iter().zip(&site.modules) {
                assert!((one.x - other.x).hypot(one.y - other.y) < 0.06 && one.x != other.x);
            }
            assert!(file.check().is_ok(), "seed {seed}: {:?}", file.check());
            open += usize::from(file.zones.iter().all(|zone| !zone.enclosed));
        }
        assert!((5..30).contains(&open), "{open}");
    }
}
