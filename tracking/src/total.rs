//! How many people are in the whole site, as the map's large number has it.
//!
//! ```text
//!   zones with `count`, or else all of them     is said
//!   each has a count                            people in all zones, `known`
//!   some have none, people are found            the same, `partly`: at least so many
//!   some have none, no person is found          null: a person may be where no device looks
//!   none has a count                            null, `unknown`
//! ```
//!
//! A person is a track that a zone counts ([`Role`]): one that was never seen to come in is one in a secure zone, and nowhere else.
//! A person in two zones is one. There are never fewer than in one of the zones: at its edge a written place, which is rounded, may
//! lie outside. A site without zones is known while a device watches whose place is known and whose reports are used: what a module without
//! a place sees is nowhere, and of one whose times are not known nothing is used.

use crate::count;
use crate::geometry::{Point, inside};
use crate::jsonl::{TrackLine, TracksLine};
use crate::occupancy::{Total, ZoneKnown};
use crate::site::{Exclude, Site, Zone};
use crate::snapshot::{DeviceState, ModuleLine};
use crate::zones::SEEN_S;
use crate::zones::verdict::Role;

/// The total of a line.
#[must_use]
pub fn total(site: &Site, line: &TracksLine, modules: &[ModuleLine]) -> Total {
    let asked: Vec<&Zone> = site.counted().collect();
    let has_count = |zone: &&&Zone| line.zones.get(&zone.name).is_some_and(|zone| zone.count().is_some());
    let known = asked.iter().filter(has_count).count();
    let is_open =
        |zone: &&Zone| line.zones.get(&zone.name).is_none_or(|zone| zone.state() != ZoneKnown::Known);
    let has_place = |name: &str| site.placed().any(|known| known == name);
    let is_used = |line: &ModuleLine| line.unused_s.is_some_and(|unused_s| unused_s < SEEN_S);
    let watches = |line: &ModuleLine| line.state == DeviceState::Watching && has_place(&line.name);
    let watched = modules.iter().any(|line| watches(line) && is_used(line));
    let state = match () {
        () if asked.is_empty() && watched => ZoneKnown::Known,
        () if asked.is_empty() || known == 0 => ZoneKnown::Unknown,
        () if asked.iter().any(is_open) => ZoneKnown::Partly,
        () => ZoneKnown::Known,
    };
    let in_one = asked.iter().filter_map(|zone| line.zones.get(&zone.name)?.count()).max();
    let found = people(site, line).max(in_one.unwrap_or(0));
    let is_said = match state {
        ZoneKnown::Known => true,
        ZoneKnown::Partly => found > 0 || known == asked.len(),
        ZoneKnown::Unknown => false,
    };
    Total { count: is_said.then_some(found), state }
}

/// Probability of no person, of one, of two, … in the whole site: of the tracks that the total counts, each with its
/// probability of existing, and for as many people as a track stands for.
#[must_use]
pub fn distribution(site: &Site, line: &TracksLine) -> Vec<f64> {
    count::distribution(counted(site, line).map(|track| track.existence))
}

fn people(site: &Site, line: &TracksLine) -> u32 {
    u32::try_from(counted(site, line).count()).unwrap_or(u32::MAX)
}

/// Whether a track is a person of the site: anywhere, or by the rule of a secure zone that it is in.
#[must_use]
pub fn is_person(site: &Site, track: &TrackLine) -> bool {
    let is_counted = |is_secure| Role::of(track.origin, track.state, is_secure).is_counted();
    let at = Point::new(track.x, track.y);
    let mut secure = site.zones.iter().filter(|zone| zone.secure);
    is_counted(false) || is_counted(true) && secure.any(|zone| inside(at, &zone.corners()))
}

/// Tracks that are counted in a zone, or anywhere if the site has no zones; none in an excluded area.
fn counted<'a>(site: &Site, line: &'a TracksLine) -> impl Iterator<Item = &'a TrackLine> {
    let zones: Vec<Vec<Point>> = site.zones.iter().map(Zone::corners).collect();
    let excluded: Vec<Vec<Point>> = site.excludes.iter().map(Exclude::corners).collect();
    line.tracks.iter().filter(move |track| is_person(site, track)).filter(move |track| {
        let is_in = |area: &Vec<Point>| inside(Point::new(track.x, track.y), area);
        !excluded.iter().any(is_in) && (zones.is_empty() || zones.iter().any(is_in))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jsonl::ZoneLine;
    use crate::occupancy::Found;
    use crate::tracker::{LifeCycle, Origin};

    const SITE: &str = "
        [[zone]]
        name = \"hall\"
        polygon = [[0, 0], [4, 0], [4, 4], [0, 4]]
        count = true
        [[zone]]
        name = \"desk\"
        polygon = [[0, 0], [2, 0], [2, 2], [0, 2]]
        count = true
        [[zone]]
        name = \"street\"
        polygon = [[9, 0], [10, 0], [10, 1]]
        [[exclude]]
        name = \"mirror\"
        polygon = [[3, 3], [4, 3], [4, 4], [3, 4]]";

    fn line(places: &[(f64, f64)], zones: &[(&str, u32, ZoneKnown)]) -> TracksLine {
        let track = |(id, &(x, y)): (u64, &(f64, f64))| -> TrackLine {
            let text = format!("{{\"id\":{id},\"x\":{x},\"y\":{y},\"state\":\"confirmed\"}}");
            serde_json::from_str(&text).unwrap()
        };
        let zone = |&(name, count, state): &(&str, u32, ZoneKnown)| {
            (name.to_owned(), ZoneLine::new(Found::inside(count, vec![1.0]), 1.0, state))
        };
        let (tracks, zones) = ((1..).zip(places).map(track).collect(), zones.iter().map(zone).collect());
        TracksLine { tracks, zones, ..TracksLine::default() }
    }

    #[test]
    fn who_is_in_two_zones_is_one_and_what_is_not_known_is_not_empty() {
        use ZoneKnown::{Known, Partly, Unknown};
        let site = Site::parse("site", SITE).unwrap();
        let said = |line: &TracksLine| {
            let Total { count, state } = total(&site, line, &[]);
            (count, state)
        };
        // In both zones, in one, in an excluded area, beside all.
        let people = [(1.0, 1.0), (3.0, 1.0), (3.5, 3.5), (7.0, 7.0)];
        assert_eq!(said(&line(&people, &[("hall", 2, Known), ("desk", 1, Known)])), (Some(2), Known));
        assert_eq!(said(&line(&people, &[("hall", 2, Partly), ("desk", 1, Known)])), (Some(2), Partly));
        assert_eq!(said(&line(&people, &[("hall", 2, Known), ("desk", 1, Unknown)])), (Some(2), Partly));
        assert_eq!(said(&line(&[], &[("hall", 0, Known), ("desk", 0, Unknown)])), (None, Partly));
        assert_eq!(said(&line(&[], &[("hall", 0, Known), ("desk", 0, Known)])), (Some(0), Known));
        assert_eq!(said(&line(&people, &[("hall", 2, Unknown), ("desk", 1, Unknown)])), (None, Unknown));
        assert_eq!(said(&line(&people, &[])), (None, Unknown));
    }

    #[test]
    fn who_is_counted_in_a_zone_is_there_though_the_written_place_is_beside_it() {
        use ZoneKnown::Known;
        let site = Site::parse("site", SITE).unwrap();
        let line = line(&[(4.0, 1.0)], &[("hall", 1, Known), ("desk", 0, Known)]);
        assert_eq!(total(&site, &line, &[]), Total { count: Some(1), state: Known });
    }

    #[test]
    fn a_track_that_a_secure_zone_counts_is_in_the_total_whatever_else_is() {
        let text = SITE.replace("name = \"desk\"", "name = \"desk\"\nsecure = true");
        let site = Site::parse("site", &text).unwrap();
        let zones = [("hall", 1, ZoneKnown::Known), ("desk", 1, ZoneKnown::Known)];
        // A person in the hall, and beside the desk's edge and at the desk each one that was never seen to come in.
        let mut line = line(&[(3.0, 1.0), (2.5, 1.0), (1.0, 1.0)], &zones);
        for track in line.tracks.iter_mut().skip(1) {
            (track.state, track.origin) = (LifeCycle::Tentative, Origin::Unexplained);
        }
        let count = |line: &TracksLine| total(&site, line, &[]).count;
        assert_eq!(count(&line), Some(2), "one of the hall, and one of the desk");
        assert_eq!(distribution(&site, &line).len(), 5);
        line.tracks[2].origin = Origin::PartOf(1);
        assert_eq!(count(&line), Some(1), "a part is no person of its own");
    }

    #[test]
    fn a_site_without_zones_is_known_while_a_device_watches_whose_place_is_known() {
        let text = "[[module]]\nname = \"left\"\nx = 0\ny = 0\n[[module]]\nname = \"new\"\nx = 0\ny = 0\nplaced = false\n
            [[floor]]\nname = \"mat\"\nx = 0\ny = 0\ncolumns = 4\nrows = 4\n";
        let site = Site::parse("site", text).unwrap();
        let people = line(&[(1.0, 1.0)], &[]);
        let after = |name: &str, state, unused_s| {
            let line = ModuleLine { name: name.into(), state, unused_s, ..ModuleLine::default() };
            total(&site, &people, &[line]).count
        };
        let count = |name: &str, state| after(name, state, Some(0.1));
        assert_eq!(
            [None, Some(2.0)].map(|unused_s| after("left", DeviceState::Watching, unused_s)),
            [None; 2]
        );
        assert_eq!(["left", "mat"].map(|name| count(name, DeviceState::Watching)), [Some(1); 2]);
        assert_eq!(["left", "mat"].map(|name| count(name, DeviceState::Missing)), [None; 2]);
        assert_eq!(["new", "stranger"].map(|name| count(name, DeviceState::Watching)), [None; 2]);
    }

    #[test]
    fn the_distribution_is_of_those_who_are_counted() {
        let site = Site::parse("site", SITE).unwrap();
        let mut line = line(&[(1.0, 1.0), (3.0, 1.0), (3.5, 3.5), (7.0, 7.0)], &[]);
        line.tracks.iter_mut().for_each(|track| track.existence = 0.5);
        let one = [0.5 + 0.5 * 0.02, 0.5 * 0.97, 0.5 * 0.01];
        let p = distribution(&site, &line);
        assert_eq!(p.len(), 5);
        assert!(
            (p[0] - one[0] * one[0]).abs() < 1e-12 && (p[1] - 2.0 * one[0] * one[1]).abs() < 1e-12,
            "{p:?}"
        );
    }
}
