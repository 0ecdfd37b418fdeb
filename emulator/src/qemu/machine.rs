//! What is around a board in QEMU: the sensor's line, the network, the flash; and the arguments that say so.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::{env, fs, io};

use super::lockstep::{GuestTime, Speed};
use super::switch::Switch;
use crate::ports::free_udp;
use crate::sensfloor::SensFloor;
use crate::serve::{SerialDevice, UdpSensor};

/// UDP port of the module.
const MODULE_PORT: u16 = 4040;

/// Connection of the sensor's line.
pub enum Line<'a> {
    /// No sensor.
    Open,
    /// A sensor that understands the board, and is understood, at any speed of the line.
    AnySpeed(&'a UdpSensor),
    /// A sensor on a serial line: where the speeds of its ends differ, both hear garbage.
    Serial(&'a UdpSensor),
    /// A SensFloor on a serial line.
    Floor(&'a UdpSensor<SensFloor>),
}

impl Line<'_> {
    /// What is at its end, and whether its speed matters.
    pub(super) fn device(&self) -> Option<(UdpSensor<dyn SerialDevice>, Speed)> {
        match self {
            Self::Open => None,
            Self::AnySpeed(sensor) => Some((sensor.of_any_kind(), Speed::Any)),
            Self::Serial(sensor) => Some((sensor.of_any_kind(), Speed::Matters)),
            Self::Floor(floor) => Some((floor.of_any_kind(), Speed::Matters)),
        }
    }
}

/// Connection of the module's Ethernet.
pub enum Network<'a> {
    /// QEMU's own user network: DHCP, and the module's port forwarded to `Qemu::module`.
    User,
    /// A switch of ours, which carries frames and nothing else.
    Switch(&'a Switch),
    /// A network interface of this machine, by name: a tap, which only root may open. The machines behind it
    /// use this machine's clock: the board's time should be [`GuestTime::not_faster_than_real`].
    Tap(&'a str),
}

/// A board to be started.
pub struct Machine<'a> {
    /// From `image`.
    pub image: &'a Path,
    /// The boot loader that starts it, if it is in the active slot of `flash`.
    pub boot: Option<&'a Path>,
    /// Hardware address, which is the module's identity.
    pub mac: [u8; 6],
    /// The time it lives in.
    pub time: &'a GuestTime,
    /// See [`Line`].
    pub line: Line<'a>,
    /// See [`Network`].
    pub network: Network<'a>,
    /// File that stands for the flash and outlives the machine; made if missing. `None`: a new one.
    pub flash: Option<&'a Path>,
}

pub(super) fn network_arguments(machine: &Machine<'_>, module_port: u16) -> io::Result<[String; 4]> {
    let netdev = match machine.network {
        Network::User => format!("user,id=net,hostfwd=udp:127.0.0.1:{module_port}-:{MODULE_PORT}"),
        Network::Switch(switch) => format!(
            "dgram,id=net,local.type=inet,local.host=127.0.0.1,local.port={},\
             remote.type=inet,remote.host=127.0.0.1,remote.port={}",
            free_udp()?,
            switch.udp_port()
        ),
        Network::Tap(name) => format!("tap,id=net,ifname={name},script=no,downscript=no"),
    };
    let [a, b, c, d, e, f] = machine.mac;
    let nic = format!("nic,model=lan9118,netdev=net,macaddr={a:02x}:{b:02x}:{c:02x}:{d:02x}:{e:02x}:{f:02x}");
    Ok(["-netdev".into(), netdev, "-net".into(), nic])
}

/// An empty folder for one machine. Its name is short: paths of sockets have little room.
pub(super) fn new_folder() -> io::Result<PathBuf> {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    let name = format!("kehai-qemu-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
    let folder = env::temp_dir().join(name);
    fs::create_dir_all(&folder)?;
    Ok(folder)
}

pub(super) fn with_path(option: impl Into<OsString>, path: &Path) -> OsString {
    let mut option = option.into();
    option.push(path);
    option
}
