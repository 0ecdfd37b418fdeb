//! A run that was recorded is followed again bit for bit, also from what is left of a file that was cut off.
#![allow(missing_docs, reason = "a test program")]

mod recorded;

use std::io::ErrorKind;
use std::path::Path;
use std::process::Command;

use host_tracker::record::replay::{Outcome, ReplayError, replay};
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
fn a_replay_keeps_the_lines_of_an_earlier_one_and_refuses_any_other_file() {
    let (file, rules) = (Temporary::new("twice"), "kehai-rules".parse().unwrap());
    record(&file.0, rules, rules);
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("tracks.jsonl");
    let replayed = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
        command.arg("replay").arg(&file.0).arg("--tracks-out").arg(&out).output().unwrap()
    };
    std::fs::write(&out, "[[zone]]\n").unwrap();
    let said = String::from_utf8(replayed().stderr).unwrap();
    assert!(said.contains("tracks.jsonl: there is neither a recording"), "{said}");
    assert_eq!(std::fs::read_to_string(&out).unwrap(), "[[zone]]\n");
    std::fs::remove_file(&out).unwrap();
    for written in 1..=2 {
        assert!(replayed().status.success());
        let files = std::fs::read_dir(folder.path()).unwrap().map(|file| file.unwrap().path());
        let lines: Vec<String> = files.map(|file| std::fs::read_to_string(file).unwrap()).collect();
        assert_eq!(lines.len(), written);
        assert!(!lines[0].is_empty() && lines.iter().all(|other| *other == lines[0]));
    }
}

#[test]
fn an_error_of_the_output_is_not_said_of_the_recording() {
    let file = Temporary::new("output");
    record(&file.0, Selected::default(), Selected::default());
    let error = replay(&file.0, |_, _| Err(ErrorKind::BrokenPipe.into())).unwrap_err();
    assert!(matches!(&error, ReplayError::Output(error) if error.kind() == ErrorKind::BrokenPipe), "{error}");
}

#[test]
fn what_is_no_recording_is_refused_by_name() {
    let file = Temporary::new("letter");
    std::fs::write(&file.0, "a letter").unwrap();
    let error = replay(&file.0, |_, _| Ok(())).unwrap_err().to_string();
    assert!(error.contains("letter.mcap"), "{error}");
}
