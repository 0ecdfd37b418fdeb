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

/// A short scene with modules of these names, in a folder of its own.
fn room(test: &str, modules: [&str; 2]) -> (PathBuf, String) {
    let folder = folder(test);
    std::fs::create_dir_all(&folder).unwrap();
    let module = |name, y| format!("[[site.module]]\nname = \"{name}\"\nx = 0\ny = {y}\nyaw_deg = 90\n");
    let text = format!(
        "duration_s = 1\n{}{}[[site.wall]]\npoints = [[-2, 3], [2, 3]]\n",
        module(modules[0], 0),
        module(modules[1], 1)
    );
    let file = folder.join("scene.toml");
    std::fs::write(&file, text).unwrap();
    (folder, file.to_str().unwrap().to_owned())
}

#[test]
fn each_module_has_a_recording_of_its_name() {
    let (folder, file) = room("names", ["hall.1", "hall.2"]);
    let scans = folder.join("scans");
    // The same again replaces the same.
    for _ in 0..2 {
        let output = scene(&[&file, "--scans", scans.to_str().unwrap()]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let mut files: Vec<_> =
        std::fs::read_dir(&scans).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    files.sort();
    assert_eq!(files, ["hall.1.csv", "hall.2.csv", "site.toml"]);
    std::fs::remove_dir_all(&folder).unwrap();
    let (folder, file) = room("slash", ["left", "../right"]);
    let output = scene(&[&file, "--scans", folder.join("scans").to_str().unwrap()]);
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && text.contains("module \"../right\": no file can have"), "{text}");
    assert!(!folder.join("right.csv").exists());
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_site_of_another_scene_is_not_written_over() {
    let (folder, file) = room("site", ["left", "right"]);
    let site = folder.join("site.toml");
    std::fs::write(&site, "# drawn by hand\n").unwrap();
    let output = scene(&[&file, "--scans", folder.to_str().unwrap()]);
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && text.contains("site.toml: is another site"), "{text}");
    assert_eq!(std::fs::read_to_string(&site).unwrap(), "# drawn by hand\n");
    assert!(!folder.join("left.csv").exists(), "nothing is written");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[cfg(unix)]
#[test]
fn a_recording_whose_end_does_not_fit_is_an_error() {
    let (folder, file) = room("full", ["left", "right"]);
    let scans = folder.join("scans");
    let arguments = ["scene", &file, "--scans", scans.to_str().unwrap()];
    assert!(scene(&arguments[1..]).status.success());
    let size = std::fs::metadata(scans.join("left.csv")).unwrap().len();
    // Blocks of 512 bytes; who asks for more gets an error, without a signal.
    let limited = format!("trap '' XFSZ; ulimit -f {}; exec \"$@\"", (size - 1) / 512);
    let output = Command::new("sh")
        .args(["-c", &limited, "sh", env!("CARGO_BIN_EXE_kehai-sim")])
        .args(arguments)
        .output()
        .unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && text.contains(".csv: "), "{text}");
    std::fs::remove_dir_all(&folder).unwrap();
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
