//! The bounds of a listener: so that no client, and no flood of them, costs more than a part of the machine.
//!
//! ```text
//!   connect ─▶ a place? ─▶ header, 64 kB ── 10 s ─▶ body, 1 MB ── 30 s ─▶ answer ── taken within 30 s ─▶ header …
//!                                                                 browser ◀── ping each 20 s ──▶ pong
//! ```

use std::time::Duration;

use super::places::Shares;

/// Longest header of a request: a browser's with many cookies of other programs at the same host is 16 kB.
pub(super) const HEADER_MAX: usize = 64 << 10;

/// The bounds of a listener.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Connections. Browsers that look at the map may take half of them, so that a page that is open everywhere leaves
    /// room for requests.
    pub connections: Shares,
    /// Until the whole header of the next request has come. A connection that is kept open and asks nothing counts, too:
    /// hyper has one timer for both, and a browser connects anew in a millisecond.
    pub header: Duration,
    /// Until the body of a request has come.
    pub body: Duration,
    /// Until a client takes the next piece of what it is sent.
    pub write: Duration,
    /// Between two pings to a browser. One that has not said anything from one to the next is gone: a client that reads
    /// nothing does not answer them, though the system takes a megabyte for it.
    pub ping: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            // A service gets 1024 descriptors, so two listeners leave three quarters of them to the tracker. A browser
            // opens 6 connections and a socket: 16 are two of them. On the loopback address are programs of this
            // machine, or all browsers of the house behind a reverse proxy: they have half of all.
            connections: Shares { all: 128, of_address: 16, of_loopback: 64 },
            header: Duration::from_secs(10),
            body: Duration::from_secs(30),
            write: Duration::from_secs(30),
            ping: Duration::from_secs(20),
        }
    }
}
