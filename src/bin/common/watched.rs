//! The network controller, watched: counts frames, datagrams and link losses that the stack does not count.
//!
//! ```text
//!   controller ─▶ Watched ─▶ stack ─▶ port ─▶ module
//!                    │ after 16 frames: none, until everything else had its turn
//!                    │ link went down: one more
//!                    └ datagram for the port, or for mDNS: one more; what never arrives there was lost in
//!                      the stack
//!
//!   frame   12 type 0x0800   14 version, header length   20 fragment   23 protocol 17   then ports
//! ```

use core::sync::atomic::{AtomicU32, Ordering};
use core::task::Context;

use embassy_net::driver::{Capabilities, Driver, HardwareAddress, LinkState, RxToken};
use kehai::device::discovery::MDNS_PORT;
use kehai::device::reception::FramesPerPoll;
use kehai::wire::PORT;

static LINK_LOSSES: AtomicU32 = AtomicU32::new(0);
static FRAMES: AtomicU32 = AtomicU32::new(0);
static DATAGRAMS: AtomicU32 = AtomicU32::new(0);
static MDNS: AtomicU32 = AtomicU32::new(0);

/// Times the link went down.
pub fn link_losses() -> u32 {
    LINK_LOSSES.load(Ordering::Relaxed)
}

/// Frames received.
pub fn frames() -> u32 {
    FRAMES.load(Ordering::Relaxed)
}

/// Datagrams that came for the module's port.
pub fn datagrams() -> u32 {
    DATAGRAMS.load(Ordering::Relaxed)
}

/// Datagrams that came for multicast DNS.
pub fn mdns() -> u32 {
    MDNS.load(Ordering::Relaxed)
}

/// A controller that is watched.
pub struct Watched<D> {
    driver: D,
    link: LinkState,
    frames: FramesPerPoll,
}

impl<D: Driver> Watched<D> {
    /// Watches `driver`.
    pub fn new(driver: D) -> Self {
        Self { driver, link: LinkState::Down, frames: FramesPerPoll::new() }
    }
}

impl<D: Driver> Driver for Watched<D> {
    type RxToken<'a>
        = Received<D::RxToken<'a>>
    where
        Self: 'a;
    type TxToken<'a>
        = D::TxToken<'a>
    where
        Self: 'a;

    fn receive(&mut self, context: &mut Context<'_>) -> Option<(Self::RxToken<'_>, Self::TxToken<'_>)> {
        if !self.frames.admits() {
            context.waker().wake_by_ref();
            return None;
        }
        let Some((received, transmitter)) = self.driver.receive(context) else {
            self.frames.ended();
            return None;
        };
        one_more(&FRAMES);
        Some((Received(received), transmitter))
    }

    fn transmit(&mut self, context: &mut Context<'_>) -> Option<Self::TxToken<'_>> {
        self.driver.transmit(context)
    }

    fn link_state(&mut self, context: &mut Context<'_>) -> LinkState {
        let link = self.driver.link_state(context);
        if (self.link, link) == (LinkState::Up, LinkState::Down) {
            one_more(&LINK_LOSSES);
        }
        self.link = link;
        link
    }

    fn capabilities(&self) -> Capabilities {
        self.driver.capabilities()
    }

    fn hardware_address(&self) -> HardwareAddress {
        self.driver.hardware_address()
    }
}

/// A received frame.
pub struct Received<T>(T);

impl<T: RxToken> RxToken for Received<T> {
    fn consume<R, F: FnOnce(&mut [u8]) -> R>(self, take: F) -> R {
        self.0.consume(|frame| {
            match port(frame) {
                Some(PORT) => one_more(&DATAGRAMS),
                Some(MDNS_PORT) => one_more(&MDNS),
                _ => {}
            }
            take(frame)
        })
    }
}

/// Counts; all runs in one executor, so nothing comes in between.
fn one_more(counter: &AtomicU32) {
    counter.store(counter.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
}

/// The port that a frame's datagram is for, if it carries a whole one of UDP.
fn port(frame: &[u8]) -> Option<u16> {
    let (ethernet, packet) = frame.split_at_checked(14)?;
    let &[first, _, _, _, _, _, fragment_high, fragment_low, _, protocol, ..] = packet else { return None };
    let ports = packet.get(usize::from(first & 0x0f) * 4..).unwrap_or_default();
    let &[_, _, high, low, ..] = ports else { return None };
    let whole = (fragment_high & 0x3f, fragment_low) == (0, 0);
    let is_udp = ethernet.ends_with(&[0x08, 0x00]) && protocol == 17 && whole;
    is_udp.then_some(u16::from_be_bytes([high, low]))
}
