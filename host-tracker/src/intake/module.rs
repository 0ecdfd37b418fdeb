//! What is known of one module: its boot, clock, sensor and background.

use std::sync::Arc;

use kehai::centre::Estimator;
use kehai::scan::Geometry;
use kehai::visibility;
use kehai::wire::{Info, ModuleId, ProfilePart, Report, Subscribed};

use super::profile::Profile;
use super::sequence::{Kind, Sequences};
use super::{Drops, LATE_S};
use crate::clock::{Exchange, ModuleClock};
use crate::sighting::{Seen, Sighting, View};
use crate::site::Site;

/// One module.
#[derive(Clone, Debug, Default)]
pub struct Module {
    boot: u32,
    clock: ModuleClock,
    setup: Option<Setup>,
    profile: Profile,
    used: Sequences,
    last_heard_us: u64,
    /// Reports used.
    reports: u64,
}

#[derive(Clone, Debug)]
struct Setup {
    number: u16,
    name: String,
    geometry: Geometry,
    view: Option<Arc<View>>,
    open_range_mm: u16,
}

impl Module {
    /// Whether a datagram of this boot is current. A newer boot begins everything anew.
    pub(super) fn accepts_boot(&mut self, boot: u32) -> bool {
        if boot < self.boot {
            return false;
        }
        if boot > self.boot {
            *self = Self { boot, ..Self::default() };
        }
        true
    }

    pub(super) fn take_exchange(&mut self, answer: &Subscribed, now_us: u64) {
        let t1_us = u64::from_le_bytes(answer.t1);
        self.clock.add(Exchange { t1_us, t2_us: answer.t2_us, t3_us: answer.t3_us, t4_us: now_us });
    }

    pub(super) fn take_info(&mut self, info: &Info<'_>, id: ModuleId, site: &Site) {
        let Some(sensor) = info.sensor else { return };
        let Ok(geometry) = sensor.geometry() else { return };
        self.setup = Some(Setup {
            number: info.setup,
            name: info.name.to_owned(),
            geometry,
            view: None,
            open_range_mm: sensor.open_range_mm,
        });
        self.place(id, site);
    }

    /// Takes its place in the site: by the name it calls itself, or by its identity.
    pub(super) fn place(&mut self, id: ModuleId, site: &Site) {
        let Some(setup) = &mut self.setup else { return };
        let place = site.place_of(&setup.name, id);
        setup.view = place.and_then(|module| {
            let placed = site.modules.get(module)?;
            let (pose, height_m, geometry) = (placed.pose(), placed.height_m, setup.geometry);
            Some(Arc::new(View { module, pose, height_m, geometry }))
        });
    }

    pub(super) fn take_profile(&mut self, part: &ProfilePart<'_>) {
        let Some(setup) = &self.setup else { return };
        if part.head.setup == setup.number {
            self.profile.take(part, setup.geometry.beams(), setup.open_range_mm);
        }
    }

    pub(super) fn sighting(
        &mut self,
        report: &Report<'_>,
        now_us: u64,
        estimator: Estimator,
        drops: &mut Drops,
    ) -> Option<Sighting> {
        let head = &report.head;
        if self.used.take(head.sequence) == Kind::Repeated {
            drops.repeated += 1;
            return None;
        }
        self.last_heard_us = now_us;
        let (Some(setup), Some(start_s)) = (&self.setup, self.clock.host_s(head.stamp_us)) else {
            drops.early += 1;
            return None;
        };
        if setup.number != head.setup {
            drops.early += 1;
            return None;
        }
        let Some(view) = &setup.view else {
            drops.unplaced += 1;
            return None;
        };
        let period_s = f64::from(view.geometry.period_us()) * 1e-6;
        if now_us as f64 * 1e-6 - start_s > LATE_S + period_s {
            drops.late += 1;
            return None;
        }
        let candidates: Vec<_> = report.candidates.iter().collect();
        let background_mm = self.profile.empty_mm(head.background_version, setup.geometry.beams());
        let mut empty_mm = background_mm.to_vec();
        visibility::cover(&view.geometry, candidates.iter(), report.unseen.iter(), &mut empty_mm);
        let seen =
            candidates.into_iter().map(|candidate| Seen::new(candidate, view, start_s, estimator)).collect();
        self.reports += 1;
        Some(Sighting { view: Arc::clone(view), start_s, seen, empty_mm, background_mm })
    }

    /// Range of the wall behind each of its beams, mm; 0 where there is none. Empty before its background is whole.
    #[must_use]
    pub const fn walls_mm(&self) -> &Arc<[u16]> {
        self.profile.walls_mm()
    }

    /// Where its beams point, once it has said so.
    #[must_use]
    pub fn geometry(&self) -> Option<&Geometry> {
        self.setup.as_ref().map(|setup| &setup.geometry)
    }

    /// Its number in the site, if it has a place there.
    #[must_use]
    pub fn place_in_site(&self) -> Option<usize> {
        Some(self.setup.as_ref()?.view.as_ref()?.module)
    }

    /// Its clock on the host's.
    #[must_use]
    pub const fn clock(&self) -> &ModuleClock {
        &self.clock
    }

    /// When its last report came, µs on the host's clock.
    #[must_use]
    pub const fn last_heard_us(&self) -> u64 {
        self.last_heard_us
    }

    /// Reports used.
    #[must_use]
    pub const fn reports(&self) -> u64 {
        self.reports
    }
}
