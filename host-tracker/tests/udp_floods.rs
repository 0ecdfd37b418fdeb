//! What floods of datagrams cost the tracker: memory, descriptors and threads, which may not grow; the module that tells the
//! truth is heard, and the way out is open.
//!
//! ```text
//!   module, at its address ── answers, a report each 0.1 s ──▶ ┐
//!   forger, at the same address ── identities, starts, … ────▶ │ tracker ◀── exit, each 50 ms
//!   forgers at 64 other ports ───────────────────────────────▶ ┘
//! ```
//!
//! Some seconds; `KEHAI_FLOOD_SECONDS=600` for as long as that. The figures are printed: `-- --nocapture`.
#![cfg(target_os = "linux")]

mod described;
#[path = "../../tracking/tests/intake/fake.rs"]
mod fake;
mod flood;
mod hall;

use std::net::{SocketAddr, UdpSocket};
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use fake::{Fake, id};
use flood::{Exits, Figures, ask};
use hall::Tracker;
use kehai::wire::{Identity, ModuleId};
use kehai_tracking::snapshot::Snapshot;

/// How long a flood lasts in a short run.
const SHORT: Duration = Duration::from_secs(2);

/// Datagrams at once, and the pause after them: 20 000 a second at most, so that other tests of the machine go on.
const BATCH: usize = 100;
const PAUSE: Duration = Duration::from_millis(5);

/// Datagrams of a flood that the tracker must have refused under the right name: a thousandth of the shortest flood could
/// be others'.
const REFUSED: u64 = 100;

/// Ports of strangers.
const PORTS: usize = 64;

/// Growth of memory that is none, kB: what forged identities cost in a second before they were bounded.
const NOISE_KB: u64 = 6000;

/// Between two looks at the tracker.
const LOOK: Duration = Duration::from_millis(100);

/// A hundred times what a loaded machine needs.
const PATIENCE: Duration = Duration::from_secs(60);

/// Steele's SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ mixed >> 31
    }
}

/// Where a flood seems to come from.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum From {
    /// The module's own address.
    Module,
    /// Addresses at which there is no module.
    Strangers,
}

/// A flood: where it seems to come from, what it says, and under which name it is refused.
struct Flood {
    name: &'static str,
    from: From,
    say: fn(&mut Random, &Fake) -> Vec<u8>,
    refused: fn(&Snapshot) -> u64,
}

const FLOODS: [Flood; 6] = [
    Flood {
        name: "strangers",
        from: From::Strangers,
        say: |random, fake| fake.reported(random.next() as u32, random.next()),
        refused: |snapshot| snapshot.strangers,
    },
    Flood {
        name: "forged identities",
        from: From::Module,
        say: |random, fake| {
            let [_, _, module @ ..] = (random.next() | 1).to_be_bytes();
            let identity = Identity { module: ModuleId(module), boot: 1 };
            Fake { identity, ..fake.clone() }.reported(1, random.next())
        },
        refused: |snapshot| snapshot.dropped.foreign,
    },
    Flood {
        name: "forged starts",
        from: From::Module,
        say: |random, fake| {
            let identity = Identity { boot: random.next() as u32 | 1 << 31, ..fake.identity };
            Fake { identity, ..fake.clone() }.reported(1, random.next())
        },
        refused: |snapshot| snapshot.dropped.stale_boot,
    },
    Flood {
        name: "answers without a question",
        from: From::Module,
        say: |random, fake| {
            let (id, t1_us, t2_us) = (random.next() as u32, random.next(), random.next());
            fake.exchanged(id, t1_us, t2_us, t2_us.wrapping_add(random.next() >> 32))
        },
        refused: |snapshot| snapshot.dropped.unasked,
    },
    Flood {
        name: "forged report numbers",
        from: From::Module,
        // Half of all numbers away.
        say: |random, fake| fake.reported(random.next() as u32 >> 2 | 1 << 30, random.next()),
        refused: |snapshot| snapshot.dropped.jump,
    },
    Flood {
        name: "any bytes",
        from: From::Module,
        say: |random, _| (0..1 + random.next() % 200).map(|_| random.next() as u8).collect(),
        refused: |snapshot| snapshot.dropped.unreadable,
    },
];

/// A module that tells the truth about an empty room, in a thread of its own.
struct Module {
    socket: UdpSocket,
    fake: Fake,
    tracker: Arc<Mutex<Option<SocketAddr>>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Module {
    fn start() -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.set_read_timeout(Some(Duration::from_millis(5))).unwrap();
        let fake = Fake::new(1, 5, "left");
        let (tracker, stop) = (Arc::<Mutex<Option<SocketAddr>>>::default(), Arc::new(AtomicBool::new(false)));
        let (told, stopped, own) = (Arc::clone(&tracker), Arc::clone(&stop), socket.try_clone().unwrap());
        let mut speaking = fake.clone();
        let thread = std::thread::spawn(move || {
            let begun = Instant::now();
            // Its clock began long before.
            let clock_us = || 1_000_000_000 + begun.elapsed().as_micros() as u64;
            let (mut next_us, mut buffer) = (clock_us(), [0; 2000]);
            while !stopped.load(Ordering::Relaxed) {
                if let Ok((len, from)) = own.recv_from(&mut buffer) {
                    *told.lock().unwrap() = Some(from);
                    for answer in speaking.answers(&buffer[..len], clock_us()) {
                        let _ = own.send_to(&answer, from);
                    }
                }
                let to = *told.lock().unwrap();
                if let (Some(to), true) = (to, clock_us() >= next_us) {
                    next_us += 100_000;
                    let report = speaking.report(clock_us() - 100_000);
                    let _ = own.send_to(&report, to);
                }
            }
        });
        Self { socket, fake, tracker, stop, thread: Some(thread) }
    }
}

impl Drop for Module {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Sends a flood until `stop`; how many datagrams that were.
fn send(flood: &Flood, module: &Module, stop: &AtomicBool) -> u64 {
    let tracker = module.tracker.lock().unwrap().expect("the tracker has asked the module");
    let sockets: Vec<UdpSocket> = match flood.from {
        From::Module => vec![module.socket.try_clone().unwrap()],
        From::Strangers => (0..PORTS).map(|_| UdpSocket::bind("127.0.0.1:0").unwrap()).collect(),
    };
    let (mut random, mut sent) = (Random(7), 0);
    while !stop.load(Ordering::Relaxed) {
        for _ in 0..BATCH {
            let socket = &sockets[random.next() as usize % sockets.len()];
            sent += u64::from(socket.send_to(&(flood.say)(&mut random, &module.fake), tracker).is_ok());
        }
        std::thread::sleep(PAUSE);
    }
    sent
}

/// Figures from now on, one each [`LOOK`], until `stop`.
fn looks(process: u32, stop: &Arc<AtomicBool>) -> Receiver<Figures> {
    let (tell, told) = mpsc::channel();
    let stop = Arc::clone(stop);
    std::thread::spawn(move || {
        while !stop.load(Ordering::Relaxed) && tell.send(Figures::of(process)).is_ok() {
            std::thread::sleep(LOOK);
        }
    });
    told
}

fn snapshot(map: SocketAddr) -> Snapshot {
    let answer = ask(map, "GET /api/state").unwrap();
    serde_json::from_str(answer.split_once("\r\n\r\n").unwrap().1).unwrap()
}

/// The zone is known to be empty, within [`PATIENCE`].
#[track_caller]
fn knows(map: SocketAddr, what: &str) {
    let begun = Instant::now();
    loop {
        let found = snapshot(map);
        let zone = found.line.zones.get("area");
        if zone.is_some_and(|zone| zone.count() == Some(0)) {
            return;
        }
        assert!(begun.elapsed() < PATIENCE, "{what}: {zone:?}, {:?}", found.dropped);
        std::thread::sleep(LOOK);
    }
}

#[test]
fn f3_f4_f5_f6_no_flood_of_datagrams_grows_mutes_a_module_or_shuts_the_way_out() {
    let folder = tempfile::tempdir().unwrap();
    let site = folder.path().join("home.toml");
    std::fs::write(&site, flood::SITE).unwrap();
    let module = Module::start();
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(["run", "--no-mdns", "--http", "0", "--door-http", "0", "--site"]).arg(&site);
    command.args(["--module", &module.socket.local_addr().unwrap().to_string()]);
    let tracker = Tracker::start(command);
    let address = |text: String| text.split('/').next().unwrap().parse::<SocketAddr>().unwrap();
    let map = address(tracker.says("live map at http://"));
    let doors = address(tracker.says("messages to doors at http://"));
    let process = tracker.process.id();
    knows(map, "before");
    assert_eq!(module.fake.identity.module, id(1));
    println!("{:30} {}", "before", Figures::of(process));
    for flood in &FLOODS {
        let lasts =
            flood::seconds().map_or(SHORT, |seconds| Duration::from_secs_f64(seconds / FLOODS.len() as f64));
        let (before, stop) = ((flood.refused)(&snapshot(map)), Arc::new(AtomicBool::new(false)));
        let exits = Exits::begin(doors);
        let (figures, sent) = std::thread::scope(|scope| {
            let sending = scope.spawn(|| send(flood, &module, &stop));
            let figures = looks(process, &stop);
            std::thread::sleep(lasts);
            stop.store(true, Ordering::Relaxed);
            (figures.into_iter().collect::<Vec<_>>(), sending.join().unwrap())
        });
        let taken = exits.end();
        let refused = (flood.refused)(&snapshot(map)) - before;
        let (first, rest) = figures.split_at(figures.len() / 4);
        let worst = |figures: &[Figures]| figures.iter().copied().fold(Figures::default(), Figures::worst);
        let (plateau, later) = (worst(first), worst(rest));
        println!("{:30} {later}; {sent} datagrams, {refused} refused; {taken}", flood.name);
        assert!(refused > REFUSED, "{}: {refused}", flood.name);
        assert!(later.rss_kb <= plateau.rss_kb + NOISE_KB, "{}: {later}; at first {plateau}", flood.name);
        // The one more is the connection at the button.
        assert!(later.descriptors <= plateau.descriptors + 1, "{}: {later}; at first {plateau}", flood.name);
        assert!(later.threads <= plateau.threads, "{}: {later}; at first {plateau}", flood.name);
        knows(map, flood.name);
    }
}
