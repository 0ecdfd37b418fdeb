//! A link in memory between code under test and an emulated sensor, on virtual time.
//!
//! ```text
//! write ─▶ the host's transmitter ─▶ sensor (at its speed, or garbage) ─▶ chunks, jitter ─▶ read
//! ```
//!
//! Everything is computed: the same program reads the same bytes at the same times in every run.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;
use std::task::{Poll, Waker};

use embedded_io_async::{ErrorKind, ErrorType, Read, Write};
use kehai::link::Baud;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg32;

use crate::simulated_time::SimulatedClock;
use crate::uart;
use crate::urg::{LinkState, Urg};

/// How bytes reach the reader.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LinkOptions {
    /// Most bytes of one read. A reader is woken for that many, or for fewer once the line pauses.
    pub chunk_bytes: usize,
    /// Longest extra delay of a chunk, in µs; chunks keep their order.
    pub jitter_us: u64,
    /// For the jitter.
    pub seed: u64,
    /// Speed of the host's side at first.
    pub baud: u32,
    /// What a reader gets while the connection is closed: an error, or the end of file.
    pub closed_is_error: bool,
    /// Bytes the host's receiver holds until they are read. What comes when it is full is lost, and the next read
    /// says so.
    pub receiver_bytes: usize,
}

impl Default for LinkOptions {
    /// Chunks of 64 bytes, no jitter, 19 200 baud, end of file when closed, a receiver that is never full.
    fn default() -> Self {
        Self {
            chunk_bytes: 64,
            jitter_us: 0,
            seed: 1,
            baud: 19_200,
            closed_is_error: false,
            receiver_bytes: usize::MAX,
        }
    }
}

/// Why a read or a write failed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum LinkError {
    /// The sensor is unplugged, or the connection is gone.
    #[error("the link is closed")]
    Closed,
    /// The receiver was full, and bytes are lost.
    #[error("bytes were received faster than they were read")]
    Overrun,
}

impl embedded_io_async::Error for LinkError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Closed => ErrorKind::NotConnected,
            Self::Overrun => ErrorKind::OutOfMemory,
        }
    }
}

/// The host's end of the link. Clones are the same end.
#[derive(Clone)]
pub struct MemoryLink(Rc<RefCell<Shared>>);

struct Shared {
    clock: SimulatedClock,
    sensor: Urg,
    options: LinkOptions,
    random: Pcg32,
    baud: u32,
    /// Bytes on their way to the sensor: when the last of them is complete, the bytes, their speed.
    outgoing: VecDeque<(u64, Vec<u8>, u32)>,
    transmitter_free_us: u64,
    arriving: VecDeque<(u64, VecDeque<u8>)>,
    last_arrival_us: u64,
    overrun: bool,
    reader: Option<Waker>,
}

impl std::fmt::Debug for MemoryLink {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("MemoryLink").field("baud", &self.0.borrow().baud).finish_non_exhaustive()
    }
}

impl MemoryLink {
    /// Plugs `sensor` in.
    #[must_use]
    pub fn new(clock: &SimulatedClock, sensor: Urg, options: LinkOptions) -> Self {
        Self(Rc::new(RefCell::new(Shared {
            clock: clock.clone(),
            sensor,
            random: Pcg32::seed_from_u64(options.seed),
            baud: options.baud,
            options,
            outgoing: VecDeque::new(),
            transmitter_free_us: 0,
            arriving: VecDeque::new(),
            last_arrival_us: 0,
            overrun: false,
            reader: None,
        })))
    }

    /// Looks at the sensor, or does something to it, as of now.
    pub fn with_sensor<T>(&self, look: impl FnOnce(&mut Urg, u64) -> T) -> T {
        let mut shared = self.0.borrow_mut();
        let now_us = shared.clock.now_us();
        shared.pump(now_us);
        let result = look(&mut shared.sensor, now_us);
        if let Some(reader) = shared.reader.take() {
            reader.wake();
        }
        result
    }

    /// Speed of the host's side.
    #[must_use]
    pub fn baud(&self) -> u32 {
        self.0.borrow().baud
    }

    /// Pulls the cable: reads wait, writes vanish.
    pub fn unplug(&self) {
        self.with_sensor(|sensor, now_us| sensor.set_link(now_us, LinkState::Silent));
    }

    /// Ends the connection: reads and writes fail.
    pub fn disconnect(&self) {
        self.with_sensor(|sensor, now_us| sensor.set_link(now_us, LinkState::Closed));
    }

    /// Puts the cable back, or lets the host connect again.
    pub fn replug(&self) {
        self.with_sensor(|sensor, now_us| sensor.set_link(now_us, LinkState::Up));
    }
}

impl Shared {
    /// Moves everything that has happened up to `now_us`.
    fn pump(&mut self, now_us: u64) {
        while self.outgoing.front().is_some_and(|(due_us, ..)| *due_us <= now_us) {
            let Some((due_us, bytes, baud)) = self.outgoing.pop_front() else { break };
            self.collect(due_us);
            let bytes =
                if self.sensor.paced() { uart::received(&bytes, baud, self.sensor.baud()) } else { bytes };
            self.sensor.receive(&bytes, due_us);
        }
        self.collect(now_us);
        self.overflow(now_us);
    }

    /// Loses what has arrived and is more than the receiver holds.
    fn overflow(&mut self, now_us: u64) {
        let mut room = self.options.receiver_bytes;
        for (_, bytes) in self.arriving.iter_mut().take_while(|(at_us, _)| *at_us <= now_us) {
            self.overrun |= bytes.len() > room;
            bytes.truncate(room);
            room -= bytes.len();
        }
    }

    fn collect(&mut self, now_us: u64) {
        for sent in self.sensor.take_output(now_us) {
            let bytes = match sent.baud {
                Some(baud) => uart::received(&sent.bytes, baud, self.baud),
                None => sent.bytes,
            };
            let delay_us = match self.options.jitter_us {
                0 => 0,
                jitter_us => self.random.next_u64() % (jitter_us + 1),
            };
            self.last_arrival_us = self.last_arrival_us.max(now_us + delay_us);
            self.arriving.push_back((self.last_arrival_us, bytes.into()));
        }
        if self.sensor.link() == LinkState::Closed {
            self.outgoing.clear();
        }
    }

    /// Bytes that have arrived.
    fn arrived(&mut self, now_us: u64, buffer: &mut [u8]) -> usize {
        let most = buffer.len().min(self.options.chunk_bytes.max(1));
        let mut count = 0;
        while let Some((at_us, bytes)) = self.arriving.front_mut()
            && *at_us <= now_us
        {
            if bytes.is_empty() {
                self.arriving.pop_front();
                continue;
            }
            // A queue in memory is read without an error; nothing is read where there is no place left.
            let places = buffer.get_mut(count..most).unwrap_or_default();
            let taken = std::io::Read::read(bytes, places).unwrap_or(0);
            if taken == 0 {
                break;
            }
            count += taken;
        }
        count
    }

    fn next_us(&self) -> Option<u64> {
        let outgoing_us = self.outgoing.front().map(|(due_us, ..)| *due_us);
        let arriving_us = self.arriving.front().map(|(at_us, _)| *at_us);
        let sensor_us = self.sensor.next_chunk_us(self.options.chunk_bytes);
        [outgoing_us, arriving_us, sensor_us].into_iter().flatten().min()
    }
}

impl ErrorType for MemoryLink {
    type Error = LinkError;
}

impl Read for MemoryLink {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, LinkError> {
        std::future::poll_fn(|context| {
            let mut shared = self.0.borrow_mut();
            let now_us = shared.clock.now_us();
            shared.pump(now_us);
            if std::mem::take(&mut shared.overrun) {
                return Poll::Ready(Err(LinkError::Overrun));
            }
            let count = shared.arrived(now_us, buffer);
            if count > 0 || buffer.is_empty() {
                return Poll::Ready(Ok(count));
            }
            if shared.sensor.link() == LinkState::Closed {
                let failed = shared.options.closed_is_error;
                return Poll::Ready(if failed { Err(LinkError::Closed) } else { Ok(0) });
            }
            if let Some(at_us) = shared.next_us() {
                shared.clock.wake_at(at_us.max(now_us + 1), context.waker());
            }
            shared.reader = Some(context.waker().clone());
            Poll::Pending
        })
        .await
    }
}

impl Write for MemoryLink {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, LinkError> {
        let mut shared = self.0.borrow_mut();
        let now_us = shared.clock.now_us();
        shared.pump(now_us);
        if shared.sensor.link() == LinkState::Closed {
            return Err(LinkError::Closed);
        }
        let baud = shared.baud;
        let takes_us = if shared.sensor.paced() {
            (bytes.len() as u64 * 10_000_000).div_ceil(u64::from(baud.max(1)))
        } else {
            0
        };
        shared.transmitter_free_us = shared.transmitter_free_us.max(now_us) + takes_us;
        let due_us = shared.transmitter_free_us;
        shared.outgoing.push_back((due_us, bytes.to_vec(), baud));
        if let Some(reader) = shared.reader.take() {
            reader.wake();
        }
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), LinkError> {
        let (clock, free_us) = {
            let shared = self.0.borrow();
            (shared.clock.clone(), shared.transmitter_free_us)
        };
        kehai::link::Clock::wait_until(&clock, free_us).await;
        Ok(())
    }
}

impl Baud for MemoryLink {
    async fn set_baud(&mut self, rate_baud: u32) {
        // A closed link has nothing left to send.
        let _ = self.flush().await;
        let mut shared = self.0.borrow_mut();
        let now_us = shared.clock.now_us();
        shared.pump(now_us);
        shared.baud = rate_baud;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulated_time::{Stuck, block_on, block_on_until};
    use crate::source::StillRoom;
    use crate::urg::model::{URG_04LX, UST_10LX};
    use crate::urg::{Config, Start};

    fn link(config: Config, options: LinkOptions) -> (SimulatedClock, MemoryLink) {
        let clock = SimulatedClock::new();
        let room = StillRoom::new(config.model.geometry);
        let sensor = Urg::new(config, Box::new(room), 0);
        (clock.clone(), MemoryLink::new(&clock, sensor, options))
    }

    /// Reads until `wanted` bytes have come.
    async fn read(link: &mut MemoryLink, wanted: usize) -> Vec<u8> {
        let mut bytes = Vec::new();
        while bytes.len() < wanted {
            let mut buffer = [0; 256];
            let count = link.read(&mut buffer).await.unwrap();
            assert!(count > 0, "closed");
            bytes.extend_from_slice(&buffer[..count]);
        }
        bytes
    }

    #[test]
    fn a_request_is_answered_on_virtual_time() {
        let (clock, mut link) = link(Config::new(URG_04LX), LinkOptions::default());
        let answer = block_on(&clock, async {
            link.write_all(b"QT\n").await.unwrap();
            read(&mut link, 8).await
        });
        assert_eq!(answer.unwrap(), b"QT\n00P\n\n");
        // The next turn of the mirror, and eight bytes at 19 200 baud.
        assert_eq!(clock.now_us(), 99_700 + 4167);
    }

    #[test]
    fn the_wrong_speed_gives_garbage_and_no_answer() {
        let options = LinkOptions { baud: 115_200, ..LinkOptions::default() };
        let (clock, mut stream) =
            link(Config { start: Start::Streaming, baud: 250_000, ..Config::new(URG_04LX) }, options);
        let noise = block_on(&clock, read(&mut stream, 500)).unwrap();
        assert!(!noise.windows(5).any(|bytes| bytes == b"MD004"));
        let (clock, mut idle) = link(Config::new(URG_04LX), options);
        let answer = block_on_until(&clock, 5_000_000, async {
            idle.write_all(b"QT\n").await.unwrap();
            read(&mut idle, 1).await
        });
        assert_eq!(answer, Err(Stuck::DeadLock { now_us: 261 }));
    }

    #[test]
    fn a_change_of_speed_takes_effect_after_its_answer() {
        let (clock, mut link) = link(Config::new(URG_04LX), LinkOptions::default());
        block_on(&clock, async {
            link.write_all(b"SS250000\n").await.unwrap();
            assert_eq!(read(&mut link, 14).await, b"SS250000\n00P\n\n");
            link.set_baud(250_000).await;
            link.write_all(b"MD0044072501001\n").await.unwrap();
            let begun_us = clock.now_us();
            assert_eq!(read(&mut link, 21 + 2137).await.len(), 2158);
            assert!(clock.now_us() - begun_us < 300_000, "too slow for 250 kbaud");
        })
        .unwrap();
        assert_eq!(link.with_sensor(|sensor, _| sensor.baud()), 250_000);
    }

    #[test]
    fn two_runs_with_jitter_are_the_same() {
        let run = || {
            let options = LinkOptions { chunk_bytes: 7, jitter_us: 20_000, ..LinkOptions::default() };
            let (clock, mut link) = link(Config::new(UST_10LX), options);
            let bytes = block_on(&clock, async {
                link.write_all(b"MS0000108000000\n").await.unwrap();
                read(&mut link, 9000).await
            });
            (bytes.unwrap(), clock.now_us())
        };
        assert_eq!(run(), run());
    }

    #[test]
    fn a_closed_link_reads_as_end_of_file_and_refuses_writes() {
        let (clock, mut link) = link(Config::new(UST_10LX), LinkOptions::default());
        link.disconnect();
        let (count, refused) =
            block_on(&clock, async { (link.read(&mut [0; 8]).await, link.write(b"VV\n").await) }).unwrap();
        assert_eq!((count, refused), (Ok(0), Err(LinkError::Closed)));
        link.replug();
        let answer = block_on(&clock, async {
            link.write_all(b"QT\n").await.unwrap();
            read(&mut link, 8).await
        });
        assert_eq!(answer.unwrap(), b"QT\n00P\n\n");
    }
}
