//! `kehai-tracker doctor`: what it says of a tracker that runs, of one that does not, and of nothing at all.
#![cfg(target_os = "linux")]

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead as _, BufReader};
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use serde_json::Value;

const SITE: &str = "[[zone]]\nname = \"hall\"\npolygon = [[0, 0], [1, 0], [1, 1]]\n";

/// A tracker that ends with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }
}

/// A site with its tracker.
struct Home {
    site: PathBuf,
    options: Vec<String>,
    folder: tempfile::TempDir,
}

impl Home {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (site, database) = (folder.path().join("home.toml"), folder.path().join("home.db"));
        fs::write(&site, SITE).unwrap();
        let options = ["--no-mdns", "--module", "127.0.0.1:9", "--db", database.to_str().unwrap()];
        Self { site, options: options.map(str::to_owned).into(), folder }
    }

    /// Starts a tracker here, and keeps where its map is.
    fn start(&mut self) -> Running {
        self.start_with(&[])
    }

    /// With more options than those with which it is looked at.
    fn start_with(&mut self, more: &[&str]) -> Running {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
        command.args(["run", "--http", "0", "--site"]).arg(&self.site).args(&self.options).args(more);
        let mut process = command.stderr(Stdio::piped()).spawn().unwrap();
        let mut said = BufReader::new(process.stderr.take().unwrap()).lines().map_while(Result::ok);
        let place = |line: String| {
            let (_, url) = line.split_once("live map at ")?;
            url.split_once("://").map(|(_, place)| place.to_owned())
        };
        let address = said.find_map(place).expect("it says where its map is");
        self.options.push(format!("--http={}", address.trim().trim_end_matches('/')));
        // Reads and drops the rest, so that a full pipe does not hold the tracker up.
        std::thread::spawn(move || said.count());
        Running(process)
    }

    /// Exit status, and how each part is: the worst, and all that is said of it.
    fn looked_at(&self, more: &[&str]) -> (Option<i32>, BTreeMap<String, (String, String)>) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
        command.args(["doctor", "--json"]).args(more).arg(&self.site).arg("--").args(&self.options);
        let output = command.output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        let mut parts = BTreeMap::new();
        for line in text.lines() {
            let finding: Value = serde_json::from_str(line).unwrap();
            let word = |key: &str| finding[key].as_str().unwrap_or_default().to_owned();
            assert!(word("verdict") == "ok" || !word("advice").is_empty(), "{line}");
            let (verdict, said) = parts.entry(word("about")).or_insert(("ok".to_owned(), String::new()));
            said.push_str(&format!("{}: {}\n", word("text"), word("advice")));
            if word("verdict") != "ok" && verdict != "wrong" {
                *verdict = word("verdict");
            }
        }
        (output.status.code(), parts)
    }

    fn files(&self) -> Vec<PathBuf> {
        let mut files: Vec<PathBuf> =
            fs::read_dir(self.folder.path()).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.sort();
        files
    }
}

#[track_caller]
fn is(parts: &BTreeMap<String, (String, String)>, about: &str, verdict: &str, words: &str) {
    let (found, said) = &parts[about];
    assert!(found == verdict && said.contains(words), "{about}: {found}: {said}");
}

fn tracker(arguments: &[&str], site: &Path) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"))
        .args(arguments)
        .arg("--site")
        .arg(site)
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn a_tracker_that_runs_is_looked_at_and_what_becomes_wrong_is_said() {
    let mut home = Home::new();
    let running = home.start();
    let (status, parts) = home.looked_at(&[]);
    assert_eq!(status, Some(0), "{parts:?}");
    is(&parts, "tracker", "ok", "a tracker goes on");
    is(&parts, "version", "ok", env!("CARGO_PKG_VERSION"));
    is(&parts, "database", "ok", "a tracker writes it");
    is(&parts, "users", "warning", "everybody on this machine");
    is(&parts, "site", "warning", "no module");
    assert!(!parts.contains_key("service"), "it is no service: {parts:?}");

    // Once a user is known, the tracker tells its version only to clients that may look.
    tracker(&["user", "add", "anna", "--role", "admin"], &home.site);
    let said = tracker(&["token", "add", "doctor", "--role", "view"], &home.site);
    let token = said.split_whitespace().find(|word| word.starts_with("kehai_")).unwrap().to_owned();
    std::thread::sleep(std::time::Duration::from_secs(2));
    let (status, parts) = home.looked_at(&[]);
    assert_eq!(status, Some(0), "{parts:?}");
    is(&parts, "version", "unknown", "--token");
    let (_, parts) = home.looked_at(&["--token", &token]);
    is(&parts, "version", "ok", env!("CARGO_PKG_VERSION"));
    is(&parts, "users", "ok", "home.access");

    // A module that the site has and that is not found; a file of users that others may read.
    fs::write(&home.site, format!("{SITE}[[module]]\nname = \"left\"\nx = 0\ny = 0\n")).unwrap();
    let access = home.site.with_extension("access");
    fs::set_permissions(&access, fs::Permissions::from_mode(0o644)).unwrap();
    let (status, parts) = home.looked_at(&["--token", &token]);
    assert_eq!(status, Some(1), "{parts:?}");
    is(&parts, "users", "wrong", "chmod 600");
    is(&parts, "module", "unknown", "left");
    drop(running);

    let before = home.files();
    let (status, parts) = home.looked_at(&[]);
    assert_eq!(status, Some(1), "{parts:?}");
    is(&parts, "tracker", "wrong", "no tracker answers");
    assert_eq!(home.files(), before, "a look leaves nothing");
}

#[test]
fn a_tracker_says_that_a_module_of_its_site_does_not_answer() {
    let mut home = Home::new();
    fs::write(&home.site, format!("{SITE}[[module]]\nname = \"left\"\nx = 0\ny = 0\n")).unwrap();
    let _running = home.start();
    let (status, parts) = home.looked_at(&[]);
    assert_eq!(status, Some(1), "{parts:?}");
    is(&parts, "module", "wrong", "left does not answer");
}

#[test]
fn of_a_tracker_over_tls_that_is_asked_in_clear_the_options_are_missed() {
    let mut home = Home::new();
    let _running = home.start_with(&["--tls"]);
    let (_, parts) = home.looked_at(&[]);
    is(&parts, "version", "unknown", "it is served over TLS: name its options");
}

#[test]
fn where_nothing_is_nothing_panics_and_a_line_says_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("none").join("home.toml");
    let output = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"))
        .args(["doctor", missing.to_str().unwrap(), "--", "--db", "/none/home.db", "--no-mdns"])
        .args(["--module", "127.0.0.1:9", "--mqtt", "mqtt://127.0.0.1:9"])
        .output()
        .unwrap();
    let (said, failed) =
        (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert_eq!(output.status.code(), Some(1), "{said}{failed}");
    assert_eq!(failed, "kehai-tracker: 3 things are wrong\n", "{said}");
    for (verdict, about, words) in [
        ("wrong", "site", "there is no such file"),
        ("wrong", "database", "its folder is missing"),
        ("wrong", "broker", "127.0.0.1:9 lets no client in"),
        ("unknown", "tracker", "without --http"),
        ("unknown", "disk", "df -h"),
    ] {
        let of = |line: &&str| line.starts_with(&format!("{verdict:<8} {about:<12} "));
        let line = said.lines().find(of).unwrap_or_else(|| panic!("{verdict} {about}: {said}"));
        assert!(line.contains(words), "{line}");
    }
}

#[test]
fn a_database_that_is_none_and_a_site_with_a_mistake_are_wrong_where_they_are() {
    let home = Home::new();
    fs::write(&home.site, "# home\n[[zone]]\nname = 3\n").unwrap();
    fs::write(home.site.with_extension("db"), "a letter").unwrap();
    let (status, parts) = home.looked_at(&[]);
    assert_eq!(status, Some(1));
    is(&parts, "site", "wrong", "home.toml:3: ");
    is(&parts, "database", "wrong", "home.db");
    fs::remove_file(home.site.with_extension("db")).unwrap();
    let other = rusqlite::Connection::open(home.site.with_extension("db")).unwrap();
    other.execute_batch("CREATE TABLE run (distance_km REAL); PRAGMA user_version = 3").unwrap();
    let (_, parts) = home.looked_at(&[]);
    is(&parts, "database", "wrong", "it is a database of another program");
}
