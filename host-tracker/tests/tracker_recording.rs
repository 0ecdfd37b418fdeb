//! A run that was recorded is followed again bit for bit, also from what is left of a file that was cut off.
#![allow(missing_docs, reason = "a test program")]

use std::path::{Path, PathBuf};
use std::sync::Arc;

use host_sim::run::{Conditions, Options, Record};
use host_sim::world::scene::Scene;
use host_sim::world::variation::{Letter, Variation};
use host_tracker::record::Recorder;
use host_tracker::record::replay::{Outcome, replay};
use kehai_tracking::site_tracker::SiteTracker;
use kehai_tracking::tracker::Selected;

/// A file that is gone with its test.
struct Temporary(PathBuf);

impl Temporary {
    fn new(name: &str) -> Self {
        Self(std::env::temp_dir().join(format!("kehai-recording-{}-{name}.mcap", std::process::id())))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // It may never have been made.
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Follows a run with `site_tracker`, and records it as one of `written`; how many datagrams and lines there were.
fn record(file: &Path, site_tracker: Selected, written: Selected) -> (u64, u64) {
    let mut scene = Scene::load("door-area").unwrap();
    let (people, condition) = (Some(3), Some(Letter::H));
    scene.vary(&Variation { people, condition, ..Variation::default() }).unwrap();
    let options = Options { conditions: Conditions::DISTURBED, ..Options::default() };
    let run = Record::of(&scene, 7, &options).unwrap();
    let recorder = Recorder::create(file, 1_700_000_000_123_456_789, written, &run.site, None).unwrap();
    let mut site_tracker = SiteTracker::new(&Arc::new(run.site.clone()), site_tracker);
    let (mut lines, mut datagrams) = (0, 0);
    for arrival in &run.arrivals {
        while (lines + 1) * 100_000 <= arrival.at_us {
            lines += 1;
            let at_us = lines * 100_000;
            recorder.line(at_us, &site_tracker.line(at_us as f64 * 1e-6));
        }
        datagrams += 1;
        recorder.datagram(arrival.at_us, &arrival.bytes);
        site_tracker.receive(&arrival.bytes, arrival.at_us);
        // Faster than life: the queue is given time.
        if datagrams % 4000 == 0 {
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
    }
    assert_eq!((recorder.lost(), recorder.trouble()), (0, String::new()));
    (datagrams, lines)
}

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
    assert_eq!(outcome.cut_off, "");

    // What is left of a file whose writer died.
    let bytes = std::fs::read(&file.0).unwrap();
    let cut = Temporary::new("cut");
    std::fs::write(&cut.0, &bytes[..bytes.len() * 2 / 3]).unwrap();
    let part = followed_again(&cut.0);
    assert!(part.lines > 0 && part.lines < lines && part.different == 0, "{part:?}");
    assert_ne!(part.cut_off, "");
}

#[test]
fn a_run_of_the_experimental_tracker_is_followed_again_bit_for_bit() {
    let (file, rendering) = (Temporary::new("rendering"), "rendering".parse().unwrap());
    let (_, lines) = record(&file.0, rendering, rendering);
    let outcome = followed_again(&file.0);
    assert_eq!((outcome.lines, outcome.different), (lines, 0));
}

#[test]
fn another_tracker_is_noticed() {
    let file = Temporary::new("other");
    record(&file.0, "kehai-without-division".parse().unwrap(), Selected::default());
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
