//! The live map's server: what it answers, what it refuses, and that nothing sent to it ends it.

mod described;
mod http_client;
mod map;
mod socket;

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::{Arc, mpsc};
use std::time::Duration;

use host_tracker::reports::ReportLine;
use host_tracker::site_file;
use kehai_tracking::snapshot::{ModuleLine, Snapshot};
use map::{HOME, Map};
use proptest::prelude::*;
use serde_json::{Value, json};
use socket::next;
use tungstenite::Message;

/// The header of a body in JSON.
const JSON: (&str, &str) = ("Content-Type", "application/json");

#[test]
fn the_page_and_all_it_names_are_there() {
    let map = Map::new();
    let (status, page) = map.ask("GET /", &[], b"");
    assert_eq!(status, 200);
    let mut named: Vec<String> = vec!["/main.js".into()];
    let quoted = |text: &str| -> Vec<String> {
        text.split(['"', '\''])
            .filter(|part| part.starts_with('/') || part.starts_with("./"))
            .map(|part| part.trim_start_matches('.').to_owned())
            .filter(|path| path.ends_with(".js") || path.ends_with(".css") || path.ends_with(".svg"))
            .collect()
    };
    named.extend(quoted(&page));
    let mut index = 0;
    while let Some(path) = named.get(index).cloned() {
        let (status, text) = map.ask(&format!("GET {path}"), &[], b"");
        assert_eq!(status, 200, "{path}");
        assert!(!text.is_empty(), "{path} is empty");
        let elsewhere = text.replace("http://www.w3.org/", "");
        assert!(
            !elsewhere.contains("http://") && !elsewhere.contains("https://"),
            "{path} asks another server"
        );
        let more: Vec<String> = quoted(&text).into_iter().filter(|path| !named.contains(path)).collect();
        named.extend(more);
        index += 1;
    }
    assert!(named.len() > 5, "{named:?}");
}

#[test]
fn a_site_that_takes_long_to_save_lets_no_other_client_wait() {
    let map = &Map::new();
    let path = map.folder.path().join("home.toml");
    std::thread::scope(|scope| {
        let slow = map.changes.lock().unwrap();
        let saving = scope.spawn(|| map.put("application/toml", &[], &HOME.replace("hall", "lounge")));
        while !std::fs::read_to_string(&path).unwrap().contains("lounge") {
            std::thread::sleep(Duration::from_millis(5));
        }
        let (tell, told) = mpsc::channel();
        scope.spawn(move || tell.send(map.ask("GET /api/site", &[], b"").0));
        let answered = told.recv_timeout(Duration::from_secs(10));
        drop(slow);
        assert_eq!(answered, Ok(200));
        assert_eq!(saving.join().unwrap().0, 200);
    });
}

/// Head and body of the answer to a GET of a path, byte by byte as they come.
fn get_bytes(map: &Map, path: &str, headers: &str) -> (String, Vec<u8>) {
    let host = map.server.address();
    let asked = format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n{headers}\r\n");
    // A client that shuts down its side is taken for one that has gone: the answer may not come.
    let mut stream = TcpStream::connect(host).unwrap();
    stream.write_all(asked.as_bytes()).unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    let end = answer.windows(4).position(|four| four == b"\r\n\r\n").unwrap();
    (String::from_utf8_lossy(&answer[..end]).into_owned(), answer[end + 4..].to_vec())
}

#[test]
fn the_page_is_compressed_and_a_browser_that_has_it_is_sent_nothing() {
    let map = Map::new();
    let (mut plain_bytes, mut gzip_bytes) = (0, 0);
    let page = map.ask("GET /", &[], b"").1;
    let mut paths = vec!["/".to_owned(), "/words-en.js".into(), "/words-ja.js".into(), "/icon.svg".into()];
    paths.extend(
        page.split('"').filter(|part| part.starts_with('/') && part.contains('.')).map(str::to_owned),
    );
    for path in paths {
        let (head, plain) = get_bytes(&map, &path, "");
        assert!(head.starts_with("HTTP/1.1 200") && !head.contains("content-encoding"), "{path}: {head}");
        assert!(head.contains("vary: Accept-Encoding") && head.contains("cache-control: no-cache"), "{head}");
        let (head, body) = get_bytes(&map, &path, "Accept-Encoding: gzip, deflate, br\r\n");
        assert!(head.contains("content-encoding: gzip") && head.contains("vary: Accept-Encoding"), "{head}");
        let mut unpacked = Vec::new();
        flate2::read::GzDecoder::new(body.as_slice()).read_to_end(&mut unpacked).unwrap();
        assert_eq!(unpacked, plain, "{path}");
        (plain_bytes, gzip_bytes) = (plain_bytes + plain.len(), gzip_bytes + body.len());
        // What a browser keeps, it asks for again by its tag.
        let tag = head.lines().find_map(|line| line.strip_prefix("etag: ")).unwrap().trim().to_owned();
        let (head, body) =
            get_bytes(&map, &path, &format!("If-None-Match: {tag}\r\nAccept-Encoding: gzip\r\n"));
        assert!(head.starts_with("HTTP/1.1 304") && body.is_empty(), "{path}: {head}");
        assert!(head.contains(&format!("etag: {tag}")) && head.contains("cache-control: no-cache"), "{head}");
        // Another version of the tracker has another tag.
        let (head, body) = get_bytes(&map, &path, "If-None-Match: W/\"0123456789abcdef01234567\"\r\n");
        assert!(head.starts_with("HTTP/1.1 200") && body == plain, "{path}: {head}");
    }
    assert!(5 * gzip_bytes < 2 * plain_bytes, "{gzip_bytes} of {plain_bytes}");
}

#[test]
fn no_answer_of_the_api_is_compressed() {
    let map = Map::new();
    map.show(1000);
    for path in ["/api/site", "/api/state", "/api/session", "/api/openapi.json", "/metrics", "/nothing"] {
        let (head, body) = get_bytes(&map, path, "Accept-Encoding: gzip\r\n");
        assert!(!head.contains("content-encoding") && !body.starts_with(&[0x1f, 0x8b]), "{path}: {head}");
    }
}

#[test]
fn frames_reach_browsers_and_the_state() {
    let map = Map::new();
    let mut socket = map.socket(None).unwrap();
    map.show(1000);
    let fields = next(&mut socket, "fields");
    assert_eq!(fields["left"], json!([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]));
    let frame = next(&mut socket, "frame");
    assert_eq!(frame["unix_ms"], 1000);
    assert_eq!(frame["modules"][0]["name"], "left");
    assert!(frame["modules"][0]["free"].is_null(), "what is seen goes its own, slower way");
    let state: Value = serde_json::from_str(&map.ask("GET /api/state", &[], b"").1).unwrap();
    assert_eq!(state["unix_ms"], 1000);
    let history: Value = serde_json::from_str(&map.ask("GET /api/history", &[], b"").1).unwrap();
    assert_eq!(history[0]["unix_ms"], 1000);
    let (status, metrics) = map.ask("GET /metrics", &[], b"");
    assert_eq!(status, 200);
    assert!(metrics.contains("left"), "{metrics}");
}

#[test]
fn tracks_come_after_each_report_to_clients_that_asked_for_that_and_to_no_other() {
    let map = Map::new();
    let (mut page, mut program) = (map.socket(None).unwrap(), map.socket(None).unwrap());
    assert!(!map.reports.are_wanted(), "no client has asked");
    program.send(Message::text(r#"{"frames": false, "reports": true}"#)).unwrap();
    while !map.reports.are_wanted() {
        std::thread::yield_now();
    }
    for sequence in 1..=3 {
        map.reports.publish(ReportLine { t: 0.5, module: "left".into(), sequence, tracks: Vec::new() });
    }
    map.show(1000);
    for sequence in 1..=3 {
        let report = next(&mut program, "report");
        assert_eq!(report, json!({ "t": 0.5, "module": "left", "sequence": sequence, "tracks": [] }));
    }
    // All that the page gets until the frame that came later.
    loop {
        let Message::Text(text) = page.read().unwrap() else { continue };
        described::message(&text);
        let value: Value = serde_json::from_str(&text).unwrap();
        assert!(value["report"].is_null());
        if !value["frame"].is_null() {
            break;
        }
    }
    program.send(Message::text(r#"{"frames": true}"#)).unwrap();
    assert_eq!(next(&mut program, "frame")["unix_ms"], 1000);
    assert!(!map.reports.are_wanted(), "asked for no more");
}

#[test]
fn a_browser_that_reads_nothing_misses_frames_and_holds_up_no_other() {
    let map = Map::new();
    let sleeper = map.socket(None).unwrap();
    let mut reader = map.socket(None).unwrap();
    // Long enough names that no buffer on the way takes all of it.
    let name = "x".repeat(100_000);
    for unix_ms in 1..=500 {
        let module = ModuleLine { name: name.clone(), ..ModuleLine::default() };
        map.frames.send_replace(Arc::new(Snapshot { unix_ms, modules: vec![module], ..Snapshot::default() }));
        let mut seen = 0;
        while seen < unix_ms {
            seen = next(&mut reader, "frame")["unix_ms"].as_u64().unwrap();
        }
    }
    let mut late = sleeper;
    let mut taken = 0;
    let mut last = 0;
    while last < 500 {
        last = next(&mut late, "frame")["unix_ms"].as_u64().unwrap();
        taken += 1;
    }
    assert!(taken < 400, "{taken} of 500 frames were queued for a client that did not read");
}

#[test]
fn a_wrong_message_is_answered() {
    let map = Map::new();
    let mut socket = map.socket(None).unwrap();
    for message in ["{", "7", "{\"frames\": 3}", "{\"frames\": true, \"reports\": 3}", "{\"more\": true}", ""]
    {
        socket.send(Message::text(message)).unwrap();
        let error = next(&mut socket, "error");
        assert!(error.as_str().unwrap().contains("understood:"), "{error}");
    }
    socket.send(Message::binary(vec![0; 3])).unwrap();
    assert!(next(&mut socket, "error").as_str().unwrap().contains("binary"));
    socket.send(Message::text("{\"frames\": false}")).unwrap();
    map.show(5);
    socket.send(Message::text("{\"frames\": true}")).unwrap();
    assert_eq!(next(&mut socket, "frame")["unix_ms"], 5);
    let mut rude = map.socket(None).unwrap();
    let _ = rude.send(Message::text("x".repeat(5000)));
    while rude.read().is_ok() {}
    assert_eq!(map.ask("GET /", &[], b"").0, 200);
}

#[test]
fn other_pages_may_neither_write_nor_listen() {
    let map = Map::new();
    let body = json!({ "site": {} }).to_string();
    let (status, why) = map.put("application/json", &[("Origin", "http://evil.example")], &body);
    assert_eq!(status, 403);
    assert!(why.contains("http://evil.example"), "{why}");
    for line in ["POST /api/calibration", "POST /api/door/front/card", "PUT /anything"] {
        for foreign in
            [("Origin", "http://evil.example"), ("Origin", "null"), ("Sec-Fetch-Site", "cross-site")]
        {
            let headers = [JSON, foreign];
            assert_eq!(map.ask(line, &headers, br#"{"do": "begin"}"#).0, 403, "{line}, {foreign:?}");
        }
    }
    let (_, calibration) = map.ask("GET /api/calibration", &[], b"");
    assert!(calibration.contains(r#""active":false"#), "{calibration}");
    let (status, why) = map.ask("GET /api/site", &[("Host", "evil.example")], b"");
    assert_eq!(status, 403);
    assert!(why.contains("evil.example"), "{why}");
    match map.socket(Some("http://evil.example")) {
        Err(tungstenite::Error::Http(response)) => assert_eq!(response.status(), 403),
        other => panic!("{other:?}"),
    }
    assert!(map.socket(Some(&format!("http://{}", map.server.address()))).is_ok());
    assert!(map.changes.lock().unwrap().is_empty());
}

#[test]
fn f11_a_request_for_two_hosts_is_refused() {
    let map = Map::new();
    let hosts = ["Host: localhost", "Host: evil.lan"];
    for [first, second] in [hosts, [hosts[1], hosts[0]], [hosts[0]; 2]] {
        for line in ["GET /", "GET /api/site", "POST /api/door/front/exit"] {
            let request = format!("{line} HTTP/1.1\r\n{first}\r\n{second}\r\nConnection: close\r\n\r\n");
            let mut stream = TcpStream::connect(map.server.address()).unwrap();
            stream.write_all(request.as_bytes()).unwrap();
            let mut answer = String::new();
            stream.read_to_string(&mut answer).unwrap();
            assert!(answer.starts_with("HTTP/1.1 400 ") && answer.contains("more than once"), "{answer}");
        }
    }
}

#[test]
fn a_site_is_saved_and_handed_on() {
    let map = Map::new();
    let mut socket = map.socket(None).unwrap();
    let first = next(&mut socket, "site");
    let mut read: Value = serde_json::from_str(&map.ask("GET /api/site", &[], b"").1).unwrap();
    assert_eq!(
        (&read["revision"], &read["file"], &read["toml"]),
        (&first, &json!("home.toml"), &json!(HOME))
    );
    read["site"]["zone"][0]["name"] = json!("lounge");
    let body = json!({ "revision": first, "site": read["site"] }).to_string();
    let origin = format!("http://{}", map.server.address());
    let (status, answer) = map.put("application/json", &[("Origin", &origin)], &body);
    let second = next(&mut socket, "site");
    assert_eq!((status, answer), (200, json!({ "revision": second }).to_string()));
    assert_ne!(second, first);
    assert_eq!(map.changes.lock().unwrap()[0].zones[0].name, "lounge");
    assert_eq!(site_file::load(&map.folder.path().join("home.toml")).unwrap().zones[0].name, "lounge");
    let (status, why) = map.put("application/json", &[], &body);
    assert_eq!(status, 409, "{why}");
    assert_eq!(map.put("application/toml", &[("If-Match", &second.to_string())], HOME).0, 200);
    assert_eq!(map.changes.lock().unwrap()[1].zones[0].name, "hall");
    assert_eq!(next(&mut socket, "site"), first, "the same text again");
}

#[test]
fn two_edits_are_merged_or_both_are_in_the_answer_and_a_try_saves_nothing() {
    let map = Map::new();
    let base: Value = serde_json::from_str(&map.ask("GET /api/site", &[], b"").1).unwrap();
    let edit = |edited: &dyn Fn(&mut Value)| {
        let mut site = base["site"].clone();
        edited(&mut site);
        json!({ "revision": base["revision"], "base": base["site"], "site": site }).to_string()
    };
    let walled = edit(&|site| site["wall"] = json!([{ "points": [[0, 0], [4, 0]] }]));
    let renamed = edit(&|site| site["zone"][0]["name"] = json!("lounge"));
    let moved = edit(&|site| site["zone"][0]["polygon"][2] = json!([1, 2]));
    let put = |body: &str| {
        let (status, answer) = map.put("application/json", &[], body);
        (status, serde_json::from_str::<Value>(&answer).unwrap())
    };
    assert_eq!(put(&walled).0, 200);
    let (status, answer) = put(&renamed);
    assert_eq!((status, &answer["merged"]), (200, &json!(["wall 1 added"])));
    let (status, answer) = put(&moved);
    let conflict = &answer["conflicts"][0];
    assert_eq!(
        (status, &conflict["kind"], &conflict["label"]),
        (409, &json!("zone"), &json!("zone \"lounge\""))
    );
    assert_eq!(
        (&conflict["mine"]["polygon"][2][1], &conflict["theirs"]["name"]),
        (&json!(2.0), &json!("lounge"))
    );
    assert_eq!(answer["changes"], json!(["wall 1 added", "zone \"lounge\" changed"]));
    assert_eq!(answer["site"]["zone"][0]["name"], "lounge");
    assert_eq!(
        (&answer["merged"]["zone"][0]["name"], answer["wrong"].as_array().unwrap().len()),
        (&json!("hall"), 0)
    );
    // Decided for mine, as of the newest revision.
    let decided = json!({ "revision": answer["revision"], "base": answer["site"], "site": answer["merged"] });
    let tried = map.ask("POST /api/site/try", &[JSON], decided.to_string().as_bytes());
    let tried: Value = serde_json::from_str(&tried.1).unwrap();
    assert_eq!((&tried["conflicts"], &tried["revision"]), (&json!([]), &answer["revision"]));
    assert_eq!(put(&decided.to_string()).0, 200);
    let text = std::fs::read_to_string(map.folder.path().join("home.toml")).unwrap();
    assert!(text.starts_with("# where we live") && text.contains("[[wall]]"), "{text}");
    let bow = edit(&|site| site["zone"][0]["polygon"] = json!([[0, 0], [2, 2], [2, 0], [0, 2]]));
    let (status, tried) = map.ask("POST /api/site/try", &[JSON], bow.as_bytes());
    assert!(status == 200 && tried.contains("crosses itself"), "{tried}");
    assert_eq!(map.changes.lock().unwrap().len(), 3);
}

#[test]
fn a_wrong_site_is_refused_by_line_or_field_and_nothing_is_lost() {
    let map = Map::new();
    let json = "application/json";
    let cases = [
        (json, "{", 400, "EOF"),
        (
            json,
            "{\"site\":{\"zone\":[{\"name\":\"a\",\"polygon\":[[0,0],[1,\"b\"]]}]}}",
            400,
            "site.zone[0].polygon[1][1]",
        ),
        (json, "{\"site\":{\"zone\":[{\"name\":\"a\",\"polygon\":[[0,0],[1,1]]}]}}", 400, "zone \\\"a\\\""),
        (json, "{\"site\":{\"gate\":[]}}", 400, "gate"),
        (json, "{\"site\":{\"wall\":[{\"points\":[[0,0],[1e300,1]]}]}}", 400, "wall 1"),
        (json, "{\"site\":{}} x", 400, "trailing"),
        ("application/toml", "[[zone]]\nname = 3\n", 400, "request:2"),
        (
            "application/toml",
            "[[zone]]\nname = \"a\"\npolygon = [[0, 0], [nan, 0], [1, 1]]",
            400,
            "zone \\\"a\\\"",
        ),
        ("text/plain", "hello", 415, "application/toml"),
    ];
    for (kind, body, expected, part) in cases {
        let (status, why) = map.put(kind, &[], body);
        assert_eq!(status, expected, "{body}: {why}");
        assert!(why.contains(part), "{body}: {why}");
    }
    // The server answers before it has read all of it, so a client that only sends hears nothing but a closed line.
    let head = "PUT /api/site HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n";
    let body = " ".repeat(2 << 20);
    let request = format!("{head}Content-Length: {}\r\n\r\n{body}", body.len());
    let answer = String::from_utf8(map.send(request.as_bytes())).unwrap();
    assert!(answer.starts_with("HTTP/1.1 413 "), "{answer}");
    assert_eq!(std::fs::read_to_string(map.folder.path().join("home.toml")).unwrap(), HOME);
    assert!(map.changes.lock().unwrap().is_empty());
}

#[test]
fn nothing_sent_ends_the_server() {
    let map = Map::new();
    for bytes in [
        b"".as_slice(),
        b"\0\xff\r\n\r\n",
        b"GET / HTTP/1.1\r\n\r\n",
        b"GET /../../etc/passwd HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"GET /%00%ff HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"PUT /api/site HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999999\r\n\r\n",
        b"GET /ws HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\n\r\n",
        b"DELETE /api/site HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: localhost\r\nOrigin: \xff\xff\r\n\r\n",
    ] {
        map.send(bytes);
        assert_eq!(map.ask("GET /", &[], b"").0, 200);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn any_body_is_answered(body in proptest::collection::vec(any::<u8>(), 0..200), toml in any::<bool>()) {
        let map = Map::new();
        let kind = if toml { "application/toml" } else { "application/json" };
        let (status, why) = map.ask("PUT /api/site", &[("Content-Type", kind)], &body);
        // An empty or a blank file is a site with nothing in it.
        prop_assert!(status == 400 || (toml && status == 200), "{status} {why}");
    }
}

#[test]
fn a_calibration_is_begun_and_ended_and_what_is_not_there_is_not_accepted() {
    let map = Map::new();
    let ask =
        |wish: &str| map.ask("POST /api/calibration", &[JSON], format!(r#"{{"do": "{wish}"}}"#).as_bytes());
    let (status, idle) = map.ask("GET /api/calibration", &[], b"");
    assert!(status == 200 && idle.contains(r#""active":false"#), "{idle}");
    let (status, begun) = ask("begin");
    assert!(status == 200 && begun.contains(r#""active":true"#), "{begun}");
    let (status, refused) = ask("accept");
    assert!(status == 409 && refused.contains("walk and finish first"), "{refused}");
    let (status, wrong) = ask("jump");
    assert!(status == 400 && wrong.contains("jump"), "{wrong}");
    assert_eq!(ask("stop").0, 200);
    let (_, idle) = map.ask("GET /api/calibration", &[], b"");
    assert!(idle.contains(r#""active":false"#), "{idle}");
}

#[test]
fn a_picture_is_served_as_what_it_is_and_in_a_sandbox() {
    const SVG: &[u8] = b"<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"40\" height=\"30\"><script>alert(1)</script></svg>";
    let map = Map::new();
    let put = |kind: &str, bytes: &[u8]| map.ask("PUT /api/picture", &[("Content-Type", kind)], bytes).0;
    assert_eq!(map.ask("GET /api/picture", &[], b"").0, 404);
    assert_eq!(
        map.ask("GET /api/picture/place", &[], b""),
        (200, "{\"picture\":false,\"place\":null}".into())
    );
    assert_eq!(
        [put("image/png", SVG), put("text/html", SVG), put("image/svg+xml", b"<html></html>")],
        [415; 3]
    );
    assert_eq!(put("image/svg+xml", &vec![b' '; (8 << 20) + 1]), 413);
    let place =
        json!({ "x": 0, "y": 3, "turn_deg": 0, "m_per_px": 0.1, "width": 40, "height": 30 }).to_string();
    let lay = |place: &str| map.ask("PUT /api/picture/place", &[JSON], place.as_bytes()).0;
    assert_eq!(lay(&place), 404, "there is nothing to be laid");
    assert_eq!(put("image/svg+xml", SVG), 200);
    assert_eq!([lay(&place), lay(&place.replace("0.1", "-0.1")), lay("{}")], [200, 400, 400]);
    let answer = get_bytes(&map, "/api/picture", "").0 + "\r\n";
    for header in [
        "content-type: image/svg+xml\r\n",
        "content-security-policy: sandbox; default-src 'none'",
        "x-content-type-options: nosniff",
    ] {
        assert!(answer.contains(header), "{answer}");
    }
    assert_eq!(answer.matches("content-security-policy").count(), 1, "{answer}");
    assert_eq!(std::fs::read(map.folder.path().join("home.picture")).unwrap(), SVG);
    assert_eq!(map.ask("DELETE /api/picture", &[], b"").0, 200);
    assert_eq!(std::fs::read_dir(map.folder.path()).unwrap().count(), 1, "only the site is left");
}

#[test]
fn it_is_healthy_while_frames_come_and_not_once_they_stop() {
    let map = Map::new();
    let (ended, end) = mpsc::channel::<()>();
    std::thread::scope(|scope| {
        let map = &map;
        let shows = scope.spawn(move || {
            while end
                .recv_timeout(Duration::from_millis(20))
                .is_err_and(|error| error == mpsc::RecvTimeoutError::Timeout)
            {
                map.show(1);
            }
        });
        assert_eq!(map.ask("GET /healthz", &[], b""), (200, "ok\n".to_owned()));
        drop(ended);
        shows.join().unwrap();
    });
    assert_eq!(map.ask("GET /healthz", &[], b"").0, 503);
}
