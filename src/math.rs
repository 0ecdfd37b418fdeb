//! All float mathematics of the core, chosen so that a PC and a board agree bit for bit.
//!
//! `+ − × ÷` on `f32` are exact IEEE operations on both and never fused by the compiler; what is
//! built of them alone agrees. Everything else would not: `f32::sqrt` and its kin are std's on a
//! PC and micromath's on a board, with different results. So nothing outside this file calls
//! them, and clippy refuses it.
//!
//! | function | from | largest error (asserted and printed by a test) |
//! |---|---|---|
//! | [`sin_cos`] | Cephes polynomials, own | 1.2e-7 absolute within ±20 rad |
//! | [`atan2`] | libm, pure `f32` | 2.5e-7 rad |
//! | [`sqrt`], [`hypot`], [`chord`] | libm, software | 0.5 ulp; the others 1 ulp of the result |
//! | [`round`], [`floor`], [`wrap_angle`] | micromath, its rounding family | exact; wrap 6e-7 rad within ±20 rad |
//!
//! micromath's square root is 6 % off and its sines cost 33 mm at 30 m: not used.
//! No function here returns NaN or an infinity for any input.

use micromath::F32Ext;

/// A full turn in rad.
pub const TAU: f32 = core::f32::consts::TAU;

/// Half a turn in rad.
pub const PI: f32 = core::f32::consts::PI;

/// Largest angle [`sin_cos`] and [`wrap_angle`] look at; anything beyond, or not a number, counts as 0.
/// 64 turns: no angle of this library leaves ±2 turns.
pub const MAX_ANGLE_RAD: f32 = 64.0 * TAU;

/// Sine and cosine of `angle_rad`.
///
/// Cephes `sinf`/`cosf`: the octant is taken off in three constants (24 + 24 + 24 bits of π/4),
/// the rest, within ±π/4, goes through a polynomial of degree 7 or 8.
#[must_use]
pub fn sin_cos(angle_rad: f32) -> (f32, f32) {
    const PI_4_HIGH: f32 = 0.785_156_25;
    const PI_4_MIDDLE: f32 = 2.418_756_5e-4;
    const PI_4_LOW: f32 = 3.774_895e-8;
    let angle = in_reach(angle_rad);
    let positive = if angle < 0.0 { -angle } else { angle };
    let octant = ((positive * (4.0 / PI)) as i32 + 1) & !1;
    let whole = octant as f32;
    let rest = ((positive - whole * PI_4_HIGH) - whole * PI_4_MIDDLE) - whole * PI_4_LOW;
    let square = rest * rest;
    let sine = ((-1.951_529_6e-4 * square + 8.332_161e-3) * square - 1.666_665_5e-1) * square * rest + rest;
    let cosine = ((2.443_315_7e-5 * square - 1.388_731_6e-3) * square + 4.166_664_6e-2) * square * square
        - 0.5 * square
        + 1.0;
    let (sine, cosine) = match octant & 7 {
        0 => (sine, cosine),
        2 => (cosine, -sine),
        4 => (-sine, -cosine),
        _ => (-cosine, sine),
    };
    (if angle < 0.0 { -sine } else { sine }, cosine)
}

/// Direction of the point (`x`, `y`), −π to π; 0 for the origin and for what is not a number.
#[must_use]
pub fn atan2(y: f32, x: f32) -> f32 {
    finite(libm::atan2f(y, x))
}

/// Square root; 0 for negative numbers and for what is not a number.
#[must_use]
pub fn sqrt(value: f32) -> f32 {
    if value > 0.0 { finite(libm::sqrtf(value)) } else { 0.0 }
}

/// Length of the vector (`x`, `y`).
#[must_use]
pub fn hypot(x: f32, y: f32) -> f32 {
    sqrt(x * x + y * y)
}

/// Distance between two points `first` and `second` away that lie `angle_rad` apart.
#[must_use]
pub fn chord(first: f32, second: f32, angle_rad: f32) -> f32 {
    // In this form, not with 1 − cos, so that near points lose no digits.
    let (half_sine, _) = sin_cos(angle_rad * 0.5);
    let step = first - second;
    sqrt(step * step + 4.0 * first * second * half_sine * half_sine)
}

/// Nearest whole number, halves away from zero. Exact.
#[must_use]
pub fn round(value: f32) -> f32 {
    finite(F32Ext::round(value))
}

/// Largest whole number not above `value`. Exact.
#[must_use]
pub fn floor(value: f32) -> f32 {
    finite(F32Ext::floor(value))
}

/// The same direction within −π to π.
#[must_use]
pub fn wrap_angle(angle_rad: f32) -> f32 {
    let wrapped = F32Ext::rem_euclid(in_reach(angle_rad), TAU);
    if wrapped > PI { wrapped - TAU } else { wrapped }
}

/// `value`, or 0 when it is not a finite number.
#[must_use]
pub fn finite(value: f32) -> f32 {
    if value.is_finite() { value } else { 0.0 }
}

/// A number made of the bits of 512 results of every function here: two machines that print the same one
/// calculate alike. 32-bit FNV-1a over arguments from −16 to 16.
#[must_use]
pub fn digest() -> u32 {
    (0..512_u16).fold(0x811c_9dc5, |hash, index| {
        let x = f32::from(index) * 0.0625 - 16.0 + 1.0 / (f32::from(index) + 3.0);
        let (sine, cosine) = sin_cos(x);
        let results = [
            sine,
            cosine,
            atan2(x, 1.7 - x),
            sqrt(x),
            hypot(x, 3.3),
            chord(x, 2.1, 0.3 * x),
            round(x),
            floor(x),
            wrap_angle(x),
        ];
        results
            .iter()
            .flat_map(|value| value.to_bits().to_le_bytes())
            .fold(hash, |hash: u32, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193))
    })
}

fn in_reach(angle_rad: f32) -> f32 {
    if (-MAX_ANGLE_RAD..=MAX_ANGLE_RAD).contains(&angle_rad) { angle_rad } else { 0.0 }
}

#[cfg(test)]
#[allow(clippy::disallowed_methods, reason = "f64 and std are the judge here")]
mod tests {
    use super::*;
    use std::println;

    /// Angles over ±20 rad, 0.1 mrad apart, off the round numbers.
    fn angles() -> impl Iterator<Item = f32> {
        (-200_000..200_000).map(|i| i as f32 * 1.000_03e-4)
    }

    #[test]
    fn accuracy_is_as_the_table_says() {
        let worst = |errors: &mut dyn Iterator<Item = f64>| errors.fold(0.0, f64::max);
        let sine = worst(&mut angles().map(|a| (f64::from(sin_cos(a).0) - f64::from(a).sin()).abs()));
        let cosine = worst(&mut angles().map(|a| (f64::from(sin_cos(a).1) - f64::from(a).cos()).abs()));
        let direction = worst(&mut angles().map(|a| {
            let (y, x) = sin_cos(a);
            (f64::from(atan2(y, x)) - f64::from(y).atan2(f64::from(x))).abs()
        }));
        let root = worst(&mut (1..400_000).map(|i| {
            let exact = f64::from(i).sqrt();
            (f64::from(sqrt(i as f32)) - exact).abs() / exact
        }));
        let length = worst(&mut angles().map(|a| {
            let (x, y) = (3.0 * a, 7.0 - a);
            let exact = f64::from(x).hypot(f64::from(y));
            (f64::from(hypot(x, y)) - exact).abs() / exact
        }));
        let span = worst(&mut (1..10_000).map(|i| {
            let (first, second, angle) = (500.0 + i as f32, 4000.0 - 0.3 * i as f32, i as f32 * 1e-4);
            let (a, b, c) = (f64::from(first), f64::from(second), f64::from(angle));
            let exact = (a * a + b * b - 2.0 * a * b * c.cos()).sqrt();
            (f64::from(chord(first, second, angle)) - exact).abs() / exact
        }));
        let wrap = worst(&mut angles().map(|a| {
            let exact = f64::from(a).sin().atan2(f64::from(a).cos());
            let off = (f64::from(wrap_angle(a)) - exact).abs();
            off.min((off - core::f64::consts::TAU).abs())
        }));
        println!("largest errors: sin {sine:.2e}, cos {cosine:.2e}, atan2 {direction:.2e} rad,");
        println!(
            "sqrt {root:.2e} relative, hypot {length:.2e}, chord {span:.2e} relative, wrap {wrap:.2e} rad"
        );
        assert!(sine < 1.2e-7 && cosine < 1.2e-7, "sine {sine:e} cosine {cosine:e}");
        assert!(direction < 2.5e-7, "{direction:e}");
        assert!(root < 6e-8, "{root:e}");
        assert!(length < 1.5e-7, "{length:e}");
        assert!(span < 3e-7, "{span:e}");
        assert!(wrap < 6e-7, "{wrap:e}");
    }

    #[test]
    fn rounding_is_exact() {
        for i in -100_000..100_000 {
            let value = i as f32 * 0.0625;
            assert_eq!(round(value), value.round());
            assert_eq!(floor(value), value.floor());
        }
    }

    #[test]
    fn nothing_that_is_not_a_number_comes_out() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -0.0, f32::MIN_POSITIVE] {
            for other in [0.0, bad] {
                let (sine, cosine) = sin_cos(bad);
                let all =
                    [sine, cosine, atan2(bad, other), sqrt(bad), hypot(bad, other), round(bad), floor(bad)];
                assert!(all.iter().chain([&wrap_angle(bad)]).all(|v| v.is_finite()), "{bad}: {all:?}");
            }
        }
        assert_eq!(atan2(0.0, 0.0), 0.0);
    }

    /// The very bits, so that the same list printed by a board can be compared with it.
    #[test]
    fn a_few_values_bit_for_bit() {
        let bits = |value: f32| value.to_bits();
        assert_eq!(bits(sqrt(2.0)), 0x3fb5_04f3);
        assert_eq!(bits(hypot(3.0, 4.0)), 0x40a0_0000);
        assert_eq!(bits(sin_cos(1.0).0), 0x3f57_6aa4);
        assert_eq!(bits(atan2(1.0, 1.0)), bits(core::f32::consts::FRAC_PI_4));
        assert_eq!(digest(), 0xf989_f389);
    }
}
