//! A module looked after over HTTP, as the map does: settings, a name, its background, a thing, a restart; with and without a key.
#![cfg(unix)]

mod bench;
mod chromium;
mod described;
mod http_client;
mod mapped;

use std::io::Write;
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use bench::{Bench, LABEL, PATIENCE};
use host_tracker::site_file;
use mapped::map_of;
use serde_json::{Value, json};

const JSON: (&str, &str) = ("Content-Type", "application/json");

/// A tracker with one module, and a site file with a comment in it.
struct Tracker {
    process: Child,
    address: SocketAddr,
    site: PathBuf,
    _folder: tempfile::TempDir,
}

impl Tracker {
    fn start(bench: &Bench) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let site = folder.path().join("home.toml");
        let module = format!(
            "[[module]]\nname = \"{}\" # above the shelf\nx = 0.0\ny = 0.0\nyaw_deg = 90.0\nheight_m = 0.6\n",
            bench.name
        );
        let zone =
            "\n[[zone]]\nname = \"hall\"\npolygon = [[-2, 0], [2, 0], [2, 3], [-2, 3]]\ncount = true\n";
        std::fs::write(&site, module + zone).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
        command.args(["run", "--http", "127.0.0.1:0", "--no-mdns", "--module"]);
        command.arg(bench.address.to_string()).arg("--site").arg(&site).stderr(Stdio::piped());
        let mut process = command.spawn().unwrap();
        let map = map_of(&mut process);
        let address = map.trim_start_matches("http://").trim_end_matches('/').parse().unwrap();
        Self { process, address, site, _folder: folder }
    }

    fn ask(&self, line: &str, body: &Value) -> (u16, Value) {
        let body = if body.is_null() { String::new() } else { body.to_string() };
        let (status, answer) = http_client::ask(self.address, line, &[JSON], body.as_bytes());
        (status, serde_json::from_str(&answer).unwrap_or(Value::Null))
    }

    fn does(&self, name: &str, action: &str, body: &Value) -> (u16, Value) {
        self.ask(&format!("POST /api/module/{name}/{action}"), body)
    }

    fn refused(&self, name: &str, action: &str, body: &Value) -> (u16, String) {
        let (status, answer) = self.does(name, action, body);
        let why = answer["error"].as_str().unwrap_or_else(|| panic!("{action}: {status} {answer}"));
        assert!(!why.contains('\n'), "one line: {why}");
        (status, why.to_owned())
    }

    fn settings(&self, name: &str) -> Value {
        let (status, answer) = self.ask(&format!("GET /api/module/{name}"), &Value::Null);
        assert_eq!(status, 200, "{answer}");
        answer["settings"].clone()
    }

    /// Whether the newest frame has a module of this name.
    fn has(&self, name: &str) -> bool {
        let (_, state) = self.ask("GET /api/state", &Value::Null);
        state["modules"].as_array().into_iter().flatten().any(|line| line["name"] == name)
    }

    /// The module's line of the newest frame, once it is so.
    #[track_caller]
    fn until(&self, what: &str, name: &str, is_so: impl Fn(&Value) -> bool) -> Value {
        let begun = Instant::now();
        loop {
            let (_, state) = self.ask("GET /api/state", &Value::Null);
            let modules = state["modules"].as_array().cloned().unwrap_or_default();
            if let Some(line) = modules.into_iter().find(|line| line["name"] == name && is_so(line)) {
                return line;
            }
            assert!(begun.elapsed() < PATIENCE, "{what} does not come: {state:#}");
            std::thread::sleep(Duration::from_millis(100));
        }
    }
}

impl Drop for Tracker {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn watches(line: &Value) -> bool {
    line["state"] == "watching" && !line["background_age_s"].is_null()
}

#[test]
fn a_module_is_set_renamed_taught_and_restarted_over_http() {
    let bench = Bench::start("acts");
    let tracker = Tracker::start(&bench);
    let name = bench.name.as_str();
    tracker.until("it watches", name, watches);

    assert_eq!(tracker.settings(name)["name"], name);
    assert_eq!(
        tracker.does(name, "settings", &json!({ "learn_scans": "40", "foreground_mm": "120" })).0,
        200
    );
    let settings = tracker.settings(name);
    assert_eq!((&settings["learn_scans"], &settings["foreground_mm"]), (&json!("40"), &json!("120")));
    let (status, why) = tracker.refused(name, "settings", &json!({ "learn_scans": "50", "skip": "many" }));
    assert!(status == 409 && why.starts_with("skip=many: ") && why.ends_with("nothing was changed"), "{why}");
    assert_eq!(tracker.settings(name)["learn_scans"], "40", "all or none");
    let (status, why) = tracker.refused(name, "settings", &json!({ "name": "x" }));
    assert!(status == 400 && why.contains("rename"), "{why}");

    let newest = |line: &Value, kind: &str| {
        let events = line["events"].as_array().into_iter().flatten().filter(|event| event["kind"] == kind);
        events.filter_map(|event| event["number"].as_u64()).max()
    };
    let before = newest(&tracker.until("it watches", name, watches), "learn-started");
    assert_eq!(tracker.does(name, "learn", &json!({ "scans": 60 })).0, 200);
    let learned = |line: &Value| {
        let begun = newest(line, "learn-started");
        begun > before && newest(line, "learned") > begun && watches(line)
    };
    tracker.until("it has learned", name, learned);
    let (status, why) = tracker.refused(name, "absorb", &json!({}));
    assert!(status == 409 && why.contains("nothing stands out"), "{why}");
    *bench.chair.lock().unwrap() = true;
    let begun = Instant::now();
    let chair = loop {
        let (status, things) = tracker.ask(&format!("GET /api/module/{name}/things"), &Value::Null);
        assert_eq!(status, 200, "{things}");
        if things[0]["is_still"] == true {
            break things[0].clone();
        }
        assert!(begun.elapsed() < PATIENCE, "the chair does not stand still: {things}");
        std::thread::sleep(Duration::from_millis(200));
    };
    assert!((0.8..1.0).contains(&chair["range_m"].as_f64().unwrap()), "{chair}");
    let (status, why) = tracker.refused(name, "absorb", &json!({ "bearing": 100.0 }));
    assert!(status == 409 && why.starts_with("nothing stands out at 100°, but: "), "{why}");
    let (status, absorbed) = tracker.does(name, "absorb", &json!({ "bearing": chair["bearing_deg"] }));
    assert!(status == 200 && absorbed["beams"].as_u64() > Some(40), "{absorbed}");

    let to = format!("hall-{}", std::process::id());
    let (status, renamed) = tracker.does(name, "rename", &json!({ "name": to }));
    assert_eq!((status, &renamed["name"]), (200, &json!(to)));
    assert_eq!(renamed["revision"], tracker.ask("GET /api/site", &Value::Null).1["revision"]);
    let text = std::fs::read_to_string(&tracker.site).unwrap();
    assert!(text.contains(&format!("name = \"{to}\" # above the shelf")), "the comment stays: {text}");
    assert_eq!(site_file::load(&tracker.site).unwrap().modules[0].name, to);
    tracker.until("it has its name", &to, watches);
    let (status, why) = tracker.refused(&to, "rename", &json!({ "name": "" }));
    assert!(status == 409 && why.contains("1 to 32 bytes"), "{why}");
    let (status, why) = tracker.refused(&to, "rename", &json!({ "name": to }));
    assert!(status == 409 && why.contains("already"), "{why}");
    for body in [json!({}), json!({ "seconds": 60 }), json!({ "seconds": 0 })] {
        assert_eq!(tracker.does(&to, "identify", &body), (200, json!({})), "{body}");
    }
    let (status, why) = tracker.refused(&to, "identify", &json!({ "seconds": 61 }));
    assert!(status == 400 && why == "seconds: a module blinks for 60 s at most", "{why}");
    assert_eq!(tracker.does(&to, "restart", &json!({})).0, 200);
    tracker.until("it is back", &to, watches);

    let (status, why) = tracker.refused("none", "learn", &json!({}));
    assert!(status == 404 && why == "there is no module \"none\"", "{why}");
    let (status, why) = tracker.refused(&to, "blink", &json!({}));
    assert!(status == 404 && why.contains("learn, absorb, restart, rename, settings"), "{why}");
    for (action, wrong) in
        [("learn", json!(7)), ("learn", json!({ "scans": -1 })), ("restart", json!({ "now": 1 }))]
    {
        assert_eq!(tracker.refused(&to, action, &wrong).0, 400, "{action} {wrong}");
    }
}

#[test]
fn a_client_that_leaves_ends_no_rename_between_the_module_and_the_site() {
    let bench = Bench::start("leaves");
    let tracker = Tracker::start(&bench);
    let mut name = bench.name.clone();
    tracker.until("it watches", &name, watches);
    for number in 0..10 {
        let to = format!("{}-{number}", bench.name);
        let body = json!({ "name": to }).to_string();
        let request = format!(
            "POST /api/module/{name}/rename HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n\
             Content-Length: {}\r\n\r\n{body}",
            body.len()
        );
        let mut client = TcpStream::connect(tracker.address).unwrap();
        client.write_all(request.as_bytes()).unwrap();
        // At some of these delays the module is being asked.
        std::thread::sleep(Duration::from_millis(number));
        drop(client);
        let begun = Instant::now();
        while !tracker.has(&to) && begun.elapsed() < Duration::from_secs(3) {
            std::thread::sleep(Duration::from_millis(20));
        }
        if !tracker.has(&to) {
            // It had left before it was heard.
            continue;
        }
        let begun = Instant::now();
        while site_file::load(&tracker.site).unwrap().modules[0].name != to {
            assert!(
                begun.elapsed() < Duration::from_secs(10),
                "{to} is the module's name, and not the site's"
            );
            std::thread::sleep(Duration::from_millis(20));
        }
        name = to;
    }
    assert_ne!(name, bench.name, "none was renamed");
}

#[test]
fn a_module_with_a_key_is_looked_after_on_the_map_in_a_browser() {
    let Some(mut page) = chromium::start() else { return };
    let bench = Bench::start("sealed");
    let tracker = Tracker::start(&bench);
    let name = bench.name.as_str();
    tracker.until("it watches", name, watches);
    let code = kehai_tracking::keys::Label(LABEL).text();
    let keys = tracker.site.with_extension("keys");
    let claimed = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"))
        .args(["module", "claim", &bench.address.to_string(), "--code", &code, "--keys"])
        .arg(&keys)
        .output()
        .unwrap();
    assert!(claimed.status.success(), "{claimed:?}");
    tracker.until("it speaks sealed", name, |line| line["is_sealed"] == true && watches(line));

    // Twice as often as a module has places for sessions.
    for _ in 0..12 {
        tracker.settings(name);
    }
    page.size(1440, 900, 1);
    page.scheme("light");
    page.open(&format!("http://{}/", tracker.address));
    page.wait("the map is live", "document.querySelector('#link').dataset.state === 'live'");
    page.wait("the module is drawn", &format!("document.querySelector('[data-module=\"{name}\"]') !== null"));
    page.value(&format!("document.querySelector('[data-module=\"{name}\"]').focus()"));
    page.key("Enter", 13);
    let button = |words: &str| {
        format!(
            "[...document.querySelectorAll('.module-actions button')].find((one) => one.innerText === '{words}')"
        )
    };
    page.wait("what can be done is there", &format!("{}?.offsetParent !== null", button("Settings…")));
    page.value(&format!("{}.click()", button("Blink")));
    page.wait(
        "it blinks",
        "document.querySelector('.module-actions').innerText.includes('its light flickers')",
    );
    page.value(&format!("{}.click()", button("Settings…")));
    page.wait("its settings are read", "document.querySelector('#setting-learn_scans')?.value > 0");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    page.picture(&folder.join("module-settings.png"));
    page.value("document.querySelector('#setting-learn_scans').value = 'many'");
    page.value(&format!("{}.click()", button("Store")));
    page.wait(
        "it says what is wrong",
        "document.querySelector('.module-actions .error').innerText.startsWith('learn_scans=many: ')",
    );
    page.value("document.querySelector('#setting-learn_scans').value = '45'");
    page.value(&format!("{}.click()", button("Store")));
    page.wait(
        "stored",
        "document.querySelector('.module-actions').innerText.includes('Stored: scans to learn from.')",
    );
    assert_eq!(tracker.settings(name)["learn_scans"], "45");
    page.fits_a_phone("module actions");
    *bench.chair.lock().unwrap() = true;
    page.wait(
        "the chair can be absorbed",
        &format!(
            "document.querySelector('.things button:not(:disabled)') !== null || ({}.disabled || {}.click(), false)",
            button("Absorb…"),
            button("Absorb…")
        ),
    );
    page.wait("it is shown on the map", "document.querySelectorAll('.thing circle').length === 1");
    page.picture(&folder.join("module-things.png"));
    page.value("document.querySelector('.things button:not(:disabled)').click()");
    page.wait("absorbed", "document.querySelector('.module-actions').innerText.includes('Absorbed: ')");
    page.value(&format!("{}.click()", button("Rename…")));
    page.wait("its name is asked for", "document.activeElement?.id === 'module-name'");
    page.write("corner");
    page.value("document.querySelector('.module-actions form').requestSubmit()");
    page.wait("it has its name", "document.querySelector('#detail h2')?.innerText === 'corner'");
    page.wait("on the map, too", "document.querySelector('[data-module=corner]') !== null");
    page.wait("it can be asked", &format!("{}?.offsetParent != null", button("Learn")));
    page.value(&format!("{}.click()", button("Learn")));
    page.wait("it asks first", &format!("{} !== undefined", button("Nobody is there: learn")));
    page.picture(&folder.join("module-learn.png"));
    page.value(&format!("{}.click()", button("Nobody is there: learn")));
    page.wait(
        "it learns",
        "document.querySelector('.module-actions').innerText.includes('learns the empty room')",
    );
    // What it has learned with the chair has the shape of a person there, until a user says what it is.
    let suspects = |line: &Value| {
        line["alarms"].as_array().into_iter().flatten().any(|alarm| alarm["name"] == "suspect")
    };
    let line = tracker.until("the chair could be a person", "corner", suspects);
    let place = line["suspects"][0].clone();
    assert!((0.8..0.9).contains(&place[1].as_f64().unwrap()), "{line}");
    page.wait("it can be said", &format!("{}?.offsetParent != null", button("It is furniture…")));
    page.value(&format!("{}.click()", button("It is furniture…")));
    page.wait("the map shows where", "document.querySelectorAll('.thing circle').length === 1");
    page.picture(&folder.join("module-furniture.png"));
    page.value(&format!("{}.click()", button("It is furniture")));
    tracker.until("the alarm is over", "corner", |line| watches(line) && !suspects(line));
    assert_eq!(json!(site_file::load(&tracker.site).unwrap().modules[0].furniture), json!([place]));
    page.wait("nothing is left to say", &format!("{}.offsetParent === null", button("It is furniture…")));
    assert_eq!(tracker.does("corner", "learn", &json!({ "scans": 40 })).0, 200);
    tracker.until("it learns anew", "corner", |line| line["state"] == "learning");
    let anew = tracker.until("it has learned", "corner", watches);
    assert!(!suspects(&anew), "the chair is furniture in the next background, too: {anew}");
    assert_eq!(page.errors, Vec::<String>::new());
}
