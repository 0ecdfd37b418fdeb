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

use super::ellipse::nearest_step;
use super::scan::Measured;

/// Range noise with the body's roughness: standard deviation m and share, of most rays and of those on arms and folds.
const NOISE: [(f64, f64); 2] = [(0.028, 0.85), (0.080, 0.15)];

/// Density of ranges from what no body explains, 1/m: arms, bags, dust.
const CLUTTER: f64 = 0.10;

/// Share of clutter in a beam's likelihood from which on no body explains it.
const UNEXPLAINED: f64 = 0.5;

/// Density of a background return at the background, 1/m: certain within 10 cm.
const BACKGROUND: f64 = 10.0;

/// Ranges farther from a surface than this are not its, m: the length of the noise table.
const NOISE_M: f64 = 0.4;

/// Share of a likelihood that is nothing.
const NOTHING_BEHIND: f64 = 1e-3;

/// Steps of the noise table to a metre.
const NOISE_STEPS: f64 = 2000.0;

static NOISE_DENSITY: LazyLock<Vec<f64>> = LazyLock::new(|| {
    (0..=(NOISE_M * NOISE_STEPS) as usize).map(|entry| density(entry as f64 / NOISE_STEPS, 0.0)).collect()
});

/// Density of ranges about a surface, looked up once for many rays.
#[derive(Clone, Copy)]
pub struct Noise(&'static [f64]);

impl Noise {
    pub fn get() -> Self {
        Self(&NOISE_DENSITY)
    }

    /// Of a range that is so many steps from the surface, 1/m.
    #[inline]
    pub fn density(self, steps: u32) -> f64 {
        self.0.get(steps as usize).copied().unwrap_or(0.0)
    }

    /// Steps of the table between two ranges.
    #[inline]
    pub const fn steps(one_m: f32, other_m: f32) -> u32 {
        nearest_step((one_m - other_m).abs() * NOISE_STEPS as f32)
    }
}

/// Squares of deviations beyond which a density is nothing: 10⁻⁶ of its peak.
const NOTHING: f64 = 28.0;

/// Log likelihood of one datum that a body explains best, over that of clutter.
pub fn most_of_a_datum() -> f64 {
    libm::log(Noise::get().density(0) / CLUTTER)
}

/// Density of a range that is `off_m` from a surface whose range has a variance of its own.
fn density(off_m: f64, variance_m2: f64) -> f64 {
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

/// What an opaque body would change between two surfaces, of the beam's likelihood without it.
#[derive(Clone, Copy, Debug, Default)]
struct Change {
    /// It adds so much to each unit of its density, m: the transmittance there.
    adds_m: f64,
    /// It takes away so much: the likelihood from all that is behind.
    hides: f64,
}

/// The likelihood of a beam without the body that is being updated, and what the body changes in it: before the nearest
/// surface in its way, behind that one, and so on.
#[derive(Clone, Copy, Debug)]
pub struct Mixture {
    measured: Measured,
    /// Ranges of the surfaces, nearest first, and of what is free; then infinity.
    ranges_m: [f32; DEEP + 1],
    /// Before each of them; the last is behind all.
    changes: [Change; DEEP + 2],
    /// Likelihood of the beam without the body.
    pub without: f64,
}

impl Mixture {
    /// Of a beam that says nothing.
    pub const SILENT: Self = Self {
        measured: Measured::Unknown,
        ranges_m: [f32::INFINITY; DEEP + 1],
        changes: [Change { adds_m: 0.0, hides: 0.0 }; DEEP + 2],
        without: f64::INFINITY,
    };

    /// Of the surfaces in the way of a beam, in any order.
    pub fn new(measured: Measured, surfaces: &mut [Surface]) -> Self {
        let mut mixture = Self { measured, ..Self::SILENT };
        let (background, free_m) = match measured {
            Measured::Unknown => return mixture,
            Measured::Free(range_m) => (BACKGROUND, range_m),
            Measured::Hit(_) => (0.0, f64::INFINITY),
        };
        surfaces.sort_unstable_by(|one, other| one.range_m.total_cmp(&other.range_m));
        // What stands beyond the free range is not seen.
        let seen = surfaces.iter().take(DEEP).take_while(|surface| surface.range_m < free_m);
        let (mut sum, mut transmittance, mut deep) = (0.0, 1.0, 0);
        for surface in seen {
            mixture.ranges_m[deep] = surface.range_m as f32;
            mixture.changes[deep] = Change { adds_m: transmittance, hides: sum };
            deep += 1;
            if let Measured::Hit(range_m) = measured {
                let off_m = range_m - surface.range_m;
                sum += transmittance * surface.opacity * density(off_m, surface.variance_m2);
            }
            transmittance *= 1.0 - surface.opacity;
        }
        mixture.ranges_m[deep] = free_m as f32;
        mixture.changes[deep] = Change { adds_m: transmittance, hides: sum };
        let all = sum + transmittance * background;
        mixture.without = all + CLUTTER;
        let inverse = 1.0 / mixture.without;
        for Change { adds_m, hides } in &mut mixture.changes[..=deep] {
            *adds_m *= inverse;
            *hides = (all - *hides) * inverse;
        }
        mixture
    }

    /// Whether the beam's likelihood depends on a body that is not nearer than this, m: on one far behind what was hit, with
    /// nothing behind it that may have been hit, it does not. What no body explains may be its hand.
    pub fn tells(&self, nearest_m: f64) -> bool {
        match self.measured {
            Measured::Unknown => false,
            Measured::Free(range_m) => nearest_m < range_m || self.is_clutter(),
            Measured::Hit(range_m) => {
                let hides = self.change(nearest_m as f32).hides;
                nearest_m - range_m < NOISE_M || hides > NOTHING_BEHIND || self.is_clutter()
            }
        }
    }

    /// Whether no body explains the beam.
    pub fn is_clutter(&self) -> bool {
        CLUTTER / self.without > UNEXPLAINED
    }

    /// What was hit, m; infinity where nothing was.
    pub fn hit_m(&self) -> f32 {
        if let Measured::Hit(range_m) = self.measured { range_m as f32 } else { f32::INFINITY }
    }

    /// Likelihood with a body of this opacity at this range, over that without it; `density`: of what was hit, if that
    /// were all, 1/m.
    #[inline]
    pub fn ratio(&self, opacity: f64, range_m: f32, density: f64) -> f64 {
        let Change { adds_m, hides } = self.change(range_m);
        1.0 + opacity * (adds_m * density - hides)
    }

    /// The same of one beam alone.
    pub fn ratio_alone(&self, opacity: f64, range_m: f32, noise: Noise) -> f64 {
        self.ratio(opacity, range_m, noise.density(Noise::steps(self.hit_m(), range_m)))
    }

    #[inline]
    fn change(&self, range_m: f32) -> Change {
        let mut index = 0;
        while index <= DEEP && self.ranges_m[index] < range_m {
            index += 1;
        }
        self.changes[index]
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
                let without = Mixture::new(measured, &mut [WALL, other]);
                let with = Mixture::new(measured, &mut [other, body, WALL]);
                let (ratio, whole) = (
                    without.ratio_alone(body.opacity, body.range_m as f32, noise),
                    with.without / without.without,
                );
                assert!((ratio / whole - 1.0).abs() < 0.05, "{measured:?} {range_m}: {ratio} {whole}");
            }
        }
    }

    #[test]
    fn what_is_behind_somebody_says_nothing() {
        let noise = Noise::get();
        let mixture = Mixture::new(Measured::Hit(1.0), &mut [WALL]);
        assert!((mixture.ratio_alone(0.97, 2.0, noise) - 1.0).abs() < 0.02);
        assert!(mixture.ratio_alone(0.97, 0.5, noise) < 0.1, "it would have been seen");
    }

    #[test]
    fn beyond_the_free_range_nothing_is_known() {
        let noise = Noise::get();
        let mixture = Mixture::new(Measured::Free(2.5), &mut []);
        assert!((mixture.ratio_alone(0.97, 3.0, noise) - 1.0).abs() < 1e-12);
        assert!(mixture.ratio_alone(0.97, 2.0, noise) < 0.05);
        assert_eq!(Mixture::new(Measured::Unknown, &mut [WALL]).ratio_alone(0.97, 2.0, noise), 1.0);
    }

    #[test]
    fn a_beam_that_does_not_tell_of_a_body_is_as_likely_with_it() {
        let noise = Noise::get();
        let veil = Surface { opacity: 0.5, range_m: 1.1, variance_m2: 0.001 };
        let (mut telling, mut silent) = (0, 0);
        for measured in [Measured::Hit(1.0), Measured::Hit(2.2), Measured::Free(1.5), Measured::Unknown] {
            for surfaces in [vec![], vec![WALL], vec![veil], vec![WALL, veil]] {
                let mixture = Mixture::new(measured, &mut surfaces.clone());
                for nearest_m in [0.8, 1.2, 1.45, 1.6, 2.4, 3.0] {
                    if mixture.tells(nearest_m) {
                        telling += 1;
                        continue;
                    }
                    silent += 1;
                    let ratio = mixture.ratio_alone(0.97, nearest_m as f32 + 0.01, noise);
                    assert!((ratio - 1.0).abs() < 0.002, "{measured:?} {surfaces:?} {nearest_m}: {ratio}");
                }
            }
        }
        assert!(telling > 30 && silent > 30, "{telling} {silent}");
    }

    #[test]
    fn what_nobody_explains_tells_of_a_body_whose_hand_it_may_be() {
        assert!(Mixture::new(Measured::Hit(1.0), &mut []).tells(1.6));
        assert!(!Mixture::new(Measured::Hit(1.0), &mut [WALL]).tells(1.6));
    }
}
