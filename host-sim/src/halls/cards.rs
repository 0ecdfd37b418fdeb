//! Cards of the people in the halls: each is read once, in the hall where its person is, after they have been found.
//!
//! ```text
//!   person 4  ──●───── 2 s ─────✕──────────▶      ● appears   ✕ card "P4" is read at the person's place
//! ```

use std::collections::BTreeMap;

use kehai_tracking::geometry::Point;

use super::world::{AREAS, depth_m};

/// A card is read so long after its person has appeared, s: they have been found.
const READ_AFTER_S: f64 = 2.0;

/// How well a reader knows where a card is, m.
pub const SIGMA_M: f64 = 0.1;

/// A card that is due.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Due {
    /// The hall in which it is read.
    pub hall: usize,
    /// Whose it is.
    pub person: u64,
    /// Where.
    pub at: Point,
}

/// When people appeared, and whether their cards were read.
#[derive(Debug, Default)]
pub struct Cards {
    people: BTreeMap<u64, (f64, bool)>,
}

impl Cards {
    /// The cards that are read at `t_s`, of the people who are there.
    pub fn due(&mut self, t_s: f64, people: impl Iterator<Item = (u64, Point)>) -> Vec<Due> {
        let mut due = Vec::new();
        for (person, at) in people {
            let (since_s, is_read) = self.people.entry(person).or_insert((t_s, false));
            let hall = (0..AREAS.len()).find(|hall| depth_m(*hall, at) > 0.0);
            let Some(hall) = hall.filter(|_| !*is_read && t_s - *since_s >= READ_AFTER_S) else { continue };
            *is_read = true;
            due.push(Due { hall, person, at });
        }
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_card_is_read_once_two_seconds_after_its_person_has_appeared_in_a_hall() {
        let mut cards = Cards::default();
        let mut read = |t_s: f64, x: f64| cards.due(t_s, [(7, Point::new(x, 3.0))].into_iter());
        assert!(read(5.0, 3.0).is_empty() && read(6.9, 3.0).is_empty());
        assert!(read(7.0, -50.0).is_empty(), "in no hall");
        let due = read(7.1, 3.0);
        assert_eq!(due, [Due { hall: 0, person: 7, at: Point::new(3.0, 3.0) }]);
        assert!(read(9.0, 3.0).is_empty(), "read already");
    }
}
