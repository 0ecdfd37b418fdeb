//! Entries that stand open: a person was just seen on the way out through one, and the next may follow unseen.
//!
//! ```text
//!        ┄┄┄┄┄┄┄  entry
//!      ↑ A   ·:B:·      A was seen in it, on the way out. B, hidden behind others, may follow
//! ```
//!
//! No module reports that a door is open: a leaf that has gone is no candidate. A person who passes shows it.

use crate::geometry::Point;

/// For so long an entry stands open after a person was seen in it, s: people leave one after another every 1.2 s, and two of them
/// may be hidden.
const OPEN_S: f64 = 2.5;

/// A person who walks out slowly, at 0.5 m/s, comes from so far in that time, m.
const NEAR_M: f64 = 1.2;

/// See the module.
#[derive(Debug, Default)]
pub struct Openings {
    /// Where a person was seen on the way out, and when, s.
    seen: Vec<(Point, f64)>,
}

impl Openings {
    /// Notes that a person was seen on the way out, and forgets what is long ago.
    pub fn note(&mut self, passing: impl IntoIterator<Item = Point>, now_s: f64) {
        self.seen.retain(|(_, at_s)| now_s - at_s < OPEN_S);
        self.seen.extend(passing.into_iter().map(|place| (place, now_s)));
    }

    /// Whether a body at a place may have left through one.
    pub fn are_near(&self, place: Point) -> bool {
        self.seen.iter().any(|(opening, _)| (*opening - place).length() < NEAR_M)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entry_stands_open_near_where_a_person_left_for_a_moment() {
        let mut openings = Openings::default();
        let (door, near, far) = (Point::new(2.0, 0.0), Point::new(1.0, 0.0), Point::new(0.5, 0.0));
        openings.note([], 1.0);
        assert!(!openings.are_near(door));
        openings.note([door], 2.0);
        assert!(openings.are_near(door) && openings.are_near(near) && !openings.are_near(far));
        openings.note([], 4.4);
        assert!(openings.are_near(near));
        openings.note([], 4.6);
        assert!(!openings.are_near(near));
    }
}
