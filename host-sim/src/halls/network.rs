//! A router of Zenoh between areas and site; or two, and between them what loses frames.
//!
//! ```text
//!   trackers ─▶ router ─▶ site                                  nothing is lost
//!   trackers ─▶ router ─ frames, some are lost ─▶ router ─▶ site     questions for sites and tokens go through
//! ```

use std::collections::BTreeMap;
use std::error::Error;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use kehai_emulator::ports::free_tcp;
use parking_lot::Mutex;
use serde_json::json;
use zenoh::liveliness::LivelinessToken;
use zenoh::sample::SampleKind;
use zenoh::{Config, Session, Wait};

use crate::world::random::{Purpose, Stream};

/// What areas publish, answer and are (docs/areas.md).
const FRAMES: &str = "kehai/*/*/frame";
const SITES: &str = "kehai/*/*/site";
const TOKENS: &str = "kehai/*/*/alive";

/// An address that no program has.
pub(super) fn free() -> std::io::Result<SocketAddr> {
    Ok(SocketAddr::from((Ipv4Addr::LOCALHOST, free_tcp()?)))
}

/// The routers. They end when this is dropped.
pub(super) struct Network {
    /// Where the trackers of areas connect.
    pub areas_port: u16,
    /// Where the service of the site connects.
    pub site_port: u16,
    lost: Arc<AtomicU64>,
    _sessions: Vec<Session>,
}

fn config(mode: &str, end: &str, port: u16) -> String {
    json!({
        "mode": mode,
        end: { "endpoints": [format!("tcp/127.0.0.1:{port}")] },
        "scouting": { "multicast": { "enabled": false }, "gossip": { "enabled": false } },
    })
    .to_string()
}

fn open(mode: &str, end: &str, port: u16) -> Result<Session, String> {
    let config = Config::from_json5(&config(mode, end, port)).map_err(|error| error.to_string())?;
    zenoh::open(config).wait().map_err(|error| error.to_string())
}

impl Network {
    /// One router, or two that lose this share of the frames.
    pub(super) fn start(lost_share: f64, seed: u64) -> Result<Self, Box<dyn Error>> {
        let (areas_port, lost) = (free()?.port(), Arc::new(AtomicU64::new(0)));
        let mut sessions = vec![open("router", "listen", areas_port)?];
        let mut site_port = areas_port;
        if lost_share > 0.0 {
            site_port = free()?.port();
            sessions.push(open("router", "listen", site_port)?);
            let [from, to] = [open("client", "connect", areas_port)?, open("client", "connect", site_port)?];
            let counted = Arc::clone(&lost);
            relay(&from, &to, lost_share, seed, counted).map_err(|error| error.to_string())?;
            sessions.extend([from, to]);
        }
        Ok(Self { areas_port, site_port, lost, _sessions: sessions })
    }

    /// The configuration of a client of the router at this port.
    pub(super) fn client(port: u16) -> String {
        config("client", "connect", port)
    }

    /// Frames that were lost.
    pub(super) fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

/// Passes on what areas say, but for a share of their frames.
fn relay(
    from: &Session,
    to: &Session,
    lost_share: f64,
    seed: u64,
    lost: Arc<AtomicU64>,
) -> Result<(), zenoh::Error> {
    let stream = Mutex::new(Stream::new(seed, Purpose::Network, [u64::MAX, 1]));
    let out = to.clone();
    from.declare_subscriber(FRAMES)
        .callback(move |sample| {
            if stream.lock().chance(lost_share) {
                lost.fetch_add(1, Ordering::Relaxed);
            } else {
                // What the other router does not take is lost, too.
                let _ = out.put(sample.key_expr().clone(), sample.payload().clone()).wait();
            }
        })
        .background()
        .wait()?;
    let asked = from.clone();
    to.declare_queryable(SITES)
        .callback(move |query| {
            let answer = query.clone();
            let pass = move |reply: zenoh::query::Reply| {
                if let Ok(sample) = reply.result() {
                    let _ = answer.reply(sample.key_expr().clone(), sample.payload().clone()).wait();
                }
            };
            let _ = asked.get(query.key_expr().clone()).callback(pass).wait();
        })
        .background()
        .wait()?;
    let tokens: Mutex<BTreeMap<String, LivelinessToken>> = Mutex::default();
    let out = to.clone();
    from.liveliness()
        .declare_subscriber(TOKENS)
        .history(true)
        .callback(move |sample| {
            let key = sample.key_expr().to_string();
            if sample.kind() == SampleKind::Delete {
                tokens.lock().remove(&key);
            } else if let Ok(token) = out.liveliness().declare_token(key.clone()).wait() {
                tokens.lock().insert(key, token);
            }
        })
        .background()
        .wait()?;
    Ok(())
}
