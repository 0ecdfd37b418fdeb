//! The clients in other languages, and a real tracker: as their READMEs show them.

mod described;
mod hall;
mod house;
mod http_client;

use std::io::{BufRead, BufReader};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver};

use hall::{Hall, PATIENCE, Tracker};
use host_tracker::access::roles::Role;
use host_tracker::web::Limits;
use house::{House, ZONE};
use kehai_tracking::snapshot::Snapshot;

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Python with `websockets`, which finds the client: `./ci.sh test` installs it.
fn python() -> Option<Command> {
    let name = std::env::var("KEHAI_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let has_it = Command::new(&name).args(["-c", "import websockets.sync.client"]).output();
    if !has_it.is_ok_and(|output| output.status.success()) {
        test_support::fail_in_ci_else_skip("no python3 with the package websockets");
        return None;
    }
    let mut python = Command::new(name);
    python.env("PYTHONPATH", project().join("clients/python")).env("NO_PROXY", "127.0.0.1").arg("-u");
    Some(python)
}

/// A script, and the lines that it prints.
struct Script {
    process: Child,
    lines: Receiver<String>,
}

impl Script {
    fn start(mut python: Command, text: &str) -> Self {
        let mut process = python.args(["-c", text]).stdout(Stdio::piped()).spawn().unwrap();
        let (tell, lines) = mpsc::channel();
        let stdout = BufReader::new(process.stdout.take().unwrap());
        std::thread::spawn(move || {
            stdout.lines().map_while(Result::ok).try_for_each(|line| tell.send(line)).ok();
        });
        Self { process, lines }
    }

    /// The next line that is as wanted, after any others.
    #[track_caller]
    fn until(&self, wanted: impl Fn(&str) -> bool) -> String {
        loop {
            let line = self.lines.recv_timeout(PATIENCE).unwrap();
            if wanted(&line) {
                return line;
            }
        }
    }
}

impl Drop for Script {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// The lines of the first example in a page's Python.
fn example(page: &str) -> String {
    let page = std::fs::read_to_string(project().join(page)).unwrap();
    let (_, rest) = page.split_once("```python\nfrom kehai ").unwrap();
    let (lines, _) = rest.split_once("```").unwrap();
    // What follows the three lines would be reached when people() ends, which is never.
    let lines = format!("from kehai {lines}");
    lines.lines().filter(|line| !line.is_empty()).take(3).map(|line| format!("{line}\n")).collect()
}

#[test]
fn the_pages_show_the_same_three_lines() {
    let lines = example("clients/python/README.md");
    assert!(lines.contains("people()") && lines.ends_with("    print(people)\n"), "{lines}");
    for page in ["README.md", "docs/api.md"] {
        assert_eq!(example(page), lines, "{page}");
    }
}

#[test]
fn three_lines_of_python_count_people_and_know_nothing_without_a_tracker() {
    let Some(python) = python() else { return };
    let hall = Hall::new(7);
    let start = |http: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
        command.args(hall.arguments(&hall.database)).args(["--http", http]);
        Tracker::start(command)
    };
    let tracker = start("127.0.0.1:0");
    let map = tracker.says("live map at ");
    let map = map.trim_end_matches('/');
    let lines = example("clients/python/README.md").replace("http://127.0.0.1:8420", map);
    let script = Script::start(python, &lines);
    let unknown = "{'left': None, 'right': None}";
    assert_eq!(script.until(|_| true), unknown, "before anything was learned");
    script.until(is_four);
    drop(tracker);
    script.until(|line| line == unknown);
    let tracker = start(map.trim_start_matches("http://"));
    script.until(is_four);
    drop(tracker);
}

/// Whether the line says that four people are there, as in `{'left': 1, 'right': 3}`.
fn is_four(line: &str) -> bool {
    let counts = line.trim_matches(['{', '}']).split(',').filter_map(|zone| zone.rsplit(' ').next());
    counts.map(|count| count.parse::<u32>().ok()).sum::<Option<u32>>() == Some(4)
}

#[test]
fn a_token_is_shown_and_a_wrong_one_is_refused_in_words() {
    let Some(python) = python() else { return };
    let house = House::of(ZONE);
    let token = house.token("screen", &[Role::View], None);
    house.frames.send_replace(std::sync::Arc::new(Snapshot { unix_ms: 7, ..Snapshot::default() }));
    let (url, token) = (format!("http://{}", house.server.address()), token.trim_start_matches("Bearer "));
    let text = format!(
        "from kehai import Refused, Tracker\n\
         print(Tracker('{url}', '{token}').state()['unix_ms'])\n\
         print(next(Tracker('{url}', '{token}').frames())['unix_ms'])\n\
         for asks in [lambda tracker: tracker.state(), lambda tracker: next(tracker.frames())]:\n\
         \x20   try: print(asks(Tracker('{url}', 'wrong')))\n\
         \x20   except Refused as why: print(why)\n"
    );
    let script = Script::start(python, &text);
    assert_eq!([(); 2].map(|()| script.until(|_| true)), ["7", "7"]);
    for _ in 0..2 {
        let why = script.until(|_| true);
        assert!(why.starts_with("401: log in at /login.html, or send a token"), "{why}");
    }
}

#[test]
fn what_no_further_try_can_mend_is_raised() {
    let Some(python) = python() else { return };
    let house = House::bound(ZONE, Limits::default(), true);
    let address = house.server.address();
    let text = format!(
        "from kehai import Tracker\n\
         try: Tracker('https://{address}').state()\n\
         except Exception as why: print(type(why).__name__, why)\n\
         for url in ['192.168.1.4:8420', 'http://', 'https://{address}', 'http://{address}']:\n\
         \x20   try:\n\
         \x20       for frame in Tracker(url).frames(): print(frame)\n\
         \x20   except Exception as why: print(type(why).__name__, why)\n"
    );
    let script = Script::start(python, &text);
    let asked = script.until(|_| true);
    assert!(asked.starts_with("SSLCertVerificationError "), "{asked}");
    let raised = [(); 4].map(|()| script.until(|_| true));
    assert_eq!(raised[0], "ValueError \"192.168.1.4:8420\": an address begins with http:// or https://");
    assert!(raised[1].starts_with("InvalidURI "), "{raised:?}");
    assert!(raised[2].starts_with("SSLCertVerificationError "), "{raised:?}");
    // As a refusal, or by versions of websockets that follow it, as an address that is none.
    assert!(raised[3].contains(&format!("https://{address}/ws")), "{raised:?}");
}

#[test]
fn python_asks_with_each_method_and_takes_answers_of_each_kind() {
    let Some(python) = python() else { return };
    let house = House::of(ZONE);
    house.frames.send_replace(std::sync::Arc::new(Snapshot { unix_ms: 7, ..Snapshot::default() }));
    let admin = house.token("admin", &[Role::Admin], None);
    let (url, admin) = (format!("http://{}", house.server.address()), admin.trim_start_matches("Bearer "));
    let text = format!(
        "from kehai import Refused, Tracker\n\
         tracker, png = Tracker('{url}', '{admin}'), b'\\x89PNG\\r\\n\\x1a\\n' + bytes(8)\n\
         print('# EOF' in tracker.get('/metrics'))\n\
         print(tracker.put('/api/picture', png, 'image/png'), tracker.get('/api/picture') == png)\n\
         print(tracker.get('/api/picture/place'), tracker.delete('/api/picture'))\n\
         site = tracker.get('/api/site')\n\
         print(list(tracker.put('/api/site', {{'site': site['site'], 'revision': site['revision']}})))\n\
         try: tracker.get('/api/picture')\n\
         except Refused as why: print(why)\n"
    );
    let script = Script::start(python, &text);
    let said = [(); 5].map(|()| script.until(|_| true));
    let expected = [
        "True",
        "{} True",
        "{'picture': True, 'place': None} {}",
        "['revision']",
        "404: there is no picture",
    ];
    assert_eq!(said, expected);
}

#[test]
fn no_token_is_sent_on_where_a_tracker_is_elsewhere() {
    let Some(python) = python() else { return };
    let house = House::bound(ZONE, Limits::default(), true);
    let token = house.token("screen", &[Role::View], None);
    let (address, token) = (house.server.address(), token.trim_start_matches("Bearer "));
    let certificate = house.folder.path().join("house.cert.pem");
    let text = format!(
        "import ssl; from kehai import Refused, Tracker\n\
         tls = ssl.create_default_context(cafile='{}')\n\
         tls.check_hostname = False\n\
         for token in [None, '{token}']:\n\
         \x20   for asks in [lambda tracker: tracker.state(), lambda tracker: next(tracker.frames())]:\n\
         \x20       try: print(asks(Tracker('http://{address}', token, tls)))\n\
         \x20       except Exception as why: print(type(why).__name__, why)\n",
        certificate.display()
    );
    let script = Script::start(python, &text);
    let raised = [(); 4].map(|()| script.until(|_| true));
    assert_eq!(raised[0], format!("Refused 307: it is at https://{address}/api/state"));
    assert!(raised[1].contains(&format!("https://{address}/ws")), "{raised:?}");
    for why in &raised[2..] {
        assert!(
            why.starts_with("Refused 426: here it is https:// alone: this token was sent in clear"),
            "{why}"
        );
    }
}

#[test]
fn a_tracker_that_is_silent_is_given_up_within_seconds() {
    let Some(python) = python() else { return };
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let text = format!(
        "import time; from kehai import Tracker\n\
         began = time.monotonic()\n\
         print(next(Tracker('http://{}').frames()), time.monotonic() - began)\n",
        listener.local_addr().unwrap()
    );
    let script = Script::start(python, &text);
    // It agrees to a WebSocket, then neither says anything nor takes a farewell.
    let _silent = tungstenite::accept(listener.accept().unwrap().0).unwrap();
    let said = script.until(|_| true);
    let waited_s: f64 = said.strip_prefix("None ").unwrap().parse().unwrap();
    assert!((5.0..9.0).contains(&waited_s), "{said}");
}

#[test]
fn every_name_in_the_types_is_defined() {
    let Some(mut python) = python() else { return };
    let text = "import typing, kehai.types as types\n\
                for known in vars(types).values():\n\
                \x20   if typing.is_typeddict(known): typing.get_type_hints(known)\n";
    let output = python.args(["-c", text]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn the_documents_are_valid_openapi() {
    let Some(mut python) = python() else { return };
    let has_it =
        Command::new(python.get_program()).args(["-c", "import openapi_spec_validator"]).output().unwrap();
    if !has_it.status.success() {
        test_support::fail_in_ci_else_skip("no python3 with the package openapi-spec-validator");
        return;
    }
    let output =
        python.args(["-m", "openapi_spec_validator"]).arg(project().join("docs/schemas/openapi.json"));
    let output = output.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
}
