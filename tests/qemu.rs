//! The real firmware image, run in QEMU. Guest time is read from its log.

#[path = "support/segment.rs"]
mod segment;

use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use host_sim::qemu::{self, Error, Line, Machine, Message, Network, PATIENCE, Port, Qemu, Switch};
use host_sim::serve::{Control, serve_pty};
use host_sim::source::StillRoom;
use host_sim::urg::model::URG_04LX;
use host_sim::urg::{Config, Urg};
use kehai::address;

const MAC: [u8; 6] = [0x52, 0x54, 0x00, 0x12, 0x34, 0x81];

/// The image, built once; `None`, with a message, where it cannot be built or run.
fn image() -> Option<&'static Path> {
    static IMAGE: OnceLock<Option<PathBuf>> = OnceLock::new();
    let build = || match qemu::image() {
        Ok(image) => Some(image),
        Err(error @ (Error::NoQemu | Error::NoTarget)) if std::env::var_os("CI").is_none() => {
            println!("{error}: nothing tested");
            None
        }
        Err(error) => panic!("{error}"),
    };
    IMAGE.get_or_init(build).as_deref()
}

/// An emulated sensor on a terminal, until dropped.
struct Sensor {
    terminal: PathBuf,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Sensor {
    fn start(config: Config) -> Self {
        let terminal = std::env::temp_dir().join(format!("kehai-sensor-{}", std::process::id()));
        let stop = Arc::new(AtomicBool::new(false));
        let (link, stopped) = (terminal.clone(), Arc::clone(&stop));
        let urg = Urg::new(config, Box::new(StillRoom::new(URG_04LX.geometry)), 0);
        let thread = std::thread::spawn(move || {
            serve_pty(&link, urg, &mut Control { stop: &stopped, on_status: &mut |_| {} }).unwrap();
        });
        let begin = Instant::now();
        while !terminal.exists() {
            assert!(begin.elapsed() < PATIENCE, "{} does not appear", terminal.display());
            std::thread::sleep(Duration::from_millis(5));
        }
        Self { terminal, stop, thread: Some(thread) }
    }
}

impl Drop for Sensor {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap();
        }
    }
}

fn start(image: &Path) -> Qemu {
    Qemu::start(&Machine { image, mac: MAC, line: Line::Datagrams, network: Network::User, flash: None })
        .unwrap()
}

/// Waits for `text` and fails with what QEMU and the log have to say.
#[track_caller]
fn wait_for(board: &mut Qemu, text: &str) -> Message {
    board.wait_for(text).unwrap_or_else(|error| panic!("{error}"))
}

/// Sends `datagram` to the module until it comes back.
fn echoes(board: &Qemu, datagram: &[u8]) {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(200))).unwrap();
    let mut answer = [0; 2000];
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        socket.send_to(datagram, board.module()).unwrap();
        if let Ok((len, _)) = socket.recv_from(&mut answer) {
            assert_eq!(&answer[..len], datagram);
            return;
        }
    }
    panic!("no answer from {}", board.module());
}

/// Looks at frames from the module until one will do.
fn frame<T>(port: &Port, mut look: impl FnMut(&[u8]) -> Option<T>) -> T {
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        if let Some(found) = port.receive(Duration::from_millis(100)).and_then(|frame| look(&frame)) {
            return found;
        }
    }
    panic!("no such frame");
}

#[test]
fn the_image_boots_names_itself_and_gets_an_address_by_dhcp() {
    let Some(image) = image() else { return };
    let mut board = start(image);
    let build = wait_for(&mut board, "kehai ");
    assert!(build.text.starts_with(concat!("kehai ", env!("CARGO_PKG_VERSION"), " ")), "{}", build.text);
    assert!(build.text.ends_with(" mps2-an386"), "{}", build.text);
    assert_eq!(wait_for(&mut board, "mac ").text, "mac 52:54:00:12:34:81");
    assert_eq!(wait_for(&mut board, "host ").text, "host kehai-123481");
    let lease = wait_for(&mut board, "address ");
    assert!(lease.text.ends_with("10.0.2.15/24"), "{}", lease.text);
    assert!(lease.at_us < 4_000_000, "before it would have given up: {lease}");
    println!("boot to DHCP lease: {} ms of guest time", lease.at_us as f64 / 1000.0);
}

#[test]
fn datagrams_of_any_length_come_back() {
    let Some(image) = image() else { return };
    let board = start(image);
    for len in [1, 2, 3, 100, 1472] {
        echoes(&board, &vec![0x5a; len]);
    }
}

#[test]
fn the_sensor_line_carries_bytes_both_ways() {
    let Some(image) = image() else { return };
    let mut board = start(image);
    let mut asked = Vec::new();
    board.sensor().set_read_timeout(Some(PATIENCE)).unwrap();
    while !asked.ends_with(b"\n") {
        let mut bytes = [0; 64];
        let len = board.sensor().recv(&mut bytes).unwrap();
        asked.extend_from_slice(&bytes[..len]);
    }
    assert_eq!(asked, b"VV\n");
    for line in 0..100 {
        board.sensor().send(format!("line {line:03}\n").as_bytes()).unwrap();
    }
    for line in 0..100 {
        wait_for(&mut board, &format!("line {line:03}"));
    }
}

#[test]
fn an_emulated_sensor_on_a_terminal_answers_at_the_speed_the_image_sets() {
    let Some(image) = image() else { return };
    let sensor = Sensor::start(Config { baud: 115_200, ..Config::new(URG_04LX) });
    let line = Line::Terminal(&sensor.terminal);
    let mut board =
        Qemu::start(&Machine { image, mac: MAC, line, network: Network::User, flash: None }).unwrap();
    wait_for(&mut board, "line VV");
    wait_for(&mut board, "line VEND:");
}

#[test]
fn a_hung_task_is_ended_by_the_watchdog_and_the_module_comes_back() {
    let Some(image) = image() else { return };
    let mut board = start(image);
    wait_for(&mut board, "boot 1");
    wait_for(&mut board, "address ");
    board.hang().unwrap();
    wait_for(&mut board, "watchdog: a task hangs");
    wait_for(&mut board, "kehai ");
    wait_for(&mut board, "boot 2");
    echoes(&board, b"again");
}

#[test]
fn after_the_link_was_down_the_module_gets_its_address_again() {
    let Some(image) = image() else { return };
    let mut board = start(image);
    wait_for(&mut board, "address 10.0.2.15");
    board.set_link(false).unwrap();
    wait_for(&mut board, "address lost");
    board.set_link(true).unwrap();
    wait_for(&mut board, "address 10.0.2.15");
    echoes(&board, b"again");
}

#[test]
fn boots_are_counted_through_resets_and_power_cuts() {
    let Some(image) = image() else { return };
    let flash = std::env::temp_dir().join(format!("kehai-flash-{}", std::process::id()));
    let machine =
        || Machine { image, mac: MAC, line: Line::Datagrams, network: Network::User, flash: Some(&flash) };
    let mut board = Qemu::start(&machine()).unwrap();
    wait_for(&mut board, "boot 1");
    board.reset().unwrap();
    wait_for(&mut board, "boot 2");
    drop(board);
    let mut board = Qemu::start(&machine()).unwrap();
    wait_for(&mut board, "boot 3");
    drop(board);
    std::fs::remove_file(&flash).unwrap();
}

#[test]
fn a_lost_dhcp_request_is_sent_again() {
    let Some(image) = image() else { return };
    let mut switch = Switch::start().unwrap();
    let segment = switch.take_port().unwrap();
    let network = Network::Switch(&switch);
    let mut board =
        Qemu::start(&Machine { image, mac: MAC, line: Line::Datagrams, network, flash: None }).unwrap();
    for lost in [true, false, true, false] {
        let answer = frame(&segment, segment::dhcp_answer);
        if !lost {
            segment.send(&answer).unwrap();
        }
    }
    let lease = wait_for(&mut board, "address ");
    assert!(lease.text.ends_with("10.1.2.77/24"), "{lease}");
}

#[test]
fn without_dhcp_the_module_is_at_its_link_local_address_until_a_server_comes() {
    let Some(image) = image() else { return };
    let mut switch = Switch::start().unwrap();
    let segment = switch.take_port().unwrap();
    let machine =
        Machine { image, mac: MAC, line: Line::Datagrams, network: Network::Switch(&switch), flash: None };
    let mut board = Qemu::start(&machine).unwrap();
    assert_eq!(frame(&segment, segment::host_name), "kehai-123481");

    let own = address::link_local(MAC);
    let fallback = wait_for(&mut board, "address 169.254.");
    assert!(fallback.text.ends_with(&format!("169.254.{}.{}/16", own[2], own[3])), "{}", fallback.text);
    assert!(fallback.at_us >= 4_000_000, "not before DHCP had its time: {fallback}");
    segment.send(&segment::who_has(own, [169, 254, 9, 9])).unwrap();
    frame(&segment, |frame| segment::has(frame, MAC, own).then_some(()));

    // Now there is a server. It answers the question, then the DHCP that follows.
    let begin = Instant::now();
    while !board.messages().unwrap().iter().any(|message| message.text.contains("address 10.1.2.77/24")) {
        assert!(begin.elapsed() < PATIENCE, "{:?}", board.messages());
        let frame = segment.receive(Duration::from_millis(20));
        if let Some(answer) = frame.as_deref().and_then(segment::dhcp_answer) {
            segment.send(&answer).unwrap();
        }
    }
}
