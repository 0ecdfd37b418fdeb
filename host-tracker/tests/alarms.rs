//! The list of alarms: over HTTP and the WebSocket, kept over a restart, and on the map in a real browser.

mod chromium;
mod described;
mod door_fixture;
mod house;
mod http_client;
mod socket;

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, mpsc};

use door_fixture::DoorServer;
use host_tracker::access::roles::Role;
use host_tracker::alarm_handle::AlarmHandle;
use host_tracker::store::{Keep, Store, alarms_before};
use host_tracker::tracker_alarms::TrackerAlarms;
use host_tracker::webhook::Webhook;
use house::{House, ZONE};
use kehai_tracking::alarm::{AlarmKind, AlarmLine};
use kehai_tracking::alarm_list::AlarmList;
use kehai_tracking::now::Now;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{Snapshot, active_alarms};
use serde_json::{Value, json};
use socket::next;
use tungstenite::WebSocket;

const JSON: (&str, &str) = ("Content-Type", "application/json");

fn acknowledge(server: &DoorServer, ids: &Value) -> (u16, Value) {
    server.ask("POST /api/alarms/acknowledge", &[JSON], &json!({ "ids": ids }).to_string())
}

fn listed(server: &DoorServer) -> Value {
    server.ask("GET /api/alarms", &[], "").1
}

/// A door whose leaf stays open until there is an alarm.
fn held_open(server: &DoorServer) -> Value {
    server.waits_for("idle");
    server.lets_one_in();
    server.goes_through();
    server.waits_until("held open", |door| door["alarm"] == "held-open")
}

/// A door that calls for help when its leaf is open for a second. Its contact says at once that the leaf is shut: one of which nothing
/// is known counts as open.
fn hurried() -> DoorServer {
    let hurried = door_fixture::SITE.replace("close_s = 120", "close_s = 1");
    assert_ne!(hurried, door_fixture::SITE);
    let server = DoorServer::of(&hurried);
    assert_eq!(server.tell("contact", json!({ "contact": "shut" })).0, 200);
    server
}

#[test]
fn a_door_s_alarm_is_listed_acknowledged_and_over_and_the_next_is_unacknowledged() {
    let server = hurried();
    server.waits_until("no alarm", |door| door["alarm"].is_null());
    let mut socket = open(&server);
    assert_eq!(next(&mut socket, "alarms"), json!([]));
    held_open(&server);
    let pushed = next(&mut socket, "alarms");
    let alarm = &pushed[0];
    assert_eq!(
        (&alarm["source"], &alarm["of"], &alarm["name"], &alarm["severity"], &alarm["acknowledged"]),
        (&json!("door"), &json!("front"), &json!("held-open"), &json!("failed"), &Value::Null)
    );
    assert_eq!(alarm["text"], "the leaf does not shut: shut it");
    assert_eq!(next(&mut socket, "frame")["alarms"][0]["id"], alarm["id"]);
    let list = listed(&server);
    assert_eq!((&list["standing"][0]["id"], &list["ended"]), (&alarm["id"], &json!([])));
    assert!(alarm["since_ms"].as_u64().unwrap() <= list["unix_ms"].as_u64().unwrap());
    let (status, answer) = acknowledge(&server, &json!([alarm["id"]]));
    assert_eq!(
        (status, &answer["acknowledged"][0]["acknowledged"]["by"]),
        (200, &json!("anybody")),
        "{answer}"
    );
    assert_eq!(next(&mut socket, "alarms")[0]["acknowledged"]["by"], "anybody");
    let (status, answer) = acknowledge(&server, &json!([alarm["id"]]));
    assert_eq!((status, &answer["acknowledged"]), (200, &json!([])), "the first user stays noted");
    assert_eq!(server.tell("contact", json!({ "contact": "shut" })).0, 200);
    assert_eq!(next(&mut socket, "alarms"), json!([]));
    let ended = &listed(&server)["ended"][0];
    assert!(ended["until_ms"].as_u64() >= ended["since_ms"].as_u64(), "{ended}");
    assert_eq!((&ended["id"], &ended["acknowledged"]["by"]), (&alarm["id"], &json!("anybody")));
    let (status, answer) = acknowledge(&server, &json!([alarm["id"]]));
    assert!(
        status == 409 && answer["error"].as_str().unwrap().contains("door front: held-open) is over"),
        "{answer}"
    );
    assert_eq!(acknowledge(&server, &json!([1])).0, 404);
    for wrong in ["", "{}", "[]", "{\"ids\": [-1]}", "{\"ids\": [1], \"all\": true}"] {
        assert_eq!(server.ask("POST /api/alarms/acknowledge", &[JSON], wrong).0, 400, "{wrong}");
    }
    // The card that has just gone in is shown again: another alarm, not acknowledged.
    assert_eq!(server.tell("card", json!({ "card": "04:A2:2B:77" })).0, 200);
    server.waits_for("alarmed");
    let again = next(&mut socket, "alarms");
    assert_eq!((&again[0]["acknowledged"], again[0]["id"] != alarm["id"]), (&Value::Null, true), "{again}");
}

fn at(unix_ms: u64) -> Now {
    Now { steady_s: unix_ms as f64 * 1e-3, unix_ms }
}

#[test]
fn who_has_acknowledged_is_said_by_name_and_not_everybody_may() {
    let house = House::of(ZONE);
    house.add("ben", Role::View);
    house.add("olga", Role::Operator);
    let alarms = [AlarmLine::new(AlarmKind::Database, "disk full")];
    let standing = house.listed.observe(at(1), active_alarms(&alarms, &[], &[]));
    let body = json!({ "ids": [standing[0].id] }).to_string();
    let as_who = |name: &str| {
        let cookie = house.cookie(name);
        house.ask("POST /api/alarms/acknowledge", &[JSON, ("Cookie", &cookie)], &body)
    };
    assert_eq!(as_who("ben").0, 403);
    let (status, answer) = as_who("olga");
    assert!(status == 200 && answer.contains("\"by\":\"olga (operator)\""), "{answer}");
    let foreign = [JSON, ("Cookie", &house.cookie("olga")), ("Origin", "http://evil.example")];
    assert_eq!(house.ask("POST /api/alarms/acknowledge", &foreign, &body).0, 403, "another site's page");
}

#[test]
fn alarms_are_kept_with_who_has_acknowledged_them() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("home.db");
    let (site, now_ms) = (Arc::new(Site::default()), kehai_tracking::snapshot::unix_ms());
    let mut list = AlarmList::new(1);
    let own = |text: &str| [AlarmLine::new(AlarmKind::Recording, text)];
    {
        let store = Store::open(&file, &site, Keep::USUAL).unwrap();
        let both = [&own("disk full")[..], &[AlarmLine::new(AlarmKind::Thread, "mqtt ended")]].concat();
        let mut changes = list.observe(at(now_ms), active_alarms(&both, &[], &[]));
        let acknowledged = list.acknowledge(&[1], "anna", now_ms + 1).unwrap();
        changes.extend(list.observe(at(now_ms + 2), active_alarms(&own("disk full"), &[], &[])));
        let changed = changes.into_iter().map(|(_, alarm)| alarm).chain(acknowledged);
        // As the tracker tells them, in the order in which they happened.
        let mut changed: Vec<_> = changed.collect();
        changed.sort_by_key(|alarm| (alarm.until_ms, alarm.acknowledged.as_ref().map(|seen| seen.at_ms)));
        changed.into_iter().for_each(|alarm| store.alarm(alarm));
        store.record(Arc::new(Snapshot { unix_ms: now_ms + 3, ..Snapshot::default() }));
    }
    let (before, known_ms) = alarms_before(&file, now_ms + 10);
    let mut kept = [list.standing().to_vec(), list.ended().cloned().collect()].concat();
    kept.sort_by_key(|alarm| alarm.id);
    let mut read = before.clone();
    read.sort_by_key(|alarm| alarm.id);
    assert_eq!((read, known_ms), (kept, now_ms + 3));
    let mut after = AlarmList::new(1);
    after.resume(before, known_ms);
    assert_eq!(after.observe(at(now_ms + 100), active_alarms(&own("disk full"), &[], &[])), []);
    assert_eq!(after.standing()[0].acknowledged.as_ref().unwrap().by, "anna");
    assert_eq!(alarms_before(&folder.path().join("none.db"), now_ms), (vec![], 0));
}

/// Takes requests, answers each with the next status, and passes their bodies on.
fn hook(statuses: &'static [u16]) -> (std::net::SocketAddr, mpsc::Receiver<Value>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let (address, (tell, told)) = (listener.local_addr().unwrap(), mpsc::channel());
    std::thread::spawn(move || {
        for status in statuses {
            let Ok((mut stream, _)) = listener.accept() else { return };
            let mut reader = BufReader::new(stream.try_clone().unwrap());
            let mut length = 0;
            loop {
                let mut line = String::new();
                reader.read_line(&mut line).unwrap();
                if let Some(bytes) = line.to_ascii_lowercase().strip_prefix("content-length:") {
                    length = bytes.trim().parse().unwrap();
                }
                if line.trim().is_empty() {
                    break;
                }
            }
            let mut body = vec![0; length];
            reader.read_exact(&mut body).unwrap();
            let answer = format!("HTTP/1.1 {status} x\r\nContent-Length: 0\r\nConnection: close\r\n\r\n");
            stream.write_all(answer.as_bytes()).unwrap();
            described::as_document("webhook", std::str::from_utf8(&body).unwrap());
            let _ = tell.send(serde_json::from_slice(&body).unwrap());
        }
    });
    (address, told)
}

#[test]
fn a_webhook_is_told_what_becomes_of_alarms_again_if_it_failed_and_holds_up_nobody() {
    let (address, told) = hook(&[500, 204, 200, 200]);
    let (listed, alarms) = (AlarmHandle::default(), TrackerAlarms::default());
    let target = format!("http://{address}/hook").parse().unwrap();
    let webhook = Webhook::start(target, "home".into(), listed.clone(), alarms).unwrap();
    let own = [AlarmLine::new(AlarmKind::Database, "disk full")];
    let standing = listed.observe(at(100), active_alarms(&own, &[], &[]));
    listed.acknowledge(&[standing[0].id], "anna (admin)").unwrap();
    assert_eq!(listed.observe(at(200), []), [], "no client waits for it");
    let next = || told.recv_timeout(door_fixture::PATIENCE).unwrap();
    let raised = next();
    assert_eq!(
        (&raised["event"], &raised["site"], &raised["alarm"]["name"], &raised["alarm"]["since_ms"]),
        (&json!("raised"), &json!("home"), &json!("database"), &json!(100))
    );
    assert_eq!(next(), raised, "after 500, the same again");
    let acknowledged = next();
    assert_eq!(acknowledged["event"], "acknowledged");
    assert_eq!(acknowledged["alarm"]["acknowledged"]["by"], "anna (admin)");
    let ended = next();
    assert_eq!((&ended["event"], &ended["alarm"]["until_ms"]), (&json!("ended"), &json!(200)));
    drop(webhook);
    let _ = listed.observe(at(300), active_alarms(&own, &[], &[]));
    assert_eq!((listed.told().failed, listed.missed()), (0, 0));
}

#[test]
fn alarms_on_the_map_in_a_browser() {
    let Some(mut page) = chromium::start() else { return };
    let server = hurried();
    server.waits_for("idle");
    page.size(1440, 900, 1);
    page.scheme("light");
    page.open(&format!("http://{}/", server.server.address()));
    page.wait("the map is live", "document.querySelector('#link').dataset.state === 'live'");
    page.wait("nothing is wrong", "document.querySelector('#alarms').innerText.includes('nothing is wrong')");
    page.click("#alarm-sound");
    page.wait(
        "sound is on",
        "document.querySelector('#alarm-sound').getAttribute('aria-pressed') === 'true'",
    );
    page.wait("and stays so", "localStorage.getItem('alarm-sound') === 'on'");
    page.value(
        "void (() => { window.tones = 0; const made = AudioContext.prototype.createOscillator; \
         AudioContext.prototype.createOscillator = function () { tones += 1; return made.call(this); }; })()",
    );
    held_open(&server);
    page.wait(
        "it is listed",
        "document.querySelector('.alarm-row')?.innerText.includes('the leaf does not shut')",
    );
    page.wait("the title says so", "document.title.startsWith('(1) ')");
    page.wait(
        "the icon says so",
        "document.querySelector('link[rel=icon]').href.startsWith('data:image/svg+xml')",
    );
    page.wait("it is heard once", "tones === 1");
    page.wait("since", "document.querySelector('.alarm-row time')?.dateTime.length > 10");
    let folder = std::path::PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    page.picture(&folder.join("alarms.png"));
    page.scheme("dark");
    page.picture(&folder.join("alarms-dark.png"));
    page.scheme("light");
    page.fits_a_phone("alarms");
    page.click(".alarm-row button.acknowledge");
    page.wait(
        "it is acknowledged",
        "document.querySelector('.alarm-row')?.innerText.includes('seen by anybody')",
    );
    page.wait("the title is quiet", "document.title.startsWith('kehai')");
    page.wait("the icon, too", "document.querySelector('link[rel=icon]').href.endsWith('/icon.svg')");
    assert_eq!(listed(&server)["standing"][0]["acknowledged"]["by"], "anybody");
    assert_eq!(server.tell("contact", json!({ "contact": "shut" })).0, 200);
    page.wait("it is over", "document.querySelectorAll('#alarms-standing .alarm-row').length === 0");
    page.click("#alarms-ended summary");
    page.wait(
        "it is among the ended",
        "document.querySelector('#alarms-ended .alarm-row')?.innerText.includes('until')",
    );
    page.picture(&folder.join("alarms-ended.png"));
    page.is_accessible("alarms");
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn a_door_on_the_map_and_the_reset_of_its_alarm_in_a_browser() {
    let Some(mut page) = chromium::start() else { return };
    let server = DoorServer::new();
    server.waits_for("idle");
    page.size(1440, 900, 1);
    page.scheme("light");
    page.open(&format!("http://{}/", server.server.address()));
    let door = "document.querySelector('#map [data-door=front]')";
    page.wait("the door is drawn, locked", &format!("{door}?.dataset.state === 'locked'"));
    page.wait("and named", &format!("{door}.getAttribute('aria-label') === 'Door front: locked'"));
    // A passage, with a link to its replay.
    server.lets_one_in();
    page.wait("it is open on the map", &format!("{door}.dataset.lock === 'unlocked'"));
    server.goes_through();
    assert_eq!(server.tell("contact", json!({ "contact": "shut" })).0, 200);
    server.waits_for("idle");
    // The card that has just gone in is shown again.
    assert_eq!(server.tell("card", json!({ "card": "04:A2:2B:77" })).0, 200);
    server.waits_for("alarmed");
    page.wait("it is in alarm", &format!("{door}.dataset.state === 'alarm'"));
    page.wait("which is listed", "document.querySelector('#alarms').innerText.includes('was shown again')");
    page.click(".alarm-of");
    page.wait("its card is open", "document.querySelector('#door-card h2')?.innerText === 'Door front'");
    let card = "document.querySelector('#door-card').innerText";
    page.wait(
        "it says how it is",
        &format!("/doing\\s+in alarm/.test({card}) && /leaf\\s+shut/.test({card})"),
    );
    let folder = std::path::PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    page.picture(&folder.join("door-card.png"));
    page.scheme("dark");
    page.picture(&folder.join("door-card-dark.png"));
    page.scheme("light");
    page.fits_a_phone("door card");
    page.click("#door-card .reset");
    server.waits_for("idle");
    page.wait("the map says so", &format!("{door}.dataset.state === 'locked'"));
    page.wait("there is nothing to reset", "document.querySelector('#door-card .reset').hidden");
    let passage = "[...document.querySelectorAll('#door-card .events a')].find((one) => one.innerText.includes('1 of 1 went in'))";
    page.wait("the passage is in its card", &format!("{passage} !== undefined"));
    page.wait("with a link to its time", &format!("/#at=\\d+$/.test({passage}.href)"));
    page.key("Escape", 27);
    page.wait("the card is closed", "document.querySelector('#door-card').hidden");
    assert_eq!(page.errors, Vec::<String>::new());
}

fn open(server: &DoorServer) -> WebSocket<TcpStream> {
    let address = server.server.address();
    let stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(door_fixture::PATIENCE)).unwrap();
    tungstenite::client(format!("ws://{address}/ws"), stream).unwrap().0
}
