//! Zones that stay occupied for a while after the last person, so that no light goes out on a person who is hidden for a moment.
//!
//! ```text
//!   people, as known    2   1   0   0   0   0   ?   0
//!   hold_s              ╎       ├───────────┤
//!   occupied            ✓   ✓   ✓   ✓   ✓   –   ?   –       never said while the zone is not known
//! ```

use std::collections::BTreeMap;

use kehai_tracking::site::Site;
use kehai_tracking::snapshot::Snapshot;

/// Until when each zone with a `hold_s` stays occupied, ms of the clock of [`Outbox::due`](super::outbox::Outbox::due).
#[derive(Debug, Default)]
pub struct Holds {
    until_ms: BTreeMap<String, u64>,
    now_ms: u64,
}

impl Holds {
    /// Notes which zones have people in `frame`, at `now_ms`.
    pub(super) fn note(&mut self, frame: &Snapshot, site: &Site, now_ms: u64) {
        self.now_ms = now_ms;
        // Saturates: a time of at most an hour.
        let until_ms = |hold_s: f64| now_ms.saturating_add((hold_s * 1e3) as u64);
        let held: BTreeMap<&str, u64> =
            site.zones.iter().filter_map(|zone| Some((zone.name.as_str(), until_ms(zone.hold_s?)))).collect();
        // A hold that was made shorter, or taken from the site, counts from now on.
        self.until_ms.retain(|name, until_ms| {
            let Some(latest_ms) = held.get(name.as_str()) else { return false };
            *until_ms = (*until_ms).min(*latest_ms);
            now_ms < *until_ms
        });
        for (name, until_ms) in held {
            let people = frame.line.zones.get(name).and_then(|zone| zone.count());
            if people.is_some_and(|people| people > 0) {
                self.until_ms.insert(name.to_owned(), until_ms);
            }
        }
    }

    /// Whether the zone `name` is occupied with `count` people in it as known; none if they are not known.
    pub(super) fn is_occupied(&self, name: &str, count: Option<u32>) -> Option<bool> {
        let is_held = self.until_ms.get(name).is_some_and(|until_ms| self.now_ms < *until_ms);
        count.map(|count| count > 0 || is_held)
    }
}

#[cfg(test)]
mod tests {
    use super::super::messages::tests::{frame, zone};
    use super::*;
    use kehai_tracking::jsonl::ZoneKnown;

    fn site(hold_s: &str) -> Site {
        let text = format!("[[zone]]\nname = \"hall\"\npolygon = [[0, 0], [1, 0], [1, 1]]\n{hold_s}");
        Site::parse("site.toml", &text).unwrap()
    }

    /// What is said of the hall, a second after the other, with so many people as known.
    fn said(site: &Site, people: &[Option<u32>]) -> Vec<Option<bool>> {
        let mut holds = Holds::default();
        let step = |(index, count): (usize, &Option<u32>)| {
            let mut frame = frame();
            let state = if count.is_some() { ZoneKnown::Known } else { ZoneKnown::Unknown };
            frame.line.zones.insert("hall".into(), zone(count.unwrap_or(0), state));
            holds.note(&frame, site, index as u64 * 1000);
            holds.is_occupied("hall", *count)
        };
        people.iter().enumerate().map(step).collect()
    }

    #[test]
    fn a_zone_stays_occupied_for_its_hold_after_the_last_person() {
        let people = [Some(0), Some(1), Some(0), Some(0), Some(0), Some(2), Some(0)];
        let expected = [false, true, true, true, false, true, true].map(Some);
        assert_eq!(said(&site("hold_s = 2.5"), &people), expected);
    }

    #[test]
    fn without_a_hold_it_is_what_the_count_says() {
        let people = [Some(1), Some(0), None];
        assert_eq!(said(&site(""), &people), [Some(true), Some(false), None]);
    }

    #[test]
    fn a_hold_says_nothing_of_a_zone_that_is_not_known() {
        let people = [Some(1), None, Some(0), None, Some(0)];
        let expected = [Some(true), None, Some(true), None, Some(false)];
        assert_eq!(said(&site("hold_s = 2.5"), &people), expected);
    }

    #[test]
    fn a_hold_that_is_made_shorter_or_taken_from_the_site_holds_no_longer_than_the_site_says() {
        let mut holds = Holds::default();
        let mut frame = frame();
        frame.line.zones.insert("hall".into(), zone(1, ZoneKnown::Known));
        holds.note(&frame, &site("hold_s = 600"), 0);
        frame.line.zones.insert("hall".into(), zone(0, ZoneKnown::Known));
        let mut said = |hold_s: &str, now_ms: u64| {
            holds.note(&frame, &site(hold_s), now_ms);
            holds.is_occupied("hall", Some(0))
        };
        assert_eq!(said("hold_s = 600", 1000), Some(true));
        assert_eq!(said("hold_s = 2", 2000), Some(true));
        assert_eq!(said("hold_s = 2", 3900), Some(true));
        assert_eq!(said("hold_s = 2", 4000), Some(false));
        assert_eq!(said("hold_s = 600", 5000), Some(false), "a longer one begins with the next person");
        frame.line.zones.insert("hall".into(), zone(1, ZoneKnown::Known));
        holds.note(&frame, &site("hold_s = 600"), 6000);
        holds.note(&frame, &site(""), 6100);
        assert_eq!(holds.is_occupied("hall", Some(0)), Some(false));
    }
}
