//! `kehai-tracker backup` and `restore` as commands: beside a tracker that writes, elsewhere, and killed at any moment.
#![cfg(target_os = "linux")]

mod described;
mod hall;

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use hall::{Hall, PATIENCE};
use host_tracker::store::reader::Reader;

fn kehai(arguments: &[&str], site: &Path, database: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(arguments).arg("--site").arg(site).arg("--db").arg(database);
    command
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&[output.stdout.as_slice(), &output.stderr].concat()).into_owned()
}

/// Everything that is asked of a database about a time, as text.
fn figures(database: &Path, from_ms: u64, to_ms: u64) -> String {
    let reader = Reader::open(database).unwrap();
    assert_eq!(reader.check().unwrap(), "ok");
    format!(
        "{:?} {:?} {:?} {:?}",
        reader.paths(from_ms, to_ms).unwrap(),
        reader.counts(from_ms, to_ms).unwrap(),
        reader.events(from_ms, to_ms).unwrap(),
        reader.health(from_ms, to_ms).unwrap()
    )
}

#[test]
fn a_backup_beside_a_tracker_that_writes_answers_the_same_elsewhere() {
    let hall = Hall::new(7);
    let user = ["user", "add", "anna", "--role", "admin"];
    let mut adds = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    assert!(adds.args(user).arg("--site").arg(&hall.site).output().unwrap().status.success());
    let tracker = hall.tracker();
    let begun = Instant::now();
    let written = || Reader::open(&hall.database).ok().and_then(|reader| reader.span_ms().ok().flatten());
    // Until paths of people who walk about are there.
    let (from_ms, to_ms) = loop {
        let span = written().filter(|(from_ms, to_ms)| to_ms - from_ms > 4000);
        if let Some((from_ms, to_ms)) = span
            && !Reader::open(&hall.database).unwrap().paths(from_ms, to_ms).unwrap().is_empty()
        {
            break (from_ms, to_ms - 1000);
        }
        assert!(begun.elapsed() < PATIENCE, "the tracker writes nothing");
        std::thread::sleep(Duration::from_millis(100));
    };
    let archive = hall.folder.path().join("hall.tar.gz");
    let name = archive.to_str().unwrap();
    let output = kehai(&["backup", name], &hall.site, &hall.database).output().unwrap();
    let words = said(&output);
    assert!(
        output.status.success() && words.contains("site.db") && words.contains("secrets (site.access"),
        "{words}"
    );
    let refused = kehai(&["restore", name, "--force"], &hall.site, &hall.database).output().unwrap();
    assert!(
        refused.status.code() == Some(1) && said(&refused).contains("a tracker keeps what happens there"),
        "{}",
        said(&refused)
    );
    let elsewhere = tempfile::tempdir().unwrap();
    let (site, database) = (elsewhere.path().join("other.toml"), elsewhere.path().join("other.db"));
    let output = kehai(&["restore", name], &site, &database).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    drop(tracker);
    let kept = figures(&database, from_ms, to_ms);
    assert!(kept.len() > 1000, "{kept}");
    assert_eq!(kept, figures(&hall.database, from_ms, to_ms), "the same figures");
    assert_eq!(std::fs::read(&site).unwrap(), std::fs::read(&hall.site).unwrap());
    let access = |site: &Path| std::fs::read(site.with_extension("access")).unwrap();
    assert_eq!(access(&site), access(&hall.site));
    // A tracker goes on there.
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(["run", "--no-mdns", "--module", "127.0.0.1:9", "--seconds", "1", "--site"]).arg(&site);
    let output = command.arg("--db").arg(&database).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
}

/// As large as the words say: a database that takes a while to be unpacked.
fn large(folder: &Path, mark: &str) -> (std::path::PathBuf, std::path::PathBuf) {
    let (site, database) = (folder.join("home.toml"), folder.join("home.db"));
    std::fs::write(&site, format!("[[zone]]\nname = \"{mark}\"\npolygon = [[0, 0], [1, 0], [1, 1]]\n"))
        .unwrap();
    let connection = rusqlite::Connection::open(&database).unwrap();
    connection
        .execute_batch(&format!(
            "PRAGMA user_version = 1; CREATE TABLE run (run); CREATE TABLE path (path); CREATE TABLE snapshot (frame);
             CREATE TABLE mark (mark TEXT, more BLOB); INSERT INTO mark VALUES ('{mark}', randomblob(20000000));"
        ))
        .unwrap();
    (site, database)
}

fn mark(site: &Path, database: &Path) -> (bool, bool) {
    let text = std::fs::read_to_string(site).unwrap();
    let connection = rusqlite::Connection::open(database).unwrap();
    let mark: String = connection.query_row("SELECT mark FROM mark", [], |row| row.get(0)).unwrap();
    (text.contains("\"new\""), mark == "new")
}

#[test]
fn a_restoration_killed_at_any_moment_leaves_the_old_site_or_the_new_one() {
    let folder = tempfile::tempdir().unwrap();
    let made = folder.path().join("made");
    std::fs::create_dir(&made).unwrap();
    let (site, database) = large(&made, "new");
    let archive = folder.path().join("new.tar.gz");
    let name = archive.to_str().unwrap();
    assert!(kehai(&["backup", name], &site, &database).output().unwrap().status.success());
    let home = folder.path().join("home");
    std::fs::create_dir(&home).unwrap();
    let (mut outcomes, mut wait) = ([0, 0], Duration::ZERO);
    for _ in 0..12 {
        let _ = std::fs::remove_file(home.join("home.db"));
        let (site, database) = large(&home, "old");
        let mut child =
            kehai(&["restore", name, "--force"], &site, &database).stdout(Stdio::null()).spawn().unwrap();
        std::thread::sleep(wait);
        let _ = child.kill();
        child.wait().unwrap();
        // What uses the site next finishes what was begun.
        let listed = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"))
            .args(["user", "list", "--site"])
            .arg(&site)
            .output()
            .unwrap();
        assert!(listed.status.success(), "{}", said(&listed));
        let (site_is_new, database_is_new) = mark(&site, &database);
        assert_eq!(site_is_new, database_is_new, "a mix after {wait:?}");
        outcomes[usize::from(site_is_new)] += 1;
        wait += if site_is_new { Duration::ZERO } else { Duration::from_millis(40) };
        if site_is_new {
            wait = wait.saturating_sub(Duration::from_millis(25));
        }
    }
    println!("old {}, new {}", outcomes[0], outcomes[1]);
}
