//! Who is there: the modules at given addresses and those found on the network, the conversation with each, and
//! how each one is.
//!
//! ```text
//!   --module ADDRESS ─▶ peer ─▶ subscribes
//!   found ────────────▶ peer ─▶ asks who it is ─▶ placed in the site? ─▶ subscribes
//!                        │
//!                        ╰─ datagrams ─▶ watch, by identity ─▶ ModuleLine
//! ```
//!
//! A module has four places for subscribers: one that belongs to somebody else's site keeps them. It does no I/O.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::Arc;

use kehai::wire::ModuleId;

use crate::calibrate::watch::PoseWatch;
use crate::calibrate::words;
use crate::conversation::Conversation;
use crate::discovery::{Finding, Found};
use crate::frame::{AlarmLine, ModuleLine};
use crate::health::Watch;
use crate::intake::Intake;
use crate::sighting::Sighting;
use crate::site::Site;

/// An address that does not answer for so long is given up for the next one, µs.
const NEXT_US: u64 = 3_000_000;

/// A sighting older than this shows no longer what the module sees, s.
const OLD_S: f64 = 1.0;

/// Most corners of what a module sees, the module's own place left out: one for each 2° of a whole turn.
const CORNERS: usize = 180;

/// Somebody to talk to.
#[derive(Debug)]
struct Peer {
    /// Where it may be, and where it is now looked for.
    addresses: Vec<SocketAddr>,
    at: usize,
    /// When it was last heard of, or looked for elsewhere.
    tried_us: u64,
    heard: bool,
    conversation: Conversation,
    given: bool,
    /// Its instance name, and whether that is gone.
    instance: String,
    lost: bool,
}

impl Peer {
    fn new(addresses: Vec<SocketAddr>, given: bool, now_us: u64) -> Self {
        let mut conversation = Conversation::new(ModuleId::ANY);
        conversation.subscribes(given);
        let instance = String::new();
        Self { addresses, at: 0, tried_us: now_us, heard: false, conversation, given, instance, lost: false }
    }

    fn address(&self) -> Option<SocketAddr> {
        self.addresses.get(self.at).copied()
    }

    const fn id(&self) -> ModuleId {
        self.conversation.module()
    }
}

/// A module that has answered.
#[derive(Debug)]
struct Known {
    watch: Watch,
    address: SocketAddr,
    newest: Option<Sighting>,
}

/// Everybody.
#[derive(Debug)]
pub struct Peers {
    site: Arc<Site>,
    peers: Vec<Peer>,
    known: BTreeMap<ModuleId, Known>,
    /// Modules of the site that have never answered, by name.
    missing: BTreeMap<String, Watch>,
    /// Whether modules are still where the site says.
    poses: PoseWatch,
}

impl Peers {
    /// Those at `given` addresses.
    #[must_use]
    pub fn new(site: Arc<Site>, given: &[SocketAddr]) -> Self {
        let peers = given.iter().map(|&address| Peer::new(vec![address], true, 0)).collect();
        let poses = PoseWatch::new(&site);
        Self { site, peers, known: BTreeMap::new(), missing: BTreeMap::new(), poses }
    }

    /// Goes on with another site: who is placed there now is subscribed to.
    pub fn change_site(&mut self, site: &Arc<Site>) {
        self.site = Arc::clone(site);
        self.poses = PoseWatch::new(site);
        for peer in &mut self.peers {
            let id = peer.id();
            let name = self.known.get(&id).map_or("", |known| known.watch.name());
            peer.conversation.subscribes(peer.given || site.place_of(name, id).is_some());
        }
    }

    /// What the site calls its module of this number.
    #[must_use]
    pub fn name(&self, module: usize) -> &str {
        self.site.modules.get(module).map_or("", |module| &module.name)
    }

    /// Somebody was found on the network, or is gone from it.
    pub fn find(&mut self, finding: Finding, now_us: u64) {
        let found = match finding {
            Finding::Found(found) => found,
            Finding::Lost(instance) => {
                let lost = self.peers.iter_mut().filter(|peer| peer.instance == instance);
                return lost.for_each(|peer| peer.lost = true);
            }
        };
        if let Some(peer) = self.peers.iter_mut().find(|peer| is(peer, &found)) {
            (peer.instance, peer.lost) = (found.instance, false);
            if !peer.given {
                let at = peer.address().and_then(|now| found.addresses.iter().position(|new| *new == now));
                (peer.addresses, peer.at) = (found.addresses, at.unwrap_or(0));
            }
            return;
        }
        let mut peer = Peer::new(found.addresses, false, now_us);
        peer.instance = found.instance;
        self.peers.push(peer);
    }

    /// Does what is due.
    pub fn poll(&mut self, now_us: u64, mut send: impl FnMut(&[u8], SocketAddr)) {
        self.peers.retain(|peer| peer.given || !peer.lost || now_us.saturating_sub(peer.tried_us) < NEXT_US);
        for peer in &mut self.peers {
            if peer.addresses.len() > 1 && now_us.saturating_sub(peer.tried_us) >= NEXT_US {
                (peer.at, peer.tried_us) = ((peer.at + 1) % peer.addresses.len(), now_us);
            }
            let Some(address) = peer.address() else { continue };
            peer.conversation.poll(now_us, |datagram| send(datagram, address));
        }
    }

    /// Whether a module is looked for at this address.
    #[must_use]
    pub fn knows(&self, address: SocketAddr) -> bool {
        self.peers.iter().any(|peer| peer.address() == Some(address))
    }

    /// Takes a datagram of a module that is [known](Self::knows), and what was seen by it.
    pub fn receive(
        &mut self,
        from: SocketAddr,
        datagram: &[u8],
        sighting: Option<Sighting>,
        now_us: u64,
        mut send: impl FnMut(&[u8], SocketAddr),
    ) {
        let Some(peer) = self.peers.iter_mut().find(|peer| peer.address() == Some(from)) else { return };
        let before = peer.id();
        peer.conversation.receive(now_us, datagram, |datagram| send(datagram, from));
        let (id, given) = (peer.id(), peer.given);
        if id == ModuleId::ANY {
            return;
        }
        (peer.tried_us, peer.heard) = (now_us, true);
        let fresh = || Known { watch: Watch::new(now_us), address: from, newest: None };
        let known = self.known.entry(id).or_insert_with(fresh);
        known.address = from;
        known.watch.receive(datagram, now_us);
        if let Some(sighting) = &sighting {
            self.poses.see(sighting);
        }
        known.newest = sighting.or(known.newest.take());
        peer.conversation.subscribes(given || self.site.place_of(known.watch.name(), id).is_some());
        if before != id {
            self.meet(id, from);
        }
    }

    /// Who answers at `from` has turned out to be `id`: of two ways to the same module, one is enough, and a given
    /// one is the better.
    fn meet(&mut self, id: ModuleId, from: SocketAddr) {
        let given = self.peers.iter().any(|peer| peer.id() == id && peer.given);
        self.peers.retain(|peer| peer.id() != id || peer.given || (!given && peer.address() == Some(from)));
    }

    /// How everybody is at `now_us`: the site's modules in its order, then the others.
    pub fn lines(&mut self, intake: &Intake, now_us: u64) -> Vec<ModuleLine> {
        let Self { site, peers, known, missing, poses } = self;
        // Of who is neither in the site nor there any more nothing is left to be said.
        known.retain(|id, known| {
            site.place_of(known.watch.name(), *id).is_some() || peers.iter().any(|peer| peer.id() == *id)
        });
        let mut placed: BTreeMap<usize, ModuleLine> = BTreeMap::new();
        let mut others = Vec::new();
        for (id, known) in known {
            let place = site.place_of(known.watch.name(), *id);
            let name = place.and_then(|place| site.modules.get(place)).map(|module| module.name.clone());
            let own = name.unwrap_or_else(|| known.watch.name().to_owned());
            let clock = intake.modules().get(id).map(|module| module.clock());
            let mut line = known.watch.line(&own, *id, clock, now_us);
            line.address = known.address.to_string();
            see(&mut line, known.newest.as_ref(), now_us);
            let subscribed = peers.iter().any(|peer| peer.id() == *id && peer.conversation.is_subscribing());
            if line.state != "missing" && !subscribed {
                line.state = "found".to_owned();
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
            let watch = missing.entry(module.name.clone()).or_insert_with(|| Watch::new(now_us));
            placed.insert(place, watch.line(&module.name, ModuleId::ANY, None, now_us));
        }
        for peer in peers.iter().filter(|peer| peer.given && !peer.heard) {
            let Some(address) = peer.address() else { continue };
            let name = address.to_string();
            let line = Watch::new(0).line(&name, ModuleId::ANY, None, now_us);
            others.push(ModuleLine { address: name, ..line });
        }
        tell_of_poses(poses, intake, &mut placed, now_us);
        placed.into_values().chain(others).collect()
    }
}

/// Adds what is wrong with the places of modules. Of one that is silent, or said to be covered, nothing more is said.
fn tell_of_poses(
    poses: &mut PoseWatch,
    intake: &Intake,
    placed: &mut BTreeMap<usize, ModuleLine>,
    now_us: u64,
) {
    for module in intake.modules().values() {
        if let Some(place) = module.place_in_site() {
            poses.know_walls(place, module.walls_mm());
        }
    }
    for (place, finding) in poses.findings(now_us as f64 * 1e-6) {
        let Some(line) = placed.get_mut(&place) else { continue };
        let (name, text) = words::finding(&finding);
        if !line.alarms.iter().any(|alarm| matches!(alarm.name.as_str(), "silent" | "covered")) {
            line.alarms.push(AlarmLine { name: name.to_owned(), text });
        }
    }
}

/// Whether a peer is who was found.
fn is(peer: &Peer, found: &Found) -> bool {
    let known = peer.id() != ModuleId::ANY && peer.id() == found.id;
    let there = peer.address().is_some_and(|address| found.addresses.contains(&address));
    known || there || (!peer.instance.is_empty() && peer.instance == found.instance)
}

/// What a module sees and what it cannot judge, from its newest sighting.
fn see(line: &mut ModuleLine, newest: Option<&Sighting>, now_us: u64) {
    let Some(sighting) = newest.filter(|newest| now_us as f64 * 1e-6 - newest.start_s < OLD_S) else {
        return;
    };
    let beams = sighting.background_mm.len().max(1);
    let unlearned = sighting.background_mm.iter().filter(|range_mm| **range_mm == 0).count();
    line.unknown_share = (line.unknown_share + unlearned as f64 / beams as f64).min(1.0);
    let view = &sighting.view;
    let each = sighting.empty_mm.len().div_ceil(CORNERS).max(1);
    let corner = |(index, ranges_mm): (usize, &[u16])| {
        let beam = u16::try_from(index * each + ranges_mm.len() / 2).unwrap_or(u16::MAX);
        let range_m = f64::from(ranges_mm.iter().copied().min().unwrap_or(0)) * 1e-3;
        let at = view.place(f64::from(view.geometry.bearing_rad(beam)), range_m);
        [cm(at.x), cm(at.y)]
    };
    line.free = vec![[cm(view.pose.at.x), cm(view.pose.at.y)]];
    line.free.extend(sighting.empty_mm.chunks(each).enumerate().map(corner));
}

fn cm(value_m: f64) -> f64 {
    (value_m * 100.0).round() / 100.0
}
