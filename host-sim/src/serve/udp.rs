//! An emulated sensor in datagrams, as QEMU's serial lines speak them: 200 kB/s and more, where a terminal
//! carries 10 kB/s. The line's speed cannot be seen: whoever speaks is understood.
//!
//! ```text
//! QEMU ── a datagram a byte ──▶ socket ─▶ sensor ◀─ with(…) the test
//!      ◀── 1024 bytes at most ──   └ to whoever spoke last
//! ```

use std::io;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::os::fd::AsFd;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;

use rustix::event::PollFlags;

use super::{Clock, sleep_us, wait};
use crate::urg::Urg;

/// Bytes of a datagram; QEMU cuts what is longer than 4096.
const DATAGRAM_BYTES: usize = 1024;

/// Longest sleep: what [`UdpSensor::with`] has changed is looked at this often.
const LOOK_US: u64 = 5_000;

/// A running sensor, in a thread of its own. It ends when dropped.
pub struct UdpSensor {
    port: u16,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    sensor: Mutex<Urg>,
    clock: Clock,
    stop: AtomicBool,
}

impl Shared {
    fn sensor(&self) -> MutexGuard<'_, Urg> {
        // A test that failed while it held the sensor has said so.
        self.sensor.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl UdpSensor {
    /// Serves `sensor` on a free port of this machine. The sensor's time starts at 0 with this call.
    ///
    /// # Errors
    /// No socket or thread is to be had.
    pub fn start(sensor: Urg) -> io::Result<Self> {
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
        socket.set_nonblocking(true)?;
        let port = socket.local_addr()?.port();
        let shared = Arc::new(Shared {
            sensor: Mutex::new(sensor),
            clock: Clock(Instant::now()),
            stop: AtomicBool::new(false),
        });
        let served = Arc::clone(&shared);
        let thread =
            std::thread::Builder::new().name("sensor".into()).spawn(move || serve(&socket, &served))?;
        Ok(Self { port, shared, thread: Some(thread) })
    }

    /// UDP port to speak to it at.
    #[must_use]
    pub fn port(&self) -> u16 {
        self.port
    }

    /// Looks at the sensor, or does something to it, now: the time is the sensor's, µs. It stands still meanwhile.
    pub fn with<T>(&self, act: impl FnOnce(&mut Urg, u64) -> T) -> T {
        let mut sensor = self.shared.sensor();
        let now_us = self.shared.clock.now_us();
        sensor.advance(now_us);
        act(&mut sensor, now_us)
    }
}

impl Drop for UdpSensor {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A sensor that has panicked has said so.
            let _ = thread.join();
        }
    }
}

fn serve(socket: &UdpSocket, shared: &Shared) {
    let mut client = None;
    while !shared.stop.load(Ordering::Relaxed) {
        let sleep_us = {
            let mut sensor = shared.sensor();
            turn(socket, &mut sensor, &shared.clock, &mut client);
            sleep_us(&sensor, &shared.clock).min(LOOK_US)
        };
        // An error is no reason to stop: the next turn shows.
        let _ = wait(&[(socket.as_fd(), PollFlags::IN)], sleep_us);
    }
}

/// Takes all that has come, and sends all that is due. An error says that the client is not there, or gone: what is
/// sent meanwhile is lost, as on a line.
fn turn(socket: &UdpSocket, sensor: &mut Urg, clock: &Clock, client: &mut Option<SocketAddr>) {
    let mut bytes = [0; DATAGRAM_BYTES];
    while let Ok((count, from)) = socket.recv_from(&mut bytes) {
        *client = Some(from);
        sensor.receive(bytes.get(..count).unwrap_or_default(), clock.now_us());
    }
    for sent in sensor.take_output(clock.now_us()) {
        for datagram in sent.bytes.chunks(DATAGRAM_BYTES) {
            if let Some(client) = *client {
                let _ = socket.send_to(datagram, client);
            }
        }
    }
}
