//! Datagrams of all modules to sightings: whose, when, where, and what that module's background says.
//!
//! ```text
//!   datagram ─▶ header: which module, which boot ─▶ its clock, setup, background ─▶ Sighting
//! ```
//!
//! Modules are keyed by identity, never by address. A report is used once, however often it comes, and not at
//! all while its module's clock or geometry is unknown; everything dropped is counted by cause.

mod module;
mod profile;
pub mod sequence;

use std::collections::BTreeMap;
use std::sync::Arc;

use kehai::centre::Estimator;
use kehai::wire::{Message, ModuleId};

use serde::{Deserialize, Serialize};

use crate::sighting::Sighting;
use crate::site::Site;
pub use module::Module;

/// Oldest report that is still used, s behind its arrival.
pub const LATE_S: f64 = 0.3;

/// What was not used, by cause.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Drops {
    /// Not a module's datagram, or not a version understood.
    pub unreadable: u64,
    /// Came before.
    pub repeated: u64,
    /// Older than [`LATE_S`].
    pub late: u64,
    /// The module's clock, setup or geometry is not known yet.
    pub early: u64,
    /// From a boot of the module that is over.
    pub stale_boot: u64,
    /// The module has no place in the site.
    pub unplaced: u64,
}

/// Receives what all modules send.
#[derive(Debug)]
pub struct Intake {
    site: Arc<Site>,
    estimator: Estimator,
    modules: BTreeMap<ModuleId, Module>,
    drops: Drops,
}

impl Intake {
    /// For the modules of a site.
    #[must_use]
    pub fn new(site: Arc<Site>, estimator: Estimator) -> Self {
        Self { site, estimator, modules: BTreeMap::new(), drops: Drops::default() }
    }

    /// Goes on with another site: every module takes its place there.
    pub fn change_site(&mut self, site: Arc<Site>) {
        for (id, module) in &mut self.modules {
            module.place(*id, &site);
        }
        self.site = site;
    }

    /// Takes a datagram that arrived at `now_us` on the host's clock.
    pub fn receive(&mut self, datagram: &[u8], now_us: u64) -> Option<Sighting> {
        let Ok((header, message)) = Message::decode(datagram) else {
            self.drops.unreadable += 1;
            return None;
        };
        let module = self.modules.entry(header.identity.module).or_default();
        if !module.accepts_boot(header.identity.boot) {
            self.drops.stale_boot += 1;
            return None;
        }
        match message {
            Message::Subscribed(answer) => module.take_exchange(&answer, now_us),
            Message::Info(info) => module.take_info(&info, header.identity.module, &self.site),
            Message::ProfilePart(part) => module.take_profile(&part),
            Message::Report(report) => {
                return module.sighting(&report, now_us, self.estimator, &mut self.drops);
            }
            _ => {}
        }
        None
    }

    /// Everything known of the modules heard of.
    #[must_use]
    pub const fn modules(&self) -> &BTreeMap<ModuleId, Module> {
        &self.modules
    }

    /// What was not used.
    #[must_use]
    pub const fn drops(&self) -> &Drops {
        &self.drops
    }
}
