//! A set of small numbers, one bit each: which cells a module sees.
//!
//! ```text
//!   word 0  63 … 2 1 0   word 1  127 … 65 64   …      sets of one kind have as many words
//! ```

/// Numbers in a word.
pub const WORD: usize = 64;

/// A set.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Bits(Vec<u64>);

impl Bits {
    /// The empty set, for numbers below `len`.
    #[must_use]
    pub fn new(len: usize) -> Self {
        Self(vec![0; len.div_ceil(WORD)])
    }

    /// Adds a number; one that is too large is left out.
    pub fn set(&mut self, number: usize) {
        if let Some(word) = self.0.get_mut(number / WORD) {
            *word |= 1 << (number % WORD);
        }
    }

    /// Whether a number is in it.
    #[must_use]
    pub fn has(&self, number: usize) -> bool {
        self.0.get(number / WORD).is_some_and(|word| word >> (number % WORD) & 1 == 1)
    }

    /// How many numbers are in it.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.0.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    /// Adds all that is in `other`.
    pub fn add(&mut self, other: &Self) {
        for (own, other) in self.0.iter_mut().zip(&other.0) {
            *own |= other;
        }
    }

    /// Its words.
    #[must_use]
    pub fn words(&self) -> &[u64] {
        &self.0
    }

    /// Its words.
    pub fn words_mut(&mut self) -> &mut [u64] {
        &mut self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_go_over_all_words() {
        let of = |numbers: &[usize]| {
            let mut bits = Bits::new(200);
            numbers.iter().for_each(|number| bits.set(*number));
            bits
        };
        let mut one = of(&[0, 63, 64, 199]);
        assert!(one.has(64) && !one.has(65) && !one.has(1_000));
        one.add(&of(&[64, 65]));
        assert_eq!((one.count(), one.words().len(), one == of(&[0, 63, 64, 65, 199])), (5, 4, true));
    }
}
