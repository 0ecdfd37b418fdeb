//! What is damaged, full or gone: recordings, the disk under the lines, the reader of the log.
//!
//! ```text
//!   recording ─ a bit flipped, bytes overwritten, cut, repeated ─▶ replay ─▶ an outcome or one line, never a panic
//!   kehai-tracker run ─ stderr without a reader, lines on /dev/full ─▶ goes on
//! ```
#![cfg(target_os = "linux")]

mod described;
mod hall;

use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;

use hall::Tracker;
use host_tracker::record::Recorder;
use host_tracker::record::replay::replay;
use kehai_tracking::site::Site;
use kehai_tracking::site_tracker::SiteTracker;
use kehai_tracking::tracker::Selected;
use proptest::prelude::*;
use proptest::sample::Index;
use proptest::test_runner::{Config, RngSeed};

const SITE: &str = "[[zone]]\nname = \"hall\"\npolygon = [[0, 0], [1, 0], [1, 1]]\n";

/// A recording of twenty lines and as many datagrams.
fn recording(file: &Path) {
    let site: Site = toml::from_str(SITE).unwrap();
    let mut site_tracker = SiteTracker::new(&Arc::new(site.clone()), Selected::default());
    let recorder = Recorder::create(file, 1, Selected::default(), &site, None).unwrap();
    for tenth in 1..=20_u64 {
        recorder.datagram(tenth * 100_000, &[tenth as u8; 60]);
        recorder.line(tenth * 100_000, &site_tracker.line(tenth as f64 * 0.1));
    }
    drop(recorder);
}

/// A way to damage a file.
#[derive(Clone, Debug)]
enum Damage {
    Flip(Index, u8),
    Overwrite(Index, Vec<u8>),
    Cut(Index),
    Twice(Index, Index),
}

fn damage() -> impl Strategy<Value = Damage> {
    prop_oneof![
        (any::<Index>(), 0..8_u8).prop_map(|(at, bit)| Damage::Flip(at, bit)),
        (any::<Index>(), prop::collection::vec(any::<u8>(), 1..16))
            .prop_map(|(at, bytes)| Damage::Overwrite(at, bytes)),
        any::<Index>().prop_map(Damage::Cut),
        (any::<Index>(), any::<Index>()).prop_map(|(from, to)| Damage::Twice(from, to)),
    ]
}

fn damaged(whole: &[u8], damage: &[Damage]) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    for damage in damage {
        if bytes.is_empty() {
            break;
        }
        match damage {
            Damage::Flip(at, bit) => {
                let at = at.index(bytes.len());
                bytes[at] ^= 1 << bit;
            }
            Damage::Overwrite(at, with) => {
                let at = at.index(bytes.len());
                bytes.iter_mut().skip(at).zip(with).for_each(|(byte, with)| *byte = *with);
            }
            Damage::Cut(at) => bytes.truncate(at.index(bytes.len())),
            Damage::Twice(from, to) => {
                let (from, to) = (from.index(bytes.len()), to.index(bytes.len()));
                let part = bytes[from.min(to)..from.max(to)].to_vec();
                bytes.splice(from.max(to)..from.max(to), part);
            }
        }
    }
    bytes
}

proptest! {
    // The same 200 files each time: those of which 94 ended the program before.
    #![proptest_config(Config { cases: 200, rng_seed: RngSeed::Fixed(0), failure_persistence: None, ..Config::default() })]

    #[test]
    fn f12_a_damaged_recording_never_ends_the_program(damage in prop::collection::vec(damage(), 1..4)) {
        let folder = tempfile::tempdir().unwrap();
        let (file, broken) = (folder.path().join("whole.mcap"), folder.path().join("broken.mcap"));
        recording(&file);
        let whole = std::fs::read(&file).unwrap();
        std::fs::write(&broken, damaged(&whole, &damage)).unwrap();
        match replay(&broken, |_, _| Ok(())) {
            Ok(outcome) => prop_assert!(outcome.lines <= 40),
            Err(error) => prop_assert!(error.to_string().contains("broken.mcap")),
        }
    }
}

#[test]
fn f12_a_length_that_is_flipped_in_any_bit_allocates_nothing_beyond_the_limit() {
    let folder = tempfile::tempdir().unwrap();
    let (file, broken) = (folder.path().join("whole.mcap"), folder.path().join("broken.mcap"));
    recording(&file);
    let whole = std::fs::read(&file).unwrap();
    // The first record's length is behind the magic, of 8 bytes, and its kind.
    for bit in 0..64 {
        let mut bytes = whole.clone();
        bytes[9 + bit / 8] ^= 1 << (bit % 8);
        std::fs::write(&broken, bytes).unwrap();
        assert!(replay(&broken, |_, _| Ok(())).is_err(), "bit {bit}");
    }
}

fn command(folder: &Path, seconds: &str) -> Command {
    let site = folder.join("home.toml");
    std::fs::write(&site, SITE).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(["run", "--no-mdns", "--module", "127.0.0.1:9", "--seconds", seconds, "--site"]).arg(site);
    command
}

#[test]
fn f12_a_log_without_a_reader_does_not_end_the_tracker() {
    let folder = tempfile::tempdir().unwrap();
    let lines = folder.path().join("lines.jsonl");
    let mut command = command(folder.path(), "4");
    let mut process = command.arg("--tracks-out").arg(&lines).stderr(Stdio::piped()).spawn().unwrap();
    drop(process.stderr.take());
    // Status 1 is the end that was asked for: "no module answered". A panic is 101.
    assert_eq!(process.wait().unwrap().code(), Some(1));
    // The alarm of a silent module is logged after 3 s.
    let last = std::fs::read_to_string(&lines).unwrap();
    let last: serde_json::Value = serde_json::from_str(last.lines().last().unwrap()).unwrap();
    assert!(last["t"].as_f64().unwrap() > 3.5, "{last}");
}

#[test]
fn f12_lines_on_a_full_disk_are_an_alarm_and_not_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = command(folder.path(), "2");
    command.args(["--http", "0", "--tracks-out", "/dev/full"]);
    let tracker = Tracker::start(command);
    tracker.says("the tracker: tracks-out: /dev/full: ");
    // The end that was asked for.
    tracker.says("no module answered");
}
