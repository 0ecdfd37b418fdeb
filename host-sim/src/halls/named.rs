//! Names over borders, followed in two ways: a name that one way loses while the other keeps it is lost by that way alone.
//!
//! ```text
//!   one tracker   ── "a11c…" ─┼─ "a11c…" ─▶ kept         both ways lose a name where people meet and cannot be told
//!   four          ── "a11c…" ─┼─         ─▶ lost alone   apart: that is no fault of a border
//! ```

/// The same crossing is settled at times that differ by less, s: the one way pairs a person a little later than the other.
const SAME_S: f64 = 1.0;

/// A crossing of a person who had their name before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Named {
    /// When the person was settled in the next hall, s.
    pub t_s: f64,
    /// The person.
    pub person: u64,
    /// From which hall to which.
    pub halls: [usize; 2],
    /// Whether they had it after, too.
    pub kept: bool,
}

/// How many of the names that `own` loses `other` keeps at the same crossing.
#[must_use]
pub fn lost_alone(own: &[Named], other: &[Named]) -> u64 {
    let is_same = |one: &Named, two: &Named| {
        one.person == two.person && one.halls == two.halls && (one.t_s - two.t_s).abs() < SAME_S
    };
    let lost = own.iter().filter(|named| !named.kept);
    lost.filter(|lost| other.iter().any(|named| named.kept && is_same(lost, named))).count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_lost_alone_only_if_the_other_way_keeps_it_at_that_crossing() {
        let named = |t_s: f64, person: u64, kept: bool| Named { t_s, person, halls: [0, 1], kept };
        let own = [named(5.0, 1, false), named(6.0, 2, true), named(7.0, 3, false), named(8.0, 4, false)];
        let other = [named(5.2, 1, true), named(6.0, 2, false), named(7.0, 3, false), named(20.0, 4, true)];
        assert_eq!((lost_alone(&own, &other), lost_alone(&other, &own)), (1, 1));
        let back = Named { halls: [1, 0], ..other[0] };
        assert_eq!(lost_alone(&own, &[back]), 0, "another crossing of the same person");
    }
}
