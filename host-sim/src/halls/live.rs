//! The halls in real time: one tracker, a tracker of each hall, a router of Zenoh and the service of the site, as processes.
//!
//! ```text
//!   emulated modules ─UDP─┬─▶ relays ─▶ kehai-tracker run ───────────────────────────────────▶ GET /api/state ─╮
//!   (this process)        ├─▶ kehai-tracker run --area halls/south-west ─╮                          ├─▶ judged, ten times a second
//!                         ├─▶ …                                          ├─ router ─▶ kehai-tracker site halls ─▶ GET /api/state
//!                         └─▶ kehai-tracker run --area halls/north-east ─╯  (this process; with loss two, and what loses between them)
//! ```

use std::collections::BTreeMap;
use std::error::Error;
use std::fs;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use host_tracker::store::card::CardKey;
use kehai_tracking::card::Card;
use kehai_tracking::geometry::Point;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::Snapshot;
use kehai_tracking::tracker::Selected;
use serde_json::json;

use super::cards::{Cards, Due, SIGMA_M};
use super::judge::{Judge, numbers};
use super::network::{Network, free};
use super::relay::Relay;
use super::simulated::Outcome;
use super::totals::Totals;
use super::world::{AREAS, Halls, area};
use crate::building::Building;
use crate::run::TICK_US;
use crate::score::Target;

/// The key of all cards, copied beside the file of each site: a card has one label everywhere.
const KEY: &str = "all.key";

/// A reader that is in no hall: a site with one has a key for cards. Each card is read at a place of its own.
const READER: &str = "[[reader]]\nname = \"cards\"\nx = 0.0\ny = 0.0\nreach_m = 0.1\n";

/// An answer takes no longer, or the picture is missed.
const PATIENCE: Duration = Duration::from_secs(1);

/// Until every process answers: they start on a busy machine.
const STARTED: Duration = Duration::from_secs(60);

/// What came out, and what this machine could not do in time.
#[derive(Debug, Default)]
pub struct Live {
    /// As of a simulated run.
    pub outcome: Outcome,
    /// Pictures that were due, and those for which some process did not answer in time.
    pub pictures: u64,
    /// See there.
    pub missed: u64,
    /// The longest answer of an area's tracker, bytes: a frame.
    pub frame_bytes: usize,
    /// Reports of modules that the one tracker never got, and that those of the areas did not, %: the worst module.
    pub lost_percent: [f64; 2],
}

/// A tracker or the service, and where it answers. It ends when this is dropped.
struct Process {
    child: Child,
    address: SocketAddr,
}

impl Process {
    fn start(program: &Path, arguments: &[String]) -> Result<Self, Box<dyn Error>> {
        let address = free()?;
        let mut command = Command::new(program);
        command.args(arguments).args(["--http", &address.to_string()]);
        let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        let child = child.map_err(|error| format!("{}: {error}", program.display()))?;
        Ok(Self { child, address })
    }

    /// Its newest frame, and of how many bytes that is.
    fn says(&self, agent: &ureq::Agent) -> Option<(Snapshot, usize)> {
        let state = format!("http://{}/api/state", self.address);
        let text = agent.get(&state).call().ok()?.body_mut().read_to_string().ok()?;
        Some((serde_json::from_str(&text).ok()?, text.len()))
    }

    /// Tells it that a card was read at a place. One that comes before any track is refused, and changes nothing.
    fn reads(&self, agent: &ureq::Agent, due: &Due) {
        let sign = json!({"id": id(due.person), "x": due.at.x, "y": due.at.y, "sigma_m": SIGMA_M});
        let _ = agent.post(&format!("http://{}/api/sign", self.address)).send(&sign.to_string());
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The program of the trackers: the one that is named, or the one beside this program.
///
/// # Errors
/// There is none.
pub fn tracker(named: Option<&Path>) -> Result<PathBuf, String> {
    let beside = || Some(std::env::current_exe().ok()?.with_file_name("kehai-tracker"));
    let found = named.map(Path::to_path_buf).or_else(beside).filter(|path| path.exists());
    found.ok_or_else(|| {
        "there is no kehai-tracker beside this program: build it, or say where it is by --tracker".to_owned()
    })
}

/// The processes that follow the halls.
struct Trackers {
    one: Process,
    areas: Vec<Process>,
    site: Process,
    /// The one tracker's ways to the modules.
    _relays: Vec<Relay>,
}

impl Trackers {
    fn start(
        program: &Path,
        folder: &Path,
        building: &Building,
        (all, model): (&Site, Selected),
        network: &Network,
    ) -> Result<Self, Box<dyn Error>> {
        // The trackers of two areas have taken both places that a module at a border has for this machine's address.
        let mut relays = Vec::new();
        let mut relayed = Vec::new();
        for (name, module) in building.modules() {
            let relay = Relay::to(*module)?;
            relayed.push((name.clone(), relay.at()));
            relays.push(relay);
        }
        let run = |name: &str,
                   site: &Site,
                   modules: &[(String, SocketAddr)]|
         -> Result<Vec<String>, Box<dyn Error>> {
            let file = folder.join(format!("{name}.toml"));
            fs::write(&file, toml::to_string(site)? + READER)?;
            fs::copy(folder.join(KEY), CardKey::beside(&file))?;
            let mut arguments =
                vec!["run".into(), "--no-mdns".into(), "--site".into(), file.display().to_string()];
            arguments.extend(["--tracker".into(), model.to_string()]);
            let is_its = |name: &str| site.modules.iter().any(|module| module.name == name);
            for (_, address) in modules.iter().filter(|(name, _)| is_its(name)) {
                arguments.extend(["--module".into(), address.to_string()]);
            }
            Ok(arguments)
        };
        let zenoh = |name: &str, port: u16| -> Result<[String; 2], Box<dyn Error>> {
            let file = folder.join(format!("{name}.json5"));
            fs::write(&file, Network::client(port))?;
            Ok(["--zenoh".into(), file.display().to_string()])
        };
        let [to_areas, to_site] = [zenoh("areas", network.areas_port)?, zenoh("site", network.site_port)?];
        let mut together: Vec<String> =
            vec!["site".into(), "halls".into(), "--folder".into(), folder.display().to_string()];
        together.extend(to_site);
        together.extend(AREAS.iter().flat_map(|name| ["--area".into(), (*name).into()]));
        let site = Process::start(program, &together)?;
        let of_area = |(hall, name): (usize, &&str)| {
            let mut arguments = run(name, &area(all, hall), building.modules())?;
            arguments.extend(["--area".into(), format!("halls/{name}")]);
            arguments.extend(to_areas.clone());
            Process::start(program, &arguments)
        };
        let areas = AREAS.iter().enumerate().map(of_area).collect::<Result<_, _>>()?;
        let one = Process::start(program, &run("all", all, &relayed)?)?;
        Ok(Self { one, areas, site, _relays: relays })
    }
}

/// Plays the halls in real time; this share of the frames of areas is lost between two routers.
///
/// # Errors
/// A process does not start or answer, or there is no port.
pub fn play(halls: &Halls, lost_share: f64, program: &Path) -> Result<Live, Box<dyn Error>> {
    let scene = halls.scene()?;
    let folder = Folder::new()?;
    let key = CardKey::load(&folder.0.join(KEY))?;
    let network = Network::start(lost_share, halls.seed)?;
    // The processes need some seconds before they look, and the world does not wait for them.
    let building = Building::start(&scene, halls.seed)?;
    let trackers = Trackers::start(program, &folder.0, &building, (&scene.site, halls.tracker), &network)?;
    let agent: ureq::Agent = ureq::Agent::config_builder().timeout_global(Some(PATIENCE)).build().into();
    let all = || [&trackers.one, &trackers.site].into_iter().chain(&trackers.areas);
    let begun = Instant::now();
    while !all().all(|process| process.says(&agent).is_some()) {
        if begun.elapsed() > STARTED {
            return Err("not every tracker answers within a minute".into());
        }
        sleep(PATIENCE / 10);
    }
    let mut live = Live::default();
    let (mut judge_one, mut judge_four, mut totals) = (Judge::default(), Judge::default(), Totals::default());
    let mut lost = [0.0_f64; 2];
    let every_s = TICK_US as f64 * 1e-6;
    let (mut cards, mut labels) = (Cards::default(), BTreeMap::new());
    let mut next_s = building.now_s();
    while next_s < halls.seconds {
        sleep(Duration::from_secs_f64((next_s - building.now_s()).max(0.0)));
        let t_s = building.now_s();
        let people = building.world().truth(t_s).people;
        let truth: Vec<Target> = people
            .iter()
            .map(|person| Target { id: person.id as u64, at: Point::new(person.x, person.y), beams: None })
            .collect();
        for due in cards.due(t_s, truth.iter().map(|target| (target.id, target.at))) {
            labels.insert(due.person, Card::from(key.hash(&id(due.person))).label());
            for tracker in trackers.areas.get(due.hall).into_iter().chain([&trackers.one]) {
                tracker.reads(&agent, &due);
            }
        }
        if t_s < halls.judged_from_s() {
            next_s = (next_s + every_s).max(building.now_s());
            continue;
        }
        live.pictures += 1;
        let said: Vec<Option<(Snapshot, usize)>> = all().map(|process| process.says(&agent)).collect();
        // What was missed while it was asked is missed.
        next_s = (next_s + every_s).max(building.now_s());
        let said: Option<(Vec<Snapshot>, Vec<usize>)> = said.into_iter().collect();
        let Some(([one, site, areas @ ..], [_, _, bytes @ ..])) =
            said.as_ref().map(|(frames, bytes)| (frames.as_slice(), bytes.as_slice()))
        else {
            live.missed += 1;
            continue;
        };
        live.frame_bytes = bytes.iter().copied().fold(live.frame_bytes, usize::max);
        let local: Vec<_> = areas.iter().map(|frame| numbers(&truth, &frame.line.tracks)).collect();
        judge_one.frame(t_s, &truth, &one.line.tracks, &one.names, &labels, &[]);
        judge_four.frame(t_s, &truth, &site.line.tracks, &site.names, &labels, &local);
        totals.frame([one.total.count, site.total.count], u32::try_from(truth.len()).unwrap_or(u32::MAX));
        let worst = |frames: &[Snapshot]| {
            let shares =
                frames.iter().flat_map(|frame| &frame.modules).filter_map(|module| module.lost_share);
            shares.fold(0.0, f64::max)
        };
        lost = [lost[0].max(worst(std::slice::from_ref(one))), lost[1].max(worst(areas))];
    }
    live.outcome = Outcome::of(judge_one, judge_four, totals, network.lost());
    live.lost_percent = lost.map(|share| share * 100.0);
    Ok(live)
}

/// What is on the card of a person.
fn id(person: u64) -> String {
    format!("P{person}")
}

/// The files of the processes; gone at the end.
struct Folder(PathBuf);

impl Folder {
    fn new() -> std::io::Result<Self> {
        let folder =
            std::env::temp_dir().join(format!("kehai-halls-{}-{}", std::process::id(), free()?.port()));
        fs::create_dir_all(&folder)?;
        Ok(Self(folder))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}
