//! Times and figures as lines show them.

/// s from one time to another, µs; 0 if that is earlier.
pub fn seconds(from_us: u64, to_us: u64) -> f64 {
    to_us.saturating_sub(from_us) as f64 * 1e-6
}

/// To so many steps a unit: 3.14 of π and 100. It divides: 3 × 0.1 is not 0.3 and is written with seventeen digits. Never -0, which is
/// the sum of nothing.
pub fn rounded(value: f64, per_unit: f64) -> f64 {
    (value * per_unit).round() / per_unit + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rounded_figure_is_written_without_more_digits() {
        assert_eq!(rounded(0.3, 10.0).to_string(), "0.3");
        assert_ne!((0.3_f64 * 10.0).round() * 0.1, 0.3, "what multiplying gives");
        assert_eq!(rounded(-0.001, 10.0).to_string(), "0");
        for tenths in 0..10_000 {
            let value = f64::from(tenths) / 10.0;
            assert!(rounded(value + 1e-9, 10.0).to_string().len() <= 5, "{value}");
        }
    }
}
