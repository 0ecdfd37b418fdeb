//! The choice of places: each next module where it adds most.
//!
//! ```text
//!   gains   12  40  31  …   ─▶ the largest ─▶ what it sees is seen ─▶ gains, none of them larger than before
//! ```

use std::cmp::Reverse;

use super::seen::{ONE, Seen, TWO};
use super::sight::Sight;

/// No further module is chosen that adds less: of fifty places where a person may stand it would look at one more.
pub const LEAST_GAIN: f64 = 0.02;

/// Most modules that are chosen without being asked for.
const MOST: usize = 16;

/// What is chosen from.
#[derive(Clone, Debug)]
pub struct Choice<'a> {
    /// What a module at each place would see.
    pub sights: &'a [Sight],
    /// What those that stay see.
    pub kept: Seen,
    /// Cells that can be seen, behind all crowds.
    pub open: u64,
}

/// How many modules are chosen.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Number {
    /// So many.
    Exactly(usize),
    /// As many as add at least [`LEAST_GAIN`] each.
    WhileItGains,
}

impl Choice<'_> {
    /// The value of a worth, 0 to 1.
    #[must_use]
    pub fn value(&self, worth: u64) -> f64 {
        worth as f64 / ((ONE + TWO) * self.open).max(1) as f64
    }

    /// What the modules at these places see, with those that stay.
    #[must_use]
    pub fn seen(&self, places: &[usize]) -> Seen {
        let mut seen = self.kept.clone();
        places.iter().filter_map(|place| self.sights.get(*place)).for_each(|sight| seen.add(sight));
        seen
    }

    /// The greedy choice, after the places in `first`.
    #[must_use]
    pub fn greedy(&self, first: &[usize], number: Number) -> Vec<usize> {
        let mut chosen = first.to_vec();
        let mut seen = self.seen(first);
        let most = if let Number::Exactly(number) = number { number } else { MOST };
        while chosen.len() < most {
            let free = self.sights.iter().enumerate().filter(|(place, _)| !chosen.contains(place));
            let gains = free.map(|(place, sight)| (place, sight, seen.gain(sight)));
            // Of equal ones the first, on every machine.
            let best = gains.min_by_key(|(.., gain)| Reverse(*gain));
            let Some((place, sight, gain)) = best.filter(|(.., gain)| *gain > 0) else { break };
            if number == Number::WhileItGains && self.value(gain) < LEAST_GAIN {
                break;
            }
            chosen.push(place);
            seen.add(sight);
        }
        chosen
    }

    /// The best of all pairs, and its value, where they are few enough to wait for. None with less than two places.
    #[must_use]
    pub fn best_pair(&self) -> Option<([usize; 2], f64)> {
        let after = |one: usize| {
            let seen = self.seen(&[one]);
            let others = self.sights.iter().enumerate().skip(one + 1);
            let pairs = others.map(|(other, sight)| ([one, other], seen.worth() + seen.gain(sight)));
            pairs.min_by_key(|(_, worth)| Reverse(*worth))
        };
        let best = (0..self.sights.len()).filter_map(after).min_by_key(|(_, worth)| Reverse(*worth));
        best.map(|(pair, worth)| (pair, self.value(worth)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::sight::tests::sight;
    use super::*;

    #[test]
    fn the_second_module_goes_where_the_first_does_not_see_or_to_another_side() {
        let sights = [sight(0, &[0, 1, 2, 3]), sight(1, &[0, 1, 2]), sight(0, &[4, 5]), sight(0, &[0, 1, 2])];
        let choice = Choice { sights: &sights, kept: Seen::nothing(64), open: 8 };
        assert_eq!(
            choice.greedy(&[], Number::Exactly(3)),
            [0, 2, 1],
            "two new cells are worth more than three again"
        );
        assert_eq!(choice.greedy(&[], Number::Exactly(9)), [0, 2, 1], "the fourth sees nothing new");
        assert_eq!(choice.greedy(&[3], Number::Exactly(2)), [3, 2]);
        assert_eq!(choice.best_pair(), Some(([0, 2], choice.value(ONE * 6))));
    }

    #[test]
    fn a_module_that_adds_next_to_nothing_is_not_chosen_unless_asked_for() {
        let all: Vec<usize> = (0..100).collect();
        let sights = [sight(0, &all), sight(1, &[3])];
        let choice = Choice { sights: &sights, kept: Seen::nothing(128), open: 100 };
        assert_eq!(choice.greedy(&[], Number::WhileItGains), [0]);
        assert_eq!(choice.greedy(&[], Number::Exactly(3)), [0, 1]);
    }
}
