//! The people of a snapshot, as `people_msgs/msg/People`.
//!
//! ```text
//!   track 7, occluded, in the hall    name track-7 · place, velocity · reliability: that a person is there at all
//!                                     tagnames  state     zone   card
//!                                     tags      occluded  hall   a11ce000
//!   no track, and all is known        an empty list
//!   no track, and a part is not seen  no message: a list cannot say that it does not know
//! ```
//!
//! A name stays as long as its person is followed. What is known of a card is a tag, since it may change: by it a consumer that goes
//! by names would take the person for another.

use kehai_tracking::geometry::{Point as Place, inside};
use kehai_tracking::jsonl::TrackLine;
use kehai_tracking::names::NameLine;
use kehai_tracking::occupancy::{Total, ZoneKnown};
use kehai_tracking::site::{Exclude, Site};
use kehai_tracking::snapshot::Snapshot;
use kehai_tracking::total::is_person;
use kehai_tracking::tracker::{LifeCycle, TrackId};

use super::messages::{Header, People, Person, Point};
use super::names::MAP;

/// A card is said of its likeliest track if that is more probable than all others together.
const LIKELY: f64 = 0.5;

/// All people who are followed; none if there are none and not all of the site is known.
pub fn people(snapshot: &Snapshot, site: &Site) -> Option<People> {
    let people: Vec<Person> =
        followed(snapshot, site).map(|track| person(track, &snapshot.names, site)).collect();
    let is_empty = snapshot.total == Total { count: Some(0), state: ZoneKnown::Known };
    let is_said = !people.is_empty() || is_empty;
    is_said.then(|| People { header: Header::new(MAP, snapshot.stamp_ns()), people })
}

/// Tracks that the total counts anywhere, outside of excluded areas: also one that was never seen to come in, in a secure zone.
pub fn followed<'a>(snapshot: &'a Snapshot, site: &Site) -> impl Iterator<Item = &'a TrackLine> {
    let excluded: Vec<Vec<Place>> = site.excludes.iter().map(Exclude::corners).collect();
    let tracks = snapshot.line.tracks.iter().filter(move |track| is_person(site, track));
    tracks.filter(move |track| !excluded.iter().any(|area| inside(Place::new(track.x, track.y), area)))
}

/// What a track is called, as long as it is one.
pub fn name(track: TrackId) -> String {
    format!("track-{track}")
}

fn person(track: &TrackLine, names: &[NameLine], site: &Site) -> Person {
    let state = match track.state {
        LifeCycle::Tentative => "tentative",
        LifeCycle::Confirmed => "seen",
        LifeCycle::Occluded => "occluded",
    };
    let mut tags = vec![("state", state.to_owned())];
    let at = Place::new(track.x, track.y);
    let around = site.zones.iter().filter(|zone| inside(at, &zone.corners()));
    tags.extend(around.map(|zone| ("zone", zone.name.clone())));
    tags.extend(card(track.id, names).map(|label| ("card", label.to_owned())));
    let (tagnames, tags) = tags.into_iter().map(|(name, tag)| (name.to_owned(), tag)).unzip();
    Person {
        name: name(track.id),
        position: Point { x: track.x, y: track.y, z: 0.0 },
        velocity: Point { x: track.vx, y: track.vy, z: 0.0 },
        reliability: track.existence,
        tagnames,
        tags,
    }
}

/// The card whose likeliest track this is.
fn card(track: TrackId, names: &[NameLine]) -> Option<&str> {
    let probability = |name: &NameLine| {
        let likeliest = name.tracks.first().filter(|likely| likely.track == track)?;
        (likeliest.probability > LIKELY).then_some(likeliest.probability)
    };
    let known = names.iter().filter_map(|name| Some((name.label.as_str(), probability(name)?)));
    known.max_by(|(_, one), (_, other)| one.total_cmp(other)).map(|(label, _)| label)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros2::messages::Time;
    use kehai_tracking::jsonl::TracksLine;
    use kehai_tracking::names::Likelihood;
    use serde_json::{Value, json};

    const SITE: &str = "
        [[zone]]
        name = \"hall\"
        polygon = [[0, 0], [4, 0], [4, 4], [0, 4]]
        [[zone]]
        name = \"desk\"
        polygon = [[0, 0], [2, 0], [2, 2], [0, 2]]
        [[exclude]]
        name = \"mirror\"
        polygon = [[3, 3], [4, 3], [4, 4], [3, 4]]";

    fn snapshot(tracks: &[Value], total: Total) -> Snapshot {
        let tracks = tracks.iter().map(|track| serde_json::from_value(track.clone()).unwrap()).collect();
        let line = TracksLine { t: 1.0, tracks, ..TracksLine::default() };
        Snapshot { total, ..Snapshot::of(1_700_000_000_250, line) }
    }

    fn said(snapshot: &Snapshot) -> Option<People> {
        people(snapshot, &toml::from_str(SITE).unwrap())
    }

    const NOT_KNOWN: Total = Total { count: None, state: ZoneKnown::Unknown };
    const EMPTY: Total = Total { count: Some(0), state: ZoneKnown::Known };

    #[test]
    fn a_person_has_place_velocity_reliability_and_tags() {
        let track = json!({ "id": 7, "x": 1.0, "y": 1.5, "vx": 0.5, "vy": -0.25, "state": "occluded", "existence": 0.8 });
        let mut snapshot = snapshot(&[track], NOT_KNOWN);
        let line = |label: &str, track, probability| NameLine {
            card: None,
            label: label.into(),
            heard_s: 1.0,
            read_s: Some(1.0),
            tracks: vec![Likelihood { track, probability }],
            zones: Vec::new(),
        };
        snapshot.names =
            vec![line("aaaa", 7, 0.6), line("bbbb", 7, 0.9), line("cccc", 8, 1.0), line("dddd", 7, 0.5)];
        let people = said(&snapshot).unwrap();
        assert_eq!(
            people.header,
            Header { stamp: Time { sec: 1_700_000_000, nanosec: 250_000_000 }, frame_id: "map".into() }
        );
        let [person] = &people.people[..] else { unreachable!("{people:?}") };
        assert_eq!((person.name.as_str(), person.reliability), ("track-7", 0.8));
        assert_eq!(person.position, Point { x: 1.0, y: 1.5, z: 0.0 });
        assert_eq!(person.velocity, Point { x: 0.5, y: -0.25, z: 0.0 });
        assert_eq!(person.tagnames, ["state", "zone", "zone", "card"]);
        assert_eq!(person.tags, ["occluded", "hall", "desk", "bbbb"]);
    }

    #[test]
    fn only_who_is_confirmed_and_counted_is_a_person() {
        let track = |id: u64, x: f64, state: &str| json!({ "id": id, "x": x, "y": 3.5, "state": state });
        let tracks = [track(1, 1.0, "tentative"), track(2, 1.0, "confirmed"), track(3, 3.5, "confirmed")];
        let people = said(&snapshot(&tracks, NOT_KNOWN)).unwrap();
        let names: Vec<&str> = people.people.iter().map(|person| person.name.as_str()).collect();
        assert_eq!(names, ["track-2"]);
        assert_eq!(people.people[0].tags, ["seen", "hall"]);
    }

    #[test]
    fn one_who_was_never_seen_to_come_in_is_a_person_in_a_secure_zone() {
        let track = json!({ "id": 7, "x": 1.0, "y": 3.0, "state": "tentative", "origin": "unexplained" });
        let snapshot = snapshot(&[track], NOT_KNOWN);
        assert_eq!(said(&snapshot), None);
        let secure = SITE.replacen("polygon", "secure = true\npolygon", 1);
        let people = people(&snapshot, &toml::from_str(&secure).unwrap()).unwrap();
        assert_eq!((people.people.len(), people.people[0].tags[0].as_str()), (1, "tentative"));
    }

    #[test]
    fn an_empty_list_is_said_only_where_that_is_known() {
        let partly = |count| Total { count, state: ZoneKnown::Partly };
        assert_eq!(said(&snapshot(&[], EMPTY)).map(|people| people.people.len()), Some(0));
        for total in [NOT_KNOWN, partly(None), partly(Some(0)), Total { count: Some(1), ..EMPTY }] {
            assert_eq!(said(&snapshot(&[], total)), None, "{total:?}");
        }
        // Nor by one who is not a person yet.
        let tentative = json!({ "id": 1, "x": 1.0, "y": 1.0, "state": "tentative" });
        assert_eq!(said(&snapshot(&[tentative], NOT_KNOWN)), None);
    }
}
