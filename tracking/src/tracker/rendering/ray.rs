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

use wide::f32x8;

use super::ellipse::Layer;
use super::scan::Measured;

/// Scale of the range noise with the body's roughness, m: a Student distribution of three degrees of freedom, since some rays
/// end on arms and folds. Its peak is 12.9 /m.
const NOISE_M: f64 = 0.0286;

/// Density of ranges from what no body explains, 1/m: arms, bags, dust.
const CLUTTER: f64 = 0.10;

/// Share of clutter in a beam's likelihood from which on no body explains it.
const UNEXPLAINED: f64 = 0.5;

/// Density of a background return at the background, 1/m: certain within 10 cm.
const BACKGROUND: f64 = 10.0;

/// Hits farther from a surface than this are not its, m: a thousandth of the density at the surface is left.
const OFF_M: f64 = 0.28;

/// Share of a likelihood that is nothing.
const NOTHING_BEHIND: f64 = 1e-3;

/// Log likelihood of one datum that a body explains best, over that of clutter.
pub fn most_of_a_datum() -> f64 {
    libm::log(density(0.0, 0.0) / CLUTTER)
}

/// Density of a range that is `off_m` from a surface whose range has a variance of its own, 1/m.
fn density(off_m: f64, variance_m2: f64) -> f64 {
    let scale_m2 = scale_m2(variance_m2);
    let fall = 1.0 + off_m * off_m / scale_m2;
    2.0 / (core::f64::consts::PI * scale_m2.sqrt() * fall * fall)
}

/// Square of the scale of that distribution, times its degrees of freedom, m².
const fn scale_m2(variance_m2: f64) -> f64 {
    3.0 * (NOISE_M * NOISE_M + variance_m2)
}

/// The same of eight surfaces whose ranges are known.
#[inline]
fn densities(off_m: f32x8) -> f32x8 {
    const SHARPNESS: f32 = (1.0 / scale_m2(0.0)) as f32;
    let fall = 1.0 + off_m * off_m * SHARPNESS;
    density(0.0, 0.0) as f32 / (fall * fall)
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

/// What an opaque body changes of a beam's likelihood, over that without it.
#[derive(Clone, Copy, Debug, Default)]
struct Change {
    /// It adds so much to each unit of its density, m: the transmittance there.
    adds_m: f32,
    /// It takes away so much: the likelihood from all that is behind.
    hides: f32,
}

/// How that changes at a surface.
#[derive(Clone, Copy, Debug, Default)]
struct Behind {
    range_m: f32,
    more: Change,
}

/// The likelihood of a beam without the body that is being updated, and what the body changes in it: before the nearest
/// surface in its way, behind that one, and so on.
#[derive(Clone, Copy, Debug)]
pub struct Mixture {
    measured: Measured,
    /// Likelihood of the beam without the body.
    pub without: f64,
    /// Before all surfaces.
    before: Change,
    /// The surfaces in its way, nearest first, and what is free; so many of them.
    behind: [Behind; DEEP + 1],
    deep: usize,
}

impl Mixture {
    /// Of a beam that says nothing.
    pub const SILENT: Self = Self {
        measured: Measured::Unknown,
        without: f64::INFINITY,
        before: Change { adds_m: 0.0, hides: 0.0 },
        behind: [Behind { range_m: 0.0, more: Change { adds_m: 0.0, hides: 0.0 } }; DEEP + 1],
        deep: 0,
    };

    /// Of the surfaces in the way of a beam, in any order.
    pub fn new(measured: Measured, surfaces: &mut [Surface]) -> Self {
        // Where a body was hit, where what else explains the beam is, and up to where bodies are seen.
        let (hit_m, mut background_m, end_m) = match measured {
            Measured::Unknown => return Self::SILENT,
            Measured::Free(range_m) => (None, range_m, range_m),
            Measured::Hit(range_m) => (Some(range_m), f64::INFINITY, f64::INFINITY),
            Measured::Swept(range_m) => (Some(range_m), range_m, f64::INFINITY),
        };
        let mut mixture = Self { measured, ..Self::SILENT };
        surfaces.sort_unstable_by(|one, other| one.range_m.total_cmp(&other.range_m));
        let (mut sum, mut transmittance) = (0.0, 1.0);
        for surface in surfaces.iter().take(DEEP).take_while(|surface| surface.range_m < end_m) {
            if background_m <= surface.range_m {
                sum += mixture.put(background_m, 0.0, transmittance * BACKGROUND);
                background_m = f64::INFINITY;
            }
            let less = transmittance * surface.opacity;
            let noise = |hit_m| density(hit_m - surface.range_m, surface.variance_m2);
            sum += mixture.put(surface.range_m, less, hit_m.map_or(0.0, |hit_m| less * noise(hit_m)));
            transmittance -= less;
        }
        if background_m.is_finite() {
            sum += mixture.put(background_m, 0.0, transmittance * BACKGROUND);
        }
        mixture.without = sum + CLUTTER;
        let inverse = (1.0 / mixture.without) as f32;
        mixture.before = Change { adds_m: inverse, hides: sum as f32 * inverse };
        for Behind { more, .. } in &mut mixture.behind[..mixture.deep] {
            more.adds_m *= inverse;
            more.hides *= inverse;
        }
        mixture
    }

    /// Puts a surface behind those it has. It takes `less` of the transmittance, and is worth `more` of the likelihood, which it
    /// returns; neither is divided by the likelihood of all yet.
    fn put(&mut self, range_m: f64, less: f64, more: f64) -> f64 {
        let change = Change { adds_m: -less as f32, hides: -more as f32 };
        self.behind[self.deep] = Behind { range_m: range_m as f32, more: change };
        self.deep += 1;
        more
    }

    /// Whether the beam says nothing.
    pub const fn is_silent(&self) -> bool {
        self.without.is_infinite()
    }

    /// Whether the beam's likelihood depends on a body that is not nearer than this, m: on one far behind what was hit, with
    /// nothing behind it that may have been hit, it does not. What no body explains may be its hand.
    pub fn tells(&self, nearest_m: f64) -> bool {
        match self.measured {
            Measured::Unknown => false,
            Measured::Free(range_m) => nearest_m < range_m || self.is_clutter(),
            Measured::Hit(range_m) | Measured::Swept(range_m) => {
                let hides = f64::from(self.hides(nearest_m as f32));
                nearest_m - range_m < OFF_M || hides > NOTHING_BEHIND || self.is_clutter()
            }
        }
    }

    /// Whether no body explains the beam.
    pub fn is_clutter(&self) -> bool {
        CLUTTER / self.without > UNEXPLAINED
    }

    /// Likelihood with a body of one of these opacities at one of these ranges, over that without it.
    #[inline]
    pub fn ratios(&self, &Layer { opacity, range_m }: &Layer) -> f32x8 {
        1.0 + opacity * self.excess(range_m)
    }

    /// The same of a body that is met twice: the likelihood is a mean of what the nearer surface holds and of what it lets pass.
    #[inline]
    pub fn ratios_of_two(&self, near: &Layer, far: &Layer) -> f32x8 {
        let behind = self.ratios(far);
        behind + near.opacity * (1.0 + self.excess(near.range_m) - behind)
    }

    /// What opaque bodies at these ranges change of the likelihood, over that without them.
    #[inline]
    fn excess(&self, range_m: f32x8) -> f32x8 {
        let (mut adds_m, mut hides) = (f32x8::splat(self.before.adds_m), f32x8::splat(self.before.hides));
        for Behind { range_m: surface_m, more } in &self.behind[..self.deep] {
            let is_behind = f32x8::splat(*surface_m).simd_lt(range_m);
            adds_m += is_behind & f32x8::splat(more.adds_m);
            hides += is_behind & f32x8::splat(more.hides);
        }
        match self.measured {
            Measured::Hit(hit_m) | Measured::Swept(hit_m) => {
                adds_m * densities(range_m - hit_m as f32) - hides
            }
            _ => -hides,
        }
    }

    /// Likelihood with a body of this opacity at this range, over that without it.
    #[cfg(test)]
    pub fn ratio_alone(&self, opacity: f64, range_m: f64) -> f64 {
        let lanes = |value: f64| f32x8::splat(value as f32);
        f64::from(self.ratios(&Layer { opacity: lanes(opacity), range_m: lanes(range_m) }).to_array()[0])
    }

    /// What an opaque body at this range takes away.
    fn hides(&self, range_m: f32) -> f32 {
        let before = self.behind[..self.deep].iter().take_while(|behind| behind.range_m < range_m);
        before.fold(self.before.hides, |hides, behind| hides + behind.more.hides)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WALL: Surface = Surface { opacity: 0.97, range_m: 1.0, variance_m2: 0.0 };

    #[test]
    fn a_ratio_is_what_the_whole_mixture_says() {
        let cases = [Measured::Hit(1.01), Measured::Hit(1.5), Measured::Hit(2.2), Measured::Free(3.0)];
        for measured in cases {
            for range_m in [0.9, 1.5, 2.0] {
                let body = Surface { opacity: 0.7, range_m, variance_m2: 0.0 };
                let other = Surface { opacity: 0.5, range_m: 2.5, variance_m2: 0.01 };
                let without = Mixture::new(measured, &mut [WALL, other]);
                let with = Mixture::new(measured, &mut [other, body, WALL]);
                let (ratio, whole) =
                    (without.ratio_alone(body.opacity, body.range_m), with.without / without.without);
                assert!((ratio / whole - 1.0).abs() < 0.05, "{measured:?} {range_m}: {ratio} {whole}");
            }
        }
    }

    #[test]
    fn what_is_behind_a_person_says_nothing() {
        let mixture = Mixture::new(Measured::Hit(1.0), &mut [WALL]);
        assert!((mixture.ratio_alone(0.97, 2.0) - 1.0).abs() < 0.02);
        assert!(mixture.ratio_alone(0.97, 0.5) < 0.1, "it would have been seen");
    }

    #[test]
    fn beyond_the_free_range_nothing_is_known() {
        let mixture = Mixture::new(Measured::Free(2.5), &mut []);
        assert!((mixture.ratio_alone(0.97, 3.0) - 1.0).abs() < 1e-12);
        assert!(mixture.ratio_alone(0.97, 2.0) < 0.05);
        assert_eq!(Mixture::new(Measured::Unknown, &mut [WALL]).ratio_alone(0.97, 2.0), 1.0);
    }

    #[test]
    fn what_moves_where_things_move_is_explained_and_may_be_a_body() {
        let mixture = Mixture::new(Measured::Swept(2.0), &mut []);
        assert!(!mixture.is_clutter());
        let ratio = |range_m| mixture.ratio_alone(0.97, range_m);
        assert!(ratio(2.01) > 2.0 && ratio(2.01) < 2.5);
        assert!(ratio(1.5) < 0.05, "it would have been hit");
        assert!((ratio(2.5) - 1.0).abs() < 0.01, "it is behind what moves");
    }

    #[test]
    fn a_beam_that_does_not_tell_of_a_body_is_as_likely_with_it() {
        let veil = Surface { opacity: 0.5, range_m: 1.1, variance_m2: 0.001 };
        let (mut telling, mut silent) = (0, 0);
        let hits = [Measured::Hit(1.0), Measured::Hit(2.2), Measured::Swept(1.5)];
        for measured in hits.into_iter().chain([Measured::Free(1.5), Measured::Unknown]) {
            for surfaces in [vec![], vec![WALL], vec![veil], vec![WALL, veil]] {
                let mixture = Mixture::new(measured, &mut surfaces.clone());
                for nearest_m in [0.8, 1.2, 1.45, 1.6, 2.4, 3.0] {
                    if mixture.tells(nearest_m) {
                        telling += 1;
                        continue;
                    }
                    silent += 1;
                    let ratio = mixture.ratio_alone(0.97, nearest_m + 0.01);
                    assert!((ratio - 1.0).abs() < 0.002, "{measured:?} {surfaces:?} {nearest_m}: {ratio}");
                }
            }
        }
        assert!(telling > 30 && silent > 30, "{telling} {silent}");
    }

    #[test]
    fn what_no_body_explains_tells_of_a_body_whose_hand_it_may_be() {
        assert!(Mixture::new(Measured::Hit(1.0), &mut []).tells(1.6));
        assert!(!Mixture::new(Measured::Hit(1.0), &mut [WALL]).tells(1.6));
    }
}
