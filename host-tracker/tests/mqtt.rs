//! The publisher and a real broker: mosquitto, which goes away and comes back.
//!
//! Without mosquitto these tests are left out with a message; under CI they fail.
#![allow(missing_docs, reason = "a test program")]
#![cfg(unix)]

mod broker;
mod described;
mod door_fixture;
mod http_client;

use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use broker::{Broker, Frames, Listener, OLD, PATIENCE, SITE, frame, mosquitto, settings};
use host_tracker::certificate::Certificate;
use host_tracker::mqtt::trust::{self, TrustFiles};
use host_tracker::mqtt::{Buttons, Publisher, Settings};
use kehai_emulator::ports::free_tcp;
use kehai_tracking::jsonl::ZoneKnown;
use rumqttc::QoS;
use tracing::Level;

/// A broker that speaks TLS alone, and knows its clients by certificates.
#[test]
fn an_encrypted_broker_is_trusted_by_its_certificate_and_no_other_is() {
    let Some(program) = mosquitto() else { return };
    let folder = tempfile::tempdir().unwrap();
    let made = |name: &str| {
        let site = folder.path().join(name).with_extension("toml");
        let names = ["localhost".to_owned(), "127.0.0.1".to_owned()];
        let certificate = Certificate::own(&site, &names).unwrap().file().to_path_buf();
        let key = site.with_extension("key.pem");
        (certificate, key)
    };
    let (theirs, ours, foreign) = (made("broker"), made("tracker"), made("foreign"));
    let port = free_tcp().unwrap();
    // Started by root it stays so: the keys are for their owner alone.
    let more = format!(
        "allow_anonymous true\nuser root\nlistener {port} 127.0.0.1\ncertfile {}\nkeyfile {}\ncafile {}\n\
         require_certificate true\n",
        theirs.0.display(),
        theirs.1.display(),
        ours.0.display()
    );
    let broker = Broker::with(&program, &more);
    let trusting = |authority: &Path, own: &(PathBuf, PathBuf)| {
        let files = TrustFiles { authorities: Some(authority.to_owned()), own: Some(own.clone()) };
        Some(trust::config(&files).unwrap())
    };
    let publish = |trust| {
        let (frames, queue) = Frames::new(frame());
        let (tell, said) = mpsc::channel();
        let broker = format!("mqtts://127.0.0.1:{port}").parse().unwrap();
        let settings = Settings { broker, trust, ..settings(0) };
        let say = move |_: Level, text: &str| drop(tell.send(text.to_owned()));
        (Publisher::start(settings, queue, None, say).unwrap(), frames, said)
    };
    let mut listener = Listener::new(broker.port);
    let (publisher, _frames, _) = publish(trusting(&theirs.0, &ours));
    listener.hears("kehai/door/status", |payload| payload == "online");
    drop(publisher);
    listener.hears("kehai/door/status", |payload| payload == "offline");
    let refused = |trust| {
        let (_publisher, _frames, said) = publish(trust);
        said.recv_timeout(PATIENCE).unwrap()
    };
    let said = refused(trusting(&foreign.0, &ours));
    assert!(said.contains("trying again") && said.contains("certificate"), "another broker: {said}");
    let said = refused(trusting(&theirs.0, &foreign));
    assert!(said.contains("trying again"), "another tracker: {said}");
    assert_eq!(listener.known["kehai/door/status"], "offline");
}

#[test]
fn a_door_is_told_and_tells_and_an_old_order_is_not_kept() {
    let Some(program) = mosquitto() else { return };
    let broker = Broker::start(&program);
    let mut listener = Listener::new(broker.port);
    let server = door_fixture::DoorServer::new();
    let doors = &server.doors;
    let settings =
        Settings { doors: Some(doors.clone()), signs: Some(server.signs.clone()), ..settings(broker.port) };
    let (told, frames) = (Some(doors.listen()), server.frames());
    let publisher = Publisher::start(settings, frames, told, |_, _| {}).unwrap();
    const DOOR: &str = "kehai/door/door/front";
    listener.hears(DOOR, |payload| payload.contains("\"phase\":\"idle\""));
    listener.hears(&format!("{DOOR}/lock"), |payload| payload.contains("\"lock\":\"locked\""));
    server.people(&[[0.0, 0.4]]);
    let tell = |input: &str, payload: String| {
        listener.client.publish(format!("{DOOR}/{input}"), QoS::AtLeastOnce, false, payload).unwrap();
    };
    assert_eq!(server.tell("contact", serde_json::json!({ "contact": "shut" })).0, 200);
    tell("card", "card".into());
    let card = server.message(serde_json::json!({ "card": "04:A2" }));
    tell("card", card.clone());
    tell("card", card);
    listener.hears(&format!("{DOOR}/refused"), |payload| payload.contains("repeated: "));
    let refused =
        |(topic, payload): &(String, String)| topic.ends_with("refused") && payload.contains("malformed: ");
    assert!(listener.all.iter().any(refused), "{:?}", listener.all);
    listener.hears(DOOR, |payload| payload.contains("\"phase\":\"asked\"") && !payload.contains("04:A2"));
    let contact = |id: u64, ago_ms: u64, contact: &str| {
        let at_ms = kehai_tracking::snapshot::unix_ms() - ago_ms;
        let payload = serde_json::json!({ "id": id, "at_ms": at_ms, "contact": contact }).to_string();
        listener.client.publish(format!("{DOOR}/contact"), QoS::AtLeastOnce, false, payload).unwrap();
    };
    contact(9, 0, "shut");
    contact(8, 0, "open");
    contact(10, 60_000, "open");
    for why in ["out of order: ", "late: "] {
        listener.hears(&format!("{DOOR}/refused"), |payload| payload.contains(why));
    }
    assert_eq!(server.door()["contact"], "shut", "what is refused changes nothing");
    let number = server.message(serde_json::json!({ "number": 1 }));
    listener.client.publish(format!("{DOOR}/number"), QoS::AtLeastOnce, false, number).unwrap();
    listener.hears(&format!("{DOOR}/lock"), |payload| payload.contains("\"lock\":\"unlocked\""));
    // A client that comes later hears no order that was given before.
    drop(server);
    drop(publisher);
    let mut late = Listener::new(broker.port);
    late.hears(STATUS, |payload| payload == "offline");
    assert!(late.all.iter().all(|(topic, _)| !topic.ends_with("/lock")), "{:?}", late.all);
}

#[test]
fn a_way_out_that_the_broker_keeps_opens_no_door() {
    let Some(program) = mosquitto() else { return };
    let broker = Broker::start(&program);
    let mut listener = Listener::new(broker.port);
    const DOOR: &str = "kehai/door/door/front";
    let (exit, lock) = (format!("{DOOR}/exit"), format!("{DOOR}/lock"));
    let button = listener.client.clone();
    let press = |retain: bool| button.publish(&*exit, QoS::AtLeastOnce, retain, OLD).unwrap();
    press(true);
    listener.hears(&exit, |payload| payload == OLD);

    let server = door_fixture::DoorServer::new();
    let doors = &server.doors;
    let (tell, said) = mpsc::channel();
    let say = move |level: Level, text: &str| drop(tell.send((level, text.to_owned())));
    let settings = Settings { doors: Some(doors.clone()), ..settings(broker.port) };
    let publisher = Publisher::start(settings, server.frames(), Some(doors.listen()), say).unwrap();
    let kept = said.iter().find(|(level, _)| *level == Level::WARN).unwrap().1;
    assert!(kept.contains(&exit) && kept.contains("retain"), "{kept}");
    // What it would have published to the topic has come back by the time a later message is answered.
    listener.hears(STATUS, |payload| payload == "online");
    listener.client.publish(format!("{DOOR}/card"), QoS::AtLeastOnce, false, "wrong").unwrap();
    listener.hears(&format!("{DOOR}/refused"), |payload| payload.contains("malformed: "));
    (0..2).for_each(|_| drop(listener.next(&lock)));
    let is_locked = |payload: &str| payload.contains("\"lock\":\"locked\"");
    assert!(listener.all.iter().all(|(topic, payload)| *topic != lock || is_locked(payload)));
    assert_eq!(listener.known[&exit], OLD, "it is left to its sender");
    press(false);
    listener.hears(&lock, |payload| payload.contains("\"lock\":\"exit\""));
    drop(publisher);
}

#[test]
fn nothing_wrong_that_is_published_is_taken() {
    let Some(program) = mosquitto() else { return };
    let broker = Broker::start(&program);
    let mut listener = Listener::new(broker.port);
    let server = door_fixture::DoorServer::new();
    let doors = &server.doors;
    let settings =
        Settings { doors: Some(doors.clone()), signs: Some(server.signs.clone()), ..settings(broker.port) };
    let publisher = Publisher::start(settings, server.frames(), Some(doors.listen()), |_, _| {}).unwrap();
    const DOOR: &str = "kehai/door/door/front";
    // The publisher has subscribed by the time it publishes.
    listener.hears(DOOR, |payload| payload.contains("\"phase\":\"idle\""));
    let client = listener.client.clone();
    let publish = |input: &str, body: &str| {
        client.publish(format!("{DOOR}/{input}"), QoS::AtLeastOnce, false, body).unwrap();
    };
    door_fixture::wrong::changes_nothing(&server, publish, |input, body| {
        publish(input, body);
        let refused = listener.next(&format!("{DOOR}/refused"));
        let refused: serde_json::Value = serde_json::from_str(&refused).unwrap();
        refused["why"].as_str().unwrap().to_owned()
    });
    drop(publisher);
}

#[test]
fn a_sign_names_its_track_and_what_is_wrong_is_answered() {
    let Some(program) = mosquitto() else { return };
    let broker = Broker::start(&program);
    let mut listener = Listener::new(broker.port);
    let server = door_fixture::DoorServer::new();
    server.people(&[[0.0, 0.4]]);
    let settings_of = |server: &door_fixture::DoorServer| Settings {
        signs: Some(server.signs.clone()),
        ..settings(broker.port)
    };
    let publisher = Publisher::start(settings_of(&server), server.frames(), None, |_, _| {}).unwrap();
    listener.hears(STATUS, |payload| payload == "online");
    const SIGN: &str = "kehai/door/sign";
    let client = listener.client.clone();
    let publish = |retained: bool, body: &str| {
        client.publish(SIGN, QoS::AtLeastOnce, retained, body).unwrap();
    };
    publish(false, "{\"id\":\"04:A2\",\"x\":1e9,\"y\":0}");
    listener.hears(&format!("{SIGN}/refused"), |payload| payload.contains("no place: 1000000000"));
    for (body, why) in [
        ("{\"id\":\"04:A2\",\"x\":NaN,\"y\":0}", "malformed: "),
        ("{\"id\":\"04:A2\",\"x\":100,\"y\":-2500}", "m beside the site"),
        ("{\"id\":\"04:A2\",\"at_ms\":0}", "late: it was read "),
        ("{\"id\":\"04:A2\",\"at_ms\":18446744073709551615}", "s ahead of this machine"),
    ] {
        publish(false, body);
        listener.hears(&format!("{SIGN}/refused"), |payload| payload.contains(why));
    }
    assert_eq!(server.signs.where_is("04:A2").unwrap(), None, "what is refused names no person");
    publish(false, "{\"id\":\"04:A2\",\"x\":0.1,\"y\":0.4}");
    let begin = Instant::now();
    let label = loop {
        if let Some(there) = server.signs.where_is("04:A2").unwrap() {
            break there.name.label;
        }
        assert!(begin.elapsed() < PATIENCE, "the sign is not taken: {:#?}", listener.known);
        std::thread::sleep(Duration::from_millis(20));
    };
    let name = format!("kehai/door/name/{label}");
    listener.hears(&name, |payload| payload.contains("\"track\":1") && payload.contains("[\"area\"]"));
    assert!(listener.all.iter().all(|(topic, payload)| topic == SIGN || !payload.contains("04:A2")));
    // What a broker kept is of no time that is known.
    drop(publisher);
    listener.hears(STATUS, |payload| payload == "offline");
    publish(true, "{\"id\":\"old\",\"x\":0.1,\"y\":0.4}");
    listener.hears(SIGN, |payload| payload.contains("old"));
    let publisher = Publisher::start(settings_of(&server), server.frames(), None, |_, _| {}).unwrap();
    listener.hears(STATUS, |payload| payload == "online");
    publish(false, "wrong");
    assert!(listener.next(&format!("{SIGN}/refused")).contains("malformed: "));
    assert_eq!(server.signs.where_is("old").unwrap(), None);
    assert!(listener.all.iter().all(|(topic, payload)| topic != SIGN || !payload.is_empty()));
    drop(publisher);
}

const ZONE: &str = "kehai/door/zone/hall";
const STATUS: &str = "kehai/door/status";

#[test]
fn states_are_told_again_to_a_broker_that_was_away_and_nothing_stale() {
    let Some(program) = mosquitto() else { return };
    let mut broker = Broker::start(&program);
    // A zone was removed while no tracker ran; topics of another site must stay.
    let mut listener = Listener::new(broker.port);
    let keep = |topic: &str| listener.client.publish(topic, QoS::AtLeastOnce, true, OLD).unwrap();
    keep("kehai/door/zone/cellar");
    keep("kehai/other/zone/cellar");
    keep("homeassistant/device/kehai_door_right/config");
    listener.hears("homeassistant/device/kehai_door_right/config", |payload| payload == OLD);

    let (frames, queue) = Frames::new(frame());
    frames.zone(2, ZoneKnown::Known);
    let (tell, said) = mpsc::channel();
    let say = move |level: Level, text: &str| drop(tell.send((level, text.to_owned())));
    let publisher = Publisher::start(settings(broker.port), queue, None, say).unwrap();
    listener.hears(ZONE, |payload| payload.contains("\"count\":2"));
    listener.hears(STATUS, |payload| payload == "online");
    listener.hears("homeassistant/device/kehai_door/config", |payload| payload.contains("zone_hall_count"));
    listener.hears("homeassistant/device/kehai_door_left/config", |payload| payload.contains("problem"));
    listener.hears("kehai/door/module/left/availability", |payload| payload == "online");
    listener.hears("kehai/door/zone/cellar", str::is_empty);
    listener.hears("homeassistant/device/kehai_door_right/config", str::is_empty);
    frames.zone(5, ZoneKnown::Unknown);
    listener.hears(ZONE, |payload| payload.contains("\"count\":null"));
    listener.hears(&format!("{ZONE}/availability"), |payload| payload == "offline");
    assert_eq!(listener.known["kehai/other/zone/cellar"], OLD);

    broker.go();
    for count in [7, 8, 9, 3] {
        frames.zone(count, ZoneKnown::Known);
        std::thread::sleep(Duration::from_millis(300));
    }
    broker.come();
    let mut listener = Listener::new(broker.port);
    listener.hears(ZONE, |payload| payload.contains("\"count\":3"));
    listener.hears(&format!("{ZONE}/availability"), |payload| payload == "online");
    listener.hears("homeassistant/device/kehai_door/config", |payload| payload.contains("zone_hall_count"));
    listener.hears(STATUS, |payload| payload == "online");
    let counts: Vec<&String> =
        listener.all.iter().filter(|(topic, _)| topic == ZONE).map(|(_, payload)| payload).collect();
    assert!(counts.iter().all(|payload| payload.contains("\"count\":3")), "{counts:?}");
    let said: Vec<(Level, String)> = said.try_iter().collect();
    let of_broker = format!("mqtt: broker 127.0.0.1:{}: ", broker.port);
    assert!(said.iter().all(|(_, text)| text.starts_with(&of_broker)), "{said:?}");
    let levels: Vec<Level> = said.iter().map(|(level, _)| *level).collect();
    assert!(levels.first() == Some(&Level::WARN) && !levels[1..].contains(&Level::WARN), "{said:?}");
    assert_eq!(said.last(), Some(&(Level::INFO, format!("{of_broker}connected"))), "{said:?}");

    drop(publisher);
    listener.hears(STATUS, |payload| payload == "offline");
}

#[test]
fn home_assistant_is_told_of_the_site_its_limits_its_doors_and_where_the_map_is() {
    let Some(program) = mosquitto() else { return };
    let broker = Broker::start(&program);
    let mut listener = Listener::new(broker.port);
    let server = door_fixture::DoorServer::new();
    server.people(&[[0.0, 0.4]]);
    let text = door_fixture::SITE.replace("[[zone]]", "[[zone]]\npeople_max = 3");
    let site = Arc::new(kehai_tracking::site::Site::parse("site", &text).unwrap());
    let (changed, site) = tokio::sync::watch::channel(site);
    let map_url = Some("https://hall.local:8420/".to_owned());
    let settings = Settings { site, map_url, ..settings(broker.port) };
    let publisher = Publisher::start(settings, server.frames(), None, |_, _| {}).unwrap();
    const SITE: &str = "homeassistant/device/kehai_door/config";
    listener.hears(SITE, |payload| payload.contains("zone_area_crowded") && payload.contains("total_count"));
    assert!(listener.known[SITE].contains("\"configuration_url\":\"https://hall.local:8420/\""));
    listener.hears("homeassistant/device/kehai_door_door_front/config", |payload| {
        payload.contains("\"suggested_area\":\"area\"") && payload.contains("kehai_door_door_front_phase")
    });
    listener.hears("kehai/door/tracker", |payload| payload.contains("\"alarms\":[]"));
    listener.hears("kehai/door/total", |payload| payload.contains("\"state\":"));
    // The limit goes from the site.
    changed.send_replace(Arc::new(kehai_tracking::site::Site::parse("site", door_fixture::SITE).unwrap()));
    listener.hears(SITE, |payload| !payload.contains("zone_area_crowded"));
    drop(publisher);
    let commands = listener.all.iter().filter(|(_, payload)| payload.contains("command_topic"));
    assert_eq!(commands.count(), 0, "nothing that opens a door");
}

#[test]
fn of_a_tracker_that_is_killed_the_broker_says_that_it_is_gone() {
    let Some(program) = mosquitto() else { return };
    let broker = Broker::start(&program);
    let site = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("door-{}.toml", std::process::id()));
    let text = "[[module]]\nname = \"left\"\nx = 0.0\ny = 0.0\n\n[[zone]]\nname = \"hall\"\npolygon = [[0, 0], [1, 0], [1, 1]]\n";
    std::fs::write(&site, text).unwrap();
    let mut tracker = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"))
        .args(["run", "--no-mdns", "--module", "127.0.0.1:9", "--mqtt-site", "door", "--site"])
        .arg(&site)
        .env("KEHAI_MQTT", format!("mqtt://127.0.0.1:{}", broker.port))
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut listener = Listener::new(broker.port);
    listener.hears(STATUS, |payload| payload == "online");
    listener
        .hears(ZONE, |payload| payload == r#"{"alarms":[],"count":null,"occupied":null,"state":"unknown"}"#);
    listener.hears("kehai/door/module/left", |payload| payload.contains("it has not been found"));
    tracker.kill().unwrap();
    tracker.wait().unwrap();
    listener.hears(STATUS, |payload| payload == "offline");
    // A client that comes later hears the same.
    Listener::new(broker.port).hears(STATUS, |payload| payload == "offline");
    let _ = std::fs::remove_file(site);
}

/// A module that hears and does not answer, and a tracker whose site it is of, with or without buttons.
struct Beside {
    module: UdpSocket,
    _frames: Frames,
    _site: tokio::sync::watch::Sender<Arc<kehai_tracking::site::Site>>,
    publisher: Publisher,
}

impl Beside {
    fn start(port: u16, site: &str, buttons: Option<Buttons>) -> Self {
        let module = UdpSocket::bind("127.0.0.1:0").unwrap();
        let mut frame = frame();
        frame.modules[0].address = module.local_addr().unwrap().to_string();
        let site = Arc::new(kehai_tracking::site::Site::parse("site", site).unwrap());
        let (changes, site) = tokio::sync::watch::channel(site);
        let (frames, queue) = Frames::new(frame);
        let settings = Settings { site, buttons, ..settings(port) };
        let publisher = Publisher::start(settings, queue, None, |_, _| {}).unwrap();
        Self { module, _frames: frames, _site: changes, publisher }
    }

    /// Ends the tracker: whether anybody has asked the module.
    fn end(self) -> bool {
        drop(self.publisher);
        self.module.set_nonblocking(true).unwrap();
        self.module.recv(&mut [0; 2048]).is_ok()
    }
}

const LEFT: &str = "kehai/door/module/left";
const LEFT_CONFIG: &str = "homeassistant/device/kehai_door_left/config";

/// Publishes there, as Home Assistant does when a button is pressed.
fn press(listener: &Listener, button: &str, payload: &str, retain: bool) {
    listener.client.try_publish(format!("{LEFT}/{button}"), QoS::AtLeastOnce, retain, payload).unwrap();
}

#[test]
fn a_press_at_the_broker_reaches_its_module_only_if_run_was_told_so() {
    let Some(program) = mosquitto() else { return };
    let broker = Broker::start(&program);
    let mut listener = Listener::new(broker.port);
    let refused = format!("{LEFT}/refused");

    // Without the option there is no button, and a press is nothing: what comes after it has been heard.
    let beside = Beside::start(broker.port, SITE, None);
    listener.hears(LEFT_CONFIG, |payload| !payload.contains("command_topic"));
    listener.hears(STATUS, |payload| payload == "online");
    press(&listener, "learn", "PRESS", false);
    listener.hears(&format!("{LEFT}/learn"), |payload| payload == "PRESS");
    assert!(!beside.end(), "it was not asked");
    listener.hears(STATUS, |payload| payload == "offline");
    assert!(!listener.known.contains_key(&refused));

    let buttons = Some(Buttons { keys: None });
    let beside = Beside::start(broker.port, SITE, buttons.clone());
    let module = &beside.module;
    module.set_read_timeout(Some(PATIENCE)).unwrap();
    let topic = |button: &str| format!("\"command_topic\":\"{LEFT}/{button}\"");
    listener.hears(LEFT_CONFIG, |payload| {
        ["learn", "restart", "identify"].iter().all(|button| payload.contains(&topic(button)))
    });
    listener.hears(STATUS, |payload| payload == "online");
    // What is no press is refused, in words, and so is one that its module does not answer.
    press(&listener, "restart", "now", false);
    listener.hears(&refused, |payload| payload.contains("a button says PRESS"));
    press(&listener, "identify", "PRESS", false);
    assert!(module.recv(&mut [0; 2048]).unwrap() > 0, "it is asked");
    listener.hears(&refused, |payload| payload.contains(&module.local_addr().unwrap().to_string()));
    drop(beside);
    listener.hears(STATUS, |payload| payload == "offline");

    // On a site with a door it only blinks, and an old press that the broker kept is none.
    let identify = format!("{LEFT}/identify");
    listener.known.remove(&identify);
    press(&listener, "identify", "PRESS", true);
    // The broker has it before the tracker comes, or it were a new one.
    listener.hears(&identify, |payload| payload == "PRESS");
    let beside = Beside::start(broker.port, door_fixture::SITE, buttons);
    listener.hears(LEFT_CONFIG, |payload| {
        payload.contains(&topic("identify")) && !payload.contains(&topic("learn"))
    });
    listener.hears(STATUS, |payload| payload == "online");
    press(&listener, "learn", "PRESS", false);
    listener.hears(&refused, |payload| payload.contains("on a site with a door"));
    assert!(!beside.end(), "it was not asked");
}
