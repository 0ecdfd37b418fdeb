//! Figures as they are told.

/// To the hundredth: metres and seconds as people read them.
pub fn hundredth(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}

/// How old a time is at `now_s`, s, to the hundredth; none if it never was.
pub fn ago_s(at_s: f64, now_s: f64) -> Option<f64> {
    at_s.is_finite().then(|| hundredth((now_s - at_s).max(0.0)))
}
