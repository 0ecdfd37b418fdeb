//! Whether more people are in a zone than may be.
//!
//! ```text
//!   people_max = 4        4   5   5   5   5   ?   ?   4
//!   known to be more          ├─2 s─▶ alarm ────┤   ├─10 s─▶ over
//! ```
//!
//! Only what is known raises it: a zone without a count has none, and of one that is seen in part at least so many are there.

use std::collections::BTreeMap;

use crate::alarm::{Active, AlarmKind, Cause, Source};
use crate::occupancy::{ZoneKnown, ZoneLine};
use crate::site::Site;

/// It is raised when it has been so for so long, s: for less, a person passes through, or one person is two tracks.
const RAISED_S: f64 = 2.0;

/// It is over when it has not been known for so long, s: people about the edge of a zone come and go.
const OVER_S: f64 = 10.0;

/// What is known of one zone.
#[derive(Clone, Debug)]
struct Watched {
    /// Whether more are known to be in it than may be, and since when, s.
    is_more: bool,
    since_s: f64,
    /// The alarm, in words.
    raised: Option<String>,
}

/// The zones of a site that have a `people_max`.
#[derive(Clone, Debug, Default)]
pub struct Capacity(BTreeMap<String, Watched>);

impl Capacity {
    /// Takes what is known of zones at `at_s`; the alarms that are on.
    pub fn observe(&mut self, site: &Site, zones: &BTreeMap<String, ZoneLine>, at_s: f64) -> Vec<Active> {
        let limited = || site.zones.iter().filter_map(|zone| Some((&zone.name, zone.people_max?)));
        self.0.retain(|name, _| limited().any(|(known, _)| known == name));
        let mut alarms = Vec::new();
        for (name, most) in limited() {
            let line = zones.get(name);
            let more =
                line.and_then(|line| Some((line.state(), line.count().filter(|count| *count > most)?)));
            let first = || Watched { is_more: more.is_some(), since_s: at_s, raised: None };
            let watched = self.0.entry(name.clone()).or_insert_with(first);
            if watched.is_more != more.is_some() {
                (watched.is_more, watched.since_s) = (more.is_some(), at_s);
            }
            let since_s = at_s - watched.since_s;
            match more {
                Some((state, count)) if since_s >= RAISED_S || watched.raised.is_some() => {
                    watched.raised = Some(words(state, count, most));
                }
                None if since_s >= OVER_S => watched.raised = None,
                Some(_) | None => {}
            }
            alarms.extend(watched.raised.clone().map(|text| Active {
                source: Source::Zone(name.clone()),
                cause: Cause::Fault(AlarmKind::Crowded),
                text,
            }));
        }
        alarms
    }
}

fn words(state: ZoneKnown, count: u32, most: u32) -> String {
    let at_least = if state == ZoneKnown::Known { "" } else { "at least " };
    let people = if count == 1 { "person is" } else { "people are" };
    format!("{at_least}{count} {people} in it, {most} may be: let some leave")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::occupancy::Found;

    fn site(most: &str) -> Site {
        toml::from_str(&format!(
            "[[zone]]\nname = \"hall\"\npolygon = [[0, 0], [1, 0], [1, 1]]\n{most}\n[[zone]]\nname = \"yard\"\npolygon = [[0, 0], [1, 0], [1, 1]]\n"
        ))
        .unwrap()
    }

    fn zones(state: ZoneKnown, count: u32) -> BTreeMap<String, ZoneLine> {
        let line = ZoneLine::new(Found::inside(count, vec![1.0]), 0.9, state);
        [("hall".to_owned(), line.clone()), ("yard".to_owned(), line)].into()
    }

    /// What is said at each time, s.
    fn said(site: &Site, steps: &[(f64, ZoneKnown, u32)]) -> Vec<Vec<String>> {
        let mut capacity = Capacity::default();
        let mut at = |&(at_s, state, count): &(f64, ZoneKnown, u32)| {
            let alarms = capacity.observe(site, &zones(state, count), at_s);
            alarms.into_iter().map(|alarm| format!("{}: {}", alarm.source, alarm.text)).collect()
        };
        steps.iter().map(&mut at).collect()
    }

    #[test]
    fn more_than_may_be_raise_an_alarm_that_is_over_when_it_has_not_been_known_for_a_while() {
        use ZoneKnown::{Known, Partly, Unknown};
        let steps = [
            (0.0, Known, 4),
            (1.0, Known, 5),
            (2.9, Known, 5),
            (3.0, Known, 5),
            (4.0, Partly, 6),
            (5.0, Unknown, 9),
            (14.9, Known, 4),
            (15.0, Known, 4),
        ];
        let said = said(&site("people_max = 4"), &steps);
        let alarm = "zone hall: 5 people are in it, 4 may be: let some leave";
        let partly = "zone hall: at least 6 people are in it, 4 may be: let some leave";
        let expected: [&[&str]; 8] = [&[], &[], &[], &[alarm], &[partly], &[partly], &[partly], &[]];
        assert_eq!(said, expected);
    }

    #[test]
    fn a_zone_of_which_no_number_is_known_raises_none_and_one_without_a_limit_neither() {
        let unknown: Vec<_> = (0..40).map(|second| (f64::from(second), ZoneKnown::Unknown, 9)).collect();
        assert!(said(&site("people_max = 4"), &unknown).concat().is_empty());
        let known: Vec<_> = (0..40).map(|second| (f64::from(second), ZoneKnown::Known, 9)).collect();
        assert!(said(&site(""), &known).concat().is_empty());
        let nobody_may =
            said(&site("people_max = 0"), &[(0.0, ZoneKnown::Partly, 1), (2.0, ZoneKnown::Partly, 1)]);
        assert_eq!(nobody_may[1], ["zone hall: at least 1 person is in it, 0 may be: let some leave"]);
    }
}
