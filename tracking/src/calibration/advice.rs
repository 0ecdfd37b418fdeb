//! Where to walk next.
//!
//! ```text
//!   hall ══════ kitchen          1  a module that nothing links: walk from the others to it
//!     ║           ┊ 6 s          2  a pair that has begun to see the walker together: more of that
//!   living      study            3  every pair has its 20 s: done
//! ```
//!
//! Two modules are a pair of the overlap graph once they have seen the walker together for a moment; the
//! overlaps need not be given. A pair that gets no further although the walker follows the advice is left as it is.

use std::collections::BTreeMap;

use crate::geometry::Point;

use super::align::link;
use super::walk::Walk;
use super::{ENOUGH_S, LEAST_S, LEAST_SPREAD_M};

/// Two modules with this much common time overlap, s: longer than a glance through a door.
pub const OVERLAP_S: f64 = 2.0;

/// A pair that was asked for so long, s, and gained less than half of that time, gets no further.
const PATIENCE_S: f64 = 25.0;

/// Walks longer than this gain nothing, s.
pub const LONGEST_S: f64 = 180.0;

/// What the walker is to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Advice {
    /// Several people are in view of a module: all but one are to leave.
    Alone {
        /// Of which.
        module: usize,
    },
    /// No walker has been seen yet, or not by the first module.
    Begin,
    /// A module that no other is linked with: walk to it from where the others see.
    Reach {
        /// It.
        module: usize,
    },
    /// More of two modules' common view.
    Together {
        /// They.
        modules: (usize, usize),
        /// What they have, s.
        common_s: f64,
        /// A place that both see, in the frame of the first of them.
        place: Option<Point>,
    },
    /// Every pair has enough.
    Enough,
}

impl Advice {
    /// The same with some modules the other way up, `turned` by module: what one of them sees on its left is on its right.
    #[must_use]
    pub fn with_turned(&self, turned: &[bool]) -> Self {
        match *self {
            Self::Together { modules, common_s, place: Some(place) }
                if turned.get(modules.0) == Some(&true) =>
            {
                Self::Together { modules, common_s, place: Some(Point::new(place.x, -place.y)) }
            }
            other => other,
        }
    }
}

/// Says where to walk next, second by second.
#[derive(Clone, Debug, Default)]
pub struct Guide {
    /// Pairs asked for: since when, and what they had then.
    asked: BTreeMap<(usize, usize), (f64, f64)>,
    /// Pairs that get no further.
    given_up: Vec<(usize, usize)>,
    last: Option<((usize, usize), f64)>,
}

impl Guide {
    /// What to do at `at_s`.
    pub fn advise(&mut self, walk: &Walk, at_s: f64) -> Advice {
        if let (_, several) = walk.now(at_s)
            && let Some(&module) = several.first()
        {
            return Advice::Alone { module };
        }
        if walk.seen_s(0) < 1.0 {
            return Advice::Begin;
        }
        let pairs: Vec<((usize, usize), f64)> =
            walk.pairs().into_iter().filter(|(_, common_s)| *common_s >= OVERLAP_S).collect();
        let links = links(walk, &pairs);
        let linked = linked(walk.modules(), &links);
        let missing = |pair: &&((usize, usize), f64)| pair.1 < ENOUGH_S && !self.given_up.contains(&pair.0);
        // Pairs that lead to modules which nothing links yet come first, then the pair with the least common time.
        let open: Vec<&((usize, usize), f64)> = pairs.iter().filter(missing).collect();
        let leads = |pair: &&&((usize, usize), f64)| linked[pair.0.0] != linked[pair.0.1];
        let before = self.last.map(|(pair, _)| pair);
        let goes_on = open.iter().find(|pair| Some(pair.0) == before);
        let next = open.iter().filter(leads).max_by(|a, b| a.1.total_cmp(&b.1));
        let unlinked = linked.iter().position(|linked| !linked);
        let chosen = match (next, unlinked) {
            (Some(pair), _) => **pair,
            (None, Some(module)) => return Advice::Reach { module },
            // A pair that was begun is finished first.
            (None, None) => match goes_on.or_else(|| open.iter().min_by(|a, b| b.1.total_cmp(&a.1))) {
                Some(pair) => **pair,
                None => return Advice::Enough,
            },
        };
        let (pair, common_s) = chosen;
        self.last = Some((pair, at_s));
        let (since_s, had_s) = *self.asked.entry(pair).or_insert((at_s, common_s));
        if common_s - had_s >= 0.5 * PATIENCE_S {
            self.asked.insert(pair, (at_s, common_s));
        } else if at_s - since_s > PATIENCE_S && linked[pair.0] && linked[pair.1] {
            self.given_up.push(pair);
        }
        Advice::Together { modules: pair, common_s, place: far_place(walk, pair) }
    }

    /// How much of what is needed is there: 0 to 1. A module that nothing links counts as a pair with nothing.
    #[must_use]
    pub fn progress(&self, walk: &Walk) -> f64 {
        let pairs: Vec<((usize, usize), f64)> =
            walk.pairs().into_iter().filter(|(_, common_s)| *common_s >= OVERLAP_S).collect();
        let linked = linked(walk.modules(), &links(walk, &pairs));
        let alone = linked.iter().filter(|linked| !**linked).count() as f64;
        let share = |pair: &((usize, usize), f64)| {
            if self.given_up.contains(&pair.0) { 1.0 } else { (pair.1 / ENOUGH_S).min(1.0) }
        };
        let needed = pairs.len() as f64 + alone;
        // A sum of nothing is -0.
        let done = pairs.iter().map(share).sum::<f64>() + 0.0;
        if needed == 0.0 { 0.0 } else { done / needed }
    }
}

/// Pairs that have seen enough to link two modules.
fn links(walk: &Walk, pairs: &[((usize, usize), f64)]) -> Vec<(usize, usize)> {
    let good = |(pair, common_s): &((usize, usize), f64)| {
        *common_s >= LEAST_S && link(walk, pair.0, pair.1).is_some_and(|link| link.spread_m >= LEAST_SPREAD_M)
    };
    pairs.iter().filter(|pair| good(pair)).map(|(pair, _)| *pair).collect()
}

/// Which modules are linked with the first one.
fn linked(modules: usize, links: &[(usize, usize)]) -> Vec<bool> {
    let mut linked = vec![false; modules];
    if let Some(first) = linked.first_mut() {
        *first = true;
    }
    for _ in 0..modules {
        for &(one, other) in links {
            let either = linked[one] || linked[other];
            (linked[one], linked[other]) = (either, either);
        }
    }
    linked
}

/// Of the places where both saw the walker, in the frame of the first, the one farthest from where they saw him last: so
/// the walk goes to and fro across all they share.
fn far_place(walk: &Walk, (one, other): (usize, usize)) -> Option<Point> {
    let places: Vec<Point> = walk.common(one, other).map(|(here, _)| here.place()).collect();
    let last = *places.last()?;
    places.into_iter().max_by(|a, b| (*a - last).length().total_cmp(&(*b - last).length()))
}
