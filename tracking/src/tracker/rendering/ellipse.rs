//! The shape of a body before a ray: an ellipse with a soft edge.
//!
//! ```text
//!                 ╭─────╮ ← ACROSS_M        in the frame in which the ellipse is the unit circle,
//!   ●────────────▸│  ⊙  │                   a ray that passes at q half widths meets
//!                 ╰─────╯                   0.97 / (1 + exp((q − 1) / 0.07)) of it
//!                    ↑ ALONG_M
//! ```

use std::array::from_fn;
use std::ops::Range;
use std::sync::LazyLock;

use crate::geometry::Point;

/// Half axes of a body across and along its heading, m: a torso with hanging arms.
pub const ACROSS_M: f64 = 0.262;
/// See [`ACROSS_M`].
pub const ALONG_M: f64 = 0.138;

/// Share of the rays through the middle of a body that return from it: the others fall between arm and torso.
const OPAQUE: f64 = 0.97;

/// Width of a silhouette's edge, of its half width: clothes.
const EDGE: f64 = 0.07;

/// Rays that pass at more than this multiple of the half width miss: the opacity is below 3 %.
pub const MISS: f64 = 1.25;

/// Steps of the table to the square of a half width.
const STEPS: f64 = 256.0;

/// With soft edges, and with hard ones.
static TABLES: LazyLock<[Vec<f64>; 2]> = LazyLock::new(|| {
    let entries = (MISS * MISS * STEPS) as usize + 1;
    let off = |entry: usize| (entry as f64 / STEPS).sqrt() - 1.0;
    let soft = |entry| OPAQUE / (1.0 + libm::exp(off(entry) / EDGE));
    let hard = |entry| if off(entry) < 0.0 { OPAQUE } else { 0.0 };
    [(0..entries).map(soft).collect(), (0..entries).map(hard).collect()]
});

/// The nearest whole number, of one that is not negative; a number that no table holds where it is large or none. Several
/// take three instructions, where a cast takes ten for each.
pub const fn nearest_step(steps: f32) -> u32 {
    /// From here on the numbers of single precision are whole, and the last bits count them.
    const WHOLE: f32 = 8_388_608.0;
    const MOST: f32 = 65_536.0;
    let steps = if steps < MOST { steps } else { MOST };
    (steps + WHOLE).to_bits() & 0x7f_ffff
}

/// Opacity by the distance at which a ray passes, looked up once for many rays.
#[derive(Clone, Copy)]
pub struct Opacity(&'static [f64]);

impl Opacity {
    /// With soft edges of silhouettes, or with hard ones.
    pub fn of(soft: bool) -> Self {
        let [with_soft, with_hard] = &*TABLES;
        Self(if soft { with_soft } else { with_hard })
    }

    /// To a ray whose square of half widths is so many steps.
    fn to(self, steps: u32) -> f64 {
        self.0.get(steps as usize).copied().unwrap_or(0.0)
    }
}

/// Beams that are met at once.
pub const LANES: usize = 4;

/// What neighbouring beams of a fan meet.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    /// Place of the first of them.
    pub first: usize,
    /// Opacities: 0 where a beam passes.
    pub opacity: [f64; LANES],
    /// Ranges of the surface or of the closest approach, m.
    pub range_m: [f32; LANES],
}

/// Directions of beams, by coordinate, so that several are met at once; the last one fills up.
#[derive(Clone, Debug, Default)]
pub struct Fan {
    x: Vec<f32>,
    y: Vec<f32>,
}

impl Fan {
    /// Of unit vectors.
    pub fn of(directions: impl Iterator<Item = Point>) -> Self {
        let (mut x, mut y): (Vec<f32>, Vec<f32>) =
            directions.map(|towards| (towards.x as f32, towards.y as f32)).unzip();
        let filled = x.len() + LANES;
        x.resize(filled, x.last().copied().unwrap_or(1.0));
        y.resize(filled, y.last().copied().unwrap_or(0.0));
        Self { x, y }
    }
}

/// An ellipse in the site.
#[derive(Clone, Copy, Debug)]
pub struct Outline {
    pub middle: Point,
    /// Unit vector of one axis.
    pub along: Point,
    /// Half axes across and along it, m.
    pub across_m: f64,
    pub along_m: f64,
}

impl Outline {
    /// Of a body as a ray from the origin meets it.
    #[cfg(test)]
    pub fn body(middle: Point, along: Point, size: f64, depth: f64) -> Ellipse {
        let outline = Self { middle, along, across_m: ACROSS_M * size, along_m: ALONG_M * size * depth };
        outline.before(Point::default(), Point::default())
    }

    /// Half its width as it is seen along `way`, m, times the length of `way`.
    pub fn half_width_m(&self, way: Point) -> f64 {
        let (across, along) = (way.dot(self.along) * self.across_m, way.cross(self.along) * self.along_m);
        (across * across + along * along).sqrt()
    }

    /// The same as rays from `origin` meet it, after it has moved by `moved`.
    pub fn before(&self, origin: Point, moved: Point) -> Ellipse {
        let offset = self.middle + moved - origin;
        let across = self.along.left() * (1.0 / self.across_m);
        let along = self.along * (1.0 / self.along_m);
        let single = |point: Point| [point.x as f32, point.y as f32];
        let origin = Point::new(-offset.dot(across), -offset.dot(along));
        Ellipse { across: single(across), along: single(along), origin: single(origin) }
    }
}

/// An ellipse, in the frame of a ray's origin, in which it is the unit circle.
#[derive(Clone, Copy, Debug)]
pub struct Ellipse {
    /// Unit vector across the heading over the half axis, and along it.
    across: [f32; 2],
    along: [f32; 2],
    /// The origin there.
    origin: [f32; 2],
}

impl Ellipse {
    /// Calls `each` for the beams of a fan, of these places, that the ellipse does not let pass: with the place, the
    /// opacity, and the range of the surface or of the closest approach, m.
    pub fn meet(
        &self,
        fan: &Fan,
        places: Range<usize>,
        table: Opacity,
        mut each: impl FnMut(usize, f64, f32),
    ) {
        let end = places.end;
        self.meet_blocks(fan, places, table, |Block { first, opacity, range_m }| {
            for ((place, opacity), range_m) in (first..end).zip(opacity).zip(range_m) {
                if opacity > 0.0 {
                    each(place, opacity, range_m);
                }
            }
        });
    }

    /// Calls `each` for the blocks that hold these places; the last one may hold some more.
    #[inline]
    pub fn meet_blocks(&self, fan: &Fan, places: Range<usize>, table: Opacity, mut each: impl FnMut(Block)) {
        let filled = places.start..places.start + places.len().next_multiple_of(LANES);
        let (Some(x), Some(y)) = (fan.x.get(filled.clone()), fan.y.get(filled)) else { return };
        let mut first = places.start;
        for (x, y) in x.as_chunks().0.iter().zip(y.as_chunks().0) {
            let (steps, range_m) = self.meet_some(x, y);
            each(Block { first, opacity: steps.map(|steps| table.to(steps)), range_m });
            first += LANES;
        }
    }

    /// The same for one beam along a unit vector.
    #[cfg(test)]
    pub fn meet_one(&self, towards: Point, table: Opacity) -> (f64, f64) {
        let mut met = (0.0, f64::INFINITY);
        self.meet(&Fan::of([towards].into_iter()), 0..1, table, |_, opacity, range_m| {
            met = (opacity, f64::from(range_m));
        });
        met
    }

    /// Squares of the distance in half widths, in steps of the table, and ranges.
    // Inlined, its lanes are taken apart.
    #[inline(never)]
    fn meet_some(&self, x: &[f32; LANES], y: &[f32; LANES]) -> ([u32; LANES], [f32; LANES]) {
        let across: [f32; LANES] = from_fn(|lane| x[lane] * self.across[0] + y[lane] * self.across[1]);
        let along: [f32; LANES] = from_fn(|lane| x[lane] * self.along[0] + y[lane] * self.along[1]);
        let inverse: [f32; LANES] =
            from_fn(|lane| 1.0 / (across[lane] * across[lane] + along[lane] * along[lane]));
        let off: [f32; LANES] = from_fn(|lane| self.origin[0] * along[lane] - self.origin[1] * across[lane]);
        let off_square: [f32; LANES] = from_fn(|lane| off[lane] * off[lane] * inverse[lane]);
        let range_m = from_fn(|lane| {
            let closest_m = -(self.origin[0] * across[lane] + self.origin[1] * along[lane]) * inverse[lane];
            closest_m - ((1.0 - off_square[lane]).max(0.0) * inverse[lane]).sqrt()
        });
        (from_fn(|lane| nearest_step(off_square[lane] * STEPS as f32)), range_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_through_the_middle_meets_the_near_side() {
        let opacity = Opacity::of(true);
        let body = Outline::body(Point::new(2.0, 0.0), Point::new(1.0, 0.0), 1.0, 1.0);
        let (part, range_m) = body.meet_one(Point::new(1.0, 0.0), opacity);
        assert!(part > 0.96 && (range_m - (2.0 - ALONG_M)).abs() < 1e-6, "{part} {range_m}");
        let beside = Outline::body(Point::new(2.0, 0.4), Point::new(1.0, 0.0), 1.0, 1.0);
        assert!(beside.meet_one(Point::new(1.0, 0.0), opacity).0 < 0.01);
        let turned = Outline::body(Point::new(2.0, 0.0), Point::new(0.0, 1.0), 1.0, 1.0);
        assert!((turned.meet_one(Point::new(1.0, 0.0), opacity).1 - (2.0 - ACROSS_M)).abs() < 1e-6);
    }

    #[test]
    fn beams_that_are_met_together_are_met_as_each_alone() {
        let table = Opacity::of(true);
        let body = Outline::body(Point::new(1.5, 0.2), Point::new(0.6, 0.8), 1.1, 1.3);
        let towards: Vec<Point> = (0..11).map(|beam| Point::towards(f64::from(beam) * 0.05 - 0.1)).collect();
        let mut met = Vec::new();
        let fan = Fan::of(towards.iter().copied());
        body.meet(&fan, 1..11, table, |place, opacity, range_m| {
            met.push((place, opacity, f64::from(range_m)))
        });
        let one = |place: usize| (place, body.meet_one(towards[place], table));
        let alone: Vec<_> = (1..11)
            .map(one)
            .filter(|(_, (opacity, _))| *opacity > 0.0)
            .map(|(place, (opacity, range_m))| (place, opacity, range_m))
            .collect();
        assert!(met.len() > 4 && met == alone, "{met:?}");
    }
}
