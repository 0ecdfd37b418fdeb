//! Ray casting: the ranges of a perfect sensor, every step's beam fired at its own moment.
//!
//! ```text
//!   step   0 ──▶ last              people move while the mirror turns: a walker is 7 cm further
//!   time  t0 ──▶ t0 + period       when the beam comes round to the other side of a half turn.
//!         |8 |8 |8 |8 …            Within eight steps (0.8 ms on a URG) they are taken as standing.
//! ```
//!
//! What does not move is looked up: each step's nearest wall is found once, when the sensor is set up.

use super::body::{Body, MAX_OUTLINES};
use super::geometry::{Beam, Meeting, Outline, Point, Pose};
use super::moving::Moving;
use super::noise::Seen;
use super::person::Person;
use super::upright;
use heapless::Vec as SmallVec;
use kehai_emulator::source::{Revolution, SensorGeometry};

/// A fixed surface: a piece of wall, a side of a table, a pillar.
#[derive(Clone, Copy, Debug)]
pub struct Thing {
    /// Its shape in the plane.
    pub outline: Outline,
    /// Reflectance.
    pub reflectance: f64,
    /// It is hit only by planes between these heights.
    pub low_m: f64,
    /// See `low_m`.
    pub high_m: f64,
    /// A mirror: beams go on from it.
    pub mirror: bool,
}

/// [`Seen::thing`] of the first thing that moves; what stands still has smaller numbers.
pub const FIRST_MOVING: u16 = 0x4000;
/// [`Seen::thing`] of the first person.
pub const FIRST_PERSON: u16 = 0x8000;
/// How many times a turn the positions of moving things are computed.
const UPDATES_PER_TURN: usize = 16;
/// Steps between two computations of where people are.
const STEPS_PER_UPDATE: usize = 8;
/// How far a person may walk between the middle of a revolution and the beam that meets them (7 m/s for the half of
/// 0.1 s) without being missed.
const WALK_MARGIN_M: f64 = 0.35;
/// The speed behind that.
const FASTEST_M_S: f64 = 7.0;
/// What rounding may take from a circle around an outline.
const ROUNDING_M: f64 = 1e-6;

/// One sensor's view of the things that do not move.
#[derive(Clone, Debug)]
pub struct Caster {
    pose: Pose,
    height_m: f64,
    /// Whether it hangs head down: its mirror turns to the right.
    upside_down: bool,
    geometry: SensorGeometry,
    /// Per step: direction of the beam in the site.
    directions: Vec<Point>,
    /// Per step: the nearest static surface, also by reflection in a mirror.
    fixed: Vec<Option<Seen>>,
    /// Per step: how far the beam goes straight.
    straight_m: Vec<f64>,
    reflections: Vec<Reflection>,
}

/// The reflection of a beam at a mirror.
#[derive(Clone, Copy, Debug)]
struct Reflection {
    index: usize,
    beam: Beam,
    /// Way up to the mirror.
    way_m: f64,
}

impl Caster {
    /// A sensor at `pose`, its plane `height_m` above the floor, among `things`.
    #[must_use]
    pub fn new(pose: Pose, height_m: f64, geometry: SensorGeometry, things: &[Thing]) -> Self {
        Self::hung(pose, height_m, false, geometry, things)
    }

    /// The same of a sensor that hangs head down, if it does.
    #[must_use]
    pub fn hung(
        pose: Pose,
        height_m: f64,
        upside_down: bool,
        geometry: SensorGeometry,
        things: &[Thing],
    ) -> Self {
        let steps = geometry.first_step..=geometry.last_step;
        let side = if upside_down { -1.0 } else { 1.0 };
        let way = |step| pose.yaw_rad + side * geometry.bearing_rad(step);
        let directions: Vec<Point> = steps.map(|step| Point::towards(way(step))).collect();
        let nearest = |beam: &Beam, except: Option<u16>| {
            let cut = |thing: &&Thing| (thing.low_m..=thing.high_m).contains(&height_m);
            let seen = |(number, thing): (usize, &Thing)| {
                let other = Some(thing).filter(|_| except != Some(number as u16));
                let meeting = other.filter(cut)?.outline.meet(beam)?;
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
        let mut straight_m = vec![f64::INFINITY; directions.len()];
        let mut reflections = Vec::new();
        let mut look = |(index, direction): (usize, &Point)| {
            let beam = Beam { origin: pose.at, direction: *direction };
            let first = nearest(&beam, None)?;
            let thing = things.get(usize::from(first.thing)).filter(|thing| thing.mirror);
            let Some(Outline::Segment(from, to)) = thing.map(|thing| thing.outline) else {
                return Some(first);
            };
            straight_m[index] = first.range_m;
            let along = (to - from) * (1.0 / (to - from).length().max(1e-9));
            let beam = Beam {
                origin: beam.origin + beam.direction * first.range_m,
                direction: along * (2.0 * beam.direction.dot(along)) - beam.direction,
            };
            reflections.push(Reflection { index, beam, way_m: first.range_m });
            let behind = nearest(&beam, Some(first.thing))?;
            Some(Seen { range_m: first.range_m + behind.range_m, ..behind })
        };
        let fixed = directions.iter().enumerate().map(&mut look).collect();
        Self { pose, height_m, upside_down, geometry, directions, fixed, straight_m, reflections }
    }

    /// Where the sensor is.
    #[must_use]
    pub const fn pose(&self) -> Pose {
        self.pose
    }

    /// A place's bearing as the sensor counts, and its distance.
    fn bearing(&self, at: Point) -> (f64, f64) {
        let place = self.pose.to_sensor(at);
        (if self.upside_down { -place.angle_rad() } else { place.angle_rad() }, place.length())
    }

    /// The entry that points at a place, and how far that is; nothing if something fixed stands between.
    #[must_use]
    pub fn entry_of(&self, at: Point) -> Option<(usize, f64)> {
        let (bearing_rad, distance_m) = self.bearing(at);
        let steps_a_rad = f64::from(self.geometry.steps_per_turn) / std::f64::consts::TAU;
        let front = f64::from(self.geometry.front_step) - f64::from(self.geometry.first_step);
        let entry = (front + bearing_rad * steps_a_rad).round();
        let fixed = (entry >= 0.0).then(|| self.fixed.get(entry as usize))??;
        let hidden = fixed.is_some_and(|seen| seen.range_m < distance_m - 0.05);
        (!hidden).then_some((entry as usize, distance_m))
    }

    /// Whether both planes are one, as far as light spreads.
    #[must_use]
    pub fn is_level_with(&self, other: &Self) -> bool {
        (self.height_m - other.height_m).abs() < 0.05
    }

    /// Measurement of each step in the given revolution; people are numbered from [`FIRST_PERSON`],
    /// what else moves from [`FIRST_MOVING`].
    #[must_use]
    pub fn cast(&self, revolution: Revolution, people: &[Person], moving: &[Moving]) -> Vec<Option<Seen>> {
        let mut seen = self.fixed.clone();
        for (number, moving) in moving.iter().enumerate().filter(|(_, moving)| moving.is_cut(self.height_m)) {
            self.add_moving(revolution, FIRST_MOVING + number as u16, moving, &mut seen);
        }
        for (number, person) in people.iter().enumerate() {
            self.add_person(revolution, FIRST_PERSON + number as u16, person, &mut seen);
        }
        for reflection in &self.reflections {
            self.add_reflected(revolution, reflection, people, &mut seen);
        }
        seen
    }

    /// Computed less often than people: within a sixteenth of a turn it is taken as standing.
    fn add_moving(&self, revolution: Revolution, thing: u16, moving: &Moving, seen: &mut [Option<Seen>]) {
        let steps = (usize::from(self.geometry.steps_per_turn) / UPDATES_PER_TURN).max(1);
        let reflectance = moving.reflectance();
        let beams = self.directions.chunks(steps).zip(self.straight_m.chunks(steps));
        for (chunk, ((directions, straight_m), seen)) in beams.zip(seen.chunks_mut(steps)).enumerate() {
            let outlines = moving.outlines(self.time_s(revolution, chunk * steps + steps / 2));
            for outline in outlines.iter().filter(|outline| self.may_meet(directions, outline)) {
                for ((direction, straight_m), seen) in directions.iter().zip(straight_m).zip(&mut *seen) {
                    let beam = Beam { origin: self.pose.at, direction: *direction };
                    let Some(Meeting { range_m, incidence }) = outline.meet(&beam) else { continue };
                    if range_m < *straight_m && seen.is_none_or(|seen| range_m < seen.range_m) {
                        *seen = Some(Seen { range_m, incidence, reflectance, bias_mm: 0.0, thing });
                    }
                }
            }
        }
    }

    /// Adds the people that a beam hits after its reflection in a mirror. Other moving objects are not reflected.
    fn add_reflected(
        &self,
        revolution: Revolution,
        reflection: &Reflection,
        people: &[Person],
        seen: &mut [Option<Seen>],
    ) {
        let Some(seen) = seen.get_mut(reflection.index) else { return };
        let time_s = self.time_s(revolution, reflection.index);
        for (number, person) in people.iter().enumerate() {
            let body = person.body_at(time_s);
            let Some(stance) = person.motion.stance(time_s).filter(|_| body.top_m > self.height_m) else {
                continue;
            };
            let (thing, mut image) = (FIRST_PERSON + number as u16, None);
            add_body(
                &reflection.beam,
                &upright::cut(&body, &stance, self.height_m),
                &body,
                (thing, f64::INFINITY),
                &mut image,
            );
            let image = image.map(|image: Seen| Seen { range_m: image.range_m + reflection.way_m, ..image });
            *seen = match (*seen, image) {
                (Some(now), Some(image)) if now.range_m <= image.range_m => Some(now),
                (now, image) => image.or(now),
            };
        }
    }

    /// When the beam of an entry is fired.
    fn time_s(&self, revolution: Revolution, index: usize) -> f64 {
        let step = index as f64 + f64::from(self.geometry.first_step);
        let period_s = f64::from(revolution.period_us) * 1e-6;
        revolution.start_us as f64 * 1e-6 + period_s * step / f64::from(self.geometry.steps_per_turn)
    }

    fn add_person(&self, revolution: Revolution, thing: u16, person: &Person, seen: &mut [Option<Seen>]) {
        let time_s = |index: usize| self.time_s(revolution, index);
        let body = person.body_at(time_s(seen.len() / 2));
        if body.top_m <= self.height_m {
            return;
        }
        let middle = person.motion.stance(time_s(seen.len() / 2));
        let sector = middle.map_or(0..seen.len(), |stance| {
            self.sector(stance.at, body.reach_m() + WALK_MARGIN_M, seen.len())
        });
        let met = self.met(revolution, &sector, (person, body.reach_m()), seen.len());
        let mut index = sector.start;
        while index < sector.end {
            // Computations are counted from the sector's start; those without a chance to meet a person are left out.
            let end = (index + STEPS_PER_UPDATE).min(sector.end);
            if end > met.start
                && index < met.end
                && let Some(stance) = person.motion.stance(time_s((index + end) / 2))
            {
                let outlines = upright::cut(&body, &stance, self.height_m);
                let directions = &self.directions[index..end];
                for outline in outlines.iter().filter(|outline| self.may_meet(directions, outline)) {
                    let beams = directions.iter().zip(&self.straight_m[index..end]);
                    for ((direction, straight_m), seen) in beams.zip(&mut seen[index..end]) {
                        let beam = Beam { origin: self.pose.at, direction: *direction };
                        add_outline(&beam, outline, &body, (thing, *straight_m), seen);
                    }
                }
            }
            index = end;
        }
    }

    /// The part of a sector in which beams can meet a person: where they are when the mirror comes round to them is
    /// known better than where they are in the middle of the revolution.
    fn met(
        &self,
        revolution: Revolution,
        sector: &std::ops::Range<usize>,
        (person, reach_m): (&Person, f64),
        entries: usize,
    ) -> std::ops::Range<usize> {
        let time_s = |index: usize| self.time_s(revolution, index);
        let middle = (sector.start + sector.end) / 2;
        let Some(stance) = person.motion.stance(time_s(middle)) else { return sector.clone() };
        let apart_s = time_s(sector.end) - time_s(middle);
        let met = self.sector(stance.at, reach_m + FASTEST_M_S * apart_s, entries);
        // Straight behind the sensor both may be at different ends of the scan.
        if met.end <= sector.start || met.start >= sector.end { sector.clone() } else { met }
    }

    /// Whether any of the neighbouring beams `directions`, less than half a turn, can meet an outline: not if the circle
    /// around it is beside or behind the first and the last of them.
    fn may_meet(&self, directions: &[Point], outline: &Outline) -> bool {
        let (Some(first), Some(last)) = (directions.first(), directions.last()) else { return false };
        let (centre, radius_m) = outline.bounds();
        let (way, reach_m) = (centre - self.pose.at, radius_m + ROUNDING_M);
        let both = |one: f64, other: f64| one.min(other) > reach_m;
        let (right, left) = (first.cross(way), last.cross(way));
        !(both(right, left) || both(-right, -left) || both(-first.dot(way), -last.dot(way)))
    }

    /// The entries whose beams can pass within `reach_m` of a place.
    fn sector(&self, at: Point, reach_m: f64, entries: usize) -> std::ops::Range<usize> {
        let (bearing_rad, distance_m) = self.bearing(at);
        if distance_m <= reach_m {
            return 0..entries;
        }
        let half_rad = libm::asin(reach_m / distance_m);
        let steps_a_rad = f64::from(self.geometry.steps_per_turn) / std::f64::consts::TAU;
        let front = f64::from(self.geometry.front_step) - f64::from(self.geometry.first_step);
        let turn = f64::from(self.geometry.steps_per_turn);
        let entry = |angle_rad: f64| front + angle_rad * steps_a_rad;
        let (mut low, mut high) = (entry(bearing_rad - half_rad), entry(bearing_rad + half_rad));
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
    (thing, straight_m): (u16, f64),
    seen: &mut Option<Seen>,
) {
    for outline in outlines {
        add_outline(beam, outline, body, (thing, straight_m), seen);
    }
}

fn add_outline(
    beam: &Beam,
    outline: &Outline,
    body: &Body,
    (thing, straight_m): (u16, f64),
    seen: &mut Option<Seen>,
) {
    let Some(meeting) = outline.meet(beam) else { return };
    if meeting.range_m < straight_m && seen.is_none_or(|seen| meeting.range_m < seen.range_m) {
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

#[cfg(test)]
mod tests;
