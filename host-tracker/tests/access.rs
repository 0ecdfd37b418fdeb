//! Who may do what over HTTP: log-in and its limits, sessions and their ends, tokens, and every role at every request.

mod described;
mod door_fixture;
mod house;
mod http_client;

use std::cell::Cell;
use std::net::TcpStream;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use door_fixture::DoorServer;
use host_tracker::access::directory::Token;
use host_tracker::access::file::AccessFile;
use host_tracker::access::roles::Role;
use host_tracker::access::{Access, secret};
use house::{DOORS, House, PASSWORD, S, ZONE};
use kehai_tracking::door::inbox::Input;
use kehai_tracking::snapshot::{Snapshot, unix_ms};
use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

/// A hundred times what a loaded machine needs.
const PATIENCE: Duration = Duration::from_secs(60);

const JSON: (&str, &str) = ("Content-Type", "application/json");

#[test]
fn the_session_of_a_log_in_is_a_cookie_that_no_script_reads_and_no_other_page_sends() {
    let house = House::of(ZONE);
    assert_eq!(house.ask("GET /api/state", &[], "").0, 401);
    let (_, before) = house.ask("GET /api/session", &[], "");
    let unknown = json!({ "needed": true, "name": null, "role": null, "may": [] });
    assert_eq!(serde_json::from_str::<Value>(&before).unwrap(), unknown);
    let (status, headers, body) = house.log_in("anna", PASSWORD);
    let anna = json!({
        "needed": true, "name": "anna", "role": "admin", "may": ["look", "edit", "edit-doors", "modules", "acknowledge", "reset"],
        "version": env!("CARGO_PKG_VERSION")
    });
    assert_eq!((status, serde_json::from_str::<Value>(&body).unwrap()), (200, anna));
    let cookie = headers["set-cookie"].to_str().unwrap();
    for part in ["; Path=/", "; HttpOnly", "; SameSite=Strict", "; Max-Age=43200"] {
        assert!(cookie.contains(part), "{cookie}");
    }
    let cookie = ("Cookie", cookie.split(';').next().unwrap());
    assert_eq!(house.ask("GET /api/state", &[cookie], "").0, 200);
    let foreign = [cookie, JSON, ("Origin", "http://evil.example")];
    assert_eq!(house.ask("PUT /api/site", &foreign, "{\"site\": {}}").0, 403, "another site's page");
    assert_eq!(house.ask("DELETE /api/session", &[cookie], "").0, 200);
    assert_eq!(house.ask("GET /api/state", &[cookie], "").0, 401, "logged out");
}

#[test]
fn ten_wrong_passwords_and_then_not_even_the_right_one() {
    let house = House::of(ZONE);
    for number in 0..10 {
        let (status, _, why) = house.log_in(if number % 2 == 0 { "anna" } else { "stranger" }, "wrong");
        assert_eq!((status, why.contains("do not belong together")), (401, true), "{why}");
    }
    let (status, headers, why) = house.log_in("anna", PASSWORD);
    assert_eq!((status, headers["retry-after"].to_str().unwrap()), (429, "30"), "{why}");
    let refused = house.refused.refused();
    assert_eq!((refused.unknown, refused.often), (10, 1));
    house.pass(30 * S);
    assert_eq!(house.log_in("anna", PASSWORD).0, 200);
    for wrong in ["", "{", "{\"name\": \"anna\"}", "[]"] {
        assert_eq!(house.ask("POST /api/session", &[JSON], wrong).0, 400, "{wrong}");
    }
    let text = [("Content-Type", "text/plain")];
    let body = json!({ "name": "anna", "password": PASSWORD }).to_string();
    assert_eq!(
        house.ask("POST /api/session", &text, &body).0,
        400,
        "as a form of another page could send it"
    );
}

#[test]
fn a_session_is_over_after_twelve_hours_and_takes_its_map_with_it() {
    let house = House::of(ZONE);
    let cookie = house.cookie("anna");
    let refused = socket(&house, &[]).unwrap_err();
    assert_eq!(refused, 401, "without a session");
    let mut map = socket(&house, &[("Cookie", &cookie)]).unwrap();
    show(&house, 1);
    until_frame(&mut map, 1);
    house.pass(12 * 3600 * S - 2);
    assert_eq!(house.ask("GET /api/state", &[("Cookie", &cookie)], "").0, 200);
    house.pass(2);
    assert_eq!(house.ask("GET /api/state", &[("Cookie", &cookie)], "").0, 401);
    // The frame that wakes it is the last that it may be sent.
    show(&house, 2);
    show(&house, 3);
    until_end(&mut map);
}

#[test]
fn a_map_ends_with_its_log_out_and_with_its_token() {
    let house = House::of(ZONE);
    let cookie = house.cookie("anna");
    let token = house.token("screen", &[Role::View], None);
    let mut maps = [("Cookie", &cookie), ("Authorization", &token)]
        .map(|(name, value)| socket(&house, &[(name, value)]).unwrap());
    show(&house, 1);
    maps.iter_mut().for_each(|map| until_frame(map, 1));
    house.ask("DELETE /api/session", &[("Cookie", &cookie)], "");
    house.file.change(|directory| directory.remove_token("screen")).unwrap();
    house.pass(S);
    show(&house, 2);
    show(&house, 3);
    maps.iter_mut().for_each(until_end);
}

#[test]
fn a_door_takes_its_devices_messages_by_their_tokens_alone_and_says_why_not() {
    let house = House::of(&format!("{ZONE}{DOORS}"));
    let reader = house.token("front reader", &[Role::Reader], Some("front"));
    let view = house.token("prometheus", &[Role::View], None);
    for (input, name) in Input::NAMED.into_iter().filter(|(input, _)| *input != Input::Exit) {
        let message = message(input);
        let line = format!("POST /api/door/front/{name}");
        let (status, why) = house.ask(&line, &[], &message);
        assert_eq!((status, why.contains("Authorization: Bearer")), (401, true), "{name}: {why}");
        let (status, _) = house.ask(&line, &[("Authorization", "Bearer kehai_wrong")], &message);
        assert_eq!(status, 401, "{name} with a wrong token");
        let (status, why) = house.ask(&line, &[("Authorization", &view)], &message);
        assert_eq!((status, why.contains("token prometheus (view) may not")), (403, true), "{name}: {why}");
    }
    let card = message(Input::Card);
    let reader = [("Authorization", reader.as_str())];
    let (status, why) = house.ask("POST /api/door/back/card", &reader, &card);
    assert_eq!(status, 403, "it is for the other door: {why}");
    assert!(why.contains("token front reader (reader of door front)"), "{why}");
    let (status, _) = house.ask("POST /api/door/front/card", &reader, &card);
    assert_ne!(status, 401);
    assert_ne!(status, 403);
    assert_eq!(house.refused.refused().unknown, 14);
    let editor = house.token("editor", &[Role::Edit], None);
    let toml = [("Content-Type", "application/toml"), ("Authorization", editor.as_str())];
    let (status, why) = house.ask("PUT /api/site", &toml, ZONE);
    assert_eq!((status, why.contains("may not change a site with doors")), (403, true), "{why}");
}

#[test]
fn the_way_out_is_taken_without_a_token_with_a_wrong_one_and_without_users() {
    let house = House::of(&format!("{ZONE}{DOORS}"));
    let back = house.token("back reader", &[Role::Reader], Some("back"));
    let looks = Cell::new(0);
    let exit = |headers: &[(&str, &str)], body: &str| {
        let (status, answer) = house.ask("POST /api/door/front/exit", headers, body);
        assert_eq!((status, answer.as_str()), (200, "{}"), "{headers:?} {body}");
        looks.set(looks.get() + 1);
        let cookie = house.token(&format!("look {}", looks.get()), &[Role::View], None);
        let (_, door) = house.ask("GET /api/door/front", &[("Authorization", &cookie)], "");
        assert_eq!(serde_json::from_str::<Value>(&door).unwrap()["lock"], "exit");
    };
    exit(&[], "");
    for wrong in ["Bearer kehai_wrong", "Basic YTpi", "Bearer", "", &back] {
        exit(&[("Authorization", wrong)], "not json");
    }
    exit(&[("Cookie", "kehai-session=over")], "{}");
    for _ in 0..11 {
        house.log_in("anna", "wrong");
    }
    assert_eq!(house.log_in("anna", PASSWORD).0, 429);
    exit(&[], "{}");
    std::fs::write(house.file.path(), "[[user").unwrap();
    house.pass(S);
    let (status, answer) = house.ask("POST /api/door/front/exit", &[], "");
    assert_eq!((status, answer.as_str()), (200, "{}"), "the file of users is damaged");
    assert_eq!(house.ask("GET /api/door/front", &[("Authorization", &back)], "").0, 401);
}

#[test]
fn whose_card_it_was_is_told_to_nobody_who_may_not_look_at_the_map() {
    let folder = tempfile::tempdir().unwrap();
    let file = AccessFile::beside(&folder.path().join("house.toml"));
    let now_us = Arc::new(AtomicU64::new(0));
    let clock = Arc::clone(&now_us);
    let access = Access::timed(file.clone(), Box::new(move || clock.load(Ordering::SeqCst)));
    let server = DoorServer::with_access(door_fixture::SITE, access);
    server.waits_for("idle");
    server.lets_one_in();
    server.goes_through();
    server.waits_for("closing");
    assert_eq!(server.tell("contact", json!({ "contact": "shut" })).0, 200);
    server.waits_until("the passage", |door| door["passages"][0].is_object());
    for (role, name) in Role::NAMED {
        let shown = secret::token().unwrap();
        let sha256 = secret::fingerprint(&shown);
        let token = Token { name: name.into(), roles: vec![role], door: None, sha256 };
        file.change(|directory| directory.add_token(token)).unwrap();
        now_us.fetch_add(S, Ordering::SeqCst);
        let bearer = format!("Bearer {shown}");
        let headers = [("Authorization", bearer.as_str())];
        let (status, door) = server.ask("GET /api/door/front", &headers, "");
        let (_, doors) = server.ask("GET /api/door", &headers, "");
        assert_eq!(status, 200, "{name}");
        for door in [&door, &doors[0]] {
            let passage = &door["passages"][0]["passage"];
            assert_eq!((&passage["outcome"], &passage["entered"]), (&json!("complete"), &json!(1)), "{name}");
            let told = (door["names"].is_array(), passage["card"].is_string());
            let wanted = role.is_of_people();
            assert_eq!(told, (wanted, wanted), "{name}: {door:#}");
        }
    }
}

/// What is asked for, and what docs/security.md calls it. Each operation of the OpenAPI document is among them.
const ASKED: [(&str, &[&str]); 18] = [
    (
        "the page's files, `/healthz`, `/api/session`, `/door/NAME`, `/api/openapi.json`, `/api/asyncapi.json`",
        &[
            "GET /",
            "GET /main.js",
            "GET /healthz",
            "GET /api/openapi.json",
            "GET /api/asyncapi.json",
            "GET /api/session",
            "POST /api/session",
            "DELETE /api/session",
            "GET /door/front",
        ],
    ),
    ("`POST …/exit`", &["POST /api/door/front/exit"]),
    (
        "`/ws`, `/metrics`, `GET /api/…`: state, history, overview, past, figures, heat, coverage, where, explain, site, calibration, alarms, picture, firmware",
        &[
            "GET /ws",
            "GET /metrics",
            "GET /api/state",
            "GET /api/history",
            "GET /api/overview?from=1&to=2",
            "GET /api/past?from=1&to=2",
            "GET /api/figures?from=1&to=2",
            "GET /api/heat?from=1&to=2",
            "GET /api/coverage",
            "GET /api/where?id=1",
            "GET /api/explain?zone=area",
            "GET /api/site",
            "GET /api/calibration",
            "GET /api/alarms",
            "GET /api/picture",
            "GET /api/picture/place",
            "GET /api/firmware",
            "GET /api/firmware/front",
        ],
    ),
    (
        "`GET`, `POST /api/module/…`, of a site without doors",
        &[
            "GET /api/module/front",
            "GET /api/module/front/things",
            "POST /api/module/front/learn",
            "POST /api/module/front/absorb",
            "POST /api/module/front/rename",
            "POST /api/module/front/restart",
            "POST /api/module/front/settings",
        ],
    ),
    (
        "`POST /api/module/NAME/identify`, of any site",
        &["POST /api/module/front/identify", "POST /api/module/front/identify with doors"],
    ),
    ("`POST /api/module/…`, of a site with doors", &["POST /api/module/front/learn with doors"]),
    ("`POST /api/alarms/acknowledge`", &["POST /api/alarms/acknowledge"]),
    (
        "`PUT /api/site`, `POST /api/site/try`, `POST /api/calibration`, of a site without doors; `GET /api/survey`; `PUT`, `DELETE /api/picture…`",
        &[
            "PUT /api/site",
            "POST /api/site/try",
            "POST /api/calibration",
            "GET /api/survey",
            "PUT /api/picture",
            "DELETE /api/picture",
            "PUT /api/picture/place",
        ],
    ),
    (
        "`PUT /api/site`, `POST /api/calibration`, of a site with doors, before or after",
        &["PUT /api/site with doors", "POST /api/calibration with doors"],
    ),
    ("`GET /api/door`, `/api/door/NAME`", &["GET /api/door", "GET /api/door/front"]),
    ("`POST …/reset`", &["POST /api/door/front/reset"]),
    ("`POST …/number`", &["POST /api/door/front/number"]),
    ("`POST …/card`", &["POST /api/door/front/card"]),
    ("`POST /api/sign`", &["POST /api/sign"]),
    ("`POST …/contact`", &["POST /api/door/front/contact"]),
    (
        "`POST …/lock/ready`, `…/lock/taken`",
        &["POST /api/door/front/lock/ready", "POST /api/door/front/lock/taken"],
    ),
    ("`POST …/alarm/taken`", &["POST /api/door/front/alarm/taken"]),
    (
        "another method, or an unknown input of a door",
        &["POST /api/state", "DELETE /api/site", "POST /api/door/front/open"],
    ),
];

#[test]
fn every_role_at_every_request_is_as_the_table_says() {
    let [plain, guarded] = [ZONE.to_owned(), format!("{ZONE}{DOORS}")].map(|site| House::of(&site));
    let mut table = format!(
        "| | nobody | {} |\n|---|{}\n",
        Role::NAMED.map(|(_, name)| name).join(" | "),
        ":-:|".repeat(1 + Role::NAMED.len())
    );
    let shown = |house: &House| {
        let tokens = Role::NAMED.map(|(role, name)| Some(house.token(name, &[role], None)));
        [vec![None], tokens.to_vec()].concat()
    };
    let (of_plain, of_guarded) = (shown(&plain), shown(&guarded));
    for (title, lines) in ASKED {
        table += &format!("| {title} |");
        for who in 0..=Role::NAMED.len() {
            let may = lines.iter().map(|line| {
                // A site gets doors by what is put; a walk is of a site that has some.
                let walks_by_doors = line.contains("calibration") && line.ends_with("with doors");
                let changes = (line.contains("site") || line.contains("calibration")) && !walks_by_doors;
                let asks = line.contains("/module/") && !line.ends_with("with doors");
                let house = if changes || asks { &plain } else { &guarded };
                let token = if std::ptr::eq(house, &plain) { &of_plain[who] } else { &of_guarded[who] };
                let status = status(house, line, token.as_deref());
                // A user who may look at doors is told that there is no such request; without doors, every client is.
                (!matches!(status, 401 | 403), status)
            });
            let may: Vec<(bool, u16)> = may.collect();
            let first = may[0].0;
            if title.starts_with("another") {
                let fine = may.iter().all(|(_, status)| matches!(status, 401 | 403 | 404 | 405));
                assert!(fine, "{title} as {who}: {may:?}");
                table += " – |";
                continue;
            }
            assert!(may.iter().all(|(may, _)| *may == first), "{title} as {who}: {may:?}");
            table += if first { " ✓ |" } else { " |" };
        }
        table += "\n";
    }
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/security.md");
    let page = std::fs::read_to_string(page).unwrap();
    assert!(page.contains(&table), "docs/security.md has another table than this:\n{table}");
    let (_, document) = plain.ask("GET /api/openapi.json", &[], "");
    let document: Value = serde_json::from_str(&document).unwrap();
    for (path, operations) in document["paths"].as_object().unwrap() {
        for method in operations.as_object().unwrap().keys() {
            let asked = format!("{} {}", method.to_uppercase(), path.replace("{name}", "front"));
            let is_asked = |line: &&str| line.split('?').next() == Some(&asked);
            assert!(
                ASKED.iter().flat_map(|(_, lines)| *lines).any(is_asked),
                "no request here asks for {asked}"
            );
        }
    }
}

#[test]
fn a_site_that_got_doors_by_hand_is_changed_by_an_admin_alone() {
    let house = House::of(ZONE);
    let editor = house.token("editor", &[Role::Edit], None);
    let shown = [JSON, ("Authorization", editor.as_str())];
    let rename = || house.ask("POST /api/module/front/rename", &shown, "{\"name\": \"hall\"}");
    assert_eq!(rename().0, 404, "it is looked for");
    std::fs::write(house.folder.path().join("house.toml"), format!("{ZONE}{DOORS}")).unwrap();
    let (status, why) = rename();
    assert_eq!((status, why.contains("may not change a site with doors")), (403, true), "{why}");
    for step in ["begin", "go-on", "finish", "accept", "stop"] {
        let body = json!({ "do": step }).to_string();
        let (status, why) = house.ask("POST /api/calibration", &shown, &body);
        assert_eq!((status, why.contains("may not change a site with doors")), (403, true), "{step}: {why}");
    }
}

#[test]
fn people_may_by_their_session_what_a_token_of_their_role_may() {
    let house = House::of(&format!("{ZONE}{DOORS}"));
    for (role, name) in Role::NAMED.into_iter().filter(|(role, _)| role.is_of_people()) {
        house.add(name, role);
        let cookie = house.cookie(name);
        let token = house.token(name, &[role], None);
        for line in ASKED.iter().flat_map(|(_, lines)| *lines).filter(|line| !line.contains("session")) {
            let [session, program] = [("Cookie", cookie.as_str()), ("Authorization", token.as_str())]
                .map(|shown| matches!(ask(&house, line, &[shown]), 401 | 403));
            assert_eq!(session, program, "{line} as {name}");
        }
    }
}

fn status(house: &House, line: &str, token: Option<&str>) -> u16 {
    let shown: Vec<(&str, &str)> = token.map(|token| ("Authorization", token)).into_iter().collect();
    ask(house, line, &shown)
}

fn ask(house: &House, line: &str, shown: &[(&str, &str)]) -> u16 {
    let (line, with_doors) = line.strip_suffix(" with doors").map_or((line, false), |line| (line, true));
    let site = if with_doors { format!("{ZONE}{DOORS}") } else { ZONE.to_owned() };
    let toml = ("Content-Type", "application/toml");
    let (kind, body) = match line {
        "PUT /api/site" => (toml, site),
        "POST /api/calibration" => (JSON, json!({ "do": "stop" }).to_string()),
        line if line.starts_with("POST") => (JSON, message(Input::Card)),
        _ => (JSON, String::new()),
    };
    let status = house.ask(line, &[&[kind], shown].concat(), &body).0;
    if with_doors && line.starts_with("PUT") && status == 200 {
        // As it was, for the next.
        let admin = house.token(&format!("again {}", shown.len()), &[Role::Admin], None);
        house.ask(line, &[toml, ("Authorization", &admin)], ZONE);
        house.file.change(|directory| directory.remove_token(&format!("again {}", shown.len()))).unwrap();
    }
    status
}

/// A message to a door that has all that an input may need.
fn message(input: Input) -> String {
    let all = json!({ "id": 1, "at_ms": unix_ms() });
    let (key, value) = match input {
        Input::Card => ("card", json!("04A22B77")),
        Input::Number => ("number", json!(1)),
        Input::Contact => ("contact", json!("shut")),
        Input::LockReady => return json!({ "nonce": 1 }).to_string(),
        Input::LockTaken | Input::AlarmTaken => return json!({ "taken": 1 }).to_string(),
        Input::Exit | Input::Reset => return all.to_string(),
    };
    let mut all = all;
    all[key] = value;
    all.to_string()
}

/// A map, or the status of the refusal.
fn socket(house: &House, headers: &[(&'static str, &String)]) -> Result<WebSocket<TcpStream>, u16> {
    let address = house.server.address();
    let mut request = format!("ws://{address}/ws").into_client_request().unwrap();
    for (name, value) in headers {
        request.headers_mut().insert(*name, value.parse().unwrap());
    }
    let stream = TcpStream::connect(address).unwrap();
    match tungstenite::client(request, stream) {
        Ok((socket, _)) => Ok(socket),
        Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer))) => {
            Err(answer.status().as_u16())
        }
        Err(error) => panic!("{error}"),
    }
}

fn show(house: &House, unix_ms: u64) {
    house.frames.send_replace(Arc::new(Snapshot { unix_ms, ..Snapshot::default() }));
    // Each of them is one that the server sees.
    std::thread::sleep(Duration::from_millis(50));
}

/// Until the server has ended it. It pings a map that goes on, so that this does not wait for ever.
fn until_end(map: &mut WebSocket<TcpStream>) {
    let begun = Instant::now();
    while map.read().is_ok() {
        assert!(begun.elapsed() < PATIENCE, "the map goes on");
    }
}

fn until_frame(map: &mut WebSocket<TcpStream>, unix_ms: u64) {
    loop {
        let Message::Text(text) = map.read().unwrap() else { continue };
        described::message(&text);
        let value: Value = serde_json::from_str(&text).unwrap();
        if value["frame"]["unix_ms"] == json!(unix_ms) {
            return;
        }
    }
}
