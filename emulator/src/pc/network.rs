//! A network in memory, on simulated time: one module's port and any number of hosts.
//!
//! ```text
//!   host ── send ──▶ module's port ── receive_from
//!   host ◀─ receive ── lane of the host ◀── try_send_to      a lane can be stopped: it fills, then drops
//! ```

use std::cell::RefCell;
use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddrV4;
use std::rc::Rc;
use std::task::{Poll, Waker};

use kehai::link::{Clock as _, Datagrams, Dropped, Lane, Outbox};

use crate::simulated_time::SimulatedClock;

/// Datagrams a stopped lane takes.
const LANE_ROOM: usize = 4;

/// The network. Clones are the same one; a clone is also the module's port.
#[derive(Clone)]
pub struct Network {
    clock: SimulatedClock,
    shared: Rc<RefCell<Shared>>,
}

#[derive(Default)]
struct Shared {
    to_module: VecDeque<(Vec<u8>, SocketAddrV4)>,
    module: Option<Waker>,
    hosts: BTreeMap<SocketAddrV4, Inbox>,
    /// Hosts that answer no ARP: what is sent to them stays in its lane, and everything behind it.
    unreachable: Vec<SocketAddrV4>,
    lanes: BTreeMap<u8, VecDeque<(Vec<u8>, SocketAddrV4)>>,
    reopened: u32,
}

#[derive(Default)]
struct Inbox {
    datagrams: VecDeque<(u64, Vec<u8>)>,
    host: Option<Waker>,
}

/// A host's socket.
#[derive(Clone)]
pub struct HostSocket {
    network: Network,
    address: SocketAddrV4,
}

impl Network {
    /// A network with the module alone.
    #[must_use]
    pub fn new(clock: &SimulatedClock) -> Self {
        Self { clock: clock.clone(), shared: Rc::default() }
    }

    /// A host with this address and port.
    #[must_use]
    pub fn host(&self, address: SocketAddrV4) -> HostSocket {
        self.shared.borrow_mut().hosts.entry(address).or_default();
        HostSocket { network: self.clone(), address }
    }

    /// Whether the host at `address` answers ARP; at first all do.
    pub fn set_reachable(&self, address: SocketAddrV4, reachable: bool) {
        let shared = &mut *self.shared.borrow_mut();
        shared.unreachable.retain(|host| *host != address);
        if !reachable {
            shared.unreachable.push(address);
        }
        let now_us = self.clock.now_us();
        for lane in shared.lanes.values_mut() {
            while lane.front().is_some_and(|(_, to)| !shared.unreachable.contains(to)) {
                let Some((datagram, to)) = lane.pop_front() else { break };
                deliver(&mut shared.hosts, datagram, to, now_us);
            }
        }
    }

    /// How often a lane was opened anew with something in it.
    #[must_use]
    pub fn reopened(&self) -> u32 {
        self.shared.borrow().reopened
    }
}

fn deliver(hosts: &mut BTreeMap<SocketAddrV4, Inbox>, datagram: Vec<u8>, to: SocketAddrV4, now_us: u64) {
    let Some(inbox) = hosts.get_mut(&to) else { return };
    inbox.datagrams.push_back((now_us, datagram));
    if let Some(host) = inbox.host.take() {
        host.wake();
    }
}

fn number(lane: Lane) -> u8 {
    match lane {
        Lane::Answers(lane) => u8::MAX - lane,
        Lane::Place(place) => place,
    }
}

impl Outbox for Network {
    fn try_send_to(&mut self, lane: Lane, to: SocketAddrV4, datagram: &[u8]) -> Result<(), Dropped> {
        let shared = &mut *self.shared.borrow_mut();
        let queue = shared.lanes.entry(number(lane)).or_default();
        if queue.is_empty() && !shared.unreachable.contains(&to) {
            deliver(&mut shared.hosts, datagram.to_vec(), to, self.clock.now_us());
            return Ok(());
        }
        if queue.len() >= LANE_ROOM {
            return Err(Dropped);
        }
        queue.push_back((datagram.to_vec(), to));
        Ok(())
    }

    fn is_empty(&mut self, lane: Lane) -> bool {
        self.shared.borrow().lanes.get(&number(lane)).is_none_or(VecDeque::is_empty)
    }

    fn reopen(&mut self, lane: Lane) {
        let shared = &mut *self.shared.borrow_mut();
        if let Some(queue) = shared.lanes.remove(&number(lane)) {
            shared.reopened += u32::from(!queue.is_empty());
        }
    }
}

impl Datagrams for Network {
    async fn receive_from(&mut self, buffer: &mut [u8]) -> (usize, SocketAddrV4) {
        std::future::poll_fn(|context| {
            let mut shared = self.shared.borrow_mut();
            let Some((datagram, from)) = shared.to_module.pop_front() else {
                shared.module = Some(context.waker().clone());
                return Poll::Pending;
            };
            let length = datagram.len().min(buffer.len());
            buffer[..length].copy_from_slice(&datagram[..length]);
            Poll::Ready((length, from))
        })
        .await
    }
}

impl HostSocket {
    /// Where it is.
    #[must_use]
    pub const fn address(&self) -> SocketAddrV4 {
        self.address
    }

    /// Sends to the module: there at once.
    pub fn send(&self, datagram: &[u8]) {
        let mut shared = self.network.shared.borrow_mut();
        shared.to_module.push_back((datagram.to_vec(), self.address));
        if let Some(module) = shared.module.take() {
            module.wake();
        }
    }

    /// A datagram that is there, and when it came.
    #[must_use]
    pub fn take(&self) -> Option<(u64, Vec<u8>)> {
        self.network.shared.borrow_mut().hosts.get_mut(&self.address)?.datagrams.pop_front()
    }

    /// The next datagram and when it came; None when none comes before `until_us`.
    pub async fn receive(&self, until_us: u64) -> Option<(u64, Vec<u8>)> {
        let clock = &self.network.clock;
        let next = std::future::poll_fn(|context| {
            if let Some(datagram) = self.take() {
                return Poll::Ready(datagram);
            }
            if let Some(inbox) = self.network.shared.borrow_mut().hosts.get_mut(&self.address) {
                inbox.host = Some(context.waker().clone());
            }
            Poll::Pending
        });
        match embassy_futures::select::select(next, clock.wait_until(until_us)).await {
            embassy_futures::select::Either::First(datagram) => Some(datagram),
            embassy_futures::select::Either::Second(()) => None,
        }
    }
}
