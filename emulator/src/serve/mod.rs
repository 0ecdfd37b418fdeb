//! Emulated sensors for real clients: in real time over TCP or on a pseudo terminal as a serial line; in datagrams on
//! the time of QEMU.
//!
//! ```text
//! client ◀──▶ socket or terminal ◀──▶ poll loop ◀──▶ emulated sensor
//!                                        │ sleeps until the next byte is due
//!                                        └ status now and then
//! ```

#[cfg(target_os = "linux")]
mod pty;
mod tcp;
mod udp;

#[cfg(target_os = "linux")]
pub use pty::serve_pty;
pub use tcp::serve_tcp;
pub use udp::{SerialDevice, UdpSensor};

use std::io;
use std::os::fd::BorrowedFd;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::urg::{Counts, State, Urg};

/// Longest sleep: the stop flag is looked at this often.
const LONGEST_SLEEP_US: u64 = 100_000;

/// Bytes handed over at once; a host's own receiver interrupts about as often.
const CHUNK_BYTES: usize = 64;

/// What a server is doing, for the terminal.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Status {
    /// Whether a client is connected.
    pub client: bool,
    /// What the sensor is doing.
    pub state: State,
    /// Bit rate at which the sensor listens.
    pub baud: u32,
    /// What has happened so far.
    pub counts: Counts,
}

/// What a server needs from its caller.
pub struct Control<'a> {
    /// Set it to end the server; it looks ten times a second.
    pub stop: &'a AtomicBool,
    /// Called after every turn of the loop with what is going on.
    pub on_status: &'a mut dyn FnMut(&Status),
}

/// Real time, in µs since the server started.
struct Clock(Instant);

impl Clock {
    fn now_us(&self) -> u64 {
        u64::try_from(self.0.elapsed().as_micros()).unwrap_or(u64::MAX)
    }
}

impl Control<'_> {
    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn report(&mut self, sensor: &Urg, client: bool) {
        let status = Status { client, state: sensor.state(), baud: sensor.baud(), counts: sensor.counts() };
        (self.on_status)(&status);
    }
}

/// Sleeps until one of the descriptors is ready, or the sensor has something to do.
fn sleep(descriptors: &[(BorrowedFd<'_>, PollFlags)], sensor: &Urg, clock: &Clock) -> io::Result<()> {
    wait(descriptors, sleep_us(sensor, clock))
}

/// Time until the sensor has something to do, µs.
fn sleep_us(sensor: &Urg, clock: &Clock) -> u64 {
    let due_us = sensor.next_chunk_us(CHUNK_BYTES).unwrap_or(u64::MAX);
    due_us.saturating_sub(clock.now_us()).min(LONGEST_SLEEP_US)
}

/// Sleeps until one of the descriptors is ready, or `sleep_us` have passed.
fn wait(descriptors: &[(BorrowedFd<'_>, PollFlags)], sleep_us: u64) -> io::Result<()> {
    let mut polled: Vec<_> =
        descriptors.iter().map(|&(fd, flags)| PollFd::from_borrowed_fd(fd, flags)).collect();
    let timeout = Timespec::try_from(Duration::from_micros(sleep_us)).ok();
    match poll(&mut polled, timeout.as_ref()) {
        Ok(_) | Err(rustix::io::Errno::INTR) => Ok(()),
        Err(error) => Err(error.into()),
    }
}
