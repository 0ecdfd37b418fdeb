//! Which reports of a module have been used: the newest sequence, and a bit for each of the 64 up to it.
//!
//! ```text
//!   … 95 96 97 98 99 │ newest
//!   …  1  1  0  1  1 │          97 may still come; 98 has come and is not used again
//! ```

/// Sequence numbers back from the newest that are remembered as used.
const REMEMBERED: u32 = 64;

/// How a sequence number relates to the ones before it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Arrival {
    /// This many later than the newest so far; 1 for the very first.
    Ahead(u32),
    /// One that was overtaken, and is used for the first time.
    Late,
    /// One that was used before, or too old to tell.
    Repeated,
}

/// The sequence numbers used so far.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sequences {
    newest: Option<u32>,
    used: u64,
}

impl Sequences {
    /// What this one is; from now on it is used.
    pub fn record(&mut self, sequence: u32) -> Arrival {
        let Some(newest) = self.newest else {
            (self.newest, self.used) = (Some(sequence), 1);
            return Arrival::Ahead(1);
        };
        let ahead = sequence.wrapping_sub(newest);
        if ahead == 0 {
            return Arrival::Repeated;
        }
        if ahead < u32::MAX / 2 {
            self.used = if ahead < REMEMBERED { self.used << ahead | 1 } else { 1 };
            self.newest = Some(sequence);
            return Arrival::Ahead(ahead);
        }
        let behind = newest.wrapping_sub(sequence);
        if behind >= REMEMBERED || self.used >> behind & 1 == 1 {
            return Arrival::Repeated;
        }
        self.used |= 1 << behind;
        Arrival::Late
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_number_is_used_once_in_whatever_order() {
        let mut sequences = Sequences::default();
        let arrivals = [7, 8, 8, 11, 9, 9, 7, 10].map(|sequence| sequences.record(sequence));
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
        sequences.record(100);
        sequences.record(100 + REMEMBERED);
        assert_eq!(sequences.record(100), Arrival::Repeated);
        assert_eq!(sequences.record(101), Arrival::Late);
    }
}
