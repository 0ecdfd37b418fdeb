//! The networks of this host, as the system tells them.

use if_addrs::{IfAddr, get_if_addrs};
use kehai_tracking::registry::Networks;

/// Those of this host, at this time; none if the system does not say.
#[must_use]
pub fn of_host() -> Networks {
    let interfaces = get_if_addrs().unwrap_or_default();
    let addresses = interfaces.into_iter().filter_map(|interface| match interface.addr {
        IfAddr::V4(v4) => Some((v4.ip, v4.netmask)),
        IfAddr::V6(_) => None,
    });
    Networks::of(addresses)
}
