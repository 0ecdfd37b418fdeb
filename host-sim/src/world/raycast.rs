//! What a perfect sensor would see: every step's beam, fired at its own moment.
//!
//! ```text
//!   step   0 ──▶ last              people move while the mirror turns: a walker is 7 cm further
//!   time  t0 ──▶ t0 + period       when the beam comes round to the other side of a half turn.
//!         |8 |8 |8 |8 …            Within eight steps (0.8 ms on a URG) they are taken as standing.
//! ```
//!
//! What does not move is looked up: each step's nearest wall is found once, when the sensor is set up.

use super::body::{Body, MAX_OUTLINES};
use super::door::Door;
use super::geometry::{Beam, Meeting, Outline, Point, Pose};
use super::motion::Motion;
use super::noise::Seen;
use crate::source::{Revolution, SensorGeometry};
use heapless::Vec as SmallVec;

/// Something that neither moves nor thinks: a piece of wall, a side of a table, a pillar.
#[derive(Clone, Copy, Debug)]
pub struct Thing {
    /// Its shape in the plane.
    pub outline: Outline,
    /// Share of the light it gives back.
    pub reflectance: f64,
    /// It is hit only by planes between these heights.
    pub low_m: f64,
    /// See `low_m`.
    pub high_m: f64,
}

/// A person of the world.
#[derive(Clone, Debug)]
pub struct Person {
    /// Name in truth; unique.
    pub name: String,
    /// Size and clothes.
    pub body: Body,
    /// Where they are when.
    pub motion: Motion,
}

/// [`Seen::thing`] of the first door; what stands still has smaller numbers.
pub const FIRST_DOOR: u16 = 0x4000;
/// [`Seen::thing`] of the first person.
pub const FIRST_PERSON: u16 = 0x8000;
/// Steps between two looks at where people are.
const STEPS_A_LOOK: usize = 8;
/// Somebody may walk this far during a revolution (3 m/s for 0.1 s) without being overlooked.
const WALK_MARGIN_M: f64 = 0.35;

/// One sensor's view of the things that do not move.
#[derive(Clone, Debug)]
pub struct Caster {
    pose: Pose,
    geometry: SensorGeometry,
    /// Per step: direction of the beam in the site.
    directions: Vec<Point>,
    /// Per step: the nearest thing that does not move.
    fixed: Vec<Option<Seen>>,
}

impl Caster {
    /// A sensor at `pose`, its plane `height_m` above the floor, among `things`.
    #[must_use]
    pub fn new(pose: Pose, height_m: f64, geometry: SensorGeometry, things: &[Thing]) -> Self {
        let steps = geometry.first_step..=geometry.last_step;
        let directions: Vec<Point> =
            steps.map(|step| Point::towards(pose.yaw_rad + geometry.bearing_rad(step))).collect();
        let nearest = |direction: &Point| {
            let beam = Beam { origin: pose.at, direction: *direction };
            let cut = |thing: &&Thing| (thing.low_m..=thing.high_m).contains(&height_m);
            let seen = |(number, thing): (usize, &Thing)| {
                let meeting = Some(thing).filter(cut)?.outline.meet(&beam)?;
                Some(Seen {
                    range_m: meeting.range_m,
                    incidence: meeting.incidence,
                    reflectance: thing.reflectance,
                    bias_mm: 0.0,
                    thing: number as u16,
                })
            };
            things.iter().enumerate().filter_map(seen).min_by(|a, b| a.range_m.total_cmp(&b.range_m))
        };
        let fixed = directions.iter().map(nearest).collect();
        Self { pose, geometry, directions, fixed }
    }

    /// Where the sensor is.
    #[must_use]
    pub const fn pose(&self) -> Pose {
        self.pose
    }

    /// What each step sees in the given revolution; people are numbered from [`FIRST_PERSON`],
    /// doors from [`FIRST_DOOR`].
    #[must_use]
    pub fn cast(&self, revolution: Revolution, people: &[Person], doors: &[Door]) -> Vec<Option<Seen>> {
        let mut seen = self.fixed.clone();
        for (number, door) in doors.iter().enumerate() {
            self.add_door(revolution, FIRST_DOOR + number as u16, door, &mut seen);
        }
        for (number, person) in people.iter().enumerate() {
            self.add_person(revolution, FIRST_PERSON + number as u16, person, &mut seen);
        }
        seen
    }

    /// A leaf is slow: within one revolution it is taken as standing.
    fn add_door(&self, revolution: Revolution, thing: u16, door: &Door, seen: &mut [Option<Seen>]) {
        let middle_us = revolution.start_us as f64 + f64::from(revolution.period_us) * 0.5;
        let outline = door.outline(middle_us * 1e-6);
        for (direction, seen) in self.directions.iter().zip(seen) {
            let beam = Beam { origin: self.pose.at, direction: *direction };
            let Some(Meeting { range_m, incidence }) = outline.meet(&beam) else { continue };
            if seen.is_none_or(|seen| range_m < seen.range_m) {
                *seen = Some(Seen { range_m, incidence, reflectance: door.reflectance, bias_mm: 0.0, thing });
            }
        }
    }

    fn add_person(&self, revolution: Revolution, thing: u16, person: &Person, seen: &mut [Option<Seen>]) {
        let turn = f64::from(self.geometry.steps_per_turn);
        let period_s = f64::from(revolution.period_us) * 1e-6;
        let time_s = |index: usize| {
            let step = index as f64 + f64::from(self.geometry.first_step);
            revolution.start_us as f64 * 1e-6 + period_s * step / turn
        };
        let middle = person.motion.stance(time_s(seen.len() / 2));
        let sector = middle.map_or(0..seen.len(), |stance| {
            self.sector(stance.at, person.body.reach_m() + WALK_MARGIN_M, seen.len())
        });
        let mut index = sector.start;
        while index < sector.end {
            let end = (index + STEPS_A_LOOK).min(sector.end);
            if let Some(stance) = person.motion.stance(time_s((index + end) / 2)) {
                let outlines = person.body.outlines(&stance);
                for (direction, seen) in self.directions[index..end].iter().zip(&mut seen[index..end]) {
                    let beam = Beam { origin: self.pose.at, direction: *direction };
                    add_body(&beam, &outlines, &person.body, thing, seen);
                }
            }
            index = end;
        }
    }

    /// The entries whose beams can pass within `reach_m` of a place.
    fn sector(&self, at: Point, reach_m: f64, entries: usize) -> std::ops::Range<usize> {
        let place = self.pose.to_sensor(at);
        let distance_m = place.length();
        if distance_m <= reach_m {
            return 0..entries;
        }
        let half_rad = libm::asin(reach_m / distance_m);
        let steps_a_rad = f64::from(self.geometry.steps_per_turn) / std::f64::consts::TAU;
        let front = f64::from(self.geometry.front_step) - f64::from(self.geometry.first_step);
        let turn = f64::from(self.geometry.steps_per_turn);
        let entry = |angle_rad: f64| front + angle_rad * steps_a_rad;
        let (mut low, mut high) = (entry(place.angle_rad() - half_rad), entry(place.angle_rad() + half_rad));
        // Straight behind the sensor, angles jump by a turn.
        if high < 0.0 {
            (low, high) = (low + turn, high + turn);
        } else if low >= entries as f64 {
            (low, high) = (low - turn, high - turn);
        }
        let bound = |entry: f64| entry.clamp(0.0, entries as f64) as usize;
        bound(low.floor())..bound(high.ceil() + 1.0)
    }
}

fn add_body(
    beam: &Beam,
    outlines: &SmallVec<Outline, MAX_OUTLINES>,
    body: &Body,
    thing: u16,
    seen: &mut Option<Seen>,
) {
    for outline in outlines {
        let Some(meeting) = outline.meet(beam) else { continue };
        if seen.is_none_or(|seen| meeting.range_m < seen.range_m) {
            *seen = Some(Seen {
                range_m: meeting.range_m,
                // Cloth is rough and sends light back at a slant, too.
                incidence: meeting.incidence.sqrt(),
                reflectance: body.reflectance,
                bias_mm: body.clothing_bias_mm,
                thing,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::body::Section;
    use crate::world::motion::Track;
    use crate::world::optics::SensorModel;
    use crate::world::random::{Purpose, Stream};

    fn person(positions: &[Point]) -> Person {
        let body = Body::random(Section::TorsoOnly, &mut Stream::new(1, Purpose::Person, [0, 0]));
        let motion = Motion::Track(Track::new(-10.0, 1.0, positions, 0.0));
        Person { name: String::from("one"), body, motion }
    }

    fn caster(yaw_deg: f64) -> Caster {
        let wall = Outline::Segment(Point::new(4.0, -9.0), Point::new(4.0, 9.0));
        let wall = Thing { outline: wall, reflectance: 0.53, low_m: 0.0, high_m: 2.5 };
        let pose = Pose { at: Point::default(), yaw_rad: yaw_deg.to_radians() };
        Caster::new(pose, 0.6, SensorModel::Urg04lx.optics().geometry, &[wall])
    }

    const REVOLUTION: Revolution = Revolution { start_us: 5_000_000, period_us: 100_000, earliest_us: 0 };

    #[test]
    fn nobody_is_overlooked_wherever_they_stand() {
        for yaw_deg in [0.0, 90.0, 175.0, -140.0] {
            let caster = caster(yaw_deg);
            for angle_deg in (0..360).step_by(5) {
                for distance_m in [0.4, 0.9, 2.5] {
                    let at = Point::towards(f64::from(angle_deg).to_radians()) * distance_m;
                    let person = person(&[at; 30]);
                    let fast = caster.cast(REVOLUTION, std::slice::from_ref(&person), &[]);
                    let mut slow = caster.fixed.clone();
                    let stance = person.motion.stance(5.0).unwrap();
                    for (direction, seen) in caster.directions.iter().zip(&mut slow) {
                        let beam = Beam { origin: Point::default(), direction: *direction };
                        add_body(&beam, &person.body.outlines(&stance), &person.body, FIRST_PERSON, seen);
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
            caster(0.0).cast(REVOLUTION, std::slice::from_ref(&person), &[])[front].unwrap().range_m;
        let expected_m = 1.5 + 2.0 * 0.0375 - person.body.half_depth_m;
        assert!((range_m - expected_m).abs() < 0.001, "{range_m} {expected_m}");
    }

    #[test]
    fn a_table_top_above_the_plane_is_not_seen() {
        let pose = Pose { at: Point::default(), yaw_rad: 0.0 };
        let geometry = SensorModel::Urg04lx.optics().geometry;
        let outline = Outline::disc(Point::new(2.0, 0.0), 0.3);
        let table = |low_m| Thing { outline, reflectance: 0.5, low_m, high_m: 0.75 };
        assert!(Caster::new(pose, 0.6, geometry, &[table(0.7)]).fixed.iter().all(Option::is_none));
        assert!(Caster::new(pose, 0.6, geometry, &[table(0.5)]).fixed.iter().any(Option::is_some));
    }
}
