//! A module on simulated time: emulated sensor, driver, tasks, network and flash, and hosts that talk to it.

use std::cell::{Cell, RefCell};
use std::net::{Ipv4Addr, SocketAddrV4};
use std::rc::Rc;

use embassy_futures::select::{Either, select};
use kehai::device::starts::ShortStarts;
use kehai::device::{About, Addressing, Module};
use kehai::link::Clock as _;
use kehai::scan::MAX_BEAMS;
use kehai::sensor::{Driver, LineSettings};
use kehai::store::flash::FlashStore;
use kehai::tasks::{self, Hardware, Notices};
use kehai::wire::{Cookie, Counter, Identity, Message, ModuleId, Refusal, Request, Subscribed};
use kehai_emulator::link::{LinkOptions, MemoryLink};
use kehai_emulator::pc::Fed;
use kehai_emulator::pc::flash::{Flash, PAGE_LEN};
use kehai_emulator::pc::network::{HostSocket, Network};
use kehai_emulator::simulated_time::{SimulatedClock, block_on_until};
use kehai_emulator::source::{RangeSource, Revolution, SensorGeometry, SourceScan, StillRoom};
use kehai_emulator::urg::model::URG_04LX;
use kehai_emulator::urg::{Config, Urg};

pub const SECOND_US: u64 = 1_000_000;
pub const MODULE: ModuleId = ModuleId([2, 0, 0, 0, 0, 1]);
pub const PAGES: usize = 8;

/// The still room, and a person in it: every step from `first` to `last` reads `range_mm`.
#[derive(Clone)]
pub struct Room {
    still: StillRoom,
    pub person: PersonInView,
}

/// First step, last step, range in mm.
pub type PersonInView = std::sync::Arc<std::sync::Mutex<Option<(u16, u16, u32)>>>;

impl RangeSource for Room {
    fn geometry(&self) -> SensorGeometry {
        self.still.geometry()
    }

    fn scan(&mut self, revolution: Revolution) -> Option<SourceScan> {
        let first_step = self.geometry().first_step;
        let mut scan = self.still.scan(revolution)?;
        if let Some((first, last, range_mm)) = *self.person.lock().unwrap() {
            for (step, value_mm) in (first_step..).zip(&mut scan.ranges_mm) {
                if (first..=last).contains(&step) {
                    *value_mm = range_mm;
                }
            }
        }
        Some(scan)
    }
}

/// Everything around a module. Its flash outlives it.
pub struct World {
    pub clock: SimulatedClock,
    pub network: Network,
    pub flash: Flash,
    pub link: MemoryLink,
    pub person: PersonInView,
    pub fed: Fed,
    pub line: LineSettings,
    pub notices: Notices,
    /// Starts so far.
    pub starts: Rc<Cell<u32>>,
    /// Addressing of the present start.
    pub addressing: Cell<Addressing>,
    /// Number of short starts that the next start will find.
    pub short_starts: Cell<ShortStarts>,
}

impl World {
    pub fn new(config: Config) -> Self {
        let clock = SimulatedClock::new();
        let room = Room { still: StillRoom::new(config.model.geometry), person: PersonInView::default() };
        let person = room.person.clone();
        let serial = config.paced;
        let link = MemoryLink::new(&clock, Urg::new(config, Box::new(room), 0), LinkOptions::default());
        let speed = LineSettings::Serial { last_baud: None, wanted_baud: None, fastest_baud: 750_000 };
        Self {
            network: Network::new(&clock),
            clock,
            flash: Flash::new(PAGES),
            link,
            person,
            fed: Fed::default(),
            notices: Notices::new(),
            line: if serial { speed } else { LineSettings::NoSpeed },
            starts: Rc::default(),
            addressing: Cell::default(),
            short_starts: Cell::default(),
        }
    }

    /// A URG-04LX in the still room.
    pub fn urg() -> Self {
        Self::new(Config::new(URG_04LX))
    }

    /// The module, start after start.
    async fn module(&self) {
        loop {
            let mut store = FlashStore::new(self.flash.clone(), 0..(PAGES * PAGE_LEN) as u32).unwrap();
            let about = About {
                module: MODULE,
                secret: [7; 16],
                firmware: "0.0.1",
                build: "test",
                board: "simulated",
                watchdog_reset: false,
            };
            let mut module = Box::new(Module::<MAX_BEAMS>::new(about));
            tasks::begin(&mut store, &mut module, self.short_starts.get()).await;
            self.addressing.set(module.addressing());
            self.starts.set(self.starts.get() + 1);
            let settings = module.settings().sensor(self.line);
            let mut driver = Box::new(Driver::new(self.link.clone(), self.clock.clone(), settings));
            let hardware = Hardware {
                driver: &mut driver,
                line: self.line,
                datagrams: self.network.clone(),
                store,
                watchdog: self.fed.clone(),
                clock: self.clock.clone(),
                notices: &self.notices,
            };
            tasks::run(&mut module, hardware).await;
        }
    }

    /// Runs the module, and `script` beside it until that is done.
    pub fn run<T>(&self, script: impl AsyncFnOnce() -> T) -> T {
        let limit_us = self.clock.now_us() + 600 * SECOND_US;
        match block_on_until(&self.clock, limit_us, select(script(), self.module())).unwrap() {
            Either::First(result) => result,
            Either::Second(()) => unreachable!("the module never ends"),
        }
    }

    pub fn host(&self, last: u8) -> Host {
        let address = SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, last), 5000);
        Host {
            socket: self.network.host(address),
            clock: self.clock.clone(),
            cookie: Cell::new(Cookie::NONE),
            boot: Cell::new(0),
            next_id: Cell::new(u32::from(last) * 1000),
            renewed_us: Cell::new(0),
            seen: RefCell::default(),
        }
    }

    pub fn now_us(&self) -> u64 {
        self.clock.now_us()
    }

    pub async fn wait(&self, seconds: f64) {
        self.clock.wait_until(self.now_us() + (seconds * 1e6) as u64).await;
    }
}

/// A host: subscribes, renews while it waits, and remembers everything it was sent.
pub struct Host {
    pub socket: HostSocket,
    clock: SimulatedClock,
    pub cookie: Cell<Cookie>,
    pub boot: Cell<u32>,
    next_id: Cell<u32>,
    renewed_us: Cell<u64>,
    /// Datagrams, and when they came.
    pub seen: RefCell<Vec<(u64, Vec<u8>)>>,
}

/// Where a look into the messages begins.
#[derive(Clone, Copy)]
pub struct Mark(usize);

impl Host {
    pub fn identity(&self) -> Identity {
        Identity { module: MODULE, boot: self.boot.get() }
    }

    /// Sends a request; gives its number.
    pub fn ask(&self, request: Request<'_>) -> u32 {
        let id = self.next_id.get();
        self.next_id.set(id + 1);
        self.ask_as(request, id, self.identity());
        id
    }

    pub fn ask_as(&self, request: Request<'_>, id: u32, to: Identity) {
        let mut datagram = [0; 1400];
        let length = request.encode(to, id, self.cookie.get(), &mut datagram).unwrap();
        self.socket.send(&datagram[..length]);
    }

    fn renew(&self) {
        self.renewed_us.set(self.clock.now_us());
        self.ask(Request::Subscribe { t1: self.clock.now_us().to_le_bytes() });
    }

    pub fn start(&self) -> Mark {
        Mark(0)
    }

    pub fn mark(&self) -> Mark {
        Mark(self.seen.borrow().len())
    }

    /// Waits until `found` has something to say about a datagram that came from now on, renewing every second;
    /// None at `until_us`.
    async fn look<T>(
        &self,
        from: Mark,
        until_us: u64,
        renewing: bool,
        mut found: impl FnMut(u64, &Message<'_>) -> Option<T>,
    ) -> Option<T> {
        let Mark(mut next) = from;
        loop {
            while let Some((at_us, datagram)) = self.seen.borrow().get(next) {
                next += 1;
                let (header, message) = Message::decode(datagram).unwrap();
                assert_eq!(header.identity.module, MODULE);
                if let Some(found) = found(*at_us, &message) {
                    return Some(found);
                }
            }
            let now_us = self.clock.now_us();
            if now_us >= until_us {
                return None;
            }
            if renewing && now_us >= self.renewed_us.get() + SECOND_US {
                self.renew();
            }
            let renewal_us = if renewing { self.renewed_us.get() + SECOND_US } else { u64::MAX };
            if let Some(received) = self.socket.receive(until_us.min(renewal_us)).await {
                self.seen.borrow_mut().push(received);
            }
        }
    }

    /// Waits 30 s at most.
    pub async fn expect<T>(
        &self,
        from: Mark,
        what: &str,
        found: impl FnMut(u64, &Message<'_>) -> Option<T>,
    ) -> T {
        let until_us = self.clock.now_us() + 30 * SECOND_US;
        match self.look(from, until_us, self.cookie.get() != Cookie::NONE, found).await {
            Some(found) => found,
            None => {
                panic!("no {what} until {until_us} µs; last seen {:x?}", self.kinds(from).rchunks(40).next())
            }
        }
    }

    /// Lets time pass, renewing.
    pub async fn stay(&self, seconds: f64) {
        let until_us = self.clock.now_us() + (seconds * 1e6) as u64;
        let nothing = |_: u64, _: &Message<'_>| None::<()>;
        self.look(self.mark(), until_us, self.cookie.get() != Cookie::NONE, nothing).await;
    }

    /// Lets time pass without renewing.
    pub async fn be_silent(&self, seconds: f64) {
        let until_us = self.clock.now_us() + (seconds * 1e6) as u64;
        self.look(self.mark(), until_us, false, |_, _| None::<()>).await;
    }

    pub fn kinds(&self, Mark(from): Mark) -> Vec<u8> {
        self.seen.borrow()[from..].iter().map(|(_, datagram)| datagram[14]).collect()
    }

    /// Everything since `from` that `pick` wants.
    pub fn all<T>(&self, Mark(from): Mark, mut pick: impl FnMut(u64, &Message<'_>) -> Option<T>) -> Vec<T> {
        let seen = self.seen.borrow();
        seen[from..]
            .iter()
            .filter_map(|(at_us, datagram)| pick(*at_us, &Message::decode(datagram).unwrap().1))
            .collect()
    }

    /// Sequences of the reports since `from`.
    pub fn sequences(&self, from: Mark) -> Vec<u32> {
        self.all(from, |_, message| match message {
            Message::Report(report) => Some(report.head.sequence),
            _ => None,
        })
    }

    /// Gets a cookie and a place.
    pub async fn subscribe(&self) -> Result<Subscribed, Refusal> {
        self.cookie.set(Cookie::NONE);
        let begin = self.mark();
        let id = self.ask(Request::Subscribe { t1: [1; 8] });
        let cookie = self
            .expect(begin, "cookie", |_, message| match message {
                Message::Cookie { request_id, t1, cookie } if *request_id == id => {
                    assert_eq!(*t1, [1; 8]);
                    Some(*cookie)
                }
                _ => None,
            })
            .await;
        let given = |datagram: &(u64, Vec<u8>)| {
            let (header, message) = Message::decode(&datagram.1).unwrap();
            matches!(message, Message::Cookie { .. }).then_some(header.identity.boot)
        };
        self.boot.set(self.seen.borrow().iter().rev().find_map(given).unwrap());
        self.cookie.set(cookie);
        self.renewed_us.set(self.clock.now_us());
        let again = self.mark();
        let id = self.ask(Request::Subscribe { t1: [2; 8] });
        self.expect(again, "place", |_, message| match message {
            Message::Subscribed(subscribed) if subscribed.request_id == id => Some(Ok(*subscribed)),
            Message::Refused(refused) if refused.request_id == id => Some(Err(refused.refusal)),
            _ => None,
        })
        .await
    }

    /// Sends a request, and waits for its answer: done or a refusal.
    pub async fn order(&self, request: Request<'_>) -> Result<(), Refusal> {
        let begin = self.mark();
        let id = self.ask(request);
        self.answer(begin, id).await
    }

    pub async fn answer(&self, from: Mark, id: u32) -> Result<(), Refusal> {
        self.expect(from, "answer", |_, message| match message {
            Message::Done { request_id } if *request_id == id => Some(Ok(())),
            Message::Absorbed { request_id, .. } if *request_id == id => Some(Ok(())),
            Message::Refused(refused) if refused.request_id == id => Some(Err(refused.refusal)),
            _ => None,
        })
        .await
    }

    pub async fn settings(&self) -> String {
        let begin = self.mark();
        let id = self.ask(Request::GetSettings);
        self.expect(begin, "settings", |_, message| match message {
            Message::Settings { request_id, text } if *request_id == id => Some((*text).to_owned()),
            _ => None,
        })
        .await
    }

    /// A counter, as of the next health.
    pub async fn counter(&self, counter: Counter) -> u32 {
        let begin = self.mark();
        self.expect(begin, "health", |_, message| match message {
            Message::Health(health) => Some(health.counters.get(counter)),
            _ => None,
        })
        .await
    }

    /// Waits for a background, and until it is stored.
    pub async fn learned(&self) -> u16 {
        let version = self
            .expect(self.mark(), "background", |_, message| match message {
                Message::Report(report) => {
                    Some(report.head.background_version).filter(|&version| version > 0)
                }
                _ => None,
            })
            .await;
        self.stay(1.0).await;
        version
    }
}
