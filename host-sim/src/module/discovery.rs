//! The module's DNS-SD service, announced by this PC: the same words as a board's, on every interface on
//! which the module listens.

use std::fmt;
use std::net::SocketAddr;

use kehai::link::Clock;
use kehai::module::discovery::{SERVICE, Service};
use kehai::tasks::Notices;
use kehai::wire::ModuleId;
use mdns_sd::{Error, IfKind, ServiceDaemon, ServiceInfo};

/// Between two looks at what the module has found out about its sensor, µs.
const LOOK_US: u64 = 500_000;

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
        loop {
            let service = Service::new(self.module, self.firmware, &notices.status());
            if self.told.as_ref() != Some(&service)
                && let Err(error) = self.tell(service)
            {
                return error;
            }
            clock.wait_until(clock.now_us() + LOOK_US).await;
        }
    }

    fn tell(&mut self, service: Service) -> Result<(), Error> {
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
