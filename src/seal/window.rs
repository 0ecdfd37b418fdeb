//! The replay window: each counter is taken once, also when datagrams overtake each other.
//!
//! ```text
//!   newest ─┐
//!   ▪▪▫▪▪▪▪▪▪│            64 counters: ▪ taken, ▫ not yet
//!   │        └ ahead: moves the window
//!   └ behind: too old to tell, refused
//! ```
//!
//! Source: RFC 6479, with one word. Only what has been authenticated may move it.

/// Counters that are told apart behind the newest one: more than a module sends in a second.
const WIDTH: u64 = 64;

/// Which counters were taken. One that has taken none takes any.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Window {
    /// The counter behind the newest one taken; 0: none was.
    next: u64,
    /// Bit i for counter `next - 1 - i`.
    taken: u64,
}

impl Window {
    /// Nothing taken.
    #[must_use]
    pub const fn new() -> Self {
        Self { next: 0, taken: 0 }
    }

    /// Whether a counter may still be taken.
    #[must_use]
    pub const fn admits(&self, counter: u64) -> bool {
        if counter >= self.next {
            return counter < u64::MAX;
        }
        let behind = self.next - 1 - counter;
        behind < WIDTH && self.taken >> behind & 1 == 0
    }

    /// Takes a counter that is admitted.
    pub const fn take(&mut self, counter: u64) {
        if counter >= self.next {
            let ahead = counter - self.next + 1;
            self.taken = if ahead < WIDTH { self.taken << ahead } else { 0 };
            self.next = counter.saturating_add(1);
            self.taken |= 1;
        } else {
            let behind = self.next - 1 - counter;
            if behind < WIDTH {
                self.taken |= 1 << behind;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::HashSet;

    #[test]
    fn the_edges() {
        let mut window = Window::new();
        assert!(window.admits(0) && window.admits(u64::MAX - 1) && !window.admits(u64::MAX));
        window.take(100);
        assert!(!window.admits(100) && window.admits(101));
        assert!(window.admits(100 - 63) && !window.admits(100 - 64), "64 are told apart");
        window.take(100 - 63);
        assert!(!window.admits(100 - 63));
        window.take(163);
        assert!(!window.admits(100), "taken, and the last that is told apart");
        window.take(164);
        assert!(!window.admits(100) && window.admits(101));
        window.take(u64::MAX - 1);
        assert!(!window.admits(164) && !window.admits(u64::MAX - 1) && window.admits(u64::MAX - 2));
    }

    proptest! {
        #[test]
        fn no_counter_is_taken_twice_and_a_new_one_within_reach_is_not_refused(
            counters in prop::collection::vec(0u64..200, 0..300)
        ) {
            let (mut window, mut taken, mut newest) = (Window::new(), HashSet::new(), 0);
            for counter in counters {
                let is_admitted = window.admits(counter);
                let is_old = counter + WIDTH <= newest;
                prop_assert_eq!(is_admitted, !taken.contains(&counter) && !is_old);
                if is_admitted {
                    window.take(counter);
                    taken.insert(counter);
                    newest = newest.max(counter);
                }
            }
        }
    }
}
