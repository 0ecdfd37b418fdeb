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

/// Range noise with the body's roughness: standard deviation m and share, of most rays and of those on arms and folds.
const NOISE: [(f64, f64); 2] = [(0.028, 0.85), (0.080, 0.15)];

/// Density of ranges from what no body explains, 1/m: arms, bags, dust.
const CLUTTER: f64 = 0.10;

/// Share of clutter in a beam's likelihood from which on no body explains it.
const UNEXPLAINED: f64 = 0.5;

/// Density of a background return at the background, 1/m: certain within 10 cm.
const BACKGROUND: f64 = 10.0;

/// Steps of the noise table to a metre.
const NOISE_STEPS: f64 = 2000.0;

static NOISE_DENSITY: LazyLock<Vec<f64>> = LazyLock::new(|| {
    (0..=(0.4 * NOISE_STEPS) as usize).map(|entry| mixture(entry as f64 / NOISE_STEPS, 0.0)).collect()
});

/// Density of ranges about a surface, looked up once for many rays.
#[derive(Clone, Copy)]
pub struct Noise(&'static [f64]);

impl Noise {
    pub fn get() -> Self {
        Self(&NOISE_DENSITY)
    }

    /// Of a range that is `off_m` from the surface, 1/m.
    pub fn density(self, off_m: f64) -> f64 {
        self.0.get((off_m.abs() * NOISE_STEPS) as usize).copied().unwrap_or(0.0)
    }
}

/// Squares of deviations beyond which a density is nothing: 10⁻⁶ of its peak.
const NOTHING: f64 = 28.0;

/// Density of a range that is `off_m` from a surface whose range has a variance of its own.
fn mixture(off_m: f64, variance_m2: f64) -> f64 {
    let part = |(sd_m, share): (f64, f64)| {
        let variance = sd_m * sd_m + variance_m2;
        let square = off_m * off_m;
        if square > NOTHING * variance {
            return 0.0;
        }
        share * libm::exp(-0.5 * square / variance) / (core::f64::consts::TAU * variance).sqrt()
    };
    NOISE.into_iter().map(part).sum()
}

/// What one body puts in the way of one beam, on the average of its cloud.
#[derive(Clone, Copy, Debug, Default)]
pub struct Surface {
    pub opacity: f64,
    pub range_m: f64,
    pub variance_m2: f64,
}

impl Surface {
    /// Whether a hit at a range is surely its.
    pub fn holds(&self, range_m: f64) -> bool {
        let sharp = self.variance_m2 < SHARP_M * SHARP_M;
        self.opacity > 0.5 && sharp && (self.range_m - range_m).abs() < SHARP_M
    }
}

/// A surface whose range is known within this holds the hits within this, m: there its density is ten times that of
/// clutter, and more.
const SHARP_M: f64 = 0.05;

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

    /// Whether no body explains the beam.
    pub fn is_clutter(&self) -> bool {
        CLUTTER / self.without > UNEXPLAINED
    }

    /// Likelihood with a body of this opacity at this range, over that without it.
    pub fn ratio(&self, opacity: f64, range_m: f64, noise: Noise) -> f64 {
        let (density, passes) = match self.measured {
            Measured::Hit(measured_m) => (noise.density(measured_m - range_m), 1.0 - opacity),
            Measured::Free(free_m) if range_m < free_m => (0.0, 1.0 - opacity),
            Measured::Free(_) | Measured::Unknown => return 1.0,
        };
        let mut index = 0;
        while index < DEEP && self.ranges_m[index] < range_m {
            index += 1;
        }
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
    fn a_ratio_is_what_the_whole_mixture_says() {
        let noise = Noise::get();
        let cases = [Measured::Hit(1.01), Measured::Hit(1.5), Measured::Hit(2.2), Measured::Free(3.0)];
        for measured in cases {
            for range_m in [0.9, 1.5, 2.0] {
                let body = Surface { opacity: 0.7, range_m, variance_m2: 0.0 };
                let other = Surface { opacity: 0.5, range_m: 2.5, variance_m2: 0.01 };
                let without = Mixture::new(measured, &mut [WALL, other]).unwrap();
                let with = Mixture::new(measured, &mut [other, body, WALL]).unwrap();
                let (ratio, whole) =
                    (without.ratio(body.opacity, body.range_m, noise), with.without / without.without);
                assert!((ratio / whole - 1.0).abs() < 0.05, "{measured:?} {range_m}: {ratio} {whole}");
            }
        }
    }

    #[test]
    fn what_is_behind_somebody_says_nothing() {
        let noise = Noise::get();
        let mixture = Mixture::new(Measured::Hit(1.0), &mut [WALL]).unwrap();
        assert!((mixture.ratio(0.97, 2.0, noise) - 1.0).abs() < 0.02);
        assert!(mixture.ratio(0.97, 0.5, noise) < 0.1, "it would have been seen");
    }

    #[test]
    fn beyond_the_free_range_nothing_is_known() {
        let noise = Noise::get();
        let mixture = Mixture::new(Measured::Free(2.5), &mut []).unwrap();
        assert!((mixture.ratio(0.97, 3.0, noise) - 1.0).abs() < 1e-12);
        assert!(mixture.ratio(0.97, 2.0, noise) < 0.05);
        assert!(Mixture::new(Measured::Unknown, &mut []).is_none());
    }
}
