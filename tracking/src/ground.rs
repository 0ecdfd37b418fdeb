//! What modules see of the empty zones: by one, from two sides, by none; and where one more would help most.
//!
//! ```text
//!        \ 1 | 0 /        directions from a cell in sixths of the circle: seen from two sides are cells with modules in two
//!       2 ── · ── 5       of them. Two modules side by side look past the same people and count once; the farther apart
//!        / 3 | 4 \        they are, as seen from the cells, the more cells are seen from two sides
//!
//!   backgrounds that modules have learned ─▶ cells seen ─┬▶ shares, blind spots
//!   places along walls ─▶ what one more module would see ┴▶ the place that adds most
//! ```
//!
//! Of a module that is there its own background says what it sees, furniture and all; of one that is not, the walls of the site.
//! With people about less is seen: `kehai-sim plan` says how much.

use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::explain::glance::Glance;
use crate::geometry::{Point, Pose, bounds, inside};
use crate::mounts::mounts;
use crate::observation::View;
use crate::site::{Blocks, Site, Wall, Zone};

/// Sides from which a cell is seen: sixths of the circle.
pub const SIDES: usize = 6;

/// What a cell is worth, behind one crowd: seen from one side, and what a second side adds. A person who is not seen is missing
/// from the count, one seen from one side may be merged with another: two modules in `host-sim/sites/office.toml` that see 89 % and
/// 15 % from two sides counted six people right 88 % of the time, two that see 73 and 45 % 19 % of it.
pub const ONE: u64 = 4;
/// See [`ONE`].
pub const TWO: u64 = 1;

/// Side of a cell, m: that of the coverage which calibration prints.
const CELL_M: f64 = 0.25;

/// Most cells: 500 m²; a larger site has larger cells.
const CELLS_MAX: f64 = 8000.0;

/// Most places on walls that are tried for one more module.
const PLACES_MAX: f64 = 600.0;

/// Blind spots that are listed, the largest first.
const SPOTS_MAX: usize = 20;

/// A blind spot that is smaller is none, m²: half a body, 0.45 × 0.28 m.
const SPOT_M2: f64 = 0.0625;

/// Coverage of the zones that count, of all if none does.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Ground {
    /// Side of a cell, m.
    pub cell_m: f64,
    /// Middle of each cell, and what sees it: 0 nothing, 1 one module or several on one side, 2 modules on two sides.
    pub cells: Vec<(f64, f64, u8)>,
    /// All zones together.
    pub all: Share,
    /// Each zone.
    pub zones: Vec<Share>,
    /// What no module sees, the largest first.
    pub blind: Vec<Spot>,
    /// Where one more module would help most; none where it would not, or no module is heard whose like it could be.
    pub next: Option<Next>,
}

/// How much of a zone is seen.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Share {
    /// Its name; of all together empty.
    pub zone: String,
    /// Its area, m².
    pub m2: f64,
    /// Share seen by at least one module.
    pub one: f64,
    /// Share seen from two sides.
    pub two: f64,
    /// What no module sees, m².
    pub blind_m2: f64,
}

/// A connected part of a zone that no module sees.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Spot {
    /// The zone.
    pub zone: String,
    /// A cell near its middle.
    pub at: [f64; 2],
    /// Its area, m².
    pub m2: f64,
}

/// Where one more module would help most.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Next {
    /// Its place.
    pub x: f64,
    /// Its place.
    pub y: f64,
    /// Where its front points.
    pub yaw_deg: f64,
    /// Share that would be seen by at least one module then.
    pub one: f64,
    /// Share that would be seen from two sides.
    pub two: f64,
}

/// A cell of a zone.
#[derive(Clone, Copy, Debug)]
struct Cell {
    at: Point,
    place: (i32, i32),
    zone: usize,
    /// The sides from which it is seen, a bit each.
    sides: u8,
}

/// The coverage of a site, by the newest scan of each module.
#[must_use]
pub fn ground(site: &Site, glances: &[Glance]) -> Ground {
    let zones = zones(site);
    let (cell_m, mut cells) = cells(&zones);
    for cell in &mut cells {
        let seers = glances.iter().filter(|glance| glance.sees_empty(cell.at));
        cell.sides = seers.fold(0, |sides, glance| sides | 1 << side(cell.at, glance.view.pose.at));
    }
    let m2 = cell_m * cell_m;
    let share =
        |name: &str, own: &dyn Fn(&Cell) -> bool| share(name, cells.iter().filter(|cell| own(cell)), m2);
    Ground {
        cell_m,
        cells: cells
            .iter()
            .map(|cell| (hundredth(cell.at.x), hundredth(cell.at.y), seen(cell.sides)))
            .collect(),
        all: share("", &|_| true),
        zones: zones
            .iter()
            .enumerate()
            .map(|(number, zone)| share(&zone.name, &|cell| cell.zone == number))
            .collect(),
        blind: spots(&cells, &zones, m2),
        next: glances.first().and_then(|like| next(site, &cells, &like.view)),
    }
}

/// The zones that matter: those that count, or all of them if none does.
fn zones(site: &Site) -> Vec<&Zone> {
    let counting: Vec<&Zone> = site.zones.iter().filter(|zone| zone.count).collect();
    if counting.is_empty() { site.zones.iter().collect() } else { counting }
}

/// The cells in the zones; one in two of them belongs to the first.
fn cells(zones: &[&Zone]) -> (f64, Vec<Cell>) {
    let corners: Vec<Vec<Point>> = zones.iter().map(|zone| zone.corners()).collect();
    let Some((low, high)) = bounds(corners.iter().flatten().copied()) else { return (CELL_M, Vec::new()) };
    let size = high - low;
    let cell_m = CELL_M.max((size.x * size.y / CELLS_MAX).sqrt());
    let (columns, rows) = ((size.x / cell_m).ceil() as i32, (size.y / cell_m).ceil() as i32);
    let places = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
    let cell = |place: (i32, i32)| {
        let at = low + Point::new(f64::from(place.0) + 0.5, f64::from(place.1) + 0.5) * cell_m;
        let zone = corners.iter().position(|polygon| inside(at, polygon))?;
        Some(Cell { at, place, zone, sides: 0 })
    };
    (cell_m, places.filter_map(cell).collect())
}

/// On which side of a cell a module is.
#[must_use]
pub fn side(cell: Point, module: Point) -> usize {
    let turn = (module - cell).angle_rad() / TAU;
    ((turn.rem_euclid(1.0) * SIDES as f64) as usize).min(SIDES - 1)
}

/// 0, 1, or 2 for two sides and more.
fn seen(sides: u8) -> u8 {
    sides.count_ones().min(2) as u8
}

fn share<'a>(name: &str, own: impl Iterator<Item = &'a Cell>, m2: f64) -> Share {
    let mut counts = [0_u32; 3];
    own.for_each(|cell| counts[usize::from(seen(cell.sides))] += 1);
    let [none, one, two] = counts.map(f64::from);
    let all = (none + one + two).max(1.0);
    Share {
        zone: name.to_owned(),
        m2: hundredth((none + one + two) * m2),
        one: thousandth((one + two) / all),
        two: thousandth(two / all),
        blind_m2: hundredth(none * m2),
    }
}

/// Cells that nothing sees and that touch each other, in one zone.
fn spots(cells: &[Cell], zones: &[&Zone], m2: f64) -> Vec<Spot> {
    let number: std::collections::HashMap<(i32, i32), usize> = (0..)
        .zip(cells)
        .filter(|(_, cell)| cell.sides == 0)
        .map(|(number, cell)| (cell.place, number))
        .collect();
    let mut taken = vec![false; cells.len()];
    let mut spots = Vec::new();
    for (first, zone) in
        cells.iter().enumerate().filter(|(_, cell)| cell.sides == 0).map(|(n, cell)| (n, cell.zone))
    {
        let (mut open, mut own) = (vec![first], Vec::new());
        while let Some((cell, is_taken)) =
            open.pop().and_then(|next| cells.get(next).zip(taken.get_mut(next)))
        {
            if cell.zone != zone || std::mem::replace(is_taken, true) {
                continue;
            }
            own.push(cell.at);
            let (x, y) = cell.place;
            open.extend(
                [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)].iter().filter_map(|at| number.get(at)),
            );
        }
        if own.len() as f64 * m2 < SPOT_M2 {
            continue;
        }
        let middle = own.iter().fold(Point::default(), |sum, at| sum + *at) * (1.0 / own.len() as f64);
        let far_m = |at: &&Point| (**at - middle).length();
        let at =
            own.iter().min_by(|one, other| far_m(one).total_cmp(&far_m(other))).copied().unwrap_or(middle);
        let name = zones.get(zone).map_or_else(String::new, |zone| zone.name.clone());
        spots.push(Spot {
            zone: name,
            at: [hundredth(at.x), hundredth(at.y)],
            m2: hundredth(own.len() as f64 * m2),
        });
    }
    spots.sort_by(|one, other| other.m2.total_cmp(&one.m2));
    spots.truncate(SPOTS_MAX);
    spots
}

/// The place on a wall from which one more module like this one adds most.
fn next(site: &Site, cells: &[Cell], like: &View) -> Option<Next> {
    let stops = |wall: &&Wall| wall.stops(Blocks::Beams);
    let walls: Vec<(Point, Point)> = site.walls.iter().filter(stops).flat_map(Wall::sides).collect();
    let look = |pose: Pose| {
        let view = View { pose, ..like.clone() };
        let far_m = ranges_m(&view, &walls);
        let sees = |cell: &Cell| {
            let (distance_m, beam) = view.beam_at(cell.at);
            beam.and_then(|beam| far_m.get(usize::from(beam))).is_some_and(|far_m| distance_m < *far_m)
        };
        let with =
            |cell: &Cell| if sees(cell) { cell.sides | 1 << side(cell.at, pose.at) } else { cell.sides };
        cells.iter().map(with).collect::<Vec<u8>>()
    };
    let worth = |sides: &[u8]| -> u64 {
        sides.iter().map(|sides| [0, ONE, ONE + TWO][usize::from(seen(*sides))]).sum()
    };
    let now = worth(&cells.iter().map(|cell| cell.sides).collect::<Vec<u8>>());
    let places = mounts(site, PLACES_MAX).into_iter().map(|pose| (pose, look(pose)));
    // Of equal ones the first, on every machine.
    let best = places.min_by_key(|(_, sides)| std::cmp::Reverse(worth(sides)));
    let (pose, sides) = best.filter(|(_, sides)| worth(sides) > now)?;
    let share = |least: u8| {
        let count = sides.iter().filter(|sides| seen(**sides) >= least).count();
        thousandth(count as f64 / sides.len().max(1) as f64)
    };
    let yaw_deg = (pose.yaw_rad.to_degrees() * 10.0).round() / 10.0;
    Some(Next { x: hundredth(pose.at.x), y: hundredth(pose.at.y), yaw_deg, one: share(1), two: share(2) })
}

/// How far each beam goes until it meets a wall, m.
fn ranges_m(view: &View, walls: &[(Point, Point)]) -> Vec<f64> {
    let range_max_m = f64::from(view.geometry.parts().range_max_mm) * 1e-3;
    let beam = |beam: u16| {
        let ahead = Point::towards(view.pose.yaw_rad + f64::from(view.geometry.bearing_rad(beam)));
        let meets_m = |(from, to): &(Point, Point)| {
            let side = *to - *from;
            let across = ahead.cross(side);
            let off = *from - view.pose.at;
            let (along_m, share) = (off.cross(side) / across, off.cross(ahead) / across);
            (along_m > 0.0 && (0.0..=1.0).contains(&share)).then_some(along_m)
        };
        walls.iter().filter_map(meets_m).fold(range_max_m, f64::min)
    };
    (0..view.geometry.beams()).map(beam).collect()
}

fn hundredth(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}

fn thousandth(value: f64) -> f64 {
    (value * 1000.0).round() / 1000.0
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use kehai::scan::{Geometry, URG_04LX};

    use super::*;
    use crate::observation::Observation;

    #[test]
    fn sides_are_sixths_of_the_circle() {
        let at = |angle_deg: f64| {
            side(Point::new(1.0, 2.0), Point::new(1.0, 2.0) + Point::towards(angle_deg.to_radians()))
        };
        assert_eq!([10.0, 70.0, 130.0, 190.0, 250.0, 310.0, -10.0].map(at), [0, 1, 2, 3, 4, 5, 5]);
        assert_eq!(side(Point::default(), Point::new(1.0, -1e-18)), 5, "not a seventh");
    }

    /// A module that sees as far as the walls, of a room of 4 m by 3 m.
    fn glance(site: &Site, number: usize) -> Glance {
        let module = &site.modules[number];
        let geometry = Geometry::new(URG_04LX).unwrap();
        let view = Arc::new(View {
            module: number,
            pose: module.pose(),
            height_m: 0.6,
            geometry,
            upside_down: false,
        });
        let walls: Vec<(Point, Point)> = site.walls.iter().flat_map(Wall::sides).collect();
        let far_mm: Vec<u16> = ranges_m(&view, &walls).iter().map(|far_m| (far_m * 1e3) as u16).collect();
        let background_mm = far_mm.clone().into();
        Glance::of(&Observation {
            view,
            start_s: 1.0,
            detections: Vec::new(),
            empty_mm: far_mm,
            background_mm,
        })
    }

    /// A pillar in the middle of a room; modules in two corners.
    const ROOM: &str = r#"
        [[module]]
        name = "one"
        x = 0.05
        y = 0.05
        yaw_deg = 45.0
        [[module]]
        name = "two"
        x = 3.95
        y = 0.05
        yaw_deg = 135.0
        [[wall]]
        points = [[0, 0], [4, 0], [4, 3], [0, 3], [0, 0]]
        [[wall]]
        points = [[1.7, 1.3], [2.3, 1.3], [2.3, 1.7], [1.7, 1.7], [1.7, 1.3]]
        [[zone]]
        name = "room"
        polygon = [[0, 0], [4, 0], [4, 3], [0, 3]]
    "#;

    #[test]
    fn the_shadow_of_a_pillar_is_blind_with_one_module_and_the_next_is_mounted_where_it_is_seen() {
        let site: Site = toml::from_str(ROOM).unwrap();
        let first = glance(&site, 0);
        let alone = ground(&site, std::slice::from_ref(&first));
        assert_eq!((alone.cells.len(), alone.cell_m, alone.all.m2), (16 * 12, 0.25, 12.0));
        assert!(alone.all.one > 0.75 && alone.all.one < 0.95 && alone.all.two == 0.0, "{:?}", alone.all);
        let shadow = &alone.blind[0];
        assert!(shadow.at[0] > 2.0 && shadow.at[1] > 1.5 && shadow.m2 > 0.5, "{shadow:?}");
        let blind = alone.blind.iter().map(|spot| spot.m2).sum::<f64>();
        assert!((blind - alone.all.blind_m2).abs() < 0.02, "{blind}");
        let next = alone.next.unwrap();
        assert!(next.one > alone.all.one + 0.05 && next.two > 0.3, "{next:?}");
        let both = ground(&site, &[first, glance(&site, 1)]);
        assert!(both.all.one > alone.all.one && both.all.two > 0.3, "{:?}", both.all);
        // Mounted where it was said, the next sees as much.
        let mut planned = site.clone();
        let modules = &mut planned.modules;
        (modules[1].x, modules[1].y, modules[1].yaw_deg) = (next.x, next.y, next.yaw_deg);
        let then = ground(&planned, &[glance(&planned, 0), glance(&planned, 1)]);
        assert!(
            (then.all.one - next.one).abs() < 0.02 && (then.all.two - next.two).abs() < 0.02,
            "{then:?} {next:?}"
        );
        assert!(then.all.one >= both.all.one, "no pair with the first is better by much");
    }

    #[test]
    fn with_no_module_all_is_blind_and_nothing_is_proposed() {
        let site: Site = toml::from_str(ROOM).unwrap();
        let found = ground(&site, &[]);
        assert_eq!((found.all.one, found.all.blind_m2, found.blind.len(), found.next), (0.0, 12.0, 1, None));
        assert_eq!(ground(&Site::default(), &[]), Ground { cell_m: CELL_M, ..Ground::default() });
    }
}
