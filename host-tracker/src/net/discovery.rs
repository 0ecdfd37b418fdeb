//! Modules on the network, found by DNS-SD as `_kehai._udp`.
//!
//! ```text
//!   announcement ─▶ mdns-sd's thread ─▶ Finding::Found  instance, addresses, what it says of itself
//!   good-bye, or nothing for two minutes ─▶ Finding::Lost
//! ```
//!
//! Sources: RFC 6762 (multicast DNS), RFC 6763 (DNS-SD); what modules announce is in `kehai::device::discovery`.

use std::fmt;
use std::net::{SocketAddr, SocketAddrV4};
use std::time::{Duration, Instant};

use crate::module_id;
use kehai::device::discovery::SERVICE;
use kehai::wire::ModuleId;
use kehai_tracking::registry::{Finding, Found};
use kehai_tracking::text::printable;
use mdns_sd::{IfKind, Receiver, ResolvedService, ServiceDaemon, ServiceEvent};

/// The network cannot be searched.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error(
    "modules cannot be looked for on the network: {0}; give their addresses with --module, and --no-mdns"
)]
pub struct SearchError(String);

/// Instances announced before the search begins anew: four times as many as are looked for. What was announced is kept in
/// memory for as long as the announcement says, 3 kB each.
const ANNOUNCED: u32 = 1024;

/// Looks for modules until dropped.
pub struct Search {
    daemon: ServiceDaemon,
    events: Receiver<ServiceEvent>,
    /// Instances since it began.
    announced: u32,
}

impl fmt::Debug for Search {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Search").finish_non_exhaustive()
    }
}

impl Search {
    /// Begins to look.
    ///
    /// # Errors
    /// There are no sockets for it.
    pub fn start() -> Result<Self, SearchError> {
        let error = |error: mdns_sd::Error| SearchError(error.to_string());
        let daemon = ServiceDaemon::new().map_err(error)?;
        // Modules have no IPv6 addresses.
        daemon.disable_interface(IfKind::IPv6).map_err(error)?;
        let events = daemon.browse(&format!("{}.local.", SERVICE.join("."))).map_err(error)?;
        Ok(Self { daemon, events, announced: 0 })
    }

    /// What has been found since the last time; does not wait.
    pub fn findings(&mut self) -> Vec<Finding> {
        let mut findings = Vec::new();
        for event in self.events.try_iter() {
            self.announced += u32::from(matches!(event, ServiceEvent::ServiceFound(..)));
            findings.extend(finding(event));
        }
        // If there are no sockets for a new one, the old one goes on.
        if self.announced > ANNOUNCED
            && let Ok(anew) = Self::start()
        {
            *self = anew;
        }
        findings
    }

    /// The next finding before `end`.
    #[must_use]
    pub fn next_before(&self, end: Instant) -> Option<Finding> {
        loop {
            let left = end.saturating_duration_since(Instant::now());
            match self.events.recv_timeout(left) {
                Ok(event) => match finding(event) {
                    None => {}
                    found => return found,
                },
                Err(_) => return None,
            }
        }
    }

    /// Every module that is found within `time`.
    #[must_use]
    pub fn all_within(&self, time: Duration) -> Vec<Found> {
        let end = Instant::now() + time;
        let mut all: Vec<Found> = Vec::new();
        while let Some(finding) = self.next_before(end) {
            let (Finding::Found(Found { instance, .. }) | Finding::Lost(instance)) = &finding;
            all.retain(|known| known.instance != *instance);
            if let Finding::Found(found) = finding {
                all.push(found);
            }
        }
        all.sort_by(|one, other| one.instance.cmp(&other.instance));
        all
    }
}

impl Drop for Search {
    fn drop(&mut self) {
        let _ = self.daemon.shutdown();
    }
}

fn finding(event: ServiceEvent) -> Option<Finding> {
    match event {
        ServiceEvent::ServiceResolved(service) => found(&service).map(Finding::Found),
        ServiceEvent::ServiceRemoved(_, name) => Some(Finding::Lost(instance(&name))),
        _ => None,
    }
}

fn found(service: &ResolvedService) -> Option<Found> {
    let mut addresses: Vec<SocketAddr> = service
        .get_addresses_v4()
        .into_iter()
        .map(|address| SocketAddrV4::new(address, service.port).into())
        .collect();
    addresses.sort_unstable();
    let text = |key: &str| printable(service.txt_properties.get_property_val_str(key).unwrap_or_default());
    let (instance, id) = (instance(&service.fullname), module_id::read(&text("id")).unwrap_or(ModuleId::ANY));
    let (firmware, model, serial) = (text("firmware"), text("model"), text("serial"));
    (!addresses.is_empty()).then_some(Found { instance, id, addresses, firmware, model, serial })
}

/// `kehai-123401._kehai._udp.local.` → `kehai-123401`.
fn instance(full_name: &str) -> String {
    printable(full_name.split('.').next().unwrap_or(full_name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_instance_is_the_first_label() {
        assert_eq!(instance("kehai-123401._kehai._udp.local."), "kehai-123401");
        assert_eq!(instance(""), "");
        assert_eq!(instance("hall\u{1b}[2J._kehai._udp.local."), "hall\u{fffd}[2J");
    }
}
