//! What a reader of tags does: each reading is a message to the tracker, over HTTP.
//!
//! ```text
//!   TagReader ─ 9.09 Hz ─▶ POST /api/sign {"id": "04A22B0007", "reader": "tags", "u": 312.4, "v": 205.1}
//! ```

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use host_sim::entrance::gate::Gate;
use kehai_tracking::site::Site;
use kehai_tracking::site::reader::Reads;
use serde_json::json;

/// An answer takes no longer, or the reading is lost.
const PATIENCE: Duration = Duration::from_secs(1);

/// What became of the readings.
#[derive(Debug, Default)]
pub struct Sent {
    pub taken: AtomicU64,
    pub refused: AtomicU64,
}

/// A thread that reads tags. It ends when it is dropped.
pub struct Signs {
    sent: Arc<Sent>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Signs {
    /// Reads the tags at `gate`, and tells the tracker at `address`.
    pub fn start(gate: &Gate, address: SocketAddr) -> Self {
        let (sent, stop) = (Arc::new(Sent::default()), Arc::new(AtomicBool::new(false)));
        let (mut reader, people_at) = gate.tags();
        let (begun, began_s) = (Instant::now(), gate.devices().now_s());
        let name = reader_name(gate.site());
        let (counts, stopped) = (Arc::clone(&sent), Arc::clone(&stop));
        let thread = std::thread::spawn(move || {
            let agent: ureq::Agent =
                ureq::Agent::config_builder().timeout_global(Some(PATIENCE)).build().into();
            let now_s = || began_s + begun.elapsed().as_secs_f64();
            while !stopped.load(Ordering::Relaxed) {
                let at_s = reader.next_s();
                std::thread::sleep(Duration::from_secs_f64((at_s - now_s()).max(0.0)));
                for reading in reader.read(&people_at(at_s)) {
                    let (u, v) = reading.pixel;
                    let message = json!({ "id": reading.id, "reader": name, "u": u, "v": v }).to_string();
                    let answer = agent.post(format!("http://{address}/api/sign")).send(message);
                    let count = if answer.is_ok() { &counts.taken } else { &counts.refused };
                    count.fetch_add(1, Ordering::Relaxed);
                }
            }
        });
        Self { sent, stop, thread: Some(thread) }
    }

    /// Ends it, and says what became of the readings.
    pub fn stop(mut self) -> (u64, u64) {
        self.end();
        (self.sent.taken.load(Ordering::Relaxed), self.sent.refused.load(Ordering::Relaxed))
    }

    fn end(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A thread that has panicked has already printed its message.
            let _ = thread.join();
        }
    }
}

impl Drop for Signs {
    fn drop(&mut self) {
        self.end();
    }
}

fn reader_name(site: &Site) -> String {
    let is_camera =
        |reader: &&kehai_tracking::site::reader::Reader| matches!(reader.reads, Reads::Pixels { .. });
    site.readers.iter().find(is_camera).map(|reader| reader.name.clone()).unwrap_or_default()
}
