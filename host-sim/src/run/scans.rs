//! What the sensors of a world measure, as recordings: the format that `kehai-sim replay` reads.
//!
//! ```text
//!   world ─▶ sensor, revolution by revolution ─▶ MODULE.csv      by hand: a real sensor's recording looks the same
//!               0 µs                     ≤ until
//! ```

use kehai::scan::GeometryParts;
use kehai_emulator::recording::{RecordedScan, Recording};
use kehai_emulator::source::{RangeSource, Revolution};

use crate::world::World;
use crate::world::sensor::WorldSensor;

/// The recordings of all sensors of `world` over its whole time, each with its module's name; all stamps are on one clock.
#[must_use]
pub fn scans(world: &World) -> Vec<(String, Recording)> {
    let until_us = (world.duration_s() * 1e6) as u64;
    world.sensors().iter().map(|(name, sensor)| (name.clone(), recording(sensor, until_us))).collect()
}

fn recording(sensor: &WorldSensor, until_us: u64) -> Recording {
    let (geometry, clock) = (sensor.geometry(), sensor.clock());
    let mm = |range_mm: u32| u16::try_from(range_mm).unwrap_or(u16::MAX);
    let starts_us = (clock.phase_us..until_us).step_by(clock.period_us.max(1) as usize);
    let scan = |start_us: u64| {
        let revolution = Revolution { start_us, period_us: clock.period_us, earliest_us: 0 };
        let ranges_mm = sensor.observe(revolution).0.ranges_mm;
        RecordedScan { stamp_us: start_us, ranges_mm: ranges_mm.into_iter().map(mm).collect() }
    };
    Recording {
        geometry: GeometryParts {
            first_step: geometry.first_step,
            last_step: geometry.last_step,
            cluster: 1,
            front_step: geometry.front_step,
            steps_per_turn: geometry.steps_per_turn,
            period_us: geometry.period_us,
            range_min_mm: mm(geometry.range_min_mm),
            range_max_mm: mm(geometry.range_max_mm),
        },
        scans: starts_us.map(scan).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::scene::Scene;
    use crate::world::variation::Variation;

    #[test]
    fn every_sensor_is_recorded_from_its_first_revolution_to_the_end() {
        let mut scene = Scene::load("hall").unwrap();
        scene.vary(&Variation { duration_s: Some(2), ..Variation::default() }).unwrap();
        let world = World::new(&scene, 1);
        let recordings = scans(&world);
        let names: Vec<&str> = recordings.iter().map(|(name, _)| name.as_str()).collect();
        let sensors: Vec<&str> = world.sensors().iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, sensors);
        for ((name, recording), (_, sensor)) in recordings.iter().zip(world.sensors()) {
            let (first, last) = (recording.scans.first().unwrap(), recording.scans.last().unwrap());
            assert_eq!(first.stamp_us, sensor.clock().phase_us, "{name}");
            assert!(last.stamp_us < 2_000_000 && last.stamp_us + 200_000 > 2_000_000, "{name}");
            let geometry = kehai::scan::Geometry::new(recording.geometry).unwrap();
            assert!(recording.scans.iter().all(|scan| scan.ranges_mm.len() == usize::from(geometry.beams())));
        }
    }
}
