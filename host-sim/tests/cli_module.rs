//! `kehai-sim module` as people meet it: beside `kehai-sim sensor`, with a host that subscribes; and its refusals.

#[path = "support/program.rs"]
mod program;

use std::io::{ErrorKind, Read, Write};
use std::net::TcpListener;
use std::process::Command;
use std::time::{Duration, Instant};

use kehai::floor::sensfloor::Layout;
use kehai::wire::{Message, Request};
use kehai_emulator::pc::host::Host;
use kehai_emulator::ports::free_tcp;
use kehai_emulator::sensfloor::{SensFloor, Signal, Sole};
use kehai_emulator::serve::SerialDevice;
use program::{Program, word};

fn host_of(module: &str) -> Host {
    Host::new(module.parse().expect("an address")).expect("a socket")
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
    let mut host = host_of(word(&line, " at "));
    host.more(10);
    let pairs = host.reports.windows(2);
    assert!(pairs.into_iter().all(|pair| pair[1].head.sequence == pair[0].head.sequence + 1));
    host.ask(Request::Info);
    let name = host.look(|_, message| match message {
        Message::Info(info) => Some((info.name.to_owned(), info.board.to_owned())),
        _ => None,
    });
    assert_eq!(name, ("hall".to_owned(), "pc".to_owned()));
    host.ask(Request::Identify { seconds: 1 });
    let said = module.says(" blinks: it is this one");
    assert!(said.starts_with("module hall ("), "{said}");
    module.says(" blinks no more");
    // It learns, and stores what it has learned.
    host.health(|health| health.head.storing);
    while host.more(1).head.background_version != 1 {}
    module.interrupt();
    let (module, line) = Program::start(&arguments, " at ");
    assert!(line.contains("start 2;"), "{line}");
    let mut host = host_of(word(&line, " at "));
    host.more(3);
    assert!(host.reports.iter().all(|report| report.head.background_version == 1), "the background was kept");
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
    let mut host = host_of(word(&line, " at "));
    host.more(5);
    module.interrupt();
    sensor.interrupt();
}

#[test]
fn a_sensor_that_cannot_be_reached_is_named_with_the_reason() {
    let place = "serial:///dev/no-such-device";
    let (module, line) =
        Program::start(&["module", "--sensor", place, "--listen", "127.0.0.1:0"], "sensor at");
    let wanted = "sensor at serial:///dev/no-such-device: No such file or directory (os error 2); \
                  it is tried again and again";
    assert_eq!(line, wanted);
    module.interrupt();
    // No program listens on a port that is free.
    let port = free_tcp().unwrap();
    let place = format!("tcp://127.0.0.1:{port}");
    let (module, line) =
        Program::start(&["module", "--sensor", &place, "--listen", "127.0.0.1:0"], "sensor at");
    assert!(line.starts_with(&format!("sensor at {place}: Connection refused")), "{line}");
    module.interrupt();
}

#[test]
fn a_sensor_that_does_not_answer_is_named() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let place = format!("tcp://{}", listener.local_addr().unwrap());
    let (module, line) =
        Program::start(&["module", "--sensor", &place, "--listen", "127.0.0.1:0"], "sensor at");
    assert_eq!(line, format!("sensor at {place}: no answer; is it switched on, and does it speak SCIP?"));
    module.interrupt();
}

/// A SensFloor of 3 × 2 tiles over TCP, for one client, with a sole on panel (1, 1).
fn serve_floor(listener: &TcpListener) {
    let signal = Signal::new(&Layout::new(10, (1, 1), (3, 2)).unwrap(), 7);
    let mut floor = SensFloor::new(signal, |_| vec![Sole { at: (0.375, 0.375), ahead: (0.0, 1.0) }]);
    let (mut client, _) = listener.accept().unwrap();
    client.set_read_timeout(Some(Duration::from_millis(10))).unwrap();
    let begin = Instant::now();
    let mut bytes = [0; 64];
    loop {
        let now_us = begin.elapsed().as_micros() as u64;
        match client.read(&mut bytes) {
            Ok(0) => return,
            Ok(count) => floor.receive(&bytes[..count], now_us),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(_) => return,
        }
        for sent in floor.take_output(now_us) {
            if client.write_all(&sent.bytes).is_err() {
                return;
            }
        }
    }
}

#[test]
fn a_host_tells_a_module_beside_a_floor_its_tiles_and_is_told_where_a_foot_is() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let place = format!("tcp://{}", listener.local_addr().unwrap());
    let floor = std::thread::spawn(move || serve_floor(&listener));
    let (module, line) = Program::start(&["module", "--floor", &place, "--listen", "127.0.0.1:0"], " at ");
    let mut host = host_of(word(&line, " at "));
    host.subscribe();
    host.ask(Request::SetSettings { text: "tiles=10,1,1,3,2" });
    host.look(|_, message| matches!(message, Message::Done { .. }).then_some(()));
    let size = host.look(|_, message| match message {
        Message::Pressed(pressed) => {
            let down = pressed.down.iter().next().map(|bits| bits >> 7 & 1 == 1);
            down.filter(|is_down| *is_down).map(|_| (pressed.columns, pressed.rows))
        }
        _ => None,
    });
    assert_eq!(size, (6, 4));
    module.interrupt();
    floor.join().unwrap();
}

#[test]
fn a_floor_that_does_not_answer_is_named() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let place = format!("tcp://{}", listener.local_addr().unwrap());
    let (module, line) =
        Program::start(&["module", "--floor", &place, "--listen", "127.0.0.1:0"], "floor at");
    let hint = "is it switched on, and does the setting `tiles` name its group and its tiles?";
    assert_eq!(line, format!("floor at {place}: no answer; {hint}"));
    module.interrupt();
}

#[test]
fn a_module_that_forgets_everything_begins_with_a_larger_number_each_time() {
    let start = || -> u32 {
        let arguments = ["module", "--sensor", "tcp://127.0.0.1:1", "--listen", "127.0.0.1:0"];
        let (module, line) = Program::start(&arguments, " at ");
        module.interrupt();
        word(&line, "start ").parse().unwrap()
    };
    let first = start();
    assert!(first > 1_700_000_000, "{first}");
    // The next second has the next number.
    std::thread::sleep(Duration::from_millis(1100));
    let second = start();
    assert!(second > first, "{second} after {first}");
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
    assert_eq!(refused(&["module", "--sensor", "tcp://here:1", "--floor", "tcp://here:1"]).0, 2);
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
