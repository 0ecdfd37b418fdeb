//! The channel between one device and the host, on simulated time.
//!
//! ```text
//!   module ── try_send_to ─▶ conditions ─▶ under way ─▶ arrived_at_host
//!   module ◀─ receive_from ◀─ under way ◀─ conditions ◀── send_to_module
//! ```

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::future::poll_fn;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::rc::Rc;
use std::task::{Context, Poll, Waker};

use kehai::link::{Datagrams, Dropped, Lane, Outbox};

use super::network::Conditions;
use crate::world::random::Stream;
use kehai_emulator::simulated_time::SimulatedClock;

/// The host's address and port.
const HOST: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 1), 40_404);

/// Either end of the channel. Clones are the same channel.
#[derive(Clone, Debug)]
pub struct Way(Rc<RefCell<Shared>>);

#[derive(Debug)]
struct Shared {
    clock: SimulatedClock,
    conditions: Conditions,
    stream: Stream,
    to_host: UnderWay,
    to_module: UnderWay,
}

/// Datagrams by the time at which they arrive and the order in which they were sent.
#[derive(Debug, Default)]
struct UnderWay {
    datagrams: BTreeMap<(u64, u64), Vec<u8>>,
    sent: u64,
    receiver: Option<Waker>,
}

impl UnderWay {
    fn send(&mut self, arrivals: impl Iterator<Item = u64>, datagram: &[u8]) {
        for at_us in arrivals {
            self.datagrams.insert((at_us, self.sent), datagram.to_vec());
            self.sent += 1;
        }
        if let Some(receiver) = self.receiver.take() {
            receiver.wake();
        }
    }

    /// The next datagram, once it has arrived.
    fn poll(&mut self, clock: &SimulatedClock, context: &Context<'_>) -> Poll<Vec<u8>> {
        match self.datagrams.first_entry() {
            Some(entry) if entry.key().0 <= clock.now_us() => return Poll::Ready(entry.remove()),
            Some(entry) => clock.wake_at(entry.key().0, context.waker()),
            None => {}
        }
        self.receiver = Some(context.waker().clone());
        Poll::Pending
    }
}

impl Way {
    /// An empty channel.
    #[must_use]
    pub fn new(clock: &SimulatedClock, conditions: Conditions, stream: Stream) -> Self {
        Self(Rc::new(RefCell::new(Shared {
            clock: clock.clone(),
            conditions,
            stream,
            to_host: UnderWay::default(),
            to_module: UnderWay::default(),
        })))
    }

    /// Sends from the host.
    pub fn send_to_module(&self, datagram: &[u8]) {
        let Shared { clock, conditions, stream, to_module, .. } = &mut *self.0.borrow_mut();
        to_module.send(conditions.arrivals(clock.now_us(), stream), datagram);
    }

    /// Waits for the next datagram to arrive at the host.
    ///
    /// # Cancellation
    /// Nothing is lost.
    pub async fn arrived_at_host(&self) -> Vec<u8> {
        poll_fn(|context| {
            let Shared { clock, to_host, .. } = &mut *self.0.borrow_mut();
            to_host.poll(clock, context)
        })
        .await
    }

    /// Drops what has arrived at the device's end: it was without power and did not listen.
    pub fn drop_arrived(&self) {
        let Shared { clock, to_module, .. } = &mut *self.0.borrow_mut();
        let now_us = clock.now_us();
        to_module.datagrams.retain(|(at_us, _), _| *at_us > now_us);
    }
}

impl Outbox for Way {
    fn try_send_to(&mut self, _: Lane, to: SocketAddrV4, datagram: &[u8]) -> Result<(), Dropped> {
        let Shared { clock, conditions, stream, to_host, .. } = &mut *self.0.borrow_mut();
        if to == HOST {
            to_host.send(conditions.arrivals(clock.now_us(), stream), datagram);
        }
        Ok(())
    }

    fn is_empty(&mut self, _: Lane) -> bool {
        true
    }

    fn reopen(&mut self, _: Lane) {}
}

impl Datagrams for Way {
    async fn receive_from(&mut self, buffer: &mut [u8]) -> (usize, SocketAddrV4) {
        let datagram = poll_fn(|context| {
            let Shared { clock, to_module, .. } = &mut *self.0.borrow_mut();
            to_module.poll(clock, context)
        })
        .await;
        let taken = buffer.iter_mut().zip(&datagram).map(|(place, byte)| *place = *byte).count();
        (taken, HOST)
    }
}
