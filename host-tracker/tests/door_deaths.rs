//! Deaths of the whole tracker while an alarm of a guarded door stands: real modules see a person walk through a door that let
//! nobody in, and the alarm is there after each start until it is reset.
//!
//! ```text
//!   hall ─UDP▶ kehai-tracker run --db --http ── kill -9 ──▶ again ── kill -9 ──▶ again ── reset, kill -9 ──▶ the database
//!               └ went-in                        └ still went-in, under its number ────▶ └ it has ended
//! ```
#![cfg(unix)]

mod described;
mod hall;
mod http_client;

use std::net::SocketAddr;
use std::process::Command;
use std::time::{Duration, Instant};

use hall::{Hall, PATIENCE, Tracker};
use host_tracker::store::reader::Reader;
use kehai_tracking::alarm_list::ListedAlarm;
use kehai_tracking::door::Alarm;
use kehai_tracking::snapshot::unix_ms;
use serde_json::{Value, json};

/// Between the two zones of the hall, where everybody crosses. No contact says anything: the leaf may be open.
const DOOR: &str = r#"
[[door]]
name = "middle"
zone = "left"
line = [[2.5, 0.2], [2.5, 4.8]]
fail = "secure"
close_s = 120
without_keys = true
"#;

/// The database is half a second behind.
const WRITTEN: Duration = Duration::from_millis(1500);

fn start(hall: &Hall) -> (Tracker, SocketAddr) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(hall.arguments(&hall.database)).args(["--http", "0"]);
    let tracker = Tracker::start(command);
    let map = tracker.says("live map at http://").trim_end_matches('/').parse().unwrap();
    (tracker, map)
}

fn door(map: SocketAddr) -> Value {
    let (status, door) = http_client::ask(map, "GET /api/door/middle", &[], b"");
    assert_eq!(status, 200, "{door}");
    serde_json::from_str(&door).unwrap()
}

/// Whether the alarm is on, or stands beneath trouble.
fn stands(door: &Value) -> bool {
    door["alarm"] == "went-in" || door["standing"] == "went-in"
}

#[track_caller]
fn until(map: SocketAddr, is_so: impl Fn(&Value) -> bool) {
    let begun = Instant::now();
    while !is_so(&door(map)) {
        assert!(begun.elapsed() < PATIENCE, "{:#}", door(map));
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// The alarms of persons who went in, in the database.
fn written(hall: &Hall) -> Vec<ListedAlarm> {
    let alarms = Reader::open(&hall.database).unwrap().alarms(0).unwrap();
    let went_in = |alarm: &ListedAlarm| alarm.cause.name() == Alarm::WentIn.name();
    alarms.into_iter().filter(went_in).collect()
}

#[test]
fn an_alarm_of_a_door_outlives_the_deaths_of_the_tracker_until_it_is_reset() {
    let hall = Hall::new(7);
    let site = std::fs::read_to_string(&hall.site).unwrap();
    // The door's zone is the first one.
    let secure = site.replacen("secure = false", "secure = true", 1);
    assert_ne!(site, secure);
    std::fs::write(&hall.site, secure + DOOR).unwrap();
    let (tracker, map) = start(&hall);
    assert!(!stands(&door(map)));
    until(map, stands);
    std::thread::sleep(WRITTEN);
    tracker.kill();
    let [alarm] = &written(&hall)[..] else { panic!("one alarm: {:?}", written(&hall)) };
    assert_eq!(alarm.of_door(), Some(("middle", Alarm::WentIn)));
    for at_once in [true, false] {
        let (tracker, map) = start(&hall);
        let first = door(map);
        assert!(stands(&first), "{first:#}");
        if !at_once {
            until(map, |door| door["phase"] == "alarmed");
            std::thread::sleep(WRITTEN);
        }
        tracker.kill();
        assert_eq!(written(&hall), std::slice::from_ref(alarm), "the same, and it stands");
    }
    let (tracker, map) = start(&hall);
    tracker.line();
    assert!(stands(&door(map)));
    let reset = json!({ "id": 1, "at_ms": unix_ms() }).to_string();
    let (status, answer) = http_client::ask(map, "POST /api/door/middle/reset", &[], reset.as_bytes());
    assert_eq!(status, 200, "{answer}");
    std::thread::sleep(WRITTEN);
    tracker.kill();
    let reset = written(&hall).into_iter().find(|known| known.id == alarm.id);
    assert!(reset.as_ref().is_some_and(|known| known.until_ms.is_some()), "{reset:?}");
}
