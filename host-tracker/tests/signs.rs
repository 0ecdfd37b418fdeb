//! Cards and tags over HTTP: which track is whom, where an ID is, what is refused; and the map that asks for one.

mod chromium;
mod described;
mod door_fixture;
mod http_client;

use std::time::{Duration, Instant};

use door_fixture::{DoorServer, PATIENCE};
use host_tracker::store::{Keep, Store};
use kehai_tracking::card::Card;
use kehai_tracking::names::{Likelihood, NameLine};
use kehai_tracking::snapshot::{Snapshot, unix_ms};
use serde_json::{Value, json};

const SIGN: &str = "POST /api/sign";

fn hall() -> DoorServer {
    let reader = "\n[[reader]]\nname = \"gate\"\nx = 0.0\ny = 0.5\nreach_m = 0.6\n";
    DoorServer::of(&format!("{}{reader}", door_fixture::SITE))
}

fn sign(server: &DoorServer, body: Value) -> (u16, Value) {
    server.ask(SIGN, &[], &body.to_string())
}

fn state(server: &DoorServer) -> Value {
    server.ask("GET /api/state", &[], "").1
}

/// Until the newest frame is so.
#[track_caller]
fn waits(server: &DoorServer, what: &str, is_so: impl Fn(&Value) -> bool) -> Value {
    let begun = Instant::now();
    loop {
        let state = state(server);
        if is_so(&state) {
            return state;
        }
        assert!(begun.elapsed() < PATIENCE, "{what} does not come: {state:#}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_tag_names_the_track_at_its_place_and_moves_none() {
    let server = hall();
    server.people(&[[0.0, 0.4], [0.0, -2.5]]);
    let before = state(&server);
    assert_eq!((&before["names"], &before["signs"]["taken"]), (&Value::Null, &json!(0)));
    assert_eq!(sign(&server, json!({ "id": "04:A2:2B", "reader": "gate" })), (200, json!({})));
    assert_eq!(sign(&server, json!({ "id": "tag 7", "x": 0.1, "y": -2.4, "sigma_m": 0.2 })).0, 200);
    let named =
        waits(&server, "two names", |state| state["names"].as_array().is_some_and(|names| names.len() == 2));
    assert_eq!(named["tracks"], before["tracks"], "a sign moves no track");
    let text = named.to_string();
    assert!(!text.contains("04:A2") && !text.contains("tag 7"), "no ID is told: {text}");
    let whole: Vec<usize> =
        named["names"].as_array().unwrap().iter().map(|name| name["label"].as_str().unwrap().len()).collect();
    assert_eq!(whole, [8, 8], "{named:#}");

    let there = |id: &str| server.ask(&format!("GET /api/where?id={id}"), &[], "");
    let (status, card) = there("04%3Aa2%3A2b");
    assert_eq!(
        (status, &card["tracks"][0]["track"], &card["zones"]),
        (200, &json!(1), &json!(["area"])),
        "{card:#}"
    );
    assert_eq!(card["at"], json!([0.0, 0.4]));
    assert!(card["tracks"][0]["probability"].as_f64().unwrap() > 0.8, "{card:#}");
    let (_, tag) = there("tag%207");
    assert_eq!((&tag["tracks"][0]["track"], &tag["read"]), (&json!(2), &json!([0.1, -2.4])), "{tag:#}");
    assert_eq!(there("other").0, 404);
    assert_eq!(there("").0, 400);
    assert_eq!(there("1&name=2").0, 400);
}

#[test]
fn what_is_wrong_or_foreign_changes_nothing_says_why_and_is_counted() {
    let server = hall();
    server.people(&[[0.0, 0.4]]);
    let refused = |headers: &[(&str, &str)], body: &str, wanted: u16, word: &str| {
        let (status, answer) = server.ask(SIGN, headers, body);
        let why = answer["error"].as_str().unwrap_or_default();
        assert!(status == wanted && why.contains(word), "{body}: {status} {answer}");
    };
    refused(&[], "tag", 400, "malformed: ");
    refused(&[], r#"{"id":"a","x":NaN,"y":0}"#, 400, "malformed: ");
    refused(&[], r#"{"id":"a","x":1e12,"y":0}"#, 400, "no place: 1000000000000 is no place");
    refused(&[], r#"{"id":"a","x":0,"y":0,"sigma_m":1e9}"#, 400, "no place: its spread");
    refused(&[], r#"{"id":"a","reader":"attic"}"#, 404, "there is no reader \"attic\"");
    refused(&[], &json!({ "id": "a", "at_ms": unix_ms() - 60_000 }).to_string(), 409, "late: ");
    refused(
        &[],
        &json!({ "id": "a", "at_ms": unix_ms() + 60_000 }).to_string(),
        409,
        "ahead of this machine",
    );
    refused(&[], &format!("{{\"id\":\"{}\"}}", "a".repeat(2000)), 400, "too long");
    refused(&[("Origin", "http://evil.example")], r#"{"id":"a"}"#, 403, "evil.example");
    let counted = waits(&server, "the counts", |state| state["signs"]["late"] == 2);
    assert_eq!(counted["names"], Value::Null);
    let counts =
        ["taken", "malformed", "no_reader", "no_place"].map(|key| counted["signs"][key].as_u64().unwrap());
    assert_eq!(counts, [0, 2, 1, 2], "{counted:#}");
    let (_, metrics) = http_client::ask(server.server.address(), "GET /metrics", &[], b"");
    assert!(metrics.contains("kehai_signs_total{outcome=\"no_place\"} 2"), "{metrics}");
}

/// Other units, other clocks, no numbers, and places that are nowhere near: each is refused in one line that says why, and
/// counted; tracks and names stay as they are.
#[test]
fn absurd_places_and_times_are_refused_in_one_line_and_move_no_track() {
    let server = hall();
    server.people(&[[0.0, 0.4], [0.0, -2.5]]);
    assert_eq!(sign(&server, json!({ "id": "a", "x": 0.0, "y": 0.4 })).0, 200);
    let named = |state: &Value| state["names"][0]["tracks"].as_array().is_some_and(|all| !all.is_empty());
    let before = waits(&server, "a name", named);
    let now_ms = unix_ms();
    let at = |at_ms: u64| format!("{{\"id\":\"a\",\"at_ms\":{at_ms}}}");
    let place = |numbers: &str| format!("{{\"id\":\"a\",{numbers}}}");
    let absurd = [
        (place(r#""x":Infinity,"y":0"#), 400, "malformed: "),
        (place(r#""x":1e999,"y":0"#), 400, "malformed: number out of range"),
        (place(r#""x":"0.1 m","y":0"#), 400, "malformed: invalid type: string"),
        (place(r#""x":0,"y":-1e9"#), 400, "no place: -1000000000 is no place"),
        // Millimetres, and centimetres of a large hall; degrees of latitude and longitude.
        (place(r#""x":100,"y":-2500"#), 400, "m beside the site, at most 100: x and y are metres"),
        (place(r#""x":0,"y":310"#), 400, "is 309 m beside the site"),
        (place(r#""x":135.52,"y":34.82"#), 400, "beside the site"),
        (place(r#""x":0,"y":0.4,"sigma_m":-0.3"#), 400, "no place: its spread"),
        (at(0), 409, "late: it was read "),
        // s and µs since 1970.
        (at(now_ms / 1000), 409, "late: it was read "),
        (at(now_ms * 1000), 409, "s ahead of this machine"),
        (at(u64::MAX), 409, "s ahead of this machine"),
        (place(r#""at_ms":-5"#), 400, "malformed: "),
        (place(r#""at_ms":1e300"#), 400, "malformed: "),
    ];
    for (body, wanted, word) in &absurd {
        let (status, answer) = server.ask(SIGN, &[], body);
        let why = answer["error"].as_str().unwrap_or_default();
        assert!(status == *wanted && why.contains(word) && !why.contains('\n'), "{body}: {status} {answer}");
    }
    let after = waits(&server, "the counts", |state| state["signs"]["late"] == 4);
    let counts = ["taken", "malformed", "no_place"].map(|key| after["signs"][key].as_u64().unwrap());
    assert_eq!(counts, [1, 5, 5], "{after:#}");
    assert_eq!(after["tracks"], before["tracks"], "a sign moves no track");
    assert_eq!(after["names"][0]["tracks"][0]["track"], before["names"][0]["tracks"][0]["track"]);
}

#[test]
fn names_are_kept_by_hash_and_for_as_long_as_cards() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("names.db");
    let keep = Keep { days: 365, card_days: 7 };
    let frame = |days_ago: u64, card: u128, track: u64| {
        let tracks = vec![Likelihood { track, probability: 0.9 }];
        let name = NameLine {
            card: Some(Card(card)),
            label: "00000000".into(),
            heard_s: 0.0,
            read_s: Some(0.0),
            tracks,
            zones: vec![],
        };
        Snapshot { unix_ms: unix_ms() - days_ago * 86_400_000, names: vec![name], ..Snapshot::default() }
    };
    let site = std::sync::Arc::default();
    let store = Store::open(&file, &site, keep).unwrap();
    store.see_waiting(std::sync::Arc::new(frame(8, 0x51d, 3)));
    store.see_waiting(std::sync::Arc::new(frame(6, 0xa11ce, 4)));
    drop(store);
    let kept = || -> Vec<(u64, Vec<u8>)> {
        let database = rusqlite::Connection::open(&file).unwrap();
        // A row of at most 0.5 says that the name has ended.
        let names = "SELECT track, hash FROM name WHERE probability > 0.5 ORDER BY at_ms";
        let mut asked = database.prepare(names).unwrap();
        let rows = asked.query_map([], |row| Ok((row.get(0)?, row.get(1)?))).unwrap();
        rows.map(Result::unwrap).collect()
    };
    let store = Store::open(&file, &site, keep).unwrap();
    let begun = Instant::now();
    // Deleting what is too old comes after the first batch.
    while kept().len() != 1 {
        assert!(begun.elapsed() < PATIENCE, "{:?}", kept());
        std::thread::sleep(Duration::from_millis(20));
    }
    drop(store);
    assert_eq!(kept(), [(4, 0xa11ce_u128.to_be_bytes().to_vec())]);
}

#[test]
fn the_map_shows_names_and_answers_where_a_person_is() {
    let Some(mut page) = chromium::start() else { return };
    let server = hall();
    server.people(&[[0.0, 0.4], [0.0, -2.5]]);
    page.size(1280, 800, 1);
    page.open(&format!("http://{}/", server.server.address()));
    page.wait("two people", "document.querySelectorAll('#map .person.confirmed').length === 2");
    page.wait("the question is there", "!document.querySelector('#where').hidden");
    sign(&server, json!({ "id": "04:A2", "reader": "gate" }));
    let first = "document.querySelector('[data-person=\"1\"] text').textContent";
    page.wait("a part of its hash is beside its track", &format!("/^ID [0-9a-f]{{8}} \\d+%$/.test({first})"));
    let ask = |page: &mut chromium::Page, id: &str| {
        page.value("document.querySelector('#where-id').focus()");
        page.value("document.querySelector('#where-id').select()");
        page.write(id);
        page.click("#where button");
    };
    ask(&mut page, "04a2");
    let answer = "document.querySelector('#where-answer').textContent";
    page.wait("where it is", &format!("/^\\d+% person 1, in area; read /.test({answer})"));
    page.wait(
        "the person is chosen",
        "document.querySelector('[data-person=\"1\"]').classList.contains('chosen')",
    );
    page.wait("by the name the visitor gave", &format!("/1 · 04a2 \\d+%/.test({first})"));
    page.fits_a_phone("where is");
    ask(&mut page, "unread");
    page.wait("what was never read", &format!("{answer}.includes('was not read')"));
    assert_eq!(page.errors.iter().filter(|error| !error.contains("404")).count(), 0, "{:?}", page.errors);
}
