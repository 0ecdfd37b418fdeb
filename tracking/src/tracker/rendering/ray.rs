//! The likelihood of a ray, given bodies: soft opacity, transmittance, range noise, clutter.
//!
//! ```text
//!            e₁ v₁ α₁        e₂ v₂ α₂                     T_n = ∏ (1 − α_m) before surface n
//!   ●─────────█───────────────▓──────────────┃ background
//!      T = 1     T = 1 − α₁      T = (1 − α₁)(1 − α₂)
//!
//!   p(z) = Σ T_n α_n N(z; e_n, v_n) + T_end p_background(z) + clutter
//! ```
//!
//! Lengths in m, densities per m. Occlusion, partial views, merged silhouettes and free space all come out of this sum.

use std::sync::LazyLock;

use super::scan::Measured;
use crate::geometry::Point;

/// Half axes of a body across and along its heading, m: a torso with hanging arms.
pub const ACROSS_M: f64 = 0.262;
/// See [`ACROSS_M`].
pub const ALONG_M: f64 = 0.138;

/// Share of the rays through the middle of a body that return from it: the others fall between arm and torso.
const OPAQUE: f64 = 0.97;

/// Width of a silhouette's edge, of its half width: clothes.
const EDGE: f64 = 0.07;

/// Rays that pass at more than this multiple of the half width miss: the opacity is below 1 %.
pub const MISS: f64 = 1.35;

/// Range noise with the body's roughness: standard deviation m and share, of most rays and of those on arms and folds.
const NOISE: [(f64, f64); 2] = [(0.028, 0.85), (0.080, 0.15)];

/// Density of ranges from what no body explains, 1/m: arms, bags, dust.
pub const CLUTTER: f64 = 0.10;

/// Density of a background return at the background, 1/m: certain within 10 cm.
const BACKGROUND: f64 = 10.0;

/// Steps of the opacity table to a half width.
const OPACITY_STEPS: f64 = 128.0;

/// With soft edges, and with hard ones.
static OPACITY: LazyLock<[Vec<f64>; 2]> = LazyLock::new(|| {
    let entries = (MISS * OPACITY_STEPS) as usize + 2;
    let off = |entry: usize| entry as f64 / OPACITY_STEPS - 1.0;
    let soft = |entry| OPAQUE / (1.0 + libm::exp(off(entry) / EDGE));
    let hard = |entry| if off(entry) < 0.0 { OPAQUE } else { 0.0 };
    [(0..entries).map(soft).collect(), (0..entries).map(hard).collect()]
});

/// Steps of the noise table to a metre.
const NOISE_STEPS: f64 = 2000.0;

static NOISE_DENSITY: LazyLock<Vec<f64>> = LazyLock::new(|| {
    (0..=(0.4 * NOISE_STEPS) as usize).map(|entry| mixture(entry as f64 / NOISE_STEPS, 0.0)).collect()
});

/// The tables, looked up once for many rays.
#[derive(Clone, Copy)]
pub struct Tables {
    opacity: &'static [f64],
    noise: &'static [f64],
}

impl Tables {
    /// With soft edges of silhouettes, or with hard ones.
    pub fn of(soft: bool) -> Self {
        let [with_soft, with_hard] = &*OPACITY;
        Self { opacity: if soft { with_soft } else { with_hard }, noise: &NOISE_DENSITY }
    }

    #[cfg(test)]
    pub fn get() -> Self {
        Self::of(true)
    }

    fn opacity(self, off: f64) -> f64 {
        self.opacity.get((off * OPACITY_STEPS) as usize).copied().unwrap_or(0.0)
    }

    /// Density of a range that is `off_m` from a surface.
    pub fn noise(self, off_m: f64) -> f64 {
        self.noise.get((off_m.abs() * NOISE_STEPS) as usize).copied().unwrap_or(0.0)
    }
}

/// Density of a range that is `off_m` from a surface whose range has a variance of its own.
fn mixture(off_m: f64, variance_m2: f64) -> f64 {
    let part = |(sd_m, share): (f64, f64)| {
        let variance = sd_m * sd_m + variance_m2;
        share * libm::exp(-0.5 * off_m * off_m / variance) / libm::sqrt(core::f64::consts::TAU * variance)
    };
    NOISE.into_iter().map(part).sum()
}

/// An ellipse, in the frame of a ray's origin, in which it is the unit circle.
#[derive(Clone, Copy, Debug)]
pub struct Ellipse {
    /// Unit vector across the heading over the half axis, and along it.
    across: Point,
    along: Point,
    /// The origin there.
    origin: Point,
}

impl Ellipse {
    /// With its middle `offset` from the ray's origin, `heading` a unit vector, `size` 1 for an ordinary body.
    pub fn new(offset: Point, heading: Point, size: f64) -> Self {
        let across = heading.left() * (1.0 / (ACROSS_M * size));
        let along = heading * (1.0 / (ALONG_M * size));
        Self { across, along, origin: Point::new(-offset.dot(across), -offset.dot(along)) }
    }

    /// Opacity to a ray along the unit vector `towards`, and the range of the surface, or of the closest approach.
    pub fn meet(&self, towards: Point, tables: Tables) -> (f64, f64) {
        let way = Point::new(towards.dot(self.across), towards.dot(self.along));
        let square = way.dot(way);
        let closest = -self.origin.dot(way) / square;
        let off_square = self.origin.dot(self.origin) - closest * closest * square;
        if off_square < 1.0 {
            let range_m = closest - ((1.0 - off_square) / square).sqrt();
            (tables.opacity(off_square.max(0.0).sqrt()), range_m)
        } else {
            (tables.opacity(off_square.sqrt()), closest)
        }
    }
}

/// What one body puts in the way of one beam, on the average of its cloud.
#[derive(Clone, Copy, Debug, Default)]
pub struct Surface {
    pub opacity: f64,
    pub range_m: f64,
    pub variance_m2: f64,
}

/// Most bodies in the way of one beam; farther ones are behind a wall of people.
const DEEP: usize = 6;

/// The likelihood of a beam without the body that is being updated, as prefix sums over the surfaces in its way.
#[derive(Clone, Copy, Debug)]
pub struct Mixture {
    measured: Measured,
    /// Ranges of the surfaces, nearest first; then infinity.
    ranges_m: [f64; DEEP],
    /// Likelihood from the surfaces before each, and the transmittance there; the last is behind all of them.
    before: [(f64, f64); DEEP + 1],
    /// Likelihood of the beam without the body.
    pub without: f64,
    inverse: f64,
}

impl Mixture {
    /// Of the surfaces in the way of a beam, in any order. `None` when it says nothing.
    pub fn new(measured: Measured, surfaces: &mut [Surface]) -> Option<Self> {
        surfaces.sort_unstable_by(|one, other| one.range_m.total_cmp(&other.range_m));
        let mut ranges_m = [f64::INFINITY; DEEP];
        let mut before = [(0.0, 1.0); DEEP + 1];
        let (mut sum, mut transmittance) = (0.0, 1.0);
        let background = match measured {
            Measured::Unknown => return None,
            Measured::Free(_) => BACKGROUND,
            Measured::Hit(_) => 0.0,
        };
        for (index, surface) in surfaces.iter().take(DEEP).enumerate() {
            before[index] = (sum, transmittance);
            ranges_m[index] = surface.range_m;
            match measured {
                Measured::Hit(range_m) => {
                    sum += transmittance
                        * surface.opacity
                        * mixture(range_m - surface.range_m, surface.variance_m2);
                    transmittance *= 1.0 - surface.opacity;
                }
                // What stands beyond the free range is not seen.
                Measured::Free(range_m) if surface.range_m < range_m => {
                    transmittance *= 1.0 - surface.opacity
                }
                Measured::Free(_) | Measured::Unknown => {}
            }
        }
        let deep = surfaces.len().min(DEEP);
        for entry in &mut before[deep..] {
            *entry = (sum, transmittance);
        }
        let behind = transmittance * background;
        let without = sum + behind + CLUTTER;
        Some(Self { measured, ranges_m, before, without, inverse: 1.0 / without })
    }

    /// Likelihood with a body of this opacity at this range, over that without it.
    pub fn ratio(&self, opacity: f64, range_m: f64, tables: Tables) -> f64 {
        let (density, passes) = match self.measured {
            Measured::Hit(measured_m) => (tables.noise(measured_m - range_m), 1.0 - opacity),
            Measured::Free(free_m) if range_m < free_m => (0.0, 1.0 - opacity),
            Measured::Free(_) | Measured::Unknown => return 1.0,
        };
        let index = self.ranges_m.iter().take_while(|&&other_m| other_m < range_m).count();
        let (sum, transmittance) = self.before[index];
        let rest = self.without - sum - CLUTTER;
        (sum + transmittance * opacity * density + passes * rest + CLUTTER) * self.inverse
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WALL: Surface = Surface { opacity: 0.97, range_m: 1.0, variance_m2: 0.0 };

    #[test]
    fn a_ray_through_the_middle_meets_the_near_side() {
        let tables = Tables::get();
        let body = Ellipse::new(Point::new(2.0, 0.0), Point::new(1.0, 0.0), 1.0);
        let (opacity, range_m) = body.meet(Point::new(1.0, 0.0), tables);
        assert!(opacity > 0.96 && (range_m - (2.0 - ALONG_M)).abs() < 1e-9, "{opacity} {range_m}");
        let beside = Ellipse::new(Point::new(2.0, 0.4), Point::new(1.0, 0.0), 1.0);
        assert!(beside.meet(Point::new(1.0, 0.0), tables).0 < 0.01);
        let turned = Ellipse::new(Point::new(2.0, 0.0), Point::new(0.0, 1.0), 1.0);
        assert!((turned.meet(Point::new(1.0, 0.0), tables).1 - (2.0 - ACROSS_M)).abs() < 1e-9);
    }

    #[test]
    fn a_ratio_is_what_the_whole_mixture_says() {
        let tables = Tables::get();
        let cases = [Measured::Hit(1.01), Measured::Hit(1.5), Measured::Hit(2.2), Measured::Free(3.0)];
        for measured in cases {
            for range_m in [0.9, 1.5, 2.0] {
                let body = Surface { opacity: 0.7, range_m, variance_m2: 0.0 };
                let other = Surface { opacity: 0.5, range_m: 2.5, variance_m2: 0.01 };
                let without = Mixture::new(measured, &mut [WALL, other]).unwrap();
                let with = Mixture::new(measured, &mut [other, body, WALL]).unwrap();
                let (ratio, whole) =
                    (without.ratio(body.opacity, body.range_m, tables), with.without / without.without);
                assert!((ratio / whole - 1.0).abs() < 0.05, "{measured:?} {range_m}: {ratio} {whole}");
            }
        }
    }

    #[test]
    fn what_is_behind_somebody_says_nothing() {
        let tables = Tables::get();
        let mixture = Mixture::new(Measured::Hit(1.0), &mut [WALL]).unwrap();
        assert!((mixture.ratio(0.97, 2.0, tables) - 1.0).abs() < 0.02);
        assert!(mixture.ratio(0.97, 0.5, tables) < 0.1, "it would have been seen");
    }

    #[test]
    fn beyond_the_free_range_nothing_is_known() {
        let tables = Tables::get();
        let mixture = Mixture::new(Measured::Free(2.5), &mut []).unwrap();
        assert!((mixture.ratio(0.97, 3.0, tables) - 1.0).abs() < 1e-12);
        assert!(mixture.ratio(0.97, 2.0, tables) < 0.05);
        assert!(Mixture::new(Measured::Unknown, &mut []).is_none());
    }
}
