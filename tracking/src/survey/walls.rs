//! Walls: the pieces of all backgrounds laid together, joined at corners, and without what beams pass.
//!
//! ```text
//!   ────────  ──── ─────         one line, however many modules saw a part of it
//!   ──── ▒▒▒▒ ────               bridged where furniture hid it; not where a beam goes through: a door
//!   ──────╴ ╷                    ends that nearly meet, meet
//!           │
//!   ─ ─ ─ ─ ─                    left out: lower than the plane of a module that looks over it
//! ```

use super::pieces::{Piece, pieces};
use super::{Background, along};
use crate::geometry::Point;

/// Pieces of one wall point the same way to 6°, and lie on one line to this, m: what calibration is off, and both sides of a
/// light partition.
const ALIKE: f64 = 0.9945;
const OFF_M: f64 = 0.08;

/// A gap in a wall that is too narrow for a person, m.
const NARROW_M: f64 = 0.4;

/// The longest gap that is bridged where furniture hid the wall, m.
const HIDDEN_M: f64 = 3.0;

/// A beam passes a place if it is empty for so much farther, m: more than poses and the thickness of a thing.
const BEYOND_M: f64 = 0.35;

/// What hides a wall stands so far before it at least, m.
const BEFORE_M: f64 = 0.1;

/// A beam along a wall says nothing of it: it meets it within 20°.
const GRAZING: f64 = 0.35;

/// A wall is none if beams pass more than this share of it.
const PASSED_SHARE: f64 = 0.25;

/// Two walls meet in a corner that lies so far beyond their ends at most, m, and at 25° or more.
const CORNER_M: f64 = 1.0;
const CROSSING: f64 = 0.42;

/// How wide a door is, m.
const DOOR_M: (f64, f64) = (0.5, 1.8);

/// A line of walls is at least so long, m: less is furniture.
const LEAST_M: f64 = 0.6;

/// What stands about a place.
#[derive(Clone, Debug, Default)]
pub(super) struct Plan {
    /// Lines of corners, the longest first.
    pub lines: Vec<Vec<Point>>,
    /// Gaps in them that beams pass, as wide as a door.
    pub doors: Vec<(Point, Point)>,
    /// Cracks too narrow for a person: from a free end of a wall to the next wall.
    pub cracks: Vec<(Point, Point)>,
}

/// Walls and doors.
pub(super) fn plan(backgrounds: &[Background]) -> Plan {
    let mut all: Vec<Piece> = backgrounds.iter().flat_map(pieces).collect();
    all.sort_by(|one, other| other.length().total_cmp(&one.length()));
    let mut walls = laid_together(all, |_, _, gap_m| gap_m < NARROW_M);
    walls.retain(|wall| passed(backgrounds, wall.from, wall.to) <= PASSED_SHARE);
    walls = laid_together(walls, |one, other, gap_m| {
        let (from, to) = one.between(other);
        gap_m < HIDDEN_M && passed(backgrounds, from, to) <= 0.0 && is_hidden(backgrounds, from, to)
    });
    let Plan { mut lines, doors, cracks } = joined(backgrounds, &walls);
    let length = |line: &Vec<Point>| line.windows(2).map(|ends| (ends[1] - ends[0]).length()).sum::<f64>();
    lines.retain(|line| length(line) >= LEAST_M);
    lines.sort_by(|one, other| length(other).total_cmp(&length(one)));
    Plan { lines, doors, cracks }
}

/// Pieces on one line become one wall where `may` allows the gap between them.
fn laid_together(pieces: Vec<Piece>, may: impl Fn(&Piece, &Piece, f64) -> bool) -> Vec<Piece> {
    let mut walls: Vec<Piece> = Vec::new();
    for piece in pieces {
        let mut piece = piece;
        // What has grown may reach another.
        while let Some(other) =
            walls.iter().position(|wall| is_one(wall, &piece) && may(wall, &piece, wall.gap(&piece)))
        {
            piece = walls.swap_remove(other).joined(&piece);
        }
        walls.push(piece);
    }
    walls
}

/// Whether something stands before every place between two others, so that no module can say whether there is a wall.
fn is_hidden(backgrounds: &[Background], from: Point, to: Point) -> bool {
    let stands_before = |place: Point| {
        backgrounds.iter().any(|background| {
            let (range_m, beam) = background.view.beam_at(place);
            let wall_mm = beam.and_then(|beam| background.walls_mm.get(usize::from(beam)));
            wall_mm.is_some_and(|wall_mm| *wall_mm > 0 && f64::from(*wall_mm) * 1e-3 < range_m - BEFORE_M)
        })
    };
    let length_m = (to - from).length();
    let inset = (to - from) * (inset_m(length_m) / length_m.max(1e-9));
    along(from + inset, to - inset).all(stands_before)
}

/// Near its ends a wall is a few centimetres elsewhere: so much is left out, m.
fn inset_m(length_m: f64) -> f64 {
    0.15_f64.min(0.25 * length_m)
}

/// Whether two pieces lie on one line. The two sides of a thin wall do.
fn is_one(one: &Piece, other: &Piece) -> bool {
    let (longer, shorter) = if one.length() >= other.length() { (one, other) } else { (other, one) };
    longer.facing.dot(shorter.facing).abs() > ALIKE
        && longer.off(shorter.from) < OFF_M
        && longer.off(shorter.to) < OFF_M
}

/// The share of a straight piece that beams of any module pass.
fn passed(backgrounds: &[Background], from: Point, to: Point) -> f64 {
    let length_m = (to - from).length();
    let across = (to - from).left() * (1.0 / length_m.max(1e-9));
    let passes = |place: &Point| {
        backgrounds.iter().any(|background| {
            let view = &background.view;
            let off = *place - view.pose.at;
            let (range_m, beam) = view.beam_at(*place);
            off.dot(across).abs() > GRAZING * off.length()
                && beam.is_some_and(|beam| background.empty_m(beam) > range_m + BEYOND_M)
        })
    };
    let inset = (to - from) * (inset_m(length_m) / length_m.max(1e-9));
    let places: Vec<Point> = along(from + inset, to - inset).collect();
    places.iter().filter(|place| passes(place)).count() as f64 / places.len() as f64
}

/// An end of a wall: its number, and which end.
type End = (usize, usize);

/// Where the lines of two walls cross.
fn crossing(one: &Piece, other: &Piece) -> Option<Point> {
    let (along, across) = (one.along(), other.along());
    let turn = along.cross(across);
    (turn.abs() > CROSSING).then(|| one.from + along * ((other.from - one.from).cross(across) / turn))
}

/// Walls as lines of corners: ends that nearly meet are one corner, and an end that nearly reaches another wall reaches it.
fn joined(backgrounds: &[Background], walls: &[Piece]) -> Plan {
    let mut ends: Vec<[Point; 2]> = walls.iter().map(|wall| [wall.from, wall.to]).collect();
    let mut meetings: Vec<(f64, End, End, Point)> = Vec::new();
    for (one, wall) in walls.iter().enumerate() {
        for (other, its) in walls.iter().enumerate().skip(one + 1) {
            let Some(corner) = crossing(wall, its) else { continue };
            let nearest = |number: usize| {
                let [from_m, to_m] = ends[number].map(|end| (corner - end).length());
                if from_m <= to_m { (from_m, (number, 0)) } else { (to_m, (number, 1)) }
            };
            let ((own_m, own), (its_m, its)) = (nearest(one), nearest(other));
            let is_open = |(number, end): End| {
                let at = ends[number][end];
                (corner - at).length() > NARROW_M && passed(backgrounds, at, corner) > 0.0
            };
            if own_m < CORNER_M && its_m < CORNER_M && !is_open(own) && !is_open(its) {
                meetings.push((own_m + its_m, own, its, corner));
            }
        }
    }
    meetings.sort_by(|one, other| one.0.total_cmp(&other.0));
    let mut met: Vec<[Option<End>; 2]> = vec![[None; 2]; walls.len()];
    for (_, own, its, corner) in meetings {
        if met[own.0][own.1].is_some() || met[its.0][its.1].is_some() {
            continue;
        }
        (met[own.0][own.1], met[its.0][its.1]) = (Some(its), Some(own));
        (ends[own.0][own.1], ends[its.0][its.1]) = (corner, corner);
    }
    reach(walls, &met, &mut ends);
    let doors = doors(backgrounds, walls, &met, &ends);
    Plan { doors, cracks: cracks(&met, &ends), lines: chains(&met, &ends) }
}

/// From each end that meets no other to the nearest place of another wall, if a person does not fit between.
fn cracks(met: &[[Option<End>; 2]], ends: &[[Point; 2]]) -> Vec<(Point, Point)> {
    let mut cracks = Vec::new();
    for (one, own) in ends.iter().enumerate() {
        for at in (0..2).filter(|end| met[one][*end].is_none()).map(|end| own[end]) {
            let others = ends.iter().enumerate().filter(|(other, _)| *other != one);
            let places = others.map(|(_, &[from, to])| {
                let way = to - from;
                from + way * ((at - from).dot(way) / way.dot(way).max(1e-12)).clamp(0.0, 1.0)
            });
            let nearest = places.min_by(|a, b| (*a - at).length().total_cmp(&(*b - at).length()));
            cracks.extend(nearest.filter(|to| (*to - at).length() < DOOR_M.0).map(|to| (at, to)));
        }
    }
    cracks
}

/// Gaps from the free end of a wall to the next wall on its line, or across it.
fn doors(
    backgrounds: &[Background],
    walls: &[Piece],
    met: &[[Option<End>; 2]],
    ends: &[[Point; 2]],
) -> Vec<(Point, Point)> {
    let mut doors: Vec<(Point, Point)> = Vec::new();
    for one in 0..walls.len() {
        for end in (0..2).filter(|end| met[one][*end].is_none()) {
            let (at, ahead) = (ends[one][end], ends[one][end] - ends[one][1 - end]);
            let next = |(other, its): (usize, &Piece)| -> Option<Point> {
                let [from, to] = ends[other];
                if is_one(&walls[one], its) {
                    return [from, to]
                        .into_iter()
                        .min_by(|a, b| (*a - at).length().total_cmp(&(*b - at).length()));
                }
                let corner = crossing(&walls[one], its)?;
                ((corner - from).dot(to - from) >= 0.0 && (corner - to).dot(from - to) >= 0.0)
                    .then_some(corner)
            };
            let others = walls.iter().enumerate().filter(|(other, _)| *other != one);
            let before = others.filter_map(next).filter(|place| (*place - at).dot(ahead) > 0.0);
            let Some(to) = before.min_by(|a, b| (*a - at).length().total_cmp(&(*b - at).length())) else {
                continue;
            };
            let is_door =
                (DOOR_M.0..=DOOR_M.1).contains(&(to - at).length()) && passed(backgrounds, at, to) > 0.0;
            let is_known =
                |door: &(Point, Point)| (door.0 - to).length() < OFF_M && (door.1 - at).length() < OFF_M;
            if is_door && !doors.iter().any(is_known) {
                doors.push((at, to));
            }
        }
    }
    doors
}

/// Ends that meet no other, and nearly reach a wall between its ends, reach it.
fn reach(walls: &[Piece], met: &[[Option<End>; 2]], ends: &mut [[Point; 2]]) {
    for one in 0..walls.len() {
        for end in 0..2 {
            if met[one][end].is_some() {
                continue;
            }
            let at = ends[one][end];
            let crossings =
                walls.iter().enumerate().filter(|(other, _)| *other != one).filter_map(|(other, its)| {
                    let corner = crossing(&walls[one], its)?;
                    let [from, to] = ends[other];
                    let is_on = (corner - from).dot(to - from) > 0.0 && (corner - to).dot(from - to) > 0.0;
                    is_on.then_some(corner)
                });
            let nearest = crossings.min_by(|a, b| (*a - at).length().total_cmp(&(*b - at).length()));
            if let Some(corner) = nearest.filter(|corner| (*corner - at).length() < NARROW_M) {
                ends[one][end] = corner;
            }
        }
    }
}

/// Walls that meet, one after the other.
fn chains(met: &[[Option<End>; 2]], ends: &[[Point; 2]]) -> Vec<Vec<Point>> {
    let mut used = vec![false; ends.len()];
    let mut lines = Vec::new();
    let begins = |wall: usize| {
        if met[wall][0].is_none() { Some((wall, 0)) } else { met[wall][1].is_none().then_some((wall, 1)) }
    };
    // Those with a free end first; what remains is closed.
    let open = (0..ends.len()).filter_map(begins);
    for (wall, end) in open.chain((0..ends.len()).map(|wall| (wall, 0))) {
        if used[wall] {
            continue;
        }
        let mut line = vec![ends[wall][end]];
        let mut next = Some((wall, end));
        while let Some((wall, end)) = next.filter(|(wall, _)| !used[*wall]) {
            used[wall] = true;
            line.push(ends[wall][1 - end]);
            next = met[wall][1 - end];
        }
        lines.push(line);
    }
    lines
}
