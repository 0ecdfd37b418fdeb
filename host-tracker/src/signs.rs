//! Who is where: signs from outside and the tracks of the running tracker, shared by the tracking loop and all who ask.
//!
//! ```text
//!   tracking loop ─ observe, before each snapshot ─▶ ╭───────╮ ─▶ names      for that snapshot
//!   HTTP, MQTT ──── tell ──────────────────────────▶ │ names │ ─▶ where_is   for a question
//!                                                    ╰───────╯
//! ```
//!
//! Each of them holds the lock for some microseconds. The tracker never asks the names anything.

use std::sync::Arc;

use parking_lot::Mutex;

use crate::doors::{Hash, by_process};
use kehai_tracking::estimate::Estimate;
use kehai_tracking::names::message::{self, Reading};
use kehai_tracking::names::{NameLine, Names, NotTaken, Sign, SignCounts, Whereabouts};
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::unix_ms;

/// The names of the running tracker. Clones are the same names.
#[derive(Clone)]
pub struct SignHandle(Arc<Mutex<Shared>>);

struct Shared {
    site: Arc<Site>,
    names: Names,
    hash: Hash,
    /// The newest estimate: its time on the tracks' clock, s, and on this machine's, ms since 1970.
    newest: Option<(f64, u64)>,
    counts: SignCounts,
}

impl std::fmt::Debug for SignHandle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SignHandle").finish_non_exhaustive()
    }
}

impl SignHandle {
    /// With nothing known. `hash` makes of an ID what may be kept of it; without one it is a hash by a key that is lost with
    /// the process.
    #[must_use]
    pub fn new(site: &Arc<Site>, hash: Option<Hash>) -> Self {
        let shared = Shared {
            site: Arc::clone(site),
            names: Names::default(),
            hash: hash.unwrap_or_else(by_process),
            newest: None,
            counts: SignCounts::default(),
        };
        Self(Arc::new(Mutex::new(shared)))
    }

    /// Goes on with another site: names stay with their tracks.
    pub fn change_site(&self, site: &Arc<Site>) {
        self.0.lock().site = Arc::clone(site);
    }

    /// Notes the tracks, and says who is whom among them: both belong to the same snapshot.
    #[must_use]
    pub fn observe(&self, estimate: &Estimate) -> (Vec<NameLine>, SignCounts) {
        let mut shared = self.0.lock();
        let Estimate { t_s, tracks, explanations, .. } = estimate;
        shared.names.follow_explained(tracks, explanations, *t_s);
        shared.newest = Some((estimate.t_s, unix_ms()));
        (shared.names.lines(&shared.site), shared.counts)
    }

    /// Takes a message.
    ///
    /// # Errors
    /// Why it changed nothing.
    pub fn tell(&self, bytes: &[u8]) -> Result<(), NotTaken> {
        let shared = &mut *self.0.lock();
        let taken = shared.sign(bytes, unix_ms()).and_then(|sign| shared.names.sign(&sign));
        shared.counts.count(&taken);
        taken
    }

    /// Where an ID is, if that is known.
    ///
    /// # Errors
    /// It is no ID.
    pub fn where_is(&self, id: &str) -> Result<Option<Whereabouts>, NotTaken> {
        let shared = self.0.lock();
        let card = (shared.hash)(message::id(id)?);
        Ok(shared.names.where_is(card, &shared.site))
    }
}

impl Shared {
    fn sign(&self, bytes: &[u8], now_ms: u64) -> Result<Sign, NotTaken> {
        let Reading { card, ago_s, read } = message::read(bytes, &self.site, now_ms, &self.hash)?;
        let (t_s, at_ms) = self.newest.ok_or(NotTaken::Untracked)?;
        let at_s = t_s + now_ms.saturating_sub(at_ms) as f64 * 1e-3 - ago_s;
        Ok(Sign { card, at_s, read })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai_tracking::snapshot::Snapshot;
    use serde_json::json;

    fn estimate(t_s: f64, x: f64) -> Estimate {
        let line = json!({ "t": t_s, "tracks": [{ "id": 4, "x": x, "y": 0.0, "state": "confirmed" }] });
        let tracks = Snapshot::of(1, serde_json::from_value(line).unwrap()).tracks;
        Estimate { t_s, tracks, ..Estimate::default() }
    }

    #[test]
    fn a_sign_by_the_wall_clock_meets_tracks_of_another_clock() {
        let handle = SignHandle::new(&Arc::default(), None);
        let early = handle.tell(br#"{"id":"a","x":0,"y":0}"#).unwrap_err();
        assert_eq!(early, NotTaken::Untracked);
        let _ = handle.observe(&estimate(1000.0, 5.0));
        handle.tell(br#"{"id":"04:a2","x":5,"y":0}"#).unwrap();
        let (names, counts) = handle.observe(&estimate(1000.1, 5.0));
        assert_eq!((names[0].tracks[0].track, counts.taken, counts.untracked), (4, 1, 1));
        let there = handle.where_is("04:a2").unwrap().unwrap();
        assert_eq!(there.at, Some([5.0, 0.0]));
        assert_eq!(handle.where_is("04:a3").unwrap(), None);
        assert!(handle.where_is(" ").is_err());
        // After a while without tracks a sign has none to meet.
        let late = json!({ "id": "a", "x": 5, "y": 0, "at_ms": unix_ms() - 1500 }).to_string();
        assert_eq!(handle.tell(late.as_bytes()), Err(NotTaken::Untracked));
        let malformed = handle.tell(b"{").unwrap_err();
        assert!(malformed.to_string().starts_with("malformed: "));
        let (_, counts) = handle.observe(&estimate(1000.2, 5.0));
        assert_eq!((counts.taken, counts.untracked, counts.malformed), (1, 2, 1));
    }
}
