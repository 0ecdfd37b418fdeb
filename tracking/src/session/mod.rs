//! Everything the host remembers of one device: start, clock, setup, background, sequences, subscription, health.
//!
//! ```text
//!   datagram ─▶ boot: stale │ as before │ new: start again   (live: `start` has admitted it before)
//!                 ├ subscribed ─▶ clock
//!                 ├ info ───────▶ setup, place in the site
//!                 ├ profile ────▶ background
//!                 ├ report ─────▶ sequence, clock, setup, background ─▶ Observation
//!                 └ report, health, info ─▶ monitor ─▶ alarms, figures
//!   poll ◀── what is due: renewal, or what is still needed
//! ```
//!
//! Devices are keyed by identity, never by address. A report is used once, however often it comes, and not at all while
//! its device's clock or geometry is unknown; everything dropped is counted by cause.

pub mod datagram;
pub mod health;
mod observe;
pub mod outstanding;
mod panels;
mod profile;
mod sequence;
mod sessions;
pub mod start;
pub mod subscription;
pub(crate) mod upside_down;

use std::sync::Arc;

use kehai::centre::Estimator;
use kehai::scan::Geometry;
use kehai::wire::{
    Event, EventKind, Health, Identity, Info, Message, ModuleId, ProfilePart, Refusal, Subscribed,
};

use crate::alarm::AlarmKind;
use crate::clock::{Exchange, ModuleClock, Verdict};
use crate::explain::alarm::AlarmCondition;
use crate::floor::{Plan, Reading};
use crate::observation::{Observation, View};
use crate::site::{Place, Site};
use crate::snapshot::{Drops, ModuleLine};
use crate::text::printable;
use datagram::Datagram;
use health::Monitor;
use outstanding::{Kind, is_answer};
use profile::Profile;
use sequence::Sequences;
pub use sessions::Sessions;
use start::{BootFilter, SILENT_US};
use subscription::{Need, Subscription};
use upside_down::Beams;

/// Where devices stand and how the centres of bodies are found: the same for all sessions.
#[derive(Clone, Debug)]
pub struct Placement {
    /// The site.
    pub site: Arc<Site>,
    /// From a silhouette to a centre.
    pub estimator: Estimator,
}

/// What a datagram that is used says of people.
#[derive(Clone, Debug)]
pub enum Input {
    /// A scan of a module.
    Scan(Observation),
    /// A reading of a floor.
    Floor(Reading),
}

impl Input {
    /// The observation, if it is a scan.
    #[must_use]
    pub fn scan(self) -> Option<Observation> {
        match self {
            Self::Scan(observation) => Some(observation),
            Self::Floor(_) => None,
        }
    }
}

/// One device.
#[derive(Clone, Debug, Default)]
pub struct Session {
    identity: Identity,
    /// Whether its newest datagram was sealed with a key of the site: no other sender can speak for it.
    is_sealed: bool,
    /// The name the device gives itself. It outlives restarts; empty until the first info.
    name: String,
    /// The version it runs; empty until the first info of this start.
    firmware: String,
    clock: ModuleClock,
    boots: BootFilter,
    /// When this start of the device answered a request last, µs.
    answered_us: Option<u64>,
    /// Number of the setup that the newest info describes, usable or not.
    described: Option<u16>,
    /// Number of the newest change of its settings, and whether the newest info is from before: its name may be another.
    changed: (Option<u32>, bool),
    setup: Option<Setup>,
    /// Its number and panels, if it is a floor of the site.
    floor: Option<(usize, Plan)>,
    profile: Profile,
    sequences: Sequences,
    /// Setup and background version of the newest report.
    current: Option<(u16, u16)>,
    last_report_us: u64,
    /// Reports used.
    reports: u64,
    /// When the newest of them came, µs.
    used_us: u64,
    subscription: Subscription,
    monitor: Option<Box<Monitor>>,
}

/// A sensor that can be used.
#[derive(Clone, Debug)]
struct Setup {
    number: u16,
    /// As the sensor has them.
    geometry: Geometry,
    /// As they are used, where the module hangs.
    beams: Option<Beams>,
    view: Option<Arc<View>>,
}

/// How the start that a datagram names compares with the session's.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Boot {
    Stale,
    Current,
    New,
}

impl Session {
    /// A session with a device whose start is not known yet.
    #[must_use]
    pub fn new(device: ModuleId, subscription: Subscription) -> Self {
        Self { identity: Identity { module: device, boot: 0 }, subscription, ..Self::default() }
    }

    /// Watches the device's health from `now_us` on.
    pub fn monitor_from(&mut self, now_us: u64) {
        self.monitor = Some(Box::new(Monitor::new(now_us)));
    }

    /// What a message of the device is to this session, which knows what it has asked.
    #[must_use]
    pub fn kind(&self, message: &Message<'_>, now_us: u64) -> Kind {
        self.subscription.kind(message, now_us)
    }

    /// The requests to the device.
    #[must_use]
    pub const fn subscription(&self) -> &Subscription {
        &self.subscription
    }

    /// What answers a request of `other` is an answer here, too.
    pub fn adopt(&mut self, other: &Subscription) {
        self.subscription.adopt(other);
    }

    /// Whether a datagram of this device that arrived at `now_us` is to be used. Only a host that sent the requests itself
    /// can tell; a recording holds what was admitted.
    ///
    /// # Errors
    /// It is not, and why.
    pub fn admit(&mut self, datagram: &Datagram<'_>, now_us: u64) -> Result<(), start::Refusal> {
        let kind = self.subscription.consume(&datagram.message, now_us);
        self.boots.admit(datagram.header.identity.boot, kind, now_us)
    }

    /// Whether the device has answered within the last three seconds. What it sends unasked can be forged.
    #[must_use]
    pub fn is_answering(&self, now_us: u64) -> bool {
        self.answered_us.is_some_and(|answered_us| now_us.saturating_sub(answered_us) < SILENT_US)
    }

    /// It answers at another address than before, and may be another device: what it was said to be is asked for again,
    /// and there are no times until it has answered once more.
    pub fn note_new_address(&mut self, now_us: u64) {
        self.described = None;
        self.clock = ModuleClock::default();
        self.subscription.ask_at(now_us);
    }

    /// When it answered last, µs.
    #[must_use]
    pub const fn answered_us(&self) -> Option<u64> {
        self.answered_us
    }

    /// The report that came at `now_us` was handed on. Until then it may be dropped for a rival of the device, and a door must not
    /// take such a device for one that watches it.
    pub(super) const fn count_used(&mut self, now_us: u64) {
        self.reports += 1;
        self.used_us = now_us;
    }

    /// Uses a datagram of this device that arrived at `now_us` on the host's clock.
    pub fn receive(
        &mut self,
        datagram: &Datagram<'_>,
        now_us: u64,
        placement: &Placement,
        drops: &mut Drops,
    ) -> Option<Input> {
        let boot = datagram.header.identity.boot;
        match self.boot(boot, now_us) {
            Boot::Stale => {
                drops.stale_boot += 1;
                return None;
            }
            Boot::Current => {}
            Boot::New => self.restart(boot, now_us),
        }
        // What names a key and comes here was opened with it.
        self.is_sealed = datagram.header.key != 0;
        if is_answer(&datagram.message) {
            self.answered_us = Some(now_us);
        }
        if let Some(monitor) = &mut self.monitor {
            monitor.heard(now_us);
        }
        match &datagram.message {
            Message::Cookie { cookie, .. } => self.subscription.grant(*cookie),
            Message::Refused(refused) if refused.refusal == Refusal::BadCookie => self.subscription.revoke(),
            Message::Subscribed(answer) => self.synchronise(answer, now_us, drops),
            Message::Info(info) => self.describe(info, now_us, &placement.site),
            Message::ProfilePart(part) => self.store_profile(part),
            Message::Report(report) => {
                return self.observe(report, now_us, placement.estimator, drops).map(Input::Scan);
            }
            Message::Pressed(pressed) => return self.read(pressed, now_us, drops).map(Input::Floor),
            Message::Health(health) => {
                self.notice_change(health);
                if let Some(monitor) = &mut self.monitor {
                    monitor.health(health, boot, now_us);
                }
            }
            _ => {}
        }
        None
    }

    /// The boot rule: a device counts its starts, so a lower number is of a datagram that is late; unless the higher one has
    /// answered nothing for so long that it is over, and the device has forgotten how often it has started.
    fn boot(&self, boot: u32, now_us: u64) -> Boot {
        if boot < self.identity.boot {
            if self.is_answering(now_us) { Boot::Stale } else { Boot::New }
        } else if boot == self.identity.boot {
            Boot::Current
        } else {
            Boot::New
        }
    }

    /// Forgets what the last start of the device said.
    fn restart(&mut self, boot: u32, now_us: u64) {
        self.subscription.restart();
        if let Some(monitor) = &mut self.monitor {
            monitor.restart();
        }
        *self = Self {
            identity: Identity { boot, ..self.identity },
            name: std::mem::take(&mut self.name),
            subscription: self.subscription.clone(),
            boots: self.boots,
            answered_us: Some(now_us),
            monitor: self.monitor.take(),
            ..Self::default()
        };
    }

    fn synchronise(&mut self, answer: &Subscribed, now_us: u64, drops: &mut Drops) {
        let t1_us = u64::from_le_bytes(answer.t1);
        let exchange = Exchange { t1_us, t2_us: answer.t2_us, t3_us: answer.t3_us, t4_us: now_us };
        match self.clock.add(exchange) {
            Verdict::Taken | Verdict::Jumped => {}
            Verdict::Impossible | Verdict::Doubted => drops.clock += 1,
        }
    }

    /// A change of its settings makes it be asked again who it is.
    fn notice_change(&mut self, health: &Health<'_>) {
        let is_change = |event: &Event| event.kind == EventKind::SettingsChanged;
        let newest = health.events.iter().filter(is_change).map(|event| event.number).max();
        if newest > self.changed.0 {
            self.changed = (newest, true);
        }
    }

    fn describe(&mut self, info: &Info<'_>, now_us: u64, site: &Site) {
        self.name = printable(info.name);
        self.firmware = printable(info.firmware);
        self.described = Some(info.setup);
        self.changed.1 = false;
        // Now the profile. But an info that is late, or early, is asked for again in its time only: as fast as answers
        // come would be without end.
        if self.knows_setup() {
            self.subscription.ask_at(now_us);
        }
        if let Some(monitor) = &mut self.monitor {
            monitor.info(info);
        }
        self.stand(site);
        let Some(sensor) = info.sensor else { return };
        let Ok(geometry) = sensor.geometry() else { return };
        self.profile.set_open_range(sensor.open_range_mm);
        self.setup = Some(Setup { number: info.setup, geometry, beams: None, view: None });
        self.place(site);
    }

    /// Finds the device's place in the site: by the name it gives itself, or by its identity.
    fn place(&mut self, site: &Site) {
        self.stand(site);
        let Some(setup) = &mut self.setup else { return };
        let place = site.place_of(&self.name, self.identity.module);
        let placed = place.and_then(|module| Some((module, site.modules.get(module)?)));
        let upside_down = placed.is_some_and(|(_, placed)| placed.upside_down);
        self.profile.hang(upside_down);
        if let Some(monitor) = &mut self.monitor {
            monitor.hang(upside_down);
        }
        setup.beams = Beams::new(setup.geometry, upside_down);
        setup.view = placed.zip(setup.beams.as_ref()).map(|((module, placed), beams)| {
            let (pose, height_m, geometry) = (placed.pose(), placed.height_m, *beams.used());
            Arc::new(View { module, pose, height_m, geometry, upside_down })
        });
    }

    /// Finds out which floor of the site the device is, if it is one.
    fn stand(&mut self, site: &Site) {
        self.floor = match site.place_of_device(&self.name, self.identity.module) {
            Some(Place::Floor(number)) => site.floors.get(number).map(|floor| (number, Plan::from(floor))),
            Some(Place::Module(_)) | None => None,
        };
    }

    fn store_profile(&mut self, part: &ProfilePart<'_>) {
        let Some(setup) = &self.setup else { return };
        if part.head.setup == setup.number {
            self.profile.store(part, setup.geometry.beams());
        }
    }

    /// Whether the newest info describes what the newest report was measured with; before any report, whether there was
    /// an info at all.
    fn knows_setup(&self) -> bool {
        self.described.is_some_and(|described| self.current.is_none_or(|(setup, _)| setup == described))
    }

    /// What is to be asked for next.
    fn need(&self) -> Need {
        // A background means nothing while it is not known where the beams point.
        if !self.knows_setup() || self.changed.1 {
            return Need::Info;
        }
        let Some(version) = self.current.map(|(_, version)| version).filter(|&version| version != 0) else {
            return Need::Nothing;
        };
        self.profile.missing(version).map_or(Need::Nothing, |parts| Need::Profile { version, parts })
    }

    /// The device is silent, and looked for elsewhere: it is asked there at once, before another that answers in its place
    /// is taken for it.
    pub const fn look_elsewhere(&mut self) {
        self.subscription.renew_at_once();
    }

    /// Sends the device what is due at `now_us`.
    pub fn poll(&mut self, now_us: u64, send: impl FnMut(&[u8])) {
        let need = self.need();
        self.subscription.poll(now_us, self.identity, need, send);
    }

    /// When [`poll`](Self::poll) has something to send next, µs.
    #[must_use]
    pub fn next_us(&self) -> u64 {
        self.subscription.next_us(self.need())
    }

    /// Whether the host wants reports of this device, and so a place among its subscribers.
    pub const fn want_reports(&mut self, wants: bool) {
        self.subscription.want_reports(wants);
    }

    /// Whether the host wants reports of this device.
    #[must_use]
    pub const fn wants_reports(&self) -> bool {
        self.subscription.wants_reports()
    }

    /// How the device is at `now_us`, under the name and with the furniture that the site gives it; none while its health is not
    /// monitored.
    pub fn line(&mut self, name: &str, furniture: &[[f64; 2]], now_us: u64) -> Option<ModuleLine> {
        let monitor = self.monitor.as_mut()?;
        monitor.know_furniture(furniture);
        monitor.subscribe(self.subscription.wants_reports());
        let unused_us = (self.reports > 0).then(|| now_us.saturating_sub(self.used_us));
        let line = monitor.line(name, self.identity.module, Some(&self.clock), now_us);
        let unused_s = unused_us.map(|unused_us| unused_us as f64 * 1e-6);
        Some(ModuleLine { unused_s, firmware: self.firmware.clone(), ..line })
    }

    /// What an alarm is decided on, at the time of the last [`line`](Self::line); none where nothing is measured for it.
    #[must_use]
    pub fn condition(&self, kind: AlarmKind, now_us: u64) -> Option<AlarmCondition> {
        self.monitor.as_ref()?.condition(kind, Some(&self.clock), now_us)
    }

    /// Whether its device has been heard lately; false while its health is not monitored.
    #[must_use]
    pub fn is_heard(&self, now_us: u64) -> bool {
        self.monitor.as_ref().is_some_and(|monitor| monitor.is_heard(now_us))
    }

    /// Whether what it says is sealed with a key of the site.
    #[must_use]
    pub const fn is_sealed(&self) -> bool {
        self.is_sealed
    }

    /// The name the device gives itself; empty until the first info.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Range of the wall behind each beam, mm; 0 where there is none. Empty before the background is whole.
    #[must_use]
    pub const fn walls_mm(&self) -> &Arc<[u16]> {
        self.profile.walls_mm()
    }

    /// Up to which range each beam is empty when nothing stands before it, mm; none before the background is whole.
    #[must_use]
    pub fn empty_mm(&self) -> Option<&Arc<[u16]>> {
        self.profile.newest_empty_mm()
    }

    /// Up to which range a beam with nothing behind it is empty, mm; 0 before the device has said it.
    #[must_use]
    pub const fn open_range_mm(&self) -> u16 {
        self.profile.open_range_mm()
    }

    /// Where it is and where its beams point, if it is a module of the site.
    #[must_use]
    pub fn view(&self) -> Option<&View> {
        self.setup.as_ref()?.view.as_deref()
    }

    /// Where the beams point, after the first info with a sensor; of a module that hangs head down as from below.
    #[must_use]
    pub fn geometry(&self) -> Option<&Geometry> {
        Some(self.setup.as_ref()?.beams.as_ref()?.used())
    }

    /// The device's number in the site, if it has a place there.
    #[must_use]
    pub fn place_in_site(&self) -> Option<usize> {
        Some(self.setup.as_ref()?.view.as_ref()?.module)
    }

    /// The device's place in the site, a module's or a floor's.
    #[must_use]
    pub fn place_of_device(&self) -> Option<Place> {
        let floor = || self.floor.map(|(number, _)| Place::Floor(number));
        self.place_in_site().map(Place::Module).or_else(floor)
    }

    /// When the newest report came, µs on the host's clock.
    #[must_use]
    pub const fn last_report_us(&self) -> u64 {
        self.last_report_us
    }

    /// Reports used.
    #[must_use]
    pub const fn reports(&self) -> u64 {
        self.reports
    }
}

#[cfg(test)]
mod tests;
