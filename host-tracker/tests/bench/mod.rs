//! A module beside an emulated sensor that looks into a still room: the library's own tasks over real sockets.
#![allow(dead_code, reason = "each test uses its own part of it")]

use std::net::{SocketAddr, TcpListener};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use kehai::update::maker::DEVELOPMENT;
use kehai_emulator::pc::device::{Beside, PAGES, Pc, set_label};
use kehai_emulator::pc::flash::Flash;
use kehai_emulator::pc::reactor::Reactor;
use kehai_emulator::pc::udp::Udp;
use kehai_emulator::serve::{Control, serve_tcp};
use kehai_emulator::source::{RangeSource, Revolution, SensorGeometry, SourceScan, StillRoom};
use kehai_emulator::urg::model::URG_04LX;
use kehai_emulator::urg::{Config, Urg};

/// A hundred times what a loaded machine needs.
pub const PATIENCE: Duration = Duration::from_secs(120);

/// The still room with a chair in it, once there is one: all steps from `CHAIR.0` to `CHAIR.1` read `CHAIR.2`.
struct Furnished {
    room: StillRoom,
    chair: Arc<Mutex<bool>>,
}

/// First step, last step, range of its sides in mm.
const CHAIR: (u16, u16, u32) = (360, 420, 900);

/// How far the middle of the chair's back stands out, mm: as round as a person's.
const ROUND_MM: u32 = 60;

impl RangeSource for Furnished {
    fn geometry(&self) -> SensorGeometry {
        self.room.geometry()
    }

    fn scan(&mut self, revolution: Revolution) -> Option<SourceScan> {
        let mut scan = self.room.scan(revolution)?;
        let steps = self.geometry().first_step..;
        for (step, range_mm) in steps.zip(&mut scan.ranges_mm).filter(|_| *self.chair.lock().unwrap()) {
            if (CHAIR.0..=CHAIR.1).contains(&step) {
                let (middle, half) = (CHAIR.0.midpoint(CHAIR.1), (CHAIR.1 - CHAIR.0) / 2);
                let aside = u32::from(step.abs_diff(middle)) * ROUND_MM / u32::from(half);
                *range_mm = CHAIR.2 - (ROUND_MM - aside);
            }
        }
        Some(scan)
    }
}

/// The secret on the module's label.
pub const LABEL: [u8; 16] = [0x5a; 16];

/// A sensor and a module in threads of their own.
pub struct Bench {
    /// Whether there is a chair in the room.
    pub chair: Arc<Mutex<bool>>,
    /// The button is held while the module starts the next time: all that it has stored is erased but its label.
    pub button: Arc<AtomicBool>,
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
    pub name: String,
    pub address: SocketAddr,
}

impl Bench {
    pub fn start(name: &str) -> Self {
        // Other runs of this test on this machine and network have names of their own.
        let name = format!("{name}-{}", std::process::id());
        let stop = Arc::new(AtomicBool::new(false));
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let place = format!("tcp://{}", listener.local_addr().unwrap()).parse().unwrap();
        let stopped = Arc::clone(&stop);
        let chair = Arc::new(Mutex::new(false));
        let room = Furnished { room: StillRoom::new(URG_04LX.geometry), chair: Arc::clone(&chair) };
        let sensor = std::thread::spawn(move || {
            let urg = Urg::new(Config { paced: false, ..Config::new(URG_04LX) }, Box::new(room), 0);
            serve_tcp(&listener, urg, &mut Control { stop: &stopped, on_status: &mut |_| {} }).unwrap();
        });
        let button = Arc::new(AtomicBool::new(false));
        let held = Arc::clone(&button);
        let (tell, told) = std::sync::mpsc::channel();
        let (stopped, own) = (Arc::clone(&stop), name.clone());
        let module = std::thread::spawn(move || {
            let port = Udp::bind("127.0.0.1:0".parse().unwrap(), &Reactor::new()).unwrap();
            let address: SocketAddr = port.local_addr().unwrap();
            let delivered = || {
                let flash = Flash::new(PAGES);
                set_label(&flash, &LABEL, &stopped).unwrap();
                flash
            };
            let mut flash = delivered();
            while !stopped.load(Ordering::Relaxed) {
                if held.swap(false, Ordering::Relaxed) {
                    flash = delivered();
                }
                let pc = Pc {
                    beside: Beside::Sensor,
                    sensor: &place,
                    port: &port,
                    flash: &flash,
                    name: Some(&own),
                    unique: None,
                    maker: DEVELOPMENT,
                    announced: true,
                    amend: None,
                };
                let started = |_| {
                    let _ = tell.send(address);
                };
                pc.start(&stopped, started).unwrap();
            }
        });
        let address = told.recv_timeout(PATIENCE).unwrap();
        Self { chair, button, stop, threads: vec![sensor, module], name, address }
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}
