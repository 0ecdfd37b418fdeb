//! Which devices there are: at given addresses and found on the network, how each is reached, and how each is.
//!
//! ```text
//!   --module ADDRESS ─▶ route ─▶ subscribes
//!   found ────────────▶ route ─▶ asks which device it is ─▶ placed in the site? ─▶ subscribes
//!                         │
//!                         ╰─ first answer ─▶ session, by identity ─▶ ModuleLine
//!
//!   datagram from a route's address ─▶ in the name of its device ──────────────▶ that start believed? ─▶ used
//!                                      in another's ─▶ the device silent for 3 s,
//!                                                      and a request answered? ─▶ the route is the other's
//!                                                      else refused, counted
//! ```
//!
//! What a route's device says of itself is not asked: a route is that device's which answers the requests sent there. An
//! announcement only adds addresses to try once the device has been silent for three seconds.
//!
//! A device has four places for subscribers: one that belongs to another site keeps them. It does no I/O.

mod found;
mod lines;
mod networks;
mod route;

use std::collections::BTreeMap;
use std::hash::{BuildHasher, RandomState};
use std::net::SocketAddr;
use std::sync::Arc;

use kehai::wire::{Identity, ModuleId};

use crate::observation::Observation;
use crate::session::Sessions;
use crate::session::datagram::Datagram;
use crate::session::outstanding::Kind;
use crate::session::subscription::{Need, Subscription};
use crate::site::Site;
use crate::snapshot::Refused;
pub use found::{Finding, Found};
pub use networks::Networks;
use route::{Device, NEXT_US, Route};

/// Most devices that are looked for: those of a site of 500, which one core follows (docs/design.md), as many again that replace
/// them or are no part of it, and some more. Each takes less than a kilobyte. Given ones are not counted out.
pub(crate) const PEERS: usize = 1024;

/// What becomes of a datagram from an address that is known.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Admission {
    /// It is to be used.
    pub is_used: bool,
    /// Its device answers at another address than before, and its times were forgotten for that. So they must be by all
    /// who follow what was used.
    pub is_elsewhere: bool,
}

/// A device that has answered.
#[derive(Debug)]
struct Answered {
    address: SocketAddr,
    newest: Option<Observation>,
}

/// All devices.
#[derive(Debug)]
pub struct Registry {
    site: Arc<Site>,
    /// Addresses at which there are devices, as said at the start.
    given: Vec<SocketAddr>,
    routes: Vec<Route>,
    /// Makes request ids that cannot be guessed.
    random: RandomState,
    routed: u64,
    refused: Refused,
    answered: BTreeMap<ModuleId, Answered>,
    /// Devices of the site that have never answered, by name, and since when they are missing, µs.
    missing: BTreeMap<String, u64>,
}

impl Registry {
    /// Those at `given` addresses.
    #[must_use]
    pub fn new(site: Arc<Site>, given: &[SocketAddr]) -> Self {
        let (routes, random) = (Vec::new(), RandomState::new());
        let (answered, missing, refused) = (BTreeMap::new(), BTreeMap::new(), Refused::default());
        let given_here = given.to_vec();
        let mut registry =
            Self { site, given: given_here, routes, random, routed: 0, refused, answered, missing };
        for &address in given {
            let route = registry.route(vec![address], true, 0);
            registry.routes.push(route);
        }
        registry
    }

    fn route(&mut self, addresses: Vec<SocketAddr>, given: bool, now_us: u64) -> Route {
        self.routed += 1;
        Route::new(addresses, given, self.random.hash_one(self.routed), now_us)
    }

    /// Goes on with another site: devices that are placed there now are subscribed to.
    pub fn change_site(&mut self, site: &Arc<Site>, sessions: &mut Sessions) {
        self.site = Arc::clone(site);
        for route in &self.routes {
            if let Some(device) = route.device()
                && let Some(session) = sessions.get_mut(device)
            {
                let placed = site.place_of_device(session.name(), device).is_some();
                session.want_reports(route.given || placed);
            }
        }
    }

    /// The site that devices are placed in.
    #[must_use]
    pub fn site(&self) -> &Site {
        &self.site
    }

    /// Announced devices that were not asked, since the start.
    #[must_use]
    pub const fn refused(&self) -> Refused {
        self.refused
    }

    /// A device was found on one of these networks, or is gone from it.
    pub fn find(&mut self, finding: Finding, networks: &Networks, now_us: u64) {
        let mut found = match finding {
            Finding::Found(found) => found,
            Finding::Lost(instance) => {
                let lost = self.routes.iter_mut().filter(|route| route.instance == instance);
                return lost.for_each(|route| route.lost = true);
            }
        };
        let announced = found.addresses.len();
        found.addresses.retain(|address| networks.hold(*address));
        self.refused.outside += (announced - found.addresses.len()) as u64;
        if found.addresses.is_empty() {
            return;
        }
        if let Some(route) = self.routes.iter_mut().find(|route| route.is(&found)) {
            route.lost = false;
            if route.instance.is_empty() || !route.is_answering(now_us) {
                route.instance = found.instance;
            }
            if !route.given {
                route.announce(found.addresses);
            }
            return;
        }
        if self.routes.len() >= PEERS {
            self.refused.crowded += 1;
            let is_idle = |route: &Route| !route.given && route.device().is_none();
            let Some(oldest) = self.routes.iter().position(is_idle) else { return };
            self.routes.remove(oldest);
        }
        let mut route = self.route(found.addresses, false, now_us);
        route.instance = found.instance;
        self.routes.push(route);
    }

    /// Sends what is due.
    pub fn poll(&mut self, sessions: &mut Sessions, now_us: u64, mut send: impl FnMut(&[u8], SocketAddr)) {
        let is_worth =
            |route: &Route| route.given || !route.lost || now_us.saturating_sub(route.tried_us) < NEXT_US;
        self.routes.retain(is_worth);
        self.part(now_us);
        let Self { routes, random, routed, .. } = self;
        for route in routes {
            let device = match &mut route.device {
                Device::Known(device) => *device,
                Device::Unknown(subscription) => {
                    let addresses = &route.addresses;
                    let all = |datagram: &[u8]| addresses.iter().for_each(|address| send(datagram, *address));
                    subscription.poll(now_us, Identity::default(), Need::Nothing, all);
                    continue;
                }
            };
            if route.addresses.len() > 1 && now_us.saturating_sub(route.tried_us) >= NEXT_US {
                (route.at, route.tried_us) = ((route.at + 1) % route.addresses.len(), now_us);
                route.proven = false;
            }
            let asked = route.asked();
            match sessions.get_mut(device) {
                Some(session) => {
                    let all = |datagram: &[u8]| asked.clone().for_each(|address| send(datagram, address));
                    session.poll(now_us, all);
                }
                // There was no room for it among the sessions.
                None => {
                    *routed += 1;
                    route.device = Device::unknown(route.given, random.hash_one(*routed));
                }
            }
        }
    }

    /// Asks anew at given addresses whose device answers elsewhere: by now another may be there.
    fn part(&mut self, now_us: u64) {
        for index in 0..self.routes.len() {
            let Some(route) = self.routes.get_mut(index).filter(|route| route.is_due(now_us)) else {
                continue;
            };
            route.asked_us = now_us;
            for address in route.part(&self.given) {
                let route = self.route(vec![address], true, now_us);
                self.routes.push(route);
            }
        }
    }

    /// Whether a device is looked for at this address.
    #[must_use]
    pub fn knows(&self, address: SocketAddr) -> bool {
        self.routes.iter().any(|route| route.place_of(address).is_some())
    }

    /// The route that leads to an address; before all others the one that is there now.
    fn index_of(&self, from: SocketAddr) -> Option<usize> {
        let is_there = |route: &Route| route.address() == Some(from);
        let may_be = |route: &Route| route.place_of(from).is_some();
        self.routes.iter().position(is_there).or_else(|| self.routes.iter().position(may_be))
    }

    /// Whether a datagram that has come from an address that is [known](Self::knows) is to be used. What is not is counted.
    /// A device that answers there for the first time has a session from now on.
    pub fn admit(
        &mut self,
        from: SocketAddr,
        datagram: &Datagram<'_>,
        sessions: &mut Sessions,
        now_us: u64,
    ) -> Admission {
        let refused = Admission::default();
        let (device, message) = (datagram.device(), &datagram.message);
        let Some(mut index) = self.index_of(from) else { return refused };
        let route = &self.routes[index];
        if let Device::Known(other) = route.device
            && other != device
        {
            let asked = sessions.get(other).filter(|session| session.kind(message, now_us) == Kind::Answer);
            let is_at = route.address() == Some(from) && !route.is_answering(now_us);
            let Some(session) = asked.filter(|_| is_at) else {
                sessions.refuse_foreign();
                return refused;
            };
            let Some(left) = self.leave(index, from, session.subscription(), now_us) else {
                sessions.refuse_foreign();
                return refused;
            };
            index = left;
            if let Some(session) = sessions.get_mut(other) {
                session.look_elsewhere();
            }
        }
        if let Device::Unknown(subscription) = &self.routes[index].device {
            if subscription.kind(message, now_us) != Kind::Answer {
                sessions.refuse_unasked();
                return refused;
            }
            let subscription = subscription.clone();
            let route = &mut self.routes[index];
            route.at = route.place_of(from).unwrap_or(route.at);
            if !self.meet(index, from, device, now_us) {
                sessions.refuse_foreign();
                return refused;
            }
            sessions.meet(device, &subscription, now_us);
        }
        let kind = sessions.get(device).map_or(Kind::Unasked, |session| session.kind(message, now_us));
        // It was looked for elsewhere, and answers where it did last.
        let is_home = |route: &&mut Route| route.leads_to(device) && route.home == Some(from);
        if kind == Kind::Answer
            && let Some(route) = self.routes.iter_mut().find(is_home)
        {
            route.at = route.place_of(from).unwrap_or(route.at);
        }
        let Some(route) = self.routes.iter_mut().find(|route| route.address() == Some(from)) else {
            return refused;
        };
        let mut is_elsewhere = false;
        if kind == Kind::Answer {
            let before = self.answered.get(&device).map(|answered| answered.address);
            is_elsewhere = before.is_some_and(|before| before != from);
            if is_elsewhere {
                sessions.note_new_address(device, now_us);
            }
            (route.tried_us, route.answered_us, route.proven) = (now_us, Some(now_us), true);
            route.home = Some(from);
        }
        if !route.proven {
            sessions.refuse_foreign();
            return refused;
        }
        Admission { is_used: sessions.admit(datagram, now_us), is_elsewhere }
    }

    /// Another device is at this address now. The route's own is looked for at its other addresses, if it has any, and
    /// this address is another route's: its number; none if there is one already.
    fn leave(
        &mut self,
        index: usize,
        from: SocketAddr,
        subscription: &Subscription,
        now_us: u64,
    ) -> Option<usize> {
        let is_full = self.routes.len() >= PEERS;
        let route = &mut self.routes[index];
        let device = Device::Unknown(subscription.clone());
        if route.addresses.len() < 2 || is_full {
            route.device = device;
            return Some(index);
        }
        route.addresses.remove(route.at);
        (route.at, route.tried_us, route.proven) = (route.at % route.addresses.len(), now_us, false);
        let given = route.given;
        if self.knows(from) {
            return None;
        }
        self.routes.push(Route { device, ..Route::new(vec![from], given, 0, now_us) });
        Some(self.routes.len() - 1)
    }

    /// Binds a route to the device that has answered there; false if that device is heard elsewhere.
    fn meet(&mut self, index: usize, from: SocketAddr, device: ModuleId, now_us: u64) -> bool {
        let other = self.routes.iter().position(|route| route.leads_to(device));
        let Some(other) = other else {
            self.routes[index].device = Device::Known(device);
            return true;
        };
        // Of two ways to the same device one is enough, and a given one is the better. A second given address is kept
        // for the time when the first no longer answers.
        let (kept, dropped) = match (self.routes[other].given, self.routes[index].given) {
            (true, true) => {
                self.routes[other].addresses.push(from);
                self.routes.remove(index);
                return false;
            }
            (true, false) => {
                self.routes.remove(index);
                return false;
            }
            (false, _) if self.routes[other].is_answering(now_us) => return false,
            (false, _) => (index, other),
        };
        // What has answered here may be another in its name: its own addresses are not forgotten.
        let addresses = std::mem::take(&mut self.routes[dropped].addresses);
        let route = &mut self.routes[kept];
        (route.device, route.lost) = (Device::Known(device), false);
        route.also(addresses);
        self.routes.remove(dropped);
        true
    }

    /// A datagram of a device that was [admitted](Self::admit) was used, with this observation if it was a report: sends
    /// what is to be answered.
    pub fn heard(
        &mut self,
        from: SocketAddr,
        datagram: &Datagram<'_>,
        observation: Option<Observation>,
        sessions: &mut Sessions,
        now_us: u64,
        mut send: impl FnMut(&[u8], SocketAddr),
    ) {
        let device = datagram.device();
        let here = |route: &&mut Route| route.address() == Some(from) && route.leads_to(device);
        let Some(route) = self.routes.iter_mut().find(here) else { return };
        let Some(session) = sessions.get_mut(device) else { return };
        let answered = self.answered.entry(device).or_insert(Answered { address: from, newest: None });
        answered.address = from;
        answered.newest = observation.or(answered.newest.take());
        session.want_reports(route.given || self.site.place_of_device(session.name(), device).is_some());
        session.poll(now_us, |datagram| send(datagram, from));
    }
}

#[cfg(test)]
mod tests;
