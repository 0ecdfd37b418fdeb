//! The options of `run` for HTTP: where the map and the doors are served, to whom, and over what.
//!
//! ```text
//!   --http IP ─┬─ this machine's own ─▶ in clear, unless --tls; open until a user is added
//!              └─ others reach it ────▶ over TLS, and only with a user who may log in, unless --insecure
//! ```

use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};

use clap::Args;
use host_tracker::access::file::AccessFile;
use host_tracker::access::{Access, FIRST, first_admin};
use host_tracker::certificate::Certificate;
use host_tracker::doctor::gather::MapPlace;
use host_tracker::firmware::folder::{self, FirmwareFolder};
use host_tracker::map::{Map, MapError, is_reached};
use host_tracker::web::{Bind, names_of_this_machine};

use super::failure::Failure;
use super::log::say;

/// Where the map is unless another place is named.
const THIS_MACHINE: &str = "127.0.0.1:8420";

#[derive(Debug, Args)]
pub(super) struct HttpArguments {
    /// Serve the live map, for this machine alone unless an address is given: 0.0.0.0:8420 is for the whole network, which
    /// has to log in [default: 127.0.0.1:8420]
    #[arg(long, value_name = "[IP:]PORT", num_args = 0..=1, default_missing_value = THIS_MACHINE, value_parser = listen)]
    http: Option<SocketAddr>,

    /// Take messages to doors at this address alone, by connections of their own: a flood of the map does not reach
    /// them, and who sees the map need not reach them [default: at the map's address]
    #[arg(long, value_name = "[IP:]PORT", requires = "http", value_parser = listen)]
    door_http: Option<SocketAddr>,

    /// A further name or address under which browsers may open the map: localhost, this machine's own name, and the
    /// address that a connection reaches are allowed without
    #[arg(long, value_name = "NAME", requires = "http")]
    http_name: Vec<String>,

    /// Firmware that the map hands out for new boards
    #[arg(long, value_name = "FOLDER", requires = "http", default_value = folder::USUAL)]
    firmware: PathBuf,

    /// If no user may log in yet, add the user admin, and say its password once on stderr, whatever is logged
    #[arg(long)]
    first_admin: bool,

    /// Serve this machine over TLS, too: others are served over TLS anyway, by a certificate made beside the site's file
    #[arg(long, requires = "http")]
    tls: bool,

    /// Serve over TLS by this certificate, with those between it and its authority, in PEM
    #[arg(long, value_name = "FILE.pem", requires = "http", requires = "tls_key")]
    tls_cert: Option<PathBuf>,

    /// The key of --tls-cert
    #[arg(long, value_name = "FILE.pem", requires = "tls_cert")]
    tls_key: Option<PathBuf>,

    /// Serve others than this machine in clear, and without a log-in if there are no users: then everybody who reaches the map
    /// may do everything
    #[arg(long, requires = "http")]
    insecure: bool,
}

/// What is served, and how.
#[derive(Debug)]
pub(super) struct Served {
    map: Option<Bind>,
    doors: Option<Bind>,
    certificate: Option<Certificate>,
}

impl HttpArguments {
    /// Serves the map for this machine, if nothing else was said.
    pub(super) fn serve_this_machine(&mut self) {
        self.http = self.http.or_else(|| listen(THIS_MACHINE).ok());
    }

    /// Whether anything is served.
    pub(super) const fn is_given(&self) -> bool {
        self.http.is_some()
    }

    /// Whether TLS is spoken at an address.
    fn is_encrypted(&self, address: &SocketAddr) -> bool {
        self.tls || self.tls_cert.is_some() || (is_reached(address) && !self.insecure)
    }

    /// Where the map is, of a tracker that was started with these.
    pub(super) fn place(&self, site: &Path) -> Option<MapPlace> {
        let listen = self.http?;
        let own = || site.with_extension("cert.pem");
        Some(MapPlace {
            listen,
            certificate: self.is_encrypted(&listen).then(|| self.tls_cert.clone().unwrap_or_else(own)),
            insecure: self.insecure,
            first_admin: self.first_admin,
        })
    }

    /// What is to be served.
    ///
    /// # Errors
    /// The certificate cannot be used, or made.
    pub(super) fn served(&self, site: &Path) -> Result<Served, Failure> {
        let certificate = self.certificate(site)?;
        let bind = |address: SocketAddr| {
            let certificate = certificate.clone().filter(|_| self.is_encrypted(&address));
            Bind { address, certificate }
        };
        Ok(Served { map: self.http.map(bind), doors: self.door_http.map(bind), certificate })
    }

    /// The map, for the daemon.
    ///
    /// # Errors
    /// The file of users cannot be used.
    pub(super) fn map(&self, served: &Served, site: &Path) -> Result<Option<Map>, Failure> {
        let access = self.access(site)?;
        let Some(listen) = served.map.clone() else { return Ok(None) };
        let (doors, names) = (served.doors.clone(), self.http_name.clone());
        let firmware = FirmwareFolder::at(&self.firmware);
        Ok(Some(Map { listen, doors, names, firmware, access, insecure: self.insecure }))
    }

    /// Who may do what; the first of them, if one is to be made.
    fn access(&self, site: &Path) -> Result<Access, Failure> {
        let file = AccessFile::beside(site);
        if self.first_admin
            && let Some(password) = first_admin(&file)?
        {
            // Whatever is logged: it is said nowhere else.
            say(format_args!(
                "the first user is {FIRST}, with the password {password}: it is not said again"
            ));
        }
        let access = Access::of(file);
        if self.insecure {
            let what = match access.is_open() {
                true => "everybody who reaches the map may do everything",
                false => "passwords and tokens go in clear over the network",
            };
            tracing::warn!("--insecure: {what}");
        }
        Ok(access)
    }

    /// What TLS shows, if it is spoken anywhere.
    fn certificate(&self, site: &Path) -> Result<Option<Certificate>, Failure> {
        if let (Some(certificate), Some(key)) = (&self.tls_cert, &self.tls_key) {
            return Ok(Some(Certificate::from_files(certificate, key)?));
        }
        if ![self.http, self.door_http].iter().flatten().any(|address| self.is_encrypted(address)) {
            return Ok(None);
        }
        Ok(Some(Certificate::own(site, &names_of_this_machine(&self.http_name))?))
    }
}

impl Served {
    /// Logs where everything is.
    pub(super) fn say(&self, map: Option<SocketAddr>, doors: Option<SocketAddr>) {
        if let Some((map, address)) = self.map.as_ref().zip(map) {
            tracing::info!("live map at {}://{address}/", map.scheme());
        }
        if let Some((doors, address)) = self.doors.as_ref().zip(doors) {
            tracing::info!("messages to doors at {}://{address}/api/door", doors.scheme());
        }
        if let Some(certificate) = &self.certificate {
            let (file, fingerprint) = (certificate.file().display(), certificate.fingerprint());
            tracing::info!("certificate {file} has the SHA-256 fingerprint {fingerprint}");
        }
    }
}

/// Why the map is not served, and which command helps.
pub(super) fn advised(error: MapError, site: &Path) -> Failure {
    if matches!(error, MapError::Open(_)) {
        let first = format!("kehai-tracker user add NAME --role admin --site {}", site.display());
        return format!("{error}: {first} makes the first user (--insecure goes without)").into();
    }
    error.into()
}

/// Where to listen: on this machine alone if only a port is said.
fn listen(text: &str) -> Result<SocketAddr, String> {
    let port = |text: &str| text.parse().ok().map(|port| SocketAddr::from((Ipv4Addr::LOCALHOST, port)));
    text.parse()
        .ok()
        .or_else(|| port(text))
        .ok_or_else(|| "PORT for this machine alone, or IP:PORT, as 0.0.0.0:8420 for everybody".to_owned())
}
