//! Whose name goes over the border: what an area said when it read the card, and where that person has gone since.
//!
//! ```text
//!   west  reads a11ce000 of 7 ●─────●┄┄┄ no track     what west says of its other tracks by then is no news
//!   east                         ●─────────▶          the name goes on with the person
//! ```

use super::tests::{area, both, frame, track};
use super::{AreaFrame, Campus};
use crate::jsonl::TrackLine;
use crate::names::{Likelihood, NameLine};
use crate::site::Site;
use crate::tracker::LifeCycle;

/// A card of which an area gives these tracks these shares, read so long ago at a place that is known.
fn named(shares: &[(u64, f64)], read_s: f64) -> NameLine {
    let tracks = shares.iter().map(|&(track, probability)| Likelihood { track, probability }).collect();
    let label = "a11ce000".into();
    NameLine { card: None, label, heard_s: read_s, read_s: Some(read_s), tracks, zones: Vec::new() }
}

/// A frame of so many tenths of a second after the start of its tracker.
fn said(tenth: u64, tracks: Vec<TrackLine>, names: Vec<NameLine>) -> AreaFrame {
    let mut said = frame(tenth, tracks);
    (said.frame.line.t, said.frame.names) = (tenth as f64 * 0.1, names);
    said
}

/// The place along x of the likeliest person of the only name, in a picture at so many tenths.
fn named_x(campus: &mut Campus, site: &Site, tenth: u64) -> Option<f64> {
    let picture = campus.picture(site, tenth * 100_000, 1);
    let person = picture.names.first().and_then(|line| line.tracks.first()).map(|likely| likely.track);
    picture.line.tracks.iter().find(|track| Some(track.id) == person).map(|track| track.x)
}

/// What west reads of its tracks at −0.5 (7) and −5 m (8), in this frame; east has no one.
fn read(campus: &mut Campus, site: &Site, tenth: u64, line: NameLine) -> Option<f64> {
    let tracks = vec![track(7, -0.5, 0.0), track(8, -5.0, 0.0)];
    campus.hear(&area("west"), said(tenth, tracks, vec![line]), tenth * 100_000);
    campus.hear(&area("east"), said(tenth, Vec::new(), Vec::new()), tenth * 100_000);
    named_x(campus, site, tenth)
}

#[test]
fn a_name_goes_over_the_border_with_its_person() {
    let (mut campus, site) = both();
    let say = |campus: &mut Campus, name: &str, number, tracks, names| {
        campus.hear(&area(name), said(number, tracks, names), number * 100_000);
        let picture = campus.picture(&site, number * 100_000, 1);
        picture.names.first().map(|line| line.tracks.clone()).unwrap_or_default()
    };
    let read = say(&mut campus, "west", 2, vec![track(7, -0.5, 0.0)], vec![named(&[(7, 0.9)], 0.0)]);
    assert_eq!(read, [Likelihood { track: 2, probability: 0.9 }]);
    say(&mut campus, "east", 3, vec![track(70, -0.45, 0.05)], Vec::new());
    // West has lost it; east has never read the card.
    let kept = say(&mut campus, "west", 4, Vec::new(), vec![named(&[], 0.2)]);
    assert_eq!(kept, [Likelihood { track: 2, probability: 0.9 }]);
    say(&mut campus, "east", 5, Vec::new(), Vec::new());
    let gone = say(&mut campus, "west", 6, Vec::new(), vec![named(&[], 0.4)]);
    assert_eq!(gone, [], "no track is there");
}

#[test]
fn an_area_does_not_guess_the_name_of_a_person_whom_another_sees() {
    let (mut campus, site) = both();
    let say = |campus: &mut Campus, number: u64, gone: bool, likeliest: u64| {
        let state = if gone { LifeCycle::Occluded } else { LifeCycle::Confirmed };
        let tracks = vec![TrackLine { state, ..track(7, 0.0, 0.0) }, track(8, -5.0, 0.0)];
        let line = named(&[(likeliest, 0.9)], 0.1 * (number - 2) as f64);
        campus.hear(&area("west"), said(number, tracks, vec![line]), number * 100_000);
        campus.hear(&area("east"), said(number, vec![track(70, 0.1, 0.0)], Vec::new()), number * 100_000);
        named_x(campus, &site, number)
    };
    assert!(say(&mut campus, 2, false, 7).is_some_and(|x| x > -1.0));
    assert!(say(&mut campus, 3, true, 8).is_some_and(|x| x > -1.0), "west guesses");
    // It is read again, in the west.
    let anew = said(20, vec![track(8, -5.0, 0.0)], vec![named(&[(8, 0.9)], 0.0)]);
    campus.hear(&area("west"), anew, 2_000_000);
    assert!(named_x(&mut campus, &site, 20).is_some_and(|x| x < -4.0));
}

#[test]
fn what_is_left_when_the_named_track_is_no_person_is_no_name() {
    let (mut campus, site) = both();
    let say = |campus: &mut Campus, number: u64, west: Vec<TrackLine>, shares: &[(u64, f64)]| {
        let line = named(shares, 0.1 * (number - 2) as f64);
        campus.hear(&area("west"), said(number, west, vec![line]), number * 100_000);
        campus.hear(&area("east"), said(number, vec![track(70, 0.1, 0.0)], Vec::new()), number * 100_000);
        named_x(campus, &site, number)
    };
    let at_border = say(&mut campus, 2, vec![track(7, 0.0, 0.0), track(8, -5.0, 0.0)], &[(7, 0.7), (8, 0.1)]);
    assert!(at_border.is_some_and(|x| x > -1.0));
    // West has another track for them, and the one it had named is over.
    for number in 3..40 {
        let named = say(&mut campus, number, vec![track(9, 0.0, 0.0), track(8, -5.0, 0.0)], &[(8, 0.1)]);
        assert!(named.is_some_and(|x| x > -1.0), "{number}: {named:?}");
    }
}

#[test]
fn while_the_likeliest_track_is_no_person_the_others_are_not_named() {
    let (mut campus, site) = both();
    assert_eq!(read(&mut campus, &site, 2, named(&[(7, 0.9)], 0.0)), Some(-0.5));
    // Read anew: 99 is not among the tracks that are people.
    assert_eq!(read(&mut campus, &site, 12, named(&[(99, 0.6), (8, 0.3)], 0.0)), Some(-0.5));
    assert_eq!(read(&mut campus, &site, 13, named(&[(8, 0.9)], 0.1)), Some(-5.0), "now it is one");
}

#[test]
fn a_reading_that_fits_nobody_takes_the_name_off() {
    let (mut campus, site) = both();
    assert_eq!(read(&mut campus, &site, 2, named(&[(7, 0.9)], 0.0)), Some(-0.5));
    assert_eq!(read(&mut campus, &site, 12, named(&[], 0.0)), None);
    assert_eq!(read(&mut campus, &site, 22, named(&[(7, 0.9)], 0.0)), Some(-0.5), "read once more");
}

#[test]
fn of_two_areas_that_read_it_at_once_the_one_that_sees_its_bearer_names_them() {
    let (mut campus, site) = both();
    // The sign goes to both trackers; in whatever order they come, only west has a track there.
    for (tenth, reader) in [(2, "west"), (20, "east")] {
        for (name, x) in [("east", 5.0), ("west", -5.0)] {
            let line = if name == reader { named(&[(7, 0.9)], 0.0) } else { named(&[], 0.0) };
            campus.hear(&area(name), said(tenth, vec![track(7, x, 0.0)], vec![line]), tenth * 100_000);
        }
        let x = named_x(&mut campus, &site, tenth);
        assert_eq!(x, Some(if reader == "west" { -5.0 } else { 5.0 }), "{reader}");
    }
}

#[test]
fn a_frame_that_comes_late_is_no_new_reading() {
    let (mut campus, site) = both();
    assert_eq!(read(&mut campus, &site, 2, named(&[(7, 0.9)], 0.0)), Some(-0.5));
    // West guesses by now. Its frame of 0.2 s after the reading comes 0.6 s late.
    let late = said(4, vec![track(7, -0.5, 0.0), track(8, -5.0, 0.0)], vec![named(&[(8, 0.9)], 0.2)]);
    campus.hear(&area("west"), late, 1_000_000);
    campus.hear(&area("east"), said(10, Vec::new(), Vec::new()), 1_000_000);
    assert_eq!(named_x(&mut campus, &site, 10), Some(-0.5));
    let line = campus.picture(&site, 1_000_000, 1).names.remove(0);
    assert_eq!(line.read_s, Some(0.8), "by the frame that came in time");
}

#[test]
fn a_sign_without_a_place_is_no_new_reading() {
    let (mut campus, site) = both();
    assert_eq!(read(&mut campus, &site, 2, named(&[(7, 0.9)], 0.0)), Some(-0.5));
    let heard = NameLine { heard_s: 0.0, ..named(&[(8, 0.9)], 1.0) };
    assert_eq!(read(&mut campus, &site, 12, heard), Some(-0.5), "it was heard again, and weighed nothing");
    let line = campus.picture(&site, 1_200_000, 1).names.remove(0);
    assert_eq!((line.heard_s, line.read_s), (0.0, Some(1.0)));
    let never = NameLine { read_s: None, label: "b0b00000".into(), ..named(&[], 0.0) };
    read(&mut campus, &site, 13, never);
    let line = campus.picture(&site, 1_300_000, 1).names.remove(0);
    assert_eq!((line.label.as_str(), line.read_s, line.tracks), ("b0b00000", None, vec![]));
}

#[test]
fn a_name_has_the_zones_in_which_its_likeliest_person_is() {
    let (mut campus, site) = both();
    read(&mut campus, &site, 2, named(&[(7, 0.9)], 0.0));
    let line = campus.picture(&site, 200_000, 1).names.remove(0);
    // Both halls have the same ground.
    assert_eq!(line.zones, ["east/hall", "west/hall"]);
    read(&mut campus, &site, 12, named(&[], 0.0));
    let line = campus.picture(&site, 1_200_000, 1).names.remove(0);
    assert_eq!(line.zones, [""; 0], "nobody has the name");
}
