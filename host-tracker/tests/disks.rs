//! The whole tracker on disks that are full or may not be written: it goes on, says so once, and stores all of it when
//! it can.
//!
//! ```text
//!   a shell in a mount namespace of its own ─ mounts a disk of 16 MB, fills it, makes it read-only ─▶ "did …"
//!      └ kehai-tracker run --db DISK/hall.db --http …  ─▶ lines, frames on a WebSocket, words on stderr
//! ```
//!
//! Where the system refuses to mount, that test is left out with a message; the limit on the size of files, and a
//! folder in which no user may write, root included, are there everywhere. Recordings and lines of tracks lose what comes
//! while there is no room, say how much, and go on.
#![cfg(target_os = "linux")]

mod described;
mod hall;

use std::io::Write;
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, Stdio};

use hall::{Hall, Tracker};
use host_tracker::record::replay::replay;
use host_tracker::store::reader::Reader;
use kehai_tracking::alarm::{AlarmKind, Cause};
use kehai_tracking::alarm_list::{About, ListedAlarm};
use kehai_tracking::jsonl::TracksLine;
use kehai_tracking::snapshot::Snapshot;
use kehai_tracking::tracker::LifeCycle;
use serde_json::Value;
use tungstenite::{Message, WebSocket};

/// Frames within which an alarm comes or goes, and a person is followed: fifty times what it takes.
const ALARM: u32 = 6000;

/// A folder in which not even root can make a file.
const NOBODYS: &str = "/proc";

/// A client that listens to a tracker's frames.
struct Listener(WebSocket<TcpStream>);

impl Listener {
    fn new(tracker: &Tracker) -> Self {
        let map = tracker.says("live map at ");
        let host = map.trim_start_matches("http://").trim_end_matches('/');
        let stream = TcpStream::connect(host).unwrap();
        stream.set_read_timeout(Some(hall::PATIENCE)).unwrap();
        Self(tungstenite::client(format!("ws://{host}/ws"), stream).unwrap().0)
    }

    fn frame(&mut self) -> Snapshot {
        loop {
            // The server asks from time to time whether it is still there: that is answered by the next read.
            let Message::Text(text) = self.0.read().unwrap() else { continue };
            described::message(&text);
            let mut value: Value = serde_json::from_str(&text).unwrap();
            if !value["frame"].is_null() {
                return serde_json::from_value(value["frame"].take()).unwrap();
            }
        }
    }

    /// The next frame in which the database's alarm is as asked for.
    #[track_caller]
    fn until(&mut self, alarm: bool) -> Snapshot {
        // Some minutes of frames.
        (0..ALARM)
            .map(|_| self.frame())
            .find(|frame| of_database(frame).is_some() == alarm)
            .unwrap_or_else(|| panic!("the alarm is not {alarm}"))
    }
}

/// The database's alarm, if it is on.
fn of_database(frame: &Snapshot) -> Option<&ListedAlarm> {
    frame.alarms.iter().find(|alarm| alarm.cause == Cause::Fault(AlarmKind::Database))
}

/// Thirty frames in which the alarm stands while a person is followed; the last. It is the `number`th that is told.
#[track_caller]
fn goes_on(tracker: &Tracker, listener: &mut Listener, number: usize, word: &str) -> Snapshot {
    let mut frame = listener.until(true);
    let said = &of_database(&frame).unwrap().text;
    assert!(said.contains(word), "{said}");
    let people = |frame: &Snapshot| frame.line.tracks.iter().any(|track| track.state == LifeCycle::Confirmed);
    let (mut followed, mut frames) = (0, 0);
    while followed < 30 {
        let next = listener.frame();
        frames += 1;
        assert!(frames < ALARM, "no person is followed");
        assert!(next.unix_ms > frame.unix_ms);
        assert!(of_database(&next).is_some(), "the alarm has ended");
        followed += u32::from(people(&next));
        frame = next;
    }
    while tracker.line().t < frame.line.t {}
    let told = tracker.said().iter().filter(|line| line.contains("the tracker: database: /")).count();
    assert_eq!(told, number, "one alarm is told once: {:#?}", tracker.said());
    frame
}

/// What the tracker knew in `frame` is in the database.
#[track_caller]
fn kept(database: &Path, frame: &Snapshot) {
    let reader = Reader::open(database).unwrap();
    assert_eq!(reader.check().unwrap(), "ok");
    let paths = reader.paths(frame.unix_ms, frame.unix_ms).unwrap();
    for track in frame.line.tracks.iter().filter(|track| track.state != LifeCycle::Tentative) {
        let covers = |path: &&host_tracker::store::answers::Walked| {
            let (first, last) = (path.places.first().unwrap().at_ms, path.places.last().unwrap().at_ms);
            path.track == track.id && (first..=last).contains(&frame.unix_ms)
        };
        assert_eq!(paths.iter().filter(covers).count(), 1, "track {}, once: {paths:?}", track.id);
    }
}

#[test]
fn a_file_that_may_not_grow_is_an_alarm_and_what_was_kept_in_memory_is_written_later() {
    let hall = Hall::new(7);
    let first = hall.tracker();
    first.until_a_person();
    first.kill();
    // Brings the log into the file, and deletes it.
    drop(rusqlite::Connection::open(&hall.database).unwrap().query_row(
        "PRAGMA wal_checkpoint(TRUNCATE)",
        [],
        |row| row.get::<_, i64>(0),
    ));
    let blocks = std::fs::metadata(&hall.database).unwrap().len() / 512;
    let mut command = Command::new("sh");
    // The soft limit only, so that it can be lifted.
    command.args(["-c", &format!("ulimit -S -f {blocks}; exec \"$0\" \"$@\"")]);
    command.arg(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(hall.arguments(&hall.database)).args(["--http", "127.0.0.1:0"]);
    let tracker = Tracker::start(command);
    let mut listener = Listener::new(&tracker);
    let frame = goes_on(&tracker, &mut listener, 1, "hall.db");
    println!("full: {}", tracker.says("the tracker: database: "));
    let lifted = Command::new("prlimit")
        .args(["--fsize=unlimited:unlimited", "--pid", &tracker.process.id().to_string()])
        .status();
    assert!(lifted.unwrap().success());
    let after = listener.until(false);
    tracker.says("the tracker: database: over");
    ends(tracker);
    kept(&hall.database, &frame);
    kept(&hall.database, &after);
}

#[test]
fn a_folder_that_may_not_be_written_is_an_alarm_and_what_was_kept_in_memory_is_written_later() {
    let hall = Hall::new(6);
    let (disk, better) = (hall.folder.path().join("disk"), hall.folder.path().join("better"));
    std::os::unix::fs::symlink(NOBODYS, &disk).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(hall.arguments(&disk.join("hall.db"))).args(["--http", "127.0.0.1:0"]);
    let tracker = Tracker::start(command);
    let mut listener = Listener::new(&tracker);
    let frame = goes_on(&tracker, &mut listener, 1, "may the tracker write");
    println!("not writable: {}", tracker.says("the tracker: database: "));
    std::fs::create_dir(&better).unwrap();
    std::os::unix::fs::symlink(&better, hall.folder.path().join("new")).unwrap();
    std::fs::rename(hall.folder.path().join("new"), &disk).unwrap();
    let after = listener.until(false);
    tracker.says("the tracker: database: over");
    ends(tracker);
    kept(&better.join("hall.db"), &frame);
    kept(&better.join("hall.db"), &after);
}

/// A limit on the size of each file, 50 kB: a recording of the hall passes it within seconds, and the lines of tracks
/// soon after. The soft limit only, so that it can be lifted.
const SMALL: &str = "ulimit -S -f 100; exec \"$0\" \"$@\"";

/// Lines of a file, of which the last may be cut off.
fn lines(file: &Path) -> Vec<Option<TracksLine>> {
    let text = std::fs::read_to_string(file).unwrap();
    text.lines().map(|line| serde_json::from_str(line).ok()).collect()
}

#[test]
fn f12_a_recording_and_the_lines_on_a_full_disk_are_alarms_and_go_on_when_there_is_room() {
    let hall = Hall::new(5);
    let (recording, tracks) = (hall.folder.path().join("hall.mcap"), hall.folder.path().join("hall.jsonl"));
    let mut command = Command::new("sh");
    command.args(["-c", SMALL]).arg(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(["run", "--no-mdns", "--http", "127.0.0.1:0", "--site"]).arg(&hall.site);
    command.arg("--record").arg(&recording).arg("--tracks-out").arg(&tracks);
    for (_, address) in hall.building.modules() {
        command.args(["--module", &address.to_string()]);
    }
    let tracker = Tracker::start(command);
    let mut listener = Listener::new(&tracker);
    let full = |alarms: &[Cause]| {
        [AlarmKind::Recording, AlarmKind::TracksOut]
            .into_iter()
            .all(|kind| alarms.contains(&Cause::Fault(kind)))
    };
    let own = |frame: &Snapshot| -> Vec<ListedAlarm> {
        frame.alarms.iter().filter(|alarm| alarm.about == About::Tracker).cloned().collect()
    };
    let has = |frame: &Snapshot| own(frame).iter().map(|alarm| alarm.cause).collect::<Vec<_>>();
    let frame = (0..ALARM).map(|_| listener.frame()).find(|frame| full(&has(frame))).expect("no alarms");
    let texts: Vec<String> = own(&frame).into_iter().map(|alarm| alarm.text).collect();
    println!("full: {texts:#?}");
    assert!(texts.iter().all(|text| text.contains("lost so far")), "{texts:#?}");
    for file in ["hall.mcap", "hall.jsonl"] {
        assert!(texts.iter().any(|text| text.contains(file)), "{texts:#?}");
    }
    let lost_from_s = frame.line.t;
    // Some seconds without room, in which people are followed.
    while listener.frame().line.t < lost_from_s + 3.0 {}
    let lifted = Command::new("prlimit")
        .args(["--fsize=unlimited:unlimited", "--pid", &tracker.process.id().to_string()])
        .status();
    assert!(lifted.unwrap().success());
    let after = (0..ALARM).map(|_| listener.frame()).find(|frame| own(frame).is_empty()).expect("no end");
    while listener.frame().line.t < after.line.t + 3.0 {}
    for kind in ["recording", "tracks-out"] {
        let told = tracker.said().iter().filter(|line| line.contains(&format!("{kind}: /"))).count();
        assert_eq!(told, 1, "{kind} is told once: {:#?}", tracker.said());
        tracker.says(&format!("the tracker: {kind}: over"));
    }
    ends(tracker);

    let outcome = replay(&recording, |_, _| Ok(())).unwrap();
    println!("{outcome:?}");
    assert_eq!(outcome.cut_off, None);
    assert!(outcome.lost > 30, "three seconds of three modules");
    let lines = lines(&tracks);
    assert!(lines.iter().all(Option::is_some), "whole lines");
    let times_s: Vec<f64> = lines.into_iter().flatten().map(|line| line.t).collect();
    assert!(times_s.iter().all(|&t| t < lost_from_s || t > lost_from_s + 2.5), "what was lost is not there");
    assert!(times_s.first().unwrap() < &lost_from_s && times_s.last().unwrap() > &(after.line.t + 2.0));
}

/// Ended with Ctrl-C's signal, it writes the last of it.
fn ends(mut tracker: Tracker) {
    let interrupt = format!("kill -INT {}", tracker.process.id());
    assert!(Command::new("sh").args(["-c", &interrupt]).status().unwrap().success());
    assert!(tracker.process.wait().unwrap().success());
}

/// Mounts a small disk at $1, then does what is asked, beside the tracker, which is the rest.
const SHELL: &str = r#"
disk=$1; shift
mount -t tmpfs -o size=16m none "$disk" && mount -o remount,ro "$disk" || { echo "cannot mount" >&2; exit 1; }
echo "mounted" >&2
"$@" <&- & tracker=$!
while read -r command; do eval "$command"; done
kill "$tracker"; wait "$tracker"
"#;

#[test]
fn a_read_only_disk_and_a_full_one_are_alarms_and_all_of_it_is_written_when_there_is_room() {
    let hall = Hall::new(8);
    let disk = hall.folder.path().join("disk");
    std::fs::create_dir(&disk).unwrap();
    let database = disk.join("hall.db");
    let mut command = Command::new("unshare");
    command.args(["--user", "--map-root-user", "--mount", "sh", "-c", SHELL, "sh"]).arg(&disk);
    command.arg(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(hall.arguments(&database)).args(["--http", "127.0.0.1:0"]).stdin(Stdio::piped());
    let mut tracker = Tracker::start(command);
    let mut shell = tracker.process.stdin.take().unwrap();
    while !tracker.said().iter().any(|line| line == "mounted") {
        if tracker.process.try_wait().unwrap().is_some() {
            let missing = format!("no permission to mount a disk: {:?}", tracker.said());
            return test_support::fail_in_ci_else_skip(missing);
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let mut listener = Listener::new(&tracker);
    let read_only = goes_on(&tracker, &mut listener, 1, "may the tracker write");
    println!("read-only: {}", tracker.says("the tracker: database: "));
    writeln!(shell, "mount -o remount,rw '{}'", disk.display()).unwrap();
    listener.until(false);
    writeln!(shell, "cat /dev/zero >'{}/filler' 2>/dev/null", disk.display()).unwrap();
    let full = goes_on(&tracker, &mut listener, 2, "make room");
    let last = tracker.said().into_iter().rfind(|line| line.contains("the tracker: database: "));
    println!("full: {}", last.unwrap_or_default());
    writeln!(shell, "rm '{}/filler'", disk.display()).unwrap();
    let after = listener.until(false);
    while listener.frame().unix_ms < after.unix_ms + 1000 {}
    // The disk goes with its namespace.
    let out = hall.folder.path().display();
    writeln!(shell, "kill -INT $tracker; wait $tracker; cp '{}'/hall.db* '{out}'", disk.display()).unwrap();
    drop(shell);
    tracker.process.wait().unwrap();
    for frame in [&read_only, &full, &after] {
        kept(&hall.database, frame);
    }
}
