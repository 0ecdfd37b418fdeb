//! The SMSC LAN9118 Ethernet controller, as embassy-net's driver.
//!
//! ```text
//! 0x00  receive data       words of the frame on top of the FIFO     0x64 BYTE_TEST
//! 0x20  transmit data      two command words, then the frame         0x68 FIFO_INT
//! 0x40  receive status     bits 29..16 length with checksum          0x6c RX_CFG   0x70 TX_CFG
//! 0x48  transmit status    one word for each frame sent              0x74 HW_CFG   0x7c RX_FIFO_INF
//! 0x54  IRQ_CFG  0x58 INT_STS  0x5c INT_EN                           0xa4 MAC_CSR_CMD  0xa8 …DATA
//! ```
//!
//! Behind MAC_CSR are the registers of the MAC, and behind two of those (MII) the ones of the PHY.
//! QEMU puts the machine's own hardware address there at reset: one image serves many modules.
//!
//! Source: SMSC LAN9118 data sheet revision 1.5, parts 5.3 to 5.5; address and interrupt ARM DAI 0386.

use core::task::Context;

use embassy_net::driver::{
    Capabilities, Driver, HardwareAddress, LinkState, RxToken as ReceiveToken, TxToken as TransmitToken,
};
use embassy_sync::waitqueue::AtomicWaker;

use super::interrupts::{self, Interrupt};
use super::mmio::{Register, device};

#[repr(C)]
struct Registers {
    receive_data: Register,
    _aliases: [u32; 7],
    transmit_data: Register,
    _aliases_too: [u32; 7],
    receive_status: Register,
    _receive_status_peek: Register,
    transmit_status: Register,
    _transmit_status_peek: Register,
    _id: Register,
    interrupt_config: Register,
    interrupt_status: Register,
    interrupt_enable: Register,
    _reserved: Register,
    byte_test: Register,
    fifo_interrupt: Register,
    receive_config: Register,
    transmit_config: Register,
    hardware_config: Register,
    _receive_control: Register,
    receive_fifo: Register,
    transmit_fifo: Register,
    _power_gpio_timer: [u32; 8],
    mac_command: Register,
    mac_data: Register,
}

const _: () = assert!(core::mem::offset_of!(Registers, interrupt_config) == 0x54);
const _: () = assert!(core::mem::offset_of!(Registers, receive_fifo) == 0x7c);
const _: () = assert!(core::mem::offset_of!(Registers, mac_data) == 0xa8);

const BYTE_TEST: u32 = 0x8765_4321;
/// HW_CFG: software reset.
const RESET: u32 = 1 << 0;
/// HW_CFG: 5 KiB of the FIFO memory for transmission, and the bit the data sheet wants set.
const FIFO_5_KIB_TRANSMIT: u32 = 5 << 16;
/// TX_CFG: transmitter on.
const TRANSMITTER_ON: u32 = 1 << 1;
/// FIFO_INT: interrupt as soon as one frame has been received, or 72 · 64 bytes can be sent.
const FIFO_LEVELS: u32 = 0x48 << 24;
/// IRQ_CFG: on, active high, push-pull.
const INTERRUPT_PIN: u32 = 1 << 8 | 1 << 4 | 1 << 0;
/// INT_STS and INT_EN: a frame has been received; the PHY has something to say.
const RECEIVED: u32 = 1 << 3;
const PHY: u32 = 1 << 18;

/// MAC_CSR_CMD: the MAC is busy; read rather than write.
const MAC_BUSY: u32 = 1 << 31;
const MAC_READ: u32 = 1 << 30;
/// Registers of the MAC.
const MAC_CONTROL: u32 = 1;
const MAC_ADDRESS_HIGH: u32 = 2;
const MAC_ADDRESS_LOW: u32 = 3;
const MII_ACCESS: u32 = 6;
const MII_DATA: u32 = 7;
/// MAC_CR: full duplex, all multicast, transmitter and receiver on.
const MAC_ON: u32 = 1 << 20 | 1 << 19 | 1 << 3 | 1 << 2;
/// MII_ACC: the one PHY has address 1; write; busy.
const PHY_ADDRESS: u32 = 1 << 11;
const MII_WRITE: u32 = 1 << 1;
const MII_BUSY: u32 = 1 << 0;
/// Registers of the PHY, and its bits for "link is up" and "negotiated" or "link is down".
const PHY_STATUS: u32 = 1;
const PHY_INTERRUPT_SOURCE: u32 = 29;
const PHY_INTERRUPT_MASK: u32 = 30;
const LINK_IS_UP: u32 = 1 << 2;
const LINK_CHANGES: u32 = 1 << 7 | 1 << 4;

/// Command words of a frame: it is sent from one buffer.
const FIRST_AND_LAST: u32 = 1 << 13 | 1 << 12;

/// Ethernet header and 1500 bytes; the controller adds and removes the checksum.
const FRAME_LEN: usize = 1514;
const CHECKSUM_LEN: usize = 4;

static CHANGED: AtomicWaker = AtomicWaker::new();

fn chip() -> &'static Registers {
    // SAFETY: the board's Ethernet controller.
    unsafe { device(0x4020_0000) }
}

fn mac_read(register: u32) -> u32 {
    chip().mac_command.write(MAC_BUSY | MAC_READ | register);
    chip().mac_data.read()
}

fn mac_write(register: u32, value: u32) {
    chip().mac_data.write(value);
    chip().mac_command.write(MAC_BUSY | register);
}

fn phy_read(register: u32) -> u32 {
    mac_write(MII_ACCESS, PHY_ADDRESS | register << 6 | MII_BUSY);
    mac_read(MII_DATA)
}

fn phy_write(register: u32, value: u32) {
    mac_write(MII_DATA, value);
    mac_write(MII_ACCESS, PHY_ADDRESS | register << 6 | MII_WRITE | MII_BUSY);
}

/// The controller, and room for one received frame.
pub struct Lan9118 {
    frame: [u32; FRAME_LEN.div_ceil(4)],
    mac: [u8; 6],
}

/// No LAN9118 answers at its address.
#[derive(Clone, Copy, PartialEq, Eq, Debug, defmt::Format)]
pub struct NoChip;

impl Lan9118 {
    /// Resets and starts the controller. To be called once.
    pub fn new() -> Result<Self, NoChip> {
        if chip().byte_test.read() != BYTE_TEST {
            return Err(NoChip);
        }
        chip().hardware_config.write(RESET);
        chip().hardware_config.write(FIFO_5_KIB_TRANSMIT);
        chip().receive_config.write(0);
        chip().fifo_interrupt.write(FIFO_LEVELS);
        chip().transmit_config.write(TRANSMITTER_ON);
        let [a, b, c, d] = mac_read(MAC_ADDRESS_LOW).to_le_bytes();
        let [e, f, ..] = mac_read(MAC_ADDRESS_HIGH).to_le_bytes();
        mac_write(MAC_CONTROL, MAC_ON);
        phy_write(PHY_INTERRUPT_MASK, LINK_CHANGES);
        chip().interrupt_status.write(u32::MAX);
        chip().interrupt_enable.write(RECEIVED | PHY);
        chip().interrupt_config.write(INTERRUPT_PIN);
        interrupts::enable(Interrupt::Ethernet);
        Ok(Self { frame: [0; _], mac: [a, b, c, d, e, f] })
    }

    /// The hardware address.
    pub fn mac(&self) -> [u8; 6] {
        self.mac
    }

    /// Moves the next good frame from the FIFO into `frame`; its length in bytes.
    fn take_frame(&mut self) -> Option<usize> {
        while chip().receive_fifo.read() >> 16 & 0xff != 0 {
            let len = (chip().receive_status.read() >> 16 & 0x3fff) as usize;
            let mut words = self.frame.iter_mut();
            for _ in 0..len.div_ceil(4) {
                let word = chip().receive_data.read();
                if let Some(place) = words.next() {
                    *place = word.to_le();
                }
            }
            match len.checked_sub(CHECKSUM_LEN) {
                Some(len) if len <= FRAME_LEN => return Some(len),
                _ => {}
            }
        }
        None
    }
}

impl Driver for Lan9118 {
    type RxToken<'a> = Received<'a>;
    type TxToken<'a> = Transmitter;

    fn receive(&mut self, context: &mut Context<'_>) -> Option<(Received<'_>, Transmitter)> {
        CHANGED.register(context.waker());
        let len = self.take_frame()?;
        Some((Received { frame: &mut self.frame, len }, Transmitter))
    }

    fn transmit(&mut self, _context: &mut Context<'_>) -> Option<Transmitter> {
        Some(Transmitter)
    }

    fn link_state(&mut self, context: &mut Context<'_>) -> LinkState {
        CHANGED.register(context.waker());
        if phy_read(PHY_STATUS) & LINK_IS_UP != 0 { LinkState::Up } else { LinkState::Down }
    }

    fn capabilities(&self) -> Capabilities {
        let mut capabilities = Capabilities::default();
        capabilities.max_transmission_unit = FRAME_LEN;
        capabilities.max_burst_size = Some(1);
        capabilities
    }

    fn hardware_address(&self) -> HardwareAddress {
        HardwareAddress::Ethernet(self.mac)
    }
}

/// A received frame.
pub struct Received<'a> {
    frame: &'a mut [u32; FRAME_LEN.div_ceil(4)],
    len: usize,
}

impl ReceiveToken for Received<'_> {
    fn consume<R, F: FnOnce(&mut [u8]) -> R>(self, take: F) -> R {
        // SAFETY: the words are plain memory, four bytes each, and borrowed for as long as this
        // slice lives; `take_frame` keeps `len` within them.
        let bytes = unsafe {
            core::slice::from_raw_parts_mut(self.frame.as_mut_ptr().cast::<u8>(), self.len.min(FRAME_LEN))
        };
        take(bytes)
    }
}

/// Permission to send one frame. Sending is synchronous here, so there is always room.
pub struct Transmitter;

impl TransmitToken for Transmitter {
    fn consume<R, F: FnOnce(&mut [u8]) -> R>(self, len: usize, fill: F) -> R {
        let mut frame = [0; FRAME_LEN];
        let bytes = &mut frame[..len];
        let result = fill(bytes);
        while chip().transmit_fifo.read() >> 16 & 0xff != 0 {
            chip().transmit_status.read();
        }
        chip().transmit_data.write(FIRST_AND_LAST | len as u32);
        chip().transmit_data.write(len as u32);
        for chunk in bytes.chunks(4) {
            let mut word = [0; 4];
            word[..chunk.len()].copy_from_slice(chunk);
            chip().transmit_data.write(u32::from_le_bytes(word));
        }
        result
    }
}

/// A frame has arrived or the link has changed.
pub extern "C" fn on_interrupt() {
    let status = chip().interrupt_status.read();
    if status & PHY != 0 {
        // Reading takes the request back.
        phy_read(PHY_INTERRUPT_SOURCE);
    }
    chip().interrupt_status.write(status);
    CHANGED.wake();
}
