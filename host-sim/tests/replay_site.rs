//! Several recordings together, through emulated sensors, modules and tracker: `kehai-sim replay --site`.
#![allow(missing_docs, reason = "a test program")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use host_sim::baselines::Choice;
use host_sim::replay::{Learn, identities};
use host_sim::run::TICK_US;
use host_sim::run::recorded::Recorded;
use host_sim::world::site::Site;
use kehai_emulator::recording::Recording;
use kehai_tracking::jsonl::TracksLine;

/// A person counts after having been seen for so long, s.
const SEEN_S: f64 = 1.0;

/// Clip, and number of people walking through it.
const CLIPS: [(&str, usize); 4] = [("tamu_ex1", 1), ("tamu_ex2", 3), ("tamu_ex4", 1), ("tamu_ex6", 2)];

fn recordings() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/recordings");
    if folder.is_dir() {
        return Some(folder);
    }
    test_support::fail_in_ci_else_skip(format!("no recordings at {}", folder.display()));
    None
}

fn site(text: &str) -> Site {
    toml::from_str(text).unwrap()
}

fn file(name: &str, text: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn people_who_walk_past_a_real_sensor_keep_their_identities() {
    let Some(folder) = recordings() else { return };
    let site = site("[[module]]\nname = \"here\"\nx = 0\ny = 0");
    for (clip, people) in CLIPS {
        let recording = Recording::open(&folder.join(clip).with_extension("csv")).unwrap();
        let scans = recording.scans.len();
        let recorded = Recorded::play(&site, &[("here".to_owned(), recording)], Learn::All, || ()).unwrap();
        assert_eq!(recorded.record.candidates_lines().len(), scans, "{clip}: not every scan came");
        let lines = recorded.record.tracks_lines(Choice::default());
        let mut identities = identities(&lines, TICK_US as f64 * 1e-6);
        println!("{clip}: {people} people; {identities:.1?}");
        identities.retain(|identity| identity.confirmed_s > SEEN_S - 0.05);
        println!("{clip}: {} identities seen for at least {SEEN_S} s, wanted {people}", identities.len());
        assert_eq!(identities.len(), people, "{clip}");
    }
}

/// A recording of a room 3 m deep, by a sensor at its middle: after 40 scans a person 0.4 m wide crosses it at 1.2 m.
/// Its scans are stamped `late_us` later than the other's.
fn walk(name: &str, late_us: u32) -> PathBuf {
    use std::fmt::Write;
    let mut text = String::from(
        "# source=made for a test\n# amin_step=44 front_step=384 ares=1024 beams=682 dmin=20 dmax=5600 period_ms=100\n",
    );
    for scan in 0..80_u32 {
        let _ = write!(text, "{}", scan * 99_700 + late_us);
        for beam in 0..682_u32 {
            let on_person = scan >= 40 && (100 + 6 * scan..160 + 6 * scan).contains(&beam);
            let _ = write!(text, ",{}", if on_person { 1200 } else { 3000 + (beam * 7 + scan * 3) % 5 });
        }
        text.push('\n');
    }
    file(&format!("{name}.csv"), &text)
}

fn replay(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_kehai-sim")).arg("replay").args(arguments).output().unwrap()
}

const TWO: &str = "[[module]]\nname = \"one\"\nx = 0\ny = 0\n[[module]]\nname = \"two\"\nx = 0\ny = 0\n";

#[test]
fn two_recordings_become_one_person_the_same_every_time() {
    let (one, two) = (walk("walk-one", 0), walk("walk-two", 40_000));
    let (one, two) = (format!("one={}", one.display()), format!("two={}", two.display()));
    let site = file("two.toml", TWO);
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("replay-two");
    let run = |learn: &str| {
        let (site, out) = (site.to_str().unwrap(), folder.to_str().unwrap());
        let output = replay(&["--site", site, &one, &two, "--learn", learn, "--out", out, "--json"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
        (String::from_utf8(output.stdout).unwrap(), read("tracks.jsonl"), read("candidates.jsonl"))
    };
    for learn in ["all", "30"] {
        let (stdout, tracks, candidates) = run(learn);
        assert_eq!((&stdout, &tracks, &candidates), (&run(learn).0, &run(learn).1, &run(learn).2));
        assert_eq!(stdout, tracks);
        let lines: Vec<TracksLine> = tracks.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        assert_eq!((lines[0].t, lines[60].t), (0.0, 6.0));
        let found = identities(&lines, 0.1);
        assert_eq!(found.len(), 1, "learned from {learn}: {found:?}");
        assert!(found[0].confirmed_s > 2.0 && found[0].first_s < 5.5, "{found:?}");
        // Scan by scan from both, each at its own time.
        let stamps = |name: &str| -> Vec<f64> {
            let own = candidates.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
            own.filter(|line| line["module"] == name).map(|line| line["t"].as_f64().unwrap()).collect()
        };
        let (one, two) = (stamps("one"), stamps("two"));
        assert!(one.len() > 40 && two.len() > 40, "{} and {}", one.len(), two.len());
        let (last_one, last_two) = (one.last().unwrap(), two.last().unwrap());
        // The accuracy of a module's estimate of its sensor's clock after eight seconds.
        assert!((last_one - 79.0 * 0.0997).abs() < 0.02, "{last_one}");
        assert!((last_two - last_one - 0.04).abs() < 0.002, "{last_two}");
        if learn == "all" {
            assert_eq!((one.len(), two.len()), (80, 80));
        }
    }
}

#[test]
fn bad_input_gets_one_line_that_says_what_to_do() {
    let walk = walk("walk-refused-site", 0);
    let (walk, site) = (walk.to_str().unwrap(), file("refused.toml", TWO));
    let site = site.to_str().unwrap();
    let named = |name: &str| format!("{name}={walk}");
    let cases: [(&[&str], &str); 6] = [
        (&["--site", site, walk], "with --site every recording is NAME=FILE.csv"),
        (&["--site", site, &named("three")], "the site has no module \"three\"; it has: one, two"),
        (&["--site", site, &named("one"), &named("one")], "\"one\" has a recording already"),
        (&["--site", site, "one=/nowhere.csv"], "/nowhere.csv: cannot be read"),
        (&["--site", "/nowhere.toml", &named("one")], "/nowhere.toml: "),
        (&[walk, walk], "several recordings need --site"),
    ];
    for (arguments, expected) in cases {
        let output = replay(arguments);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{text}");
        assert!(text.contains(expected) && text.lines().count() == 1, "{text}");
    }
}
