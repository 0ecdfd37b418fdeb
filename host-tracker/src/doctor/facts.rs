//! What was found out about an installation. What could not be is said, and never taken for good.

use std::net::SocketAddr;
use std::path::PathBuf;

use kehai_tracking::site::Site;
use kehai_tracking::snapshot::ModuleLine;

/// All of it.
#[derive(Clone, Debug)]
pub struct Facts {
    /// The options of the service.
    pub options: OptionsState,
    /// Whether it is the service of this machine, and not another site's tracker.
    pub is_service: bool,
    /// systemd's service; none where systemd does not run.
    pub service: Option<Service>,
    /// The site's file.
    pub site: SiteFact,
    /// Files with secrets beside it.
    pub secrets: Vec<SecretFile>,
    /// The database, if there is to be one.
    pub database: Option<DatabaseFact>,
    /// The live map, if it is to be served.
    pub map: Option<MapFact>,
    /// What the kernel keeps of datagrams.
    pub udp: UdpFact,
    /// How modules are found, if they are looked for.
    pub search: Option<SearchFact>,
    /// How modules are, as the tracker sees them, or why that is not known.
    pub devices: Result<Devices, String>,
    /// The broker, if there is one.
    pub broker: Option<BrokerFact>,
    /// The machine's clock.
    pub clock: Clock,
}

impl Facts {
    /// How many modules the site has; none if it cannot be read.
    #[must_use]
    pub fn modules(&self) -> Option<usize> {
        match &self.site.state {
            SiteState::Read(site) => Some(site.modules.len()),
            SiteState::Missing => Some(0),
            SiteState::Denied | SiteState::Wrong(_) => None,
        }
    }
}

/// The options of a service.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum OptionsState {
    /// They can be used; so can those of a tracker that is no service.
    Usable,
    /// The user of this command may not read this file of theirs.
    Denied(PathBuf),
    /// They cannot be used: what is wrong, and where.
    Wrong(String),
}

/// The site's file.
#[derive(Clone, Debug)]
pub struct SiteFact {
    /// Where it is.
    pub file: PathBuf,
    /// Whether it belongs to whom its folder belongs to; none where that cannot be said.
    pub owned: Option<bool>,
    /// What is in it.
    pub state: SiteState,
}

/// What is in a site's file.
#[derive(Clone, Debug)]
pub enum SiteState {
    /// There is none.
    Missing,
    /// The user of this command may not read it.
    Denied,
    /// It cannot be used: what is wrong, and where.
    Wrong(String),
    /// A site.
    Read(Box<Site>),
}

/// What a file with secrets is for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Secret {
    /// The keys of the site's modules.
    Keys,
    /// Who may log in.
    Users,
    /// The key by which cards are hashed.
    Cards,
    /// The key of the tracker's own certificate.
    Certificate,
}

/// A file with secrets.
#[derive(Clone, Debug)]
pub struct SecretFile {
    /// What it is for.
    pub secret: Secret,
    /// Where it is.
    pub file: PathBuf,
    /// What is in it.
    pub state: SecretState,
}

/// How a file with secrets is.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum SecretState {
    /// There is none; whether there must be.
    Missing {
        /// It was named, or nothing starts without it.
        needed: bool,
    },
    /// The user of this command may not look at it.
    Denied,
    /// It is there.
    There {
        /// Its mode; none where files have none.
        mode: Option<u32>,
        /// Whether it belongs to whom its folder belongs to; none where that cannot be said.
        owned: Option<bool>,
        /// How many users, modules or keys are in it, or what is wrong with it; none if it may not be read.
        content: Option<Result<usize, String>>,
    },
}

/// The database.
#[derive(Clone, Debug)]
pub struct DatabaseFact {
    /// Where it is.
    pub file: PathBuf,
    /// How it is.
    pub state: DatabaseState,
    /// What the disk under it has left for the tracker, bytes.
    pub free_bytes: Option<u64>,
}

/// How a database is.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum DatabaseState {
    /// There is none, and whether there is a folder to make it in.
    Missing {
        /// There is.
        folder: bool,
    },
    /// The user of this command may not read it.
    Denied,
    /// It cannot be used.
    Wrong(String),
    /// It can.
    Read {
        /// The number of its layout.
        layout: i64,
        /// The number of the newest that this version knows.
        newest: i64,
        /// Whether a tracker writes it at the moment; none if that cannot be said.
        written: Option<bool>,
    },
}

/// The live map.
#[derive(Clone, Debug)]
pub struct MapFact {
    /// Where it is asked.
    pub address: SocketAddr,
    /// Whether others than this machine reach it.
    pub is_reached: bool,
    /// Whether it is served without a log-in.
    pub insecure: bool,
    /// Whether a first user is made at the start.
    pub first_admin: bool,
    /// What `/healthz` answers.
    pub health: Health,
    /// The version of the tracker that answers, or why it is not known.
    pub version: Result<String, String>,
    /// The version of this program.
    pub own_version: &'static str,
}

/// What `/healthz` answers.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Health {
    /// The tracker goes on.
    Goes,
    /// It stands still.
    Stands,
    /// Another program answers, with this status.
    Other(u16),
    /// No program answers: what the system says.
    NoAnswer(String),
}

/// What the kernel keeps of datagrams.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct UdpFact {
    /// What it gives at most, bytes; none if it does not say.
    pub most_bytes: Option<u64>,
    /// What the tracker asks for, bytes.
    pub asked_bytes: u64,
    /// Why there is no socket, if there is none.
    pub trouble: Option<String>,
}

/// How modules are found.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SearchFact {
    /// IPv4 networks of this machine beside its own; none if the system does not say.
    pub networks: Option<usize>,
    /// How many modules were found, or why none can be looked for.
    pub found: Result<usize, String>,
}

/// How modules are.
#[derive(Clone, Debug)]
pub struct Devices {
    /// How old that is, s.
    pub age_s: f64,
    /// They.
    pub modules: Vec<ModuleLine>,
}

/// The broker.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct BrokerFact {
    /// Its name and port.
    pub broker: String,
    /// What became of a log-in there: done, or what it or the system says.
    pub log_in: Result<(), String>,
}

/// Whether the machine's clock is set by another.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Clock {
    /// It is.
    Synchronised,
    /// It is not.
    Free,
    /// The system does not say.
    Unknown,
}

/// systemd's service.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Service {
    /// systemd does not say.
    Unknown(String),
    /// There is no such unit.
    NotInstalled,
    /// It is installed.
    Installed {
        /// What it is doing.
        activity: Activity,
        /// Whether it starts with the machine; none if systemd does not say.
        enabled: Option<bool>,
        /// How often systemd has started it anew; none if it does not say.
        restarts: Option<u32>,
    },
}

/// What a service is doing: systemd's ActiveState.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Activity {
    /// It runs.
    Active,
    /// It starts, or starts again.
    Starting,
    /// It has failed.
    Failed,
    /// It was stopped, or never started.
    Inactive,
    /// Something else.
    Other,
}
