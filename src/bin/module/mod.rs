//! What every board's image does: the same program, over whatever the board hands it.
//!
//! ```text
//! board's main.rs ─▶ Board { uart, storage, stack, feed, led } ─▶ run
//! ```
//!
//! This is bring-up: it shows that every part of a board works. It counts its boots in the storage,
//! keeps an address on the network, answers UDP datagrams on port [`PORT`] with themselves, and
//! copies lines from the serial line to the log.

pub mod clock;
mod network;

use core::ops::Range;

use defmt::{Debug2Format, info, warn};
use embassy_futures::join::join4;
use embassy_net::Stack;
use embassy_net::udp::{PacketMetadata, UdpSocket};
use embassy_time::Duration;
use embedded_io_async::{Read, Write};
use embedded_storage_async::nor_flash::NorFlash;
use kehai::address::{self, Mac};
use kehai::link::{Baud, Clock};
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};

use clock::BoardClock;

/// Version, source and board of this image.
pub const BUILD: &str =
    concat!("kehai ", env!("CARGO_PKG_VERSION"), " ", env!("KEHAI_GIT"), " ", env!("KEHAI_BOARD"));

/// UDP port of the module.
const PORT: u16 = 4040;
/// Speed the sensor's line begins with.
pub const FIRST_BAUD: u32 = 115_200;
/// Sockets of the network stack: DHCP and the search for a server, the module's own two, mDNS, spare.
pub const SOCKETS: usize = 8;
/// How often the watchdog is fed and the LED changes.
const HEARTBEAT: Duration = Duration::from_millis(500);
/// Longest line that is copied to the log.
const LINE_LEN: usize = 80;
/// Longest datagram that comes back: what an Ethernet frame carries.
const DATAGRAM_LEN: usize = 1472;
/// Key of the boot count in the storage.
const BOOT_COUNT: u8 = 0;

/// What a board brings.
pub struct Board<Line, Flash, Feed, Light> {
    /// Hardware address.
    pub mac: Mac,
    /// The network; somebody else runs its runner.
    pub stack: Stack<'static>,
    /// The serial line to the sensor.
    pub uart: Line,
    /// Flash, and the part of it that is for settings and background.
    pub storage: Flash,
    /// See `storage`.
    pub storage_range: Range<u32>,
    /// Feeds the watchdog.
    pub feed: Feed,
    /// Lights the LED, or not.
    pub led: Light,
}

/// What the network stack begins with: DHCP under the module's name.
pub fn network_config(mac: Mac) -> embassy_net::Config {
    network::dhcp(mac)
}

/// Runs the module for ever.
pub async fn run<Line, Flash, Feed, Light>(board: Board<Line, Flash, Feed, Light>) -> !
where
    Line: Read + Write + Baud,
    Flash: NorFlash,
    Feed: FnMut(),
    Light: FnMut(bool),
{
    info!("{=str}", BUILD);
    let [a, b, c, d, e, f] = board.mac;
    info!("mac {=u8:02x}:{=u8:02x}:{=u8:02x}:{=u8:02x}:{=u8:02x}:{=u8:02x}", a, b, c, d, e, f);
    info!("host {=str}", address::host_name(board.mac).as_str());
    count_boot(board.storage, board.storage_range).await;
    let ((), (), (), never) = join4(
        network::keep_address(board.stack, board.mac),
        echo(board.stack),
        copy_lines(board.uart),
        heartbeat(board.feed, board.led),
    )
    .await;
    never
}

/// Reads, steps and writes the boot count. A storage that cannot be read is erased.
async fn count_boot<Flash: NorFlash>(storage: Flash, range: Range<u32>) {
    let mut storage = MapStorage::<u8, _, Cache<Uncached, Uncached, Uncached, u8>>::new(
        storage,
        MapConfig::new(range),
        Cache::new_uncached(),
    );
    let mut buffer = [0; 64];
    let last = match storage.fetch_item::<u32>(&mut buffer, &BOOT_COUNT).await {
        Ok(last) => last.unwrap_or(0),
        Err(error) => {
            warn!("storage erased: {}", Debug2Format(&error));
            if let Err(error) = storage.erase_all().await {
                warn!("storage: {}", Debug2Format(&error));
            }
            0
        }
    };
    let boot = last.wrapping_add(1);
    if let Err(error) = storage.store_item(&mut buffer, &BOOT_COUNT, &boot).await {
        warn!("storage: {}", Debug2Format(&error));
    }
    info!("boot {=u32}", boot);
}

/// Answers every datagram with itself.
async fn echo(stack: Stack<'static>) {
    let (mut receive_metadata, mut transmit_metadata) =
        ([PacketMetadata::EMPTY; 4], [PacketMetadata::EMPTY; 4]);
    let (mut received, mut to_send) = ([0; 2 * DATAGRAM_LEN], [0; 2 * DATAGRAM_LEN]);
    let mut socket =
        UdpSocket::new(stack, &mut receive_metadata, &mut received, &mut transmit_metadata, &mut to_send);
    if socket.bind(PORT).is_err() {
        warn!("UDP port taken");
        return;
    }
    let mut datagram = [0; DATAGRAM_LEN];
    loop {
        // Longer ones than fit are dropped by the socket, and so are answers nobody can be sent.
        let Ok((len, from)) = socket.recv_from(&mut datagram).await else { continue };
        let _ = socket.send_to(datagram.get(..len).unwrap_or_default(), from.endpoint).await;
    }
}

/// Asks the sensor for its version at every power-up, then logs every line that comes in.
async fn copy_lines(mut uart: impl Read + Write + Baud) {
    uart.set_baud(FIRST_BAUD).await;
    if uart.write_all(b"VV\n").await.is_err() || uart.flush().await.is_err() {
        warn!("uart: cannot send");
    }
    let mut line = heapless::Vec::<u8, LINE_LEN>::new();
    let mut bytes = [0; 64];
    loop {
        let Ok(len) = uart.read(&mut bytes).await else {
            warn!("uart: bytes lost");
            line.clear();
            continue;
        };
        for &byte in bytes.get(..len).unwrap_or_default() {
            if byte == b'\n' {
                info!("line {=str}", core::str::from_utf8(&line).unwrap_or("of something else than text"));
                line.clear();
            } else {
                // The rest of a longer line is left out.
                let _ = line.push(byte);
            }
        }
    }
}

/// Feeds the watchdog and blinks, as long as the tasks are polled.
async fn heartbeat(mut feed: impl FnMut(), mut led: impl FnMut(bool)) -> ! {
    let clock = BoardClock;
    let mut on = false;
    loop {
        feed();
        on = !on;
        led(on);
        clock.wait_until(clock.now_us() + HEARTBEAT.as_micros()).await;
    }
}
