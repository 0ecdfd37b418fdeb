//! Which devices there are: at given addresses and found on the network, how each is reached, and how each is.
//!
//! ```text
//!   --module ADDRESS ─▶ route ─▶ subscribes
//!   found ────────────▶ route ─▶ asks which device it is ─▶ placed in the site? ─▶ subscribes
//!                         │
//!                         ╰─ first answer ─▶ session, by identity ─▶ ModuleLine
//! ```
//!
//! A device has four places for subscribers: one that belongs to another site keeps them. It does no I/O.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::Arc;

use kehai::wire::{Identity, ModuleId};

use crate::net::discovery::{Finding, Found};
use kehai_tracking::observation::Observation;
use kehai_tracking::session::Sessions;
use kehai_tracking::session::datagram::Datagram;
use kehai_tracking::session::health::Monitor;
use kehai_tracking::session::subscription::{Need, Subscription};
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{DeviceState, ModuleLine};

/// After so long without an answer an address is given up for the next one, µs.
const NEXT_US: u64 = 3_000_000;

/// An observation older than this no longer shows what the device sees, s.
const OLD_S: f64 = 1.0;

/// Most corners of what a device sees, the device's own place left out: one for each 2° of a whole turn.
const CORNERS: usize = 180;

/// A way to a device.
#[derive(Debug)]
struct Route {
    /// Where the device may be, and where it is now looked for.
    addresses: Vec<SocketAddr>,
    at: usize,
    /// When something came from there, or the device was looked for elsewhere.
    tried_us: u64,
    device: Device,
    given: bool,
    /// Its instance name, and whether that is gone.
    instance: String,
    lost: bool,
}

/// The device at the end of a route.
#[derive(Debug)]
enum Device {
    /// It has not answered yet.
    Unknown(Subscription),
    /// It has: its session sends the requests.
    Known(ModuleId),
}

impl Route {
    fn new(addresses: Vec<SocketAddr>, given: bool, now_us: u64) -> Self {
        let device = Device::Unknown(Subscription::new(given));
        let instance = String::new();
        Self { addresses, at: 0, tried_us: now_us, device, given, instance, lost: false }
    }

    fn address(&self) -> Option<SocketAddr> {
        self.addresses.get(self.at).copied()
    }

    const fn device(&self) -> Option<ModuleId> {
        match self.device {
            Device::Unknown(_) => None,
            Device::Known(device) => Some(device),
        }
    }

    fn leads_to(&self, device: ModuleId) -> bool {
        self.device() == Some(device)
    }

    /// Whether this route is that of what was found.
    fn is(&self, found: &Found) -> bool {
        let there = self.address().is_some_and(|address| found.addresses.contains(&address));
        self.leads_to(found.id) || there || (!self.instance.is_empty() && self.instance == found.instance)
    }
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
    routes: Vec<Route>,
    answered: BTreeMap<ModuleId, Answered>,
    /// Devices of the site that have never answered, by name, and since when they are missing, µs.
    missing: BTreeMap<String, u64>,
}

impl Registry {
    /// Those at `given` addresses.
    #[must_use]
    pub fn new(site: Arc<Site>, given: &[SocketAddr]) -> Self {
        let routes = given.iter().map(|&address| Route::new(vec![address], true, 0)).collect();
        Self { site, routes, answered: BTreeMap::new(), missing: BTreeMap::new() }
    }

    /// Goes on with another site: devices that are placed there now are subscribed to.
    pub fn change_site(&mut self, site: &Arc<Site>, sessions: &mut Sessions) {
        self.site = Arc::clone(site);
        for route in &self.routes {
            if let Some(device) = route.device()
                && let Some(session) = sessions.get_mut(device)
            {
                let placed = site.place_of(session.name(), device).is_some();
                session.want_reports(route.given || placed);
            }
        }
    }

    /// The site that devices are placed in.
    #[must_use]
    pub fn site(&self) -> &Site {
        &self.site
    }

    /// A device was found on the network, or is gone from it.
    pub fn find(&mut self, finding: Finding, now_us: u64) {
        let found = match finding {
            Finding::Found(found) => found,
            Finding::Lost(instance) => {
                let lost = self.routes.iter_mut().filter(|route| route.instance == instance);
                return lost.for_each(|route| route.lost = true);
            }
        };
        if let Some(route) = self.routes.iter_mut().find(|route| route.is(&found)) {
            (route.instance, route.lost) = (found.instance, false);
            if !route.given {
                let at = route.address().and_then(|now| found.addresses.iter().position(|new| *new == now));
                (route.addresses, route.at) = (found.addresses, at.unwrap_or(0));
            }
            return;
        }
        let mut route = Route::new(found.addresses, false, now_us);
        route.instance = found.instance;
        self.routes.push(route);
    }

    /// Sends what is due.
    pub fn poll(&mut self, sessions: &mut Sessions, now_us: u64, mut send: impl FnMut(&[u8], SocketAddr)) {
        let is_worth =
            |route: &Route| route.given || !route.lost || now_us.saturating_sub(route.tried_us) < NEXT_US;
        self.routes.retain(is_worth);
        for route in &mut self.routes {
            if route.addresses.len() > 1 && now_us.saturating_sub(route.tried_us) >= NEXT_US {
                (route.at, route.tried_us) = ((route.at + 1) % route.addresses.len(), now_us);
            }
            let Some(address) = route.address() else { continue };
            let send = |datagram: &[u8]| send(datagram, address);
            match &mut route.device {
                Device::Unknown(subscription) => {
                    subscription.poll(now_us, Identity::default(), Need::Nothing, send);
                }
                Device::Known(device) => {
                    if let Some(session) = sessions.get_mut(*device) {
                        session.poll(now_us, send);
                    }
                }
            }
        }
    }

    /// Whether a device is looked for at this address.
    #[must_use]
    pub fn knows(&self, address: SocketAddr) -> bool {
        self.routes.iter().any(|route| route.address() == Some(address))
    }

    /// A datagram has come from an address that is [known](Self::knows): from now on its device has a session.
    pub fn meet(&mut self, from: SocketAddr, device: ModuleId, sessions: &mut Sessions, now_us: u64) {
        let Some(index) = self.routes.iter().position(|route| route.address() == Some(from)) else { return };
        let Device::Unknown(subscription) = &self.routes[index].device else { return };
        sessions.meet(device, subscription, now_us);
        let other = self.routes.iter().position(|route| route.leads_to(device));
        self.routes[index].device = Device::Known(device);
        let Some(other) = other else { return };
        // Of two ways to the same device one is enough, and a given one is the better. A second given address is kept
        // for the time when the first no longer answers.
        let (kept, dropped) = match (self.routes[other].given, self.routes[index].given) {
            (true, true) => {
                self.routes[other].addresses.push(from);
                (other, index)
            }
            (true, false) => (other, index),
            (false, _) => (index, other),
        };
        self.routes[kept].lost = false;
        self.routes.remove(dropped);
    }

    /// A datagram of a device that has been [met](Self::meet) was used, with this observation if it was a report: sends
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
        route.tried_us = now_us;
        let answered = self.answered.entry(device).or_insert(Answered { address: from, newest: None });
        answered.address = from;
        answered.newest = observation.or(answered.newest.take());
        session.want_reports(route.given || self.site.place_of(session.name(), device).is_some());
        session.poll(now_us, |datagram| send(datagram, from));
    }

    /// How every device is at `now_us`: those of the site in its order, then the others.
    pub fn lines(&mut self, sessions: &mut Sessions, now_us: u64) -> Vec<ModuleLine> {
        let Self { site, routes, answered, missing } = self;
        // A device that is neither in the site nor there any more is forgotten.
        answered.retain(|&device, _| {
            let name = sessions.get(device).map_or("", |session| session.name());
            let stays =
                site.place_of(name, device).is_some() || routes.iter().any(|route| route.leads_to(device));
            if !stays {
                sessions.part(device);
            }
            stays
        });
        let mut placed: BTreeMap<usize, ModuleLine> = BTreeMap::new();
        let mut others = Vec::new();
        for (&device, answered) in answered {
            let Some(session) = sessions.get_mut(device) else { continue };
            let place = site.place_of(session.name(), device);
            let name = place.and_then(|place| site.modules.get(place)).map(|module| module.name.clone());
            let name = name.unwrap_or_else(|| session.name().to_owned());
            let subscribed = session.wants_reports();
            let Some(mut line) = session.line(&name, now_us) else { continue };
            line.address = answered.address.to_string();
            show_view(&mut line, answered.newest.as_ref(), now_us);
            if line.state != DeviceState::Missing && !subscribed {
                line.state = DeviceState::Found;
            }
            match place {
                Some(place) if !placed.contains_key(&place) => drop(placed.insert(place, line)),
                _ => others.push(line),
            }
        }
        missing.retain(|name, _| site.modules.iter().any(|module| module.name == *name));
        for (place, module) in site.modules.iter().enumerate() {
            if placed.contains_key(&place) {
                missing.remove(&module.name);
                continue;
            }
            let since_us = *missing.entry(module.name.clone()).or_insert(now_us);
            placed.insert(place, silent(&module.name, since_us, now_us));
        }
        for route in routes.iter().filter(|route| route.given && route.device().is_none()) {
            let Some(address) = route.address() else { continue };
            let name = address.to_string();
            let line = silent(&name, 0, now_us);
            others.push(ModuleLine { address: name, ..line });
        }
        placed.into_values().chain(others).collect()
    }
}

/// How a device is that has never answered since `since_us`.
fn silent(name: &str, since_us: u64, now_us: u64) -> ModuleLine {
    Monitor::new(since_us).line(name, ModuleId::ANY, None, now_us)
}

/// What a device sees and what it cannot judge, from its newest observation.
fn show_view(line: &mut ModuleLine, newest: Option<&Observation>, now_us: u64) {
    let Some(observation) = newest.filter(|newest| now_us as f64 * 1e-6 - newest.start_s < OLD_S) else {
        return;
    };
    let beams = observation.background_mm.len().max(1);
    let unlearned = observation.background_mm.iter().filter(|range_mm| **range_mm == 0).count();
    line.unknown_share = (line.unknown_share + unlearned as f64 / beams as f64).min(1.0);
    let view = &observation.view;
    let each = observation.empty_mm.len().div_ceil(CORNERS).max(1);
    let corner = |(index, ranges_mm): (usize, &[u16])| {
        let beam = u16::try_from(index * each + ranges_mm.len() / 2).unwrap_or(u16::MAX);
        let range_m = f64::from(ranges_mm.iter().copied().min().unwrap_or(0)) * 1e-3;
        let at = view.place(f64::from(view.geometry.bearing_rad(beam)), range_m);
        [cm(at.x), cm(at.y)]
    };
    line.free = vec![[cm(view.pose.at.x), cm(view.pose.at.y)]];
    line.free.extend(observation.empty_mm.chunks(each).enumerate().map(corner));
}

fn cm(value_m: f64) -> f64 {
    (value_m * 100.0).round() / 100.0
}
