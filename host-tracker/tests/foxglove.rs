//! What Foxglove and Lichtblick show, in a recording and live: as their schemas say, and without any effect on what is replayed.
//!
//! ```text
//!   recording ─┬─ tests/foxglove.py, Foxglove's own schemas and classes ─▶ every message is one of theirs
//!              └─ without the derived channels, or with misleading ones ─▶ replay: the same
//!   kehai-tracker run --foxglove ─ WebSocket ─▶ a viewer of our own ─▶ a recording of what it was shown ─▶ tests/foxglove.py
//! ```
#![allow(missing_docs, reason = "a test program")]

mod described;
mod hall;
mod recorded;
mod viewer;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use hall::{Hall, Tracker};
use host_tracker::record::replay::{Outcome, replay};
use kehai_tracking::tracker::Selected;
use recorded::{Temporary, record};
use serde_json::Value;
use viewer::{Shown, Viewer};

fn followed_again(file: &Path) -> (Outcome, Vec<String>) {
    let mut lines = Vec::new();
    let outcome = replay(file, |_, line| {
        lines.push(serde_json::to_string(line)?);
        Ok(())
    });
    (outcome.unwrap(), lines)
}

/// Writes a recording anew: what `metadata` gives none for is left out, else it has that; then `more` is called with each message.
fn rewritten(
    from: &Path,
    to: &Path,
    mut each: impl FnMut(&mut mcap::Writer<std::fs::File>, &mcap::Message<'_>),
) {
    let bytes = std::fs::read(from).unwrap();
    let options = mcap::WriteOptions::new().compression(None);
    let mut writer = options.create(std::fs::File::create(to).unwrap()).unwrap();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        each(&mut writer, &message.unwrap());
    }
    writer.finish().unwrap();
}

#[test]
fn what_is_only_shown_changes_nothing_that_is_followed_again() {
    let (file, without, misleading) =
        (Temporary::new("shown"), Temporary::new("without"), Temporary::new("misleading"));
    record(&file.0, Selected::default(), Selected::default());
    let mut derived = 0;
    rewritten(&file.0, &without.0, |writer, message| {
        if message.channel.metadata.contains_key("derived") {
            derived += 1;
        } else {
            writer.write(message).unwrap();
        }
    });
    assert!(derived > 300, "{derived}");
    // Whatever a derived channel is called, it is not what came in.
    rewritten(&file.0, &misleading.0, |writer, message| {
        writer.write(message).unwrap();
        if message.channel.topic == "/datagrams" || message.channel.topic == "/lines" {
            let metadata = BTreeMap::from([("derived".to_owned(), "true".to_owned())]);
            let channel =
                mcap::Channel { metadata, id: message.channel.id + 100, ..(*message.channel).clone() };
            writer.write(&mcap::Message { channel: channel.into(), ..message.clone() }).unwrap();
        }
    });
    let whole = followed_again(&file.0);
    assert_eq!((whole.0.different, whole.0.recorded == whole.0.replayed), (0, true));
    assert!(whole.0.lines > 100, "{:?}", whole.0);
    assert_eq!(followed_again(&without.0), whole);
    assert_eq!(followed_again(&misleading.0), whole);
}

/// Python with what reads recordings, and the file of Foxglove's schemas: `./ci.sh test` gets both.
fn judge() -> Option<(Command, PathBuf)> {
    let name = std::env::var("KEHAI_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let imports = "import mcap, mcap_protobuf, jsonschema, foxglove_schemas_protobuf";
    let has_it = Command::new(&name).args(["-c", imports]).output();
    if !has_it.is_ok_and(|output| output.status.success()) {
        test_support::fail_in_ci_else_skip(
            "no python3 with mcap, mcap-protobuf-support, jsonschema, foxglove-schemas-protobuf",
        );
        return None;
    }
    let Some(schemas) = std::env::var_os("KEHAI_FOXGLOVE_SCHEMAS") else {
        test_support::fail_in_ci_else_skip(
            "KEHAI_FOXGLOVE_SCHEMAS does not name the output of tests/foxglove.ts",
        );
        return None;
    };
    Some((Command::new(name), schemas.into()))
}

#[test]
fn every_message_is_as_foxglove_and_its_own_schema_say() {
    let Some((mut python, schemas)) = judge() else { return };
    let file = Temporary::new("judged");
    let (_, lines) = record(&file.0, Selected::default(), Selected::default());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/foxglove.py");
    let output = python.arg(script).arg(&file.0).arg(schemas).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said: Value = serde_json::from_slice(&output.stdout).unwrap();
    println!("{said}");
    // The site was told twice, an alarm began and ended.
    let topic = |name: &str| said["topics"][name].as_u64().unwrap_or(0);
    assert_eq!([topic("/tf"), topic("/map"), topic("/log"), topic("/people")], [2, 2, 2, lines]);
    let scans = said["topics"].as_object().unwrap().iter().filter(|(name, _)| name.starts_with("/scan/"));
    let scans: Vec<u64> = scans.map(|(_, count)| count.as_u64().unwrap()).collect();
    // One a second, of each module.
    assert_eq!(scans.len(), 2, "{said}");
    assert!(scans.iter().all(|count| (lines / 20..=lines / 10 + 1).contains(count)), "{said}, {lines} lines");
    assert!(
        said["beams"]["unknown"].as_u64().unwrap() > 0 && said["beams"]["known"].as_u64().unwrap() > 10_000
    );
}

/// Who is where in a message of /people: the number, x, y.
fn places(shown: &Shown) -> Vec<(String, f64, f64)> {
    let update: Value = serde_json::from_slice(&shown.bytes).unwrap();
    let place = |entity: &Value| {
        let at = &entity["cylinders"][0]["pose"]["position"];
        (entity["id"].as_str().unwrap().to_owned(), at["x"].as_f64().unwrap(), at["y"].as_f64().unwrap())
    };
    update["entities"].as_array().unwrap().iter().map(place).collect()
}

#[cfg(feature = "foxglove")]
#[test]
fn a_viewer_is_shown_everything_live_and_scans_only_if_it_wants_them() {
    let Some((mut python, schemas)) = judge() else { return };
    let hall = Hall::new(4);
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(hall.arguments(&hall.database)).args(["--foxglove", "0"]);
    let tracker = Tracker::start(command);
    let address = tracker.says("Foxglove and Lichtblick are served at ws://");
    let always = ["/tf", "/map", "/people", "/log"];
    let scans = ["/scan/south", "/scan/east", "/scan/north"];
    let mut viewer = Viewer::open(&address, &[&always[..], &scans].concat());
    always.iter().for_each(|topic| viewer.subscribe(topic));
    let mut all: Vec<Shown> = Vec::new();
    let four = |all: &[Shown]| {
        all.iter().filter(|shown| shown.topic == "/people" && places(shown).len() == 4).count()
    };
    while four(&all) < 30 {
        all.push(viewer.shown());
    }
    assert!(!all.iter().any(|shown| shown.topic.starts_with("/scan")), "no scan was wanted");
    // Those who come late are told where the modules are, too.
    for topic in ["/tf", "/map"] {
        assert!(all.iter().any(|shown| shown.topic == topic), "{topic}");
    }
    viewer.subscribe("/scan/east");
    while all.iter().filter(|shown| shown.topic == "/scan/east").count() < 20 {
        all.push(viewer.shown());
    }
    // Without modules alarms begin.
    drop(hall.building);
    while !all.iter().any(|shown| shown.topic == "/log") {
        all.push(viewer.shown());
    }

    let file = Temporary::new("live");
    viewer.keep(&all, &file.0);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/foxglove.py");
    let output = python.arg(script).arg(&file.0).arg(schemas).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said: Value = serde_json::from_slice(&output.stdout).unwrap();
    println!("{said}");
    assert!(said["beams"]["known"].as_u64().unwrap() > 5_000, "{said}");

    // What is shown is what the tracker says, to the last bit.
    let lines: Vec<Vec<(String, f64, f64)>> = tracker
        .kill()
        .iter()
        .map(|line| line.tracks.iter().map(|track| (track.id.to_string(), track.x, track.y)).collect())
        .collect();
    let people: Vec<_> = all.iter().filter(|shown| shown.topic == "/people").map(places).collect();
    let unknown = people.iter().filter(|shown| !lines.contains(shown)).count();
    assert_eq!(unknown, 0, "of {} updates are of no line", people.len());
}
