//! One glimpse of the walker against the state: its errors along and across the ray, and how they change with every unknown.
//!
//! ```text
//!   along   r − (1 + s)·|p(t − c) − a| − b(θ)        a: the module, p: the walk, c: its clock, s: its scale
//!   across  r·(bearing − that of p(t − c)) − d(θ)    θ: between the ray and the chest
//!
//!   on panels: the two numbers of  q − R(−yaw)·(p(t − c) − a)        q: the middle of the feet, in the frame of the floor
//! ```

use nalgebra::DVector;

use crate::geometry::{Point, Pose, wrapped};

use super::spline::{Place, Spline};
use super::walk::{By, Glimpse};

/// An error beyond so many σ counts less.
const HUBER: f64 = 1.5;

/// Numbers that say how a body's centre seems off.
pub const SHAPES: usize = 5;

/// From this speed on the chest points along the way, m/s.
const WALKS_M_S: f64 = 0.4;

/// Where each unknown stands: poses, scales, clocks, body.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    pub modules: usize,
    /// Those of them that measure beams; the others are floors.
    pub beams: usize,
}

impl Layout {
    pub const fn pose(self, module: usize) -> Option<usize> {
        if module == 0 { None } else { Some(3 * (module - 1)) }
    }

    pub const fn scale(self, module: usize) -> usize {
        3 * (self.modules - 1) + module
    }

    pub const fn clock(self, module: usize) -> Option<usize> {
        if module == 0 { None } else { Some(4 * self.modules - 3 + module - 1) }
    }

    pub const fn body(self) -> usize {
        5 * self.modules - 4
    }

    pub const fn size(self) -> usize {
        self.body() + SHAPES
    }
}

/// All unknowns.
#[derive(Clone, Debug)]
pub struct State {
    pub poses: Vec<Pose>,
    /// Scales, clocks and body, where the [`Layout`] has them; the places of the poses are not used.
    pub rest: DVector<f64>,
    pub walk: Spline,
}

/// One glimpse against the state: errors along and across, and how they change.
pub struct Row {
    pub errors: [f64; 2],
    pub sigmas: [f64; 2],
    /// First control point and the weights of four.
    pub first: usize,
    pub position: [f64; 4],
    /// Changes of both errors with the walker's place, turned round.
    pub rays: [Point; 2],
    /// Unknowns and the changes of both errors with them; a module has three of pose, scale and clock.
    pub others: [(usize, [f64; 2]); 5 + SHAPES],
    pub count: usize,
}

impl Row {
    pub fn of(glimpse: &Glimpse, state: &State, layout: Layout) -> Self {
        let module = glimpse.module;
        let pose = state.poses[module];
        let clock_s = layout.clock(module).map_or(0.0, |at| state.rest[at]);
        let place = state.walk.place(glimpse.at_s - clock_s);
        let at = state.walk.sum(place.first, &place.position);
        let velocity = state.walk.sum(place.first, &place.velocity);
        let offset = at - pose.at;
        if glimpse.by == By::Panels {
            return Self::on_panels(glimpse, pose, offset, (&place, velocity), layout);
        }
        let away_m = offset.length().max(0.05);
        let ray = offset * (1.0 / away_m);
        let shapes = shapes(velocity, ray);
        let body = layout.body();
        let (mut radial_m, mut tangential_m) = (0.0, 0.0);
        for (shape, changes) in shapes.iter().enumerate() {
            radial_m += state.rest[body + shape] * changes[0];
            tangential_m += state.rest[body + shape] * changes[1];
        }
        let longer = 1.0 + state.rest[layout.scale(module)];
        let aside_rad = wrapped(glimpse.bearing_rad + pose.yaw_rad - offset.angle_rad());
        let errors =
            [glimpse.range_m - longer * away_m - radial_m, glimpse.range_m * aside_rad - tangential_m];
        let (along, across) = (ray * longer, ray.left() * (glimpse.range_m / away_m));
        let mut row = Self {
            errors,
            sigmas: [glimpse.radial_m, glimpse.tangential_m],
            first: place.first,
            position: place.position,
            rays: [along, across],
            others: [(0, [0.0; 2]); 5 + SHAPES],
            count: 0,
        };
        if let Some(at) = layout.pose(module) {
            row.put(at, [along.x, across.x]);
            row.put(at + 1, [along.y, across.y]);
            row.put(at + 2, [0.0, glimpse.range_m]);
        }
        row.put(layout.scale(module), [-away_m, 0.0]);
        if let Some(at) = layout.clock(module) {
            row.put(at, [along.dot(velocity), across.dot(velocity)]);
        }
        for (shape, changes) in shapes.iter().enumerate() {
            row.put(body + shape, changes.map(|change| -change));
        }
        row
    }

    /// That of a floor: `offset` is where the walker is from its corner.
    fn on_panels(
        glimpse: &Glimpse,
        pose: Pose,
        offset: Point,
        (place, velocity): (&Place, Point),
        layout: Layout,
    ) -> Self {
        let (seen, along) = (glimpse.place(), Point::towards(pose.yaw_rad));
        let axes = [along, along.left()];
        let there = axes.map(|axis| axis.dot(offset));
        let mut row = Self {
            errors: [seen.x - there[0], seen.y - there[1]],
            sigmas: [glimpse.radial_m, glimpse.tangential_m],
            first: place.first,
            position: place.position,
            rays: axes,
            others: [(0, [0.0; 2]); 5 + SHAPES],
            count: 0,
        };
        if let Some(at) = layout.pose(glimpse.module) {
            row.put(at, axes.map(|axis| axis.x));
            row.put(at + 1, axes.map(|axis| axis.y));
            row.put(at + 2, [-there[1], there[0]]);
        }
        if let Some(at) = layout.clock(glimpse.module) {
            row.put(at, axes.map(|axis| axis.dot(velocity)));
        }
        row
    }

    fn put(&mut self, unknown: usize, changes: [f64; 2]) {
        self.others[self.count] = (unknown, changes);
        self.count += 1;
    }

    pub fn others(&self) -> &[(usize, [f64; 2])] {
        &self.others[..self.count]
    }

    /// Squared length in σ.
    fn squared(&self) -> f64 {
        (0..2).map(|part| (self.errors[part] / self.sigmas[part]).powi(2)).sum()
    }

    /// Huber's weight and cost.
    pub fn weight(&self) -> (f64, f64) {
        let squared = self.squared();
        let length = squared.sqrt();
        if length <= HUBER { (1.0, 0.5 * squared) } else { (HUBER / length, HUBER * (length - 0.5 * HUBER)) }
    }
}

/// How the body's offsets, along and across, change with its numbers: 1, cos θ, cos 2θ along; sin θ, sin 2θ across.
fn shapes(velocity: Point, along: Point) -> [[f64; 2]; SHAPES] {
    let speed = velocity.length();
    let mut shapes = [[0.0; 2]; SHAPES];
    shapes[0] = [1.0, 0.0];
    if speed > 1e-6 {
        let heading = velocity * (1.0 / speed);
        let sure = (speed / WALKS_M_S).min(1.0);
        let (cosine, sine) = (-heading.dot(along), -heading.cross(along));
        shapes[1] = [sure * cosine, 0.0];
        shapes[2] = [sure * (2.0 * cosine * cosine - 1.0), 0.0];
        shapes[3] = [0.0, sure * sine];
        shapes[4] = [0.0, sure * 2.0 * sine * cosine];
    }
    shapes
}
