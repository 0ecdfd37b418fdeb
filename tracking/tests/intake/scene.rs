//! A room with people, and what each of two modules reports of them.
//!
//! ```text
//!             1.2 m ┌─────────────┐
//!                   │ ●        ▲  │      ● stands      ▲▼ walks to and fro
//!   left ◁──────────│          │  │──────────▷ right
//!   (−2, 0)         │          ▼  │       (2, 0), turned round
//!                   └─────────────┘ zone "area"
//! ```

use kehai::candidate::{CONTOUR_UNIT_MM, Candidate, End, EndKind};
use kehai::scan::{Geometry, GeometryParts, URG_04LX};
use kehai_tracking::geometry::{Point, Pose};

/// The site of it.
pub const ROOM: &str = r#"
    [[module]]
    name = "left"
    x = -2.0
    y = 0.0
    [[module]]
    name = "right"
    x = 2.0
    y = 0.0
    yaw_deg = 180.0
    [[zone]]
    name = "area"
    polygon = [[-1.2, -1.2], [1.2, -1.2], [1.2, 1.2], [-1.2, 1.2]]
"#;

/// Beams of 1°: a third of the work, and a person at 3 m is still seven of them.
pub const BEAMS: GeometryParts = GeometryParts { cluster: 3, ..URG_04LX };

/// Half a torso across, m.
const BODY_M: f64 = 0.2;

/// Points of a contour.
const POINTS: u16 = 7;

/// Who is in the room.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct People {
    pub stands: bool,
    pub walks: bool,
}

impl People {
    pub fn count(self) -> u32 {
        u32::from(self.stands) + u32::from(self.walks)
    }

    /// Where they are.
    fn places(self, at_us: u64) -> impl Iterator<Item = Point> {
        // 0.8 m/s at most.
        let phase = (at_us % 6_000_000) as f64 * 1e-6 / 6.0 * core::f64::consts::TAU;
        let standing = self.stands.then(|| Point::new(-0.6, 0.5));
        let walking = self.walks.then(|| Point::new(0.5, 0.8 * libm::sin(phase)));
        standing.into_iter().chain(walking)
    }

    /// What a module at `pose` sees of them in a scan that begins at `at_us` of the host's clock.
    pub fn seen(self, pose: Pose, at_us: u64) -> Vec<Candidate> {
        silhouettes(self.places(at_us + u64::from(BEAMS.period_us) / 2), pose, BEAMS)
    }
}

/// What a sensor at `pose` with these beams sees of bodies, by step.
pub fn silhouettes(bodies: impl Iterator<Item = Point>, pose: Pose, beams: GeometryParts) -> Vec<Candidate> {
    let geometry = Geometry::new(beams).unwrap();
    let mut bodies: Vec<Point> = bodies.map(|at| pose.to_sensor(at)).collect();
    bodies.sort_by(|one, other| one.length().total_cmp(&other.length()));
    let mut all: Vec<Candidate> = Vec::new();
    for body in bodies {
        if let Some(candidate) = silhouette(body, &geometry, &all) {
            all.push(candidate);
        }
    }
    all.sort_by_key(|candidate| candidate.first_step);
    all
}

/// What is seen of a body, a round one, where no nearer candidate hides it.
fn silhouette(body: Point, geometry: &Geometry, nearer: &[Candidate]) -> Option<Candidate> {
    let (far_m, bearing_rad) = (body.length(), body.angle_rad());
    let range_mm = |beam: u16| -> Option<u16> {
        let aside_m = far_m * libm::sin(f64::from(geometry.bearing_rad(beam)) - bearing_rad);
        let half_m = (BODY_M * BODY_M - aside_m * aside_m).sqrt();
        let front_m = (far_m * far_m - aside_m * aside_m).sqrt() - half_m;
        half_m.is_finite().then_some((front_m * 1000.0) as u16)
    };
    let covers = |candidate: &Candidate, beam: u16| {
        (candidate.first_step..=candidate.last_step).contains(&geometry.step(beam))
    };
    let middle = (bearing_rad - f64::from(geometry.bearing_rad(0))) / f64::from(geometry.beam_rad());
    let (low, high) = ((middle - 30.0).max(0.0) as u16, (middle + 30.0).max(0.0) as u16);
    let hit: Vec<u16> =
        (low..=high.min(geometry.beams() - 1)).filter(|beam| range_mm(*beam).is_some()).collect();
    let free: Vec<u16> =
        hit.iter().copied().filter(|beam| !nearer.iter().any(|other| covers(other, *beam))).collect();
    let (first, last) = (*free.first()?, *free.last()?);
    if last - first < 2 {
        return None;
    }
    let at = |beam: u16| range_mm(beam).unwrap_or(0);
    let near = (first..=last).min_by_key(|beam| at(*beam))?;
    let end = |beam: u16, own: Option<&u16>| {
        let is_free = own == Some(&beam);
        let kind = if is_free { EndKind::Free } else { EndKind::Body };
        End { kind, step_mm: if is_free { 1000 } else { -500 } }
    };
    let point = |point: u16| {
        let beam = first + (u32::from(last - first) * u32::from(point) / u32::from(POINTS - 1)) as u16;
        ((at(beam) - at(near)) / CONTOUR_UNIT_MM).min(255) as u8
    };
    Some(Candidate {
        first_step: geometry.step(first),
        last_step: geometry.step(last),
        first_mm: at(first),
        mid_mm: at(first.midpoint(last)),
        last_mm: at(last),
        near_mm: at(near),
        near_step: geometry.step(near),
        beams: last - first + 1,
        first_end: end(first, hit.first()),
        last_end: end(last, hit.last()),
        contour: (0..POINTS).map(point).collect(),
        ..Candidate::default()
    })
}
