//! `kehai-sim module` as people meet it: beside `kehai-sim sensor`, with a host that subscribes; and what it refuses.

use std::io::{BufRead, BufReader};
use std::net::UdpSocket;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use kehai::wire::{Cookie, Identity, Message, Request};

const PATIENCE: Duration = Duration::from_secs(60);

/// A program that is ended with the test, and what it says on stderr until `marker`.
struct Program(Child);

impl Program {
    fn start(arguments: &[&str], marker: &str) -> (Self, String) {
        let mut child = Command::new(env!("CARGO_BIN_EXE_kehai-sim"))
            .args(arguments)
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program runs");
        let mut lines = BufReader::new(child.stderr.take().expect("piped")).lines();
        let line = lines.find_map(|line| line.ok().filter(|line| line.contains(marker)));
        // Somebody has to read the rest.
        std::thread::spawn(move || lines.count());
        (Self(child), line.expect("it says where it is"))
    }

    /// Ends it as Ctrl-C does; it must end well.
    fn interrupt(mut self) {
        let sent = Command::new("kill").args(["-INT", &self.0.id().to_string()]).status();
        assert!(sent.expect("kill runs").success());
        assert!(self.0.wait().expect("it ends").success());
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The word behind `before` in `line`.
fn word<'a>(line: &'a str, before: &str) -> &'a str {
    let behind = line.split_once(before).unwrap_or_else(|| panic!("{before} in {line}")).1;
    behind.split([' ', ',', ';']).next().unwrap_or(behind)
}

struct Host {
    socket: UdpSocket,
    identity: Identity,
    cookie: Cookie,
    next_id: u32,
}

impl Host {
    fn new(module: &str) -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").expect("a socket");
        socket.connect(module).expect("an address");
        socket.set_read_timeout(Some(Duration::from_millis(500))).expect("a time");
        Self { socket, identity: Identity::default(), cookie: Cookie::NONE, next_id: 1 }
    }

    fn ask(&mut self, request: Request<'_>) {
        let mut datagram = [0; 1400];
        let length =
            request.encode(self.identity, self.next_id, self.cookie, &mut datagram).expect("it fits");
        self.next_id += 1;
        self.socket.send(&datagram[..length]).expect("sent");
    }

    /// Subscribes and renews until `found` finds something.
    fn look<T>(&mut self, mut found: impl FnMut(&Message<'_>) -> Option<T>) -> T {
        let (begin, mut renewed) = (Instant::now(), None::<Instant>);
        let mut buffer = [0; 1500];
        while begin.elapsed() < PATIENCE {
            if renewed.is_none_or(|renewed| renewed.elapsed() > Duration::from_secs(1)) {
                self.ask(Request::Subscribe { t1: [0; 8] });
                renewed = Some(Instant::now());
            }
            let Ok(length) = self.socket.recv(&mut buffer) else { continue };
            let (header, message) = Message::decode(&buffer[..length]).expect("a message of the module");
            self.identity = header.identity;
            if let Message::Cookie { cookie, .. } = message {
                self.cookie = cookie;
                renewed = None;
            }
            if let Some(found) = found(&message) {
                return found;
            }
        }
        panic!("nothing of the kind within {PATIENCE:?}");
    }

    /// `count` reports: their sequences and background versions.
    fn reports(&mut self, count: usize) -> Vec<(u32, u16)> {
        let mut reports = Vec::new();
        self.look(|message| {
            if let Message::Report(report) = message {
                reports.push((report.head.sequence, report.head.background_version));
            }
            (reports.len() >= count).then_some(())
        });
        reports
    }
}

#[test]
fn a_host_gets_the_reports_of_a_module_beside_a_sensor_over_tcp() {
    let store = std::env::temp_dir().join(format!("kehai-{}-module.flash", std::process::id()));
    let _ = std::fs::remove_file(&store);
    let (sensor, line) =
        Program::start(&["sensor", "--model", "ust-10lx", "--tcp", "127.0.0.1:0"], "listening on");
    let place = format!("tcp://{}", word(&line, "listening on "));
    let arguments = [
        "module",
        "--sensor",
        &place,
        "--listen",
        "127.0.0.1:0",
        "--name",
        "hall",
        "--store",
        store.to_str().unwrap(),
    ];
    let (module, line) = Program::start(&arguments, " at ");
    assert!(line.contains("start 1;"), "{line}");
    let mut host = Host::new(word(&line, " at "));
    let first = host.reports(10);
    assert!(first.windows(2).all(|pair| pair[1].0 == pair[0].0 + 1), "{first:?}");
    host.ask(Request::Info);
    let name = host.look(|message| match message {
        Message::Info(info) => Some((info.name.to_owned(), info.board.to_owned())),
        _ => None,
    });
    assert_eq!(name, ("hall".to_owned(), "pc".to_owned()));
    // It learns, and stores what it has learned.
    host.look(|message| match message {
        Message::Health(health) if health.head.storing => Some(()),
        _ => None,
    });
    host.look(|message| match message {
        Message::Report(report) if report.head.background_version == 1 => Some(()),
        _ => None,
    });
    module.interrupt();
    let (module, line) = Program::start(&arguments, " at ");
    assert!(line.contains("start 2;"), "{line}");
    let mut host = Host::new(word(&line, " at "));
    assert!(host.reports(3).iter().all(|(_, version)| *version == 1), "the background was kept");
    module.interrupt();
    sensor.interrupt();
    std::fs::remove_file(&store).expect("the store is a file");
}

#[cfg(target_os = "linux")]
#[test]
fn a_module_finds_a_sensor_on_a_serial_device_at_the_wrong_speed() {
    let link = std::env::temp_dir().join(format!("kehai-{}-serial", std::process::id()));
    let device = link.to_str().unwrap();
    let sensor =
        ["sensor", "--model", "urg-04lx", "--pty", device, "--baud", "57600", "--start", "streaming"];
    let (sensor, _) = Program::start(&sensor, "serial device");
    let place = format!("serial://{device}");
    let (module, line) = Program::start(&["module", "--sensor", &place, "--listen", "127.0.0.1:0"], " at ");
    let mut host = Host::new(word(&line, " at "));
    assert_eq!(host.reports(5).len(), 5);
    module.interrupt();
    sensor.interrupt();
}

#[test]
fn wrong_arguments_are_refused_in_one_line() {
    let refused = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_kehai-sim")).args(arguments).output().expect("it runs");
        let text = String::from_utf8(output.stderr).expect("text");
        (output.status.code().unwrap_or(0), text.lines().next().unwrap_or_default().to_owned())
    };
    let (status, line) = refused(&["module", "--sensor", "ttyUSB0"]);
    assert_eq!(status, 2);
    assert!(line.ends_with("a sensor is tcp://HOST:PORT or serial:///dev/NAME"), "{line}");
    assert_eq!(refused(&["module", "--sensor", "tcp://here"]).0, 2);
    assert_eq!(refused(&["module"]).0, 2);
    let place = ["module", "--sensor", "tcp://127.0.0.1:1"];
    let (status, line) = refused(&[place.as_slice(), &["--listen", "here"]].concat());
    assert_eq!(status, 2);
    assert!(line.contains("an address to listen at is IPv4:PORT"), "{line}");
    assert_eq!(refused(&[place.as_slice(), &["--name", ""]].concat()).0, 2);
    let (status, line) = refused(&[place.as_slice(), &["--store", "/no/such/file"]].concat());
    assert_eq!(status, 1);
    assert!(line.starts_with("kehai-sim: /no/such/file: "), "{line}");
    let (status, line) = refused(&[place.as_slice(), &["--listen", "192.0.2.1:4040"]].concat());
    assert_eq!(status, 1);
    assert!(line.starts_with("kehai-sim: cannot listen at 192.0.2.1:4040: "), "{line}");
}
