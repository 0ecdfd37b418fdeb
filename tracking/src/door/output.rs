//! An output that is said again and again until it is acknowledged.
//!
//! ```text
//!   locked #7 ── 1 s ──▶ locked #7 ── 1 s ──▶ locked #7 ◀── taken #7    silent until it changes
//!   unlocked #8 …                              ◀── taken #7: refused, that is no longer said
//! ```

/// Between two times the same is said, s.
const AGAIN_S: f64 = 1.0;

/// An output.
#[derive(Clone, Debug)]
pub struct Output<T> {
    value: T,
    id: u64,
    taken: bool,
    /// When it is to be said next.
    due_s: f64,
}

impl<T: Copy + PartialEq> Output<T> {
    /// Nothing has been said.
    #[must_use]
    pub const fn new(value: T) -> Self {
        Self { value, id: 1, taken: false, due_s: f64::NEG_INFINITY }
    }

    /// What it is to be from now on.
    pub fn set(&mut self, value: T) {
        if value != self.value {
            *self = Self { value, id: self.id + 1, taken: false, due_s: f64::NEG_INFINITY };
        }
    }

    /// Number and value, if they are to be said at `now_s`.
    pub fn due(&mut self, now_s: f64) -> Option<(u64, T)> {
        if self.taken || now_s < self.due_s {
            return None;
        }
        self.due_s = now_s + AGAIN_S;
        Some((self.id, self.value))
    }

    /// Takes an acknowledgement; false if it is of something else.
    pub const fn take(&mut self, id: u64) -> bool {
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
        let mut output = Output::new(false);
        assert_eq!(output.due(0.0), Some((1, false)));
        assert_eq!(output.due(0.9), None);
        assert_eq!(output.due(1.0), Some((1, false)));
        output.set(true);
        assert!(!output.take(1), "that is no longer said");
        assert_eq!(output.due(1.1), Some((2, true)));
        output.set(true);
        assert!(output.take(2) && output.due(99.0).is_none());
    }
}
