//! `kehai-sim demo`: a simulated building or entrance, its devices, the tracker and the live map, all of it real.
//!
//! ```text
//!   people walk ─▶ sensors ─SCIP▶ modules ─UDP▶ tracker ─┬▶ live map at a local address
//!        │                            └─DNS-SD▶┘         │
//!        ├────▶ tags ────────HTTP, signs─────────▶┘      └▶ database, gone at the end unless asked for
//!        └────────────── truth ───────────────────┴─▶ summary at the end
//! ```

mod beside;
mod signs;
mod stage;
mod summary;

use std::error::Error;
use std::io::ErrorKind;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::time::{Duration, Instant};

use clap::Args;
use host_tracker::access::Access;
use host_tracker::daemon::{Daemon, Database, Next, Settings, card_key};
use host_tracker::firmware::folder::FirmwareFolder;
use host_tracker::links::LinkSettings;
use host_tracker::map::Map;
use host_tracker::net::discovery::Search;
use host_tracker::site_file::SiteFile;
use host_tracker::store::Keep;
use kehai_emulator::pc::discovery;
use kehai_tracking::keys::Clear;
use kehai_tracking::registry::Finding;
use kehai_tracking::tracker::Selected;

use beside::Devices;
use signs::Signs;
use stage::Stage;
use summary::Summary;

/// Where the map is, unless that port is taken.
const MAP: SocketAddr = SocketAddr::new(std::net::IpAddr::V4(Ipv4Addr::LOCALHOST), 8420);

/// How long a headless demo runs when nothing else is said, s.
const HEADLESS_S: f64 = 30.0;

/// Longest search for modules: on a machine with multicast they are found in one or two seconds.
const SEARCH: Duration = Duration::from_secs(10);

/// Longest wait for a frame: the stop flag is looked at this often.
const WAIT: Duration = Duration::from_millis(200);

/// Watch it work: a building with several modules in which people walk, or an entrance with every kind of source, on the live map
///
/// Every part is real: emulated sensors speak SCIP to the modules' own tasks, those send their reports over UDP, the
/// tracker follows, and the browser shows it. Runs in real time until Ctrl-C, then prints a summary.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-sim demo --open
  kehai-sim demo --headless --seconds 60
  kehai-sim demo --scene entrance --open               range finders, a depth camera, a floor and tags
  kehai-sim demo --scene guarded --open                a guarded door, with cards and numbers
  kehai-sim demo --scene home --http 0.0.0.0:8420      the map for everybody on the network")]
pub struct Arguments {
    /// No map: only the summary, after 30 s or what --seconds says
    #[arg(long, conflicts_with_all = ["open", "http"])]
    headless: bool,

    /// Stop after so many seconds
    #[arg(long, value_name = "N", value_parser = seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,

    /// Open the map in the browser
    #[arg(long)]
    open: bool,

    /// Where the map is served [default: 127.0.0.1:8420, or any free port]
    #[arg(long, value_name = "IP:PORT")]
    http: Option<SocketAddr>,

    /// A further name or address under which browsers may open the map, as of kehai-tracker run
    #[arg(long, value_name = "NAME", conflicts_with = "headless")]
    http_name: Vec<String>,

    /// One that comes with the program, such as building or entrance, or a scene of one's own, FILE.toml
    #[arg(long, value_name = "NAME", default_value = "building")]
    scene: String,

    /// Seed of everything random
    #[arg(long, value_name = "N")]
    seed: Option<u64>,

    /// Keep the site, and what is drawn on the map, in this file [default: a temporary one, removed at the end]
    #[arg(long, value_name = "FILE.toml")]
    site: Option<PathBuf>,

    /// Keep what happens in this database [default: a temporary one, removed at the end]
    #[arg(long, value_name = "FILE")]
    db: Option<PathBuf>,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }
    let stage = Stage::start(&arguments.scene, arguments.seed)?;
    let temporary = Temporary::new()?;
    let (path, kept) = match &arguments.site {
        Some(path) => (path.clone(), true),
        None => (temporary.0.join(format!("{}.toml", scene_name(&arguments.scene))), false),
    };
    if !(kept && path.exists()) {
        let text = toml::to_string(stage.site())?;
        std::fs::write(&path, text).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    let database = arguments.db.clone().unwrap_or_else(|| temporary.0.join("demo.db"));
    let found = look(&stage);
    let site = SiteFile::load(&path)?;
    let key = card_key(&path, stage.site())?;
    let settings = Settings {
        site,
        modules: stage.addresses(),
        discover: false,
        tracker: Selected::default(),
        record: None,
        database: Some(Database { file: database.clone(), keep: Keep::USUAL, restore: false }),
        map: map(arguments, &stage),
        webhook: None,
        mqtt: None,
        card_key: key.clone(),
        keys: None,
        clear: Clear::default(),
        links: LinkSettings::default(),
    };
    let mut daemon = Daemon::start(settings, |text| println!("{text}"))?;
    if let Some(address) = daemon.map_address().filter(|_| !arguments.headless) {
        tell(address, stage.about(), arguments.open);
    }
    let signs = match (&stage, daemon.map_address()) {
        (Stage::Entrance(gate), Some(address)) => Some(Signs::start(gate, local(address))),
        _ => None,
    };
    let default_s = if arguments.headless { HEADLESS_S } else { f64::INFINITY };
    let until_s = arguments.seconds.unwrap_or(default_s).min(stage.duration_s());
    let mut summary = Summary::new(key);
    let mut beside = match &stage {
        Stage::Scene(scene, _) => Some(Devices::of(scene)),
        Stage::Entrance(_) => None,
    };
    while !stop.load(Ordering::Relaxed) && stage.now_s() < until_s {
        match daemon.next(WAIT) {
            Next::Snapshot(snapshot) => summary.add(&snapshot, &stage.people(), stage.site()),
            Next::Waiting => {}
            Next::Ended => return Err("the tracker has ended".into()),
        }
        if let Some(beside) = &mut beside {
            beside.until(stage.now_s(), &daemon);
        }
        daemon.outputs().iter().for_each(|output| summary.door(output));
        if let Ok(found) = found.try_recv() {
            println!("{found}");
        }
    }
    let signs = signs.map(Signs::stop);
    let kept_rows = daemon.stop()?.unwrap_or_default();
    summary.print(&arguments.scene, signs);
    println!(
        "  database              {} transactions, {} frames missed",
        kept_rows.written, kept_rows.dropped.messages
    );
    if kept {
        println!("  the site is kept in      {}", path.display());
    }
    if arguments.db.is_some() {
        println!("  the database is kept in  {}", database.display());
    }
    Ok(())
}

/// The map. Without one, tags need a port of this machine all the same, over which they are told.
fn map(arguments: &Arguments, stage: &Stage) -> Option<Map> {
    // It shows no real people, so it needs no users: with --http the whole network may open it.
    let at = |listen: SocketAddr, names| Map {
        listen: listen.into(),
        doors: None,
        names,
        firmware: FirmwareFolder::default(),
        access: Access::open(),
        insecure: true,
    };
    match (arguments.headless, stage) {
        (false, _) => Some(at(listen(arguments.http), arguments.http_name.clone())),
        (true, Stage::Entrance(_)) => Some(at(SocketAddr::new(MAP.ip(), 0), Vec::new())),
        (true, Stage::Scene(..)) => None,
    }
}

/// Looks for the modules as a tracker on another machine would; how many were found is said once. The demo does
/// not wait for that, and the tracker is given all their addresses: there are machines without multicast, and another demo on
/// this one announces modules of the same names.
fn look(stage: &Stage) -> Receiver<String> {
    let (modules, announced) = (stage.addresses(), stage.announced());
    let (tell, told) = mpsc::channel();
    std::thread::spawn(move || {
        // The demo may have ended.
        let _ = tell.send(found(&modules, announced));
    });
    told
}

fn found(modules: &[SocketAddr], announced: usize) -> String {
    let mut found: Vec<SocketAddr> = Vec::new();
    if discovery::multicast_passes()
        && let Ok(search) = Search::start()
    {
        let end = Instant::now() + SEARCH;
        while found.len() < announced
            && let Some(finding) = search.next_before(end)
        {
            let Finding::Found(module) = finding else { continue };
            let new = |address: &SocketAddr| modules.contains(address) && !found.contains(address);
            let new = module.addresses.into_iter().find(new);
            found.extend(new);
        }
    }
    match (found.len(), announced) {
        (0, _) => "no multicast here: the tracker was given the modules' addresses".to_owned(),
        (some, all) if some == all => format!("{all} modules found by DNS-SD"),
        (some, all) => {
            format!("{some} of {all} modules found by DNS-SD; the tracker was given the others' addresses")
        }
    }
}

fn scene_name(scene: &str) -> String {
    Path::new(scene).file_stem().map_or_else(|| "site".into(), |name| name.to_string_lossy().into_owned())
}

/// Where the map is to be served.
fn listen(wanted: Option<SocketAddr>) -> SocketAddr {
    wanted.unwrap_or_else(|| match std::net::TcpListener::bind(MAP) {
        Err(error) if error.kind() == ErrorKind::AddrInUse => SocketAddr::new(MAP.ip(), 0),
        _ => MAP,
    })
}

/// Where a program on this machine reaches that address.
fn local(address: SocketAddr) -> SocketAddr {
    if address.ip().is_unspecified() {
        SocketAddr::new(Ipv4Addr::LOCALHOST.into(), address.port())
    } else {
        address
    }
}

fn tell(address: SocketAddr, about: &str, open: bool) {
    let shown = local(address);
    println!("{about}");
    println!("live map   http://{shown}/      Ctrl-C ends it");
    if open {
        let opener = if cfg!(target_os = "macos") { "open" } else { "xdg-open" };
        let mut command = Command::new(opener);
        command
            .arg(format!("http://{shown}/"))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        if let Err(error) = command.spawn() {
            eprintln!("{opener}: {error}; open the address by hand");
        }
    }
}

/// A folder that goes with the demo.
struct Temporary(PathBuf);

impl Temporary {
    fn new() -> Result<Self, String> {
        let folder = std::env::temp_dir().join(format!("kehai-demo-{}", std::process::id()));
        std::fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        Ok(Self(folder))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if let Err(error) = std::fs::remove_dir_all(&self.0) {
            eprintln!("{} is left behind: {error}", self.0.display());
        }
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds.is_finite() => Ok(seconds),
        _ => Err("a number of seconds above 0".into()),
    }
}
