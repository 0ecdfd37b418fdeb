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
//! `-- --loopback-modules N` to so many modules, for a minute if nothing else is said.
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
use host_sim::world::random::{Purpose, Stream};
use host_sim::world::scene::Scene;
use host_sim::world::variation::{Letter, Variation};
use host_tracker::net::tracking::{Parts, TrackingLoop};
use kehai::seal::{Nonces, Role};
use kehai::wire::{Cookie, HEADER_LEN, Incoming, Message, Request};
use kehai_tracking::keys::{Clear, Keys, Links};
use kehai_tracking::observation::LATE_S;
use kehai_tracking::registry::Registry;
use kehai_tracking::session::Session;
use kehai_tracking::site_tracker::SiteTracker;
use kehai_tracking::tracker::LifeCycle;

/// Most instructions a report, with eight people before two modules: a millisecond of a small computer.
const EIGHT_BUDGET: u64 = 3_000_000;

/// The same with one person in view of both.
const ONE_BUDGET: u64 = 300_000;

/// What a report may cost in sixteen halls of four modules, of what it costs in three. Walls hide the people of the other halls; what
/// still grows with the site is small beside the bodies.
const GROWTH_BUDGET: f64 = 1.3;

/// What a second may cost when five of six reports are lost, of what it costs when all arrive: a body that is looked for less often may
/// be anywhere in a wider place. If it were more than 1, a tracker that falls behind would never catch up.
const OVERLOAD_BUDGET: f64 = 0.8;

/// So many times faster than real time on one core are 64 modules to be, and 500; printed, not guarded.
const AIM_SIXTY_FOUR: f64 = 4.0;
const AIM_FIVE_HUNDRED: f64 = 1.0;

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
    /// One report in so many arrives.
    arrives: u64,
}

const WORLDS: [World; 8] = [
    World {
        name: "door",
        what: "2 modules, 8 people before a door",
        halls: 0,
        modules: 2,
        people: 8,
        arrives: 1,
    },
    World { name: "one", what: "2 modules, 1 person", halls: 1, modules: 2, people: 1, arrives: 1 },
    World { name: "two", what: "2 modules, 2 people", halls: 1, modules: 2, people: 2, arrives: 1 },
    World { name: "four", what: "4 modules, 4 people", halls: 1, modules: 4, people: 4, arrives: 1 },
    World {
        name: "twelve",
        what: "12 modules, 12 people in three halls",
        halls: 3,
        modules: 4,
        people: 4,
        arrives: 1,
    },
    World { name: "sixty-four", what: "64 modules, 64 people", halls: 16, modules: 4, people: 4, arrives: 1 },
    World {
        name: "lost",
        what: "64 modules, 64 people, five of six reports lost",
        halls: 16,
        modules: 4,
        people: 4,
        arrives: 6,
    },
    World {
        name: "five-hundred",
        what: "500 modules, 500 people",
        halls: 125,
        modules: 4,
        people: 4,
        arrives: 1,
    },
];

/// The tracker with rules, beside which the cost is printed.
const RULES: &str = "kehai-rules";

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

/// The world in the file, as often as it is needed; of its reports one in `arrives` arrives.
fn load(path: &Path, halls: usize, arrives: u64) -> Result<Record, Box<dyn Error>> {
    let record = Record::load(path)?;
    let mut record = if halls > 1 { record.copies(halls, APART_M) } else { record };
    // Drawn: if it were every sixth, the modules would take turns.
    let mut stream = Stream::new(1, Purpose::Network, [0, 0]);
    let mut is_kept = |bytes: &[u8]| !is_report(bytes) || stream.chance(1.0 / arrives as f64);
    record.arrivals.retain(|arrival| is_kept(&arrival.bytes));
    Ok(record)
}

fn is_report(bytes: &[u8]) -> bool {
    matches!(Message::decode(bytes), Ok((_, Message::Report(_))))
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
    let (path, tracker) = (path.to_str()?, tracker.to_string());
    let (halls, arrives) = (world.halls.to_string(), world.arrives.to_string());
    let count = |end: &str| counted::instructions(&["--run", path, &halls, &arrives, end, &tracker], None);
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

fn cost(world: &World, path: &Path, tracker: Choice, counts: bool) -> Result<Cost, Box<dyn Error>> {
    let record = load(path, world.halls, world.arrives)?;
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
    let instructions = if counts { instructions(path, world, tracker, reports) } else { None };
    Ok(Cost {
        instructions,
        us: best_s * 1e6 / reports.max(1) as f64,
        real_time: (last_s - first_s) / best_s,
        reports,
        people,
    })
}

/// A module of the record, as it answers the live host: with what it answered the host of the record, sooner or later.
#[derive(Default)]
struct Answers {
    /// Where the host is, once it has asked.
    host: Option<SocketAddr>,
    /// What it answered to who had no cookie.
    cookie: Option<Vec<u8>>,
    /// What it answered to its subscriber, and its clock, µs ahead of the record's.
    subscribed: Option<(Vec<u8>, i64)>,
    info: Option<Vec<u8>>,
    /// Parts of its backgrounds, with their versions.
    profiles: Vec<(u32, Vec<u8>)>,
}

impl Answers {
    /// Of each module, by what it sent in the record.
    fn of(record: &Record) -> Vec<Self> {
        let mut all: Vec<Self> = record.modules.iter().map(|_| Self::default()).collect();
        for arrival in &record.arrivals {
            let Some(own) = all.get_mut(usize::from(arrival.module)) else { continue };
            match Message::decode(&arrival.bytes) {
                Ok((_, Message::Subscribed(subscribed))) if own.subscribed.is_none() => {
                    let ahead_us = subscribed.t3_us as i64 - arrival.at_us as i64;
                    own.subscribed = Some((arrival.bytes.to_vec(), ahead_us));
                }
                Ok((_, Message::Cookie { .. })) => own.cookie = Some(arrival.bytes.to_vec()),
                Ok((_, Message::Info(_))) => own.info = Some(arrival.bytes.to_vec()),
                Ok((_, Message::ProfilePart(part))) => {
                    own.profiles.push((part.head.object, arrival.bytes.to_vec()));
                }
                _ => {}
            }
        }
        all
    }

    /// Takes a request of the host; the datagrams that answer it at once. One to subscribe could not wait, or the host would learn a
    /// false time of the module.
    fn take(&mut self, request: &[u8], from: SocketAddr, now_us: u64) -> Vec<Vec<u8>> {
        self.host = Some(from);
        let Ok(incoming) = Incoming::open(request) else { return Vec::new() };
        let id = incoming.request_id.to_le_bytes();
        let with = |bytes: &[u8], own: &[u8]| {
            let mut answer = bytes.to_vec();
            answer[HEADER_LEN..HEADER_LEN + own.len()].copy_from_slice(own);
            answer
        };
        match incoming.request(incoming.header.identity) {
            Ok(Request::Subscribe { t1 }) if incoming.cookie == Cookie::NONE => {
                let answer = |bytes: &Vec<u8>| with(bytes, &[&id[..], &t1].concat());
                self.cookie.as_ref().map(answer).into_iter().collect()
            }
            Ok(Request::Subscribe { t1 }) => {
                let answer = |(bytes, ahead_us): &(Vec<u8>, i64)| {
                    let now_us = now_us.saturating_add_signed(*ahead_us).to_le_bytes();
                    with(bytes, &[&id[..], &t1, &now_us, &now_us].concat())
                };
                self.subscribed.as_ref().map(answer).into_iter().collect()
            }
            Ok(Request::Info) => self.info.as_ref().map(|bytes| with(bytes, &id)).into_iter().collect(),
            Ok(Request::Profile { version, .. }) => {
                let is_asked = |of: u32| version == 0 || of == u32::from(version);
                self.profiles.iter().filter(|(of, _)| is_asked(*of)).map(|(_, part)| part.clone()).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Whether a datagram of the record answers no request.
    fn is_unasked(bytes: &[u8]) -> bool {
        !matches!(
            Message::decode(bytes),
            Ok((
                _,
                Message::Cookie { .. } | Message::Subscribed(_) | Message::Info(_) | Message::ProfilePart(_)
            ))
        )
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
            for answer in answers.take(&asked[..length], from, begun.elapsed().as_micros() as u64) {
                let _ = socket.send_to(&answer, from);
            }
        }
        let Some(host) = answers.host.filter(|_| Answers::is_unasked(&arrival.bytes)) else { continue };
        if socket.send_to(&arrival.bytes, host).is_ok() && is_report(&arrival.bytes) {
            let behind_s = begun.elapsed().saturating_sub(at).as_secs_f64();
            sent.reports += 1;
            sent.behind += u64::from(behind_s > LATE_S);
            sent.most_behind_s = sent.most_behind_s.max(behind_s);
        }
    }
    Sent { processor_s: processor_s(None) - before_s, ..sent }
}

/// Follows modules over the loopback for so long; reports sent, how many of them were not used, and the most people at one time.
fn loopback(modules: usize, seconds: u32) -> Result<(u64, u64, usize), Box<dyn Error>> {
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
    let (begun, before_s, mut most) = (Instant::now(), processor_s(None), 0);
    let sent = std::thread::scope(|scope| {
        let sender = scope.spawn(|| send(&record, answers, &sockets, begun));
        while tracking.now_us() < (u64::from(seconds) + 1) * 1_000_000 {
            let tracks = tracking.snapshot()?.tracks;
            most = most.max(tracks.iter().filter(|track| track.state != LifeCycle::Tentative).count());
        }
        sender.join().map_err(|_| std::io::Error::other("the sender fell over"))
    })?;
    let (sessions, drops) = (tracking.sessions(), tracking.sessions().drops());
    let used: u64 = sessions.iter().map(Session::reports).sum();
    println!("  ({used} were used, {} came too late)", drops.late);
    println!(
        "  (processor time: tracking {:.1} s, receiver {:.1} s, sender {:.1} s)",
        processor_s(None) - before_s,
        processor_s(Some("receiver")),
        sent.processor_s
    );
    println!("  (the sender was late itself with {}, by up to {:.2} s)", sent.behind, sent.most_behind_s);
    Ok((sent.reports, sent.reports.saturating_sub(used), most))
}

fn report(loopback_s: u32, loopback_modules: usize) -> Result<ExitCode, Box<dyn Error>> {
    let mut over = Vec::new();
    println!(
        "{:<46}{:>8}{:>8}{:>14}{:>12}{:>14}",
        "", "reports", "tracks", "instructions", "µs/report", "× real time"
    );
    let paths = WORLDS.iter().map(recorded).collect::<Result<Vec<_>, _>>()?;
    let mut costs = Vec::new();
    for (world, path) in WORLDS.iter().zip(&paths) {
        let cost = cost(world, path, Choice::default(), true)?;
        cost.print(world.what);
        costs.push(cost);
    }
    let rules: Choice = RULES.parse()?;
    for (world, path) in WORLDS.iter().zip(&paths) {
        cost(world, path, rules, false)?.print(&format!("{RULES}: {}", world.what));
    }
    let [eight, one, _, _, twelve, sixty_four, overloaded, five_hundred] = costs.as_slice() else {
        return Ok(ExitCode::FAILURE);
    };
    println!();
    for (what, cost, most) in [("eight people", eight, EIGHT_BUDGET), ("one person", one, ONE_BUDGET)] {
        let count = counted::shown(cost.instructions);
        println!("{what} before two modules: {count} instructions a report, at most {most}");
        if cost.instructions.is_some_and(|count| count > most) {
            over.push(format!("{what} before two modules take {count} instructions, more than {most}"));
        }
    }
    if let (Some(few), Some(many)) = (twelve.instructions, sixty_four.instructions) {
        let growth = many as f64 / few as f64;
        println!("at 64 modules {growth:.2} times what it is at 12, at most {GROWTH_BUDGET}");
        if growth > GROWTH_BUDGET {
            over.push(format!("at 64 modules {growth:.2} times as much as at 12, more than {GROWTH_BUDGET}"));
        }
    }
    if let (Some(all), Some(some)) = (sixty_four.instructions, overloaded.instructions) {
        let second = |each: u64, cost: &Cost| (each * cost.reports) as f64;
        let share = second(some, overloaded) / second(all, sixty_four);
        println!(
            "with five of six reports lost {share:.2} of the instructions a second, at most {OVERLOAD_BUDGET}"
        );
        if share > OVERLOAD_BUDGET {
            over.push(format!("with five of six reports lost {share:.2} of the instructions a second, more than {OVERLOAD_BUDGET}"));
        }
    }
    for (modules, cost, aim) in [(64, sixty_four, AIM_SIXTY_FOUR), (500, five_hundred, AIM_FIVE_HUNDRED)] {
        println!("{modules} modules on one core: {:.1} times real time, aim {aim}", cost.real_time);
    }
    if loopback_s > 0 {
        let (sent, lost, most) = loopback(loopback_modules, loopback_s)?;
        println!(
            "over the loopback for {loopback_s} s: {sent} reports of {loopback_modules} modules, {lost} lost; at most {most} people"
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
    if let [flag, path, halls, arrives, end, tracker] = arguments.as_slice()
        && flag == "--run"
    {
        let record = load(Path::new(path), halls.parse()?, arrives.parse()?)?;
        let (first_s, last_s) = window_s(&record);
        let mut site_tracker = site_tracker(&record, tracker.parse()?);
        feed(&record, &mut site_tracker, -1.0, if end == "first" { first_s } else { last_s });
        return Ok(ExitCode::SUCCESS);
    }
    let number = |flag: &str| {
        let at = arguments.iter().position(|argument| argument == flag);
        at.map(|at| arguments.get(at + 1).map_or("", String::as_str).parse::<u32>()).transpose()
    };
    let modules = number("--loopback-modules")?;
    let seconds = number("--loopback")?.or(modules.map(|_| 60));
    report(seconds.unwrap_or(0), modules.unwrap_or(64) as usize)
}
