//! Devices of a site on this PC, in real time: each with the firmware's own tasks, at a UDP port of its own.
//!
//! ```text
//!   sensor ──TCP, SCIP──▶ driver ─▶ pipeline ──UDP──▶ any tracker      a range finder, a depth camera
//!   panels ─────────────▶ state machine ─────UDP──▶                    a floor
//!   a thread each          a thread each
//! ```
//!
//! The world's time begins with the devices, for every sensor as soon as its thread runs: within a millisecond
//! or two. Modules are announced by DNS-SD if that is asked for, to this machine alone; their addresses are known
//! anyway.

use std::error::Error;
use std::io;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, TcpListener, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::thread::{Builder, JoinHandle};
use std::time::Instant;

use kehai::floor::Floor;
use kehai::update::maker::DEVELOPMENT;
use kehai_emulator::pc::amended::Amend;
use kehai_emulator::pc::device::{Beside, PAGES, Pc};
use kehai_emulator::pc::flash::Flash;
use kehai_emulator::pc::floor::{self, Panels};
use kehai_emulator::pc::line::Place;
use kehai_emulator::pc::reactor::Reactor;
use kehai_emulator::pc::udp::Udp;
use kehai_emulator::serve::{Control, Status, serve_tcp};
use kehai_emulator::urg::Urg;

/// A port that the system chooses, for this machine alone.
const ANY_PORT: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 0);

/// The devices. They end when they are dropped.
pub struct Devices {
    begun: Instant,
    announced: bool,
    listed: Vec<(String, SocketAddr)>,
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Devices {
    /// None yet; whether the modules will announce themselves.
    #[must_use]
    pub fn new(announced: bool) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        Self { begun: Instant::now(), announced, listed: Vec::new(), stop, threads: Vec::new() }
    }

    /// Switches on the emulated sensor of a module, and says where it is; `on_status` is called after every turn of its
    /// loop.
    ///
    /// # Errors
    /// No port or thread is available.
    pub fn sensor(
        &mut self,
        name: &str,
        urg: Urg,
        mut on_status: impl FnMut(&Status) + Send + 'static,
    ) -> io::Result<Place> {
        let listener = TcpListener::bind(ANY_PORT)?;
        let place = Place::Tcp(listener.local_addr()?.to_string());
        let (stop, own_name) = (Arc::clone(&self.stop), name.to_owned());
        self.threads.push(Builder::new().name(format!("sensor {name}")).spawn(move || {
            let mut control = Control { stop: &stop, on_status: &mut on_status };
            if let Err(error) = serve_tcp(&listener, urg, &mut control) {
                tracing::error!("sensor {own_name} has ended: {error}");
            }
        })?);
        Ok(place)
    }

    /// Switches on a module beside the sensor at `sensor`; `amend` adds to its reports.
    ///
    /// # Errors
    /// No port or thread is available.
    pub fn module(&mut self, name: &str, sensor: Place, amend: Option<Arc<dyn Amend>>) -> io::Result<()> {
        let (listening, listens) = mpsc::channel();
        let (stop, announced, own_name) = (Arc::clone(&self.stop), self.announced, name.to_owned());
        self.threads.push(Builder::new().name(format!("module {name}")).spawn(move || {
            let port = match Udp::bind(ANY_PORT, &Reactor::new()) {
                Ok(port) => port,
                Err(error) => return drop(listening.send(Err(error))),
            };
            let _ = listening.send(port.local_addr());
            let flash = Flash::new(PAGES);
            let name = Some(own_name.as_str());
            let pc = Pc {
                beside: Beside::Sensor,
                sensor: &sensor,
                port: &port,
                flash: &flash,
                name,
                unique: None,
                maker: DEVELOPMENT,
                announced,
                amend,
            };
            if let Err(error) = start_again(&pc, &stop) {
                tracing::error!("module {own_name} has ended: {error}");
            }
        })?);
        let address =
            listens.recv().unwrap_or_else(|_| Err(io::Error::other("the module's thread has failed")))?;
        self.listed.push((name.to_owned(), address));
        Ok(())
    }

    /// Switches on a floor that reads `panels`.
    ///
    /// # Errors
    /// No port or thread is available.
    pub fn floor(
        &mut self,
        name: &str,
        floor: Floor,
        mut panels: impl Panels + Send + 'static,
    ) -> io::Result<()> {
        let socket = UdpSocket::bind(ANY_PORT)?;
        let address = socket.local_addr()?;
        let (stop, own_name) = (Arc::clone(&self.stop), name.to_owned());
        self.threads.push(Builder::new().name(format!("floor {name}")).spawn(move || {
            if let Err(error) = floor::run(&socket, &own_name, &floor, &mut panels, &stop, |_| {}) {
                tracing::error!("floor {own_name} has ended: {error}");
            }
        })?);
        self.listed.push((name.to_owned(), address));
        Ok(())
    }

    /// Names of the devices in the site, and where they listen.
    #[must_use]
    pub fn listed(&self) -> &[(String, SocketAddr)] {
        &self.listed
    }

    /// Time since they began, s: the world's.
    #[must_use]
    pub fn now_s(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }
}

impl Drop for Devices {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // A thread that has panicked has already printed its message.
            let _ = thread.join();
        }
    }
}

/// Start after start, until everything ends.
fn start_again(pc: &Pc<'_>, stop: &AtomicBool) -> Result<(), Box<dyn Error>> {
    while !stop.load(Ordering::Relaxed) {
        pc.start(stop, |_| {})?;
    }
    Ok(())
}
