//! The receiver: a thread that only empties the socket, so that nothing is lost there while the tracker is at work.
//!
//! ```text
//!   socket ─▶ time of arrival ─▶ queue, bounded ─▶ tracking loop
//!                                  └ full: the oldest is dropped and counted
//! ```
//!
//! The kernel's buffer holds some three hundred datagrams, if it gives no more: what 500 devices send in 60 ms. A snapshot of
//! them, or another program on the processor, takes longer.

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use crossbeam_channel::{RecvTimeoutError, TrySendError, bounded};
use rustix::net::sockopt;

use crate::clock::HostClock;

/// Datagrams that wait for the tracker: what 500 devices send in 0.8 s. What is older is too late to be used.
pub const WAITING: usize = 4096;

/// Longer than any datagram of a device, so that a longer one is seen to be.
const BUFFER: usize = 2048;

/// Buffer asked of the kernel, bytes: it gives up to `net.core.rmem_max`, usually 208 kB, and counts some 1.3 kB a datagram.
pub const KERNEL_BUFFER: u32 = 4 << 20;

/// The thread looks so often whether it is to end.
const LOOKS: Duration = Duration::from_millis(100);

/// Asks for a large buffer of the kernel; how large it is, is in the log.
pub fn enlarge(socket: &UdpSocket) {
    let _ = sockopt::set_socket_recv_buffer_size(socket, KERNEL_BUFFER as usize);
    let bytes = sockopt::socket_recv_buffer_size(socket).unwrap_or_default();
    tracing::debug!("the kernel keeps {} kB of datagrams for the receiver", bytes / 1024);
}

/// A datagram that has arrived.
#[derive(Debug)]
pub struct Arrival {
    /// When, µs of the host's clock.
    pub at_us: u64,
    /// Where it came from.
    pub from: SocketAddr,
    /// All of it, up to 2048 bytes.
    pub bytes: Box<[u8]>,
}

/// The thread, and the datagrams that wait. It ends when this is dropped.
#[derive(Debug)]
pub struct Receiver {
    waiting: crossbeam_channel::Receiver<Arrival>,
    overrun: Arc<AtomicU64>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<io::Error>>,
}

impl Receiver {
    /// Empties `socket` from now on.
    ///
    /// # Errors
    /// The socket cannot be shared, or no thread be had.
    pub fn start(socket: &UdpSocket, clock: HostClock) -> io::Result<Self> {
        let socket = socket.try_clone()?;
        socket.set_read_timeout(Some(LOOKS))?;
        let (arrivals, waiting) = bounded(WAITING);
        let oldest = waiting.clone();
        let (overrun, stop) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicBool::new(false)));
        let (dropped, ends) = (Arc::clone(&overrun), Arc::clone(&stop));
        let thread = std::thread::Builder::new().name("receiver".into()).spawn(move || {
            let mut buffer = [0; BUFFER];
            while !ends.load(Ordering::Relaxed) {
                let (len, from) = match socket.recv_from(&mut buffer) {
                    Ok(received) => received,
                    Err(error) if is_passing(&error) => continue,
                    Err(error) => return error,
                };
                let bytes = buffer.get(..len).unwrap_or_default().into();
                let mut arrival = Arrival { at_us: clock.now_us(), from, bytes };
                while let Err(TrySendError::Full(newest)) = arrivals.try_send(arrival) {
                    arrival = newest;
                    dropped.fetch_add(u64::from(oldest.try_recv().is_ok()), Ordering::Relaxed);
                }
            }
            io::ErrorKind::Interrupted.into()
        })?;
        Ok(Self { waiting, overrun, stop, thread: Some(thread) })
    }

    /// The oldest datagram that waits; None if none comes within `wait`.
    ///
    /// # Errors
    /// The socket has failed for good.
    pub fn next(&mut self, wait: Duration) -> io::Result<Option<Arrival>> {
        match self.waiting.recv_timeout(wait) {
            Ok(arrival) => return Ok(Some(arrival)),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Err(self.failure()),
        }
        // Its own end of the queue keeps the channel open while the thread lives.
        if self.thread.as_ref().is_some_and(JoinHandle::is_finished) { Err(self.failure()) } else { Ok(None) }
    }

    /// How many were dropped so far, as the tracker had fallen behind.
    #[must_use]
    pub fn overrun(&self) -> u64 {
        self.overrun.load(Ordering::Relaxed)
    }

    fn failure(&mut self) -> io::Error {
        let ended = self.thread.take().and_then(|thread| thread.join().ok());
        ended.unwrap_or_else(|| io::Error::other("the thread that receives has failed"))
    }
}

impl Drop for Receiver {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Nothing came in time, or a device's host said that the port is not open yet.
fn is_passing(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::WouldBlock
            | io::ErrorKind::TimedOut
            | io::ErrorKind::Interrupted
            | io::ErrorKind::ConnectionRefused
            | io::ErrorKind::ConnectionReset
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sends `count` numbered datagrams, a few at a time so that the kernel's buffer holds them; then what the receiver has.
    fn sent(count: u32) -> (Vec<u32>, u64) {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        let mut receiver = Receiver::start(&socket, HostClock::start()).unwrap();
        let (device, to) = (UdpSocket::bind("127.0.0.1:0").unwrap(), socket.local_addr().unwrap());
        for number in 0..count {
            device.send_to(&number.to_le_bytes(), to).unwrap();
            while number % 64 == 63 && receiver.waiting.len() as u64 + receiver.overrun() <= u64::from(number)
            {
                std::thread::yield_now();
            }
        }
        let mut numbers = Vec::new();
        while numbers.last() != Some(&(count - 1)) {
            if let Some(arrival) = receiver.next(Duration::from_secs(1)).unwrap() {
                numbers.push(u32::from_le_bytes((*arrival.bytes).try_into().unwrap()));
            }
        }
        (numbers, receiver.overrun())
    }

    #[test]
    fn what_comes_while_the_tracker_is_at_work_waits() {
        assert_eq!(sent(3072), ((0..3072).collect(), 0), "ten times the kernel's buffer");
    }

    #[test]
    fn of_too_many_the_oldest_are_dropped_and_counted() {
        let all = WAITING as u32 + 640;
        assert_eq!(sent(all), ((640..all).collect(), 640));
    }
}
