//! `kehai-sim demo` from outside: it starts, shows people's map at a local address, finds its modules, and leaves nothing
//! behind when it ends.
#![cfg(all(unix, feature = "daemon"))]

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// An empty folder.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("demo-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// A demo in a world of its own: all that it leaves behind is in `folder`.
fn demo(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-sim"));
    command.arg("demo").args(arguments).env("TMPDIR", folder).current_dir(folder).stdout(Stdio::piped());
    command
}

fn left_behind(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect()
}

/// Ended with the test, however that ends.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn headless_it_sums_up_and_leaves_only_what_was_asked_for() {
    let folder = folder("headless");
    let asked = ["--headless", "--seconds", "4", "--db", "kept.db"];
    let output = demo(&folder, &asked).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{text}");
    assert!(text.contains("transactions") && text.contains("kept.db"), "{text}");
    // The lock stays beside the database: it tells a damaged one from another program's file.
    let mut left = left_behind(&folder);
    left.sort();
    assert_eq!(left, ["kept.db", "kept.db-lock"]);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn it_shows_a_map_says_how_modules_were_found_and_ends_with_ctrl_c() {
    let folder = folder("map");
    let asked = ["--http", "127.0.0.1:0", "--http-name", "map.example.org"];
    let mut running = Running(demo(&folder, &asked).spawn().unwrap());
    let mut lines = BufReader::new(running.0.stdout.take().unwrap()).lines().map_while(Result::ok);
    let address = lines
        .by_ref()
        .find_map(|line| Some(line.split_once("http://")?.1.split('/').next()?.to_owned()))
        .expect("it says where its map is");
    let page = ureq::get(format!("http://{address}/")).call().unwrap();
    assert_eq!(page.status(), 200);
    let page = ureq::get(format!("http://{address}/")).header("Host", "map.example.org").call().unwrap();
    assert_eq!(page.status(), 200, "by the name that its owner gave it");
    assert!(ureq::get(format!("http://{address}/")).header("Host", "evil.lan").call().is_err());
    let found = lines.by_ref().find(|line| line.contains("DNS-SD") || line.contains("no multicast"));
    println!("{}", found.expect("it says how modules were found"));
    let interrupt = format!("kill -INT {}", running.0.id());
    assert!(Command::new("sh").args(["-c", &interrupt]).status().unwrap().success());
    let rest: Vec<String> = lines.collect();
    assert!(running.0.wait().unwrap().success(), "{rest:#?}");
    assert!(rest.iter().any(|line| line.contains("transactions")), "{rest:#?}");
    assert_eq!(left_behind(&folder), [""; 0]);
    std::fs::remove_dir(folder).unwrap();
}

/// The figure of a line of the summary.
fn figure(text: &str, line: &str) -> Option<f64> {
    let rest = text.lines().find_map(|found| found.trim().strip_prefix(line))?;
    rest.split_whitespace().next()?.parse().ok()
}

#[test]
fn at_the_entrance_every_source_is_there_and_tags_name_people() {
    let folder = folder("entrance");
    let asked = ["--scene", "entrance", "--headless", "--seconds", "45"];
    let output = demo(&folder, &asked).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    println!("{text}");
    assert!(output.status.success(), "{text}");
    for device in ["left", "right", "camera", "mat"] {
        let line = text.lines().find(|line| line.trim().starts_with(device)).unwrap_or_default();
        assert!(line.ends_with("watching"), "{device}: {text}");
    }
    assert!(figure(&text, "tags read").is_some_and(|times| times > 20.0), "{text}");
    assert!(text.contains("times, 0 refused"), "{text}");
    assert!(figure(&text, "named right").is_some_and(|percent| percent > 50.0), "{text}");
    assert!(figure(&text, "found where they are").is_some_and(|percent| percent > 50.0), "{text}");
    assert_eq!(left_behind(&folder), [""; 0]);
    std::fs::remove_dir(folder).unwrap();
}

#[test]
fn a_guarded_door_lets_in_who_was_told_of() {
    let folder = folder("guarded");
    let output = demo(&folder, &["--scene", "guarded", "--headless", "--seconds", "32"]).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    println!("{text}");
    assert!(output.status.success(), "{text}");
    let words = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
    let passed = "front 2 entered, 1 tries, 2 through: all went through";
    assert!(text.lines().any(|line| words(line) == passed), "{text}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_scene_that_does_not_exist_is_one_line_that_names_those_that_do() {
    let folder = folder("nowhere");
    let output = demo(&folder, &["--scene", "attic"]).stderr(Stdio::piped()).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && said.trim().lines().count() == 1, "{said}");
    assert!(
        said.contains("there is no scene \"attic\"") && said.contains("entrance, demo, building"),
        "{said}"
    );
    assert_eq!(left_behind(&folder), [""; 0]);
    std::fs::remove_dir(folder).unwrap();
}
