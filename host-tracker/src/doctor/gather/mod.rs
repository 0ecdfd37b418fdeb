//! Asks the machine, the tracker and the broker. Changes nothing there, and decides nothing.
//!
//! ```text
//!   Installation ─┬─ files      site, secrets, database, disk
//!                 ├─ tracker    /healthz, /api/session, /api/state, or what the database knew last
//!                 ├─ network    socket, DNS-SD, broker
//!                 └─ machine    timedatectl, systemctl ─▶ Facts
//! ```

mod files;
mod machine;
mod network;
mod tracker;

use std::net::SocketAddr;
use std::path::PathBuf;

use super::facts::{Facts, OptionsState};
use crate::mqtt::BrokerLink;

/// What is to be looked at: the options with which a tracker is started.
#[derive(Debug)]
pub struct Installation {
    /// The options of the service.
    pub options: OptionsState,
    /// Whether it is the service of this machine.
    pub is_service: bool,
    /// The site's file.
    pub site: PathBuf,
    /// The keys of its modules, if another file than that beside the site was named.
    pub keys: Option<PathBuf>,
    /// The database.
    pub database: Option<PathBuf>,
    /// The live map.
    pub map: Option<MapPlace>,
    /// Whether modules are looked for.
    pub discover: bool,
    /// The broker, or what is wrong with its certificates.
    pub broker: Option<Result<BrokerLink, String>>,
    /// What the tracker is to be asked with.
    pub token: Option<String>,
}

/// Where the live map is.
#[derive(Clone, Debug)]
pub struct MapPlace {
    /// Where it listens.
    pub listen: SocketAddr,
    /// The certificate that it shows, if it speaks TLS there.
    pub certificate: Option<PathBuf>,
    /// Whether it is served without a log-in.
    pub insecure: bool,
    /// Whether a first user is made at the start.
    pub first_admin: bool,
}

/// Finds out all that can be. It takes some seconds: modules are listened for.
#[must_use]
pub fn gather(what: Installation) -> Facts {
    let site = files::site(&what.site);
    let database = what.database.as_deref().map(files::database);
    let seen = what.map.as_ref().map(|map| tracker::ask(map, what.token.as_deref()));
    let (map, devices) = match seen {
        Some((map, devices)) => (Some(map), devices),
        None => (None, Err("the map is not served".to_owned())),
    };
    let devices = devices.or_else(|why| what.database.as_deref().and_then(tracker::last_known).ok_or(why));
    Facts {
        options: what.options,
        is_service: what.is_service,
        service: what.is_service.then(machine::service).flatten(),
        secrets: files::secrets(&what.site, what.keys, &site),
        site,
        database,
        map,
        udp: network::udp(),
        search: what.discover.then(network::search),
        devices,
        broker: what.broker.map(network::broker),
        clock: machine::clock(),
    }
}
