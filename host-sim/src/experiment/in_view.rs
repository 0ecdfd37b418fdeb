//! How many beams met each person, in recordings whose truth does not say it.
//!
//! ```text
//!   recording ─▶ background: median of each beam's empty scans ─▶ hits before it ─┐
//!   pose of the sensor ──────────────────────────────────────────────────────────┴▶ points of the floor
//!         · ·· ·                    a point within BODY_M of a person is on
//!        ( A ) ·· ( B )             the nearest one: 3 beams on A, 4 on B
//! ```
//!
//! What [`crate::run`] counts in our own world by asking which body a ray met, this counts from where rays ended: the most
//! beams that met a person in one scan of one sensor within the last 0.2 s.

use kehai::scan::{Geometry, GeometryError};
use kehai_emulator::recording::{RecordedScan, Recording};
use kehai_tracking::geometry::{Point, Pose};

use crate::run::SIGHT_US;
use crate::score::statistics::median;

/// A body ends within so far of its middle, m: half the shoulders of a broad person, 0.25 m, and a hand beside them.
const BODY_M: f64 = 0.35;

/// A hit is before the background if it is so much nearer, mm: three times a sensor's noise of 30 mm.
const BEFORE_MM: f64 = 90.0;

/// A scan's hits on what was not there when the room was empty, in the site, m.
struct Hits {
    stamp_us: u64,
    points: Vec<Point>,
}

/// The hits of all sensors, scan by scan.
#[derive(Default)]
pub struct Rays {
    /// In the order of their stamps.
    scans: Vec<Hits>,
}

impl Rays {
    /// Adds a recording of an upright sensor at `pose`, of which the first `empty` scans show the empty room.
    ///
    /// # Errors
    /// The recording's geometry is none of a sensor.
    pub fn add(&mut self, recording: &Recording, pose: Pose, empty: usize) -> Result<(), GeometryError> {
        let geometry = Geometry::new(recording.geometry)?;
        let directions: Vec<Point> = (0..geometry.beams())
            .map(|beam| Point::towards(f64::from(geometry.bearing_rad(beam)) + pose.yaw_rad))
            .collect();
        let range_mm = |value_mm: &u16| geometry.reading(*value_mm).range_mm().map(f64::from);
        let background_mm: Vec<f64> = (0..directions.len())
            .map(|beam| {
                let scans = recording.scans.iter().take(empty);
                let ranges: Vec<f64> = scans.filter_map(|scan| range_mm(scan.ranges_mm.get(beam)?)).collect();
                median(&ranges).unwrap_or(f64::INFINITY)
            })
            .collect();
        let hits = |scan: &RecordedScan| {
            let beams = scan.ranges_mm.iter().zip(&directions).zip(&background_mm);
            let hit = |((value_mm, direction), background_mm): ((&u16, &Point), &f64)| {
                let range_mm = range_mm(value_mm)?;
                (range_mm + BEFORE_MM < *background_mm).then(|| pose.at + *direction * (range_mm * 1e-3))
            };
            Hits { stamp_us: scan.stamp_us, points: beams.filter_map(hit).collect() }
        };
        self.scans.extend(recording.scans.iter().map(hits));
        self.scans.sort_by_key(|scan| scan.stamp_us);
        Ok(())
    }

    /// The most beams on each of these people in one scan of the last 0.2 s before `at_us`, on the recordings' clock.
    pub fn beams(&self, at_us: u64, people: &[Point]) -> Vec<u32> {
        let end = self.scans.partition_point(|scan| scan.stamp_us <= at_us);
        let begin = self.scans.partition_point(|scan| scan.stamp_us < at_us.saturating_sub(SIGHT_US));
        let mut most = vec![0; people.len()];
        for scan in self.scans.get(begin..end).unwrap_or_default() {
            let mut beams = vec![0; people.len()];
            for point in &scan.points {
                let distances = people.iter().map(|at| (*at - *point).length()).enumerate();
                if let Some((person, distance_m)) = distances.min_by(|one, other| one.1.total_cmp(&other.1))
                    && distance_m <= BODY_M
                {
                    beams[person] += 1;
                }
            }
            for (most, beams) in most.iter_mut().zip(beams) {
                *most = beams.max(*most);
            }
        }
        most
    }
}

#[cfg(test)]
mod tests {
    use kehai::scan::URG_04LX;

    use super::*;

    /// An empty room 3 m deep, then `near` beams around the front that end at 1.5 m and `far` more to their left at 2.2 m.
    fn rays(near: usize, far: usize) -> Rays {
        let geometry = Geometry::new(URG_04LX).unwrap();
        let front = usize::from(geometry.beam(geometry.parts().front_step));
        let empty = vec![3000; usize::from(geometry.beams())];
        let mut seen = empty.clone();
        seen[front..front + near].fill(1500);
        seen[front + near..front + near + far].fill(2200);
        let scan = |stamp_us, ranges_mm: &Vec<u16>| RecordedScan { stamp_us, ranges_mm: ranges_mm.clone() };
        let scans = vec![scan(0, &empty), scan(100_000, &empty), scan(200_000, &seen)];
        let pose = Pose { at: Point::new(1.0, 0.0), yaw_rad: core::f64::consts::FRAC_PI_2 };
        let mut rays = Rays::default();
        rays.add(&Recording { geometry: URG_04LX, scans }, pose, 2).unwrap();
        rays
    }

    #[test]
    fn beams_are_counted_on_the_person_whose_middle_is_nearest() {
        let people = [Point::new(1.0, 1.6), Point::new(0.9, 2.3), Point::new(-2.0, 1.0)];
        assert_eq!(rays(12, 7).beams(250_000, &people), [12, 7, 0]);
    }

    #[test]
    fn a_scan_of_before_counts_for_a_fifth_of_a_second_and_a_later_one_never() {
        let (rays, people) = (rays(12, 0), [Point::new(1.0, 1.6)]);
        let at = |at_us| rays.beams(at_us, &people)[0];
        assert_eq!([at(199_999), at(200_000), at(400_000), at(400_001)], [0, 12, 12, 0]);
    }

    #[test]
    fn points_of_the_empty_room_and_far_from_all_people_are_on_no_person() {
        assert_eq!(rays(0, 0).beams(250_000, &[Point::new(1.0, 2.9)]), [0]);
        assert_eq!(rays(12, 0).beams(250_000, &[Point::new(1.0, 1.9)]), [0]);
        assert!(rays(12, 0).beams(250_000, &[]).is_empty());
    }
}
