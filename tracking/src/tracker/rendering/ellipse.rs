//! The shape of a body before a ray: an ellipse with a soft edge. Eight of them are met by a ray at once.
//!
//! ```text
//!                 ╭─────╮ ← ACROSS_M        a ray from 0 along u, an ellipse (x − c)ᵀ M (x − c) = 1:
//!   ●────────────▸│  ⊙  │                   A = uᵀ M u,  B = cᵀ M u,  C = cᵀ M c
//!                 ╰─────╯                   passes at q half widths, q² = C − B²/A
//!                    ↑ ALONG_M              meets it at (B − √(A (1 − q²))) / A
//! ```

use wide::f32x8;

use crate::geometry::Point;

/// Half axes of a body across and along its heading, m: a torso with hanging arms.
pub const ACROSS_M: f64 = 0.262;
/// See [`ACROSS_M`].
pub const ALONG_M: f64 = 0.138;

/// Share of the rays through the middle of a body that return from it: the others fall between arm and torso.
const OPAQUE: f32 = 0.97;

/// Half the width of a silhouette's edge, as a part of the square of its half width: clothes. And of a hard one.
const EDGE: f32 = 0.42;
const HARD: f32 = 0.004;

/// Ellipses that are met at once.
pub const LANES: usize = 8;

/// How opacity falls at the edge of a silhouette.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    half: f32,
}

impl Edge {
    /// Soft, or hard.
    pub const fn of(soft: bool) -> Self {
        Self { half: if soft { EDGE } else { HARD } }
    }

    /// Opacity to rays whose distances are these squares, in half widths.
    #[inline]
    fn opacity(self, squares: f32x8) -> f32x8 {
        let scale = 0.5 / self.half;
        let past = squares * scale - (1.0 - self.half) * scale;
        let past = past.fast_max(f32x8::ZERO).fast_min(f32x8::ONE);
        past * past * (past * (2.0 * OPAQUE) - 3.0 * OPAQUE) + OPAQUE
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
    /// Of a body.
    #[cfg(test)]
    pub fn body(middle: Point, along: Point, size: f64, depth: f64) -> Self {
        Self { middle, along, across_m: ACROSS_M * size, along_m: ALONG_M * size * depth }
    }

    /// Opacity to a ray from the origin along a unit vector, and the range of its surface there or of the closest approach, m.
    #[cfg(test)]
    pub fn meet_one(&self, towards: Point, edge: Edge) -> (f64, f64) {
        let Layer { opacity, range_m } =
            Ellipses::of(&Lanes::of(std::iter::repeat(*self))).meet(&Ray::along(towards), edge);
        (f64::from(opacity.to_array()[0]), f64::from(range_m.to_array()[0]))
    }
}

/// What each of eight ellipses puts in the way of one ray.
#[derive(Clone, Copy, Debug)]
pub struct Layer {
    /// 0 where the ray passes.
    pub opacity: f32x8,
    /// Of the surface, or of the closest approach, m.
    pub range_m: f32x8,
}

/// A ray from where the ellipses are seen from: a unit vector, and its products.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    x: f32,
    y: f32,
    xx: f32,
    xy: f32,
    yy: f32,
}

impl Ray {
    /// Along a unit vector.
    pub fn along(towards: Point) -> Self {
        let (x, y) = (towards.x as f32, towards.y as f32);
        Self { x, y, xx: x * x, xy: x * y, yy: y * y }
    }
}

/// The sum of eight lanes, in the same order on every machine.
pub fn sum(lanes: f32x8) -> f32 {
    let [a, b, c, d, e, f, g, h] = lanes.to_array();
    ((a + e) + (b + f)) + ((c + g) + (d + h))
}

/// The middles, directions and half axes of eight outlines.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lanes([[f32; LANES]; 6]);

impl Lanes {
    /// Puts an outline into a lane, as rays from an origin meet it.
    pub fn put(&mut self, lane: usize, outline: &Outline, origin: Point) {
        let &Outline { middle, along, across_m, along_m } = outline;
        let of = [middle.x - origin.x, middle.y - origin.y, along.x, along.y, across_m, along_m];
        for (lanes, value) in self.0.iter_mut().zip(of) {
            lanes[lane] = value as f32;
        }
    }

    /// Of these outlines before the origin.
    #[cfg(test)]
    pub fn of(outlines: impl Iterator<Item = Outline>) -> Self {
        let mut lanes = Self::default();
        for (lane, outline) in outlines.take(LANES).enumerate() {
            lanes.put(lane, &outline, Point::default());
        }
        lanes
    }
}

/// Eight ellipses before the rays of one origin.
#[derive(Clone, Copy, Debug)]
pub struct Ellipses {
    /// M: its diagonal, and twice the other element.
    xx: f32x8,
    xy: f32x8,
    yy: f32x8,
    /// M c, and cᵀ M c.
    x: f32x8,
    y: f32x8,
    square: f32x8,
    /// Their middles c, seen from the origin, m.
    middle: [f32x8; 2],
    /// The longer half axis, m.
    most_m: f32x8,
}

impl Ellipses {
    /// Of these outlines.
    pub fn of(lanes: &Lanes) -> Self {
        let [middle_x, middle_y, along_x, along_y, across_m, along_m] = lanes.0.map(f32x8::from);
        let (across, along) = (1.0 / (across_m * across_m), 1.0 / (along_m * along_m));
        let xx = along_y * along_y * across + along_x * along_x * along;
        let yy = along_x * along_x * across + along_y * along_y * along;
        let other = along_x * along_y * (along - across);
        let (x, y) = (xx * middle_x + other * middle_y, other * middle_x + yy * middle_y);
        Self {
            xx,
            xy: other + other,
            yy,
            x,
            y,
            square: x * middle_x + y * middle_y,
            middle: [middle_x, middle_y],
            most_m: across_m.fast_max(along_m),
        }
    }

    /// What a ray meets.
    #[inline]
    pub fn meet(&self, ray: &Ray, edge: Edge) -> Layer {
        let inverse = 1.0 / (self.xx * ray.xx + self.xy * ray.xy + self.yy * ray.yy);
        let ahead = self.x * ray.x + self.y * ray.y;
        let closest_m = ahead * inverse;
        let square = self.square - ahead * closest_m;
        let depth_m = ((f32x8::ONE - square).fast_max(f32x8::ZERO) * inverse).sqrt();
        Layer { opacity: edge.opacity(square), range_m: closest_m - depth_m }
    }

    /// No part of them is nearer to the origin, m.
    pub fn nearest_m(&self) -> f32 {
        let [x, y] = self.middle;
        let nearest_m = (x * x + y * y).sqrt() - self.most_m;
        nearest_m.to_array().into_iter().fold(f32::INFINITY, f32::min)
    }

    /// The angles from a direction between which all that they cover lies, from right to left; all around where it is not surely ahead.
    ///
    /// In the frame of the direction a ray along (1, t) passes at the edge where B² = (C − 1 − EDGE) A.
    pub fn shadow_rad(&self, towards: Point) -> (f64, f64) {
        let (cosine, sine) = (towards.x as f32, towards.y as f32);
        let (x, y) = (self.x * cosine + self.y * sine, self.y * cosine - self.x * sine);
        let (turned, crossed) = (self.xy * (cosine * sine), (self.yy - self.xx) * (cosine * sine));
        let xx = self.xx * (cosine * cosine) + self.yy * (sine * sine) + turned;
        let yy = self.xx * (sine * sine) + self.yy * (cosine * cosine) - turned;
        let xy = self.xy * (0.5 * (cosine * cosine - sine * sine)) + crossed;
        let outside = self.square - (1.0 + EDGE);
        let (p, q, r) = (outside * xx - x * x, x * y - outside * xy, outside * yy - y * y);
        // r t² − 2 q t + p = 0
        let root = (q * q - p * r).fast_max(f32x8::ZERO).sqrt();
        let (first, last) = ((q - root) / r, (q + root) / r);
        let is_ahead = outside.simd_gt(f32x8::ZERO) & r.simd_gt(f32x8::ZERO) & x.simd_gt(f32x8::ZERO);
        if !is_ahead.all() {
            return (f64::NEG_INFINITY, f64::INFINITY);
        }
        let least = first.to_array().into_iter().fold(f32::INFINITY, f32::min);
        let most = last.to_array().into_iter().fold(f32::NEG_INFINITY, f32::max);
        (libm::atan(f64::from(least)), libm::atan(f64::from(most)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_through_the_middle_meets_the_near_side() {
        let edge = Edge::of(true);
        let body = Outline::body(Point::new(2.0, 0.0), Point::new(1.0, 0.0), 1.0, 1.0);
        let (part, range_m) = body.meet_one(Point::new(1.0, 0.0), edge);
        assert!(part > 0.96 && (range_m - (2.0 - ALONG_M)).abs() < 1e-6, "{part} {range_m}");
        let beside = Outline::body(Point::new(2.0, 0.4), Point::new(1.0, 0.0), 1.0, 1.0);
        assert_eq!(beside.meet_one(Point::new(1.0, 0.0), edge).0, 0.0);
        let turned = Outline::body(Point::new(2.0, 0.0), Point::new(0.0, 1.0), 1.0, 1.0);
        assert!((turned.meet_one(Point::new(1.0, 0.0), edge).1 - (2.0 - ACROSS_M)).abs() < 1e-6);
    }

    #[test]
    fn opacity_falls_from_all_to_nothing_at_the_edge() {
        let at = |passes: f64, soft| {
            let body = Outline::body(Point::new(2.0, passes * ACROSS_M), Point::new(1.0, 0.0), 1.0, 1.0);
            body.meet_one(Point::new(1.0, 0.0), Edge::of(soft)).0
        };
        let passes = [0.0, 0.76, 0.9, 1.0, 1.1, 1.2];
        let soft = passes.map(|passes| at(passes, true));
        assert!(soft.windows(2).all(|two| two[0] >= two[1]), "{soft:?}");
        assert!(
            (soft[1] - 0.97).abs() < 1e-6 && (soft[3] - 0.485).abs() < 1e-3 && soft[5] == 0.0,
            "{soft:?}"
        );
        assert!(at(0.99, false) > 0.96 && at(1.01, false) == 0.0);
    }

    #[test]
    fn the_shadow_is_what_the_rays_meet() {
        let edge = Edge::of(true);
        let outline = |lane: usize| {
            let at = Point::towards(0.1 * lane as f64) * (0.5 + 0.2 * lane as f64);
            Outline::body(at, Point::towards(lane as f64), 1.0, 1.0 + 0.1 * lane as f64)
        };
        let ellipses = Ellipses::of(&Lanes::of((0..LANES).map(outline)));
        for aim_rad in [-0.5, 0.0, 0.3] {
            let (first_rad, last_rad) = ellipses.shadow_rad(Point::towards(aim_rad));
            let mut met_rad: Option<(f64, f64)> = None;
            for step in -1500..1500 {
                let off_rad = 0.001 * f64::from(step);
                let met = ellipses.meet(&Ray::along(Point::towards(aim_rad + off_rad)), edge);
                let meets = |(opacity, range_m): (f32, f32)| opacity > 0.0 && range_m > 0.0;
                if met.opacity.to_array().into_iter().zip(met.range_m.to_array()).any(meets) {
                    met_rad = Some((met_rad.map_or(off_rad, |met_rad| met_rad.0), off_rad));
                }
            }
            let (from_rad, to_rad) = met_rad.unwrap();
            assert!(
                (first_rad - from_rad).abs() < 0.01 && (last_rad - to_rad).abs() < 0.01,
                "{aim_rad}: {first_rad} {last_rad}"
            );
        }
        let (first_rad, last_rad) = ellipses.shadow_rad(Point::new(-1.0, 0.0));
        assert!(first_rad.is_infinite() && last_rad.is_infinite());
    }
}
