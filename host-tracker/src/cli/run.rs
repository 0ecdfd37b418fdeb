//! `kehai-tracker run`: follows people with live modules.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

use clap::Args;
use host_tracker::door::{Card, DoorDesk, Doors, Told as DoorTold};
use host_tracker::frame::{Frame, ModuleLine, unix_ms};
use host_tracker::geometry::Pose;
use host_tracker::http::{Desk, Server};
use host_tracker::jsonl::write_line;
use host_tracker::mqtt::{self, Broker, Publisher, Topics};
use host_tracker::service::{Options, Service};
use host_tracker::site::Site;
use host_tracker::site::file::SiteFile;
use host_tracker::store::card::CardKey;
use host_tracker::store::pose::{self, Source};
use host_tracker::store::{Keep, Store, known_before};
use host_tracker::trackers::Choice;

use super::{Failure, address};

/// Follow people with live modules
///
/// Modules that the site names are found by themselves, by DNS-SD as _kehai._udp; others are only asked who they
/// are. What is wrong with a module is said on stderr, when it begins and when it ends. Ends with Ctrl-C.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The site: where the modules, walls, zones and entries are
    #[arg(long, value_name = "FILE.toml")]
    site: PathBuf,

    /// A module's address, beside those that are found; port 4040 if none is given
    #[arg(long, value_name = "HOST[:PORT]")]
    module: Vec<String>,

    /// Look for no modules on the network: only those at --module
    #[arg(long, requires = "module")]
    no_mdns: bool,

    /// Write tracks and zones, a JSON line every 0.1 s; - is the terminal, and the default when nobody else is told
    #[arg(long, value_name = "FILE")]
    tracks_out: Option<PathBuf>,

    /// Serve the live map, for this machine alone unless an address is given: 0.0.0.0:8420 is for the whole network, of
    /// which everybody may then edit the site [default: 127.0.0.1:8420]
    #[arg(long, value_name = "[IP:]PORT", num_args = 0..=1, default_missing_value = "127.0.0.1:8420", value_parser = listen)]
    http: Option<SocketAddr>,

    /// A name under which browsers may open the map, beside addresses and local names
    #[arg(long, value_name = "NAME", requires = "http")]
    http_name: Vec<String>,

    /// The tracker
    #[arg(long, value_name = "NAME", default_value_t = Choice::default())]
    tracker: Choice,

    /// Publish to this broker, with discovery for Home Assistant
    #[arg(
        long,
        value_name = "mqtt://[USER:PASSWORD@]HOST[:PORT]",
        env = "KEHAI_MQTT",
        hide_env_values = true
    )]
    mqtt: Option<Broker>,

    /// In front of every topic
    #[arg(long, value_name = "TOPIC", default_value = "kehai", value_parser = prefix)]
    mqtt_prefix: String,

    /// Name of the site there [default: the site file's]
    #[arg(long, value_name = "NAME")]
    mqtt_site: Option<String>,

    /// Where Home Assistant discovers; empty: it is not told
    #[arg(long, value_name = "TOPIC", default_value = "homeassistant", value_parser = prefix)]
    home_assistant_prefix: String,

    /// Keep what happens in this database, made if missing
    #[arg(long, value_name = "FILE")]
    db: Option<PathBuf>,

    /// Days it is kept
    #[arg(long, value_name = "N", default_value_t = 365, requires = "db")]
    keep_days: u32,

    /// Days for what is kept of cards: their hash by this site's key
    #[arg(long, value_name = "N", default_value_t = 30, requires = "db")]
    keep_card_days: u32,

    /// Record everything that comes in, for kehai-tracker replay and Foxglove
    #[arg(long, value_name = "FILE.mcap")]
    record: Option<PathBuf>,

    /// Stop after so long
    #[arg(long, value_name = "N")]
    seconds: Option<u64>,
}

const EXAMPLES: &str = "Examples:
  kehai-tracker run --site door.toml --tracks-out -
  kehai-tracker run --site door.toml --http
  kehai-tracker run --site door.toml --module 192.168.1.20 --module 192.168.1.21
  kehai-tracker run --site door.toml --mqtt mqtt://homeassistant.local
  kehai-tracker run --site door.toml --db door.db --keep-days 30
  kehai-tracker run --site door.toml --no-mdns --module 127.0.0.1:4040 --tracks-out tracks.jsonl --seconds 60";

/// Between two looks at whether it is to end.
const WAIT: Duration = Duration::from_millis(200);

/// Runs the tracker until Ctrl-C.
///
/// # Errors
/// One line: what is wrong with which file or address.
pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let file = SiteFile::load(&arguments.site)?;
    let site = (*file.current().site).clone();
    let modules = arguments
        .module
        .iter()
        .map(|text| address(text).map_err(|error| format!("--module {error}")))
        .collect::<Result<Vec<_>, _>>()?;
    let silent = arguments.mqtt.is_some()
        || arguments.db.is_some()
        || arguments.record.is_some()
        || arguments.http.is_some();
    let tracks_out = arguments.tracks_out.as_deref().or((!silent).then_some(Path::new("-")));
    let mut out = tracks_out.map(open).transpose()?;
    let topics = topics(&arguments);
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }
    let now_ms = unix_ms();
    let (known, event) = arguments.db.as_deref().map_or((None, None), |file| known_before(file, now_ms));
    let restore = known.map(|frame| (frame.line, now_ms.saturating_sub(frame.unix_ms) as f64 * 1e-3));
    // Who limits the size of files asks for an error, not for the tracker's death.
    #[cfg(unix)]
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default())?;
    let keep = Keep { days: arguments.keep_days, card_days: arguments.keep_card_days };
    let open_store = |file| Store::open(file, &Arc::new(site.clone()), keep);
    let store = arguments.db.as_deref().map(open_store).transpose()?;
    if let Some((store, event)) = store.as_ref().zip(event) {
        eprintln!("{}: {}", event.kind, event.text);
        store.happened(event);
    }
    let service = Arc::new(Service::start(Options {
        restore,
        site,
        modules,
        discover: !arguments.no_mdns,
        tracker: arguments.tracker,
        record: arguments.record,
    })?);
    let doors = Doors::start(service.site(), service.queue(), service.doors(), card_hash(&arguments.site))?;
    let passages = doors.listen();
    let publisher = arguments
        .mqtt
        .map(|broker| {
            let settings = mqtt::Settings { broker, topics, doors: Some(doors.desk()) };
            let told = Some(doors.listen());
            Publisher::start(settings, service.queue(), told, |text| eprintln!("{text}"))
        })
        .transpose()?;
    let frames = service.queue();
    let mut sites = service.site();
    let map = arguments
        .http
        .map(|listen| map(listen, file, arguments.db.clone(), &service, doors.desk(), arguments.http_name))
        .transpose()?;
    let end_s = arguments.seconds.map_or(f64::INFINITY, |seconds| seconds as f64);
    let mut told = Told::default();
    let mut last = Arc::<Frame>::default();
    while !stop.load(Ordering::Relaxed) && last.line.t < end_s {
        match frames.recv_timeout(WAIT) {
            Ok(frame) => last = frame,
            Err(RecvTimeoutError::Timeout) => continue,
            Err(RecvTimeoutError::Disconnected) => break,
        }
        if let Some(store) = &store {
            if sites.has_changed().unwrap_or(false) {
                store.set_site(&sites.borrow_and_update(), Source::Map);
            }
            store.see(Arc::clone(&last));
            let state = store.state();
            service.trouble().set("database", &state.trouble);
            service.trouble().set("raw-scans", &state.raw);
        }
        for news in passages.try_iter() {
            match (news, &store) {
                (DoorTold::Passage(passed), Some(store)) => store.passed(passed),
                (DoorTold::Alarm { door, alarm: Some(alarm), .. }, _) => {
                    eprintln!("door {door}: alarm: {alarm}")
                }
                (DoorTold::NotTaken { door, why }, _) => eprintln!("door {door}: {why}"),
                _ => {}
            }
        }
        told.tell(&last);
        if let Some(out) = &mut out {
            match write_line(out, &last.line).and_then(|()| out.flush()) {
                // Whoever read the lines has had enough.
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe => break,
                other => other?,
            }
        }
    }
    drop(map);
    drop(doors);
    drop(publisher);
    // The map had the only other share of it.
    if let Some(service) = Arc::into_inner(service) {
        service.stop()?;
    }
    summary(&last)
}

/// What may be kept of a card.
type CardHash = Box<dyn Fn(&str) -> Card + Send>;

/// What makes of a card what may be kept of it, by the key beside the site's file. Without a door none is made; without
/// a key the doors have one that is lost with the process.
fn card_hash(site: &Path) -> Option<CardHash> {
    let has_doors = Site::load(site).is_ok_and(|site| !site.doors.is_empty());
    match has_doors.then(|| CardKey::load(&CardKey::beside(site)))? {
        Ok(key) => Some(Box::new(move |card| key.hash(card).into())),
        Err(error) => {
            eprintln!("{error}; cards of before are not known again");
            None
        }
    }
}

/// Serves the live map.
fn map(
    listen: SocketAddr,
    site: SiteFile,
    database: Option<PathBuf>,
    service: &Arc<Service>,
    doors: DoorDesk,
    names: Vec<String>,
) -> Result<Server, Failure> {
    let changing = Arc::clone(service);
    let changed = Box::new(move |site| changing.change_site(site));
    let noting = database.clone();
    let accepted = Box::new(move |poses: &[(String, Pose)]| {
        let note = |database: &PathBuf| pose::note(database, poses, unix_ms(), Source::Calibration);
        if let Some(Err(error)) = noting.as_ref().map(note) {
            eprintln!("accepted poses are not in the database: {error}");
        }
    });
    let (frames, calibration) = (service.frames(), service.calibration());
    let (reports, doors) = (service.reports(), Some(doors));
    let desk = Desk { frames, reports, site, changed, calibration, accepted, database, names, doors };
    let server = Server::start(listen, desk)
        .map_err(|error| format!("the live map cannot be at {listen}: {error}"))?;
    eprintln!("live map at http://{}/", server.address());
    Ok(server)
}

/// Where to listen: on this machine alone if only a port is said.
fn listen(text: &str) -> Result<SocketAddr, String> {
    let port = |text: &str| text.parse().ok().map(|port| SocketAddr::from((Ipv4Addr::LOCALHOST, port)));
    text.parse()
        .ok()
        .or_else(|| port(text))
        .ok_or_else(|| "PORT for this machine alone, or IP:PORT, as 0.0.0.0:8420 for everybody".to_owned())
}

fn prefix(text: &str) -> Result<String, String> {
    if text.contains(['#', '+', '\0']) || text.starts_with('/') || text.ends_with('/') {
        return Err("a topic has neither # nor +, and no / at its ends".to_owned());
    }
    Ok(text.to_owned())
}

fn topics(arguments: &Arguments) -> Topics {
    let file = arguments.site.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    Topics {
        title: arguments.mqtt_site.clone().or(file).unwrap_or_default(),
        prefix: arguments.mqtt_prefix.clone(),
        home_assistant: Some(arguments.home_assistant_prefix.clone()).filter(|prefix| !prefix.is_empty()),
    }
}

fn open(file: &Path) -> Result<Box<dyn Write>, String> {
    if file.as_os_str() == "-" {
        return Ok(Box::new(io::stdout()));
    }
    let file_out = File::create(file).map_err(|error| format!("{}: {error}", file.display()))?;
    Ok(Box::new(BufWriter::new(file_out)))
}

/// Alarms that have been told: whose, and which.
#[derive(Debug, Default)]
struct Told(Vec<(String, String)>);

impl Told {
    /// Tells on stderr which alarms have begun and which have ended.
    fn tell(&mut self, frame: &Frame) {
        let mut now = Vec::new();
        let of_modules = frame.modules.iter().flat_map(|module| {
            module.alarms.iter().map(move |alarm| (format!("module {}", module.name), alarm))
        });
        let own = frame.alarms.iter().map(|alarm| ("the tracker".to_owned(), alarm));
        for (who, alarm) in own.chain(of_modules) {
            let key = (who, alarm.name.clone());
            if !self.0.contains(&key) {
                eprintln!("{}: {}: {}", key.0, alarm.name, alarm.text);
            }
            now.push(key);
        }
        for (who, alarm) in self.0.iter().filter(|key| !now.contains(key)) {
            eprintln!("{who}: {alarm}: over");
        }
        self.0 = now;
    }
}

/// How the modules were, on stderr.
fn summary(last: &Frame) -> Result<(), Failure> {
    let answered: Vec<&ModuleLine> = last.modules.iter().filter(|module| !module.id.is_empty()).collect();
    for module in &answered {
        let offset =
            module.clock_offset_ms.map_or("unknown".to_owned(), |offset_ms| format!("{offset_ms:.1} ms"));
        eprintln!(
            "module {} ({}): {}, {:.1} scans/s, {:.1} % lost, clock offset {offset}",
            module.name,
            module.id,
            module.state,
            module.scans_hz,
            module.lost_share * 100.0,
        );
    }
    if answered.is_empty() {
        return Err(
            "no module answered: is it switched on and in this network? kehai-tracker module list shows \
                    what is there; --module gives an address"
                .into(),
        );
    }
    Ok(())
}
