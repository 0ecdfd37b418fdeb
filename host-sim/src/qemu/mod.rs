//! The real firmware image in QEMU: built, started, fed, listened to, frozen, reset and hung.
//!
//! ```text
//!   UdpSensor, terminal ───▶ UART0 ┌────────────┐ LAN9118 ◀── user network (slirp), a Switch, a tap
//!                                  │ mps2-an386 │
//!   log file (defmt) ◀────── UART1 └────────────┘ PSRAM ◀──▶ flash file
//!                                   ▲         ▲
//!                              Monitor      Debugger
//! ```
//!
//! Guest time is what the log says; nothing here judges by the host's clock. The host's clock only
//! ends waits that would otherwise never end ([`PATIENCE`]).

mod debugger;
mod image;
mod log;
mod monitor;
mod switch;
mod terminal;

pub use crate::module::host::PATIENCE;
pub use debugger::Watch;
pub use image::image;
pub use log::Message;
pub use switch::{Port, Switch};
pub use terminal::TerminalSensor;

use std::ffi::OsString;
use std::fs::{self, File};
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};
use std::{env, io};

use log::Log;
use monitor::Monitor;
use thiserror::Error;

use crate::serve::UdpSensor;

/// Between two looks at whatever is waited for.
const LOOK_AGAIN: Duration = Duration::from_millis(5);

/// UDP port of the module.
const MODULE_PORT: u16 = 4040;
/// The board's PSRAM, all of which QEMU takes from the flash file.
const PSRAM_LEN: u64 = 16 * 1024 * 1024;
/// Its beginning is the image's storage; erased flash is all ones.
const STORAGE_LEN: usize = 128 * 1024;
const STORAGE_ADDRESS: u32 = 0x2100_0000;

/// The image's memory: what is static at its beginning, the stack at its end.
const RAM_ADDRESS: usize = 0x2000_0000;
const RAM_LEN: usize = 4 * 1024 * 1024;
/// What the image fills the stack with when it starts (cortex-m-rt, `paint-stack`).
const PAINT: u32 = 0xcccc_cccc;

/// Target of the image.
const TARGET: &str = "thumbv7em-none-eabihf";

/// Why there is no running image.
#[derive(Debug, Error)]
pub enum Error {
    /// Nothing can be emulated here.
    #[error("qemu-system-arm is not installed (Debian: apt-get install qemu-system-arm)")]
    NoQemu,
    /// Nothing can be built for the board here.
    #[error("the target {TARGET} is not installed (rustup target add {TARGET})")]
    NoTarget,
    /// The image does not build.
    #[error("building the image failed:\n{0}")]
    Build(String),
    /// QEMU has ended, or has never come up.
    #[error("QEMU is gone: {0}")]
    Gone(String),
    /// What was waited for has not come within [`PATIENCE`].
    #[error("{what} in {} s; the log so far:\n{log}", PATIENCE.as_secs())]
    Patience {
        /// What was waited for.
        what: String,
        /// Everything the image has logged.
        log: String,
    },
    /// QEMU's monitor or debugger refuses something.
    #[error("QEMU refuses {command}: {answer}")]
    Refused {
        /// What was asked for.
        command: String,
        /// What came back.
        answer: String,
    },
    /// The image's log cannot be decoded.
    #[error("log: {0}")]
    Log(String),
    /// A file or socket of the harness.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// What is on the sensor's line.
pub enum Line<'a> {
    /// No sensor.
    Open,
    /// A sensor that is spoken to in datagrams: for any rate of scans, but the line's speed cannot be seen.
    /// It learns of the board with the first byte the board sends.
    Datagrams(&'a UdpSensor),
    /// A terminal, whose speed the image sets; 10 kB/s at most.
    Terminal(&'a Path),
}

/// What the module's Ethernet is plugged into.
pub enum Network<'a> {
    /// QEMU's own user network: DHCP, and the module's port forwarded to [`Qemu::module`].
    User,
    /// A switch of ours, which carries frames and nothing else.
    Switch(&'a Switch),
    /// A network interface of this machine, by name: a tap, which only root may open.
    Tap(&'a str),
}

/// A board to be started.
pub struct Machine<'a> {
    /// From [`image`].
    pub image: &'a Path,
    /// Hardware address, which is the module's identity.
    pub mac: [u8; 6],
    /// See [`Line`].
    pub line: Line<'a>,
    /// See [`Network`].
    pub network: Network<'a>,
    /// File that stands for the flash and outlives the machine; made if missing. `None`: a new one.
    pub flash: Option<&'a Path>,
}

/// A running board. Dropping it ends QEMU, whatever it is doing.
pub struct Qemu {
    child: Child,
    folder: PathBuf,
    log: Log,
    monitor: Option<Monitor>,
    module: SocketAddr,
}

impl Qemu {
    /// Starts `machine` and waits until QEMU takes commands; the image is running by then.
    ///
    /// # Errors
    /// QEMU does not start.
    pub fn start(machine: &Machine<'_>) -> Result<Self, Error> {
        let folder = new_folder()?;
        let flash = machine.flash.map_or_else(|| folder.join("flash"), Path::to_path_buf);
        if !flash.exists() {
            fs::write(&flash, vec![0xff; STORAGE_LEN])?;
            File::options().write(true).open(&flash)?.set_len(PSRAM_LEN)?;
        }
        let line = match machine.line {
            Line::Open => OsString::from("null,id=sensor"),
            Line::Datagrams(sensor) => {
                format!("udp,id=sensor,host=127.0.0.1,port={},mux=on", sensor.port()).into()
            }
            Line::Terminal(path) => with_path("serial,id=sensor,path=", path),
        };
        let module = SocketAddr::from((Ipv4Addr::LOCALHOST, free_port()?));

        let mut command = Command::new("qemu-system-arm");
        command
            .args(["-M", "mps2-an386,memory-backend=flash", "-display", "none", "-monitor", "none"])
            .arg("-object")
            .arg(with_path(
                format!("memory-backend-file,id=flash,size={PSRAM_LEN},share=on,mem-path="),
                &flash,
            ))
            .arg("-chardev")
            .arg(line)
            // A multiplexed line has an escape character: one that SCIP never uses.
            .args(["-echr", "255", "-serial", "chardev:sensor", "-serial"])
            .arg(with_path("file:", &folder.join("log")))
            .arg("-qmp")
            .arg(with_path("unix:", &folder.join("monitor,server=on,wait=off")))
            .arg("-chardev")
            .arg(with_path("socket,id=debugger,server=on,wait=off,path=", &folder.join("debugger")))
            .args(["-gdb", "chardev:debugger"])
            .args(network_arguments(machine, module.port())?)
            .arg("-kernel")
            .arg(machine.image)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(File::create(folder.join("stderr"))?);
        let child = command.spawn().map_err(|_| Error::NoQemu)?;
        let log = Log::new(machine.image, folder.join("log"))?;
        let mut qemu = Self { child, folder, log, monitor: None, module };
        let monitor = qemu.folder.join("monitor");
        qemu.monitor = Some(qemu.until("no monitor", |_| Ok(Monitor::connect(&monitor).ok()))?);
        Ok(qemu)
    }

    /// Where the module's UDP port is reached, with [`Network::User`].
    #[must_use]
    pub fn module(&self) -> SocketAddr {
        self.module
    }

    /// Waits for the next message that contains `text`, after the last one this returned.
    ///
    /// # Errors
    /// It does not come, or QEMU is gone.
    pub fn wait_for(&mut self, text: &str) -> Result<Message, Error> {
        self.until(&format!("no message with {text:?}"), |qemu| qemu.log.find(text))
    }

    /// All messages so far.
    ///
    /// # Errors
    /// The log cannot be decoded.
    pub fn messages(&mut self) -> Result<&[Message], Error> {
        self.log.messages()
    }

    /// Pulls the Ethernet plug, or puts it back.
    ///
    /// # Errors
    /// QEMU refuses or is gone.
    pub fn set_link(&mut self, up: bool) -> Result<(), Error> {
        self.execute("set_link", serde_json::json!({ "name": "net", "up": up }))
    }

    /// Stops the machine, time and all, until [`resume`](Self::resume).
    ///
    /// # Errors
    /// QEMU refuses or is gone.
    pub fn freeze(&mut self) -> Result<(), Error> {
        self.execute("stop", serde_json::json!({}))
    }

    /// Ends [`freeze`](Self::freeze).
    ///
    /// # Errors
    /// QEMU refuses or is gone.
    pub fn resume(&mut self) -> Result<(), Error> {
        self.execute("cont", serde_json::json!({}))
    }

    /// Presses the reset button.
    ///
    /// # Errors
    /// QEMU refuses or is gone.
    pub fn reset(&mut self) -> Result<(), Error> {
        self.execute("system_reset", serde_json::json!({}))
    }

    /// Makes the program loop for ever where it just is, as a task that hangs would.
    ///
    /// # Errors
    /// QEMU refuses or is gone.
    pub fn hang(&mut self) -> Result<(), Error> {
        debugger::hang(&self.folder.join("debugger"))
    }

    /// Stops the program, and then at each of its writes to the storage.
    ///
    /// # Errors
    /// QEMU refuses or is gone.
    pub fn watch_storage(&mut self) -> Result<Watch, Error> {
        Watch::start(&self.folder.join("debugger"), STORAGE_ADDRESS, STORAGE_LEN)
    }

    /// Most bytes of stack in use at once since the last reset: what lies behind the longest stretch that was
    /// never written.
    ///
    /// # Errors
    /// QEMU refuses or is gone.
    pub fn stack_used(&mut self) -> Result<usize, Error> {
        let path = self.folder.join("memory");
        let arguments = serde_json::json!({ "val": RAM_ADDRESS, "size": RAM_LEN, "filename": path });
        self.execute("pmemsave", arguments)?;
        let memory = fs::read(path)?;
        let (words, _) = memory.as_chunks();
        let stretches =
            words.chunk_by(|one, other| (*one == PAINT.to_le_bytes()) == (*other == PAINT.to_le_bytes()));
        let (mut passed, mut longest, mut used) = (0, 0, RAM_LEN);
        for stretch in stretches {
            passed += 4 * stretch.len();
            if stretch.first() == Some(&PAINT.to_le_bytes()) && stretch.len() > longest {
                (longest, used) = (stretch.len(), RAM_LEN - passed);
            }
        }
        Ok(used)
    }

    fn execute(&mut self, command: &str, arguments: serde_json::Value) -> Result<(), Error> {
        match &mut self.monitor {
            Some(monitor) => monitor.execute(command, arguments),
            None => Err(Error::Gone("no monitor".into())),
        }
    }

    /// Looks until there is something.
    fn until<T>(
        &mut self,
        what: &str,
        mut look: impl FnMut(&mut Self) -> Result<Option<T>, Error>,
    ) -> Result<T, Error> {
        let begin = Instant::now();
        loop {
            if let Some(found) = look(self)? {
                return Ok(found);
            }
            if let Some(status) = self.child.try_wait()? {
                let stderr = fs::read_to_string(self.folder.join("stderr"))?;
                return Err(Error::Gone(format!("{status}\n{stderr}")));
            }
            if begin.elapsed() > PATIENCE {
                let log: Vec<String> = self.log.messages()?.iter().map(ToString::to_string).collect();
                return Err(Error::Patience { what: what.into(), log: log.join("\n") });
            }
            std::thread::sleep(LOOK_AGAIN);
        }
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        // It may be gone already; then there is nothing to end, and nobody to tell.
        let _ = self.child.kill();
        let _ = self.child.wait();
        if std::thread::panicking() {
            eprintln!("log and flash of the image are left in {}", self.folder.display());
        } else {
            let _ = fs::remove_dir_all(&self.folder);
        }
    }
}

fn network_arguments(machine: &Machine<'_>, module_port: u16) -> Result<[String; 4], Error> {
    let netdev = match machine.network {
        Network::User => format!("user,id=net,hostfwd=udp:127.0.0.1:{module_port}-:{MODULE_PORT}"),
        Network::Switch(switch) => format!(
            "dgram,id=net,local.type=inet,local.host=127.0.0.1,local.port={},\
             remote.type=inet,remote.host=127.0.0.1,remote.port={}",
            free_port()?,
            switch.port()
        ),
        Network::Tap(name) => format!("tap,id=net,ifname={name},script=no,downscript=no"),
    };
    let [a, b, c, d, e, f] = machine.mac;
    let nic = format!("nic,model=lan9118,netdev=net,macaddr={a:02x}:{b:02x}:{c:02x}:{d:02x}:{e:02x}:{f:02x}");
    Ok(["-netdev".into(), netdev, "-net".into(), nic])
}

/// A UDP port of this machine that nobody has at the moment.
fn free_port() -> io::Result<u16> {
    Ok(UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?.local_addr()?.port())
}

/// An empty folder for one machine. Its name is short: paths of sockets have little room.
fn new_folder() -> io::Result<PathBuf> {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    let name = format!("kehai-qemu-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
    let folder = env::temp_dir().join(name);
    fs::create_dir_all(&folder)?;
    Ok(folder)
}

fn with_path(option: impl Into<OsString>, path: &Path) -> OsString {
    let mut option = option.into();
    option.push(path);
    option
}
