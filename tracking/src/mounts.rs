//! The places at which modules can be mounted: along walls and in corners, facing into the room.
//!
//! ```text
//!   ◣───▽───▽───▽───◢      ▽ every 0.25 m of a piece of wall, on both of its sides, at a right angle to it
//!   ▷   0.05 m off  ◁      ◣ where two pieces meet, in both of the angles between them, along its bisector
//!   ▷               ◁      not on glass or mirrors, not across an entry, not where a mover sweeps
//! ```

use crate::geometry::{Point, Pose, distance_to_segment, inside, wrapped};
use crate::site::{Blocks, Site, Wall};

/// Between two places on a wall, m: a third of a person's width of difference in what is hidden.
const STEP_M: f64 = 0.25;

/// From the wall to the sensor's axis, m: half the width of the sensors of the table, 50 to 60 mm, and a bracket.
const OFF_M: f64 = 0.05;

/// Ends of walls nearer than this are one corner, m: drawn by hand, snapped to centimetres.
const SAME_M: f64 = 0.02;

/// Nothing is mounted so near to the line of an entry, m: people pass there.
const ENTRY_M: f64 = 0.1;

/// All places, in the order of the walls; of more than `most` along walls, fewer that are farther apart.
#[must_use]
pub fn mounts(site: &Site, most: f64) -> Vec<Pose> {
    let sides: Vec<(Point, Point)> = mountable(site);
    let length_m: f64 = sides.iter().map(|(from, to)| (*to - *from).length()).sum();
    let step_m = STEP_M.max(2.0 * length_m / most);
    let along = sides.iter().flat_map(|(from, to)| along(*from, *to, step_m));
    let all = along.chain(corners(&sides));
    all.filter(|pose| is_free(site, &sides, pose.at)).collect()
}

/// The pieces of wall that carry a module.
fn mountable(site: &Site) -> Vec<(Point, Point)> {
    let carries = |wall: &&Wall| wall.stops(Blocks::Beams) && !wall.mirror;
    let sides = site.walls.iter().filter(carries).flat_map(|wall| wall.sides());
    sides.filter(|(from, to)| (*to - *from).length() > SAME_M).collect()
}

/// The places on both sides of a piece of wall, without its ends.
fn along(from: Point, to: Point, step_m: f64) -> impl Iterator<Item = Pose> {
    let way = to - from;
    let length_m = way.length();
    let parts = (length_m / step_m).round().max(1.0) as u32;
    let left = way.left() * (1.0 / length_m);
    [left, left * -1.0].into_iter().flat_map(move |ahead| {
        (1..parts).map(move |part| {
            let at = from + way * (f64::from(part) / f64::from(parts)) + ahead * OFF_M;
            Pose { at, yaw_rad: ahead.angle_rad() }
        })
    })
}

/// The places in the corners: of all pieces that meet, between each and the next round.
fn corners(sides: &[(Point, Point)]) -> Vec<Pose> {
    let ends = sides.iter().flat_map(|(from, to)| [(*from, *to), (*to, *from)]);
    let mut met: Vec<(Point, Vec<f64>)> = Vec::new();
    for (at, other) in ends {
        let direction_rad = (other - at).angle_rad();
        match met.iter_mut().find(|(corner, _)| (*corner - at).length() < SAME_M) {
            Some((_, directions_rad)) => directions_rad.push(direction_rad),
            None => met.push((at, vec![direction_rad])),
        }
    }
    let mut all = Vec::new();
    for (at, mut directions_rad) in met.into_iter().filter(|(_, directions_rad)| directions_rad.len() > 1) {
        directions_rad.sort_by(f64::total_cmp);
        let next = directions_rad.iter().cycle().skip(1);
        for (one_rad, other_rad) in directions_rad.iter().zip(next) {
            let between_rad = wrapped(other_rad - one_rad).rem_euclid(std::f64::consts::TAU);
            let yaw_rad = wrapped(one_rad + 0.5 * between_rad);
            // As far from both walls as on one of them; in a narrow angle not without end.
            let off_m = OFF_M / libm::sin(0.5 * between_rad).max(0.25);
            all.push(Pose { at: at + Point::towards(yaw_rad) * off_m, yaw_rad });
        }
    }
    all
}

/// Whether a module can be there: beside all walls, outside of entries and movers.
fn is_free(site: &Site, sides: &[(Point, Point)], at: Point) -> bool {
    // Where a wall ends on the middle of another there is no corner of ends, and a step along the other may fall on it.
    let in_wall = sides.iter().any(|(from, to)| distance_to_segment(at, *from, *to) < 0.9 * OFF_M);
    let in_entry = site.entries.iter().any(|entry| {
        let (from, to) = entry.ends();
        distance_to_segment(at, from, to) < ENTRY_M
    });
    !in_wall && !in_entry && !site.movers.iter().any(|mover| inside(at, &mover.corners()))
}
