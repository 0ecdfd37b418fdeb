//! How far each beam of a module saw nothing, as `sensor_msgs/msg/LaserScan`: the free space.
//!
//! ```text
//!   beams, right to left   ·  ·  ·  ·  ·  ·
//!   empty range, m        4.1 4.1 1.8  ?  4.0      ?: nothing is known, NaN
//! ```
//!
//! A beam ends at a body, at the learned background, or where it is open: as far as anything was ever seen there. So the space before
//! an end is free, and not each end is a wall.
//!
//! Source: `sensor_msgs/msg/LaserScan`; REP-117: NaN where a reading is invalid.

use super::messages::{Header, LaserScan};
use super::names::module_frame;
use crate::scans::Scan;

const NS_PER_S: f64 = 1e9;

const MM_PER_M: f32 = 1000.0;

/// Its message, of a tracker whose clock stood at 0 at `begun_ns`, since 1970; `part` is the module's part of names.
pub fn laser_scan(scan: &Scan, part: &str, begun_ns: u64) -> LaserScan {
    let (view, geometry) = (&scan.view, &scan.view.geometry);
    // When a beam passed; of a module that hangs head down the first is the last.
    let first_s = view.delay_s(0);
    let at_ns = begun_ns.saturating_add(((scan.start_s + first_s) * NS_PER_S) as u64);
    let range_m = |&mm: &u16| if mm == 0 { f32::NAN } else { f32::from(mm) / MM_PER_M };
    LaserScan {
        header: Header::new(&module_frame(part), at_ns),
        angle_min: geometry.bearing_rad(0),
        angle_max: geometry.bearing_rad(geometry.beams().saturating_sub(1)),
        angle_increment: geometry.beam_rad(),
        time_increment: (view.delay_s(1) - first_s) as f32,
        scan_time: geometry.period_us() as f32 * 1e-6,
        range_min: f32::from(geometry.range_min_mm()) / MM_PER_M,
        range_max: f32::from(geometry.range_max_mm()) / MM_PER_M,
        ranges: scan.empty_mm.iter().map(range_m).collect(),
        intensities: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::TAU;
    use std::sync::Arc;

    use super::*;
    use kehai::scan::{Geometry, GeometryParts};
    use kehai_tracking::geometry::{Point, Pose};
    use kehai_tracking::observation::View;

    fn scan(upside_down: bool) -> Scan {
        let geometry = Geometry::new(GeometryParts {
            first_step: 44,
            last_step: 725,
            cluster: 1,
            front_step: 384,
            steps_per_turn: 1024,
            period_us: 102_400,
            range_min_mm: 20,
            range_max_mm: 5600,
        });
        let pose = Pose { at: Point::new(0.0, 0.0), yaw_rad: 0.0 };
        let view = View { module: 0, pose, height_m: 1.0, geometry: geometry.unwrap(), upside_down };
        let mut empty_mm = vec![4000; 682];
        (empty_mm[1], empty_mm[2]) = (0, 1500);
        Scan { module: "left".into(), start_s: 2.5, view: Arc::new(view), empty_mm }
    }

    #[test]
    fn beams_go_from_right_to_left_and_what_is_not_known_is_no_number() {
        let said = laser_scan(&scan(false), "left_1", 1_000_000_000);
        assert_eq!(said.header.frame_id, "kehai/left_1");
        assert!((said.angle_min + 340.0 * TAU / 1024.0).abs() < 1e-5, "{}", said.angle_min);
        let last = said.angle_min + 681.0 * said.angle_increment;
        assert!((said.angle_max - last).abs() < 1e-4, "{} {last}", said.angle_max);
        assert_eq!((said.range_min, said.range_max, said.ranges.len()), (0.02, 5.6, 682));
        assert!(said.ranges[1].is_nan());
        assert_eq!((said.ranges[0], said.ranges[2]), (4.0, 1.5));
        // Step 44 of 1024 passes 4.4 ms after step 0.
        assert_eq!((said.header.stamp.sec, said.header.stamp.nanosec / 1000), (3, 504_400));
        assert!((said.time_increment - 1e-4).abs() < 1e-8 && (said.scan_time - 0.1024).abs() < 1e-7);
    }

    #[test]
    fn head_down_the_mirror_turns_the_other_way() {
        let said = laser_scan(&scan(true), "left", 0);
        assert!((said.time_increment + 1e-4).abs() < 1e-8, "{}", said.time_increment);
    }
}
