//! Random numbers of the particles: normal deviates from a table, in an order that a small generator decides.
//!
//! ```text
//!   PCG32 ─▶ 32 bits ─▶ two indices of 12 bits ─▶ table of 4096 normal deviates
//! ```
//!
//! A table gives the same numbers on every machine, and costs a tenth of a transformation. 4096 deviates reach 3.5
//! standard deviations.

use std::f64::consts::SQRT_2;
use std::sync::LazyLock;

use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng;

/// Entries of the table.
const ENTRIES: usize = 4096;

/// Quantiles of the normal distribution at the middles of equal shares, in a shuffled order.
static NORMAL: LazyLock<Vec<f64>> = LazyLock::new(|| {
    let mut table = Vec::with_capacity(ENTRIES);
    let mut value = -4.0_f64;
    for entry in 0..ENTRIES {
        let share = (entry as f64 + 0.5) / ENTRIES as f64;
        // Newton's method on the distribution function, from the quantile before.
        for _ in 0..50 {
            let error = 0.5 * libm::erfc(-value / SQRT_2) - share;
            let density = libm::exp(-0.5 * value * value) / libm::sqrt(core::f64::consts::TAU);
            let step = (error / density.max(1e-12)).clamp(-0.5, 0.5);
            value -= step;
            if step.abs() < 1e-12 {
                break;
            }
        }
        table.push(value);
    }
    // An odd factor visits every entry once: neighbours of the order are far apart in value.
    (0..ENTRIES).map(|entry| table[entry * 1597 % ENTRIES]).collect()
});

/// The generator of one tracker.
#[derive(Clone, Debug)]
pub struct Random {
    generator: Pcg32,
    normal: &'static [f64],
}

impl Random {
    /// With the same seed, the same numbers.
    pub fn new(seed: u64) -> Self {
        Self { generator: Pcg32::new(seed, 0xa02_bdbf_7bb3_c0a7), normal: &NORMAL }
    }

    /// Two independent normal deviates.
    pub fn pair(&mut self) -> (f64, f64) {
        let bits = self.generator.next_u32() as usize;
        let entry = |bits: usize| self.normal.get(bits % ENTRIES).copied().unwrap_or(0.0);
        (entry(bits >> 8), entry(bits >> 20))
    }

    /// Between 0 and 1.
    pub fn uniform(&mut self) -> f64 {
        f64::from(self.generator.next_u32()) / (f64::from(u32::MAX) + 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deviates_have_the_moments_of_the_normal_distribution() {
        let mut random = Random::new(1);
        let pairs: Vec<(f64, f64)> = (0..20_000).map(|_| random.pair()).collect();
        let mean = |of: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / pairs.len() as f64;
        assert!(mean(&|pair| pair.0).abs() < 0.03 && mean(&|pair| pair.1).abs() < 0.03);
        assert!((mean(&|pair| pair.0 * pair.0) - 1.0).abs() < 0.03);
        assert!(mean(&|pair| pair.0 * pair.1).abs() < 0.03, "independent");
    }

    #[test]
    fn the_same_seed_gives_the_same_numbers() {
        let numbers = |seed| {
            let mut random = Random::new(seed);
            (random.pair(), random.uniform())
        };
        assert_eq!(numbers(7), numbers(7));
        assert_ne!(numbers(7), numbers(8));
    }
}
