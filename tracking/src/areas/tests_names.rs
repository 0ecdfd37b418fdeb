//! Whose name goes over the border: what an area said when it read the card, and where that person has gone since.
//!
//! ```text
//!   west  reads a11c of 7 ●─────●┄┄┄ no track     what west says of its other tracks by then is no news
//!   east                     ●─────────▶          the name goes on with the person
//! ```

use super::Campus;
use super::tests::{area, both, frame, track};
use crate::jsonl::TrackLine;
use crate::names::{Likelihood, NameLine};
use crate::tracker::LifeCycle;

#[test]
fn a_name_goes_over_the_border_with_its_person() {
    let (mut campus, site) = both();
    let named = |tracks: Vec<Likelihood>, heard_s| NameLine {
        card: None,
        label: "a11c".into(),
        heard_s,
        tracks,
        zones: Vec::new(),
    };
    let say = |campus: &mut Campus, name: &str, number, tracks, names| {
        let mut said = frame(number, tracks);
        said.frame.names = names;
        campus.hear(&area(name), said, number * 100_000);
        let picture = campus.picture(&site, number * 100_000, 1);
        picture.names.first().map(|line| line.tracks.clone()).unwrap_or_default()
    };
    let seven = vec![Likelihood { track: 7, probability: 0.9 }];
    let read = say(&mut campus, "west", 2, vec![track(7, -0.5, 0.0)], vec![named(seven.clone(), 0.0)]);
    assert_eq!(read, [Likelihood { track: 2, probability: 0.9 }]);
    say(&mut campus, "east", 3, vec![track(70, -0.45, 0.05)], Vec::new());
    // West has lost it; east has never read the card.
    let kept = say(&mut campus, "west", 4, Vec::new(), vec![named(Vec::new(), 0.2)]);
    assert_eq!(kept, [Likelihood { track: 2, probability: 0.9 }]);
    say(&mut campus, "east", 5, Vec::new(), Vec::new());
    let gone = say(&mut campus, "west", 6, Vec::new(), vec![named(Vec::new(), 0.4)]);
    assert_eq!(gone, [], "no track is there");
}

#[test]
fn an_area_does_not_guess_the_name_of_a_person_whom_another_sees() {
    let (mut campus, site) = both();
    let name = |track| NameLine {
        card: None,
        label: "a11c".into(),
        heard_s: 0.0,
        tracks: vec![Likelihood { track, probability: 0.9 }],
        zones: Vec::new(),
    };
    let say = |campus: &mut Campus, number: u64, gone: bool, mut named: NameLine| {
        let state = if gone { LifeCycle::Occluded } else { LifeCycle::Confirmed };
        let mut said = frame(number, vec![TrackLine { state, ..track(7, 0.0, 0.0) }, track(8, -5.0, 0.0)]);
        named.heard_s = 0.1 * (number - 2) as f64;
        said.frame.names = vec![named];
        campus.hear(&area("west"), said, number * 100_000);
        campus.hear(&area("east"), frame(number, vec![track(70, 0.1, 0.0)]), number * 100_000);
        let picture = campus.picture(&site, number * 100_000, 1);
        let person = picture.names.first().and_then(|line| line.tracks.first()).map(|likely| likely.track);
        picture.line.tracks.iter().find(|track| Some(track.id) == person).map(|track| track.x)
    };
    assert!(say(&mut campus, 2, false, name(7)).is_some_and(|x| x > -1.0));
    assert!(say(&mut campus, 3, true, name(8)).is_some_and(|x| x > -1.0), "west guesses");
    // It is read again, in the west.
    let anew = NameLine { heard_s: 0.0, ..name(8) };
    let mut said = frame(20, vec![track(8, -5.0, 0.0)]);
    said.frame.names = vec![anew];
    campus.hear(&area("west"), said, 2_000_000);
    let picture = campus.picture(&site, 2_000_000, 1);
    let person = picture.names[0].tracks[0].track;
    assert!(picture.line.tracks.iter().any(|track| track.id == person && track.x < -4.0));
}

#[test]
fn what_is_left_when_the_named_track_is_no_person_is_no_name() {
    let (mut campus, site) = both();
    let say = |campus: &mut Campus, number: u64, west: Vec<TrackLine>, shares: &[(u64, f64)]| {
        let mut said = frame(number, west);
        let tracks = shares.iter().map(|&(track, probability)| Likelihood { track, probability }).collect();
        let heard_s = 0.1 * (number - 2) as f64;
        said.frame.names =
            vec![NameLine { card: None, label: "a11c".into(), heard_s, tracks, zones: Vec::new() }];
        campus.hear(&area("west"), said, number * 100_000);
        campus.hear(&area("east"), frame(number, vec![track(70, 0.1, 0.0)]), number * 100_000);
        let picture = campus.picture(&site, number * 100_000, 1);
        let person = picture.names.first().and_then(|line| line.tracks.first()).map(|likely| likely.track);
        picture.line.tracks.iter().find(|track| Some(track.id) == person).map(|track| track.x)
    };
    let named = say(&mut campus, 2, vec![track(7, 0.0, 0.0), track(8, -5.0, 0.0)], &[(7, 0.7), (8, 0.1)]);
    assert!(named.is_some_and(|x| x > -1.0));
    // West has another track for them, and the one it had named is over.
    for number in 3..40 {
        let named = say(&mut campus, number, vec![track(9, 0.0, 0.0), track(8, -5.0, 0.0)], &[(8, 0.1)]);
        assert!(named.is_some_and(|x| x > -1.0), "{number}: {named:?}");
    }
}
