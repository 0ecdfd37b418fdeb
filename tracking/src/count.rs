//! How many of some people are there: the distribution of their number.
//!
//! ```text
//!   P(0) P(1) P(2) …   one more, there with r:   P'(n) = P(n)·(1 − r) + P(n − 1)·r
//!
//!   what is taken for a person   1/50 none ─ 97/100 one ─ 1/100 two, of whom one is hidden     (Doubt)
//! ```
//!
//! Of independent people with their probabilities of being there that is the Poisson binomial distribution (Poisson 1837). It is too
//! sure: a track's existence says how well scans agree with it, not whether the tracker has taken an arm for a person or two people for
//! one. So each track stands for none, one or two with probabilities of its own: a step of a branching process (Watson and
//! Galton 1875), in which the error grows with the number of people, as it does.

/// For how many people a track stands that exists.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Doubt {
    none: f64,
    two: f64,
}

impl Doubt {
    /// Each track is one person.
    pub(crate) const NONE: Self = Self { none: 0.0, two: 0.0 };

    /// The likeliest of the true counts of 7682 seconds, in nine worlds before the door, in conditions D and H with one, three, five and
    /// seven people (`kehai-sim experiment counts --seeds 400-402`), in steps of 0.005: for both trackers near these, so for both these.
    pub(crate) const OF_TRACKS: Self = Self { none: 0.02, two: 0.01 };
}

/// Smaller probabilities of the greatest numbers are left out: of some hundred people they would be half of the list.
const NEGLIGIBLE: f64 = 1e-9;

/// Adds what one more track that exists with that probability stands for.
pub(crate) fn join(p: &mut Vec<f64>, existence: f64, doubt: Doubt) {
    let two = existence * doubt.two;
    let one = existence * (1.0 - doubt.none - doubt.two);
    let none = 1.0 - existence + existence * doubt.none;
    p.extend([0.0, 0.0]);
    for number in (0..p.len()).rev() {
        let less =
            |by: usize| number.checked_sub(by).and_then(|number| p.get(number)).copied().unwrap_or(0.0);
        p[number] = less(0) * none + less(1) * one + less(2) * two;
    }
    while p.len() > 1 && p.last().is_some_and(|last| *last < NEGLIGIBLE) {
        p.pop();
    }
}

/// The distribution of the number of people for whom tracks stand that exist with those probabilities, from 0 people on. It sums to 1.
pub(crate) fn distribution(existences: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut p = vec![1.0];
    existences.into_iter().for_each(|existence| join(&mut p, existence, Doubt::OF_TRACKS));
    p
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joined(existences: &[f64], doubt: Doubt) -> Vec<f64> {
        let mut p = vec![1.0];
        existences.iter().for_each(|existence| join(&mut p, *existence, doubt));
        p
    }

    #[test]
    fn without_doubt_the_distribution_is_that_of_independent_people() {
        assert_eq!(joined(&[], Doubt::NONE), [1.0]);
        assert_eq!(joined(&[1.0, 0.5], Doubt::NONE), [0.0, 0.5, 0.5]);
        assert_eq!(joined(&[0.5, 0.5, 0.0], Doubt::NONE), [0.25, 0.5, 0.25]);
    }

    #[test]
    fn a_track_stands_for_none_one_or_two() {
        let close = |p: &[f64], expected: &[f64]| {
            p.len() == expected.len()
                && p.iter().zip(expected).all(|(p, expected)| (p - expected).abs() < 1e-12)
        };
        let one = joined(&[1.0], Doubt::OF_TRACKS);
        assert!(close(&one, &[0.02, 0.97, 0.01]), "{one:?}");
        let two = distribution([1.0, 1.0]);
        assert!(close(&two, &[0.0004, 0.0388, 0.9413, 0.0194, 0.0001]), "{two:?}");
        // Without tracks the count is surely 0.
        assert_eq!(distribution([]), [1.0]);
    }

    #[test]
    fn of_many_people_it_sums_to_one_and_is_no_longer_than_it_must_be() {
        let p = distribution(vec![0.997; 300]);
        assert!(
            (p.iter().sum::<f64>() - 1.0).abs() < 1e-6 && p.len() < 330,
            "{} of {}",
            p.iter().sum::<f64>(),
            p.len()
        );
    }
}
