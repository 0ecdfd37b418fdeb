//! A run that was recorded is followed again bit for bit, also from what is left of a file that was cut off.
#![allow(missing_docs, reason = "a test program")]

mod recorded;

use std::path::Path;

use host_tracker::record::replay::{Outcome, replay};
use kehai_tracking::tracker::Selected;
use recorded::{Temporary, record};

fn followed_again(file: &Path) -> Outcome {
    replay(file, |_, _| Ok(())).unwrap()
}

#[test]
fn a_recorded_run_is_followed_again_bit_for_bit() {
    let file = Temporary::new("whole");
    let (datagrams, lines) = record(&file.0, Selected::default(), Selected::default());
    let outcome = followed_again(&file.0);
    println!("{outcome:?}");
    assert_eq!((outcome.datagrams, outcome.lines, outcome.different), (datagrams, lines, 0));
    assert_eq!(outcome.recorded, outcome.replayed);
    assert_eq!(outcome.cut_off, None);

    // What is left of a file whose writer died.
    let bytes = std::fs::read(&file.0).unwrap();
    let cut = Temporary::new("cut");
    std::fs::write(&cut.0, &bytes[..bytes.len() * 2 / 3]).unwrap();
    let part = followed_again(&cut.0);
    assert!(part.lines > 0 && part.lines < lines && part.different == 0, "{part:?}");
    assert_ne!(part.cut_off, None);
}

#[test]
fn a_run_of_the_tracker_with_rules_is_followed_again_bit_for_bit() {
    let (file, rules) = (Temporary::new("rules"), "kehai-rules".parse().unwrap());
    let (_, lines) = record(&file.0, rules, rules);
    let outcome = followed_again(&file.0);
    assert_eq!((outcome.lines, outcome.different), (lines, 0));
}

#[test]
fn another_tracker_is_noticed() {
    let file = Temporary::new("other");
    record(&file.0, "kehai-rules".parse().unwrap(), Selected::default());
    let outcome = followed_again(&file.0);
    assert!(outcome.different > 0 && outcome.recorded != outcome.replayed);
}

#[test]
fn what_is_no_recording_is_refused_by_name() {
    let file = Temporary::new("letter");
    std::fs::write(&file.0, "a letter").unwrap();
    let error = replay(&file.0, |_, _| Ok(())).unwrap_err().to_string();
    assert!(error.contains("letter.mcap"), "{error}");
}
