//! The way to a real sensor, or an emulated one: TCP, or a serial device. Opened by the first read, and anew
//! after every failure.

use std::fmt;
use std::fs::File;
use std::io::{self, ErrorKind, Read as _, Write as _};
use std::net::{TcpStream, ToSocketAddrs};
use std::os::fd::AsFd;
use std::path::PathBuf;
use std::rc::Rc;
use std::str::FromStr;
use std::task::Poll;
use std::thread::JoinHandle;
use std::time::Duration;

use embedded_io_async::{ErrorType, Read, Write};
use kehai::link::{Baud, Clock};
use kehai::sensor::LineSettings;
use rustix::event::PollFlags;
use rustix::fs::{Mode, OFlags, open};
use rustix::termios::{OptionalActions, tcdrain, tcgetattr, tcsetattr};

use super::reactor::Reactor;

/// Longest wait for a connection.
const CONNECT: Duration = Duration::from_secs(2);

/// Between two looks at a connection that is being made, µs.
const LOOK_US: u64 = 20_000;

/// Speed of a serial device before the driver has set one.
const FIRST_BAUD: u32 = 19_200;

/// Where a sensor is: `tcp://HOST:PORT` or `serial:///dev/…`.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Place {
    /// A socket.
    Tcp(String),
    /// A serial device.
    Serial(PathBuf),
}

impl FromStr for Place {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let usage = || "a sensor is tcp://HOST:PORT or serial:///dev/NAME".to_owned();
        if let Some(address) = text.strip_prefix("tcp://") {
            let (host, port) = address.rsplit_once(':').ok_or_else(usage)?;
            if host.is_empty() || port.parse::<u16>().is_err() {
                return Err(usage());
            }
            Ok(Self::Tcp(address.to_owned()))
        } else if let Some(path) = text.strip_prefix("serial://") {
            if path.starts_with('/') { Ok(Self::Serial(path.into())) } else { Err(usage()) }
        } else {
            Err(usage())
        }
    }
}

impl Place {
    /// What the driver must know of the line; `last_baud` is what was remembered.
    #[must_use]
    pub const fn settings(&self, last_baud: Option<u32>) -> LineSettings {
        match self {
            Self::Tcp(_) => LineSettings::NoSpeed,
            Self::Serial(_) => LineSettings::Serial { last_baud, wanted_baud: None, fastest_baud: 750_000 },
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tcp(address) => write!(f, "tcp://{address}"),
            Self::Serial(path) => write!(f, "serial://{}", path.display()),
        }
    }
}

/// The way to a sensor.
pub struct Line {
    place: Place,
    /// Told why the line cannot be opened, when that changes.
    on_failure: fn(&Place, &io::Error),
    failure: Option<ErrorKind>,
    reactor: Reactor,
    baud: u32,
    state: State,
}

enum State {
    Closed,
    Connecting(JoinHandle<io::Result<TcpStream>>),
    Tcp(Rc<TcpStream>),
    Serial(Rc<File>),
}

impl Line {
    /// To this place; opened when it is needed. `on_failure` is told why it cannot be, once for each kind of failure
    /// until it can.
    #[must_use]
    pub fn new(place: Place, reactor: &Reactor, on_failure: fn(&Place, &io::Error)) -> Self {
        let (reactor, state) = (reactor.clone(), State::Closed);
        Self { place, on_failure, failure: None, reactor, baud: FIRST_BAUD, state }
    }

    /// Opens it if it is closed.
    async fn opened(&mut self) -> io::Result<()> {
        let result = self.open().await;
        let failure = result.as_ref().err().map(io::Error::kind);
        if let Err(error) = &result
            && self.failure != failure
        {
            (self.on_failure)(&self.place, error);
        }
        self.failure = failure;
        result
    }

    async fn open(&mut self) -> io::Result<()> {
        loop {
            self.state = match std::mem::replace(&mut self.state, State::Closed) {
                State::Closed => match &self.place {
                    Place::Tcp(address) => {
                        let address = address.clone();
                        State::Connecting(std::thread::spawn(move || connect(&address)))
                    }
                    Place::Serial(path) => {
                        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC | OFlags::NONBLOCK;
                        let file = File::from(open(path, flags, Mode::empty())?);
                        set_speed(&file, self.baud)?;
                        State::Serial(Rc::new(file))
                    }
                },
                State::Connecting(thread) if thread.is_finished() => {
                    let failed = Err(io::Error::from(ErrorKind::NotConnected));
                    State::Tcp(Rc::new(thread.join().unwrap_or(failed)?))
                }
                State::Connecting(thread) => {
                    self.state = State::Connecting(thread);
                    self.reactor.wait_until(self.reactor.now_us() + LOOK_US).await;
                    continue;
                }
                open => {
                    self.state = open;
                    return Ok(());
                }
            };
        }
    }

    /// Does `operation` as soon as the line is ready for it; a failure closes it.
    async fn when_ready(
        &mut self,
        flags: PollFlags,
        mut operation: impl FnMut(&State) -> io::Result<usize>,
    ) -> io::Result<usize> {
        self.opened().await?;
        let result = std::future::poll_fn(|_| match operation(&self.state) {
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {
                let descriptor: Rc<dyn AsFd> = match &self.state {
                    State::Tcp(stream) => stream.clone(),
                    State::Serial(file) => file.clone(),
                    State::Closed | State::Connecting(_) => {
                        return Poll::Ready(Err(ErrorKind::NotConnected.into()));
                    }
                };
                self.reactor.wait_for(descriptor, flags);
                Poll::Pending
            }
            result => Poll::Ready(result),
        })
        .await;
        if !matches!(result, Ok(1..)) {
            self.state = State::Closed;
        }
        result
    }
}

fn connect(address: &str) -> io::Result<TcpStream> {
    let mut failure = io::Error::from(ErrorKind::NotFound);
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, CONNECT) {
            Ok(stream) => {
                stream.set_nodelay(true)?;
                stream.set_nonblocking(true)?;
                return Ok(stream);
            }
            Err(error) => failure = error,
        }
    }
    Err(failure)
}

fn set_speed(file: &File, rate_baud: u32) -> io::Result<()> {
    let mut settings = tcgetattr(file)?;
    settings.make_raw();
    settings.set_speed(rate_baud)?;
    Ok(tcsetattr(file, OptionalActions::Now, &settings)?)
}

impl ErrorType for Line {
    type Error = io::Error;
}

impl Read for Line {
    async fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.when_ready(PollFlags::IN, |state| match state {
            State::Tcp(stream) => (&**stream).read(buffer),
            State::Serial(file) => (&**file).read(buffer),
            State::Closed | State::Connecting(_) => Ok(0),
        })
        .await
    }
}

impl Write for Line {
    async fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.when_ready(PollFlags::OUT, |state| match state {
            State::Tcp(stream) => (&**stream).write(bytes),
            State::Serial(file) => (&**file).write(bytes),
            State::Closed | State::Connecting(_) => Ok(0),
        })
        .await
    }

    async fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Baud for Line {
    async fn set_baud(&mut self, rate_baud: u32) {
        self.baud = rate_baud;
        if let State::Serial(file) = &self.state {
            // A device that is gone is opened anew, at the new speed.
            let _ = tcdrain(&**file);
            let _ = set_speed(file, rate_baud);
        }
    }
}
