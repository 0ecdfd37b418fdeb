//! Rooms: what was seen empty, parted where it is as narrow as a door; and the gaps through which people come in.
//!
//! ```text
//!   ┌──────────┬───────┐       clearance ▲         saddle lower than both peaks: a door
//!   │ room 1   ╷ room 2│                 │ ╭──╮   ╭─╮
//!   │          ╵       │                 │╭╯  ╰─╮╭╯ ╰
//!   └── ── ────┴───────┘                 └───────╰─────▶ way from room to room
//!      entry: beams pass, and it is as wide as a door
//! ```
//!
//! A watershed of the distance to the nearest wall (Vincent and Soille 1991; Bormann and others 2016 compare ways to part maps into
//! rooms). What was not seen is a room's if walls close around it: the zone says how much of it is seen. Otherwise it is in no room.

use std::collections::BTreeMap;

use super::grid::{Grid, WAYS};
use super::{Background, rounded};
use crate::geometry::{Point, cross, distance_to_segment, inside};
use crate::site::{Entry, Site, Zone};

/// Half of a passage that parts no room, m: doors are narrower.
const WIDE_M: f64 = 0.52;

/// A passage parts no room that is hardly wider than itself.
const ALIKE: f64 = 0.8;

/// Shadows up to this width are the room's, cells on either side: a leg of a table hides that much.
const SHADOW: usize = 2;

/// What is not seen in the midst of a room is the room's up to this, m²: a table.
const ISLAND_M2: f64 = 1.5;

/// A room is at least so large, m², and so much of its rim is wall: otherwise it is a glance through a door.
const LEAST_M2: f64 = 1.0;
const WALL_SHARE: f64 = 0.5;

/// The rim of a room is at a wall as near as this, m; its corners are put on walls as near as that.
const AT_WALL_M: f64 = 0.25;

/// Corners of a zone are left out that are no farther off the line, m.
const STRAIGHT_M: f64 = 0.15;

/// What is on either side of a door is looked for so far beside it, m.
const BESIDE_M: f64 = 0.3;

/// No room.
const NONE: usize = usize::MAX;

/// Zones and entries that a site lacks, with these walls.
pub(super) fn rooms(
    backgrounds: &[Background],
    walls: &[(Point, Point)],
    doors: &[(Point, Point)],
    site: &Site,
) -> (Vec<Zone>, Vec<Entry>) {
    let eyes = backgrounds.iter().map(|background| background.view.pose.at);
    let ends = walls.iter().flat_map(|&(from, to)| [from, to]);
    let shut = [walls, doors].concat();
    let Some(grid) = Grid::over(eyes.chain(ends), &shut) else { return (Vec::new(), Vec::new()) };
    let free = free(backgrounds, &grid);
    let room_of = parted(&grid, &free);
    let cell_m2 = grid.cell_m * grid.cell_m;
    let mut cells_of = BTreeMap::<usize, Vec<usize>>::new();
    for (cell, room) in room_of.iter().enumerate().filter(|(_, room)| **room != NONE) {
        cells_of.entry(*room).or_default().push(cell);
    }
    let mut found: Vec<(usize, Vec<usize>)> =
        cells_of.into_iter().filter(|(_, cells)| cells.len() as f64 * cell_m2 >= LEAST_M2).collect();
    found.sort_by_key(|(_, cells)| std::cmp::Reverse(cells.len()));
    let rims: Vec<(usize, Vec<usize>, Vec<Side>)> = found
        .into_iter()
        .map(|(room, cells)| (room, cells, rim(&grid, &room_of, room, walls)))
        .filter(|(_, _, rim)| is_walled(rim, |cell| room_of[cell] != NONE))
        .collect();
    let known: Vec<Vec<Point>> = site.zones.iter().map(Zone::corners).collect();
    let mut zones: Vec<Zone> = Vec::new();
    let mut named = BTreeMap::<usize, String>::new();
    for (room, cells, rim) in rims {
        let is_known = |cell: &&usize| known.iter().any(|zone| inside(grid.middle(**cell), zone));
        if 2 * cells.iter().filter(is_known).count() > cells.len() {
            named.insert(room, String::new());
            continue;
        }
        let name = unused("room", zones.iter().chain(&site.zones).map(|zone| zone.name.as_str()));
        let polygon = polygon(&rim, walls).into_iter().map(rounded).collect();
        named.insert(room, name.clone());
        zones.push(Zone::counted(name, polygon));
    }
    let mut entries: Vec<Entry> = Vec::new();
    for (from, to) in doors {
        let across = (*to - *from).left() * (BESIDE_M / (*to - *from).length().max(1e-9));
        let middle = (*from + *to) * 0.5;
        let room_at = |at: Point| named.get(room_of.get(grid.cell(at)?)?);
        let ((Some(zone), None) | (None, Some(zone))) = (room_at(middle + across), room_at(middle - across))
        else {
            continue;
        };
        if zone.is_empty() {
            continue;
        }
        let name = unused("entry", entries.iter().chain(&site.entries).map(|entry| entry.name.as_str()));
        let line = [*from, *to].map(rounded);
        entries.push(Entry { name, line, zone: Some(zone.clone()) });
    }
    (zones, entries)
}

/// Whether enough of a rim is wall. Where the next room begins does not matter.
fn is_walled(rim: &[Side], is_room: impl Fn(usize) -> bool) -> bool {
    let walls = rim.iter().filter(|side| side.is_wall).count() as f64;
    let rooms = rim.iter().filter(|side| !side.is_wall && side.beyond.is_some_and(&is_room)).count();
    walls > 0.0 && walls >= WALL_SHARE * (rim.len() - rooms) as f64
}

/// A name that is not taken.
fn unused<'a>(word: &str, taken: impl Iterator<Item = &'a str> + Clone) -> String {
    let names = (1_u32..).map(|number| format!("{word} {number}"));
    names.into_iter().find(|name| taken.clone().all(|known| known != name)).unwrap_or_default()
}

/// The cells that were seen empty, with narrow shadows, islands, and what walls enclose together with them.
fn free(backgrounds: &[Background], grid: &Grid) -> Vec<bool> {
    let ahead: Vec<Point> = backgrounds.iter().map(|background| background.view.forward()).collect();
    let sees =
        |at: Point| backgrounds.iter().zip(&ahead).any(|(background, forward)| background.sees(*forward, at));
    let seen: Vec<bool> = (0..grid.len()).map(|cell| sees(grid.middle(cell))).collect();
    let mut free = grid.shrunk(&grid.grown(&seen, SHADOW), SHADOW);
    let most = (ISLAND_M2 / (grid.cell_m * grid.cell_m)) as usize;
    let unseen: Vec<bool> = free.iter().map(|is_free| !is_free).collect();
    for part in grid.parts(&unseen) {
        let is_reached = part.iter().any(|cell| grid.beside(*cell).any(|next| free[next]));
        let is_closed = part.iter().all(|cell| !grid.is_edge(*cell));
        if part.len() <= most || (is_reached && is_closed) {
            part.into_iter().for_each(|cell| free[cell] = true);
        }
    }
    free
}

/// The room of each cell: from the cells that are farthest from walls outwards, each cell joins its neighbours' room; rooms that
/// meet become one unless they meet in a door.
fn parted(grid: &Grid, free: &[bool]) -> Vec<usize> {
    let clearance_m = grid.clearance_m(free);
    let mut order: Vec<usize> = (0..grid.len()).filter(|cell| free[*cell]).collect();
    order.sort_by(|one, other| clearance_m[*other].total_cmp(&clearance_m[*one]));
    let mut room_of = vec![NONE; grid.len()];
    // Each room's peak, and the room it has become a part of.
    let mut rooms: Vec<(f64, usize)> = Vec::new();
    let root = |rooms: &[(f64, usize)], mut room: usize| {
        while rooms[room].1 != room {
            room = rooms[room].1;
        }
        room
    };
    for cell in order {
        let here_m = clearance_m[cell];
        let mut around: Vec<usize> =
            grid.beside(cell).map(|next| room_of[next]).filter(|room| *room != NONE).collect();
        around.iter_mut().for_each(|room| *room = root(&rooms, *room));
        around.sort_by(|one, other| rooms[*other].0.total_cmp(&rooms[*one].0));
        around.dedup();
        let Some(&first) = around.first() else {
            room_of[cell] = rooms.len();
            rooms.push((here_m, rooms.len()));
            continue;
        };
        room_of[cell] = first;
        for other in around.into_iter().skip(1).filter(|other| *other != first) {
            if here_m >= WIDE_M || here_m >= ALIKE * rooms[other].0 {
                rooms[other].1 = first;
            }
        }
    }
    room_of.into_iter().map(|room| if room == NONE { NONE } else { root(&rooms, room) }).collect()
}

/// A side of a cell at the rim of a room.
#[derive(Clone, Copy, Debug)]
struct Side {
    from: Point,
    to: Point,
    /// It is at a wall.
    is_wall: bool,
    /// The cell beyond it.
    beyond: Option<usize>,
}

/// The outer rim of a room, side by side, counter-clockwise.
fn rim(grid: &Grid, room_of: &[usize], room: usize, walls: &[(Point, Point)]) -> Vec<Side> {
    // From a corner of cells, the way that has the room to its left: at most two, where rooms touch corner to corner.
    let mut sides = BTreeMap::<(usize, usize), Vec<(usize, usize)>>::new();
    for cell in (0..grid.len()).filter(|cell| room_of[*cell] == room) {
        for way in 0..WAYS {
            if grid.next(cell, way).is_some_and(|(next, _)| room_of[next] == room) {
                continue;
            }
            let (column, row) = (cell % grid.columns, cell / grid.columns);
            let corners = [(column, row), (column + 1, row), (column + 1, row + 1), (column, row + 1)];
            sides.entry(corners[(way + 1) % WAYS]).or_default().push((cell, way));
        }
    }
    let mut longest: Vec<Side> = Vec::new();
    while let Some((&first, _)) = sides.first_key_value() {
        let (mut at, mut loop_) = (first, Vec::new());
        while let Some(ways) = sides.get_mut(&at) {
            let Some((cell, way)) = ways.pop() else { break };
            if ways.is_empty() {
                sides.remove(&at);
            }
            let (column, row) = (cell % grid.columns, cell / grid.columns);
            let corners = [(column, row), (column + 1, row), (column + 1, row + 1), (column, row + 1)];
            let (from, to) = (at, corners[(way + 2) % WAYS]);
            at = to;
            let beyond = grid.next(cell, way);
            let (from, to) = (grid.corner(from), grid.corner(to));
            let middle = (from + to) * 0.5;
            let near = |&(a, b): &(Point, Point)| distance_to_segment(middle, a, b) < AT_WALL_M;
            let is_wall = beyond.is_some_and(|(_, shut)| shut) || walls.iter().any(near);
            loop_.push(Side { from, to, is_wall, beyond: beyond.map(|(next, _)| next) });
        }
        if area_m2(&loop_) > area_m2(&longest) {
            longest = loop_;
        }
    }
    longest
}

fn area_m2(rim: &[Side]) -> f64 {
    0.5 * rim.iter().map(|side| side.from.cross(side.to)).sum::<f64>()
}

/// The rim as a polygon with few corners, on walls where there are walls.
fn polygon(rim: &[Side], walls: &[(Point, Point)]) -> Vec<Point> {
    let corners: Vec<Point> = rim.iter().map(|side| side.from).collect();
    // Both ends of the first cut are corners: the lowest left one, and the one farthest from it.
    let sum = |place: &Point| place.x + place.y;
    let Some(first) = (0..corners.len()).min_by(|a, b| sum(&corners[*a]).total_cmp(&sum(&corners[*b])))
    else {
        return corners;
    };
    let mut ring: Vec<Point> = corners.iter().cycle().skip(first).take(corners.len() + 1).copied().collect();
    let far = (0..ring.len())
        .max_by(|a, b| (ring[*a] - ring[0]).length().total_cmp(&(ring[*b] - ring[0]).length()));
    let far = far.unwrap_or(0);
    let mut simple = simplified(&ring[..=far]);
    simple.pop();
    simple.extend(simplified(&ring[far..]));
    simple.pop();
    ring = simple.iter().map(|corner| on_wall(*corner, walls)).collect();
    let is_same = |one: &Point, other: &Point| (*one - *other).length() < 0.02;
    ring.dedup_by(|one, other| is_same(one, other));
    // Around a ring the first comes after the last.
    if ring.len() > 1 && ring.first().zip(ring.last()).is_some_and(|(first, last)| is_same(first, last)) {
        ring.pop();
    }
    if is_simple(&ring) { ring } else { simple }
}

/// A line with the corners that matter (Douglas and Peucker 1973).
fn simplified(line: &[Point]) -> Vec<Point> {
    let (Some(&first), Some(&last)) = (line.first(), line.last()) else { return Vec::new() };
    let off = |index: &usize| distance_to_segment(line[*index], first, last);
    let farthest = (1..line.len().saturating_sub(1)).max_by(|a, b| off(a).total_cmp(&off(b)));
    match farthest.filter(|index| off(index) > STRAIGHT_M) {
        Some(index) => {
            let mut simple = simplified(&line[..=index]);
            simple.pop();
            simple.extend(simplified(&line[index..]));
            simple
        }
        None => vec![first, last],
    }
}

/// A corner at the nearest corner of walls, or else on the nearest wall, if there is one near.
fn on_wall(corner: Point, walls: &[(Point, Point)]) -> Point {
    let nearest = |places: &mut dyn Iterator<Item = Point>| {
        let near = places.map(|place| ((place - corner).length(), place));
        near.filter(|(far_m, _)| *far_m < AT_WALL_M)
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, place)| place)
    };
    let foot = |&(from, to): &(Point, Point)| {
        let way = to - from;
        from + way * ((corner - from).dot(way) / way.dot(way).max(1e-12)).clamp(0.0, 1.0)
    };
    nearest(&mut walls.iter().flat_map(|&(from, to)| [from, to]))
        .or_else(|| nearest(&mut walls.iter().map(foot)))
        .unwrap_or(corner)
}

/// Whether no two sides of a polygon cross.
fn is_simple(ring: &[Point]) -> bool {
    let side = |index: usize| (ring[index], ring[(index + 1) % ring.len()]);
    ring.len() >= 3
        && (0..ring.len()).all(|one| (one + 1..ring.len()).all(|other| !cross(side(one), side(other))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_corners_of_a_rim_that_one_corner_of_walls_takes_are_one_also_at_its_end() {
        let places = [[0.2, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0], [0.0, 0.2]].map(Point::from);
        let room = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]].map(Point::from);
        let around = |corners: &[Point]| -> Vec<(Point, Point)> {
            corners.iter().copied().zip(corners.iter().copied().cycle().skip(1)).collect()
        };
        let rim: Vec<Side> = around(&places)
            .into_iter()
            .map(|(from, to)| Side { from, to, is_wall: true, beyond: None })
            .collect();
        assert_eq!(polygon(&rim, &around(&room)), room);
    }
}
