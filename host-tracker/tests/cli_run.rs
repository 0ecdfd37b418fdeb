//! `kehai-tracker run`: what it refuses, in words that name the place, and which clients may see its map.
#![cfg(target_os = "linux")]

mod described;
mod hall;

use std::io::{BufRead as _, BufReader, Read, Write};
use std::net::{TcpStream, UdpSocket};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;

use hall::{Hall, Tracker};
use host_tracker::store::{Keep, Store};

const SITE: &str = "[[zone]]\nname = \"hall\"\npolygon = [[0, 0], [1, 0], [1, 1]]\n";

fn command(site: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(["run", "--no-mdns", "--module", "127.0.0.1:9", "--site"]).arg(site);
    command
}

#[test]
fn a_wrong_site_file_is_one_line_with_its_place_and_nothing_is_begun() {
    let folder = tempfile::tempdir().unwrap();
    let (site, database) = (folder.path().join("home.toml"), folder.path().join("home.db"));
    for (text, place) in [
        ("[[zone]\nname = 3\n", "home.toml:1: "),
        ("# home\n[[zone]]\nname = 3\n", "home.toml:3: "),
        ("[[module]]\nname = \"left\"\nx = 0\ny = \"far\"\n", "home.toml:4: "),
        ("[[module]]\nname = \"left\"\nx = 0\n", "missing field `y`"),
        ("[[zone]]\nname = \"a\"\npolygon = [[0, 0], [1, 1]]\n", "zone \"a\": polygon needs at least three"),
        ("[[zone]]\nname = \"a\"\npolygon = [[0, 0], [nan, 0], [1, 1]]\n", "zone \"a\": NaN is no place"),
        ("[[wall]]\npoints = [[0, 0]]\n", "wall 1: points needs at least two"),
        ("[[entry]]\nname = \"street\"\nline = [[0, 0], [1, 0]]\nzone = \"attic\"\n", "no zone \"attic\""),
        ("[[window]]\nx = 1\n", "unknown field `window`"),
        ("\u{0}", "home.toml:1: "),
    ] {
        std::fs::write(&site, text).unwrap();
        let output = command(&site).arg("--db").arg(&database).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), said.lines().count()), (Some(1), 1), "{text}: {said}");
        assert!(said.starts_with("kehai-tracker: ") && said.contains("home.toml"), "{text}: {said}");
        assert!(said.contains(place), "{text}: {said}");
        assert_eq!(std::fs::read_to_string(&site).unwrap(), text);
        assert!(!database.exists());
    }
    std::fs::write(&site, [0xff, 0xfe, 0x00]).unwrap();
    let output = command(&site).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(1) && said.contains("home.toml"), "{said}");
}

/// A command line, and what it says on stderr if it fails.
fn fails(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_kehai-tracker")).args(arguments).output().unwrap();
    assert!(!output.status.success(), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn a_file_that_is_something_else_is_one_line_that_says_what_makes_the_right_one() {
    let folder = tempfile::tempdir().unwrap();
    let other = folder.path().join("walk.csv");
    std::fs::write(&other, "time,x,y\n0,1,2\n".repeat(20)).unwrap();
    let said = fails(&["replay", other.to_str().unwrap()]);
    assert!(said.contains("walk.csv: it is no recording: kehai-tracker run --record"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    let none = folder.path().join("home.db");
    let said = fails(&["export", none.to_str().unwrap(), "--out", folder.path().to_str().unwrap()]);
    assert!(said.contains("home.db: No such file") && said.contains("--db FILE makes one"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
}

#[test]
fn a_report_is_by_the_time_zone_and_of_a_database_of_a_tracker_alone() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let report = |name: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
        command.arg("report").arg(file(name)).args(["--day", "2025-03-14", "--json"]);
        let output = command.env("TZ", "Asia/Tokyo").output().unwrap();
        String::from_utf8([output.stdout, output.stderr].concat()).unwrap()
    };
    drop(Store::open(&file("home.db"), &Arc::default(), Keep::USUAL).unwrap());
    let bins: serde_json::Value = serde_json::from_str(&report("home.db")).unwrap();
    // 2025-03-13 15:00 UTC is midnight in Tokyo.
    assert_eq!(bins["bins"][0]["from_ms"], 1_741_878_000_000_u64);
    std::fs::write(file("empty.db"), "").unwrap();
    std::fs::write(file("letter.db"), "Dear Anna, this is a letter and no database. ".repeat(30)).unwrap();
    let other = rusqlite::Connection::open(file("other.db")).unwrap();
    other.execute_batch("CREATE TABLE run (distance_km REAL)").unwrap();
    let before = std::fs::read(file("other.db")).unwrap();
    for (name, why) in [
        ("nope.db", "No such file"),
        ("empty.db", "it is empty"),
        ("letter.db", "file is not a database: choose another file"),
        ("other.db", "it is a database of another program"),
    ] {
        let said = report(name);
        assert!(said.contains(&format!("{name}: {why}")) && said.lines().count() == 1, "{said}");
        assert!(!file("nope.db").exists());
    }
    let (site, archive) = (file("home.toml"), file("home.tar.gz"));
    std::fs::write(&site, SITE).unwrap();
    for name in ["nope.db", "other.db"] {
        let place = ["backup".as_ref(), archive.as_os_str(), "--site".as_ref(), site.as_os_str()];
        let mut backup = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
        let done = backup.args(place).arg("--db").arg(file(name)).output().unwrap();
        let said = String::from_utf8(done.stderr).unwrap();
        assert!(!done.status.success() && said.contains(name) && said.lines().count() == 1, "{said}");
        assert!(!archive.exists());
    }
    let output = command(&site).arg("--db").arg(file("other.db")).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && said.contains("other.db: it is a database of another"), "{said}");
    assert!(std::fs::read(file("other.db")).unwrap() == before && !file("other.db-lock").exists());
}

#[test]
fn a_reader_that_has_had_enough_ends_a_calibration_without_a_word() {
    let folder = tempfile::tempdir().unwrap();
    let site = folder.path().join("home.toml");
    std::fs::write(&site, "[[module]]\nname = \"left\"\nx = 0\ny = 0\n").unwrap();
    let mut calibrate = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"))
        .args(["calibrate", "--json", "--no-mdns", "--module", "127.0.0.1:9", "--site"])
        .arg(&site)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut first = String::new();
    BufReader::new(calibrate.stdout.take().unwrap()).read_line(&mut first).unwrap();
    assert!(first.starts_with('{'), "{first}");
    let output = calibrate.wait_with_output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && !said.contains("panicked"), "{:?}: {said}", output.status);
}

#[test]
fn the_map_is_for_this_machine_alone_unless_an_address_is_given() {
    let folder = tempfile::tempdir().unwrap();
    let site = folder.path().join("home.toml");
    std::fs::write(&site, SITE).unwrap();
    let start = |http: &str| {
        let mut command = command(&site);
        command.args(["--http", http, "--insecure"]);
        let tracker = Tracker::start(command);
        let map = tracker.says("live map at http://");
        let (ip, port) = map.trim_end_matches('/').rsplit_once(':').unwrap();
        (tracker, ip.to_owned(), port.parse::<u16>().unwrap())
    };
    let (_alone, ip, port) = start("0");
    assert_eq!(ip, "127.0.0.1");
    assert!(TcpStream::connect(("127.0.0.1", port)).is_ok());
    assert!(TcpStream::connect(("127.0.0.2", port)).is_err(), "another address of this machine");
    let own = own_address();
    assert!(own.as_ref().is_none_or(|own| TcpStream::connect((own.as_str(), port)).is_err()), "{own:?}");
    let (_open, ip, port) = start("0.0.0.0:0");
    assert_eq!(ip, "0.0.0.0");
    assert!(TcpStream::connect(("127.0.0.2", port)).is_ok());
    let output = command(&site).args(["--http", "here"]).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && said.contains("PORT for this machine alone"), "{said}");
    let help = Command::new(env!("CARGO_BIN_EXE_kehai-tracker")).args(["run", "--help"]).output().unwrap();
    assert!(String::from_utf8(help.stdout).unwrap().contains("[default: 127.0.0.1:8420]"));
}

/// The first line of the answer to a request for this host.
fn asked(address: &str, host: &str, path: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer.lines().next().unwrap_or_default().to_owned()
}

#[test]
fn f11_doors_have_a_listener_of_their_own_and_names_are_this_machines() {
    let folder = tempfile::tempdir().unwrap();
    let site = folder.path().join("home.toml");
    std::fs::write(&site, SITE).unwrap();
    let mut command = command(&site);
    command.args(["--http", "0", "--door-http", "0", "--http-name", "map.lan"]);
    let tracker = Tracker::start(command);
    let map = tracker.says("live map at http://").trim_end_matches('/').to_owned();
    let doors = tracker.says("messages to doors at http://").trim_end_matches("/api/door").to_owned();
    assert_ne!(map, doors);
    for (address, host, path, expected) in [
        (&map, "evil.lan", "/api/state", "403 Forbidden"),
        (&map, "MAP.lan:80", "/api/state", "200 OK"),
        (&map, "localhost", "/api/state", "200 OK"),
        (&doors, "evil.lan", "/api/door", "403 Forbidden"),
        (&doors, "map.lan", "/api/door", "200 OK"),
        (&doors, "map.lan", "/api/state", "404 Not Found"),
    ] {
        let answer = asked(address, host, path);
        assert_eq!(answer, format!("HTTP/1.1 {expected}"), "{host}{path}");
    }
}

#[test]
fn a_log_level_that_is_none_is_refused_and_off_logs_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let site = folder.path().join("home.toml");
    std::fs::write(&site, SITE).unwrap();
    let output = command(&site).args(["--log", "loud"]).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && said.contains("\"warn\""), "{said}");
    let said = |level: &str| {
        let mut command = command(&site);
        let output = command.args(["--http", "0", "--log", level, "--seconds", "1"]).output().unwrap();
        String::from_utf8(output.stderr).unwrap()
    };
    assert!(said("info").contains("INFO live map at http://"));
    let quiet = said("off");
    assert!(quiet.lines().all(|line| line.starts_with("kehai-tracker: ")), "{quiet}");
}

/// The address under which others know this machine, if it has one; nothing is sent to find out.
fn own_address() -> Option<String> {
    let socket = UdpSocket::bind("0.0.0.0:0").ok()?;
    socket.connect("192.0.2.1:9").ok()?;
    let ip = socket.local_addr().ok()?.ip();
    (!ip.is_loopback() && !ip.is_unspecified()).then(|| ip.to_string())
}

#[test]
fn the_tracker_with_rules_follows_people_over_the_loopback() {
    let hall = Hall::new(31);
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(hall.arguments(&hall.database)).args(["--tracker", "kehai-rules"]);
    let tracker = Tracker::start(command);
    tracker.until_a_person();
    drop(tracker);

    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(hall.arguments(&hall.database)).args(["--tracker", "rules"]);
    let output = command.output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && said.contains("choose kehai or kehai-rules"), "{said}");
}

#[test]
fn an_option_that_needs_another_one_is_named_with_it() {
    let needs = |arguments: &[&str]| fails(&[&["run", "--site", "no.toml"], arguments].concat());
    assert_eq!(needs(&["--no-mdns"]), "kehai-tracker: --no-mdns needs --module <HOST[:PORT]> beside it\n");
    assert_eq!(needs(&["--keep-days", "3"]), "kehai-tracker: --keep-days needs --db <FILE> beside it\n");
}

#[test]
fn a_signal_reads_the_site_anew_and_one_that_is_wrong_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let site = folder.path().join("home.toml");
    std::fs::write(&site, SITE).unwrap();
    let mut command = command(&site);
    command.args(["--http", "0", "--tracks-out", "-"]);
    let tracker = Tracker::start(command);
    tracker.says("live map at http://");
    let hang_up = || {
        let signal = format!("kill -HUP {}", tracker.process.id());
        assert!(Command::new("sh").args(["-c", &signal]).status().unwrap().success());
    };
    hang_up();
    tracker.says("home.toml: read anew, nothing has changed");
    std::fs::write(&site, SITE.replace("hall", "lobby")).unwrap();
    hang_up();
    tracker.says("home.toml: read anew");
    let begun = std::time::Instant::now();
    while !tracker.line().zones.contains_key("lobby") {
        assert!(begun.elapsed().as_secs() < 30, "the zone does not come");
    }
    std::fs::write(&site, "[[zone]\n").unwrap();
    hang_up();
    tracker.says("not used, the site stays as it was");
    assert!(tracker.line().zones.contains_key("lobby"));
    std::fs::remove_file(&site).unwrap();
    hang_up();
    tracker.says("home.toml: not used, the site stays as it was: No such file");
}
