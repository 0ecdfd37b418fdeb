//! Cost of the tracker, from a datagram to tracks and zones: instructions a report (counted by valgrind, so the
//! same in every run), time on this machine, and whether it keeps up with a network.
//!
//! ```text
//!   worlds, simulated once ─▶ datagrams in memory ─┬─▶ callgrind: instructions up to t₁, up to t₂ ─▶ a report
//!                                                  ├─▶ a clock: µs a report, multiple of real time
//!                                                  └─▶ one UDP socket a module ─▶ TrackingLoop ─▶ reports lost
//! ```
//!
//! `cargo bench -p host-sim` prints the table and fails when a budget is exceeded. `-- --loopback N` listens to the
//! network for N seconds, too, and fails when a report is lost there, which a busy machine may cause;
//! `-- --loopback-modules N` to so many modules.
//!
//! Only the tracker is measured: its input was recorded before. A line of tracks is asked for every 0.1 s, as
//! `kehai-tracker` does, and is part of the cost.

mod counted;

use std::error::Error;
use std::net::{SocketAddr, UdpSocket};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use host_sim::baselines::Choice;
use host_sim::run::{Options, Record};
use host_sim::world::scene::Scene;
use host_sim::world::variation::{Letter, Variation};
use host_tracker::net::tracking::{Parts, TrackingLoop};
use kehai::seal::{Nonces, Role};
use kehai::wire::{HEADER_LEN, Incoming, Message, Request};
use kehai_tracking::keys::{Clear, Keys, Links};
use kehai_tracking::observation::LATE_S;
use kehai_tracking::registry::Registry;
use kehai_tracking::session::Session;
use kehai_tracking::site_tracker::SiteTracker;

/// Most instructions a report, with eight people before two modules: what it took before vehicles and zones that are never
/// said to be empty by mistake. Measured: 97 thousand.
const EIGHT_BUDGET: u64 = 112_999;

/// What a report may cost at 64 modules, of what it costs at two. A hall of four costs 1.20 times one of two: its modules
/// see more people; sixteen such halls 1.03 times one.
const GROWTH_BUDGET: f64 = 1.3;

/// Five hundred modules on one core are to be so much faster than real time; printed, not guarded.
const AIM_REAL_TIME: f64 = 5.0;

/// Distance from one hall to the next, m: eight, and walls between.
const APART_M: f64 = 8.2;

/// Time in which all people are in and walk: s, of the halls' 20.
const WALKING_S: (f64, f64) = (15.0, 17.0);

/// A world to be fed to a tracker.
#[derive(Clone, Copy)]
struct World {
    name: &'static str,
    what: &'static str,
    /// Halls side by side; 0: the door area instead.
    halls: usize,
    /// Modules of a hall, and its people.
    modules: usize,
    people: usize,
}

const DOOR: World =
    World { name: "door", what: "2 modules, 8 people before a door", halls: 0, modules: 2, people: 8 };

const SIXTY_FOUR: World =
    World { name: "sixty-four", what: "64 modules, 64 people", halls: 16, modules: 4, people: 4 };

const FIVE_HUNDRED: World =
    World { name: "five-hundred", what: "500 modules, 500 people", halls: 125, modules: 4, people: 4 };

const WORLDS: [World; 5] = [
    DOOR,
    World { name: "two", what: "2 modules, 2 people", halls: 1, modules: 2, people: 2 },
    World { name: "four", what: "4 modules, 4 people", halls: 1, modules: 4, people: 4 },
    SIXTY_FOUR,
    FIVE_HUNDRED,
];

/// What is asked of a tracker in a world.
#[derive(Clone, Copy)]
enum Aim {
    /// At most so many instructions for a report.
    Instructions(u64),
    /// So many times faster than real time on one core. The instructions are not counted: under valgrind that takes minutes.
    RealTime(f64),
}

/// The worlds in which the tracker that renders is measured, and what is asked of it: printed, not guarded, while it is
/// experimental.
const RENDERED: [(World, Aim); 4] = [
    (DOOR, Aim::Instructions(3_000_000)),
    (
        World { name: "one", what: "2 modules, 1 person", halls: 1, modules: 2, people: 1 },
        Aim::Instructions(300_000),
    ),
    (SIXTY_FOUR, Aim::RealTime(4.0)),
    (FIVE_HUNDRED, Aim::RealTime(1.0)),
];

fn hall(modules: usize, people: usize, duration_s: u32) -> Result<Record, Box<dyn Error>> {
    let mut scene = Scene::load("hall")?;
    scene.site.modules.truncate(modules);
    scene.people.truncate(people);
    scene.vary(&Variation { duration_s: Some(duration_s), ..Variation::default() })?;
    Ok(Record::of(&scene, 1, &Options::default())?)
}

/// Simulates what is in the file, once a run of this program.
fn recorded(world: &World) -> Result<PathBuf, Box<dyn Error>> {
    let record = if world.halls == 0 {
        let mut scene = Scene::load("door-area")?;
        let condition = Some(Letter::D);
        scene.vary(&Variation { people: Some(8), condition, ..Variation::default() })?;
        Record::of(&scene, 1, &Options::default())?
    } else {
        hall(world.modules, world.people, 20)?
    };
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("bench-{}.run", world.name));
    record.save(&path)?;
    Ok(path)
}

/// The world in the file, as often as it is needed.
fn load(path: &Path, halls: usize) -> Result<Record, Box<dyn Error>> {
    let record = Record::load(path)?;
    Ok(if halls > 1 { record.copies(halls, APART_M) } else { record })
}

/// The time that is measured: all people are there.
fn window_s(record: &Record) -> (f64, f64) {
    record.events.map_or(WALKING_S, |events| (events.all_in_s, events.door_opens_s))
}

/// Feeds everything up to a time; the reports among it.
fn feed(record: &Record, site_tracker: &mut SiteTracker, from_s: f64, until_s: f64) -> u64 {
    let within = |t: f64| t > from_s && t <= until_s;
    let mut arrivals =
        record.arrivals.iter().filter(|arrival| within(arrival.at_us as f64 * 1e-6)).peekable();
    let mut reports = 0;
    for moment in record.truth.iter().filter(|moment| within(moment.t)) {
        while let Some(arrival) = arrivals.next_if(|arrival| arrival.at_us as f64 * 1e-6 <= moment.t) {
            reports += u64::from(site_tracker.receive(&arrival.bytes, arrival.at_us).is_some());
        }
        std::hint::black_box(site_tracker.line(moment.t));
    }
    reports
}

fn site_tracker(record: &Record, tracker: Choice) -> SiteTracker {
    SiteTracker::new(&Arc::new(record.site.clone()), tracker)
}

/// Instructions a report within the world's window, counted by valgrind; None if valgrind is not installed.
fn instructions(path: &Path, world: &World, tracker: Choice, reports: u64) -> Option<u64> {
    let (path, halls, tracker) = (path.to_str()?, world.halls.to_string(), tracker.to_string());
    let count = |end: &str| counted::instructions(&["--run", path, &halls, end, &tracker], None);
    Some((count("last")? - count("first")?) / reports.max(1))
}

/// One line of the table: instructions, µs a report, multiple of real time.
struct Cost {
    instructions: Option<u64>,
    us: f64,
    real_time: f64,
    reports: u64,
    people: usize,
}

impl Cost {
    fn print(&self, what: &str) {
        println!(
            "{what:<46}{:>8}{:>8}{:>14}{:>12.1}{:>14.1}",
            self.reports,
            self.people,
            counted::shown(self.instructions),
            self.us,
            self.real_time
        );
    }
}

fn cost(world: &World, tracker: Choice, counts: bool) -> Result<Cost, Box<dyn Error>> {
    let path = recorded(world)?;
    let record = load(&path, world.halls)?;
    let (first_s, last_s) = window_s(&record);
    let (mut best_s, mut reports, mut people) = (f64::INFINITY, 0, 0);
    for _ in 0..3 {
        let mut site_tracker = site_tracker(&record, tracker);
        feed(&record, &mut site_tracker, -1.0, first_s);
        let start = Instant::now();
        reports = feed(&record, &mut site_tracker, first_s, last_s);
        best_s = best_s.min(start.elapsed().as_secs_f64());
        people = site_tracker.tracks(last_s).len();
    }
    // Five hundred take minutes under valgrind and say nothing that 64 do not.
    let counts = counts && world.halls <= 16;
    let instructions = if counts { instructions(&path, world, tracker, reports) } else { None };
    Ok(Cost {
        instructions,
        us: best_s * 1e6 / reports.max(1) as f64,
        real_time: (last_s - first_s) / best_s,
        reports,
        people,
    })
}

/// A module of the record, as it answers the live host.
struct Answers {
    /// Where the host is, once it has asked.
    host: Option<SocketAddr>,
    /// Request id of its newest question for information.
    info: [u8; 4],
    /// What the module answered to its subscriber in the record, and its clock, µs ahead of the record's.
    subscribed: Option<(Vec<u8>, i64)>,
}

impl Answers {
    /// Of each module, by what it sent in the record.
    fn of(record: &Record) -> Vec<Self> {
        let silent = |_| Self { host: None, info: [0; 4], subscribed: None };
        let mut all: Vec<Self> = (0..record.modules.len()).map(silent).collect();
        for arrival in &record.arrivals {
            if let Some(own) = all.get_mut(usize::from(arrival.module)).filter(|own| own.subscribed.is_none())
                && let Ok((_, Message::Subscribed(subscribed))) = Message::decode(&arrival.bytes)
            {
                let ahead_us = subscribed.t3_us as i64 - arrival.at_us as i64;
                own.subscribed = Some((arrival.bytes.to_vec(), ahead_us));
            }
        }
        all
    }

    /// Takes a request of the host. One to subscribe is answered at once, or the host would learn a false time of the module.
    fn take(&mut self, request: &[u8], from: SocketAddr, now_us: u64) -> Option<Vec<u8>> {
        self.host = Some(from);
        let incoming = Incoming::open(request).ok()?;
        match incoming.request(incoming.header.identity) {
            Ok(Request::Subscribe { t1 }) => {
                let (bytes, ahead_us) = self.subscribed.as_ref()?;
                let now_us = now_us.saturating_add_signed(*ahead_us).to_le_bytes();
                let (head, rest) = bytes.split_at(HEADER_LEN);
                let id = incoming.request_id.to_le_bytes();
                let times = [&id[..], &t1, &now_us, &now_us].concat();
                Some([head, &times, rest.get(times.len()..)?].concat())
            }
            Ok(Request::Info) => {
                self.info = incoming.request_id.to_le_bytes();
                None
            }
            _ => None,
        }
    }

    /// A datagram of the record, for this host; none that answers another one's subscription.
    fn played(&self, bytes: &[u8]) -> Option<Vec<u8>> {
        let own: &[u8] = match Message::decode(bytes) {
            Ok((_, Message::Cookie { .. } | Message::Subscribed(_))) => return None,
            Ok((_, Message::Info(_))) => &self.info,
            _ => &[],
        };
        let mut played = bytes.to_vec();
        played[HEADER_LEN..HEADER_LEN + own.len()].copy_from_slice(own);
        Some(played)
    }
}

/// What became of the datagrams that were to be sent.
#[derive(Clone, Copy, Default)]
struct Sent {
    reports: u64,
    /// Reports that the sender itself was slow to send: by more than a tracker waits.
    behind: u64,
    most_behind_s: f64,
    processor_s: f64,
}

/// Processor time of this process's threads of that name so far, s; of this one if none is given.
fn processor_s(name: Option<&str>) -> f64 {
    /// Ticks a second, in which Linux counts to all programs.
    const TICKS: f64 = 100.0;
    let of = |folder: &Path| {
        let stat = std::fs::read_to_string(folder.join("stat")).ok()?;
        // After the name in brackets: state, ten more, utime, stime.
        let mut times = stat.rsplit_once(')')?.1.split_whitespace().skip(11).map(str::parse::<f64>);
        Some((times.next()?.ok()? + times.next()?.ok()?) / TICKS)
    };
    let Some(name) = name else { return of(Path::new("/proc/thread-self")).unwrap_or_default() };
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten().map(|task| task.path());
    let is_of =
        |folder: &PathBuf| std::fs::read_to_string(folder.join("comm")).is_ok_and(|comm| comm.trim() == name);
    tasks.filter(is_of).filter_map(|folder| of(&folder)).sum()
}

/// Sends the datagrams of a record at their times of arrival, each module from its own socket.
fn send(record: &Record, mut modules: Vec<Answers>, sockets: &[UdpSocket], begun: Instant) -> Sent {
    let (mut sent, before_s) = (Sent::default(), processor_s(None));
    let mut asked = [0; 2048];
    for arrival in &record.arrivals {
        let at = Duration::from_micros(arrival.at_us);
        std::thread::sleep(at.saturating_sub(begun.elapsed()));
        let module = usize::from(arrival.module);
        let (Some(socket), Some(answers)) = (sockets.get(module), modules.get_mut(module)) else { continue };
        // Every request subscribes its sender.
        while let Ok((length, from)) = socket.recv_from(&mut asked) {
            if let Some(answer) = answers.take(&asked[..length], from, begun.elapsed().as_micros() as u64) {
                let _ = socket.send_to(&answer, from);
            }
        }
        let Some((host, played)) = answers.host.zip(answers.played(&arrival.bytes)) else { continue };
        let is_report = matches!(Message::decode(&arrival.bytes), Ok((_, Message::Report(_))));
        if socket.send_to(&played, host).is_ok() && is_report {
            let behind_s = begun.elapsed().saturating_sub(at).as_secs_f64();
            sent.reports += 1;
            sent.behind += u64::from(behind_s > LATE_S);
            sent.most_behind_s = sent.most_behind_s.max(behind_s);
        }
    }
    Sent { processor_s: processor_s(None) - before_s, ..sent }
}

/// Follows modules over the loopback for so long; reports sent, and how many of them never came.
fn loopback(modules: usize, seconds: u32) -> Result<(u64, u64), Box<dyn Error>> {
    let record = hall(4, 4, seconds)?.copies(modules.div_ceil(4), APART_M);
    let sockets: Vec<UdpSocket> =
        (0..record.modules.len()).map(|_| UdpSocket::bind("127.0.0.1:0")).collect::<Result<_, _>>()?;
    sockets.iter().try_for_each(|socket| socket.set_nonblocking(true))?;
    let addresses: Vec<SocketAddr> = sockets.iter().map(UdpSocket::local_addr).collect::<Result<_, _>>()?;
    let registry = Registry::new(Arc::new(record.site.clone()), &addresses);
    let (socket, site_tracker) = (TrackingLoop::bind()?, site_tracker(&record, Choice::default()));
    let links = Links::new(Arc::new(Keys::none()), Role::Read, Nonces::new([0; 16]), Clear::Believed);
    let mut tracking = TrackingLoop::new(socket, (registry, links), None, site_tracker, Parts::default())?;
    let answers = Answers::of(&record);
    let (begun, before_s) = (Instant::now(), processor_s(None));
    let sent = std::thread::scope(|scope| {
        let sender = scope.spawn(|| send(&record, answers, &sockets, begun));
        while tracking.now_us() < (u64::from(seconds) + 1) * 1_000_000 {
            tracking.snapshot()?;
        }
        sender.join().map_err(|_| std::io::Error::other("the sender fell over"))
    })?;
    let sessions = tracking.sessions();
    let drops = sessions.drops();
    let came: u64 = sessions.iter().map(Session::reports).sum::<u64>()
        + drops.repeated
        + drops.late
        + drops.early
        + drops.unplaced
        + drops.ahead
        + drops.jump;
    if drops.late > 0 {
        println!("  ({} of them came too late to be used)", drops.late);
    }
    println!(
        "  (processor time: tracking {:.1} s, receiver {:.1} s, sender {:.1} s)",
        processor_s(None) - before_s,
        processor_s(Some("receiver")),
        sent.processor_s
    );
    println!("  (the sender was late itself with {}, by up to {:.2} s)", sent.behind, sent.most_behind_s);
    Ok((sent.reports, sent.reports.saturating_sub(came)))
}

fn report(loopback_s: u32, loopback_modules: usize) -> Result<ExitCode, Box<dyn Error>> {
    let mut over = Vec::new();
    println!(
        "{:<46}{:>8}{:>8}{:>14}{:>12}{:>14}",
        "", "reports", "tracks", "instructions", "µs/report", "× real time"
    );
    let mut costs = Vec::new();
    for world in &WORLDS {
        let cost = cost(world, Choice::default(), true)?;
        cost.print(world.what);
        costs.push(cost);
    }
    let mut rendered = Vec::new();
    for (world, aim) in &RENDERED {
        let what = format!("rendering: {}", world.what);
        let cost = cost(world, "rendering".parse()?, matches!(aim, Aim::Instructions(_)))?;
        cost.print(&what);
        rendered.push((what, cost, aim));
    }
    let [door, two, four, sixty_four, five_hundred] = costs.as_slice() else { return Ok(ExitCode::FAILURE) };
    if let Some(count) = door.instructions.filter(|count| *count > EIGHT_BUDGET) {
        over.push(format!(
            "eight people before two modules take {count} instructions, more than {EIGHT_BUDGET}"
        ));
    }
    if let (Some(two), Some(four), Some(many)) =
        (two.instructions, four.instructions, sixty_four.instructions)
    {
        let (growth, from_four) = (many as f64 / two as f64, many as f64 / four as f64);
        println!("\nat 64 modules {growth:.2} times what it is at 2, {from_four:.2} times what it is at 4");
        println!("at most {EIGHT_BUDGET} with eight people and two modules; {GROWTH_BUDGET} times at 64");
        if growth > GROWTH_BUDGET {
            over.push(format!(
                "at 64 modules {growth:.2} times as much as at two, more than {GROWTH_BUDGET}"
            ));
        }
    }
    for (what, cost, aim) in rendered {
        match (aim, cost.instructions) {
            (Aim::Instructions(most), Some(count)) => {
                println!("{what}: {:.2} times the aim of {most} instructions", count as f64 / *most as f64);
            }
            (Aim::Instructions(_), None) => {}
            (Aim::RealTime(times), _) => {
                println!("{what}: {:.1} times real time on one core, aim {times}", cost.real_time);
            }
        }
    }
    println!("500 modules on one core: {:.1} times real time, aim {AIM_REAL_TIME}", five_hundred.real_time);
    if loopback_s > 0 {
        let (sent, lost) = loopback(loopback_modules, loopback_s)?;
        println!(
            "over the loopback for {loopback_s} s: {sent} reports of {loopback_modules} modules, {lost} lost"
        );
        if lost > 0 {
            over.push(format!("{lost} of {sent} reports were lost on the loopback"));
        }
    }
    for line in &over {
        eprintln!("over budget: {line}");
    }
    Ok(if over.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let arguments: Vec<_> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    if let [flag, path, halls, end, tracker] = arguments.as_slice()
        && flag == "--run"
    {
        let record = load(Path::new(path), halls.parse()?)?;
        let (first_s, last_s) = window_s(&record);
        let mut site_tracker = site_tracker(&record, tracker.parse()?);
        feed(&record, &mut site_tracker, -1.0, if end == "first" { first_s } else { last_s });
        return Ok(ExitCode::SUCCESS);
    }
    let number = |flag: &str, otherwise: u32| {
        let at = arguments.iter().position(|argument| argument == flag);
        at.map_or(Ok(otherwise), |at| arguments.get(at + 1).map_or("", String::as_str).parse())
    };
    report(number("--loopback", 0)?, number("--loopback-modules", 64)? as usize)
}
