//! `examples/python/kehai_wire.py --key` before a module with keys: a session, keys that the module does not know, and a restart.

use std::io::{BufRead, BufReader, Read};
use std::net::{SocketAddr, SocketAddrV4, UdpSocket};
use std::process::{Child, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use kehai::link::{Dropped, Lane, Outbox};
use kehai::seal::{Key, Role};
use kehai::wire::DATAGRAM_MAX;

use super::exchange::{project, python};
use super::{key, owned, started};

/// A hundred times what a loaded machine needs.
const PATIENCE: Duration = Duration::from_secs(60);

/// A socket as a module's way out.
struct Port(UdpSocket);

impl Outbox for Port {
    fn try_send_to(&mut self, _: Lane, to: SocketAddrV4, bytes: &[u8]) -> Result<(), Dropped> {
        self.0.send_to(bytes, to).map(|_| ()).map_err(|_| Dropped)
    }

    fn is_empty(&mut self, _: Lane) -> bool {
        true
    }

    fn reopen(&mut self, _: Lane) {}
}

/// A module with keys at a port of this machine.
struct Device {
    address: String,
    /// Which of its starts it is in; it starts anew when this is changed.
    boot: Arc<AtomicU32>,
    /// Datagrams that came.
    heard: Arc<AtomicUsize>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Device {
    fn start() -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
        let address = socket.local_addr().unwrap().to_string();
        let boot = Arc::new(AtomicU32::new(3));
        let (heard, stop) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicBool::new(false)));
        let (wanted, counted, stopped) = (Arc::clone(&boot), Arc::clone(&heard), Arc::clone(&stop));
        let thread = std::thread::spawn(move || {
            let mut port = Port(socket);
            let mut room = [0; DATAGRAM_MAX + 1];
            while !stopped.load(Ordering::Relaxed) {
                let boot = wanted.load(Ordering::Relaxed);
                // Cookies of the start before are of another secret.
                let mut module = started(boot, [boot as u8; 16], owned());
                let begun = Instant::now();
                while wanted.load(Ordering::Relaxed) == boot && !stopped.load(Ordering::Relaxed) {
                    let now_us = begun.elapsed().as_micros() as u64;
                    if let Ok((length, SocketAddr::V4(from))) = port.0.recv_from(&mut room) {
                        counted.fetch_add(1, Ordering::Relaxed);
                        module.receive(from, &mut room[..length], now_us, &mut port);
                    }
                    module.poll(now_us, &mut port);
                }
            }
        });
        Self { address, boot, heard, stop, thread: Some(thread) }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().map(JoinHandle::join);
    }
}

/// The script, and the lines that it prints.
struct Listener {
    process: Child,
    lines: Receiver<String>,
}

impl Listener {
    /// None where there is no Python with `cryptography`.
    fn start(device: &Device, id: u8) -> Option<Self> {
        Self::with(device, (id, key(Role::Read).1))
    }

    /// The same with this key.
    fn with(device: &Device, (id, Key(bytes)): (u8, Key)) -> Option<Self> {
        let digits: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        let mut process = python()?
            .arg(project().join("examples/python/kehai_wire.py"))
            .args(["--listen", &device.address, "--key", &format!("{id}:{digits}")])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let (tell, lines) = mpsc::channel();
        let outputs: [Box<dyn Read + Send>; 2] =
            [Box::new(process.stdout.take().unwrap()), Box::new(process.stderr.take().unwrap())];
        for output in outputs.map(BufReader::new) {
            let tell = tell.clone();
            std::thread::spawn(move || {
                output.lines().map_while(Result::ok).try_for_each(|line| tell.send(line)).ok();
            });
        }
        Some(Self { process, lines })
    }

    /// The next line with all of these words, after any others.
    #[track_caller]
    fn until(&self, words: &[&str]) {
        loop {
            let line = self.lines.recv_timeout(PATIENCE).unwrap();
            if words.iter().all(|word| line.contains(word)) {
                return;
            }
        }
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

const SUBSCRIBED: &str = "\"message\": \"subscribed\"";

#[test]
fn python_subscribes_to_a_module_with_keys() {
    let device = Device::start();
    let Some(listener) = Listener::start(&device, key(Role::Read).0) else { return };
    for kind in ["\"message\": \"cookie\"", SUBSCRIBED, "\"message\": \"health\""] {
        listener.until(&[kind]);
    }
}

#[test]
fn python_opens_another_session_after_a_restart_of_the_module() {
    let device = Device::start();
    let Some(listener) = Listener::start(&device, key(Role::Read).0) else { return };
    listener.until(&[SUBSCRIBED, "\"boot\": 3"]);
    device.boot.store(4, Ordering::Relaxed);
    listener.until(&[SUBSCRIBED, "\"boot\": 4"]);
}

#[test]
fn python_says_that_a_key_is_refused_and_asks_no_more_than_before() {
    let device = Device::start();
    let Some(listener) = Listener::start(&device, 9) else { return };
    let begun = Instant::now();
    for _ in 0..3 {
        listener.until(&["\"refusal\": \"no_such_key\""]);
    }
    let (heard, seconds) = (device.heard.load(Ordering::Relaxed), begun.elapsed().as_secs() as usize);
    // A subscribe for a cookie and an open each second.
    assert!(heard <= 2 * (seconds + 2), "{heard} datagrams in {seconds} s");
}

#[test]
fn python_says_that_a_module_has_another_key_under_that_number() {
    let device = Device::start();
    let Some(listener) = Listener::with(&device, (key(Role::Read).0, Key([99; 32]))) else { return };
    listener.until(&["opens no session", "its key is another one"]);
}
