//! What a track has been through: when and where it began, and which modules have detected it, each when last.
//!
//! ```text
//!   first ●────────────────●──────────▶ now        seen by   left   0.1 s ago
//!         12.1 s ago                                         right  7.4 s ago
//! ```

use crate::geometry::Point;

/// The modules that have detected a track, by their numbers in the site, and when each did last, s.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SeenBy(Vec<(usize, f64)>);

impl SeenBy {
    /// One module, at a time.
    #[must_use]
    pub fn of(module: usize, at_s: f64) -> Self {
        Self(vec![(module, at_s)])
    }

    /// Notes that a module has detected it.
    pub fn note(&mut self, module: usize, at_s: f64) {
        match self.0.iter_mut().find(|(known, _)| *known == module) {
            Some((_, seen_s)) => *seen_s = seen_s.max(at_s),
            None => self.0.push((module, at_s)),
        }
    }

    /// Adds what another has.
    pub fn add(&mut self, other: &Self) {
        other.0.iter().for_each(|(module, at_s)| self.note(*module, *at_s));
    }

    /// Whether a module has ever detected it.
    #[must_use]
    pub fn has(&self, module: usize) -> bool {
        self.0.iter().any(|(known, _)| *known == module)
    }

    /// The modules have other numbers: by each number now, the one before.
    pub fn renumber(&mut self, before: &[Option<usize>]) {
        let number = |module: &usize| before.iter().position(|before| *before == Some(*module));
        self.0 = self.0.iter().filter_map(|(module, at_s)| Some((number(module)?, *at_s))).collect();
    }

    /// Each module, and when it detected the track last, s.
    pub fn iter(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.0.iter().copied()
    }
}

/// What a track has been through.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct History {
    /// When it was detected first, s.
    pub first_s: f64,
    /// Where.
    pub first_at: Point,
    /// When it was detected last, s.
    pub last_s: f64,
    /// By whom.
    pub seen_by: SeenBy,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_module_has_seen_it_last_at_a_time_under_its_number_of_now() {
        let mut seen_by = SeenBy::of(0, 1.0);
        seen_by.note(2, 3.0);
        seen_by.note(0, 2.0);
        seen_by.note(2, 2.5);
        let mut other = SeenBy::of(5, 9.0);
        other.add(&seen_by);
        assert_eq!(other.iter().collect::<Vec<_>>(), [(5, 9.0), (0, 2.0), (2, 3.0)]);
        // Module 2 is module 0 now, 5 is gone, and 0 is the last.
        other.renumber(&[Some(2), None, Some(0)]);
        assert_eq!(other.iter().collect::<Vec<_>>(), [(2, 2.0), (0, 3.0)]);
        assert!(other.has(0) && !other.has(1));
    }
}
