//! The live map's server, as a browser and a program have it: its answers and its WebSocket.

use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use host_tracker::site_file::SiteFile;
use host_tracker::web::{Server, ServerContext};
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::Snapshot;
use serde_json::{Value, json};
use tokio::sync::watch;
use tungstenite::{Message, WebSocket};
use ureq::Agent;

/// A hundred times what a loaded machine needs.
const PATIENCE: Duration = Duration::from_secs(60);

pub struct Map {
    server: Server,
    frames: watch::Sender<Arc<Snapshot>>,
    changes: Arc<Mutex<Vec<Site>>>,
    agent: Agent,
    socket: WebSocket<TcpStream>,
}

impl Map {
    /// Of a site's file, with the database of a tracker.
    pub fn new(site: &Path, database: &Path) -> Self {
        let (frames, newest) = watch::channel(Arc::default());
        let changes = Arc::new(Mutex::new(Vec::new()));
        let told = Arc::clone(&changes);
        let context = ServerContext {
            changed: Box::new(move |site| {
                told.lock().unwrap().push(site);
                Ok(())
            }),
            database: Some(database.to_path_buf()),
            ..ServerContext::alone(newest, SiteFile::load(site).unwrap())
        };
        let server = Server::start(SocketAddr::from(([127, 0, 0, 1], 0)), context).unwrap();
        let agent: Agent = Agent::config_builder().http_status_as_error(false).proxy(None).build().into();
        let stream = TcpStream::connect(server.address()).unwrap();
        let (socket, _) = tungstenite::client(format!("ws://{}/ws", server.address()), stream).unwrap();
        Self { server, frames, changes, agent, socket }
    }

    pub fn show(&self, snapshot: &Arc<Snapshot>) {
        self.frames.send_replace(Arc::clone(snapshot));
    }

    /// The body of an answer.
    pub fn text(&self, path: &str) -> String {
        let url = format!("http://{}{path}", self.server.address());
        let mut answer = self.agent.get(&url).call().unwrap();
        let text = answer.body_mut().read_to_string().unwrap();
        assert!(answer.status().is_success(), "{path}: {text}");
        text
    }

    pub fn ask(&self, path: &str) -> Value {
        serde_json::from_str(&self.text(path)).unwrap()
    }

    /// The newest frame of the WebSocket, and of the API: those of this time.
    pub fn newest(&mut self, t_s: f64) -> [Value; 2] {
        let begun = Instant::now();
        let pushed = loop {
            assert!(begun.elapsed() < PATIENCE, "no frame of {t_s} s");
            let Message::Text(text) = self.socket.read().unwrap() else { continue };
            let frame = serde_json::from_str::<Value>(&text).unwrap()["frame"].take();
            if frame["t"].as_f64() == Some(t_s) {
                break frame;
            }
        };
        let asked = self.ask("/api/state");
        let asked = if asked["frame"].is_null() { asked } else { asked["frame"].clone() };
        assert_eq!(asked["t"].as_f64(), Some(t_s), "{asked}");
        [pushed, asked]
    }

    /// Saves another site, and returns what the tracker is told.
    pub fn save(&self, site: &Site) -> Site {
        let url = format!("http://{}/api/site", self.server.address());
        let body = json!({ "revision": self.ask("/api/site")["revision"], "site": site }).to_string();
        let request = self.agent.put(&url).header("Content-Type", "application/json");
        let mut answer = request.send(body.as_bytes()).unwrap();
        let text = answer.body_mut().read_to_string().unwrap();
        assert!(answer.status().is_success(), "{text}");
        self.changes.lock().unwrap().pop().unwrap_or_else(|| site.clone())
    }
}
