//! Headless Chromium, driven through its DevTools protocol: JSON over a WebSocket.
//!
//! ```text
//!   test ─▶ {"id": 7, "method": "Runtime.evaluate", …} ─▶ chromium ─▶ {"id": 7, "result": …}
//!                                                               └────▶ events: errors, requests
//! ```
//!
//! The browser has one family of fonts, DejaVu, as a bare Debian has: a page looks alike on every machine.
//!
//! No crate stands in for this client. headless_chrome and chromiumoxide compile the whole protocol, 1.5 minutes of
//! processor time for the six domains used here; fantoccini needs chromedriver and hears no events of the page.

#![allow(dead_code, reason = "each test does a part of what a visitor can")]

mod accessible;
mod phone;

use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use base64::prelude::{BASE64_STANDARD, Engine};
use serde_json::{Value, json};
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Message, WebSocket};

/// Programs that are Chromium, by the names distributions give it.
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// A wait longer than this is a failure, not slowness.
const PATIENCE: Duration = Duration::from_secs(150);

/// Between two looks at the page.
const LOOK: Duration = Duration::from_millis(50);

/// The only fonts of the browser, whatever family a page asks for.
const FONTS: &str = r#"<?xml version="1.0"?>
<!DOCTYPE fontconfig SYSTEM "urn:fontconfig:fonts.dtd">
<fontconfig>
  <dir>/usr/share/fonts/truetype/dejavu</dir>
  <match target="pattern">
    <edit name="family" mode="append" binding="strong"><string>DejaVu Sans</string></edit>
  </match>
  <cachedir>FOLDER/fonts</cachedir>
</fontconfig>
"#;

/// One of the files of those fonts (`fonts-dejavu-core`).
const FONT: &str = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";

/// Where pictures of the documentation go: under `target/`, or with `KEHAI_SCREENSHOTS=1` to `docs/images`.
pub fn pictures() -> PathBuf {
    if std::env::var_os("KEHAI_SCREENSHOTS").is_some() {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/images")
    } else {
        PathBuf::from(env!("CARGO_TARGET_TMPDIR"))
    }
}

/// A browser with an empty page. Without Chromium: fails under CI, else says so.
pub fn start() -> Option<Page> {
    let program = find();
    if program.is_none() {
        test_support::fail_in_ci_else_skip("no Chromium (Debian: apt-get install chromium)");
    }
    program.map(Page::new)
}

/// The program, if it is installed.
fn find() -> Option<&'static str> {
    let runs = |name: &&str| {
        let quiet = || Stdio::null();
        Command::new(name)
            .arg("--version")
            .stdout(quiet())
            .stderr(quiet())
            .status()
            .is_ok_and(|status| status.success())
    };
    NAMES.into_iter().find(runs)
}

/// A page in a browser of its own.
pub struct Page {
    browser: Child,
    socket: WebSocket<TcpStream>,
    session: String,
    next_id: u64,
    /// What the page's scripts failed with.
    pub errors: Vec<String>,
    /// Addresses the page asked for.
    pub requests: Vec<String>,
    /// Width, height, and real pixels to one.
    metrics: (u32, u32, u32),
    _profile: tempfile::TempDir,
}

impl Page {
    fn new(program: &str) -> Self {
        assert!(Path::new(FONT).exists(), "no {FONT}: apt-get install fonts-dejavu-core");
        let profile = tempfile::tempdir().unwrap();
        let fonts = profile.path().join("fonts.conf");
        std::fs::write(&fonts, FONTS.replace("FOLDER", &profile.path().display().to_string())).unwrap();
        let mut browser = Command::new(program)
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"])
            .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
            .args(["--remote-debugging-port=0", "--force-color-profile=srgb"])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .env("FONTCONFIG_FILE", fonts)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut said = BufReader::new(browser.stderr.take().unwrap()).lines();
        let address = said
            .by_ref()
            .map_while(Result::ok)
            .find_map(|line| Some(line.split_once("listening on ws://")?.1.to_owned()))
            .expect("Chromium does not say where it listens");
        // A full pipe would stop it.
        std::thread::spawn(move || said.for_each(drop));
        let (host, _) = address.split_once('/').unwrap();
        let stream = TcpStream::connect(host).unwrap();
        let config =
            WebSocketConfig::default().max_message_size(Some(64 << 20)).max_frame_size(Some(64 << 20));
        let (socket, _) =
            tungstenite::client::client_with_config(format!("ws://{address}"), stream, Some(config)).unwrap();
        let mut page = Self {
            browser,
            socket,
            session: String::new(),
            next_id: 1,
            errors: Vec::new(),
            requests: Vec::new(),
            metrics: (800, 600, 1),
            _profile: profile,
        };
        let target = page.call("Target.createTarget", json!({ "url": "about:blank" }));
        let attach = json!({ "targetId": target["targetId"], "flatten": true });
        page.session = page.call("Target.attachToTarget", attach)["sessionId"].as_str().unwrap().to_owned();
        for domain in ["Page", "Runtime", "Network"] {
            page.call(&format!("{domain}.enable"), json!({}));
        }
        // Whatever the machine's own language is.
        page.language("en-US");
        page
    }

    /// Does what a method of the protocol says.
    pub fn call(&mut self, method: &str, params: Value) -> Value {
        self.ask(method, params).unwrap_or_else(|error| panic!("{method}: {error}"))
    }

    /// The answer to a method of the protocol, or the browser's error.
    fn ask(&mut self, method: &str, params: Value) -> Result<Value, Value> {
        let id = self.next_id;
        self.next_id += 1;
        let mut message = json!({ "id": id, "method": method, "params": params });
        if !self.session.is_empty() {
            message["sessionId"] = json!(self.session);
        }
        self.socket.send(Message::text(message.to_string())).unwrap();
        loop {
            let Message::Text(text) = self.socket.read().unwrap() else { continue };
            let mut answer: Value = serde_json::from_str(&text).unwrap();
            if answer["id"] == json!(id) {
                let error = answer["error"].take();
                return if error.is_null() { Ok(answer["result"].take()) } else { Err(error) };
            }
            self.note(&answer);
        }
    }

    fn note(&mut self, event: &Value) {
        let params = &event["params"];
        match event["method"].as_str() {
            Some("Runtime.exceptionThrown") => self.errors.push(params["exceptionDetails"].to_string()),
            Some("Network.requestWillBeSent") => {
                self.requests.push(params["request"]["url"].as_str().unwrap_or_default().to_owned());
            }
            Some("Network.webSocketCreated") => {
                self.requests.push(params["url"].as_str().unwrap_or_default().to_owned());
            }
            _ => {}
        }
    }

    /// What the browser wishes to read from the next page on, as BCP 47 has it.
    pub fn language(&mut self, tag: &str) {
        let agent = self.value("navigator.userAgent");
        let wish = json!({ "userAgent": agent, "acceptLanguage": tag });
        self.call("Emulation.setUserAgentOverride", wish);
    }

    /// Opens an address.
    pub fn open(&mut self, address: &str) {
        self.call("Page.navigate", json!({ "url": address }));
    }

    /// The value of an expression in the page.
    pub fn value(&mut self, expression: &str) -> Value {
        self.evaluate(expression).unwrap_or_else(|error| panic!("{expression}: {error}"))
    }

    fn evaluate(&mut self, expression: &str) -> Result<Value, Value> {
        let params = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let mut result = self.ask("Runtime.evaluate", params)?;
        let thrown = result["exceptionDetails"].take();
        if thrown.is_null() { Ok(result["result"]["value"].take()) } else { Err(thrown) }
    }

    /// Waits until an expression in the page is true; `what` says what did not happen.
    pub fn wait(&mut self, what: &str, expression: &str) {
        let begun = Instant::now();
        // What is not there yet is not true yet.
        let careful =
            format!("(() => {{ try {{ return Boolean({expression}); }} catch {{ return false; }} }})()");
        // A page that another one takes the place of meanwhile answers with an error.
        while self.evaluate(&careful) != Ok(json!(true)) {
            if begun.elapsed() > PATIENCE {
                let shown = self.value("document.body?.innerText");
                panic!("{what}: never. The page shows {shown}, and failed with {:?}", self.errors);
            }
            std::thread::sleep(LOOK);
        }
    }

    /// Waits until the layout after the last change is done: before the frame after the next.
    pub fn settle(&mut self) {
        self.value("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))");
    }

    /// The middle of what a selector finds, in pixels.
    pub fn middle(&mut self, selector: &str) -> [f64; 2] {
        // Measured while the map is fitted to a new size, the place would be that of before.
        self.settle();
        let place = self.value(&format!(
            "(() => {{ const box = document.querySelector({selector:?}).getBoundingClientRect(); \
             return [box.x + box.width / 2, box.y + box.height / 2]; }})()"
        ));
        [0, 1].map(|axis| place[axis].as_f64().unwrap_or_else(|| panic!("{selector} has no place")))
    }

    /// Clicks on what a selector finds, with a real mouse; what is beyond the edge of the page is scrolled to first.
    pub fn click(&mut self, selector: &str) {
        self.value(&format!("document.querySelector({selector:?}).scrollIntoView({{ block: 'nearest' }})"));
        let at = self.middle(selector);
        self.drag(at, at);
    }

    /// Presses the mouse at one place and releases it at another.
    pub fn drag(&mut self, from: [f64; 2], to: [f64; 2]) {
        let between = [0, 1].map(|axis| f64::midpoint(from[axis], to[axis]));
        for (kind, [x, y], buttons) in [
            ("mouseMoved", from, 0),
            ("mousePressed", from, 1),
            ("mouseMoved", between, 1),
            ("mouseMoved", to, 1),
            ("mouseReleased", to, 0),
        ] {
            let button = if kind == "mouseMoved" && buttons == 0 { "none" } else { "left" };
            let event = json!({ "type": kind, "x": x, "y": y, "button": button, "buttons": buttons, "clickCount": 1 });
            self.call("Input.dispatchMouseEvent", event);
        }
    }

    /// Types into whatever has the focus.
    pub fn write(&mut self, text: &str) {
        self.call("Input.insertText", json!({ "text": text }));
    }

    /// Presses a key that writes nothing.
    pub fn key(&mut self, name: &str, code: u32) {
        for kind in ["keyDown", "keyUp"] {
            let event = json!({ "type": kind, "key": name, "code": name, "windowsVirtualKeyCode": code });
            self.call("Input.dispatchKeyEvent", event);
        }
    }

    /// Gives the page a size, in pixels; `dense` as many real pixels to one.
    pub fn size(&mut self, width: u32, height: u32, dense: u32) {
        self.metrics = (width, height, dense);
        let metrics =
            json!({ "width": width, "height": height, "deviceScaleFactor": dense, "mobile": dense > 1 });
        self.call("Emulation.setDeviceMetricsOverride", metrics);
    }

    /// Light or dark.
    pub fn scheme(&mut self, scheme: &str) {
        let features = json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] });
        self.call("Emulation.setEmulatedMedia", features);
    }

    /// As a system shows pages that has its own few colours.
    pub fn forced_colors(&mut self) {
        let features = json!({ "features": [{ "name": "forced-colors", "value": "active" }] });
        self.call("Emulation.setEmulatedMedia", features);
    }

    /// As a user has it who wants no motion.
    pub fn reduce_motion(&mut self) {
        let features = json!({ "features": [{ "name": "prefers-reduced-motion", "value": "reduce" }] });
        self.call("Emulation.setEmulatedMedia", features);
    }

    /// Takes a picture of what is shown.
    pub fn picture(&mut self, file: &Path) {
        let answer = self.call("Page.captureScreenshot", json!({}));
        let bytes = BASE64_STANDARD.decode(answer["data"].as_str().unwrap()).unwrap();
        assert!(bytes.starts_with(b"\x89PNG"), "no picture");
        std::fs::write(file, bytes).unwrap();
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        let _ = self.browser.kill();
        let _ = self.browser.wait();
    }
}
