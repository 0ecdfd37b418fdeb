//! What an announcement says of a device: where it may be, and which it claims to be.

use std::net::SocketAddr;

use kehai::wire::ModuleId;

/// What is known of a module that announces itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// Its instance name: `kehai-123401`.
    pub instance: String,
    /// Its identity; [`ModuleId::ANY`] if it does not say.
    pub id: ModuleId,
    /// Where it may answer, in a fixed order; never empty.
    pub addresses: Vec<SocketAddr>,
    /// Its firmware's version.
    pub firmware: String,
    /// Its sensor's model; empty until it has found one.
    pub model: String,
    /// Its sensor's serial number; empty until it has found one.
    pub serial: String,
}

/// What is new on the network.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Finding {
    /// A module is there, or says something new.
    Found(Found),
    /// The module with this instance name is gone.
    Lost(String),
}
