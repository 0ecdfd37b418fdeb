//! The real firmware image, run in QEMU. Guest time is read from its log.

#[path = "support/segment.rs"]
mod segment;

use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use host_sim::module::flash::{Flash, PAGE_LEN};
use host_sim::qemu::{self, Error, Line, Machine, Network, PATIENCE, Port, Qemu, Switch};
use host_sim::serve::{Control, serve_pty};
use host_sim::source::StillRoom;
use host_sim::urg::model::URG_04LX;
use host_sim::urg::{Config, Urg};
use kehai::address;
use kehai::module::Settings;
use kehai::store::flash::FlashStore;
use kehai::store::save_settings;
use kehai::wire::{Cookie, Counter, Identity, Message, ModuleId, Request};

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
fn wait_for(board: &mut Qemu, text: &str) -> qemu::Message {
    board.wait_for(text).unwrap_or_else(|error| panic!("{error}"))
}

/// A host of the module.
struct Host {
    socket: UdpSocket,
    identity: Identity,
    cookie: Cookie,
    renewed: Option<Instant>,
}

impl Host {
    fn new(board: &Qemu) -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.connect(board.module()).unwrap();
        socket.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
        Self { socket, identity: Identity::default(), cookie: Cookie::NONE, renewed: None }
    }

    /// Subscribes, and renews, until `found` finds something.
    fn look<T>(&mut self, mut found: impl FnMut(&Message<'_>) -> Option<T>) -> T {
        let begin = Instant::now();
        let mut datagram = [0; 2000];
        while begin.elapsed() < PATIENCE {
            if self.renewed.is_none_or(|renewed| renewed.elapsed() > Duration::from_millis(500)) {
                let subscribe = Request::Subscribe { t1: [0; 8] };
                let len = subscribe.encode(self.identity, 1, self.cookie, &mut datagram).unwrap();
                // Refused while the port is not there yet.
                let _ = self.socket.send(&datagram[..len]);
                self.renewed = Some(Instant::now());
            }
            let Ok(len) = self.socket.recv(&mut datagram) else { continue };
            let (header, message) = Message::decode(&datagram[..len]).unwrap();
            assert_eq!(header.identity.module, ModuleId(MAC));
            self.identity = header.identity;
            if let Message::Cookie { cookie, .. } = message {
                (self.cookie, self.renewed) = (cookie, None);
            }
            if let Some(found) = found(&message) {
                return found;
            }
        }
        panic!("nothing of the kind");
    }

    /// `count` reports: sequences and background versions.
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

/// The module answers a subscriber; the number of its start.
fn answers(board: &Qemu) -> u32 {
    let mut host = Host::new(board);
    host.look(|message| matches!(message, Message::Health(_)).then_some(()));
    host.identity.boot
}

/// An emulated sensor that streams on the board's line, in this thread's time, until dropped.
struct Streaming {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Streaming {
    fn start(board: &Qemu, mut urg: Urg) -> Self {
        let socket = board.sensor().try_clone().unwrap();
        socket.set_read_timeout(Some(Duration::from_millis(2))).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            let begin = Instant::now();
            let mut bytes = [0; 1024];
            while !stopped.load(Ordering::Relaxed) {
                let received = socket.recv(&mut bytes).unwrap_or(0);
                let now_us = begin.elapsed().as_micros() as u64;
                urg.receive(&bytes[..received], now_us);
                for sent in urg.take_output(now_us) {
                    for chunk in sent.bytes.chunks(1024) {
                        // QEMU is gone: so is the test.
                        let _ = socket.send(chunk);
                    }
                }
            }
        });
        Self { stop, thread: Some(thread) }
    }
}

impl Drop for Streaming {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap();
        }
    }
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
    let maths = wait_for(&mut board, "maths ").text;
    assert_eq!(maths, format!("maths {:08x}", kehai::math::digest()), "board and PC calculate differently");
    assert_eq!(wait_for(&mut board, "mac ").text, "mac 52:54:00:12:34:81");
    assert_eq!(wait_for(&mut board, "host ").text, "host kehai-123481");
    let lease = wait_for(&mut board, "address ");
    assert!(lease.text.ends_with("10.0.2.15/24"), "{}", lease.text);
    assert!(lease.at_us < 4_000_000, "before it would have given up: {lease}");
    println!("boot to DHCP lease: {} ms of guest time", lease.at_us as f64 / 1000.0);
}

#[test]
fn a_host_gets_a_report_for_every_scan_and_the_background_survives_a_reset() {
    let Some(image) = image() else { return };
    let mut board = start(image);
    let urg = Urg::new(Config::new(URG_04LX), Box::new(StillRoom::new(URG_04LX.geometry)), 0);
    let _sensor = Streaming::start(&board, urg);
    let mut host = Host::new(&board);
    let reports = host.reports(20);
    assert!(reports.windows(2).all(|pair| pair[1].0 == pair[0].0 + 1), "{reports:?}");
    host.look(|message| match message {
        Message::Health(health) if health.head.storing => Some(()),
        _ => None,
    });
    host.look(|message| match message {
        Message::Health(health) if !health.head.storing => Some(()),
        _ => None,
    });
    // It has learned and stored; reports go on.
    while host.reports(1)[0].1 != 1 {}
    board.reset().unwrap();
    wait_for(&mut board, "boot 2");
    let mut host = Host::new(&board);
    assert!(host.reports(5).iter().all(|(_, version)| *version == 1), "the background is back");
    assert_eq!(host.identity.boot, 2);
}

#[test]
fn datagrams_of_any_length_and_content_do_no_harm() {
    let Some(image) = image() else { return };
    let board = start(image);
    let boot = answers(&board);
    let (stranger, mut host) = (Host::new(&board), Host::new(&board));
    // As many as it takes: a burst may overrun the network's buffers on the way.
    let mut foreign = 0;
    while foreign < 40 {
        for len in [1, 2, 3, 39, 40, 51, 100, 1400, 1401, 1472] {
            for byte in [0x5a, 0xe6] {
                stranger.socket.send(&vec![byte; len]).unwrap();
            }
        }
        foreign = host.look(|message| match message {
            Message::Health(health) => Some(health.counters.get(Counter::DatagramsForeign)),
            _ => None,
        });
    }
    assert_eq!(answers(&board), boot);
}

#[test]
fn a_restart_asked_for_is_a_new_start() {
    let Some(image) = image() else { return };
    let mut board = start(image);
    let mut host = Host::new(&board);
    host.look(|message| matches!(message, Message::Subscribed(_)).then_some(()));
    let mut datagram = [0; 100];
    let len = Request::Restart.encode(host.identity, 2, host.cookie, &mut datagram).unwrap();
    host.socket.send(&datagram[..len]).unwrap();
    host.look(|message| matches!(message, Message::Done { .. }).then_some(()));
    wait_for(&mut board, "restart");
    wait_for(&mut board, "boot 2");
    assert_eq!(answers(&board), 2);
}

/// A terminal carries 10 kB/s at most, and QEMU sets none to 250 kbaud: two steps a beam need neither.
#[test]
fn an_emulated_sensor_on_a_terminal_is_found_at_a_rare_speed_and_its_line_made_faster() {
    let Some(image) = image() else { return };
    let path = std::env::temp_dir().join(format!("kehai-flash-terminal-{}", std::process::id()));
    let flash = Flash::open(&path, 128 * 1024 / PAGE_LEN).unwrap();
    let mut store = FlashStore::new(flash, 0..128 * 1024).unwrap();
    let settings = Settings::new().changed_by("cluster=2").unwrap();
    embassy_futures::block_on(save_settings(&mut store, &settings)).unwrap();
    std::fs::File::options().write(true).open(&path).unwrap().set_len(16 * 1024 * 1024).unwrap();

    let sensor = Sensor::start(Config { baud: 57_600, ..Config::new(URG_04LX) });
    let line = Line::Terminal(&sensor.terminal);
    let machine = Machine { image, mac: MAC, line, network: Network::User, flash: Some(&path) };
    let board = Qemu::start(&machine).unwrap();
    let mut host = Host::new(&board);
    let changes = host.look(|message| match message {
        Message::Health(health) if health.counters.get(Counter::ScansAccepted) > 0 => {
            Some(health.counters.get(Counter::SensorBaudChanges))
        }
        _ => None,
    });
    assert!(changes > 0);
    drop(board);
    std::fs::remove_file(&path).unwrap();
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
    assert_eq!(answers(&board), 2);
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
    answers(&board);
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
