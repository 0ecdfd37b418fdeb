//! Starts that do not last: counted, so that a panic at every start does not go on for ever.
//!
//! ```text
//!   word   31 … 8  "kst"   7 … 0  starts in a row that did not last 60 s
//!
//!   start ── +1 ──▶ … 60 s ──▶ 0        a restart that was asked for: 0, too
//!             └ 3 before this one: default addressing for this start
//! ```
//!
//! The word lies in memory that a reset spares and a loss of power does not ([`ResetMemory`]). Not in the flash:
//! there each start would be written twice, the second time with the sensor's stream stopped; and a supply that
//! fails three times in a minute is no reason to change a module's address.

use crate::link::ResetMemory;

/// A start that lasts this long counts as good, µs: DHCP, sensor and first subscribers need less.
pub const LASTED_US: u64 = 60_000_000;

/// Starts in a row that did not last, before default addressing is tried.
const TOO_MANY: u8 = 3;

/// Distinguishes the word from memory that was just switched on.
const MARK: [u8; 3] = *b"kst";

/// Number of starts in a row, before the present one, that did not last.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ShortStarts(u8);

impl ShortStarts {
    /// So many.
    #[must_use]
    pub const fn new(count: u8) -> Self {
        Self(count)
    }

    /// Reads the number before this start, and counts this start as a short one until it has lasted.
    pub fn begin(memory: &mut impl ResetMemory) -> Self {
        let [a, b, c, count] = memory.read().to_be_bytes();
        let before = Self(if [a, b, c] == MARK { count } else { 0 });
        memory.write(Self(before.0.saturating_add(1)).word());
        before
    }

    /// Notes that the present start has lasted, or ends on request.
    pub fn lasted(memory: &mut impl ResetMemory) {
        memory.write(Self(0).word());
    }

    /// Whether default addressing must be tried.
    #[must_use]
    pub const fn are_too_many(self) -> bool {
        self.0 >= TOO_MANY
    }

    const fn word(self) -> u32 {
        let [a, b, c] = MARK;
        u32::from_be_bytes([a, b, c, self.0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Ram(u32);

    impl ResetMemory for Ram {
        fn read(&mut self) -> u32 {
            self.0
        }

        fn write(&mut self, word: u32) {
            self.0 = word;
        }
    }

    #[test]
    fn the_fourth_start_after_three_that_did_not_last_is_a_careful_one() {
        let mut ram = Ram(0x1234_5678);
        for before in 0..3 {
            assert_eq!(ShortStarts::begin(&mut ram), ShortStarts(before));
            assert!(!ShortStarts(before).are_too_many());
        }
        for before in 3..600 {
            let starts = ShortStarts::begin(&mut ram);
            assert!(starts.are_too_many(), "{before} starts");
        }
        ShortStarts::lasted(&mut ram);
        assert_eq!(ShortStarts::begin(&mut ram), ShortStarts(0));
    }

    #[test]
    fn memory_that_was_just_switched_on_counts_nothing() {
        for word in [0, u32::MAX, 0x6b73_7503, 0x006b_7374] {
            assert_eq!(ShortStarts::begin(&mut Ram(word)), ShortStarts(0), "{word:x}");
        }
    }
}
