//! A floor of panels as a device on a PC, in real time: the firmware's own state machine beside any source of readings.
//!
//! ```text
//!   readings, 9 Hz ─▶ kehai::floor ─▶ kehai::device::Module ◀─▶ UDP
//! ```
//!
//! Nothing is kept: settings last until the end. It is not announced: hosts are told its address.

use std::io;
use std::net::{SocketAddr, SocketAddrV4, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use super::blink::Blink;
use kehai::address::mac_from_unique_id;
use kehai::device::{About, Module, Settings, Stored, Wish};
use kehai::floor::{Bits, Floor, next_reading_us};
use kehai::link::{Dropped, Lane, Outbox};
use kehai::wire::{DATAGRAM_MAX, Identity, ModuleId};

/// The stop flag is looked at so often, µs.
const LOOK_US: u64 = 100_000;

/// Where the readings come from.
pub trait Panels {
    /// Which panels are down at `at_us` since the start.
    fn read(&mut self, at_us: u64) -> Bits;
}

/// Sends at once, or not at all.
struct Port<'a>(&'a UdpSocket);

impl Outbox for Port<'_> {
    fn try_send_to(&mut self, _: Lane, to: SocketAddrV4, datagram: &[u8]) -> Result<(), Dropped> {
        self.0.send_to(datagram, to).map(|_| ()).map_err(|_| Dropped)
    }

    fn is_empty(&mut self, _: Lane) -> bool {
        true
    }

    fn reopen(&mut self, _: Lane) {}
}

/// Runs a floor of that name at `socket` until `stop` is set; a request to restart begins a new start. `on_start` is told
/// who it is.
///
/// # Errors
/// What the socket or `/dev/urandom` says.
pub fn run(
    socket: &UdpSocket,
    name: &str,
    floor: &Floor,
    panels: &mut dyn Panels,
    stop: &AtomicBool,
    mut on_start: impl FnMut(Identity),
) -> io::Result<()> {
    let begin = Instant::now();
    // Hosts take a smaller number for an old datagram.
    let since_1970_s = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
    let mut boot = u32::try_from(since_1970_s).unwrap_or(u32::MAX);
    while !stop.load(Ordering::Relaxed) {
        let mut module = Box::new(Module::<1>::new(about(name)?));
        module.begin(boot, Settings::new());
        module.rename(name);
        on_start(module.identity());
        let blink = Blink::new(module.identity().module, Some(name));
        start(&mut module, socket, (&mut floor.clone(), panels, blink), stop, begin)?;
        boot = boot.wrapping_add(1);
    }
    Ok(())
}

/// One start, until it is to start anew or `stop` is set.
fn start(
    module: &mut Module<1>,
    socket: &UdpSocket,
    (floor, panels, mut blink): (&mut Floor, &mut dyn Panels, Blink),
    stop: &AtomicBool,
    begin: Instant,
) -> io::Result<()> {
    let now_us = || u64::try_from(begin.elapsed().as_micros()).unwrap_or(u64::MAX);
    let mut port = Port(socket);
    let mut buffer = [0; DATAGRAM_MAX + 1];
    let mut reading_us = now_us();
    while !stop.load(Ordering::Relaxed) {
        let due_us = module.poll(now_us(), &mut port).min(reading_us);
        let wait_us = due_us.saturating_sub(now_us()).clamp(1, LOOK_US);
        socket.set_read_timeout(Some(Duration::from_micros(wait_us)))?;
        // An error is how time passes, or says that a host has gone.
        if let Ok((length, SocketAddr::V4(from))) = socket.recv_from(&mut buffer) {
            let _ = module.receive(from, buffer.get_mut(..length).unwrap_or(&mut []), now_us(), &mut port);
        }
        if now_us() >= reading_us {
            let stamp_us = now_us();
            let bits = panels.read(stamp_us);
            // As many bits as there are panels.
            let _ = floor.read(bits.bytes(floor.panels()));
            module.panels(floor, stamp_us, now_us(), &mut port);
            reading_us = next_reading_us(reading_us, now_us());
        }
        if let Some(line) = blink.line(module.status(now_us()).identifying) {
            eprintln!("{line}");
        }
        match module.wish() {
            Some(Wish::Store) => {
                module.begin_storing(now_us(), &mut port);
                let settings = module.settings_to_store().map(|_| true);
                // It forgets at its end, and its keys would be gone with the next start.
                let keys = module.keys_to_store().map(|_| false);
                let stored = Stored { settings, keys, background: None };
                module.end_storing(stored, now_us(), &mut port);
            }
            Some(Wish::Restart) => return Ok(()),
            // It has no boot loader.
            Some(Wish::Confirm | Wish::Told) | None => {}
        }
    }
    Ok(())
}

fn about(name: &str) -> io::Result<About> {
    let mut secret = [0; 16];
    io::Read::read_exact(&mut std::fs::File::open("/dev/urandom")?, &mut secret)?;
    let host = std::fs::read_to_string("/etc/machine-id").unwrap_or_default();
    Ok(About {
        module: ModuleId(mac_from_unique_id(format!("{host}floor{name}").as_bytes())),
        secret,
        firmware: env!("CARGO_PKG_VERSION"),
        build: concat!("kehai-sim ", env!("CARGO_PKG_VERSION")),
        board: "pc",
        watchdog_reset: false,
    })
}
