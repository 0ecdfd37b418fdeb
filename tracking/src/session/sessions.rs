//! The sessions with all devices, and the only way in for what they send.
//!
//! ```text
//!   bytes ─▶ decode, once ─▶ Datagram ─▶ admit ─▶ accept ─▶ the device's session ─▶ Observation
//!                                        live only          two with one place: neither is used
//! ```

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use kehai::centre::Estimator;
use kehai::wire::{Message, ModuleId};

use super::datagram::Datagram;
use super::start::Refusal;
use super::{Input, Placement, Session, Subscription};
use crate::alarm::{AlarmKind, AlarmLine};
use crate::observation::Observation;
use crate::site::{Place, Site};
use crate::snapshot::Drops;

/// Sessions beside those of a site's devices and their replacements: a network's other devices.
const OTHERS: usize = 64;

/// The sessions with all devices.
#[derive(Debug)]
pub struct Sessions {
    placement: Placement,
    sessions: BTreeMap<ModuleId, Session>,
    drops: Drops,
    decoded: u64,
    /// Sessions that were given up for newer ones.
    forgotten: u64,
    /// Whether two sessions have the same place.
    shared: bool,
}

impl Sessions {
    /// For the devices of a site.
    #[must_use]
    pub fn new(site: Arc<Site>, estimator: Estimator) -> Self {
        let placement = Placement { site, estimator };
        let (sessions, drops) = (BTreeMap::new(), Drops::default());
        Self { placement, sessions, drops, decoded: 0, forgotten: 0, shared: false }
    }

    /// Goes on with another site: every device takes its place there.
    pub fn change_site(&mut self, site: Arc<Site>) {
        for session in self.sessions.values_mut() {
            session.place(&site);
        }
        self.placement.site = site;
        self.compare_places();
    }

    /// Notes whether any two have the same place: with each report it is looked at which, then.
    fn compare_places(&mut self) {
        let mut places: Vec<Place> = self.sessions.values().filter_map(Session::place_of_device).collect();
        places.sort_unstable();
        self.shared = places.windows(2).any(|pair| pair.first() == pair.last());
    }

    /// Another device with the name and the place of this one, because of which this one is not used. It is a rival while it
    /// answers: the tracker cannot know which of the two stands where the site says. A device that does not answer is no
    /// rival. But any device can claim a name: one without a key is no rival of one that has a key. The one with the key keeps
    /// its place even while it is silent.
    #[must_use]
    pub fn rival(&self, device: ModuleId, now_us: u64) -> Option<ModuleId> {
        if !self.shared {
            return None;
        }
        let own = self.get(device)?;
        let place = own.place_of_device()?;
        let is_rival = |other: &Session| match (own.is_sealed(), other.is_sealed()) {
            (true, false) => false,
            (false, true) => true,
            (true, true) | (false, false) => other.is_answering(now_us),
        };
        let mut others = self.sessions.iter().filter(|(id, _)| **id != device);
        others.find(|(_, other)| other.place_of_device() == Some(place) && is_rival(other)).map(|(id, _)| *id)
    }

    /// The alarm about a device that answers and has a [rival](Self::rival).
    #[must_use]
    pub fn alarm(&self, device: ModuleId, now_us: u64) -> Option<AlarmLine> {
        let rival = self.rival(device, now_us)?;
        let own = self.get(device).filter(|session| session.is_answering(now_us))?;
        let (name, is_sealed) = (own.name(), self.get(rival)?.is_sealed());
        let who = format!("{device} and {rival} both are \"{name}\"");
        let text = if is_sealed && !own.is_sealed() {
            format!(
                "{who}, and this one, which has no key, is not used: switch it off, or give it another name"
            )
        } else {
            format!(
                "{who}, and neither is used: switch one off, or give it another name with kehai-tracker module set"
            )
        };
        Some(AlarmLine::new(AlarmKind::SameName, text))
    }

    /// Whether a datagram of a device that arrived at `now_us` is to be used: see [`Session::admit`]. It is counted if not.
    pub fn admit(&mut self, datagram: &Datagram<'_>, now_us: u64) -> bool {
        let Some(session) = self.sessions.get_mut(&datagram.device()) else { return false };
        match session.admit(datagram, now_us) {
            Ok(()) => return true,
            Err(Refusal::StaleBoot) => self.drops.stale_boot += 1,
            Err(Refusal::Unasked) => self.drops.unasked += 1,
        }
        false
    }

    /// A device answers at another address than before: see [`Session::note_new_address`]. A replay of the same datagrams
    /// has to call this, too, as they do not say where they came from.
    pub fn note_new_address(&mut self, device: ModuleId, now_us: u64) {
        if let Some(session) = self.get_mut(device) {
            session.note_new_address(now_us);
        }
    }

    /// A datagram came in the name of a device that answers at another address.
    pub const fn refuse_foreign(&mut self) {
        self.drops.foreign += 1;
    }

    /// An answer came to nothing that was asked.
    pub const fn refuse_unasked(&mut self) {
        self.drops.unasked += 1;
    }

    /// Makes room for one session more: of those without a place the one that has answered least lately goes, those with a key
    /// last; of all, if every one has a place.
    fn make_room(&mut self) {
        let most = 2 * self.placement.site.places().count() + OTHERS;
        while self.sessions.len() >= most {
            let least = |(_, session): &(&ModuleId, &Session)| {
                (session.place_of_device().is_some(), session.is_sealed(), session.answered_us())
            };
            let Some(device) = self.sessions.iter().min_by_key(least).map(|(device, _)| *device) else {
                return;
            };
            self.sessions.remove(&device);
            self.forgotten += 1;
        }
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
        self.accept(&datagram, now_us)?.scan()
    }

    /// What a datagram that is decoded already says of people.
    pub fn accept(&mut self, datagram: &Datagram<'_>, now_us: u64) -> Option<Input> {
        let device = datagram.device();
        if !self.sessions.contains_key(&device) {
            self.make_room();
        }
        let session =
            self.sessions.entry(device).or_insert_with(|| Session::new(device, Subscription::default()));
        let input = session.receive(datagram, now_us, &self.placement, &mut self.drops);
        if let Message::Info(_) = datagram.message {
            self.compare_places();
        }
        if input.is_some() && self.rival(device, now_us).is_some() {
            self.drops.same_name += 1;
            return None;
        }
        if input.is_some()
            && let Some(session) = self.sessions.get_mut(&device)
        {
            session.count_used(now_us);
        }
        input
    }

    /// Monitors the health of a device from `now_us` on. Its session goes on, or begins with the requests of
    /// `subscription`.
    pub fn meet(&mut self, device: ModuleId, subscription: &Subscription, now_us: u64) {
        match self.sessions.get_mut(&device) {
            Some(session) => session.adopt(subscription),
            None => self.make_room(),
        }
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

    /// The same without devices that have no key, and the place of one that has.
    pub fn in_place(&self) -> impl Iterator<Item = &Session> {
        let sealed = self.iter().filter(|session| self.shared && session.is_sealed());
        let taken: BTreeSet<Place> = sealed.filter_map(Session::place_of_device).collect();
        let has_lost = move |session: &Session| {
            !session.is_sealed() && session.place_of_device().is_some_and(|place| taken.contains(&place))
        };
        self.iter().filter(move |session| !has_lost(session))
    }

    /// What was not used, by cause.
    #[must_use]
    pub const fn drops(&self) -> &Drops {
        &self.drops
    }

    /// The same, for what is dropped before it is decoded.
    pub const fn drops_mut(&mut self) -> &mut Drops {
        &mut self.drops
    }

    /// Sessions that were given up for newer ones.
    #[must_use]
    pub const fn forgotten(&self) -> u64 {
        self.forgotten
    }

    /// How often something was decoded.
    #[must_use]
    pub const fn decoded(&self) -> u64 {
        self.decoded
    }
}
