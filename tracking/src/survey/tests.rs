//! Rooms made up here, seen by modules at known places: the plan found is compared with them.

use super::*;
use crate::geometry::{Pose, inside};
use kehai::scan::{Geometry, URG_04LX};

/// A sensor sees walls so far, m; beams that end nowhere are taken for empty up to the second.
const WALL_M: f64 = 5.6;
const OPEN_M: f64 = 4.0;

/// Numbers that look random: about normal, one σ.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

/// What a module at `[x, y, yaw_deg]` learns of walls, with a wall's noise of 6 mm.
fn background([x, y, yaw_deg]: [f64; 3], walls: &[Vec<[f64; 2]>], seed: u64) -> Background {
    let geometry = Geometry::new(URG_04LX).unwrap();
    let pose = Pose { at: Point::new(x, y), yaw_rad: yaw_deg.to_radians() };
    let view = View { module: 0, pose, height_m: 0.6, geometry, upside_down: false };
    let mut noise = Noise(seed);
    let sides: Vec<(Point, Point)> =
        walls.iter().flat_map(|wall| wall.windows(2).map(|ends| (ends[0].into(), ends[1].into()))).collect();
    let (mut walls_mm, mut empty_mm) = (Vec::new(), Vec::new());
    for beam in 0..geometry.beams() {
        let along = Point::towards(pose.yaw_rad + f64::from(geometry.bearing_rad(beam)));
        let hit = |&(from, to): &(Point, Point)| {
            let way = to - from;
            let turn = along.cross(way);
            let (range_m, share) = ((from - pose.at).cross(way) / turn, (from - pose.at).cross(along) / turn);
            (turn != 0.0 && range_m > 0.0 && (0.0..=1.0).contains(&share)).then_some(range_m)
        };
        let range_m = sides.iter().filter_map(hit).fold(f64::INFINITY, f64::min);
        let measured_m = range_m + 0.006 * noise.next();
        let is_wall = range_m < WALL_M;
        walls_mm.push(if is_wall { (measured_m * 1000.0) as u16 } else { 0 });
        empty_mm.push((if is_wall { measured_m } else { OPEN_M } * 1000.0) as u16);
    }
    Background { view, walls_mm: walls_mm.into(), empty_mm: empty_mm.into() }
}

fn backgrounds(poses: &[[f64; 3]], walls: &[Vec<[f64; 2]>]) -> Vec<Background> {
    poses.iter().zip(1..).map(|(pose, seed)| background(*pose, walls, seed)).collect()
}

/// Share of what is in one of the two polygons that is in both.
fn likeness(one: &[Point], other: &[Point]) -> f64 {
    let (mut both, mut either) = (0.0, 0.0);
    for cell in 0..400_usize * 400 {
        let at = Point::new((cell % 400) as f64, (cell / 400) as f64) * 0.05 - Point::new(10.0, 10.0);
        let (in_one, in_other) = (inside(at, one), inside(at, other));
        both += f64::from(u8::from(in_one && in_other));
        either += f64::from(u8::from(in_one || in_other));
    }
    both / either
}

fn corners(polygon: &[[f64; 2]]) -> Vec<Point> {
    polygon.iter().map(|&corner| corner.into()).collect()
}

/// How far the corners of the found walls are off the true ones at most, m, and how much of the true walls is found.
fn compared(found: &[Wall], truth: &[Vec<[f64; 2]>]) -> (f64, f64) {
    let sides = |lines: &mut dyn Iterator<Item = &[[f64; 2]]>| -> Vec<(Point, Point)> {
        lines.flat_map(|line| line.windows(2).map(|ends| (ends[0].into(), ends[1].into()))).collect()
    };
    let found_sides = sides(&mut found.iter().map(|wall| wall.points.as_slice()));
    let true_sides = sides(&mut truth.iter().map(Vec::as_slice));
    let off_m = |place: Point, sides: &[(Point, Point)]| {
        sides.iter().map(|&(from, to)| distance_to_segment(place, from, to)).fold(f64::INFINITY, f64::min)
    };
    let placed: Vec<Point> = found_sides.iter().flat_map(|&(from, to)| along(from, to)).collect();
    let worst_m = placed.iter().map(|place| off_m(*place, &true_sides)).fold(0.0, f64::max);
    let there: Vec<Point> = true_sides.iter().flat_map(|&(from, to)| along(from, to)).collect();
    let met = there.iter().filter(|place| off_m(**place, &found_sides) < 0.05).count();
    (worst_m, met as f64 / there.len() as f64)
}

#[test]
fn a_rectangle_is_four_walls_and_one_room() {
    let walls = vec![vec![[0.0, 0.0], [5.0, 0.0], [5.0, 4.0], [0.0, 4.0], [0.0, 0.0]]];
    let seen = backgrounds(&[[0.1, 0.1, 45.0], [4.9, 3.9, -135.0]], &walls);
    let found = propose(&seen, &Site::default());
    let (worst_m, share) = compared(&found.walls, &walls);
    assert!(worst_m < 0.03 && share > 0.97, "{worst_m} {share} {:?}", found.walls);
    assert_eq!((found.walls.len(), found.walls[0].points.len()), (1, 5), "{:?}", found.walls);
    assert_eq!((found.zones.len(), found.entries.len()), (1, 0), "{found:?}");
    assert_eq!((found.zones[0].name.as_str(), found.zones[0].polygon.len()), ("room 1", 4));
    let like = likeness(&found.zones[0].corners(), &corners(&walls[0][..4]));
    assert!(like > 0.97, "{like} {:?}", found.zones);
}

#[test]
fn an_l_is_one_room_with_six_corners() {
    let walls =
        vec![vec![[0.0, 0.0], [6.0, 0.0], [6.0, 2.5], [2.5, 2.5], [2.5, 5.0], [0.0, 5.0], [0.0, 0.0]]];
    let seen = backgrounds(&[[5.9, 0.1, 135.0], [0.1, 4.9, -45.0], [0.1, 0.1, 45.0]], &walls);
    let found = propose(&seen, &Site::default());
    let (worst_m, share) = compared(&found.walls, &walls);
    assert!(worst_m < 0.03 && share > 0.95, "{worst_m} {share} {:?}", found.walls);
    assert_eq!(found.zones.len(), 1, "{found:?}");
    let like = likeness(&found.zones[0].corners(), &corners(&walls[0][..6]));
    assert!(like > 0.96, "{like} {:?}", found.zones);
}

#[test]
fn a_door_parts_two_rooms_and_another_is_an_entry() {
    // A door between the rooms, and one from the left room to the street.
    let walls = vec![
        vec![[0.0, 1.9], [0.0, 4.0], [7.0, 4.0], [7.0, 0.0], [0.0, 0.0], [0.0, 1.0]],
        vec![[3.4, 0.0], [3.4, 1.5]],
        vec![[3.4, 2.3], [3.4, 4.0]],
    ];
    let poses = [[0.1, 3.9, -45.0], [3.3, 0.1, 135.0], [6.9, 3.9, -135.0], [3.5, 0.1, 45.0]];
    let found = propose(&backgrounds(&poses, &walls), &Site::default());
    let (worst_m, share) = compared(&found.walls, &walls);
    assert!(worst_m < 0.05 && share > 0.95, "{worst_m} {share} {:?}", found.walls);
    let room = |left: f64, right: f64| corners(&[[left, 0.0], [right, 0.0], [right, 4.0], [left, 4.0]]);
    assert_eq!(found.zones.len(), 2, "{:?}", found.zones);
    for (zone, truth) in found.zones.iter().zip([room(3.4, 7.0), room(0.0, 3.4)]) {
        let like = likeness(&zone.corners(), &truth);
        assert!(like > 0.94, "{like} {zone:?}");
    }
    assert_eq!(found.entries.len(), 1, "{:?}", found.entries);
    let ([from, to], zone) = (found.entries[0].line, found.entries[0].zone.as_deref());
    assert_eq!(zone, Some("room 2"));
    let mut ys = [from[1], to[1]];
    ys.sort_by(f64::total_cmp);
    assert!((ys[0] - 1.0).abs() < 0.1 && (ys[1] - 1.9).abs() < 0.1, "{:?}", found.entries);
}

#[test]
fn a_cupboard_hides_a_wall_that_is_bridged_and_a_low_shelf_is_no_wall() {
    let room = vec![[0.0, 0.0], [5.0, 0.0], [5.0, 4.0], [0.0, 4.0], [0.0, 0.0]];
    let cupboard = vec![[2.0, 4.0], [2.0, 3.5], [3.0, 3.5], [3.0, 4.0]];
    let shelf = vec![[1.0, 1.2], [2.5, 1.2]];
    let high = background([0.1, 0.1, 45.0], &[room.clone(), cupboard.clone()], 1);
    let low = background([4.9, 0.1, 135.0], &[room.clone(), cupboard, shelf], 2);
    let found = propose(&[high, low], &Site::default());
    let has = |x: f64, y: f64| {
        let at = Point::new(x, y);
        found.walls.iter().flat_map(Wall::sides).any(|(from, to)| distance_to_segment(at, from, to) < 0.05)
    };
    assert!(has(2.5, 4.0), "the wall behind the cupboard: {:?}", found.walls);
    assert!(!has(1.8, 1.2), "the low shelf: {:?}", found.walls);
    assert_eq!(found.zones.len(), 1, "{:?}", found.zones);
}

#[test]
fn what_a_site_has_is_not_proposed_again() {
    let walls = vec![vec![[0.0, 0.0], [5.0, 0.0], [5.0, 4.0], [0.0, 4.0], [0.0, 0.0]]];
    let seen = backgrounds(&[[0.1, 0.1, 45.0], [4.9, 3.9, -135.0]], &walls);
    let first = propose(&seen, &Site::default());
    let site = Site { walls: first.walls, zones: first.zones, ..Site::default() };
    assert_eq!(propose(&seen, &site), Proposal::default());
    assert_eq!(propose(&[], &Site::default()), Proposal::default());
}

#[test]
fn a_glance_into_the_open_is_no_room() {
    let seen = backgrounds(&[[0.0, 0.0, 0.0]], &[]);
    assert_eq!(propose(&seen, &Site::default()), Proposal::default());
}

#[test]
fn a_module_looks_from_where_the_site_has_it_and_one_without_a_place_says_nothing() {
    let seen = background([0.0, 0.0, 0.0], &[], 1);
    let known = vec![("hall".to_owned(), seen.clone()), ("attic".to_owned(), seen)];
    let text = "[[module]]\nname = \"hall\"\nx = 3.0\ny = 4.0\nyaw_deg = 90\n\n[[module]]\nname = \"attic\"\nx = 0.0\ny = 0.0\nplaced = false\n";
    let site = Site::parse("home.toml", text).unwrap();
    let found = placed(known, &site);
    assert_eq!(
        found.iter().map(|background| background.view.pose).collect::<Vec<_>>(),
        [site.modules[0].pose()]
    );
}

#[test]
fn a_module_that_the_site_has_turned_over_since_sees_its_walls_on_the_other_side() {
    let walls = vec![vec![[1.0, -3.0], [1.0, 2.0]], vec![[-3.0, 2.0], [1.0, 2.0]]];
    let seen = background([0.0, 0.0, 0.0], &walls, 1);
    let text = "[[module]]\nname = \"hall\"\nx = 0.0\ny = 0.0\nupside_down = true\n";
    let found = placed(vec![("hall".to_owned(), seen.clone())], &Site::parse("home.toml", text).unwrap());
    assert!(found[0].view.upside_down);
    for (beam, &range_mm) in seen.walls_mm.iter().enumerate() {
        let bearing_rad = f64::from(seen.view.geometry.bearing_rad(beam as u16));
        let mirrored = found[0].view.beam_towards(-bearing_rad).unwrap();
        assert_eq!(found[0].walls_mm[usize::from(mirrored)], range_mm, "beam {beam}");
        assert_eq!(found[0].empty_mm[usize::from(mirrored)], seen.empty_mm[beam], "beam {beam}");
    }
}

#[test]
fn what_no_module_sees_is_the_rooms_where_walls_close_around_it() {
    // Beams that end nowhere are empty for 1.6 m: the middle is not seen, and all walls are.
    let walls = vec![vec![[0.0, 0.0], [5.0, 0.0], [5.0, 4.0], [0.0, 4.0], [0.0, 0.0]]];
    let short = |background: Background| {
        let empty_mm = background.empty_mm.iter().map(|mm| (*mm).min(1600)).collect();
        Background { empty_mm, ..background }
    };
    let seen: Vec<Background> =
        backgrounds(&[[0.1, 0.1, 45.0], [4.9, 3.9, -135.0]], &walls).into_iter().map(short).collect();
    let found = propose(&seen, &Site::default());
    assert_eq!(found.zones.len(), 1, "{:?}", found.zones);
    let like = likeness(&found.zones[0].corners(), &corners(&walls[0][..4]));
    assert!(like > 0.97, "{like} {:?}", found.zones);
}
