//! A door over HTTP: a passage from the card to the lock, what is refused, and the screen in a real browser.

mod chromium;
mod described;
mod door_fixture;
mod http_client;

use chromium::pictures;
use door_fixture::{DoorServer, SITE};
use kehai_tracking::snapshot::unix_ms;
use serde_json::json;

#[test]
fn a_passage_from_the_card_to_the_lock() {
    let server = DoorServer::new();
    server.waits_for("idle");
    server.people(&[[0.0, 0.4]]);
    assert_eq!(server.tell("contact", json!({ "contact": "shut" })).0, 200);
    assert_eq!(server.tell("card", json!({ "card": "04:A2:2B:77" })).0, 200);
    let asked = server.waits_for("asked");
    let name = &asked["names"][0];
    assert_eq!(name["track"], 1, "the person at the reader has shown the card: {asked:#}");
    assert_eq!(name["label"].as_str().map(str::len), Some(8), "eight digits of a hash: {name}");
    let track = &server.ask("GET /api/state", &[], "").1["tracks"][0];
    assert_eq!((&track["x"], &track["y"]), (&json!(0.0), &json!(0.4)), "a card moves no track: {track}");
    assert!(!asked.to_string().contains("04:A2"), "the card's number is not told");
    assert_eq!(server.tell("number", json!({ "number": 1 })).0, 200);
    let unlocked = server.waits_for("unlocked");
    assert_eq!((&unlocked["lock"], &unlocked["lock_taken"]), (&json!("unlocked"), &json!(false)));
    assert_eq!(server.tell("lock/taken", json!({ "taken": unlocked["lock_id"] })).0, 200);
    assert_eq!(server.tell("contact", json!({ "contact": "open" })).0, 200);
    server.people(&[[0.0, 0.95]]);
    server.people(&[[0.0, 1.4]]);
    server.waits_for("closing");
    assert_eq!(server.tell("contact", json!({ "contact": "shut" })).0, 200);
    let idle = server.waits_for("idle");
    let passed = &idle["passages"][0];
    let passage = &passed["passage"];
    assert_eq!(
        (&passage["outcome"], &passage["entered"], &passage["through"]),
        (&json!("complete"), &json!(1), &json!([1])),
        "{idle:#}"
    );
    assert!(passed["begun_ms"].as_u64() <= passed["ended_ms"].as_u64());
    let (status, why) = server.tell("card", json!({ "card": "04:A2:2B:77" }));
    assert_eq!((status, why), (200, json!({})));
    assert_eq!(server.waits_for("alarmed")["alarm"], "passed-back");
}

#[test]
fn what_is_malformed_late_repeated_or_foreign_changes_nothing_and_says_why() {
    let server = DoorServer::new();
    server.waits_for("idle");
    let refused = |line: &str, headers: &[(&str, &str)], body: &str| {
        let (status, answer) = server.ask(line, headers, body);
        let why = answer["error"].as_str().unwrap_or_else(|| panic!("{line}: {status} {answer}")).to_owned();
        assert_eq!(server.door()["phase"], "idle", "{line}");
        (status, why)
    };
    let card = |id: u64, at_ms: u64| json!({ "id": id, "at_ms": at_ms, "card": "1" }).to_string();
    const CARD: &str = "POST /api/door/front/card";
    let (status, why) = refused(CARD, &[], "card");
    assert!(status == 400 && why.starts_with("malformed: "), "{why}");
    let (status, why) = refused(CARD, &[], &card(1, unix_ms() - 60_000));
    assert!(status == 409 && why.starts_with("late: "), "{why}");
    let (status, why) = refused(CARD, &[], &card(1, unix_ms() + 60_000));
    assert!(status == 409 && why.contains("ahead"), "{why}");
    let (status, why) = refused(CARD, &[("Origin", "http://evil.example")], &card(1, unix_ms()));
    assert!(status == 403 && why.contains("evil.example"), "{why}");
    let number = server.message(json!({ "number": 1 }));
    let (status, why) = refused("POST /api/door/front/number", &[], &number);
    assert!(status == 409 && why.starts_with("no card"), "{why}");
    let (status, why) = refused("POST /api/door/front/number", &[], &number);
    assert!(status == 409 && why.starts_with("repeated: "), "{why}");
    let body = |id: u64, at_ms: u64| json!({ "id": id, "at_ms": at_ms, "number": 1 }).to_string();
    let (status, why) = refused("POST /api/door/front/number", &[], &body(9, unix_ms()));
    assert!(status == 409 && why.starts_with("no card"), "{why}");
    let (status, why) = refused("POST /api/door/front/number", &[], &body(8, unix_ms()));
    assert!(status == 409 && why.starts_with("out of order: "), "{why}");
    let (status, why) = refused("POST /api/door/back/card", &[], &card(1, unix_ms()));
    assert!(status == 404 && why.contains("no door \"back\""), "{why}");
    let (status, why) = refused("POST /api/door/front/knock", &[], "{}");
    assert!(status == 404 && why.contains("lock/taken"), "{why}");
    let (status, why) = refused(CARD, &[], &card(1, unix_ms()));
    assert!(status == 409 && why.starts_with("the contact has not said yet"), "{why}");
    assert_eq!(server.tell("contact", json!({ "contact": "shut" })).0, 200);
    assert_eq!(server.ask(CARD, &[], &card(2, unix_ms())).0, 200);
    server.waits_for("asked");
}

#[test]
fn nothing_wrong_over_http_is_taken() {
    let server = DoorServer::new();
    let ask = |input: &str, body: &str| server.ask(&format!("POST /api/door/front/{input}"), &[], body);
    door_fixture::wrong::changes_nothing(
        &server,
        |input, body| assert_eq!(ask(input, body), (200, json!({})), "{input}: {body}"),
        |input, body| {
            let (status, answer) = ask(input, body);
            assert!(status == 400 || status == 409, "{input}: {body}: {status} {answer}");
            answer["error"].as_str().unwrap().to_owned()
        },
    );
}

#[test]
fn f10_whatever_a_request_to_leave_says_the_door_opens() {
    let server = DoorServer::new();
    let idle = server.waits_for("idle");
    assert_eq!(idle["lock"], "locked");
    let late = unix_ms() - 6000;
    for body in [
        json!({ "id": u64::MAX, "at_ms": unix_ms() }).to_string(),
        json!({ "id": 1, "at_ms": late }).to_string(),
        "pressed".to_owned(),
        String::new(),
    ] {
        assert_eq!(server.ask("POST /api/door/front/exit", &[], &body), (200, json!({})), "{body}");
        assert_eq!(server.door()["lock"], "exit", "{body}");
        server.waits_until("it is locked again", |door| door["lock"] == "locked");
    }
}

#[test]
fn f9_a_lock_that_says_it_is_ready_is_answered_with_a_lease_under_its_own_number() {
    let server = DoorServer::new();
    server.waits_for("idle");
    let ready = |nonce: u64| {
        server.ask("POST /api/door/front/lock/ready", &[], &json!({ "nonce": nonce }).to_string())
    };
    let (status, locked) = ready(41);
    assert_eq!((status, &locked["lock"], &locked["nonce"]), (200, &json!("locked"), &json!(41)), "{locked}");
    assert_eq!(server.tell("exit", json!({})).0, 200);
    let (_, order) = ready(42);
    assert_eq!(
        (&order["lock"], &order["for_ms"], &order["nonce"]),
        (&json!("exit"), &json!(1500), &json!(42)),
        "{order}"
    );
    assert_eq!(ready(43).1["id"], order["id"], "the same order, asked for again");
}

#[test]
fn f8_a_site_is_not_changed_while_its_door_is_in_use() {
    let server = DoorServer::new();
    server.waits_for("idle");
    let site = server.ask("GET /api/site", &[], "").1["site"].clone();
    let json = [("Content-Type", "application/json")];
    let change = |fail: &str| {
        let mut site = site.clone();
        site["door"][0]["fail"] = json!(fail);
        server.ask("PUT /api/site", &json, &json!({ "site": site }).to_string())
    };
    server.people(&[[0.0, 0.4]]);
    server.tell("contact", json!({ "contact": "shut" }));
    server.tell("card", json!({ "card": "7" }));
    server.waits_for("asked");
    let (status, answer) = change("safe");
    assert_eq!(status, 409, "{answer}");
    assert!(answer["error"].as_str().unwrap().starts_with("door \"front\" is asked: "), "{answer}");
    server.tell("number", json!({ "number": 1 }));
    server.waits_for("unlocked");
    assert_eq!(change("safe").0, 409);
    server.tell("card", json!({ "card": "7" }));
    server.waits_for("alarmed");
    assert_eq!(change("safe").0, 409, "an alarm is looked after first");
    server.tell("reset", json!({}));
    server.waits_for("idle");
    assert_eq!(change("safe").0, 200);
    assert_eq!(server.door()["lock"], "locked");
}

#[test]
fn without_frames_the_door_fails_and_says_so() {
    let server = DoorServer::new();
    server.waits_for("idle");
    server.people(&[[0.0, 0.4]]);
    server.tell("contact", json!({ "contact": "shut" }));
    server.tell("card", json!({ "card": "7" }));
    server.waits_for("asked");
    server.tell("number", json!({ "number": 1 }));
    server.waits_for("unlocked");
    server.tracker_is_dead(true);
    let failed = server.waits_for("failed");
    let told = ["lock", "alarm", "trouble"].map(|key| failed[key].as_str().unwrap_or("").to_owned());
    assert_eq!(told, ["locked", "trouble", "no-frames"], "{failed:#}");
    assert_eq!(failed["passages"][0]["passage"]["outcome"], "trouble", "{failed:#}");
    server.tracker_is_dead(false);
    let idle = server.waits_for("idle");
    assert_eq!((&idle["alarm"], &idle["trouble"]), (&json!(null), &json!(null)), "{idle:#}");
}

#[test]
fn a_passage_is_replayed_on_the_map() {
    let Some(mut page) = chromium::start() else { return };
    let server = DoorServer::new();
    server.waits_for("idle");
    page.size(1280, 800, 1);
    page.open(&format!("http://{}/", server.server.address()));
    server.people(&[[0.0, 0.4]]);
    page.wait("a person waits", "document.querySelectorAll('#map .person.confirmed').length === 1");
    page.wait("no passage yet", "document.querySelector('#passages').closest('section').hidden");
    server.tell("contact", json!({ "contact": "shut" }));
    server.tell("card", json!({ "card": "7" }));
    // Beside the one at the reader stands a part of the card's hash, and how sure that is.
    let card = "document.querySelector('#map .person text').textContent";
    page.wait("the card is beside its track", &format!("/^card [0-9a-f]{{8}} 9\\d%$/.test({card})"));
    std::thread::sleep(std::time::Duration::from_secs(2));
    server.tell("number", json!({ "number": 1 }));
    server.waits_for("unlocked");
    server.tell("contact", json!({ "contact": "open" }));
    server.people(&[[0.0, 0.95]]);
    server.people(&[[0.0, 1.4]]);
    server.waits_for("closing");
    server.tell("contact", json!({ "contact": "shut" }));
    let begun_ms = server.waits_for("idle")["passages"][0]["begun_ms"].as_u64().unwrap();
    server.people(&[[0.0, 3.0]]);
    let at = |y: f64| {
        format!("document.querySelector('[data-person=\"1\"]')?.style.transform === 'translate(0px, {y}px)'")
    };
    page.wait("now a person is inside", &at(-3.0));
    page.wait(
        "the passage is told",
        "document.querySelector('#passages')?.innerText.includes('1 of 1 went in')",
    );
    page.click("#passages a");
    page.wait("its time is shown", "document.body.classList.contains('past')");
    page.wait("with who waited then", &at(-0.4));
    page.wait("the link says when", &format!("location.hash === '#at={begun_ms}'"));
    page.click("#live");
    page.wait("and now again", &at(-3.0));
    // The link works anywhere it is sent to: a page that is opened with it.
    page.open("about:blank");
    page.wait("the page is gone", "document.querySelector('#map') === null");
    page.open(&format!("http://{}/#at={begun_ms}", server.server.address()));
    page.wait("the same from outside", &at(-0.4));
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn the_entrant_enters_the_number_on_the_screen() {
    let Some(mut page) = chromium::start() else { return };
    let server = DoorServer::new();
    server.waits_for("idle");
    server.people(&[[0.0, 0.4], [0.5, 0.2], [-0.5, 0.0]]);
    server.tell("contact", json!({ "contact": "shut" }));
    page.size(1280, 800, 1);
    page.scheme("light");
    page.open(&format!("http://{}/door/front", server.server.address()));
    let phase = |phase: &str| format!("document.body.dataset.phase === '{phase}'");
    page.wait("it asks for a card", &phase("idle"));
    page.wait(
        "no number can be entered",
        "document.querySelectorAll('.keys button:not(:disabled)').length === 0",
    );
    server.tell("card", json!({ "card": "7" }));
    page.wait("it asks for the number", &phase("asked"));
    page.wait(
        "seven may go in",
        "document.querySelectorAll('.keys button:not(:disabled):not([hidden])').length === 7",
    );
    page.wait(
        "keys are larger than a thumb",
        "[...document.querySelectorAll('.keys button:not([hidden])')].every((key) => key.offsetHeight >= 64 && key.offsetWidth >= 64)",
    );
    page.picture(&pictures().join("door.png"));
    page.click(".keys button:nth-child(2)");
    page.wait("two is not three", "document.querySelector('#prompt').innerText.includes('does not match')");
    page.fits_a_phone("door asks again");
    page.size(390, 844, 2);
    page.scheme("dark");
    page.wait("the page has the phone's width", "document.documentElement.scrollWidth <= 390");
    page.wait(
        "all keys are on it",
        "document.querySelector('.keys').getBoundingClientRect().bottom <= innerHeight",
    );
    page.picture(&pictures().join("door-phone.png"));
    page.click(".keys button:nth-child(3)");
    page.wait("they may go in", &phase("unlocked"));
    page.wait("three are awaited", "document.querySelectorAll('#people li:not(.none)').length === 3");
    server.tell("contact", json!({ "contact": "open" }));
    server.people(&[[0.0, 0.95], [0.5, 0.2], [-0.5, 0.0]]);
    server.people(&[[0.0, 1.4], [0.5, 0.2], [-0.5, 0.0]]);
    page.wait("one is in", "document.querySelectorAll('#people li.in').length === 1");
    page.fits_a_phone("door unlocked");
    drop(server);
    page.wait("the screen says so", &phase("lost"));
    page.fits_a_phone("door lost");
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn the_screen_has_a_key_for_each_number_that_a_door_allows() {
    let Some(mut page) = chromium::start() else { return };
    let server = DoorServer::of(&SITE.replace("fail = ", "people_max = 16\nfail = "));
    server.waits_for("idle");
    server.people(&[[0.0, 0.4]]);
    server.tell("contact", json!({ "contact": "shut" }));
    server.tell("card", json!({ "card": "7" }));
    let keys = "[...document.querySelectorAll('.keys button:not(:disabled):not([hidden])')]";
    let all = format!(
        "{keys}.length === 16 && {keys}.every((key) => key.offsetHeight >= 64 && key.offsetWidth >= 64)"
    );
    for (width, height) in [(1280, 800), (390, 844)] {
        page.size(width, height, 1);
        page.open(&format!("http://{}/door/front", server.server.address()));
        page.wait("sixteen keys, larger than a thumb", &all);
        page.wait("they are on it", &format!("{keys}[15].getBoundingClientRect().bottom <= innerHeight"));
    }
    page.fits_a_phone("door of sixteen");
    page.click(".keys button:nth-child(16)");
    page.wait("it was entered", "document.querySelector('#prompt').innerText.includes('does not match')");
    assert_eq!(page.errors, Vec::<String>::new());
}
