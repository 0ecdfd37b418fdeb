//! The real firmware image in QEMU and the module of a PC, each beside a sensor that measures a recording: what they
//! learn is the same, and so is every report, byte for byte.
//!
//! ```text
//! recording ─▶ sensor ══ serial line ═▶ image in QEMU ══ reports ═▶ host ─┐
//!                                                                         ├─ equal?
//! recording ─▶ sensor ══ TCP ═════════▶ kehai-sim module ═ reports ▶ host ┘
//! ```
//!
//! Both first learn from the recording, each by itself, and store that; this costs scans, and not the same ones. Then
//! both start anew with what they have stored, and a sensor that waits until a host has subscribed. The recording
//! begins with the first scan they ask for, so both are given all of it. Matched by sensor stamp; left out are
//! what differs between any two modules: sequence, boot, stamps on the module's clock and counters.

use std::net::{SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread::JoinHandle;

use crate::support::board::{host_of, image, start};
use kehai::background::{Background, BeamProfile};
use kehai::scan::MAX_BEAMS;
use kehai::store::flash::FlashStore;
use kehai::store::load_background;
use kehai::update::maker::DEVELOPMENT;
use kehai_emulator::pc::device::{Beside, PAGES, Pc};
use kehai_emulator::pc::flash::{Flash, PAGE_LEN};
use kehai_emulator::pc::host::{Host, Seen, Way};
use kehai_emulator::pc::line::Place;
use kehai_emulator::pc::reactor::Reactor;
use kehai_emulator::pc::udp::Udp;
use kehai_emulator::qemu::Line;
use kehai_emulator::recording::{Recording, RecordingSource};
use kehai_emulator::serve::{Control, UdpSensor, serve_tcp};
use kehai_emulator::source::{RangeSource, Repeating, Revolution, SensorGeometry, SourceScan};
use kehai_emulator::urg::model::URG_04LX;
use kehai_emulator::urg::{Config, LinkState, Urg};

/// A recording that begins at a whole millisecond: the sensor's stamps are then the same time apart in every run.
#[derive(Clone)]
struct Aligned(RecordingSource);

impl RangeSource for Aligned {
    fn geometry(&self) -> SensorGeometry {
        self.0.geometry()
    }

    fn scan(&mut self, revolution: Revolution) -> Option<SourceScan> {
        let start_us = revolution.start_us.next_multiple_of(1000);
        self.0.scan(Revolution { start_us, ..revolution })
    }

    fn latest(&mut self, revolution: Revolution) -> Option<SourceScan> {
        self.0.latest(revolution)
    }
}

/// A sensor with an exact clock, on a line without losses.
fn sensor(source: impl RangeSource + 'static) -> Urg {
    let config = Config { paced: false, clock_fast_ppm: 0, ..Config::new(URG_04LX) };
    Urg::new(config, Box::new(source), 0)
}

/// A thread that is stopped with its owner.
struct Running {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Running {
    fn start(run: impl FnOnce(&AtomicBool) + Send + 'static) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        Self { stop, thread: Some(std::thread::spawn(move || run(&flag))) }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let ended = thread.join();
            assert!(ended.is_ok() || std::thread::panicking(), "the thread has failed");
        }
    }
}

fn serve(listener: TcpListener, sensor: Urg) -> Running {
    Running::start(move |stop| {
        serve_tcp(&listener, sensor, &mut Control { stop, on_status: &mut |_| {} }).unwrap();
    })
}

/// The module of a PC, and where it is.
fn pc(sensor: SocketAddr, flash: &Path) -> (Running, SocketAddr) {
    let flash = flash.to_owned();
    let (to_test, address) = mpsc::channel();
    let running = Running::start(move |stop| {
        let flash = Flash::open(&flash, PAGES).unwrap();
        let port = Udp::bind("127.0.0.1:0".parse().unwrap(), &Reactor::new()).unwrap();
        to_test.send(port.local_addr().unwrap()).unwrap();
        let sensor = Place::Tcp(sensor.to_string());
        let pc = Pc {
            beside: Beside::Sensor,
            sensor: &sensor,
            port: &port,
            flash: &flash,
            name: None,
            unique: None,
            maker: DEVELOPMENT,
            announced: false,
            amend: None,
        };
        pc.start(stop, |_| {}).unwrap();
    });
    (running, address.recv().unwrap())
}

/// The background is learned, and stored.
fn learned(mut host: Host<impl Way>) {
    host.health(|health| health.head.background_version == 1 && health.head.storing);
    host.health(|health| !health.head.storing);
}

/// As many reports as there are scans, and no more.
fn reports(mut host: Host<impl Way>, scans: usize) -> Vec<Seen> {
    host.more(scans);
    host.health(|_| true);
    assert!(host.health(|_| true).head.sequence as usize >= scans);
    host.reports
}

fn board_learns(image: &Path, recording: Recording, flash: &Path) {
    let sensor = UdpSensor::new(sensor(Repeating::new(Aligned(RecordingSource::new(recording))))).unwrap();
    let board = start(image, Line::AnySpeed(&sensor), Some(flash));
    learned(host_of(&board));
}

fn board_reports(image: &Path, recording: Recording, flash: &Path) -> Vec<Seen> {
    let scans = recording.scans.len();
    let sensor = UdpSensor::new(sensor(Aligned(RecordingSource::new(recording)))).unwrap();
    sensor.with(|urg, now_us| urg.set_link(now_us, LinkState::Silent));
    let board = start(image, Line::AnySpeed(&sensor), Some(flash));
    let mut host = host_of(&board);
    host.subscribe();
    sensor.with(|urg, now_us| urg.set_link(now_us, LinkState::Up));
    let reports = reports(host, scans);
    let sent: Vec<u64> = sensor.with(|urg, _| urg.truth().map(|truth| truth.stamp_ms.into()).collect());
    assert!(reports.iter().map(|report| report.head.sensor_ms).eq(sent), "a report for every scan sent");
    reports
}

fn pc_learns(recording: Recording, flash: &Path) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let _sensor = serve(listener, sensor(Repeating::new(Aligned(RecordingSource::new(recording)))));
    let (_module, module) = pc(address, flash);
    learned(Host::new(module).unwrap());
}

fn pc_reports(recording: Recording, flash: &Path) -> Vec<Seen> {
    let scans = recording.scans.len();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let (_module, module) = pc(listener.local_addr().unwrap(), flash);
    let mut host = Host::new(module).unwrap();
    host.subscribe();
    // Until now it has asked in vain.
    let _sensor = serve(listener, sensor(Aligned(RecordingSource::new(recording))));
    reports(host, scans)
}

/// A new file, removed with the test.
struct Temporary(PathBuf);

impl Temporary {
    fn new(name: &str) -> Self {
        Self(std::env::temp_dir().join(format!("kehai-recording-{}-{name}", std::process::id())))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // It may never have been made.
        let _ = std::fs::remove_file(&self.0);
    }
}

/// The background in a flash file, which may be longer than the flash.
fn background(flash: &Path) -> (u16, Vec<BeamProfile>) {
    const LEN: usize = PAGES * PAGE_LEN;
    let copy = Temporary::new("copy");
    std::fs::write(&copy.0, &std::fs::read(flash).unwrap()[..LEN]).unwrap();
    let flash = Flash::open(&copy.0, PAGES).unwrap();
    let mut store = FlashStore::new(flash, 0..LEN as u32).unwrap();
    let mut background = Box::new(Background::<MAX_BEAMS>::new());
    embassy_futures::block_on(load_background(&mut store, &mut background)).unwrap().unwrap();
    (background.version(), background.profile().collect())
}

/// The recording; `None`, with a message, in a clone that does not have it.
fn recording(name: &str) -> Option<Recording> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/recordings").join(name);
    if !path.exists() {
        test_support::fail_in_ci_else_skip(format!("no recording at {}", path.display()));
        return None;
    }
    Some(Recording::open(&path).unwrap())
}

/// Time of a report by the sensor's clock since the first one.
fn since_first_ms(reports: &[Seen]) -> Vec<u64> {
    reports.iter().map(|report| report.head.sensor_ms - reports[0].head.sensor_ms).collect()
}

#[test]
fn the_image_and_the_module_of_a_pc_report_the_same_of_every_scan_of_a_recording() {
    let Some(image) = image() else { return };
    let Some(recording) = recording("tamu_ex2.csv") else { return };
    let (board_flash, pc_flash) = (Temporary::new("board"), Temporary::new("pc"));
    std::thread::scope(|scope| {
        scope.spawn(|| board_learns(image, recording.clone(), &board_flash.0));
        scope.spawn(|| pc_learns(recording.clone(), &pc_flash.0));
    });
    let learned = background(&pc_flash.0);
    assert_eq!((learned.0, learned.1.len()), (1, recording.scans[0].ranges_mm.len()));
    assert!(learned == background(&board_flash.0), "both have learned the same");

    let (on_board, on_pc) = std::thread::scope(|scope| {
        let on_board = scope.spawn(|| board_reports(image, recording.clone(), &board_flash.0));
        let on_pc = scope.spawn(|| pc_reports(recording.clone(), &pc_flash.0));
        (on_board.join().unwrap(), on_pc.join().unwrap())
    });
    for reports in [&on_board, &on_pc] {
        assert_eq!(reports.len(), recording.scans.len());
        assert!(
            (1..).zip(reports).all(|(sequence, report)| report.head.sequence == sequence),
            "none is lost"
        );
        assert!(reports.iter().all(|report| report.head.lost_scans == 0));
    }
    assert_eq!(since_first_ms(&on_board), since_first_ms(&on_pc));
    let versions = |reports: &[Seen]| -> Vec<u16> {
        reports.iter().map(|report| report.head.background_version).collect()
    };
    assert_eq!(versions(&on_board), versions(&on_pc));
    assert!(!versions(&on_board).contains(&0), "judged with what was learned");
    let different = on_board.iter().zip(&on_pc).filter(|(board, pc)| board.found != pc.found).count();
    let bytes: usize = on_pc.iter().map(|report| report.found.len()).sum();
    println!(
        "{} reports compared, {bytes} bytes of candidates and spans; {different} differ",
        on_board.len()
    );
    assert_eq!(different, 0);
    // A candidate takes 22 bytes at least: this was about something.
    assert!(bytes > recording.scans.len() * 22);
}
