//! Beams, people and mirrors, where it is known what is to be seen.

use super::*;
use crate::world::body::Section;
use crate::world::motion::{Motion, Track};
use crate::world::optics::SensorModel;
use crate::world::random::{Purpose, Stream};

fn person(positions: &[Point]) -> Person {
    let body = Body::random(Section::TorsoOnly, &mut Stream::new(1, Purpose::Person, [0, 0]));
    let motion = Motion::Track(Track::new(-10.0, 1.0, positions, 0.0));
    Person {
        name: String::from("one"),
        body,
        motion,
        crouches_s: None,
        gestures: None,
        reaches_s: Vec::new(),
    }
}

fn caster(yaw_deg: f64, upside_down: bool) -> Caster {
    let wall = Outline::Segment(Point::new(4.0, -9.0), Point::new(4.0, 9.0));
    let wall = Thing { outline: wall, reflectance: 0.53, low_m: 0.0, high_m: 2.5, mirror: false };
    let pose = Pose { at: Point::default(), yaw_rad: yaw_deg.to_radians() };
    Caster::hung(pose, 0.6, upside_down, SensorModel::Urg04lx.optics().geometry, &[wall])
}

const REVOLUTION: Revolution = Revolution { start_us: 5_000_000, period_us: 100_000, earliest_us: 0 };

#[test]
fn no_person_is_overlooked_wherever_they_stand() {
    for (yaw_deg, upside_down) in [(0.0, false), (90.0, true), (175.0, false), (175.0, true), (-140.0, true)]
    {
        let caster = caster(yaw_deg, upside_down);
        for angle_deg in (0..360).step_by(5) {
            for distance_m in [0.4, 0.9, 2.5] {
                let at = Point::towards(f64::from(angle_deg).to_radians()) * distance_m;
                let person = person(&[at; 30]);
                let fast = caster.cast(REVOLUTION, std::slice::from_ref(&person), &[]);
                let mut slow = caster.fixed.clone();
                let stance = person.motion.stance(5.0).unwrap();
                for (direction, seen) in caster.directions.iter().zip(&mut slow) {
                    let beam = Beam { origin: Point::default(), direction: *direction };
                    let thing = (FIRST_PERSON, f64::INFINITY);
                    add_body(&beam, &person.body.outlines(&stance), &person.body, thing, seen);
                }
                assert_eq!(fast, slow, "yaw {yaw_deg}, {angle_deg}° at {distance_m} m");
            }
        }
    }
}

#[test]
fn a_walker_is_seen_where_they_are_when_the_beam_comes_round() {
    // Away from the sensor along its front at 2 m/s: front step 384 passes 37.5 ms after the start.
    let positions: Vec<Point> =
        (0..30).map(|second| Point::new(2.0 * f64::from(second) - 28.5, 0.0)).collect();
    let person = person(&positions);
    let front = 384 - 44;
    let range_m =
        caster(0.0, false).cast(REVOLUTION, std::slice::from_ref(&person), &[])[front].unwrap().range_m;
    let expected_m = 1.5 + 2.0 * 0.0375 - person.body.half_depth_m;
    assert!((range_m - expected_m).abs() < 0.001, "{range_m} {expected_m}");
}

#[test]
fn a_sensor_that_hangs_head_down_sees_on_its_right_what_is_on_its_left() {
    let at = Point::new(1.5, 1.0);
    let person = person(&[at; 30]);
    let middle = |upside_down: bool| {
        let caster = caster(0.0, upside_down);
        let seen = caster.cast(REVOLUTION, std::slice::from_ref(&person), &[]);
        let hit = seen.iter().flatten().filter(|seen| seen.thing == FIRST_PERSON).count();
        let first = seen.iter().position(|seen| seen.is_some_and(|seen| seen.thing == FIRST_PERSON));
        let middle = first.unwrap() + hit / 2;
        assert_eq!(caster.entry_of(at).map(|(entry, _)| entry.abs_diff(middle) < 3), Some(true));
        (hit, middle)
    };
    let ((upright, left), (hung, right)) = (middle(false), middle(true));
    let front = 384 - 44;
    assert!(upright.abs_diff(hung) <= 2 && left > front + 80, "{upright} {hung}, at {left}");
    assert!((left + right).abs_diff(2 * front) < 4, "{left} and {right} about {front}");
}

#[test]
fn a_plane_above_the_shoulders_sees_no_person() {
    let mut child = person(&[Point::new(1.0, 0.0); 30]);
    child.body.top_m = 0.5;
    let beams = |child: &Person| {
        let seen = caster(0.0, false).cast(REVOLUTION, std::slice::from_ref(child), &[]);
        seen.iter().flatten().filter(|seen| seen.thing == FIRST_PERSON).count()
    };
    assert_eq!(beams(&child), 0);
    child.body.top_m = 0.7;
    let standing = beams(&child);
    child.crouches_s = Some([4.0, 6.0]);
    child.body.top_m = 1.4;
    assert!(standing > 20 && beams(&child) > 20, "still in the plane, crouching or not");
}

#[test]
fn a_mirror_shows_people_behind_it_as_far_as_their_image() {
    let wall = |x: f64, mirror| Thing {
        outline: Outline::Segment(Point::new(x, -9.0), Point::new(x, 9.0)),
        reflectance: 0.5,
        low_m: 0.0,
        high_m: 2.5,
        mirror,
    };
    let pose = Pose { at: Point::default(), yaw_rad: 0.0 };
    let geometry = SensorModel::Urg04lx.optics().geometry;
    // A mirror 1 m ahead; a person to the right of the sensor, out of its straight view.
    let caster = Caster::new(pose, 0.6, geometry, &[wall(1.0, true), wall(-3.0, false)]);
    let front = 384 - 44;
    let fixed_m = caster.fixed[front].unwrap().range_m;
    assert!((fixed_m - 5.0).abs() < 1e-9, "to the mirror, and back to the wall behind: {fixed_m}");
    let person = person(&[Point::new(-0.6, -0.4); 30]);
    let seen = caster.cast(REVOLUTION, std::slice::from_ref(&person), &[]);
    let image = Point::new(2.6, -0.4);
    let index = (front as f64 + image.angle_rad() * 1024.0 / std::f64::consts::TAU).round() as usize;
    let there = seen[index].unwrap();
    assert_eq!(there.thing, FIRST_PERSON);
    assert!((there.range_m - image.length()).abs() < 0.3, "{}", there.range_m);
    let behind =
        Person { motion: Motion::Track(Track::new(-10.0, 1.0, &[Point::new(2.0, 0.0); 30], 0.0)), ..person };
    assert_eq!(caster.cast(REVOLUTION, &[behind], &[]), caster.fixed, "no person is seen through it");
}

#[test]
fn a_table_top_above_the_plane_is_not_seen() {
    let pose = Pose { at: Point::default(), yaw_rad: 0.0 };
    let geometry = SensorModel::Urg04lx.optics().geometry;
    let outline = Outline::disc(Point::new(2.0, 0.0), 0.3);
    let table = |low_m| Thing { outline, reflectance: 0.5, low_m, high_m: 0.75, mirror: false };
    assert!(Caster::new(pose, 0.6, geometry, &[table(0.7)]).fixed.iter().all(Option::is_none));
    assert!(Caster::new(pose, 0.6, geometry, &[table(0.5)]).fixed.iter().any(Option::is_some));
}
