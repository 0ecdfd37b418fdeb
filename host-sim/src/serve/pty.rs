//! An emulated sensor on a pseudo terminal, as on a serial line: its speed matters.
//!
//! ```text
//! client ─▶ LINK ─▶ /dev/pts/N ─▶ master ─▶ sensor     the client's speed is read from the terminal;
//!                                                       another speed than the sensor's gives garbage
//! ```
//!
//! The terminal is held open here, so that its settings stay; `inotify` tells when somebody else opens it.
//! As on a real line, bytes that nobody reads are lost. A client that reads late (QEMU takes one byte at a time)
//! must not take what it should have heard at one speed for what it hears at the next: garbage hardly waits for
//! it, and nothing outlasts a change of its speed.

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

/// Most bytes of garbage, heard at a wrong speed, that wait for the client.
const GARBAGE_BYTES: usize = 64;

/// Serves the sensor on a new pseudo terminal until told to stop; `link` points at it meanwhile and is removed in
/// the end. The sensor's time starts at 0 with this call.
///
/// # Errors
/// What the operating system says; [`io::ErrorKind::AlreadyExists`] if `link` is something else than a link.
pub fn serve_pty(link: &Path, sensor: Urg, control: &mut Control<'_>) -> io::Result<()> {
    serve_terminal(link, sensor, |rate_baud| rate_baud, control)
}

/// As [`serve_pty`], for a client that cannot set every speed: `meant` says which one it means.
///
/// # Errors
/// As [`serve_pty`].
pub fn serve_terminal(
    link: &Path,
    mut sensor: Urg,
    meant: fn(u32) -> u32,
    control: &mut Control<'_>,
) -> io::Result<()> {
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
            terminal = Some(Terminal::new(link, sensor.baud(), meant)?);
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
        let descriptors = [(line.master.as_fd(), PollFlags::IN), (line.watch.as_fd(), PollFlags::IN)];
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
    meant: fn(u32) -> u32,
    /// The client's speed, when last looked at.
    baud: u32,
    clients: u32,
}

impl Terminal {
    fn new(link: &Path, baud: u32, meant: fn(u32) -> u32) -> io::Result<Self> {
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
        Ok(Self { link: link.to_owned(), device, master, slave, watch, meant, baud, clients: 0 })
    }

    /// Counts who has the terminal open. What came before the first client did is gone.
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
            }
        }
    }

    /// The client's speed. What waits at another one is gone.
    fn baud(&mut self) -> io::Result<u32> {
        let baud = (self.meant)(tcgetattr(&self.master)?.output_speed());
        if std::mem::replace(&mut self.baud, baud) != baud {
            tcflush(&self.slave, QueueSelector::IFlush)?;
        }
        Ok(baud)
    }

    fn receive(&mut self, sensor: &mut Urg, clock: &Clock) -> io::Result<()> {
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
            let heard_baud = self.baud()?;
            let mut bytes = match sent.baud {
                Some(baud) => uart::received(&sent.bytes, baud, heard_baud),
                None => sent.bytes,
            };
            if sent.baud.is_some_and(|baud| baud != heard_baud) {
                let waiting = usize::try_from(ioctl_fionread(&self.slave)?).unwrap_or(usize::MAX);
                bytes.truncate(GARBAGE_BYTES.saturating_sub(waiting));
            }
            match rustix::io::write(&self.master, &bytes) {
                // Without flow control a receiver that is full loses bytes.
                Ok(_) | Err(rustix::io::Errno::AGAIN | rustix::io::Errno::INTR) => {}
                Err(error) => return Err(error.into()),
            }
        }
        Ok(())
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        if fs::read_link(&self.link).is_ok_and(|target| target == self.device) {
            // Nobody is left to tell.
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
