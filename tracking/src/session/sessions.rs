//! The sessions with all devices, and the only way in for what they send.
//!
//! ```text
//!   bytes ─▶ decode, once ─▶ Datagram ─▶ accept ─▶ the device's session ─▶ Observation
//! ```

use std::collections::BTreeMap;
use std::sync::Arc;

use kehai::centre::Estimator;
use kehai::wire::ModuleId;

use super::datagram::Datagram;
use super::{Placement, Session, Subscription};
use crate::observation::Observation;
use crate::site::Site;
use crate::snapshot::Drops;

/// The sessions with all devices.
#[derive(Debug)]
pub struct Sessions {
    placement: Placement,
    sessions: BTreeMap<ModuleId, Session>,
    drops: Drops,
    decoded: u64,
}

impl Sessions {
    /// For the devices of a site.
    #[must_use]
    pub fn new(site: Arc<Site>, estimator: Estimator) -> Self {
        let placement = Placement { site, estimator };
        Self { placement, sessions: BTreeMap::new(), drops: Drops::default(), decoded: 0 }
    }

    /// Goes on with another site: every device takes its place there.
    pub fn change_site(&mut self, site: Arc<Site>) {
        for session in self.sessions.values_mut() {
            session.place(&site);
        }
        self.placement.site = site;
    }

    /// Decodes what has arrived; what cannot be read, or names no device, is counted.
    pub fn decode<'a>(&mut self, bytes: &'a [u8]) -> Option<Datagram<'a>> {
        self.decoded += 1;
        let datagram = Datagram::decode(bytes).ok().filter(|datagram| datagram.device() != ModuleId::ANY);
        self.drops.unreadable += u64::from(datagram.is_none());
        datagram
    }

    /// Decodes and uses what arrived at `now_us` on the host's clock; an observation, if it was a report that counts.
    pub fn receive(&mut self, bytes: &[u8], now_us: u64) -> Option<Observation> {
        let datagram = self.decode(bytes)?;
        self.accept(&datagram, now_us)
    }

    /// The same with a datagram that is decoded already.
    pub fn accept(&mut self, datagram: &Datagram<'_>, now_us: u64) -> Option<Observation> {
        let device = datagram.device();
        let session =
            self.sessions.entry(device).or_insert_with(|| Session::new(device, Subscription::default()));
        session.receive(datagram, now_us, &self.placement, &mut self.drops)
    }

    /// Monitors the health of a device from `now_us` on. Its session goes on, or begins with the requests of
    /// `subscription`.
    pub fn meet(&mut self, device: ModuleId, subscription: &Subscription, now_us: u64) {
        let new = || Session::new(device, subscription.clone());
        let session = self.sessions.entry(device).or_insert_with(new);
        if session.monitor.is_none() {
            session.monitor_from(now_us);
        }
    }

    /// Ends the monitoring of a device. What was measured stays: a recording can be followed again bit for bit only if it
    /// does not depend on what was monitored.
    pub fn part(&mut self, device: ModuleId) {
        if let Some(session) = self.get_mut(device) {
            session.monitor = None;
        }
    }

    /// The session with a device.
    #[must_use]
    pub fn get(&self, device: ModuleId) -> Option<&Session> {
        self.sessions.get(&device)
    }

    /// The session with a device.
    pub fn get_mut(&mut self, device: ModuleId) -> Option<&mut Session> {
        self.sessions.get_mut(&device)
    }

    /// All sessions, in the order of their identities.
    pub fn iter(&self) -> impl Iterator<Item = &Session> {
        self.sessions.values()
    }

    /// What was not used, by cause.
    #[must_use]
    pub const fn drops(&self) -> &Drops {
        &self.drops
    }

    /// How often something was decoded.
    #[must_use]
    pub const fn decoded(&self) -> u64 {
        self.decoded
    }
}
