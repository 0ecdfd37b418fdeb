//! Addresses of modules on the command line.

use std::net::{SocketAddr, ToSocketAddrs};

use kehai::wire::PORT;

/// The address of a module; port 4040 if none is given.
pub(super) fn address(text: &str) -> Result<SocketAddr, String> {
    let found = if text.contains(':') { text.to_socket_addrs() } else { (text, PORT).to_socket_addrs() };
    found
        .map_err(|error| format!("{text}: {error}"))?
        .find(SocketAddr::is_ipv4)
        .ok_or_else(|| format!("{text}: no IPv4 address"))
}
