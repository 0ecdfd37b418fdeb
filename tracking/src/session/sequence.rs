//! Which reports of a module have been used: the newest sequence, and a bit for each of the 64 up to it.
//!
//! ```text
//!   … 95 96 97 98 99 │ newest
//!   …  1  1  0  1  1 │          97 may still come; 98 has come and is not used again
//! ```
//!
//! A number far from the newest is another row. While the one in use goes on, no device begins another. Once it is silent
//! the next report of a device that answers begins one, whatever its number: a number that was forged may have ended it.

/// Sequence numbers back from the newest that are remembered as used.
const REMEMBERED: u32 = 64;

/// Farther than this from the newest is another row: 25 s of the fastest sensor, so a row that was interrupted for less
/// goes on.
const FAR: u32 = 1000;

/// How a sequence number relates to the ones before it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Arrival {
    /// This many later than the newest so far; 1 for the very first.
    Ahead(u32),
    /// One that was overtaken, and is used for the first time.
    Late,
    /// One that was used before, or too old to tell.
    Repeated,
    /// One of another row, which has not begun.
    Far,
}

impl Arrival {
    /// The numbers that it leaves out, if any, can still come and be used.
    pub const fn is_near(self) -> bool {
        !matches!(self, Self::Ahead(ahead) if ahead >= REMEMBERED)
    }
}

/// The sequence numbers used so far.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sequences {
    newest: Option<u32>,
    used: u64,
}

impl Sequences {
    /// What this one is, and the numbers once it is used: until then they stay. `may_jump`: the row in use is silent, and the
    /// device has just answered.
    #[must_use]
    pub const fn with(self, sequence: u32, may_jump: bool) -> (Arrival, Self) {
        let begun = Self { newest: Some(sequence), used: 1 };
        let Some(newest) = self.newest else { return (Arrival::Ahead(1), begun) };
        let (ahead, behind) = (sequence.wrapping_sub(newest), newest.wrapping_sub(sequence));
        let is_far = ahead > FAR && behind > FAR;
        let is_behind = ahead == 0 || ahead >= u32::MAX / 2;
        if may_jump && (is_far || is_behind) {
            return (Arrival::Ahead(if is_behind { 1 } else { ahead }), begun);
        }
        if is_far {
            return (Arrival::Far, self);
        }
        if !is_behind {
            let used = if ahead < REMEMBERED { self.used << ahead | 1 } else { 1 };
            return (Arrival::Ahead(ahead), Self { used, ..begun });
        }
        if behind >= REMEMBERED || self.used >> behind & 1 == 1 {
            return (Arrival::Repeated, self);
        }
        (Arrival::Late, Self { used: self.used | 1 << behind, ..self })
    }

    /// What this one is, and it is used.
    #[cfg(test)]
    pub const fn record(&mut self, sequence: u32, may_jump: bool) -> Arrival {
        let (arrival, after) = self.with(sequence, may_jump);
        *self = after;
        arrival
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_number_is_used_once_in_whatever_order() {
        let mut sequences = Sequences::default();
        let arrivals = [7, 8, 8, 11, 9, 9, 7, 10].map(|sequence| sequences.record(sequence, false));
        let (late, repeated) = (Arrival::Late, Arrival::Repeated);
        let expected = [
            Arrival::Ahead(1),
            Arrival::Ahead(1),
            repeated,
            Arrival::Ahead(3),
            late,
            repeated,
            repeated,
            late,
        ];
        assert_eq!(arrivals, expected);
    }

    #[test]
    fn what_is_too_old_to_tell_counts_as_repeated() {
        let mut sequences = Sequences::default();
        sequences.record(100, false);
        sequences.record(100 + REMEMBERED, false);
        assert_eq!(sequences.record(100, false), Arrival::Repeated);
        assert_eq!(sequences.record(101, false), Arrival::Late);
    }

    #[test]
    fn f4_a_jump_of_the_numbers_silences_no_report() {
        let mut sequences = Sequences::default();
        sequences.record(100, false);
        for far in [100 + FAR + 1, 100 + (1 << 30), 100_u32.wrapping_sub(FAR + 1), u32::MAX / 2 + 100] {
            assert_eq!(sequences.record(far, false), Arrival::Far, "{far}");
            assert_eq!(sequences.record(100, false), Arrival::Repeated);
        }
        assert_eq!(sequences.record(101, false), Arrival::Ahead(1));
        assert_eq!(sequences.record(5000, true), Arrival::Ahead(4899), "its row has ended");
        assert_eq!(sequences.record(7, true), Arrival::Ahead(1), "and so has this");
    }

    #[test]
    fn f4_a_row_that_was_led_ahead_and_is_silent_begins_anew() {
        let mut sequences = Sequences::default();
        sequences.record(100, false);
        assert_eq!(sequences.record(100 + FAR, false), Arrival::Ahead(FAR), "forged, and not far");
        assert_eq!(sequences.record(101, false), Arrival::Repeated, "the true one");
        assert_eq!(sequences.record(102, true), Arrival::Ahead(1), "nothing else comes any more");
        assert_eq!(sequences.record(103, false), Arrival::Ahead(1));
    }

    #[test]
    fn numbers_go_on_over_their_end() {
        let mut sequences = Sequences::default();
        sequences.record(u32::MAX, false);
        assert_eq!(sequences.record(1, false), Arrival::Ahead(2));
        assert_eq!(sequences.record(0, false), Arrival::Late);
        assert_eq!(sequences.record(u32::MAX, false), Arrival::Repeated);
    }
}
