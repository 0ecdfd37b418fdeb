//! Seeded random numbers, one independent stream per purpose.
//!
//! ```text
//!   seed ──┬── Purpose::Walk, person 3 ───▶ how person 3 sways
//!          ├── Purpose::Noise, module 0, scan 17 ───▶ the noise of that scan
//!          └── …
//! ```
//!
//! A stream is a pure function of the seed, its purpose and its key. So the same scan gets the same
//! noise whether or not the scans before it were asked for, and one more person in a scene does not
//! change the others. Generator: PCG64-MCG (O'Neill 2014). Distributions are computed here and with
//! `libm`, never with the platform's C library, so that every machine gets the same bytes.

use rand::Rng;
use rand_pcg::Pcg64Mcg;

/// Purpose of a stream; streams of different purposes never share numbers.
#[derive(Clone, Copy, Debug)]
pub enum Purpose {
    /// Sizes, clothes and habits of a person.
    Person = 1,
    /// How a person sways and fidgets.
    Walk = 2,
    /// What differs between two sensors of one model.
    Sensor = 3,
    /// The noise of one scan.
    Noise = 4,
    /// Edges and codes of one scan.
    Edges = 5,
    /// The drop-outs that begin in one scan.
    DropOut = 6,
    /// Where people of a crowd go, and when.
    Crowd = 7,
    /// The shape of a person's body, where it is not plain; its clothes, where some are black.
    Shape = 10,
    /// What a person does with the arms.
    Gesture = 11,
    /// How a site was installed.
    Installed = 12,
    /// Who comes through an entrance, and the flaws of its depth camera.
    Entrance = 13,
    /// Where one sensor's light falsifies another's readings.
    CrossTalk = 9,
    /// Where people stand about while places for modules are compared, and where they walk to.
    Plan = 14,
    /// What the network does to one module's datagrams, and how its clock runs.
    Network = 8,
}

/// One stream of random numbers.
#[derive(Clone, Debug)]
pub struct Stream {
    generator: Pcg64Mcg,
    spare_normal: Option<f64>,
}

impl Stream {
    /// The stream of `purpose` and `key` (person, module, scan, …) under `seed`.
    #[must_use]
    pub fn new(seed: u64, purpose: Purpose, key: [u64; 2]) -> Self {
        let high = mix(mix(seed) ^ (purpose as u64));
        let high = mix(high ^ key[0]);
        let low = mix(high.rotate_left(17) ^ key[1]);
        // The low bits of an MCG's state must not be 0; `Pcg64Mcg::new` sets the lowest.
        Self { generator: Pcg64Mcg::new(u128::from(high) << 64 | u128::from(low)), spare_normal: None }
    }

    /// A number in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.generator.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// A number in [`low`, `high`).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// True with probability `share`.
    pub fn chance(&mut self, share: f64) -> bool {
        self.uniform() < share
    }

    /// A normally distributed number, mean 0, standard deviation 1 (Box and Muller 1958).
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare_normal.take() {
            return spare;
        }
        let radius = (-2.0 * libm::log(1.0 - self.uniform())).sqrt();
        let (sine, cosine) = libm::sincos(std::f64::consts::TAU * self.uniform());
        self.spare_normal = Some(radius * sine);
        radius * cosine
    }
}

/// Spreads the bits of a key (the finaliser of SplitMix64, Steele et al. 2014).
const fn mix(key: u64) -> u64 {
    let key = key.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let key = (key ^ (key >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let key = (key ^ (key >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    key ^ (key >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_of_another_seed_purpose_or_key_differ() {
        let first = |seed, purpose, key| Stream::new(seed, purpose, key).uniform();
        let base = first(1, Purpose::Noise, [2, 3]);
        assert_eq!(base, first(1, Purpose::Noise, [2, 3]));
        assert_ne!(base, first(2, Purpose::Noise, [2, 3]));
        assert_ne!(base, first(1, Purpose::Edges, [2, 3]));
        assert_ne!(base, first(1, Purpose::Noise, [3, 2]));
        assert_ne!(base, first(1, Purpose::Noise, [2, 4]));
    }

    #[test]
    fn the_first_numbers_of_neighbouring_streams_are_independent_and_even() {
        let first: Vec<f64> =
            (0..20_000).map(|scan| Stream::new(5, Purpose::Noise, [0, scan]).uniform() - 0.5).collect();
        let mean = first.iter().sum::<f64>() / 20_000.0;
        let lag = first.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / 20_000.0 * 12.0;
        assert!(mean.abs() < 0.01, "mean {mean}");
        assert!(lag.abs() < 0.03, "correlation of neighbours {lag}");
    }

    #[test]
    fn normal_numbers_have_unit_spread_and_no_skew() {
        let mut stream = Stream::new(9, Purpose::Walk, [0, 0]);
        let numbers: Vec<f64> = (0..50_000).map(|_| stream.normal()).collect();
        let moment = |power| {
            numbers.iter().map(|number| libm::pow(*number, power)).sum::<f64>() / numbers.len() as f64
        };
        assert!(moment(1.0).abs() < 0.02);
        assert!((moment(2.0) - 1.0).abs() < 0.02);
        assert!(moment(3.0).abs() < 0.05);
        assert!((moment(4.0) - 3.0).abs() < 0.12);
    }
}
