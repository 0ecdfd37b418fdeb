//! The live map: where it is served, and where others than this machine open it.
//!
//! ```text
//!   listen  0.0.0.0:8420 ─▶ https://kehai.local:8420/    its URL, told to Home Assistant
//!   doors 127.0.0.1:8421    messages to doors alone
//! ```

use std::io;
use std::net::SocketAddr;

use crate::access::Access;
use crate::firmware::folder::FirmwareFolder;
use crate::web::{Bind, Limits, Listen, Server, ServerContext};

/// Where the live map is served.
#[derive(Debug)]
pub struct Map {
    /// The address.
    pub listen: Bind,
    /// Where messages to doors are taken, if not there.
    pub doors: Option<Bind>,
    /// Names under which browsers may open it, beside this machine's addresses and own name.
    pub names: Vec<String>,
    /// What clients may do there.
    pub access: Access,
    /// Where firmware for new boards lies.
    pub firmware: FirmwareFolder,
    /// Whether others than this machine are served though any client may do everything.
    pub insecure: bool,
}

/// Why the map is not served.
#[derive(Debug, thiserror::Error)]
pub enum MapError {
    /// Any client on the network could do everything.
    #[error("{0} is for the whole network, and no user has been added who may log in")]
    Open(SocketAddr),
    /// Its address cannot be used.
    #[error("the live map cannot be at {places}: {error}")]
    Listen {
        /// Where it was to be, and the doors.
        places: String,
        /// What the system says.
        error: io::Error,
    },
}

impl Map {
    /// Refuses an address at which others than this machine could do everything.
    ///
    /// # Errors
    /// [`MapError::Open`].
    pub fn refuse_open(&self) -> Result<(), MapError> {
        if !self.access.is_open() || self.insecure {
            return Ok(());
        }
        let mut listens =
            [Some(&self.listen), self.doors.as_ref()].into_iter().flatten().map(|bind| bind.address);
        listens.find(is_reached).map_or(Ok(()), |open| Err(MapError::Open(open)))
    }

    /// Where others than this machine open it: by the name that was given for it, or the first address that they reach.
    #[must_use]
    pub fn url(&self) -> Option<String> {
        let Bind { address, .. } = self.listen;
        if !is_reached(&address) || address.port() == 0 {
            return None;
        }
        let own = || {
            let all = if_addrs::get_if_addrs().unwrap_or_default();
            all.iter().map(if_addrs::Interface::ip).find(|ip| ip.is_ipv4() && !ip.is_loopback())
        };
        let ip = if address.ip().is_unspecified() { own() } else { Some(address.ip()) };
        let host = self
            .names
            .first()
            .cloned()
            .or_else(|| ip.map(|ip| if ip.is_ipv6() { format!("[{ip}]") } else { ip.to_string() }))?;
        Some(format!("{}://{host}:{}/", self.listen.scheme(), address.port()))
    }

    /// Serves it.
    ///
    /// # Errors
    /// [`MapError::Listen`].
    pub fn serve(self, context: ServerContext) -> Result<Server, MapError> {
        let Self { listen, doors, .. } = self;
        let places = match &doors {
            Some(doors) => format!("{}, or the doors at {}", listen.address, doors.address),
            None => listen.address.to_string(),
        };
        let at = Listen { map: listen, doors, limits: Limits::default() };
        Server::start(at, context).map_err(|error| MapError::Listen { places, error })
    }
}

/// Whether others than this machine reach this address.
#[must_use]
pub fn is_reached(address: &SocketAddr) -> bool {
    !address.ip().to_canonical().is_loopback()
}
