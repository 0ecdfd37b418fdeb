//! How many of some people are there: the distribution of their number.
//!
//! ```text
//!   P(0) P(1) P(2) …   one more, who is there with r:   P'(n) = P(n)·(1 − r) + P(n − 1)·r
//! ```
//!
//! Of independent people with their probabilities of being there that is the Poisson binomial distribution (Poisson 1837).

/// Adds one more person, who is there with that probability.
pub(crate) fn join(p: &mut Vec<f64>, existence: f64) {
    p.push(0.0);
    for number in (0..p.len()).rev() {
        let one_less = if number == 0 { 0.0 } else { p[number - 1] };
        p[number] = p[number] * (1.0 - existence) + one_less * existence;
    }
}

/// The distribution of the number of people who are each there with that probability, from 0 people on. It sums to 1.
pub(crate) fn distribution(existences: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut p = vec![1.0];
    existences.into_iter().for_each(|existence| join(&mut p, existence));
    p
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_distribution_is_that_of_independent_people() {
        assert_eq!(distribution([]), [1.0]);
        assert_eq!(distribution([1.0, 0.5]), [0.0, 0.5, 0.5]);
        assert_eq!(distribution([0.5, 0.5, 0.0]), [0.25, 0.5, 0.25, 0.0]);
    }
}
