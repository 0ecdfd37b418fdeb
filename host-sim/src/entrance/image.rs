//! What a perfect camera would see: depths, and whose they are.
//!
//! ```text
//!   column: one ray in the plane ─▶ enters an ellipse at t₁, leaves it at t₂
//!
//!   rows of that column      ▔▔▔▔   top, where it is below the lens and between t₁ and t₂
//!                            ▓▓▓▓   side: at depth t₁, from the upper to the lower end
//! ```
//!
//! The camera is level: all rays of a column lie over one ray of the plane, and its length along x is the depth. So a
//! part of a body costs a square root a column, not a pixel.

use crate::world::geometry::Point;

use super::CAMERA;
use super::stack::{Cut, Stack};

/// Depth of the wall opposite, m.
pub(super) const WALL_M: f64 = 5.8;

/// Whose a pixel is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Whose {
    /// Of the room.
    Room,
    /// Of the person of this number.
    Person(u16),
    /// Of a bag.
    Bag,
}

/// Depths and owners, row by row.
#[derive(Clone, PartialEq, Debug)]
pub struct Image {
    /// m, along the optical axis.
    pub depth_m: Vec<f32>,
    /// Whose each is.
    pub whose: Vec<Whose>,
}

/// Tangent of the angle above the horizontal under which a row looks.
fn up(row: usize) -> f64 {
    (CAMERA.height as f64 * 0.5 - 0.5 - row as f64) / f64::from(CAMERA.focal_px())
}

/// Tangent of the angle to the left under which a column looks.
fn left(column: usize) -> f64 {
    (CAMERA.width as f64 * 0.5 - 0.5 - column as f64) / f64::from(CAMERA.focal_px())
}

/// The columns, or rows, of `count` between two tangents.
fn between(low: f64, high: f64, count: usize) -> std::ops::Range<usize> {
    let index = |tangent: f64| {
        (count as f64 * 0.5 - 0.5 - tangent * f64::from(CAMERA.focal_px())).clamp(-1.0, count as f64)
    };
    let first = index(high).ceil().max(0.0) as usize;
    let last = (index(low).floor() + 1.0).clamp(0.0, count as f64) as usize;
    first..last.max(first)
}

impl Image {
    /// The room.
    #[must_use]
    pub fn empty() -> Self {
        let height_m = f64::from(CAMERA.height_m);
        let row = |row: usize| {
            let floor_m = if up(row) < 0.0 { -height_m / up(row) } else { f64::INFINITY };
            std::iter::repeat_n(floor_m.min(WALL_M) as f32, CAMERA.width)
        };
        let depth_m: Vec<f32> = (0..CAMERA.height).flat_map(row).collect();
        Self { whose: vec![Whose::Room; depth_m.len()], depth_m }
    }

    /// Puts a body in; the number of pixels that it would fill if nothing stood before it.
    pub fn add(&mut self, stack: &Stack, whose: Whose) -> usize {
        let mut own = vec![f32::INFINITY; self.depth_m.len()];
        for cut in &stack.cuts {
            draw(&mut own, cut);
        }
        let mut alone = 0;
        for ((depth_m, owner), own_m) in self.depth_m.iter_mut().zip(&mut self.whose).zip(own) {
            if own_m.is_finite() {
                alone += 1;
                if own_m < *depth_m {
                    (*depth_m, *owner) = (own_m, whose);
                }
            }
        }
        alone
    }

    /// How many pixels are of this owner.
    #[must_use]
    pub fn pixels(&self, whose: Whose) -> usize {
        self.whose.iter().filter(|owner| **owner == whose).count()
    }
}

/// Draws a part into an image of its body alone.
fn draw(depth_m: &mut [f32], cut: &Cut) {
    let reach_m = cut.half_axes_m.0.max(cut.half_axes_m.1);
    let nearest_m = cut.centre.x - reach_m;
    // The lens is not inside a body, and what is beside it is not seen.
    if nearest_m < 0.1 {
        return;
    }
    let (low_m, high_m) = cut.heights_m;
    let lens_m = f64::from(CAMERA.height_m);
    let side = |y_m: f64| [y_m / nearest_m, y_m / (cut.centre.x + reach_m)];
    let [one, other] = [side(cut.centre.y - reach_m), side(cut.centre.y + reach_m)];
    let columns = between(one[0].min(one[1]), other[0].max(other[1]), CAMERA.width);
    let mut fill = |column: usize, rows: std::ops::Range<usize>, depth: &dyn Fn(usize) -> f64| {
        for row in rows {
            if let Some(pixel) = depth_m.get_mut(row * CAMERA.width + column) {
                *pixel = pixel.min(depth(row) as f32);
            }
        }
    };
    for column in columns {
        let Some((enters_m, leaves_m)) = crossing(cut, left(column)) else { continue };
        let tangent = |height_m: f64, at_m: f64| (height_m - lens_m) / at_m;
        let rows = between(tangent(low_m, enters_m), tangent(high_m, enters_m), CAMERA.height);
        fill(column, rows, &|_| enters_m);
        for end_m in [low_m, high_m] {
            // The upper end is seen from above, the lower one from below.
            if (end_m == high_m) == (end_m < lens_m) {
                let (near, far) = (tangent(end_m, enters_m), tangent(end_m, leaves_m));
                let rows = between(near.min(far), near.max(far), CAMERA.height);
                fill(column, rows, &|row| ((end_m - lens_m) / up(row)).clamp(enters_m, leaves_m));
            }
        }
    }
}

/// Depths at which the ray (1, `left`) enters and leaves a cut.
fn crossing(cut: &Cut, left: f64) -> Option<(f64, f64)> {
    let (along_m, across_m) = cut.half_axes_m;
    let squeeze =
        |vector: Point| Point::new(vector.dot(cut.axis) / along_m, vector.dot(cut.axis.left()) / across_m);
    let (ray, centre) = (squeeze(Point::new(1.0, left)), squeeze(cut.centre));
    let (a, b, c) = (ray.dot(ray), ray.dot(centre), centre.dot(centre) - 1.0);
    let square = b * b - a * c;
    (square > 0.0 && b > 0.0).then(|| ((b - square.sqrt()) / a, (b + square.sqrt()) / a))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pillar(x: f64, y: f64, heights_m: (f64, f64)) -> Stack {
        let axis = Point::towards(0.4);
        Stack { cuts: vec![Cut { centre: Point::new(x, y), axis, half_axes_m: (0.2, 0.12), heights_m }] }
    }

    #[test]
    fn every_pixel_of_a_pillar_lies_on_it_and_no_other_does() {
        for heights_m in [(0.0, 1.7), (0.0, 0.5), (1.2, 1.4)] {
            let (stack, mut image) = (pillar(2.0, 0.4, heights_m), Image::empty());
            let alone = image.add(&stack, Whose::Bag);
            assert!(alone > 300 && alone == image.pixels(Whose::Bag), "{alone}");
            for (index, depth_m) in image.depth_m.iter().enumerate() {
                let (column, row) = (index % CAMERA.width, index / CAMERA.width);
                // March along the ray of the crate's own camera.
                let [x, y, z] = CAMERA.ray(column, row).map(f64::from);
                let inside = |depth_m: f64| {
                    let cut = stack.cuts[0];
                    let off = Point::new(depth_m * x, depth_m * y) - cut.centre;
                    let (u, v) = (off.dot(cut.axis) / 0.2, off.dot(cut.axis.left()) / 0.12);
                    u * u + v * v < 1.0 && (heights_m.0..heights_m.1).contains(&(1.0 + depth_m * z))
                };
                let first = (1700..2300).map(|mm| f64::from(mm) * 1e-3).find(|depth_m| inside(*depth_m));
                match first {
                    Some(first_m) => assert!((first_m - f64::from(*depth_m)).abs() < 0.003, "{column} {row}"),
                    // Grazing rays are in the ellipse for less than a step.
                    None => assert!(
                        image.whose[index] == Whose::Room
                            || (0..40).any(|n| inside(f64::from(*depth_m) + f64::from(n - 20) * 1e-4)),
                        "{column} {row} {depth_m}"
                    ),
                }
            }
        }
    }

    #[test]
    fn the_nearer_body_hides_the_farther_one() {
        let mut image = Image::empty();
        let behind = image.add(&pillar(3.0, 0.0, (0.0, 1.5)), Whose::Person(7));
        image.add(&pillar(2.0, 0.0, (0.0, 1.7)), Whose::Person(8));
        assert!(image.pixels(Whose::Person(7)) < behind / 5);
        // The other way round it is the same image.
        let mut turned = Image::empty();
        turned.add(&pillar(2.0, 0.0, (0.0, 1.7)), Whose::Person(8));
        assert_eq!(turned.add(&pillar(3.0, 0.0, (0.0, 1.5)), Whose::Person(7)), behind);
        assert_eq!(image, turned);
    }
}
