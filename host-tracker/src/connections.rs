//! HTTP connections and requests that were refused or ended, counted where every snapshot finds them.
//!
//! ```text
//!   listeners, requests, browsers ── count(Cause::Address) ──▶ Connections ──▶ Snapshot.http ──▶ /metrics
//! ```

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use kehai_tracking::snapshot::HttpRefused;

/// Why a connection was refused or ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Cause {
    /// All places were taken.
    Full,
    /// Its address had its share of them.
    Address,
    /// No whole header of a request came in time.
    Header,
    /// The body of a request did not come in time.
    Body,
    /// The client did not take what it was sent.
    Unread,
    /// The host or the page that asked is not allowed.
    Foreign,
    /// Who asked is not known, or the password was wrong.
    Unknown,
    /// Who asked may not do this.
    Role,
    /// Passwords were tried too often.
    Often,
    /// No TLS could be agreed, or a request came without it.
    Tls,
}

/// The counts. Clones are the same.
#[derive(Clone, Debug, Default)]
pub struct Connections(Arc<[AtomicU64; 10]>);

impl Connections {
    /// One more.
    pub fn count(&self, cause: Cause) {
        self.of(cause).fetch_add(1, Ordering::Relaxed);
    }

    /// All, since the start.
    #[must_use]
    pub fn refused(&self) -> HttpRefused {
        let count = |cause| self.of(cause).load(Ordering::Relaxed);
        HttpRefused {
            full: count(Cause::Full),
            address: count(Cause::Address),
            header: count(Cause::Header),
            body: count(Cause::Body),
            unread: count(Cause::Unread),
            foreign: count(Cause::Foreign),
            unknown: count(Cause::Unknown),
            role: count(Cause::Role),
            often: count(Cause::Often),
            tls: count(Cause::Tls),
        }
    }

    fn of(&self, cause: Cause) -> &AtomicU64 {
        let [full, address, header, body, unread, foreign, unknown, role, often, tls] = &*self.0;
        match cause {
            Cause::Full => full,
            Cause::Address => address,
            Cause::Header => header,
            Cause::Body => body,
            Cause::Unread => unread,
            Cause::Foreign => foreign,
            Cause::Unknown => unknown,
            Cause::Role => role,
            Cause::Often => often,
            Cause::Tls => tls,
        }
    }
}
