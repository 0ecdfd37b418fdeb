//! What may be said of few runs: intervals at 95 %, medians.
//!
//! ```text
//! successes of trials   Wilson (1927)   p̂ + z²/2n ± z √(p̂(1 − p̂)/n + z²/4n²), over 1 + z²/n
//! two trackers, same seeds: mean of the differences ± Student's t · s / √n
//! ```

use super::frame::share;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// 97.5 % of the normal distribution lie below this.
const Z_95: f64 = 1.959_963_984_540_054;

/// Between which two values something lies in 95 of 100 cases.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Wilson's interval of the probability behind so many successes. Without trials: from 0 to 1.
#[must_use]
pub fn wilson(successes: u64, trials: u64) -> Interval {
    if trials == 0 {
        return Interval { low: 0.0, high: 1.0 };
    }
    let (number, square) = (trials as f64, Z_95 * Z_95);
    let rate = successes.min(trials) as f64 / number;
    let middle = rate + square / (2.0 * number);
    let half = Z_95 * (rate * (1.0 - rate) / number + square / (4.0 * number * number)).sqrt();
    let whole = 1.0 + square / number;
    Interval { low: ((middle - half) / whole).max(0.0), high: ((middle + half) / whole).min(1.0) }
}

/// A mean and where it may lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// The mean.
    pub mean: f64,
    /// Its interval; everything from one value.
    pub interval: Interval,
    /// How many values.
    pub number: usize,
}

/// Mean of the values with Student's interval. None without values.
#[must_use]
pub fn mean(values: &[f64]) -> Option<Mean> {
    let number = values.len();
    let mean = share(values.iter().sum(), number as f64)?;
    let everything = Interval { low: f64::NEG_INFINITY, high: f64::INFINITY };
    let freedom = number as f64 - 1.0;
    let interval = StudentsT::new(0.0, 1.0, freedom).map_or(everything, |student| {
        let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / freedom;
        let half = student.inverse_cdf(0.975) * (variance / number as f64).sqrt();
        Interval { low: mean - half, high: mean + half }
    });
    Some(Mean { mean, interval, number })
}

/// The value below which this share of the values lies, between two of them in proportion (as NumPy does by
/// default). None without values.
#[must_use]
pub fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let place = share.clamp(0.0, 1.0) * sorted.len().checked_sub(1)? as f64;
    let (below, above) = (sorted[place.floor() as usize], sorted[place.ceil() as usize]);
    Some(below + (above - below) * place.fract())
}

/// The value in the middle. None without values.
#[must_use]
pub fn median(values: &[f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// The value that 95 % of the values do not exceed. None without values.
#[must_use]
pub fn p95(values: &[f64]) -> Option<f64> {
    quantile(values, 0.95)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::vec;
    use proptest::prelude::*;

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-4
    }

    #[test]
    fn wilson_is_as_in_the_tables() {
        let interval = wilson(10, 10);
        assert!(close(interval.low, 0.722_47) && interval.high > 0.999_999, "{interval:?}");
        let interval = wilson(1, 10);
        assert!(close(interval.low, 0.017_88) && close(interval.high, 0.404_15), "{interval:?}");
        assert_eq!(wilson(0, 0), Interval { low: 0.0, high: 1.0 });
    }

    #[test]
    fn a_mean_has_students_interval() {
        // Of 1, 2, 3: mean 2, s = 1, t(2) = 4.302653.
        let mean_of = mean(&[1.0, 2.0, 3.0]).unwrap();
        assert_eq!((mean_of.mean, mean_of.number), (2.0, 3));
        assert!(close(mean_of.interval.high - 2.0, 4.302_653 / 3.0_f64.sqrt()), "{mean_of:?}");
        assert_eq!(mean(&[1.0]).unwrap().interval.high, f64::INFINITY);
        assert_eq!(mean(&[]), None);
    }

    #[test]
    fn quantiles_lie_between_the_values() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(p95(&(0..=20).map(f64::from).collect::<Vec<_>>()), Some(19.0));
        assert_eq!(median(&[]), None);
    }

    proptest! {
        #[test]
        fn wilson_holds_the_rate_and_mirrors(trials in 1_u64..500, part in 0.0..=1.0) {
            let successes = (trials as f64 * part) as u64;
            let (own, mirrored) = (wilson(successes, trials), wilson(trials - successes, trials));
            let rate = successes as f64 / trials as f64;
            prop_assert!(0.0 <= own.low && own.low <= rate + 1e-12 && rate <= own.high + 1e-12 && own.high <= 1.0);
            prop_assert!((own.low + mirrored.high - 1.0).abs() < 1e-9);
            let more = wilson(successes * 4, trials * 4);
            prop_assert!(more.high - more.low < own.high - own.low);
        }

        #[test]
        fn a_mean_lies_in_its_interval_and_moves_with_the_values(values in vec(-10.0..10.0_f64, 2..40), by in -5.0..5.0_f64) {
            let own = mean(&values).unwrap();
            let moved = mean(&values.iter().map(|value| value + by).collect::<Vec<_>>()).unwrap();
            prop_assert!(own.interval.low <= own.mean && own.mean <= own.interval.high);
            prop_assert!((moved.mean - own.mean - by).abs() < 1e-9);
            prop_assert!((moved.interval.high - own.interval.high - by).abs() < 1e-9);
        }

        #[test]
        fn quantiles_rise_and_stay_inside(values in vec(-10.0..10.0_f64, 1..40), low in 0.0..=1.0_f64, high in 0.0..=1.0_f64) {
            let (low, high) = if low < high { (low, high) } else { (high, low) };
            let (below, above) = (quantile(&values, low).unwrap(), quantile(&values, high).unwrap());
            prop_assert!(below <= above);
            let least = values.iter().copied().fold(f64::INFINITY, f64::min);
            let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            prop_assert!(least <= below && above <= most);
        }
    }
}
