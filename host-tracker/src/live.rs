//! Live modules over UDP: one socket for all of them, and what is known every 0.1 s.
//!
//! ```text
//!   DNS-SD ──────▶ peers ─▶ subscribe, info, profile ─▶ socket
//!   socket ─┬────▶   │ how each module is ─╮
//!           └▶ follower ─▶ tracks, zones ──┴─▶ a frame every 0.1 s
//! ```

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::calibrate::session::Session;
use crate::discovery::Search;
use crate::door::Shown;
use crate::follower::Follower;
use crate::frame::{Frame, unix_ms};
use crate::peers::Peers;
use crate::record::Recorder;
use crate::reports::{ReportLine, Reports};
use crate::sighting::Sighting;
use crate::site::Site;
use crate::trouble::Trouble;
use kehai::wire::Message;

/// Between two lines of tracks.
pub const LINE_US: u64 = 100_000;

/// Longest wait for a datagram: a tenth of a line's time.
const WAIT: Duration = Duration::from_millis(10);

/// Longer than any datagram of a module, so that a longer one is seen to be.
const BUFFER: usize = 2048;

/// Follows live modules.
pub struct Live {
    socket: UdpSocket,
    search: Option<Search>,
    peers: Peers,
    follower: Follower,
    begun: Instant,
    next_line_us: u64,
    /// Datagrams from addresses that are no module of ours.
    strangers: u64,
    recorder: Option<Recorder>,
    trouble: Trouble,
    doors: Shown,
    calibration: Session,
    reports: Reports,
}

impl Live {
    /// A socket for [`new`](Self::new).
    ///
    /// # Errors
    /// None can be had.
    pub fn bind() -> io::Result<UdpSocket> {
        let socket = UdpSocket::bind("0.0.0.0:0")?;
        socket.set_read_timeout(Some(WAIT))?;
        Ok(socket)
    }

    /// Listens to modules over a socket of [`bind`](Self::bind): to those among `peers`, and to those that are found.
    #[must_use]
    pub fn new(socket: UdpSocket, peers: Peers, search: Option<Search>, follower: Follower) -> Self {
        Self {
            socket,
            search,
            peers,
            follower,
            begun: Instant::now(),
            next_line_us: LINE_US,
            strangers: 0,
            recorder: None,
            trouble: Trouble::default(),
            doors: Shown::default(),
            calibration: Session::default(),
            reports: Reports::default(),
        }
    }

    /// Records everything from now on; to be called before the first frame.
    #[must_use]
    pub fn recording(self, recorder: Option<Recorder>) -> Self {
        Self { recorder, ..self }
    }

    /// Tells in every frame what is wrong with the tracker itself.
    #[must_use]
    pub fn telling(self, trouble: Trouble) -> Self {
        Self { trouble, ..self }
    }

    /// Tells in every frame how the doors are.
    #[must_use]
    pub fn showing(self, doors: Shown) -> Self {
        Self { doors, ..self }
    }

    /// Shows what is seen to whoever calibrates.
    #[must_use]
    pub fn calibrated_by(self, calibration: Session) -> Self {
        Self { calibration, ..self }
    }

    /// Tells of every report to those who listen.
    #[must_use]
    pub fn reporting(self, reports: Reports) -> Self {
        Self { reports, ..self }
    }

    /// Goes on with another site.
    pub fn change_site(&mut self, site: &Arc<Site>) {
        self.calibration.set_site(site);
        if let Some(recorder) = &self.recorder {
            recorder.told(self.now_us(), site);
        }
        self.follower.change_site(site);
        self.peers.change_site(site);
    }

    /// µs since it began: the clock of all that follows.
    #[must_use]
    pub fn now_us(&self) -> u64 {
        u64::try_from(self.begun.elapsed().as_micros()).unwrap_or(u64::MAX)
    }

    /// Sends what is due and takes what arrives, until the next frame is.
    ///
    /// # Errors
    /// The socket fails for good.
    pub fn frame(&mut self) -> io::Result<Frame> {
        let mut buffer = [0; BUFFER];
        loop {
            let now_us = self.now_us();
            if now_us >= self.next_line_us {
                let at_us = self.next_line_us;
                // After a stall the lines missed are left out.
                self.next_line_us = (now_us / LINE_US + 1) * LINE_US;
                return Ok(self.frame_at(at_us));
            }
            for finding in self.search.iter().flat_map(Search::findings) {
                self.peers.find(finding, now_us);
            }
            let socket = &self.socket;
            self.peers.poll(now_us, |datagram, to| send(socket, datagram, to));
            let (len, from) = match self.socket.recv_from(&mut buffer) {
                Ok(received) => received,
                Err(error) if is_passing(&error) => continue,
                Err(error) => return Err(error),
            };
            if let Some(datagram) = buffer.get(..len) {
                self.receive(datagram, from);
            }
        }
    }

    fn receive(&mut self, datagram: &[u8], from: SocketAddr) {
        let now_us = self.now_us();
        if !self.peers.knows(from) {
            self.strangers += 1;
            return;
        }
        if let Some(recorder) = &self.recorder {
            recorder.datagram(now_us, datagram);
        }
        let sighting = self.follower.receive(datagram, now_us);
        if let Some(sighting) = &sighting {
            self.calibration.see(sighting);
            if self.reports.are_wanted() {
                self.report(datagram, sighting, now_us);
            }
        }
        let socket = &self.socket;
        self.peers.receive(from, datagram, sighting, now_us, |datagram, to| send(socket, datagram, to));
    }

    /// Tells what is known right after this report.
    fn report(&mut self, datagram: &[u8], sighting: &Sighting, now_us: u64) {
        let Ok((_, Message::Report(report))) = Message::decode(datagram) else { return };
        let t = now_us as f64 * 1e-6;
        let module = self.peers.name(sighting.view.module).to_owned();
        let tracks = self.follower.peek(t);
        self.reports.tell(ReportLine { t, module, sequence: report.head.sequence, tracks });
    }

    fn frame_at(&mut self, at_us: u64) -> Frame {
        let line = self.follower.line(at_us as f64 * 1e-6);
        self.calibration.tick(self.follower.intake(), at_us as f64 * 1e-6);
        if let Some(recorder) = &self.recorder {
            recorder.line(at_us, &line);
            self.trouble.set("recording", &recorder.trouble());
        }
        Frame {
            unix_ms: unix_ms(),
            line,
            alarms: self.trouble.lines(),
            doors: self.doors.lines(),
            modules: self.peers.lines(self.follower.intake(), self.now_us()),
            dropped: *self.follower.intake().drops(),
            strangers: self.strangers,
        }
    }

    /// The follower.
    #[must_use]
    pub const fn follower(&self) -> &Follower {
        &self.follower
    }
}

/// What cannot be sent now is due again in a second.
fn send(socket: &UdpSocket, datagram: &[u8], to: SocketAddr) {
    let _ = socket.send_to(datagram, to);
}

/// Nothing came in time, or a module's host said that nobody listens there yet.
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
