//! An output that is said again and again: until it is acknowledged, or, as a lease, for as long as it holds.
//!
//! ```text
//!   locked #7 ── 1 s ──▶ locked #7 ── 1 s ──▶ locked #7 ◀── taken #7    silent until it changes
//!   unlocked #8 for 1.5 s ── 0.5 s ──▶ unlocked #8 for 1.5 s ── …        whether it is acknowledged or not
//! ```

/// Between two times the same is said, s.
const AGAIN_S: f64 = 1.0;

/// Between two renewals of a lease, s: two of three may be lost on the way.
const RENEW_S: f64 = 0.5;

/// How long a lease lasts, ms. With half a second on the way it is over within two seconds of the last renewal.
pub const LEASE_MS: u32 = 1500;

/// An output.
#[derive(Clone, Debug)]
pub struct Output<T> {
    value: T,
    id: u64,
    taken: bool,
    /// It is to be said once more, acknowledged or not.
    asked: bool,
    /// When it is to be said next.
    due_s: f64,
}

/// How an output is kept up.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Hold {
    /// It holds until the next one: said until it is acknowledged.
    Standing,
    /// It ends by itself if it is not said again.
    Lease,
}

impl<T: Copy + PartialEq> Output<T> {
    /// Nothing has been said; outputs are numbered from `first_id`.
    #[must_use]
    pub const fn new(value: T, first_id: u64) -> Self {
        Self { value, id: first_id, taken: false, asked: false, due_s: f64::NEG_INFINITY }
    }

    /// What it is to be from now on.
    pub fn set(&mut self, value: T) {
        if value != self.value {
            *self = Self::new(value, self.id.saturating_add(1));
        }
    }

    /// Number and value, if they are to be said at `now_s`.
    pub fn due(&mut self, hold: Hold, now_s: f64) -> Option<(u64, T)> {
        let (is_wanted, again_s) = match hold {
            Hold::Standing => (!self.taken, AGAIN_S),
            Hold::Lease => (true, RENEW_S),
        };
        if !self.asked && (!is_wanted || now_s < self.due_s) {
            return None;
        }
        self.asked = false;
        self.due_s = now_s + again_s;
        Some((self.id, self.value))
    }

    /// It is to be said once more at the next time, acknowledged or not.
    pub const fn ask(&mut self) {
        self.asked = true;
    }

    /// Takes an acknowledgement; false if it is of something else.
    pub const fn acknowledge(&mut self, id: u64) -> bool {
        self.taken |= id == self.id;
        id == self.id
    }

    /// What it is.
    #[must_use]
    pub const fn value(&self) -> T {
        self.value
    }

    /// Its number.
    #[must_use]
    pub const fn id(&self) -> u64 {
        self.id
    }

    /// Whether it was acknowledged.
    #[must_use]
    pub const fn is_taken(&self) -> bool {
        self.taken
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_said_again_until_it_is_taken() {
        let mut output = Output::new(false, 1);
        assert_eq!(output.due(Hold::Standing, 0.0), Some((1, false)));
        assert_eq!(output.due(Hold::Standing, 0.9), None);
        assert_eq!(output.due(Hold::Standing, 1.0), Some((1, false)));
        output.set(true);
        assert!(!output.acknowledge(1), "that is no longer said");
        assert_eq!(output.due(Hold::Standing, 1.1), Some((2, true)));
        output.set(true);
        assert!(output.acknowledge(2) && output.due(Hold::Standing, 99.0).is_none());
    }

    #[test]
    fn f9_a_lease_is_renewed_whether_it_is_taken_or_not() {
        let mut output = Output::new(true, 5);
        assert_eq!(output.due(Hold::Lease, 0.0), Some((5, true)));
        assert!(output.acknowledge(5) && output.due(Hold::Lease, 0.4).is_none());
        assert_eq!(output.due(Hold::Lease, 0.5), Some((5, true)));
        output.ask();
        assert_eq!(output.due(Hold::Standing, 0.6), Some((5, true)), "asked for, and acknowledged as before");
        assert!(output.is_taken() && output.due(Hold::Standing, 9.0).is_none());
    }
}
