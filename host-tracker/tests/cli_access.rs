//! `kehai-tracker user`, `token` and `run`: how a user gets in, and that none does before.
#![cfg(target_os = "linux")]

mod described;
mod hall;
mod http_client;

use std::io::Write;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use hall::Tracker;
use serde_json::json;

/// A hundred times what a loaded machine needs.
const PATIENCE: Duration = Duration::from_secs(60);

const SITE: &str = "
[[zone]]
name = \"area\"
polygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
secure = true

[[door]]
name = \"front\"
zone = \"area\"
line = [[-0.45, 1.0], [0.45, 1.0]]
fail = \"secure\"
";

struct Place {
    site: PathBuf,
    folder: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let site = folder.path().join("home.toml");
        std::fs::write(&site, SITE).unwrap();
        Self { site, folder }
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
        command.args(arguments).arg("--site").arg(&self.site);
        command
    }

    /// Whether it went well, and what it said on stdout or stderr.
    fn does(&self, arguments: &[&str]) -> (bool, String) {
        said(self.command(arguments).output().unwrap())
    }

    fn run(&self, arguments: &[&str]) -> Command {
        let mut command = self.command(&["run", "--no-mdns", "--module", "127.0.0.1:9"]);
        command.args(arguments);
        command
    }

    fn password(&self, name: &str, role: &str) -> String {
        let (done, said) = self.does(&["user", "add", name, "--role", role]);
        assert!(done, "{said}");
        said.split(" is ").nth(1).unwrap().split(':').next().unwrap().to_owned()
    }
}

fn said(output: Output) -> (bool, String) {
    let text = [output.stdout, output.stderr].concat();
    (output.status.success(), String::from_utf8(text).unwrap())
}

fn map_of(tracker: &Tracker) -> SocketAddr {
    let said = tracker.says("live map at http://");
    let port = said.trim_end_matches('/').rsplit(':').next().unwrap().to_owned();
    SocketAddr::from(([127, 0, 0, 1], port.parse().unwrap()))
}

fn log_in(map: SocketAddr, name: &str, password: &str) -> u16 {
    let body = json!({ "name": name, "password": password }).to_string();
    let json = [("Content-Type", "application/json")];
    http_client::ask(map, "POST /api/session", &json, body.as_bytes()).0
}

#[test]
fn others_than_this_machine_are_not_served_before_a_user_may_log_in() {
    let place = Place::new();
    for reached in [&["--http", "0.0.0.0:0"][..], &["--http", "0", "--door-http", "0.0.0.0:0"]] {
        // One that starts ends, too.
        let (done, said) = said(place.run(reached).args(["--seconds", "1"]).output().unwrap());
        assert!(!done && said.lines().count() == 1, "{said}");
        let command = format!("kehai-tracker user add NAME --role admin --site {}", place.site.display());
        assert!(said.contains("0.0.0.0:0 is for the whole network") && said.contains(&command), "{said}");
    }
    let mut insecure = place.run(&["--http", "0.0.0.0:0", "--insecure"]);
    insecure.args(["--seconds", "1"]);
    let (_, said) = said(insecure.output().unwrap());
    assert!(
        said.contains("WARN --insecure: everybody") && said.contains("live map at http://0.0.0.0:"),
        "{said}"
    );
    let password = place.password("anna", "admin");
    let tracker = Tracker::start(place.run(&["--http", "0.0.0.0:0", "--insecure"]));
    let map = map_of(&tracker);
    assert_eq!(http_client::ask(map, "GET /api/state", &[], b"").0, 401);
    assert_eq!(log_in(map, "anna", &password), 200);
}

#[test]
fn the_first_user_may_be_added_before_the_map_has_made_the_site() {
    let mut place = Place::new();
    std::fs::remove_file(&place.site).unwrap();
    let (done, said) = place.does(&["user", "list"]);
    assert!(!done && said.contains("there is no such site"), "{said}");
    let (done, said) = place.does(&["user", "add", "anna", "--role", "admin"]);
    assert!(done && said.contains("home.toml yet: the live map makes it"), "{said}");
    assert_eq!(place.does(&["user", "list"]), (true, "anna\tadmin\n".to_owned()));
    let tracker = Tracker::start(place.run(&["--http", "0.0.0.0:0"]));
    tracker.says("live map at https://0.0.0.0:");
    place.site = place.folder.path().join("nowhere").join("home.toml");
    let (done, said) = place.does(&["user", "add", "anna", "--role", "admin"]);
    assert!(!done && said.contains("there is no such site"), "in a folder that is not there: {said}");
}

#[test]
fn who_is_added_to_a_running_tracker_shuts_its_map_and_may_log_in() {
    let place = Place::new();
    let tracker = Tracker::start(place.run(&["--http", "0"]));
    let map = map_of(&tracker);
    assert_eq!(http_client::ask(map, "GET /api/state", &[], b"").0, 200, "as ever");
    let password = place.password("anna", "view");
    let begun = Instant::now();
    while http_client::ask(map, "GET /api/state", &[], b"").0 != 401 {
        assert!(begun.elapsed() < PATIENCE);
        std::thread::sleep(Duration::from_millis(50));
    }
    assert_eq!(log_in(map, "anna", &password), 200);
    let mut change = place.command(&["user", "password", "anna", "--stdin"]);
    let mut child = change.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(b"correct horse battery\n").unwrap();
    let (done, changed) = said(child.wait_with_output().unwrap());
    assert!(done && !changed.contains("horse"), "{changed}");
    let begun = Instant::now();
    while log_in(map, "anna", "correct horse battery") != 200 {
        assert!(begun.elapsed() < PATIENCE);
        std::thread::sleep(Duration::from_millis(500));
    }
    assert_eq!(log_in(map, "anna", &password), 401, "the one before");
    tracker.says("a wrong password for anna, from 127.0.0.1");
}

#[test]
fn the_first_admin_is_said_once() {
    let place = Place::new();
    let arguments = ["--http", "0", "--first-admin"];
    let tracker = Tracker::start(place.run(&arguments));
    let map = map_of(&tracker);
    let password = tracker.says("the first user is admin, with the password ");
    let password = password.split(':').next().unwrap();
    assert_eq!(log_in(map, "admin", password), 200);
    drop(tracker);
    let tracker = Tracker::start(place.run(&arguments));
    let map = map_of(&tracker);
    assert_eq!(log_in(map, "admin", password), 200, "it is the same");
    assert!(!tracker.said().iter().any(|line| line.contains("password")), "{:?}", tracker.said());
}

#[test]
fn the_first_admin_is_said_though_only_errors_are_logged() {
    let place = Place::new();
    let tracker = Tracker::start(place.run(&["--http", "0", "--first-admin", "--log", "error"]));
    tracker.says("the first user is admin, with the password ");
}

#[test]
fn tokens_come_are_listed_and_go() {
    let place = Place::new();
    let (done, token) =
        place.does(&["token", "add", "front", "--role", "lock", "--role", "alarm", "--door", "front"]);
    assert!(done && token.starts_with("kehai_") && token.trim().len() == 38, "{token}");
    let kept = std::fs::read_to_string(place.site.with_extension("access")).unwrap();
    assert!(!kept.contains(token.trim()), "{kept}");
    assert_eq!(place.does(&["token", "list"]), (true, "front\tlock,alarm\tfront\n".into()));
    let tracker = Tracker::start(place.run(&["--http", "0"]));
    let shown = format!("Bearer {}", token.trim());
    let headers = [("Authorization", shown.as_str())];
    let ready = br#"{"nonce": 7}"#;
    let (status, order) =
        http_client::ask(map_of(&tracker), "POST /api/door/front/lock/ready", &headers, ready);
    assert_eq!(status, 200, "{order}");
    http_client::ask(map_of(&tracker), "POST /api/door/front/exit", &[], b"");
    tracker.says("WARN door front: exit without a token, from 127.0.0.1");
    assert!(place.does(&["token", "remove", "front"]).0);
    assert_eq!(place.does(&["token", "list"]), (true, String::new()));
}

#[test]
fn what_cannot_be_is_one_line() {
    let place = Place::new();
    place.password("anna", "admin");
    for (arguments, part) in [
        (&["user", "add", "anna", "--role", "view"][..], "user anna is there already"),
        (&["user", "add", "bert", "--role", "lock"], "\"lock\" is a role of devices"),
        (&["user", "remove", "anna"], "anna is the last admin"),
        (&["user", "remove", "carl"], "there is no user carl"),
        (&["user", "password", "carl"], "there is no user carl"),
        (&["token", "remove", "carl"], "there is no token carl"),
        (&["user", "add", "a\nb", "--role", "view"], "is no name"),
    ] {
        let (done, said) = place.does(arguments);
        assert!(!done && said.lines().count() == 1 && said.contains(part), "{arguments:?}: {said}");
    }
    let (done, said) = place.does(&["user", "add", "bert", "--role", "root"]);
    assert!(!done && said.contains("view, edit, operator, admin"), "{said}");
    let nowhere = Place { site: Path::new("/nowhere/home.toml").into(), ..place };
    let (done, said) = nowhere.does(&["user", "list"]);
    assert!(!done && said.contains("/nowhere/home.toml: there is no such site"), "{said}");
    drop(nowhere.folder);
}
