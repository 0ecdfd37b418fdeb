//! `kehai-tracker` beside a module: the library's own tasks and an emulated sensor, over real sockets. The module is
//! found by DNS-SD where this machine allows it, and else by its address, with a message.
#![allow(missing_docs, reason = "a test program")]
#![cfg(unix)]

mod bench;

use std::io::{BufRead, BufReader, Read};
use std::net::UdpSocket;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::time::Instant;

use bench::{Bench, LABEL, PATIENCE};
use host_tracker::store::reader::Reader;
use kehai::wire::{Cookie, DATAGRAM_MAX, Identity, Incoming, Message, ModuleId, Refusal, Request};
use kehai_tracking::snapshot::unix_ms;
use serde_json::Value;

/// The module's name if it can be found by that, or else its address.
fn target(bench: &Bench) -> String {
    let found = kehai_tracker(&["module", "info", &bench.name]);
    if found.status.success() {
        return bench.name.clone();
    }
    eprintln!("no multicast here: the module is not found by its name, its address is used");
    bench.address.to_string()
}

fn kehai_tracker(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_kehai-tracker")).args(arguments).output().expect("it runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// What it prints; it must end well.
#[track_caller]
fn done(arguments: &[&str]) -> String {
    let output = kehai_tracker(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

/// Its exit status and its one line.
fn refused(arguments: &[&str]) -> (i32, String) {
    let output = kehai_tracker(arguments);
    let text = text(&output.stderr);
    assert!(output.status.code() == Some(2) || text.lines().count() == 1, "{text}");
    (output.status.code().unwrap_or(0), text.lines().next().unwrap_or_default().to_owned())
}

fn json(line: &str) -> Value {
    serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"))
}

#[test]
fn a_module_is_asked_set_taught_looked_at_and_restarted() {
    let bench = Bench::start("hall");
    let target = target(&bench);
    let target = target.as_str();
    // Its sensor is found within a second or two.
    let begin = Instant::now();
    let info = loop {
        let info = json(&done(&["module", "info", target, "--json"]));
        if !info["sensor"].is_null() {
            break info;
        }
        assert!(begin.elapsed() < PATIENCE, "{info}");
    };
    assert_eq!(info["name"], bench.name.as_str());
    assert_eq!(info["address"], bench.address.to_string());
    assert!(info["sensor"]["model"].as_str().unwrap().starts_with("URG-04LX"), "{info}");
    assert!(done(&["module", "info", target]).contains("URG-04LX"));
    let by_address = json(&done(&["module", "info", &bench.address.to_string(), "--json"]));
    assert_eq!(by_address["id"], info["id"]);

    if target == bench.name {
        let begin = Instant::now();
        let own = loop {
            let listed = done(&["module", "list", "--json"]);
            // One that a busy machine was too slow to ask is listed, too.
            let own = |module: &Value| module["id"] == info["id"] && module["answers"] == true;
            match listed.lines().map(json).find(own) {
                Some(own) => break own,
                None => assert!(begin.elapsed() < PATIENCE, "{listed}"),
            }
        };
        assert_eq!(own["name"], bench.name.as_str());
        let by_id = done(&["module", "info", info["id"].as_str().unwrap(), "--json"]);
        assert_eq!(json(&by_id)["name"], bench.name.as_str());
    }
    // All else by its address: that is the same, and quicker than to look for it each time.
    let target = bench.address.to_string();
    let target = target.as_str();

    assert_eq!(done(&["module", "get", target, "foreground_mm"]), "100\n");
    done(&["module", "set", target, "foreground_mm=200", "learn_scans=40"]);
    assert_eq!(done(&["module", "get", target, "foreground_mm"]), "200\n");
    assert_eq!(json(&done(&["module", "get", target, "--json"]))["learn_scans"], "40");
    let (status, line) = refused(&["module", "set", target, "learn_scans=50", "foreground_mm=9"]);
    assert_eq!(
        (status, line.as_str()),
        (
            1,
            "kehai-tracker: foreground_mm=9: the value is out of range: foreground_mm is 100 to 1000; nothing was changed"
        )
    );
    assert_eq!(done(&["module", "get", target, "learn_scans"]), "40\n");
    for wrong in ["colour=red", "foreground_mm=wide", "learn_scans=", "hosts=1.2.3", "address=10.0.0.300/24"]
    {
        let (status, line) = refused(&["module", "set", target, "learn_scans=50", wrong]);
        let names_it = line.starts_with(&format!("kehai-tracker: {wrong}: "));
        assert!(status == 1 && names_it && line.ends_with("; nothing was changed"), "{line}");
    }
    assert_eq!(done(&["module", "get", target, "learn_scans"]), "40\n");
    let (status, line) = refused(&["module", "get", target, "colour"]);
    assert!(status == 1 && line.contains("there is no setting \"colour\""), "{line}");

    assert!(done(&["module", "learn", target, "--scans", "30"]).starts_with("learned: background version"));
    let learned = done(&["module", "learn", target, "--scans", "30", "--json"]);
    assert!(
        json(learned.lines().last().unwrap())["learned"]["background_version"].as_u64() > Some(0),
        "{learned}"
    );

    a_chair_is_absorbed(target, &bench);

    let raw = done(&["module", "raw", target, "--seconds", "2"]);
    let scan = json(raw.lines().next().unwrap());
    assert_eq!((scan["ranges_mm"].as_array().unwrap().len(), &scan["first_step"]), (682, &Value::from(44)));

    raw_scans_are_kept_for_a_while(target, &bench.name);

    done(&["module", "identify", target]);
    done(&["module", "identify", target, "--seconds", "0"]);
    done(&["module", "restart", target]);
    let begin = Instant::now();
    while json(&done(&["module", "info", target, "--json"]))["start"] != 2 {
        assert!(begin.elapsed() < PATIENCE, "it starts again");
    }
}

/// Only what has stood there for a while, and only once.
fn a_chair_is_absorbed(target: &str, bench: &Bench) {
    let (status, line) = refused(&["module", "absorb", target]);
    assert!(status == 1 && line.contains("nothing stands out from the background"), "{line}");
    *bench.chair.lock().unwrap() = true;
    let begin = Instant::now();
    let absorbed = loop {
        let output = kehai_tracker(&["module", "absorb", target, "--bearing", "2", "--json"]);
        if output.status.success() {
            break json(&text(&output.stdout));
        }
        let line = text(&output.stderr);
        assert!(line.contains("it moves (2° at 0.84 m") || line.contains("nothing stands out"), "{line}");
        assert!(begin.elapsed() < PATIENCE, "{line}");
    };
    assert!((58..=62).contains(&absorbed["beams"].as_u64().unwrap()), "{absorbed}");
    let info = json(&done(&["module", "info", target, "--json"]));
    assert_eq!(info["background_version"], absorbed["background_version"]);
    let (status, line) = refused(&["module", "absorb", target]);
    assert!(status == 1 && line.contains("nothing stands out from the background"), "{line}");
}

/// In a database, and gone from it when their time is over, whatever opens it then.
fn raw_scans_are_kept_for_a_while(target: &str, name: &str) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("raw.db");
    let database = file.to_str().unwrap();
    let wish = ["module", "raw", target, "--seconds", "2", "--db", database, "--keep-hours", "3"];
    let said = done(&wish);
    assert!(said.contains(&format!("scans of {name} are kept in {database} for 3 h")), "{said}");
    let said = json(&done(&[wish.as_slice(), &["--json"]].concat()));
    let now_ms = unix_ms();
    let left_ms = said["until_ms"].as_u64().unwrap() - now_ms;
    assert!(left_ms <= 3 * 3_600_000 && left_ms > 2 * 3_600_000, "{said}");
    let kept = Reader::open(&file).unwrap().raw(now_ms).unwrap();
    assert_eq!((kept.len(), kept[1].scans), (2, said["scans"].as_u64().unwrap()), "{kept:?}");
    assert!(kept.iter().all(|kept| kept.module == name && kept.scans > 5), "{kept:?}");
    let connection = rusqlite::Connection::open(&file).unwrap();
    let first = |sql: &str| connection.query_row(sql, [], |row| row.get::<_, String>(0)).unwrap();
    assert_eq!(json(&first("SELECT scan FROM raw"))["ranges_mm"].as_array().unwrap().len(), 682);
    // The first request's time is over.
    connection
        .execute("UPDATE raw_request SET until_ms = ?1 WHERE request = 1", [now_ms as i64 - 1])
        .unwrap();
    done(&["export", database, "--out", folder.path().join("out").to_str().unwrap()]);
    assert_eq!(first("SELECT group_concat(DISTINCT request) FROM raw"), "2");
    assert_eq!(refused(&["module", "raw", target, "--keep-hours", "3"]).0, 2, "kept where?");
    assert_eq!(refused(&["module", "raw", target, "--db", database, "--keep-hours", "0"]).0, 2);
    let (status, line) = refused(&["module", "raw", target, "--db", "/no/such/folder/raw.db"]);
    assert!(status == 1 && line.contains("/no/such/folder/raw.db"), "{line}");
}

#[test]
fn no_answer_is_exit_status_3_and_one_line() {
    let (status, line) = refused(&["module", "info", "127.0.0.1:9"]);
    assert_eq!(status, 3);
    assert_eq!(
        line,
        "kehai-tracker: no module answers at 127.0.0.1:9: is it switched on, and is the address right?"
    );
    let (status, line) = refused(&["module", "learn", "02:00:00:ff:ff:ff"]);
    assert!(status == 3 && line.contains("no module \"02:00:00:ff:ff:ff\" was found"), "{line}");
    assert_eq!(refused(&["module", "set", "127.0.0.1:9", "name"]).0, 2);
    let (status, line) = refused(&["module", "set", "127.0.0.1:9", "name="]);
    assert!(status == 2 && line.contains("a module has a name of 1 to 32 bytes"), "{line}");
    assert_eq!(refused(&["module", "absorb", "127.0.0.1:9", "--bearing", "190"]).0, 2);
    assert_eq!(refused(&["module", "raw", "127.0.0.1:9", "--seconds", "0"]).0, 2);
    assert_eq!(refused(&["module", "identify", "127.0.0.1:9", "--seconds", "61"]).0, 2);
    assert_eq!(refused(&["module"]).0, 2);
}

#[test]
fn a_module_of_before_it_could_blink_is_named_as_too_old() {
    let module = Identity { module: ModuleId([2, 0, 0, 0, 0, 7]), boot: 3 };
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = socket.local_addr().unwrap().to_string();
    std::thread::spawn(move || {
        let (mut received, mut answer) = ([0; DATAGRAM_MAX], [0; DATAGRAM_MAX]);
        while let Ok((length, from)) = socket.recv_from(&mut received) {
            let incoming = Incoming::open(&received[..length]).unwrap();
            let message = match incoming.request(module) {
                Ok(Request::Subscribe { t1 }) => {
                    Message::Cookie { request_id: incoming.request_id, t1, cookie: Cookie([1; 8]) }
                }
                _ => Message::Refused(incoming.refused(Refusal::Unsupported)),
            };
            let length = message.encode(module, &mut answer).unwrap();
            socket.send_to(&answer[..length], from).unwrap();
        }
    });
    let (status, line) = refused(&["module", "identify", &address]);
    assert_eq!(status, 1);
    assert!(line.starts_with("kehai-tracker: this module's firmware is too old to blink"), "{line}");
}

#[test]
fn every_command_has_examples() {
    for command in ["list", "info", "identify", "learn", "absorb", "get", "set", "raw", "restart"] {
        let help = done(&["module", command, "--help"]);
        assert!(help.contains(&format!("kehai-tracker module {command}")), "{help}");
    }
}

#[test]
fn a_closed_pipe_ends_a_command_in_peace() {
    let site = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("pipe-{}.toml", std::process::id()));
    std::fs::write(&site, "[[module]]\nname = \"left\"\nx = 0.0\ny = 0.0\n").unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(["calibrate", "--json", "--no-mdns", "--module", "127.0.0.1:9", "--site"]).arg(&site);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    json(&lines.next().expect("a line").unwrap());
    drop(lines);
    let ended = child.wait_with_output().unwrap();
    assert!(ended.status.success() && ended.stderr.is_empty(), "{}", text(&ended.stderr));
    let _ = std::fs::remove_file(site);
}

/// `kehai-tracker run`, ended with the test.
struct Tracker(Child);

impl Drop for Tracker {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn the_tracker_follows_with_a_module_and_says_who_is_missing() {
    let bench = Bench::start("left");
    let found = target(&bench) == bench.name;
    let site = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("run-{}.toml", std::process::id()));
    let text = format!(
        "[[module]]\nname = \"{}\"\nx = 0.0\ny = 0.0\n\n[[module]]\nname = \"ghost\"\nx = 9.0\ny = 0.0\n\n\
         [[zone]]\nname = \"hall\"\npolygon = [[0.2, -0.3], [0.8, -0.3], [0.8, 0.3], [0.2, 0.3]]\n",
        bench.name
    );
    std::fs::write(&site, text).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(["run", "--tracks-out", "-", "--site"]).arg(&site);
    if !found {
        command.args(["--no-mdns", "--module", &bench.address.to_string()]);
    }
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut tracker = Tracker(child);
    // The still room is all walls: what lies before them is known once the module has learned.
    let lines = BufReader::new(tracker.0.stdout.take().unwrap()).lines();
    let begin = Instant::now();
    let known = lines
        .map(|line| json(&line.unwrap()))
        .take_while(|_| begin.elapsed() < PATIENCE)
        .find(|line| line["zones"]["hall"]["state"] == "known" && line["t"].as_f64() > Some(6.0));
    assert_eq!(known.expect("the zone is seen")["zones"]["hall"]["count"], 0);
    let sent = Command::new("kill").args(["-INT", &tracker.0.id().to_string()]).status();
    assert!(sent.unwrap().success());
    let mut said = String::new();
    tracker.0.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    assert!(tracker.0.wait().unwrap().success(), "{said}");
    assert!(said.contains("module ghost: silent: it has not been found"), "{said}");
    assert!(said.contains(&format!("module {} (", bench.name)) && said.contains("watching"), "{said}");
    let _ = std::fs::remove_file(site);
}

/// A site of one module, and its file of keys beside it.
fn site_of(bench: &Bench) -> (tempfile::TempDir, String, String) {
    let folder = tempfile::tempdir().unwrap();
    let site = folder.path().join("hall.toml");
    let text = format!(
        "[[module]]\nname = \"{}\"\nx = 0.0\ny = 0.0\n\n[[zone]]\nname = \"area\"\npolygon = [[0.3, -0.3], [0.6, -0.3], [0.6, 0.3], [0.3, 0.3]]\n",
        bench.name
    );
    std::fs::write(&site, text).unwrap();
    let path = |path: &std::path::Path| path.to_str().unwrap().to_owned();
    let (site, keys) = (path(&site), path(&site.with_extension("keys")));
    (folder, site, keys)
}

/// How many snapshots of a run say that the zone is known.
fn known(site: &str, address: &str, more: &[&str]) -> usize {
    let arguments =
        ["run", "--site", site, "--module", address, "--no-mdns", "--tracks-out", "-", "--seconds", "6"];
    let output = kehai_tracker(&[&arguments[..], more].concat());
    let lines = text(&output.stdout);
    lines.lines().map(json).filter(|line| line["zones"]["area"]["state"] == "known").count()
}

#[test]
fn a_label_carries_the_address_of_the_map_for_the_lid() {
    let map = "http://10.0.0.2:8420/";
    let both = done(&["module", "label", "--map", map]);
    let (key, lid) = both.trim_end().rsplit_once('\n').unwrap();
    let rows = |text: &str| text.lines().filter(|line| line.contains(['█', '▀', '▄'])).count();
    assert!(lid == map && rows(key) > rows(&done(&["module", "label"])) + 8, "{both}");
    let said = json(&done(&["module", "label", "--map", map, "--json"]));
    assert!(said["map"] == map && said["code"].is_string(), "{said}");
    for wrong in ["10.0.0.2:8420", "ftp://map", "http://", "http://the map/"] {
        let (status, line) = refused(&["module", "label", "--map", wrong]);
        assert!(status == 2 && line.contains("is like http://10.0.0.2:8420/"), "{status}: {line}");
    }
}

#[test]
fn a_module_is_claimed_by_its_label_and_then_believed_and_ruled_by_its_key_alone() {
    let bench = Bench::start("keyed");
    let (folder, site, keys) = site_of(&bench);
    let address = bench.address.to_string();
    let (address, code) = (address.as_str(), kehai_tracking::keys::Label(LABEL).text());
    let begin = Instant::now();
    while json(&done(&["module", "info", address, "--json"]))["background_version"] == 0 {
        assert!(begin.elapsed() < PATIENCE, "no background is learned");
    }
    let claim = |code: &str| ["module", "claim", address, "--keys", &keys, "--code", code].map(str::to_owned);

    let wrong = claim("AAAAA-AAAAA-AAAAA-AAAAA-AAAAAA");
    let (status, line) = refused(&wrong.each_ref().map(String::as_str));
    assert!(status == 1 && line.contains("does not take this code"), "{line}");
    assert!(known(&site, address, &[]) > 0, "without keys it is believed in clear");

    done(&claim(&code).each_ref().map(String::as_str));
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        assert_eq!(std::fs::metadata(&keys).unwrap().permissions().mode() & 0o777, 0o600);
    }
    let (_, line) = refused(&["module", "get", address]);
    assert!(line.contains("holders of a key only: name the site's with --keys"), "{line}");
    let named = json(&done(&["module", "info", address, "--json"]));
    assert!(named["sensor"].is_null() && named["name"] == bench.name.as_str(), "who it is, no more: {named}");
    assert!(done(&["module", "get", address, "--keys", &keys]).contains("name"));
    let (_, line) = refused(
        &claim(&code)
            .each_ref()
            .map(String::as_str)
            .map(|word| if word == keys.as_str() { "/tmp/no-such-folder/x.keys" } else { word }),
    );
    assert!(line.contains("x.keys"), "{line}");

    assert!(known(&site, address, &[]) > 0, "the keys beside the site file are taken");
    let copy = folder.path().join("copy.keys");
    std::fs::copy(&keys, &copy).unwrap();
    let other = folder.path().join("other.keys");
    let stranger = std::fs::read_to_string(&keys).unwrap();
    let secret = stranger.lines().find(|line| line.starts_with("secret")).unwrap();
    std::fs::write(&other, stranger.replace(secret, &format!("secret = \"{}\"", "ab".repeat(32)))).unwrap();
    assert_eq!(known(&site, address, &["--keys", other.to_str().unwrap()]), 0, "the keys of another site");

    done(&["module", "rotate", address, "--keys", &keys]);
    assert!(done(&["module", "get", address, "--keys", &keys]).contains("name"));
    let (_, line) = refused(&["module", "get", address, "--keys", copy.to_str().unwrap()]);
    assert!(line.contains("no such key"), "{line}");
    let key = done(&["module", "key", &bench.name, "--role", "read", "--keys", &keys]);
    assert_eq!(key.trim().len(), "7:".len() + 64, "{key}");
}

/// Claims the module of a bench, as often as it is asked to.
fn claim(bench: &Bench, keys: &str) -> String {
    let (address, code) = (bench.address.to_string(), kehai_tracking::keys::Label(LABEL).text());
    done(&["module", "claim", &address, "--keys", keys, "--code", &code])
}

#[test]
fn keys_that_were_rotated_out_do_not_come_back_when_a_module_is_claimed_again() {
    let bench = Bench::start("again");
    let (folder, _, keys) = site_of(&bench);
    let (address, keys) = (bench.address.to_string(), keys.as_str());
    let get = ["module", "get", address.as_str(), "--keys"];
    claim(&bench, keys);
    let first = folder.path().join("first.keys");
    std::fs::copy(keys, &first).unwrap();
    let first = first.to_str().unwrap();
    done(&["module", "rotate", &address, "--keys", keys]);
    let before = std::fs::read(keys).unwrap();
    assert!(claim(&bench, keys).contains("has its keys"), "it has those of the file");
    assert_eq!(std::fs::read(keys).unwrap(), before);

    bench.button.store(true, std::sync::atomic::Ordering::Relaxed);
    done(&["module", "restart", &address, "--keys", keys]);
    let begin = Instant::now();
    while !kehai_tracker(&["module", "get", &address]).status.success() {
        assert!(begin.elapsed() < PATIENCE, "it has keys still");
    }
    claim(&bench, keys);
    assert!(done(&[&get[..], &[keys]].concat()).contains("name"));
    let (_, line) = refused(&[&get[..], &[first]].concat());
    assert!(line.contains("no such key"), "{line}");
}

#[test]
fn a_mistyped_file_of_keys_makes_no_secret() {
    let folder = tempfile::tempdir().unwrap();
    let (site, file) = (folder.path().join("hal.toml"), folder.path().join("hal.keys"));
    let (keys, code) = (file.to_str().unwrap(), kehai_tracking::keys::Label(LABEL).text());
    let claim = ["module", "claim", "127.0.0.1:9", "--code", &code, "--keys", keys];
    let (status, line) = refused(&claim);
    assert!(status == 1 && line.contains("no such file") && line.contains("--new"), "{line}");
    let (status, line) = refused(&["module", "rotate", "127.0.0.1:9", "--keys", keys]);
    assert!(status == 1 && line.contains("hal.keys: there is no such file"), "{line}");
    let (status, line) = refused(&["module", "get", "127.0.0.1:9", "--keys", keys]);
    assert!(status == 1 && line.contains("hal.keys: there is no such file"), "{line}");
    assert!(!file.exists());
    // Beside its site file, or if that is wanted.
    assert!(refused(&[&claim[..], &["--new"]].concat()).0 == 3 && file.exists());
    std::fs::remove_file(&file).unwrap();
    std::fs::write(&site, "").unwrap();
    assert!(refused(&claim).0 == 3 && file.exists());
}

#[test]
fn a_rotation_that_is_interrupted_says_that_the_old_keys_still_count() {
    let bench = Bench::start("cut");
    let (folder, _, keys) = site_of(&bench);
    let (address, keys) = (bench.address.to_string(), keys.as_str());
    let rotate = ["module", "rotate", address.as_str(), "--keys", keys];
    claim(&bench, keys);
    let old = folder.path().join("old.keys");
    std::fs::copy(keys, &old).unwrap();
    let with_old = ["module", "get", address.as_str(), "--keys", old.to_str().unwrap()];
    // Until it says that the old keys still count.
    let begin = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
        let command = command.args(rotate).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let line = lines.next().expect("a line").unwrap();
        assert!(line.contains("the old keys still count") && line.contains("run rotate again"), "{line}");
        (child, lines)
    };

    let (mut child, _lines) = begin();
    assert!(Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap().success());
    assert!(!child.wait().unwrap().success());
    assert!(done(&with_old).contains("name"), "as it said");
    done(&rotate);
    let (_, line) = refused(&with_old);
    assert!(line.contains("no such key"), "{line}");

    let (child, _lines) = begin();
    drop(bench);
    let output = child.wait_with_output().unwrap();
    let line = text(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{line}");
    assert!(
        line.ends_with("; the old keys still count: run rotate again\n") && line.lines().count() == 1,
        "{line}"
    );
}
