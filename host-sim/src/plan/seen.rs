//! What several modules see together, and from how many sides.
//!
//! ```text
//!        \ 1 | 0 /        directions from a cell in sixths of the circle: seen from two sides are cells with modules in two
//!       2 ── · ── 5       of them. Two modules side by side look past the same people and count once; the farther apart
//!        / 3 | 4 \        they are, as seen from the cells, the more cells are seen from two sides
//!
//!   value of a cell, behind one crowd: ⅘ from one side, 1 from two
//! ```
//!
//! The number of sides is a coverage function and the value is concave in it: submodular.

use super::bits::Bits;
use super::sight::{SIDES, Sight};
pub use kehai_tracking::ground::{ONE, TWO};

/// What some modules see together, crowd after crowd.
#[derive(Clone, PartialEq, Debug)]
pub struct Seen {
    /// Cells seen by at least one.
    pub one: Bits,
    /// Seen from at least two sides.
    pub two: Bits,
    from: [Bits; SIDES],
}

impl Seen {
    /// By no module yet; `len` bits.
    #[must_use]
    pub fn nothing(len: usize) -> Self {
        let none = Bits::new(len);
        Self { one: none.clone(), two: none.clone(), from: std::array::from_fn(|_| none.clone()) }
    }

    /// Adds what one more sees.
    pub fn add(&mut self, own: &Sight) {
        for word in 0..own.among.words().len() {
            let second = self.second(own, word);
            for (from, towards) in self.from.iter_mut().zip(&own.towards) {
                let seen = own.among.words()[word] & repeated(towards, word);
                from.words_mut()[word] |= seen;
            }
            self.two.words_mut()[word] |= second;
            self.one.words_mut()[word] |= own.among.words()[word];
        }
    }

    /// What all of it is worth, in units of [`ONE`] and [`TWO`].
    #[must_use]
    pub fn worth(&self) -> u64 {
        ONE * self.one.count() + TWO * self.two.count()
    }

    /// What one more would add to that.
    #[must_use]
    pub fn gain(&self, own: &Sight) -> u64 {
        let words = own.among.words().iter().zip(self.one.words()).zip(self.two.words()).enumerate();
        let gain = |(word, ((own_word, one), two)): (usize, ((&u64, &u64), &u64))| {
            if *own_word == 0 {
                return 0;
            }
            let first = u64::from((own_word & !one).count_ones());
            let second = u64::from((self.second(own, word) & !two).count_ones());
            ONE * first + TWO * second
        };
        words.map(gain).sum()
    }

    /// The cells of a word that this module sees and others see from another side.
    fn second(&self, own: &Sight, word: usize) -> u64 {
        let seen = own.among.words()[word] & self.one.words()[word];
        let sides = self.from.iter().zip(&own.towards);
        sides.fold(0, |second, (from, towards)| {
            second | (seen & repeated(towards, word) & !from.words()[word])
        })
    }
}

/// A word of a set of cells that is the same for all crowds.
fn repeated(cells: &Bits, word: usize) -> u64 {
    let words = cells.words();
    words[word % words.len().max(1)]
}

#[cfg(test)]
mod tests {
    use super::super::sight::tests::sight;
    use super::*;

    #[test]
    fn two_on_one_side_are_one_and_two_on_two_sides_are_two() {
        let mut seen = Seen::nothing(128);
        // Cells 0 to 3, behind two crowds; of the second crowd only cell 3.
        let first = sight(0, &[0, 1, 2, 3, 64 + 3]);
        seen.add(&first);
        assert_eq!(seen.gain(&sight(0, &[2, 3, 64 + 3])), 0);
        assert_eq!(seen.gain(&sight(4, &[2, 3, 64 + 3, 64 + 1])), 3 * TWO + ONE);
        seen.add(&sight(4, &[2, 3]));
        assert_eq!(
            (seen.one.count(), seen.two.count(), seen.two.has(3), seen.two.has(64 + 3)),
            (5, 2, true, false)
        );
    }

    #[test]
    fn a_gain_is_what_is_added_and_falls_with_every_other_module() {
        let sights =
            [sight(0, &[0, 1, 2, 3]), sight(1, &[2, 3, 4]), sight(0, &[3, 4, 5]), sight(2, &[0, 3, 4, 7])];
        let mut seen = Seen::nothing(64);
        let mut gains = Vec::new();
        for own in &sights {
            let before = seen.worth();
            gains.push(seen.gain(&sights[3]));
            let gain = seen.gain(own);
            seen.add(own);
            assert_eq!(seen.worth() - before, gain);
        }
        assert!(gains.is_sorted_by(|one, other| one >= other), "{gains:?}");
    }
}
