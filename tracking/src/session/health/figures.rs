//! Times and figures as lines show them.

/// s from one time to another, µs; 0 if that is earlier.
pub fn seconds(from_us: u64, to_us: u64) -> f64 {
    to_us.saturating_sub(from_us) as f64 * 1e-6
}

/// To so many steps a unit.
pub fn rounded(value: f64, per_unit: f64) -> f64 {
    (value * per_unit).round() / per_unit
}
