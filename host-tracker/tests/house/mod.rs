//! A server with users and tokens: a site, doors or none, and a clock of the test's own.
#![allow(dead_code, reason = "each test uses its own part of it")]

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use host_tracker::access::Access;
use host_tracker::access::directory::{Token, User};
use host_tracker::access::file::AccessFile;
use host_tracker::access::password;
use host_tracker::access::roles::Role;
use host_tracker::access::secret;
use host_tracker::alarm_handle::AlarmHandle;
use host_tracker::certificate::Certificate;
use host_tracker::connections::Connections;
use host_tracker::doors::DoorHandle;
use host_tracker::signs::SignHandle;
use host_tracker::site_file::SiteFile;
use host_tracker::web::{Bind, Limits, Listen, Server, ServerContext};
use kehai_tracking::snapshot::Snapshot;
use tokio::sync::watch;
use ureq::http::HeaderMap;

/// A site without doors.
pub const ZONE: &str = "
[[zone]]
name = \"area\"
polygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
secure = true
";

/// Two doors, to be put behind it.
pub const DOORS: &str = "
[[door]]
name = \"front\"
zone = \"area\"
line = [[-0.45, 1.0], [0.45, 1.0]]
fail = \"secure\"

[[door]]
name = \"back\"
zone = \"area\"
line = [[-0.45, -1.0], [0.45, -1.0]]
fail = \"secure\"
";

/// Of every user.
pub const PASSWORD: &str = "correct horse battery";

pub const S: u64 = 1_000_000;

pub struct House {
    pub server: Server,
    pub file: AccessFile,
    pub refused: Connections,
    pub listed: AlarmHandle,
    pub frames: watch::Sender<Arc<Snapshot>>,
    pub folder: tempfile::TempDir,
    now_us: Arc<AtomicU64>,
}

impl House {
    /// With the user `anna`, who is an admin.
    pub fn of(site: &str) -> Self {
        Self::bound(site, Limits::default(), false)
    }

    /// The same within other bounds, in clear or over TLS by a certificate of its own, for `localhost`.
    pub fn bound(site: &str, limits: Limits, tls: bool) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("house.toml");
        std::fs::write(&path, site).unwrap();
        let file = AccessFile::beside(&path);
        let now_us = Arc::new(AtomicU64::new(0));
        let clock = Arc::clone(&now_us);
        let (frames, newest) = watch::channel(Arc::default());
        let refused = Connections::default();
        let listed = AlarmHandle::default();
        let site = SiteFile::load(&path).unwrap();
        add(&file, "anna", Role::Admin);
        let context = ServerContext {
            doors: Some(DoorHandle::new(&site.current().site, None)),
            signs: Some(SignHandle::new(&site.current().site, None)),
            access: Access::timed(file.clone(), Box::new(move || clock.load(Ordering::SeqCst))),
            listed: listed.clone(),
            connections: refused.clone(),
            ..ServerContext::alone(newest, site)
        };
        let own = || Certificate::own(&path, &["localhost".to_owned()]).unwrap();
        let map = Bind { address: SocketAddr::from(([127, 0, 0, 1], 0)), certificate: tls.then(own) };
        let server = Server::start(Listen { map, doors: None, limits }, context).unwrap();
        Self { server, file, refused, listed, frames, folder, now_us }
    }

    pub fn pass(&self, time_us: u64) {
        self.now_us.fetch_add(time_us, Ordering::SeqCst);
    }

    /// Another user.
    pub fn add(&self, name: &str, role: Role) {
        add(&self.file, name, role);
        self.pass(S);
    }

    /// The header of a new token.
    pub fn token(&self, name: &str, roles: &[Role], door: Option<&str>) -> String {
        let shown = secret::token().unwrap();
        let token = Token {
            name: name.into(),
            roles: roles.to_vec(),
            door: door.map(str::to_owned),
            sha256: secret::fingerprint(&shown),
        };
        self.file.change(|directory| directory.add_token(token)).unwrap();
        self.pass(S);
        format!("Bearer {shown}")
    }

    /// Status and body, with these headers.
    pub fn ask(&self, line: &str, headers: &[(&str, &str)], body: &str) -> (u16, String) {
        crate::http_client::ask(self.server.address(), line, headers, body.as_bytes())
    }

    /// The answer to a log-in.
    pub fn log_in(&self, name: &str, password: &str) -> (u16, HeaderMap, String) {
        let body = serde_json::json!({ "name": name, "password": password }).to_string();
        let json = [("Content-Type", "application/json")];
        crate::http_client::exchange(self.server.address(), "POST /api/session", &json, body.as_bytes())
    }

    /// The cookie of a user who has logged in.
    pub fn cookie(&self, name: &str) -> String {
        let (status, headers, body) = self.log_in(name, PASSWORD);
        assert_eq!(status, 200, "{body}");
        headers["set-cookie"].to_str().unwrap().split(';').next().unwrap().to_owned()
    }
}

fn add(file: &AccessFile, name: &str, role: Role) {
    let user = User { name: name.into(), role, password: password::hash(PASSWORD).unwrap() };
    file.change(|directory| directory.add_user(user)).unwrap();
}
