//! `kehai-sim scene` as a process.
#![allow(missing_docs, reason = "a test program")]

use std::path::PathBuf;
use std::process::{Command, Output};

fn scene(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_kehai-sim")).arg("scene").args(arguments).output().unwrap()
}

fn folder(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("kehai-scene-{name}-{}", std::process::id()))
}

#[test]
fn a_scene_writes_its_lines_and_a_picture_the_same_every_time() {
    let run = |name: &str| {
        let folder = folder(name);
        let arguments =
            ["passage", "--seconds", "12", "--seed", "4", "--out", folder.to_str().unwrap(), "--json"];
        let output = scene(&arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let read = |file: &str| std::fs::read_to_string(folder.join(file)).unwrap();
        let files = ["candidates.jsonl", "tracks.jsonl", "truth.jsonl", "scene.svg"].map(read);
        std::fs::remove_dir_all(&folder).unwrap();
        (output.stdout, files)
    };
    let (stdout, files) = run("one");
    assert_eq!((&stdout, &files), (&run("two").0, &run("three").1));
    let summary: serde_json::Value = serde_json::from_slice(&stdout).unwrap();
    assert_eq!((&summary["modules"], &summary["duration_s"]), (&2.into(), &12.0.into()));
    let [candidates, tracks, truth, picture] = files;
    assert!(candidates.lines().count() > 200);
    assert_eq!((tracks.lines().count(), truth.lines().count()), (121, 121));
    assert!(truth.starts_with("{\"t\":0.0,\"people\":[]}\n") && picture.contains("</svg>"));
}

#[test]
fn what_cannot_be_is_refused_in_one_line() {
    let cases: [(&[&str], &str); 5] = [
        (&["nowhere.toml"], "nowhere.toml: cannot be read"),
        (&["door-area", "--people", "0"], "door-area: people must be 1 to 16, is 0"),
        (&["crossing", "--people", "2"], "crossing: the scene has no gathering"),
        (&["door-area", "--sensors", "9"], "no sensors \"9\" in this scene; there are: 1, 1-door"),
        (&["passage", "--seconds", "1", "--out", "/dev/null/x"], "/dev/null/x: "),
    ];
    for (arguments, expected) in cases {
        let output = scene(arguments);
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success() && text.lines().count() == 1, "{text}");
        assert!(text.contains(expected), "{text}");
    }
}
