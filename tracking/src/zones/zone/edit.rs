//! What a zone of an edited site keeps of the old zones.
//!
//! ```text
//!   the same name and shape   all that was known of it
//!   another one               its cells: what was known at their places
//!                             the newest gap of the old zones that had a cell at one of them
//! ```

use std::collections::HashMap;

use super::{Gap, Zone};

/// What old zones knew, by [`place`](super::Cell::place).
#[derive(Debug, Default)]
pub struct Before(HashMap<(i64, i64), Known>);

/// What is known of a place.
#[derive(Clone, Copy, Debug)]
struct Known {
    seen_s: f64,
    was_seen: bool,
    gap: Option<Gap>,
}

impl Before {
    /// Of all zones before the edit.
    pub fn of(zones: &[Zone]) -> Self {
        let mut places: HashMap<(i64, i64), Known> = HashMap::new();
        for zone in zones {
            for cell in &zone.cells {
                let Known { seen_s, was_seen, gap } = places.entry(cell.place()).or_insert(Known {
                    seen_s: cell.seen_s,
                    was_seen: cell.was_seen,
                    gap: zone.gap,
                });
                *seen_s = seen_s.min(cell.seen_s);
                *was_seen |= cell.was_seen;
                *gap = newer(*gap, zone.gap);
            }
        }
        Self(places)
    }
}

impl Zone {
    /// Takes all that was known of it: it has the name and the shape that `was` had.
    pub fn go_on(&mut self, was: &mut Self) {
        self.cells = std::mem::take(&mut was.cells);
        (self.occupied_s, self.missed_s, self.gap) = (was.occupied_s, was.missed_s, was.gap);
    }

    /// Takes what was known of its places: it is new, or has another name or shape. A person that a gap may have hidden in
    /// an old zone may be hidden in this one.
    pub fn inherit(&mut self, before: &Before) {
        for cell in &mut self.cells {
            let known = before.0.get(&cell.place());
            cell.seen_s = known.map_or(f64::NEG_INFINITY, |known| known.seen_s);
            cell.was_seen = known.is_some_and(|known| known.was_seen);
            self.gap = newer(self.gap, known.and_then(|known| known.gap));
        }
    }
}

/// The gap that ended last.
fn newer(one: Option<Gap>, other: Option<Gap>) -> Option<Gap> {
    let gaps = one.into_iter().chain(other);
    gaps.max_by(|one, other| one.newest_s.total_cmp(&other.newest_s))
}
