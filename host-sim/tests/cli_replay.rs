//! `kehai-sim replay` and `demo` from outside: what they print, and what they say to bad input.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn kehai_sim(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_kehai-sim")).args(arguments).output().unwrap()
}

fn file(name: &str, text: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, text).unwrap();
    path
}

/// A person of 0.4 m before a wall at 3 m, walking aside, after 40 scans of the empty room.
/// `name` tells the files of tests that run at the same time apart.
fn walk(name: &str) -> PathBuf {
    use std::fmt::Write;
    let mut text = String::from(
        "# source=made for a test\n# amin_step=44 front_step=384 ares=1024 beams=682 dmin=20 dmax=5600 period_ms=100\n",
    );
    for scan in 0..60_u32 {
        let _ = write!(text, "{}", scan * 99_700);
        for beam in 0..682_u32 {
            let on_person = scan >= 40 && (200 + scan..260 + scan).contains(&beam);
            let _ = write!(text, ",{}", if on_person { 1200 } else { 3000 + (beam * 7 + scan * 3) % 5 });
        }
        text.push('\n');
    }
    file(&format!("{name}.csv"), &text)
}

fn refused(arguments: &[&str], status: i32, words: &[&str]) {
    let output = kehai_sim(arguments);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {said}");
    for word in words {
        assert!(said.contains(word), "{arguments:?}: {word:?} is missing in {said:?}");
    }
    if status == 1 {
        assert_eq!(said.lines().count(), 1, "one line: {said}");
    }
}

#[test]
fn a_recording_becomes_lines_of_json_the_same_every_time() {
    let path = walk("walk");
    let path = path.to_str().unwrap();
    let output = kehai_sim(&["replay", path, "--learn", "30", "--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let again = kehai_sim(&["replay", path, "--learn", "30", "--json"]);
    assert!(output.stdout == again.stdout, "two runs differ");
    let lines: Vec<serde_json::Value> = output
        .stdout
        .split(|&byte| byte == b'\n')
        .filter(|line| !line.is_empty())
        .map(|line| serde_json::from_slice(line).unwrap())
        .collect();
    assert_eq!(lines.len(), 60);
    assert_eq!(lines[59]["t"], 5.8823);
    assert_eq!(lines[59]["module"], "walk");
    assert_eq!(lines[35]["candidates"].as_array().unwrap().len(), 0);
    let candidate = &lines[50]["candidates"][0];
    assert_eq!((&candidate["first_step"], &candidate["last_step"]), (&(44 + 250).into(), &(44 + 309).into()));
    assert_eq!(candidate["narrow"], false);
    assert_eq!(candidate["first_end"], "free");
    assert!((1.2..1.5).contains(&candidate["x"].as_f64().unwrap()), "{candidate}");
}

#[test]
fn the_figures_and_the_picture_are_for_people() {
    let path = walk("walk-drawn");
    let picture = Path::new(env!("CARGO_TARGET_TMPDIR")).join("walk.svg");
    let output =
        kehai_sim(&["replay", path.to_str().unwrap(), "--learn", "30", "--svg", picture.to_str().unwrap()]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("60 of 60 scans decoded, 30 judged"), "{text}");
    assert!(text.contains("wide in 20 scans, any in 20"), "{text}");
    assert!(std::fs::read_to_string(picture).unwrap().contains("<svg"));
}

#[test]
fn bad_input_gets_one_line_that_names_what_and_where() {
    let head = "# amin_step=44 front_step=384 ares=1024 beams=3 dmin=20 dmax=5600 period_ms=100\n";
    let bad = |name: &str, text: &str| file(name, text).to_str().unwrap().to_owned();
    refused(&["replay", "/nowhere/x.csv"], 1, &["/nowhere/x.csv", "No such file"]);
    refused(
        &["replay", &bad("letters.csv", &format!("{head}0,1,two,3\n"))],
        1,
        &["letters.csv:2", "field 3", "two"],
    );
    refused(&["replay", &bad("short.csv", &format!("{head}0,1,2\n"))], 1, &["short.csv:2", "2 values", "3"]);
    refused(&["replay", &bad("turn.csv", &head.replace("1024", "7"))], 1, &["turn.csv:1", "impossible"]);
    refused(&["replay", &bad("empty.csv", head)], 1, &["empty.csv", "no scan"]);
    let path = walk("walk-refused");
    let path = path.to_str().unwrap();
    refused(&["replay", path, "--learn", "3"], 2, &["--learn", "at least 30"]);
    refused(&["replay", path, "--learn", "many"], 2, &["--learn", "or all"]);
    refused(&["replay", path, "--svg", "/nowhere/x.svg"], 1, &["/nowhere/x.svg", "cannot be written"]);
    refused(&["demo", "--headless", "--seconds", "-3"], 2, &["--seconds"]);
    refused(&["demo", "--headless", "--scene", "no-such-scene"], 1, &["no-such-scene"]);
    refused(&["nonsense"], 2, &["nonsense"]);
}

#[test]
fn a_scene_gives_recordings_to_try_it_with() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scans");
    let (out, file) = (folder.to_str().unwrap(), |name: &str| folder.join(name).to_str().unwrap().to_owned());
    let made = kehai_sim(&["scene", "crossing", "--seconds", "20", "--scans", out]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    // The commands of the README.
    let csv = file("wall.csv");
    let detected = kehai_sim(&["replay", &csv, "--learn", "60", "--svg", &file("wall.svg")]);
    assert!(detected.status.success(), "{}", String::from_utf8_lossy(&detected.stderr));
    let site = file("site.toml");
    let wall = format!("wall={csv}");
    let followed = kehai_sim(&["replay", "--site", &site, &wall, "--learn", "60", "--out", out]);
    assert!(followed.status.success(), "{}", String::from_utf8_lossy(&followed.stderr));
    let tracks = std::fs::read_to_string(file("tracks.jsonl")).unwrap();
    let people = |line: &str| {
        let line: serde_json::Value = serde_json::from_str(line).unwrap();
        line["tracks"].as_array().unwrap().len()
    };
    let most = tracks.lines().map(people).max();
    assert!(most >= Some(2), "two people cross: {most:?}");
}
