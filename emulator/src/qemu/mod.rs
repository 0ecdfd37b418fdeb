//! The real firmware image in QEMU: built, started, fed, listened to, frozen, reset and hung.
//!
//! ```text
//!              UdpSensor ──▶ UART0 ┌────────────┐ LAN9118 ◀── user network (slirp), a Switch, a tap
//!                                  │ mps2-an386 │
//!   log file (defmt) ◀────── UART1 └────────────┘ PSRAM ◀──▶ flash file
//!                                   ▲         ▲
//!                              Monitor      Debugger
//! ```
//!
//! A board runs only while a test waits for something, a millisecond at a time, with everything around it on the
//! same time ([`GuestTime`]): nothing here depends on how fast this machine is. Its clock only ends waits for a QEMU
//! that says nothing ([`PATIENCE`]).

mod debugger;
mod image;
mod lockstep;
mod log;
mod machine;
mod monitor;
mod switch;

pub use crate::pc::host::PATIENCE;
pub use debugger::Watch;
pub use image::{Image, image};
pub use lockstep::{Forwarded, GuestTime, PATIENCE_US, STEP_US};
pub use log::Message;
pub use machine::{Line, Machine, Network};
pub use switch::{Port, Switch};

use std::fs::{self, File};
use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::os::unix::net::UnixStream;
use std::path::{self, Path, PathBuf};
use std::process::{Command, Stdio};
use std::rc::Rc;
use std::time::{Duration, Instant};

use lockstep::Lockstep;
use log::Log;
use machine::{network_arguments, new_folder, with_path};
use monitor::Monitor;
use thiserror::Error;

use crate::ports::free_udp;

/// Time between two checks whether a new QEMU has opened its monitor.
const LOOK_AGAIN: Duration = Duration::from_millis(5);

/// An instruction takes 2⁵ ns, 31 million a second: about what a Cortex-M4 does at the 25 MHz of this board. Time
/// without instructions is jumped over.
const ICOUNT: &str = "shift=5,sleep=off";
/// Longest jump over time, µs, for the image's lock-step. QEMU hands the sensor's line 32 bytes between two jumps:
/// 160 kB/s, twice what 750 kbaud carry.
const LONGEST_JUMP_US: u32 = 200;
/// Where the image looks for it: a word of PSRAM behind the storage.
const LOCKSTEP_ADDRESS: u32 = 0x2110_0000;

/// Size of the board's PSRAM, which QEMU loads from the flash file.
const PSRAM_LEN: u64 = 16 * 1024 * 1024;
/// Size of the image's storage, at the beginning of the PSRAM; erased flash is all ones.
const STORAGE_LEN: usize = 128 * 1024;
const STORAGE_ADDRESS: u32 = 0x2100_0000;

/// Register of the board's LEDs, a bit each: FPGA LED0 (ARM DAI 0386).
const LEDS_ADDRESS: u32 = 0x4002_8000;

/// The image's memory: static variables at its beginning, the stack at its end.
const RAM_ADDRESS: usize = 0x2000_0000;
const RAM_LEN: usize = 4 * 1024 * 1024;
/// Word with which the image fills the stack when it starts (cortex-m-rt, `paint-stack`).
const PAINT: u32 = 0xcccc_cccc;

/// Target of the image.
const TARGET: &str = "thumbv7em-none-eabihf";

/// Reasons why an image does not run.
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
    /// The awaited condition has not come within [`PATIENCE_US`] of guest time.
    #[error("{what} in {} s of its time; the log so far:\n{log}", PATIENCE_US / 1_000_000)]
    Patience {
        /// The awaited condition.
        what: String,
        /// Everything the image has logged.
        log: String,
    },
    /// QEMU's monitor or debugger refuses something.
    #[error("QEMU refuses {command}: {answer}")]
    Refused {
        /// The command sent.
        command: String,
        /// The answer of QEMU.
        answer: String,
    },
    /// The image's log cannot be decoded.
    #[error("log: {0}")]
    Log(String),
    /// A file or socket of the harness.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// A running board. Dropping it ends QEMU, whatever it is doing.
pub struct Qemu {
    time: GuestTime,
    lockstep: Rc<Lockstep>,
    folder: PathBuf,
    log: Log,
    monitor: Option<Monitor>,
    module: SocketAddr,
}

impl Qemu {
    /// Starts `machine` and waits until QEMU accepts commands; the image is running by then.
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
        let sensor = machine.line.device();
        let line = match &sensor {
            None => "null,id=sensor".to_owned(),
            Some((sensor, _)) => format!("udp,id=sensor,host=127.0.0.1,port={},mux=on", sensor.port()),
        };
        lockstep::make_fifos(&folder)?;
        let module = SocketAddr::from((Ipv4Addr::LOCALHOST, free_udp()?));

        let mut command = Command::new("qemu-system-arm");
        command
            .current_dir(&folder)
            .args(["-icount", ICOUNT, "-rtc", "clock=vm", "-semihosting-config", "enable=on,target=native"])
            .arg("-device")
            .arg(format!("loader,addr={LOCKSTEP_ADDRESS:#x},data={LONGEST_JUMP_US},data-len=4"))
            .args(["-M", "mps2-an386,memory-backend=flash", "-display", "none", "-monitor", "none"])
            .arg("-object")
            .arg(with_path(
                format!("memory-backend-file,id=flash,size={PSRAM_LEN},share=on,mem-path="),
                &path::absolute(&flash)?,
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
            .arg(path::absolute(machine.boot.unwrap_or(machine.image))?)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(File::create(folder.join("stderr"))?);
        let child = command.spawn().map_err(|_| Error::NoQemu)?;
        let lockstep = Lockstep::new(child, &folder, sensor)?;
        machine.time.add_board(Rc::clone(&lockstep));
        let log = Log::new(machine.image, folder.join("log"))?;
        let mut qemu = Self { time: machine.time.clone(), lockstep, folder, log, monitor: None, module };
        qemu.wait_for_monitor()?;
        Ok(qemu)
    }

    /// The time it lives in.
    #[must_use]
    pub fn time(&self) -> &GuestTime {
        &self.time
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
        self.execute("stop", serde_json::json!({}))?;
        self.lockstep.set_frozen(true);
        Ok(())
    }

    /// With the machine frozen, has QEMU look at its network `times` times: at each look it takes at least one
    /// waiting datagram. So what has been sent to the module is there at once when the machine goes on.
    ///
    /// # Errors
    /// QEMU refuses or is gone.
    pub fn take_datagrams(&mut self, times: usize) -> Result<(), Error> {
        (0..times).try_for_each(|_| self.execute("query-status", serde_json::json!({})))
    }

    /// Ends [`freeze`](Self::freeze).
    ///
    /// # Errors
    /// QEMU refuses or is gone.
    pub fn resume(&mut self) -> Result<(), Error> {
        // Steps run again before the answer comes: the guest may stand at the end of one, and QEMU answers nothing
        // meanwhile.
        self.lockstep.set_frozen(false);
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
        debugger::hang(&self.folder.join("debugger"), &self.time)
    }

    /// Stops the program, and then at each of its writes to the storage.
    ///
    /// # Errors
    /// QEMU refuses or is gone.
    pub fn watch_storage(&mut self) -> Result<Watch, Error> {
        let storage = (STORAGE_ADDRESS, STORAGE_LEN);
        Watch::start(&self.folder.join("debugger"), (&self.time, &self.lockstep), storage)
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

    /// Whether the board's first LED is lit.
    ///
    /// # Errors
    /// QEMU refuses or is gone.
    pub fn is_lit(&mut self) -> Result<bool, Error> {
        let path = self.folder.join("leds");
        self.execute("pmemsave", serde_json::json!({ "val": LEDS_ADDRESS, "size": 4, "filename": path }))?;
        Ok(fs::read(path)?.first().is_some_and(|leds| leds & 1 != 0))
    }

    fn execute(&mut self, command: &str, arguments: serde_json::Value) -> Result<(), Error> {
        match &mut self.monitor {
            Some(monitor) => monitor.execute(command, arguments),
            None => Err(Error::Gone("no monitor".into())),
        }
    }

    /// Waits for the monitor's socket, which exists once QEMU has started: this uses no guest time.
    fn wait_for_monitor(&mut self) -> Result<(), Error> {
        let path = self.folder.join("monitor");
        let begin = Instant::now();
        let stream = loop {
            match UnixStream::connect(&path) {
                Ok(stream) => break stream,
                Err(error) if begin.elapsed() > PATIENCE => return Err(error.into()),
                Err(_) => self.still_there()?,
            }
            std::thread::sleep(LOOK_AGAIN);
        };
        let monitor = Monitor::open(stream, &self.time);
        self.still_there()?;
        self.monitor = Some(monitor?);
        Ok(())
    }

    fn still_there(&self) -> Result<(), Error> {
        let Some(status) = self.lockstep.ended()? else { return Ok(()) };
        let stderr = fs::read_to_string(self.folder.join("stderr"))?;
        Err(Error::Gone(format!("{status}\n{stderr}")))
    }

    /// Calls `look` after each step until it returns a value.
    fn until<T>(
        &mut self,
        what: &str,
        mut look: impl FnMut(&mut Self) -> Result<Option<T>, Error>,
    ) -> Result<T, Error> {
        let end_us = self.time.now_us() + PATIENCE_US;
        loop {
            if let Some(found) = look(self)? {
                return Ok(found);
            }
            self.still_there()?;
            if self.time.now_us() >= end_us {
                let log: Vec<String> = self.log.messages()?.iter().map(ToString::to_string).collect();
                return Err(Error::Patience { what: what.into(), log: log.join("\n") });
            }
            self.time.step();
        }
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        self.time.remove_board(&self.lockstep);
        self.lockstep.end();
        if std::thread::panicking() {
            eprintln!("log and flash of the image are left in {}", self.folder.display());
        } else {
            let _ = fs::remove_dir_all(&self.folder);
        }
    }
}
