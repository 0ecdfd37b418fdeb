//! The time of emulated boards, and of everything connected to them.
//!
//! ```text
//! board 1   ███ 1 ms ███│ stands │███ 1 ms ███│ stands │ …
//! board 2   ██ 1 ms ██──│ stands │████ 1 ms ██│ stands │ …      time passes only while a board runs
//! here           waits  │ world  │   waits    │ world  │ …      sensors, switches, then the test
//! ```
//!
//! A board reports the end of a step through a FIFO, and stands until it gets the command to go on: see
//! `src/bin/mps2-an386/lockstep.rs`. It runs a step only when the test waits for something. So actions of sensors,
//! network and hosts have the same delay in the board's time on a slow machine as on a fast one, and every wait is
//! counted in that time.

use std::cell::{Cell, RefCell};
use std::fs::File;
use std::io::{Read, Write};
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::os::fd::{AsFd, BorrowedFd};
use std::path::Path;
use std::process::Child;
use std::rc::Rc;
use std::time::{Duration, Instant};
use std::{io, thread};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{CWD, FileType, Mode, mknodat};

use crate::pc::host::{PATIENCE, Way};
use crate::serve::{SerialDevice, UdpSensor};

/// Guest time of a step (`STEP_US` of the image).
pub const STEP_US: u64 = 1000;

/// Wait for anything in the guest, in its own time.
pub const PATIENCE_US: u64 = PATIENCE.as_secs() * 1_000_000;

/// Clock of the board's UARTs.
const UART_CLOCK_HZ: u64 = 25_000_000;

/// Names of the FIFOs, as the image has them.
const FROM_GUEST: &str = "guest-time";
const TO_GUEST: &str = "go-on";

/// Wait for QEMU's answer in each step of a frozen board: its time costs none of this machine's.
const FROZEN_STEP: Timespec = Timespec { tv_sec: 0, tv_nsec: 1_000_000 };
const NOT_AT_ALL: Timespec = Timespec { tv_sec: 0, tv_nsec: 0 };

/// Between two looks whether a silent QEMU is still there.
const LOOK: Timespec = Timespec { tv_sec: 1, tv_nsec: 0 };

/// What carries frames between boards, once between two steps of their time.
pub(super) trait Forward {
    /// Forwards every frame that has come.
    fn forward(&self);
}

/// The time of boards that live in one world. Clones are the same.
#[derive(Clone, Default)]
pub struct GuestTime(Rc<World>);

#[derive(Default)]
struct World {
    now_us: Cell<u64>,
    /// When time 0 was, if it is not to pass faster than here.
    begin: Cell<Option<Instant>>,
    boards: RefCell<Vec<Rc<Lockstep>>>,
    switches: RefCell<Vec<Rc<dyn Forward>>>,
}

impl GuestTime {
    /// Time 0 of a world without boards.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// For a world with programs that go by the clock of this machine: time may fall behind that, but never gets
    /// ahead.
    #[must_use]
    pub fn not_faster_than_real() -> Self {
        let time = Self::default();
        time.0.begin.set(Some(Instant::now()));
        time
    }

    /// Time of the world, µs.
    #[must_use]
    pub fn now_us(&self) -> u64 {
        self.0.now_us.get()
    }

    /// Lets all boards run for [`STEP_US`].
    pub fn step(&self) {
        self.step_or(None);
    }

    /// Calls `look` after each step until it returns a value; `None` after `wait_us`.
    pub fn until<T>(&self, wait_us: u64, mut look: impl FnMut() -> Option<T>) -> Option<T> {
        let end_us = self.now_us() + wait_us;
        loop {
            let found = look();
            if found.is_some() || self.now_us() >= end_us {
                return found;
            }
            self.step();
        }
    }

    /// A step that ends early when `other` is readable: true if it is.
    pub(super) fn step_or(&self, other: Option<BorrowedFd<'_>>) -> bool {
        let boards = self.0.boards.borrow().clone();
        let frozen = boards.iter().any(|board| board.frozen.get());
        if frozen && other.is_some_and(|other| ready(&[other], &FROZEN_STEP) == Some(0)) {
            return true;
        }
        self.forward();
        boards.iter().for_each(|board| board.go_on());
        for board in &boards {
            if board.meet(other) == Meeting::Interrupted {
                return true;
            }
        }
        self.forward();
        self.0.now_us.set(self.now_us() + STEP_US);
        if let Some(begin) = self.0.begin.get() {
            thread::sleep(Duration::from_micros(self.now_us()).saturating_sub(begin.elapsed()));
        }
        other.is_some_and(|other| ready(&[other], &NOT_AT_ALL) == Some(0))
    }

    /// Runs steps until `other` is readable.
    pub(super) fn until_ready(&self, other: BorrowedFd<'_>) -> io::Result<()> {
        let end_us = self.now_us() + PATIENCE_US;
        while !self.step_or(Some(other)) {
            if self.now_us() >= end_us {
                return Err(io::ErrorKind::TimedOut.into());
            }
        }
        Ok(())
    }

    fn forward(&self) {
        self.0.switches.borrow().iter().for_each(|switch| switch.forward());
    }

    pub(super) fn add_switch(&self, switch: Rc<dyn Forward>) {
        self.0.switches.borrow_mut().push(switch);
    }

    pub(super) fn add_board(&self, board: Rc<Lockstep>) {
        self.0.boards.borrow_mut().push(board);
    }

    pub(super) fn remove_board(&self, board: &Rc<Lockstep>) {
        self.0.boards.borrow_mut().retain(|other| !Rc::ptr_eq(other, board));
    }
}

/// Index of the first readable descriptor.
fn ready(descriptors: &[BorrowedFd<'_>], wait: &Timespec) -> Option<usize> {
    let mut polled: Vec<_> =
        descriptors.iter().map(|&descriptor| PollFd::from_borrowed_fd(descriptor, PollFlags::IN)).collect();
    // An error is an interruption: it is looked at again.
    poll(&mut polled, Some(wait)).ok()?;
    polled.iter().position(|descriptor| !descriptor.revents().is_empty())
}

/// Whether the speed of the line matters to a board's sensor.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Speed {
    /// Any speed of the line is right.
    Any,
    /// As on a real line.
    Matters,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum State {
    /// Its step is not over.
    Runs,
    /// It waits for the command to go on.
    Stands,
    /// QEMU has ended.
    Gone,
}

#[derive(PartialEq, Eq)]
enum Meeting {
    /// The board is done with its step, or cannot be.
    Over,
    /// The step goes on, but other input must be handled first.
    Interrupted,
}

/// One board's end of the lock-step.
pub(super) struct Lockstep {
    child: RefCell<Child>,
    from_guest: File,
    to_guest: File,
    sensor: Option<(UdpSensor<dyn SerialDevice>, Speed)>,
    state: Cell<State>,
    /// QEMU has stopped the machine, perhaps in the midst of a step.
    frozen: Cell<bool>,
    /// Last report of the guest: its time since its reset, µs, and the divisor of its line.
    said: Cell<[u64; 2]>,
}

/// Makes the FIFOs in `folder`, before QEMU is started in it.
pub(super) fn make_fifos(folder: &Path) -> io::Result<()> {
    for name in [FROM_GUEST, TO_GUEST] {
        mknodat(CWD, folder.join(name), FileType::Fifo, Mode::RUSR | Mode::WUSR, 0)?;
    }
    Ok(())
}

impl Lockstep {
    /// With QEMU running as `child` in `folder`.
    pub fn new(
        child: Child,
        folder: &Path,
        sensor: Option<(UdpSensor<dyn SerialDevice>, Speed)>,
    ) -> io::Result<Rc<Self>> {
        // Open for both, a FIFO neither waits for its other end nor ends with it.
        let open = |name| File::options().read(true).write(true).open(folder.join(name));
        Ok(Rc::new(Self {
            child: RefCell::new(child),
            from_guest: open(FROM_GUEST)?,
            to_guest: open(TO_GUEST)?,
            sensor,
            state: Cell::new(State::Runs),
            frozen: Cell::new(false),
            said: Cell::default(),
        }))
    }

    /// Exit status of QEMU, if it has ended.
    pub fn ended(&self) -> io::Result<Option<std::process::ExitStatus>> {
        self.child.borrow_mut().try_wait()
    }

    /// Ends QEMU, whatever it is doing.
    pub fn end(&self) {
        let mut child = self.child.borrow_mut();
        // It may be gone already; then there is nothing to end.
        let _ = child.kill();
        let _ = child.wait();
        self.state.set(State::Gone);
    }

    /// QEMU has stopped the machine, or lets it go on.
    pub fn set_frozen(&self, frozen: bool) {
        self.frozen.set(frozen);
    }

    fn go_on(&self) {
        if self.state.get() != State::Stands {
            return;
        }
        let [now_us, divisor] = self.said.get().map(u64::to_le_bytes);
        if (&self.to_guest).write_all(&[now_us, divisor].concat()).is_ok() {
            self.state.set(State::Runs);
        }
    }

    /// Waits for the end of the step, and lets the sensor have as much time.
    fn meet(&self, other: Option<BorrowedFd<'_>>) -> Meeting {
        let begin = Instant::now();
        while self.state.get() == State::Runs && !self.frozen.get() {
            let descriptors: Vec<_> = [self.from_guest.as_fd()].into_iter().chain(other).collect();
            match ready(&descriptors, &LOOK) {
                Some(0) => self.listen(),
                Some(_) => return Meeting::Interrupted,
                None if matches!(self.ended(), Ok(None)) && begin.elapsed() < PATIENCE => {}
                None => self.end(),
            }
        }
        Meeting::Over
    }

    fn listen(&self) {
        let mut said = [[0; 8]; 2];
        if (&self.from_guest).read_exact(said.as_flattened_mut()).is_err() {
            return self.end();
        }
        let [now_us, divisor] = said.map(u64::from_le_bytes);
        let [before_us, _] = self.said.replace([now_us, divisor]);
        self.state.set(State::Stands);
        // After a reset its time begins anew.
        let passed_us = now_us.checked_sub(before_us).unwrap_or(now_us);
        if let Some((sensor, speed)) = &self.sensor {
            let baud = u32::try_from(UART_CLOCK_HZ / divisor.max(1)).unwrap_or(u32::MAX);
            sensor.advance(passed_us, (*speed == Speed::Matters).then_some(baud));
        }
    }
}

/// Connection to a module through the UDP port that QEMU's user network forwards.
pub struct Forwarded {
    socket: UdpSocket,
    time: GuestTime,
}

impl Forwarded {
    /// From a port of its own.
    ///
    /// # Errors
    /// No socket is available.
    pub fn new(module: SocketAddr, time: &GuestTime) -> io::Result<Self> {
        Self::from((Ipv4Addr::LOCALHOST, 0).into(), module, time)
    }

    /// From the port at `own`.
    ///
    /// # Errors
    /// The port is not free.
    pub fn from(own: SocketAddr, module: SocketAddr, time: &GuestTime) -> io::Result<Self> {
        let socket = UdpSocket::bind(own)?;
        socket.connect(module)?;
        socket.set_nonblocking(true)?;
        Ok(Self { socket, time: time.clone() })
    }

    /// Its own address.
    ///
    /// # Errors
    /// The operating system's.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }
}

impl Way for Forwarded {
    fn send(&self, datagram: &[u8]) {
        Way::send(&self.socket, datagram);
    }

    fn receive(&self, buffer: &mut [u8]) -> Option<usize> {
        self.time.until(STEP_US, || self.socket.recv(buffer).ok())
    }

    fn now_us(&self) -> u64 {
        self.time.now_us()
    }
}
