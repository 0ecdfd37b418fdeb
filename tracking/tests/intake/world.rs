//! Two modules that tell the truth about a room, a host that asks them, and a network between, in a simulated time.
//!
//! ```text
//!   people ─▶ modules ──▶ flying: late, twice, lost ──▶ registry ─▶ site tracker ─▶ zone
//!                 ▲                    ▲                    │
//!                 ╰──── requests ──────┼────────────────────╯
//!                                    forged
//! ```

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};
use std::net::SocketAddr;
use std::sync::{Arc, LazyLock};

use kehai::wire::{Incoming, Request};
use kehai_tracking::geometry::{Point, Pose};
use kehai_tracking::jsonl::ZoneLine;
use kehai_tracking::registry::{Finding, Found, Networks, Registry};
use kehai_tracking::session::datagram::Datagram;
use kehai_tracking::session::outstanding::is_answer;
use kehai_tracking::site::Site;
use kehai_tracking::site_tracker::SiteTracker;

use super::fake::{Fake, id};
use super::judge::{Judge, Report, Used};
use super::scene::{BEAMS, People, ROOM};
use super::times::{SCAN_US, SECOND_US, WAY_US};
use super::tracker::tracker;

/// A module says so often that it is there.
const ANNOUNCES_US: u64 = 5 * SECOND_US;

/// The two modules, a peer that has been found and has no place, and a host where nothing answers.
pub const ADDRESSES: [[u8; 4]; 4] =
    [[192, 168, 7, 1], [192, 168, 7, 2], [192, 168, 7, 66], [192, 168, 7, 77]];
pub const PEER: usize = 2;
pub const PEERS_NAME: &str = "peer";

/// Number of a module that has the left one's name: while both answer, neither is used.
pub const NAMESAKE: u8 = 8;

static SITE: LazyLock<Arc<Site>> = LazyLock::new(|| Arc::new(toml::from_str(ROOM).unwrap()));

pub fn address(number: usize) -> SocketAddr {
    SocketAddr::from((ADDRESSES[number % ADDRESSES.len()], 4040))
}

/// A module of the site.
#[derive(Debug)]
pub struct Honest {
    pub fake: Fake,
    pub pose: Pose,
    /// It sends nothing before this time, µs.
    pub silent_until_us: u64,
    /// So many of its next datagrams are lost, twice or late, and by how much.
    pub lost: u32,
    pub twice: u32,
    pub late: (u32, u64),
}

/// Whose a datagram is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Sender {
    /// A module's own, and when its scan began on the host's clock if it is a report.
    True(usize, Option<u64>),
    Forged,
}

#[derive(PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Order {
    at_us: u64,
    number: u64,
}

#[derive(Debug)]
struct Flying {
    order: Order,
    from: SocketAddr,
    sender: Sender,
    bytes: Vec<u8>,
}

impl PartialEq for Flying {
    fn eq(&self, other: &Self) -> bool {
        self.order == other.order
    }
}
impl Eq for Flying {}
impl PartialOrd for Flying {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Flying {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.order.cmp(&other.order)
    }
}

pub struct World {
    pub registry: Registry,
    pub site_tracker: SiteTracker,
    /// Follows what a recording holds, and must know the same. In one sequence of sixteen: it doubles the time.
    again: Option<SiteTracker>,
    pub honest: [Honest; 2],
    /// A peer without a place, which answers as whom it likes.
    pub peer: Fake,
    pub people: People,
    pub now_us: u64,
    pub judge: Judge,
    /// Ids and T1 of requests that were answered, for who copies them.
    pub spent: VecDeque<(u32, [u8; 8], u64)>,
    /// True datagrams, for who sends them again.
    pub overheard: VecDeque<(usize, Vec<u8>)>,
    flying: BinaryHeap<Reverse<Flying>>,
    flown: u64,
    random: u64,
}

impl World {
    pub fn new(people: People, seed: u64) -> Self {
        let module = |number: u8, name, x: f64, yaw_rad| Honest {
            fake: Fake { offset_us: 1 << 33, parts: BEAMS, ..Fake::new(number, 57, name) },
            pose: Pose { at: Point::new(x, 0.0), yaw_rad },
            silent_until_us: 0,
            lost: 0,
            twice: 0,
            late: (0, 0),
        };
        let mut right = module(2, "right", 2.0, core::f64::consts::PI);
        right.fake.offset_us = (1 << 33) + 6 * SECOND_US as i64;
        let mut world = Self {
            registry: Registry::new(Arc::clone(&SITE), &[address(0), address(PEER)]),
            site_tracker: SiteTracker::new(&SITE, tracker()),
            again: (seed >> 4 == 0).then(|| SiteTracker::new(&SITE, tracker())),
            honest: [module(1, "left", -2.0, 0.0), right],
            peer: Fake::new(9, 1, PEERS_NAME),
            people,
            now_us: 10 * SECOND_US,
            judge: Judge::new(10 * SECOND_US),
            spent: VecDeque::new(),
            overheard: VecDeque::new(),
            flying: BinaryHeap::new(),
            flown: 0,
            random: seed | 1,
        };
        world.announce();
        world
    }

    /// xorshift64: Marsaglia 2003.
    pub fn random(&mut self) -> u64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        self.random
    }

    fn way_us(&mut self) -> u64 {
        200 + self.random() % (WAY_US - 200)
    }

    pub fn find(&mut self, finding: Finding) {
        static OWN: LazyLock<Networks> =
            LazyLock::new(|| Networks::of([([192, 168, 7, 9].into(), [255, 255, 255, 0].into())]));
        self.registry.find(finding, &OWN, self.now_us);
    }

    /// The right module says where it is; the left one's address was given.
    fn announce(&mut self) {
        let id = self.honest[1].fake.identity.module;
        let (instance, addresses) = ("kehai-right".to_owned(), vec![address(1)]);
        self.find(Finding::Found(Found { instance, id, addresses, ..Found::default() }));
    }

    /// Something sends a datagram from an address, or in its name.
    pub fn send(&mut self, from: usize, sender: Sender, bytes: Vec<u8>, after_us: u64) {
        self.flown += 1;
        let order = Order { at_us: self.now_us + after_us, number: self.flown };
        self.flying.push(Reverse(Flying { order, from: address(from), sender, bytes }));
    }

    /// A module sends a datagram, and the network does to it what it does.
    fn sends(&mut self, number: usize, scan_us: Option<u64>, bytes: Vec<u8>, after_us: u64) {
        let way_us = after_us + self.way_us();
        let honest = &mut self.honest[number];
        if honest.lost > 0 {
            honest.lost -= 1;
            self.judge.disturbed_us = self.judge.disturbed_us.max(self.now_us);
            return;
        }
        let mut late_us = 0;
        if honest.late.0 > 0 {
            honest.late.0 -= 1;
            late_us = honest.late.1;
            self.judge.disturbed_us = self.judge.disturbed_us.max(self.now_us + late_us);
        }
        if honest.twice > 0 {
            honest.twice -= 1;
            self.send(number, Sender::True(number, scan_us), bytes.clone(), way_us + late_us + WAY_US);
        }
        if self.overheard.len() == 16 {
            self.overheard.pop_front();
        }
        self.overheard.push_back((number, bytes.clone()));
        self.send(number, Sender::True(number, scan_us), bytes, way_us + late_us);
    }

    /// The host's request arrives.
    fn ask(&mut self, request: &[u8], to: SocketAddr) {
        let way_us = self.way_us();
        let t2_us = self.now_us + way_us;
        if to == address(PEER) {
            if self.peer.name != PEERS_NAME {
                self.judge.forged_us = self.now_us;
            }
            let t2_us = self.peer.clock_us(t2_us);
            for answer in self.peer.answers(request, t2_us) {
                self.send(PEER, Sender::Forged, answer, way_us);
            }
        }
        let Some(number) = (0..2).find(|number| address(*number) == to) else { return };
        let honest = &self.honest[number];
        if self.now_us < honest.silent_until_us {
            return;
        }
        if let Ok(incoming) = Incoming::open(request) {
            let t1 = match incoming.request(honest.fake.identity) {
                Ok(Request::Subscribe { t1 }) => t1,
                _ => [0; 8],
            };
            if self.spent.len() == 8 {
                self.spent.pop_front();
            }
            // An id whose answer gets lost is not spent, and only a host that has seen the request knows it.
            if honest.lost == 0 && honest.late.0 == 0 {
                self.spent.push_back((incoming.request_id, t1, self.now_us));
            }
        }
        let t2_us = honest.fake.clock_us(t2_us);
        for answer in honest.fake.answers(request, t2_us) {
            self.sends(number, None, answer, way_us);
        }
    }

    fn deliver(&mut self, sent: Vec<(Vec<u8>, SocketAddr)>) {
        for (request, to) in sent {
            self.ask(&request, to);
        }
    }

    fn hear(&mut self, flying: &Flying) {
        if !self.registry.knows(flying.from) {
            return;
        }
        let sessions = self.site_tracker.sessions_mut();
        let Some(datagram) = sessions.decode(&flying.bytes) else { return };
        let admission = self.registry.admit(flying.from, &datagram, sessions, self.now_us);
        if let Some(again) = &mut self.again {
            if admission.is_elsewhere {
                again.sessions_mut().note_new_address(datagram.device(), self.now_us);
            }
            if admission.is_used {
                again.receive(&flying.bytes, self.now_us);
            }
        }
        if !admission.is_used {
            return;
        }
        let identity = datagram.header.identity;
        let own = self.honest.iter().map(|honest| honest.fake.identity);
        let own = own.into_iter().find(|own| own.module == identity.module);
        let is_false = |own| own != identity || is_answer(&datagram.message);
        if flying.sender == Sender::Forged && own.is_some_and(is_false) {
            self.judge.believed_falsely(self.now_us);
        }
        let observation = self.site_tracker.follow(&datagram, self.now_us);
        if let Some(observation) = &observation {
            self.note(&datagram, flying, observation.view.module, observation.start_s);
        }
        let mut sent = Vec::new();
        let sessions = self.site_tracker.sessions_mut();
        self.registry.heard(flying.from, &datagram, observation, sessions, self.now_us, |bytes, to| {
            sent.push((bytes.to_vec(), to));
        });
        self.deliver(sent);
    }

    /// A report was used.
    fn note(&mut self, datagram: &Datagram<'_>, flying: &Flying, place: usize, start_s: f64) {
        let now_us = self.now_us;
        let honest = &self.honest[place];
        let kehai::wire::Message::Report(report) = &datagram.message else { return };
        let used = Used {
            place,
            is_from_its_address: flying.from == address(place),
            identity: datagram.header.identity,
            true_identity: honest.fake.identity,
            start_s,
            stamp_host_us: report.head.stamp_us as i128 - i128::from(honest.fake.offset_us),
        };
        let report = match flying.sender {
            Sender::True(number, Some(scan_us)) if number == place => Report::True { scan_us },
            _ => Report::Forged,
        };
        self.judge.used(&used, report, now_us);
    }

    /// Lets datagrams arrive until `end_us`.
    fn arrive(&mut self, end_us: u64) {
        while let Some(Reverse(next)) = self.flying.peek() {
            if next.order.at_us > end_us {
                break;
            }
            let Some(Reverse(flying)) = self.flying.pop() else { break };
            self.now_us = self.now_us.max(flying.order.at_us);
            self.hear(&flying);
        }
        self.now_us = self.now_us.max(end_us);
    }

    /// A tenth of a second: requests, a scan of each module, what arrives, and what is known then.
    pub fn tenth(&mut self) {
        if self.now_us / ANNOUNCES_US != (self.now_us + SCAN_US) / ANNOUNCES_US {
            self.announce();
        }
        let mut sent = Vec::new();
        let sessions = self.site_tracker.sessions_mut();
        self.registry.poll(sessions, self.now_us, |bytes, to| sent.push((bytes.to_vec(), to)));
        self.deliver(sent);
        let scan_us = self.now_us - SCAN_US;
        for number in 0..self.honest.len() {
            let honest = &mut self.honest[number];
            if self.now_us < honest.silent_until_us {
                continue;
            }
            honest.fake.sequence = honest.fake.sequence.wrapping_add(1);
            let seen = self.people.seen(honest.pose, scan_us);
            let fake = &honest.fake;
            let report = fake.reported_with(fake.sequence, fake.clock_us(scan_us), &seen);
            self.sends(number, Some(scan_us), report, 0);
        }
        if self.peer.identity.module == id(NAMESAKE) {
            let report = self.peer.report(scan_us);
            self.send(PEER, Sender::Forged, report, WAY_US);
        }
        self.arrive(self.now_us + SCAN_US);
        let zone = self.zone();
        self.judge.look(&zone, self.people.count(), self.now_us);
        let sessions = self.site_tracker.sessions().iter().count();
        assert!(sessions <= 68, "{sessions} sessions");
    }

    pub fn zone(&mut self) -> ZoneLine {
        let at_s = self.now_us as f64 * 1e-6;
        let mut known = self.site_tracker.estimate(at_s);
        if let Some(again) = &mut self.again {
            assert_eq!(again.estimate(at_s), known, "who follows the recording knows something else");
        }
        known.zones.remove("area").unwrap()
    }

    pub fn seconds(&mut self, seconds: u64) {
        (0..10 * seconds).for_each(|_| self.tenth());
    }
}
