//! Emulated sensors in real time, as strangers' clients meet them: a socket, and a serial device.
//!
//! Nothing here looks at how long anything takes; what is waited for comes, or the test fails after a
//! generous time.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use kehai_emulator::serve::{Control, UdpSensor, serve_tcp};
use kehai_emulator::source::StillRoom;
use kehai_emulator::urg::model::{Model, URG_04LX, UST_10LX};
use kehai_emulator::urg::{Config, LinkState, Urg};

const PATIENCE: Duration = Duration::from_secs(20);

/// A server in a thread of its own, stopped at the end of the test.
struct Server {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<std::io::Result<()>>>,
}

impl Server {
    fn run(serve: impl FnOnce(&mut Control<'_>) -> std::io::Result<()> + Send + 'static) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        let thread = std::thread::spawn(move || serve(&mut Control { stop: &flag, on_status: &mut |_| {} }));
        Self { stop, thread: Some(thread) }
    }

    fn stop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().expect("the server does not panic").expect("the server ends in peace");
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

fn sensor(model: Model, faults: &[&str]) -> Urg {
    let faults = faults.iter().map(|fault| fault.parse().unwrap()).collect();
    Urg::new(Config { faults, ..Config::new(model) }, Box::new(StillRoom::new(model.geometry)), 0)
}

/// Reads until the text ends with `end`.
fn read_to(from: &mut impl Read, end: &str) -> String {
    let mut text = String::new();
    let mut byte = [0];
    while !text.ends_with(end) {
        match from.read(&mut byte) {
            Ok(0) => panic!("closed after {text:?}"),
            Ok(_) => text.push(char::from(byte[0])),
            Err(error) => panic!("{error} after {text:?}"),
        }
    }
    text
}

fn connect(server: &TcpListener) -> TcpStream {
    let stream = TcpStream::connect(server.local_addr().unwrap()).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream
}

#[test]
fn a_client_on_tcp_gets_scans_and_the_next_client_a_quiet_sensor() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let clone = listener.try_clone().unwrap();
    let mut server = Server::run(move |control| serve_tcp(&clone, sensor(UST_10LX, &[]), control));

    let mut first = connect(&listener);
    first.write_all(b"MD0000").unwrap();
    first.write_all(b"10").unwrap();
    first.write_all(b"8000000\n").unwrap();
    assert_eq!(read_to(&mut first, "\n\n"), "MD0000108000000\n00P\n\n");
    for _ in 0..3 {
        let scan = read_to(&mut first, "\n\n");
        assert_eq!((scan.len(), scan.starts_with("MD0000108000000\n99b\n")), (3372, true));
    }
    let mut second = connect(&listener);
    assert_eq!(second.read(&mut [0; 8]).unwrap(), 0, "one client at a time");
    drop(first);

    let mut third = loop {
        let mut candidate = connect(&listener);
        candidate.write_all(b"%ST\n").unwrap();
        // The server may not have noticed yet that the first client is gone.
        if candidate.peek(&mut [0; 1]).unwrap_or(0) > 0 {
            break candidate;
        }
    };
    assert_eq!(read_to(&mut third, "\n\n"), "%ST\n00P\n000@\n\n");
    server.stop();
}

#[test]
fn a_power_cycle_closes_the_connection_and_lets_the_client_back_in() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let clone = listener.try_clone().unwrap();
    let faults = &["power-cycle:0.5,0.3,4"];
    let mut server = Server::run(move |control| serve_tcp(&clone, sensor(UST_10LX, faults), control));
    let mut client = connect(&listener);
    client.write_all(b"QT\n").unwrap();
    assert_eq!(read_to(&mut client, "\n\n"), "QT\n00P\n\n");
    assert_eq!(client.read(&mut [0; 8]).unwrap_or(0), 0, "the sensor is off");
    let mut client = connect(&listener);
    client.write_all(b"VV\n").unwrap();
    assert!(read_to(&mut client, "\n\n").starts_with("VV\n00P\nVEND:"));
    server.stop();
}

#[test]
fn a_client_in_datagrams_gets_every_byte_and_the_test_has_a_hand_on_the_sensor() {
    const STEP_US: u64 = 1000;
    const SECOND_US: u64 = 1_000_000;
    let sensor = UdpSensor::new(sensor(URG_04LX, &[])).unwrap();
    let client = UdpSocket::bind("127.0.0.1:0").unwrap();
    client.connect(("127.0.0.1", sensor.port())).unwrap();
    client.set_nonblocking(true).unwrap();
    // What is heard within a second of the sensor's time, or until all answers are there.
    let ask = |text: &str, client_baud: Option<u32>, answers: &[&str]| {
        text.bytes().for_each(|byte| assert_eq!(client.send(&[byte]).unwrap(), 1));
        let (mut heard, mut datagram) = (String::new(), [0; 4096]);
        for _ in 0..SECOND_US / STEP_US {
            sensor.advance(STEP_US, client_baud);
            while let Ok(count) = client.recv(&mut datagram) {
                assert!(count <= 1024);
                heard.extend(datagram[..count].iter().copied().map(char::from));
            }
            if !answers.is_empty() && answers.iter().all(|answer| heard.contains(answer)) {
                break;
            }
        }
        assert!(answers.iter().all(|answer| heard.contains(answer)), "{heard}");
        heard
    };
    ask("SS750000\n", None, &["SS750000\n00P\n\n"]);
    // The line has its new speed a moment after the answer.
    ask("", None, &[]);
    assert_eq!(sensor.with(|urg, _| urg.baud()), 750_000);
    let heard = ask("MD0044072501003\n", None, &["03\n00P\n\n", "02\n99b\n", "01\n99b\n", "00\n99b\n"]);
    assert!(heard.len() > 2 * 2137);
    assert_eq!(sensor.with(|urg, _| urg.counts().scans_sent), 3);
    // The rest of the last scan.
    ask("", None, &[]);
    assert_eq!(ask("QT\n", Some(115_200), &[]), "", "at the wrong speed it understands nothing");
    ask("QT\n", Some(750_000), &["QT\n00P\n\n"]);
    sensor.with(|urg, now_us| urg.set_link(now_us, LinkState::Silent));
    assert_eq!(ask("QT\n", None, &[]), "", "unplugged");
    sensor.with(|urg, now_us| urg.set_link(now_us, LinkState::Up));
    ask("QT\n", None, &["QT\n00P\n\n"]);
}

#[cfg(target_os = "linux")]
mod pty {
    use super::*;
    use kehai_emulator::serve::serve_pty;
    use kehai_emulator::urg::model::{URG_04LX, UTM_30LX};
    use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
    use std::fs::{File, OpenOptions};
    use std::path::{Path, PathBuf};

    /// A place for the link that no other test uses.
    fn link(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("kehai-{}-{name}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        path
    }

    /// Opens the serial device once it is there.
    fn open(link: &Path) -> File {
        for _ in 0..400 {
            if let Ok(file) = OpenOptions::new().read(true).write(true).open(link) {
                return file;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        panic!("{} does not appear", link.display());
    }

    fn set_baud(file: &File, baud: u32) {
        let mut settings = tcgetattr(file).unwrap();
        settings.make_raw();
        settings.set_speed(baud).unwrap();
        tcsetattr(file, OptionalActions::Now, &settings).unwrap();
    }

    #[test]
    fn a_serial_client_changes_the_speed_and_the_link_goes_when_the_server_does() {
        let path = link("speed");
        let name = path.clone();
        let mut server = Server::run(move |control| serve_pty(&name, sensor(URG_04LX, &[]), control));
        let mut line = open(&path);
        set_baud(&line, 19_200);
        line.write_all(b"QT\n").unwrap();
        assert_eq!(read_to(&mut line, "\n\n"), "QT\n00P\n\n");
        line.write_all(b"SS250000\n").unwrap();
        assert_eq!(read_to(&mut line, "\n\n"), "SS250000\n00P\n\n");
        set_baud(&line, 250_000);
        line.write_all(b"MD0044072501002\n").unwrap();
        assert_eq!(read_to(&mut line, "\n\n"), "MD0044072501002\n00P\n\n");
        assert_eq!(read_to(&mut line, "\n\n").len(), 2137);
        assert_eq!(read_to(&mut line, "\n\n").len(), 2137);
        server.stop();
        assert!(!path.exists() && std::fs::symlink_metadata(&path).is_err(), "the link is removed");
    }

    #[test]
    fn a_serial_client_at_the_wrong_speed_hears_garbage() {
        let path = link("garbage");
        let name = path.clone();
        let config = Config { start: kehai_emulator::urg::Start::Streaming, ..Config::new(URG_04LX) };
        let room = StillRoom::new(URG_04LX.geometry);
        let urg = Urg::new(Config { baud: 115_200, ..config }, Box::new(room), 0);
        let mut server = Server::run(move |control| serve_pty(&name, urg, control));
        let mut line = open(&path);
        set_baud(&line, 57_600);
        let mut noise = [0; 300];
        line.read_exact(&mut noise).unwrap();
        assert!(!noise.windows(5).any(|bytes| bytes == b"MD004"));
        set_baud(&line, 115_200);
        assert!(read_to(&mut line, "\nMD0044072501000\n99b\n").len() < 100_000);
        server.stop();
    }

    /// Bytes read by a client that polls five times a second.
    fn read_after_sleeping(line: &mut File, naps: u32) -> Vec<u8> {
        let mut heard = Vec::new();
        let mut buffer = [0; 4096];
        for _ in 0..naps {
            std::thread::sleep(Duration::from_millis(200));
            let count = line.read(&mut buffer).unwrap();
            heard.extend_from_slice(&buffer[..count]);
        }
        heard
    }

    // A USB sensor has flow control: a client that reads late misses whole scans.
    #[test]
    fn a_usb_client_that_reads_late_hears_whole_scans_only_and_the_rest_is_counted() {
        let path = link("late");
        let name = path.clone();
        let dropped = Arc::new(std::sync::atomic::AtomicU64::new(0));
        let counted = Arc::clone(&dropped);
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        let server = std::thread::spawn(move || {
            let on_status = &mut |status: &kehai_emulator::serve::Status| {
                counted.store(status.counts.scans_dropped, Ordering::Relaxed);
            };
            serve_pty(&name, sensor(UTM_30LX, &[]), &mut Control { stop: &flag, on_status })
        });
        let mut line = open(&path);
        line.write_all(b"MD0000108001000\n").unwrap();
        let mut heard = read_to(&mut line, "\n\n").into_bytes();
        assert_eq!(heard, b"MD0000108001000\n00P\n\n");
        heard = read_after_sleeping(&mut line, 40);
        line.write_all(b"QT\n").unwrap();
        heard.extend(read_to(&mut line, "\nQT\n00P\n\n").bytes());
        let text = String::from_utf8(heard).unwrap();
        let (scans, _) = text.rsplit_once("QT\n00P\n\n").unwrap();
        let sizes: Vec<_> = scans.split_inclusive("\n\n").map(str::len).collect();
        assert!(sizes.len() > 3 && sizes.iter().all(|size| *size == 3372), "{sizes:?}");
        let lost = dropped.load(Ordering::Relaxed);
        println!("{} scans heard, {lost} dropped", sizes.len());
        assert!(lost > 0, "what was not heard is counted");
        stop.store(true, Ordering::Relaxed);
        server.join().unwrap().unwrap();
    }

    #[test]
    fn a_file_in_the_place_of_the_link_is_left_alone() {
        let path = link("file");
        std::fs::write(&path, "mine").unwrap();
        let stop = AtomicBool::new(false);
        let mut control = Control { stop: &stop, on_status: &mut |_| {} };
        let refused = serve_pty(&path, sensor(URG_04LX, &[]), &mut control).unwrap_err();
        assert_eq!(refused.kind(), std::io::ErrorKind::AlreadyExists);
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "mine");
        std::fs::remove_file(&path).unwrap();
    }
}
