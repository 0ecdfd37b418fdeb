//! The module's DNS-SD service, announced by this PC: the same words as a board's, on every interface on
//! which the module listens.

use std::fmt;
use std::io;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::time::Duration;

use kehai::device::discovery::{SERVICE, Service};
use kehai::link::Clock;
use kehai::tasks::Notices;
use kehai::wire::ModuleId;
use mdns_sd::{Error, IfKind, ServiceDaemon, ServiceInfo};

/// Between two looks at what the module has found out about its sensor, µs.
const LOOK_US: u64 = 500_000;

/// After the first announcement, before it may be changed, µs: its name is probed for up to 250 ms and three times 250 ms
/// more (RFC 6762, section 8.1), twice that on a busy machine. A change within that time meets the daemon's own probe, which
/// takes it for another machine's, chooses another name, meets the change again, and so on for ever.
const PROBED_US: u64 = 2_000_000;

/// Multicast DNS's group (RFC 6762, section 3).
const GROUP: Ipv4Addr = Ipv4Addr::new(224, 0, 0, 251);

/// Tries, and how long each waits: loopback loses nothing, but a machine may be busy.
const TRIES: (usize, Duration) = (5, Duration::from_millis(500));

/// Answers for the module, in a thread of its own, until dropped.
pub struct Announcement {
    daemon: ServiceDaemon,
    listen: SocketAddr,
    module: ModuleId,
    firmware: &'static str,
    told: Option<Service>,
}

impl fmt::Debug for Announcement {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Announcement").field("told", &self.told).finish_non_exhaustive()
    }
}

/// The service type as DNS-SD writes it: `_kehai._udp.local.`
#[must_use]
pub fn service_type() -> String {
    format!("{}.local.", SERVICE.join("."))
}

/// Whether a datagram to multicast DNS's group comes back on the loopback interface: some containers and sandboxes
/// have no multicast at all, and nothing is found by DNS-SD there. Another port is used for that.
#[must_use]
pub fn multicast_passes() -> bool {
    echo().unwrap_or(false)
}

fn echo() -> io::Result<bool> {
    let hears = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
    hears.join_multicast_v4(&GROUP, &Ipv4Addr::LOCALHOST)?;
    hears.set_read_timeout(Some(TRIES.1))?;
    // Its own address says which interface.
    let says = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
    for _ in 0..TRIES.0 {
        says.send_to(b"kehai", (GROUP, hears.local_addr()?.port()))?;
        if hears.recv_from(&mut [0; 16]).is_ok() {
            return Ok(true);
        }
    }
    Ok(false)
}

impl Announcement {
    /// Gets ready to announce `module`, which listens at `listen`.
    ///
    /// # Errors
    /// There are no sockets for it.
    pub fn new(listen: SocketAddr, module: ModuleId, firmware: &'static str) -> Result<Self, Error> {
        let daemon = ServiceDaemon::new()?;
        // Modules have no IPv6 addresses.
        daemon.disable_interface(IfKind::IPv6)?;
        Ok(Self { daemon, listen, module, firmware, told: None })
    }

    /// Announces what `notices` say of the sensor, now and whenever it changes; returns only when an
    /// announcement is refused, and why.
    ///
    /// # Cancellation
    /// The module goes on being announced as it was.
    pub async fn keep(&mut self, notices: &Notices, clock: &impl Clock) -> Error {
        let mut from_us = clock.now_us();
        loop {
            let service = Service::new(self.module, self.firmware, &notices.status());
            let is_first = self.told.is_none();
            if self.told.as_ref() != Some(&service)
                && clock.now_us() >= from_us
                && let Err(error) = self.publish(service)
            {
                return error;
            }
            if is_first {
                from_us = clock.now_us() + PROBED_US;
            }
            clock.wait_until(clock.now_us() + LOOK_US).await;
        }
    }

    fn publish(&mut self, service: Service) -> Result<(), Error> {
        let host = format!("{}.local.", service.instance());
        let (ip, port) = (self.listen.ip(), self.listen.port());
        let everywhere = ip.is_unspecified();
        let addresses = if everywhere { String::new() } else { ip.to_string() };
        let txt = service.txt();
        let info =
            ServiceInfo::new(&service_type(), service.instance(), &host, addresses.as_str(), port, &txt[..])?;
        let mut info = if everywhere { info.enable_addr_auto() } else { info };
        info.set_interfaces(vec![if everywhere { IfKind::IPv4 } else { IfKind::Addr(ip) }]);
        // Its own name is not in its own way.
        info.set_requires_probe(self.told.is_none());
        self.daemon.register(info)?;
        self.told = Some(service);
        Ok(())
    }
}

impl Drop for Announcement {
    fn drop(&mut self) {
        if let Some(service) = &self.told {
            let name = format!("{}.{}", service.instance(), service_type());
            // Says good-bye; without that, hosts forget the module after two minutes.
            if let Ok(done) = self.daemon.unregister(&name) {
                let _ = done.recv();
            }
        }
        let _ = self.daemon.shutdown();
    }
}
