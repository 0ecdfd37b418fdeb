//! Which modules may see the same person: those whose views may meet.
//!
//! ```text
//!      ╭───────╮ ╭───────╮                 ╭───────╮
//!     │  ╶●╴ r₁ ╳  r₂ ●   │               │    ●    │
//!      ╰───────╯ ╰───────╯                 ╰───────╯
//!       d ≤ r₁ + r₂: nearby                 another hall: what it sees is not compared, and its crowds do not matter
//! ```
//!
//! Without it the watch would compare every pair of a site, 125 000 of 500 modules, and one group of people anywhere would
//! silence it everywhere.

use crate::geometry::Point;

/// How far a module may see, and from where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// Its place, m.
    pub at: Point,
    /// The farthest of its background, m: of an open beam, how far it surely sees.
    pub reach_m: f64,
}

/// For every module the others whose views may meet its own, in their order. A module that has shown nothing yet has none.
/// `slack_m`: a module may have been moved so far.
pub fn nearby(reaches: &[Option<Reach>], slack_m: f64) -> Vec<Vec<usize>> {
    let meets =
        |one: &Reach, other: &Reach| (one.at - other.at).length() <= one.reach_m + other.reach_m + slack_m;
    let others = |(module, own): (usize, &Option<Reach>)| -> Vec<usize> {
        let Some(own) = own else { return Vec::new() };
        let others = reaches.iter().enumerate().filter(|(other, _)| *other != module);
        others
            .filter(|(_, other)| other.as_ref().is_some_and(|other| meets(own, other)))
            .map(|(other, _)| other)
            .collect()
    };
    reaches.iter().enumerate().map(others).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reach(x: f64, reach_m: f64) -> Option<Reach> {
        Some(Reach { at: Point::new(x, 0.0), reach_m })
    }

    #[test]
    fn modules_are_nearby_whose_views_may_meet() {
        let reaches = [reach(0.0, 4.0), reach(7.0, 3.5), None, reach(20.0, 5.0)];
        assert_eq!(nearby(&reaches, 0.0), [vec![1], vec![0], vec![], vec![]]);
        assert_eq!(nearby(&reaches, 5.0), [vec![1], vec![0, 3], vec![], vec![1]], "one may have been moved");
    }
}
