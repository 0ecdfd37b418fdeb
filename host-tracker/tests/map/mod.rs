//! The live map's server, alone, with the site file that it writes.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::{Arc, Mutex};

use host_tracker::reports::Reports;
use host_tracker::site_file::SiteFile;
use host_tracker::web::{Server, ServerContext};
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{ModuleLine, Snapshot};
use tokio::sync::watch;
use tungstenite::WebSocket;
use tungstenite::client::IntoClientRequest;

/// Its site file.
pub const HOME: &str = "# where we live
[[zone]]
name = \"hall\"
polygon = [[0, 0], [1, 0], [1, 1]]

[[module]]
name = \"left\"
x = 0
y = 0
yaw_deg = 0
";

/// The server, its inputs, and the sites that were saved.
pub struct Map {
    pub server: Server,
    pub frames: watch::Sender<Arc<Snapshot>>,
    pub reports: Reports,
    pub changes: Arc<Mutex<Vec<Site>>>,
    pub folder: tempfile::TempDir,
}

impl Map {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("home.toml");
        std::fs::write(&path, HOME).unwrap();
        let (frames, newest) = watch::channel(Arc::default());
        let changes = Arc::new(Mutex::new(Vec::new()));
        let reports = Reports::default();
        let told = Arc::clone(&changes);
        let context = ServerContext {
            reports: reports.clone(),
            changed: Box::new(move |site| {
                told.lock().unwrap().push(site);
                Ok(())
            }),
            ..ServerContext::alone(newest, SiteFile::load(&path).unwrap())
        };
        let server = Server::start(SocketAddr::from(([127, 0, 0, 1], 0)), context).unwrap();
        Self { server, frames, reports, changes, folder }
    }

    pub fn show(&self, unix_ms: u64) {
        let free = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
        let module = ModuleLine { name: "left".into(), free: free.into(), ..ModuleLine::default() };
        self.frames.send_replace(Arc::new(Snapshot {
            unix_ms,
            modules: vec![module],
            ..Snapshot::default()
        }));
    }

    /// Status and body of the answer to a request with these headers.
    pub fn ask(&self, line: &str, headers: &[(&str, &str)], body: &[u8]) -> (u16, String) {
        crate::http_client::ask(self.server.address(), line, headers, body)
    }

    /// Whatever comes back for these bytes, which need not be HTTP, until the server closes.
    pub fn send(&self, bytes: &[u8]) -> Vec<u8> {
        let mut stream = TcpStream::connect(self.server.address()).unwrap();
        // A server that refuses early may have closed already.
        let _ = stream.write_all(bytes);
        let _ = stream.shutdown(std::net::Shutdown::Write);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        answer
    }

    pub fn put(&self, kind: &str, headers: &[(&str, &str)], body: &str) -> (u16, String) {
        let headers = [&[("Content-Type", kind)], headers].concat();
        self.ask("PUT /api/site", &headers, body.as_bytes())
    }

    pub fn socket(&self, origin: Option<&str>) -> Result<WebSocket<TcpStream>, tungstenite::Error> {
        let address = self.server.address();
        let mut request = format!("ws://{address}/ws").into_client_request().unwrap();
        if let Some(origin) = origin {
            request.headers_mut().insert("Origin", origin.parse().unwrap());
        }
        let stream = TcpStream::connect(address).unwrap();
        tungstenite::client(request, stream).map(|(socket, _)| socket).map_err(|error| match error {
            tungstenite::HandshakeError::Failure(error) => error,
            tungstenite::HandshakeError::Interrupted(_) => panic!("interrupted"),
        })
    }
}
