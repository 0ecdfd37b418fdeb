//! Joins the session to a link and a clock. It decides nothing.
//!
//! ```text
//!   loop {
//!       match driver.event_until(limit_us).await {
//!           SensorEvent::Scan         => … driver.scan()     borrowed until the next call
//!           SensorEvent::State(state) => …
//!           SensorEvent::Timeout      => …
//!       }
//!   }
//! ```

use embassy_futures::select::{Either, select};
use embedded_io_async::{Read, Write};

use super::action::{Action, Message, ScanTaken};
use super::session::Session;
use super::settings::SensorSettings;
use super::state::SensorState;
use crate::link::{Baud, Clock};
use crate::scan::Scan;

/// Bytes read at a time: at 115 200 baud, 22 ms of them.
const CHUNK: usize = 256;

/// Longest time for handing a request to the link, or changing its speed; both take milliseconds.
const SEND_US: u64 = 500_000;

/// What [`Driver::event_until`] returns with.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SensorEvent {
    /// A scan has arrived: [`Driver::scan`].
    Scan,
    /// The sensor's state has changed.
    State(SensorState),
    /// Neither, until the time given.
    Timeout,
}

/// A sensor on a link, with memory for scans of `BEAMS` beams.
///
/// The link may fail: a read of 0 bytes or with an error is tried again after a pause of at most half a
/// second, for ever. A link that has to be opened anew should do so in its `read`.
#[derive(Debug)]
pub struct Driver<L, C, const BEAMS: usize> {
    link: L,
    clock: C,
    session: Session,
    ranges_mm: [u16; BEAMS],
    chunk: [u8; CHUNK],
    /// The part of `chunk` that is still to be looked at, and when it came.
    start: usize,
    end: usize,
    arrival_us: u64,
    taken: Option<ScanTaken>,
}

impl<L: Read + Write + Baud, C: Clock, const BEAMS: usize> Driver<L, C, BEAMS> {
    /// A driver on `link`; nothing is sent before [`event_until`](Self::event_until) is called.
    pub fn new(link: L, clock: C, settings: SensorSettings) -> Self {
        let capacity = u16::try_from(BEAMS).unwrap_or(u16::MAX);
        Self {
            link,
            clock,
            session: Session::new(settings, capacity),
            ranges_mm: [0; BEAMS],
            chunk: [0; CHUNK],
            start: 0,
            end: 0,
            arrival_us: 0,
            taken: None,
        }
    }

    /// State, counters, and what is known of the sensor.
    pub const fn session(&self) -> &Session {
        &self.session
    }

    /// The scan of the newest [`SensorEvent::Scan`], until the next call of [`event_until`](Self::event_until).
    pub fn scan(&self) -> Option<Scan<'_>> {
        let ScanTaken { time, beams } = self.taken?;
        let ranges_mm = self.ranges_mm.get(..usize::from(beams)).unwrap_or(&[]);
        Some(Scan { geometry: self.session.geometry()?, ranges_mm, time })
    }

    /// Stops the stream; [`event_until`](Self::event_until) then returns [`SensorState::Paused`], half a second
    /// later at most.
    pub fn pause(&mut self) {
        self.session.pause(self.clock.now_us());
    }

    /// Goes on after [`pause`](Self::pause), with these settings.
    pub fn resume_with(&mut self, settings: SensorSettings) {
        self.session.resume_with(settings, self.clock.now_us());
    }

    /// Waits for the next scan or change of state, but no longer than until `limit_us` (µs since boot; `u64::MAX`:
    /// for ever). It recovers from every failure by itself, and passes the limit only while it sends.
    ///
    /// # Cancellation
    /// Bytes of a read under way may be lost, which costs the scan they belong to. A request may be sent in
    /// part or not at all; it is repeated when its answer does not come. A change of the line's speed is begun anew. Call
    /// again.
    pub async fn event_until(&mut self, limit_us: u64) -> SensorEvent {
        self.taken = None;
        loop {
            if let Some(state) = self.session.state_change() {
                return SensorEvent::State(state);
            }
            if let Some(bytes) = self.chunk.get(self.start..self.end).filter(|bytes| !bytes.is_empty()) {
                let received = self.session.receive(bytes, self.arrival_us, &mut self.ranges_mm);
                self.start = self.start.saturating_add(received.consumed.max(1));
                if received.scan.is_some() {
                    self.taken = received.scan;
                    return SensorEvent::Scan;
                }
                continue;
            }
            let now_us = self.clock.now_us();
            match self.session.poll(now_us) {
                Action::Wait(_) | Action::Pause(_) if now_us >= limit_us => return SensorEvent::Timeout,
                Action::SetBaud(rate_baud) => {
                    let limit_us = self.clock.now_us().saturating_add(SEND_US);
                    let change = self.link.set_baud(rate_baud);
                    // Given up meanwhile, it is asked for again.
                    self.session.repeat_baud();
                    let done = select(change, self.clock.wait_until(limit_us)).await;
                    self.session.baud_is_set();
                    if let Either::Second(()) = done {
                        self.session.link_failed(self.clock.now_us());
                    }
                }
                Action::Send(message) => {
                    let limit_us = self.clock.now_us().saturating_add(SEND_US);
                    let send = send(&mut self.link, &message);
                    let Either::First(true) = select(send, self.clock.wait_until(limit_us)).await else {
                        self.session.link_failed(self.clock.now_us());
                        continue;
                    };
                }
                Action::Wait(until_us) => {
                    let read = self.link.read(&mut self.chunk);
                    let Either::First(result) =
                        select(read, self.clock.wait_until(until_us.min(limit_us))).await
                    else {
                        continue;
                    };
                    self.arrival_us = self.clock.now_us();
                    self.start = 0;
                    self.end = result.unwrap_or(0).min(CHUNK);
                    if self.end == 0 {
                        self.session.link_failed(self.arrival_us);
                    }
                }
                Action::Pause(until_us) => self.clock.wait_until(until_us.min(limit_us)).await,
            }
        }
    }
}

/// Whether all of it was sent.
async fn send<L: Write>(link: &mut L, message: &Message) -> bool {
    for part in message.parts() {
        if link.write_all(part).await.is_err() {
            return false;
        }
    }
    link.flush().await.is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::convert::Infallible;
    use embassy_futures::poll_once;
    use embedded_io_async::ErrorType;
    use std::vec::Vec;

    /// A line that takes its time to change its speed. It brings nothing.
    #[derive(Default)]
    struct SlowLine {
        is_slow: bool,
        rates_baud: Vec<u32>,
        sent: usize,
    }

    impl ErrorType for SlowLine {
        type Error = Infallible;
    }

    impl Read for SlowLine {
        async fn read(&mut self, _: &mut [u8]) -> Result<usize, Infallible> {
            core::future::pending().await
        }
    }

    impl Write for SlowLine {
        async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
            self.sent += bytes.len();
            Ok(bytes.len())
        }

        async fn flush(&mut self) -> Result<(), Infallible> {
            Ok(())
        }
    }

    impl Baud for SlowLine {
        async fn set_baud(&mut self, rate_baud: u32) {
            if self.is_slow {
                core::future::pending::<()>().await;
            }
            self.rates_baud.push(rate_baud);
        }
    }

    /// It stands still.
    struct Still;

    impl Clock for Still {
        fn now_us(&self) -> u64 {
            0
        }

        async fn wait_until(&self, _: u64) {
            core::future::pending().await
        }
    }

    #[test]
    fn a_change_of_the_lines_speed_that_was_given_up_is_done_before_anything_is_sent() {
        let line = SlowLine { is_slow: true, ..SlowLine::default() };
        let mut driver = Driver::<_, _, 16>::new(line, Still, SensorSettings::SERIAL);
        assert!(poll_once(driver.event_until(u64::MAX)).is_ready(), "it searches");
        for _ in 0..2 {
            assert!(poll_once(driver.event_until(u64::MAX)).is_pending());
            assert_eq!((driver.link.rates_baud.len(), driver.link.sent), (0, 0));
        }
        driver.link.is_slow = false;
        assert!(poll_once(driver.event_until(u64::MAX)).is_pending());
        assert_eq!(driver.link.rates_baud, [19_200]);
        assert!(driver.link.sent > 0);
    }
}
