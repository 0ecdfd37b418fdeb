//! An emulated sensor on a pseudo terminal, as on a serial line: its speed matters.
//!
//! ```text
//! client ─▶ LINK ─▶ /dev/pts/N ─▶ master ─▶ sensor     the client's speed is read from the terminal;
//!                                                       another speed than the sensor's gives garbage
//! ```
//!
//! The terminal is held open here, so that its settings stay; `inotify` reports when a client opens it.
//! On a line with a speed, bytes that no client reads are lost, as on a real one. A client that reads late (QEMU takes
//! one byte at a time) must not take what it should have heard at one speed for what it hears at the next: garbage
//! hardly waits for it, and nothing outlasts a change of its speed.
//!
//! USB has flow control: no byte is lost. A sensor whose client does not read drops whole scans.

use std::fs;
use std::io;
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::time::Instant;

use rustix::event::PollFlags;
use rustix::fs::inotify;
use rustix::fs::{Mode, OFlags, fcntl_setfl, open};
use rustix::io::ioctl_fionread;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, QueueSelector, tcflush, tcgetattr, tcsetattr};

use super::{Clock, Control, sleep};
use crate::uart;
use crate::urg::{LinkState, Urg};

/// Bytes that wait for a client that does not read, and beyond which its requests are not read either.
const MAX_UNSENT: usize = 64 * 1024;

/// Most bytes of garbage, heard at a wrong speed, that wait for the client.
const GARBAGE_BYTES: usize = 64;

/// Serves the sensor on a new pseudo terminal until told to stop; `link` points at it meanwhile and is removed in
/// the end. The sensor's time starts at 0 with this call.
///
/// # Errors
/// What the operating system says; [`io::ErrorKind::AlreadyExists`] if `link` is something else than a link.
pub fn serve_pty(link: &Path, mut sensor: Urg, control: &mut Control<'_>) -> io::Result<()> {
    let clock = Clock(Instant::now());
    let mut terminal = None;
    while !control.stopped() {
        sensor.advance(clock.now_us());
        if sensor.link() == LinkState::Closed {
            // The device is gone; so is its name.
            if terminal.take().is_some() {
                sensor.client_left(clock.now_us());
            }
        } else if terminal.is_none() {
            terminal = Some(Terminal::new(link, sensor.baud())?);
        }
        let Some(line) = &mut terminal else {
            control.report(&sensor, false);
            sleep(&[], &sensor, &clock)?;
            continue;
        };
        line.watch();
        line.receive(&mut sensor, &clock)?;
        line.send(&mut sensor, &clock)?;
        control.report(&sensor, line.clients > 0);
        let descriptors = [(line.master.as_fd(), line.wanted()), (line.watch.as_fd(), PollFlags::IN)];
        sleep(&descriptors, &sensor, &clock)?;
    }
    Ok(())
}

struct Terminal {
    link: PathBuf,
    device: PathBuf,
    master: OwnedFd,
    slave: OwnedFd,
    watch: OwnedFd,
    /// The client's speed, when last looked at.
    baud: u32,
    clients: u32,
    /// What the terminal had no room for yet; without a line speed only.
    unsent: Vec<u8>,
}

impl Terminal {
    fn new(link: &Path, baud: u32) -> io::Result<Self> {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&master)?;
        unlockpt(&master)?;
        fcntl_setfl(&master, OFlags::NONBLOCK)?;
        let name = ptsname(&master, Vec::new())?;
        let device = PathBuf::from(name.to_string_lossy().into_owned());
        let slave = open(&device, OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty())?;
        let mut settings = tcgetattr(&slave)?;
        settings.make_raw();
        settings.set_speed(baud)?;
        tcsetattr(&slave, OptionalActions::Now, &settings)?;
        let watch = inotify::init(inotify::CreateFlags::NONBLOCK | inotify::CreateFlags::CLOEXEC)?;
        let opened =
            inotify::WatchFlags::OPEN | inotify::WatchFlags::CLOSE_WRITE | inotify::WatchFlags::CLOSE_NOWRITE;
        inotify::add_watch(&watch, &device, opened)?;
        point(link, &device)?;
        Ok(Self { link: link.to_owned(), device, master, slave, watch, baud, clients: 0, unsent: Vec::new() })
    }

    /// What the terminal must be ready for before there is something to do.
    fn wanted(&self) -> PollFlags {
        let receive = if self.unsent.len() < MAX_UNSENT { PollFlags::IN } else { PollFlags::empty() };
        let send = if self.unsent.is_empty() { PollFlags::empty() } else { PollFlags::OUT };
        receive | send
    }

    /// Counts the clients that have the terminal open. What came before the first client did is gone.
    fn watch(&mut self) {
        let mut buffer = [MaybeUninit::uninit(); 1024];
        let mut events = inotify::Reader::new(&self.watch, &mut buffer);
        while let Ok(event) = events.next() {
            if event.events().contains(inotify::ReadFlags::OPEN) {
                if self.clients == 0 {
                    // Nothing can be done about a queue that cannot be emptied.
                    let _ = tcflush(&self.slave, QueueSelector::IFlush);
                }
                self.clients += 1;
            } else if event
                .events()
                .intersects(inotify::ReadFlags::CLOSE_WRITE | inotify::ReadFlags::CLOSE_NOWRITE)
            {
                self.clients = self.clients.saturating_sub(1);
                if self.clients == 0 {
                    self.unsent.clear();
                }
            }
        }
    }

    /// The client's speed. What waits at another one is gone.
    fn baud(&mut self) -> io::Result<u32> {
        let baud = tcgetattr(&self.master)?.output_speed();
        if std::mem::replace(&mut self.baud, baud) != baud {
            tcflush(&self.slave, QueueSelector::IFlush)?;
        }
        Ok(baud)
    }

    fn receive(&mut self, sensor: &mut Urg, clock: &Clock) -> io::Result<()> {
        if self.unsent.len() >= MAX_UNSENT {
            return Ok(());
        }
        let mut buffer = [0; 1024];
        let count = match rustix::io::read(&self.master, &mut buffer) {
            Ok(count) => count,
            Err(rustix::io::Errno::AGAIN | rustix::io::Errno::INTR) => return Ok(()),
            Err(error) => return Err(error.into()),
        };
        let bytes = buffer.get(..count).unwrap_or_default();
        if sensor.paced() {
            let bytes = uart::received(bytes, self.baud()?, sensor.baud());
            sensor.receive(&bytes, clock.now_us());
        } else {
            sensor.receive(bytes, clock.now_us());
        }
        Ok(())
    }

    fn send(&mut self, sensor: &mut Urg, clock: &Clock) -> io::Result<()> {
        for sent in sensor.take_output(clock.now_us()) {
            if self.clients == 0 {
                continue;
            }
            match sent.baud {
                Some(baud) => self.send_at(baud, &sent.bytes)?,
                None => self.unsent.extend(sent.bytes),
            }
        }
        while !self.unsent.is_empty() {
            let count = self.write(&self.unsent)?;
            if count == 0 {
                break;
            }
            self.unsent.drain(..count);
        }
        sensor.set_reader_behind(!self.unsent.is_empty());
        Ok(())
    }

    /// Sends bytes at the speed of a serial line. Without flow control a receiver that is full loses bytes.
    fn send_at(&mut self, baud: u32, bytes: &[u8]) -> io::Result<()> {
        let heard_baud = self.baud()?;
        let mut bytes = uart::received(bytes, baud, heard_baud);
        if baud != heard_baud {
            let waiting = usize::try_from(ioctl_fionread(&self.slave)?).unwrap_or(usize::MAX);
            bytes.truncate(GARBAGE_BYTES.saturating_sub(waiting));
        }
        self.write(&bytes).map(|_| ())
    }

    /// Writes what the terminal has room for: how many bytes.
    fn write(&self, bytes: &[u8]) -> io::Result<usize> {
        match rustix::io::write(&self.master, bytes) {
            Ok(count) => Ok(count),
            Err(rustix::io::Errno::AGAIN | rustix::io::Errno::INTR) => Ok(0),
            Err(error) => Err(error.into()),
        }
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        if fs::read_link(&self.link).is_ok_and(|target| target == self.device) {
            // No caller is left to report an error to.
            let _ = fs::remove_file(&self.link);
        }
    }
}

/// Makes `link` point at the terminal, in place of an older link.
fn point(link: &Path, device: &Path) -> io::Result<()> {
    match fs::symlink_metadata(link) {
        Ok(found) if found.file_type().is_symlink() => fs::remove_file(link)?,
        Ok(_) => {
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, "exists and is not a symbolic link"));
        }
        Err(_) => {}
    }
    symlink(device, link)
}
