//! Figures as they are told.

/// To the hundredth: metres and seconds as people read them; never -0, which is the sum of nothing.
pub fn hundredth(value: f64) -> f64 {
    (value * 100.0).round() / 100.0 + 0.0
}

/// How old a time is at `now_s`, s, to the hundredth; none if it never was.
pub fn ago_s(at_s: f64, now_s: f64) -> Option<f64> {
    at_s.is_finite().then(|| hundredth((now_s - at_s).max(0.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_of_nothing_is_nought() {
        let none: [f64; 0] = [];
        for nought in [hundredth(none.iter().sum()), hundredth(-0.001)] {
            assert_eq!(serde_json::to_string(&nought).unwrap(), "0.0");
        }
    }
}
