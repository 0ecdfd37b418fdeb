//! `kehai-sim score` from outside: its output, and its messages for bad input.

use std::path::Path;
use std::process::{Command, Output};

const TRUTH: &str = r#"{"t":0.0,"people":[{"id":1,"x":0.0,"y":0.0,"beams":20},{"id":2,"x":5.0,"y":0.0}]}
{"t":0.1,"people":[{"id":1,"x":0.1,"y":0.0,"beams":20},{"id":2,"x":5.0,"y":0.0}]}
"#;
const TRACKS: &str = r#"{"t":0.0,"tracks":[{"id":9,"x":0.0,"y":0.0,"state":"confirmed"}],"zones":{}}
{"t":0.1,"tracks":[{"id":9,"x":0.1,"y":0.1,"cov":[0.01,0,0.01],"state":"occluded"},{"id":10,"x":5,"y":0,"state":"tentative"}]}
"#;

fn score(name: &str, truth: &str, tracks: &str, arguments: &[&str]) -> Output {
    let file = |kind: &str, text: &str| {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{kind}.jsonl"));
        std::fs::write(&path, text).unwrap();
        path
    };
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-sim"));
    command.arg("score").arg(file("truth", truth)).arg(file("tracks", tracks)).args(arguments);
    command.output().unwrap()
}

fn json(arguments: &[&str]) -> serde_json::Value {
    let name = format!("json{}", arguments.concat());
    let output = score(&name, TRUTH, TRACKS, &[arguments, &["--json"]].concat());
    serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{output:?}"))
}

#[test]
fn the_table_is_for_people() {
    let output = score("table", TRUTH, TRACKS, &[]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("2 frames, 4 people and 2 tracks"), "{text}");
    assert!(text.contains("MOTA 50.0 %, MOTP 5.0 cm, 2 misses, 0 false, 0 switches, 2 lost"), "{text}");
    assert!(text.contains("visible 7.1 cm (2 pairs), hidden – (0 pairs)"), "{text}");
}

#[test]
fn options_say_who_is_judged() {
    assert_eq!(json(&[])["people"], 4);
    assert_eq!(json(&["--region", "-1,-1,1,1"])["people"], 2);
    assert_eq!(json(&["--region", "-1,-1,1,1"])["exact_count_rate"], 1.0);
    assert_eq!(json(&["--area", "4,-1,6,1"])["exact_count_rate"], 0.0);
    assert_eq!(json(&["--tentative"])["tracks"], 3);
    assert_eq!(json(&["--gate", "0.05"])["misses"], 3);
}

#[test]
fn bad_input_gets_one_line_that_names_what_and_where() {
    let refused = |name: &str, truth: &str, tracks: &str, arguments: &[&str], status: i32, words: &[&str]| {
        let output = score(name, truth, tracks, arguments);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(status), "{name}: {said}");
        assert!(words.iter().all(|word| said.contains(word)), "{name}: {words:?} in {said:?}");
        assert!(status == 2 || said.lines().count() == 1, "one line: {said}");
    };
    let twice = TRUTH.replace("0.1,\"people\"", "0.0,\"people\"");
    refused("twice", &twice, TRACKS, &[], 1, &["twice-truth.jsonl:2", "does not come after"]);
    refused("lost", TRUTH, &TRACKS.replace("tentative", "lost"), &[], 1, &["lost-tracks.jsonl:2", "`lost`"]);
    refused("empty", TRUTH, "", &[], 1, &["empty-tracks.jsonl", "within 0.05 s"]);
    refused("corner", TRUTH, TRACKS, &["--region", "1,2,3"], 2, &["--region", "two opposite corners"]);
    refused("gate", TRUTH, TRACKS, &["--gate", "-1"], 2, &["gate"]);
    let output =
        Command::new(env!("CARGO_BIN_EXE_kehai-sim")).args(["score", "/nowhere/a", "/nowhere/b"]).output();
    let said = String::from_utf8(output.unwrap().stderr).unwrap();
    assert!(said.contains("/nowhere/a") && said.lines().count() == 1, "{said}");
}

#[test]
fn a_scene_and_a_score_where_it_says_it_judged_are_one_figure() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scene-and-score");
    let sim = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_kehai-sim")).args(arguments).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let out = folder.to_str().unwrap();
    let scene = ["scene", "door-area", "--people", "2", "--condition", "H", "--seconds", "40", "--out", out];
    let said = sim(&scene);
    let region = said.split("--region ").nth(1).unwrap().split_whitespace().next().unwrap();
    let file = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let (truth, tracks) = (file("truth.jsonl"), file("tracks.jsonl"));
    let there = sim(&["score", &truth, &tracks, "--region", region]);
    let figures = |text: &str| -> Vec<String> {
        text.lines()
            .filter(|line| line.contains("HOTA") || line.contains("MOTA"))
            .map(str::to_owned)
            .collect()
    };
    assert_eq!(figures(&said).len(), 2, "{said}");
    assert_eq!(figures(&there), figures(&said));
    assert!(there.contains(&format!("judged in {region}")), "{there}");
    assert!(sim(&["score", &truth, &tracks]).contains("judged everywhere; --region"));
}
