//! `kehai-tracker run`: follows people with live modules.

use std::fs::File;
use std::io::{self, Write};
use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Args;
use host_tracker::access::file::AccessFile;
use host_tracker::access::{Access, FIRST, first_admin};
use host_tracker::certificate::Certificate;
use host_tracker::daemon::{Daemon, DaemonError, Database, Map, Next, Settings, card_key, is_reached};
use host_tracker::mqtt::{Broker, Topics};
use host_tracker::site_file::SiteFile;
use host_tracker::store::Keep;
use host_tracker::web::{Bind, names_of_this_machine};
use kehai_tracking::alarm::{AlarmKind, Alarms, Changes};
use kehai_tracking::door::doors::Output;
use kehai_tracking::snapshot::{ModuleLine, Snapshot};
use kehai_tracking::tracker::Selected;

use super::address::address;
use super::failure::Failure;
use super::supervisor::Supervisor;
use super::tracks_out::TracksOut;

/// Follow people with live modules
///
/// Modules that the site names are found by themselves, by DNS-SD as _kehai._udp; others are only asked who they
/// are. What is wrong with a module is logged on stderr, when it begins and when it ends. Ends with Ctrl-C.
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

    /// Serve the live map, for this machine alone unless an address is given: 0.0.0.0:8420 is for the whole network, which
    /// has to log in [default: 127.0.0.1:8420]
    #[arg(long, value_name = "[IP:]PORT", num_args = 0..=1, default_missing_value = "127.0.0.1:8420", value_parser = listen)]
    http: Option<SocketAddr>,

    /// Take messages to doors at this address alone, by connections of their own: a flood of the map does not reach
    /// them, and who sees the map need not reach them [default: at the map's address]
    #[arg(long, value_name = "[IP:]PORT", requires = "http", value_parser = listen)]
    door_http: Option<SocketAddr>,

    /// A further name or address under which browsers may open the map: localhost, this machine's own name, and the
    /// address that a connection reaches are allowed without
    #[arg(long, value_name = "NAME", requires = "http")]
    http_name: Vec<String>,

    /// If nobody may log in yet, add the user admin, and say its password once in the log
    #[arg(long)]
    first_admin: bool,

    /// Serve this machine over TLS, too: others are served over TLS anyway, by a certificate made beside the site's file
    #[arg(long, requires = "http")]
    tls: bool,

    /// Serve over TLS by this certificate, with those between it and its authority, in PEM
    #[arg(long, value_name = "FILE.pem", requires = "http", requires = "tls_key")]
    tls_cert: Option<PathBuf>,

    /// The key of --tls-cert
    #[arg(long, value_name = "FILE.pem", requires = "tls_cert")]
    tls_key: Option<PathBuf>,

    /// Serve others than this machine in clear, and although nobody needs to log in: then everybody who reaches the map may do
    /// everything
    #[arg(long, requires = "http")]
    insecure: bool,

    /// The tracker: kehai, or rendering (experimental: follows people by one formula; it knows no things and no wheels,
    /// takes back no people after a restart, and is far slower)
    #[arg(long, value_name = "NAME", default_value_t = Selected::default())]
    tracker: Selected,

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
    #[arg(long, value_name = "N", default_value_t = Keep::USUAL.days, requires = "db")]
    keep_days: u32,

    /// Days for what is kept of cards: their hash by this site's key
    #[arg(long, value_name = "N", default_value_t = Keep::USUAL.card_days, requires = "db")]
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
    let site = SiteFile::load(&arguments.site)?;
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
    // A limit on the size of files is an error of the file, not the tracker's death.
    #[cfg(unix)]
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default())?;
    let keep = Keep { days: arguments.keep_days, card_days: arguments.keep_card_days };
    let card_key = card_key(&arguments.site, &site.current().site).unwrap_or_else(|error| {
        tracing::warn!("{error}; cards of before are not known again");
        None
    });
    let access = access(&arguments)?;
    let certificate = certificate(&arguments)?;
    let everywhere = arguments.tls || arguments.tls_cert.is_some();
    let bind = |address: SocketAddr| Bind {
        address,
        certificate: certificate.clone().filter(|_| everywhere || is_reached(&address)),
    };
    let (map_bind, door_bind) = (arguments.http.map(bind), arguments.door_http.map(bind));
    let scheme = |bind: &Option<Bind>| bind.as_ref().map_or("http", Bind::scheme);
    let schemes = [scheme(&map_bind), scheme(&door_bind)];
    let settings = Settings {
        site,
        modules,
        discover: !arguments.no_mdns,
        tracker: arguments.tracker,
        record: arguments.record,
        database: arguments.db.map(|file| Database { file, keep, restore: true }),
        map: map_bind.map(|listen| Map {
            listen,
            doors: door_bind,
            names: arguments.http_name,
            access,
            insecure: arguments.insecure,
        }),
        mqtt: arguments.mqtt.map(|broker| (broker, topics)),
        card_key,
    };
    let mut daemon = match Daemon::start(settings, |text| tracing::info!("{text}")) {
        Err(error @ DaemonError::Open(_)) => {
            let site = arguments.site.display();
            let first = format!("kehai-tracker user add NAME --role admin --site {site}");
            return Err(format!("{error}: {first} makes the first user (--insecure goes without)").into());
        }
        started => started?,
    };
    if let Some(address) = daemon.map_address() {
        tracing::info!("live map at {}://{address}/", schemes[0]);
    }
    if let (Some(address), Some(_)) = (daemon.door_address(), arguments.door_http) {
        tracing::info!("messages to doors at {}://{address}/api/door", schemes[1]);
    }
    if let Some(certificate) = certificate {
        let (file, fingerprint) = (certificate.file().display(), certificate.fingerprint());
        tracing::info!("certificate {file} has the SHA-256 fingerprint {fingerprint}");
    }
    let mut supervisor = Supervisor::ready();
    let end_s = arguments.seconds.map_or(f64::INFINITY, |seconds| seconds as f64);
    let mut alarms = Alarms::default();
    let mut last = Arc::<Snapshot>::default();
    while !stop.load(Ordering::Relaxed) && last.line.t < end_s {
        match daemon.next(WAIT) {
            Next::Snapshot(snapshot) => {
                last = snapshot;
                supervisor.lives();
            }
            Next::Waiting => continue,
            Next::Ended => break,
        }
        for output in daemon.outputs() {
            if let Output::NotTaken { door, why } = output {
                tracing::warn!("door {door}: {why}");
            }
        }
        say(&alarms.update(last.active_alarms()));
        if let Some(out) = &mut out {
            match out.line(&last.line) {
                // The reader of the lines has had enough, and there is no other.
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe && !silent => break,
                _ => daemon.alarms().set(AlarmKind::TracksOut, out.trouble()),
            }
        }
    }
    drop(supervisor);
    daemon.stop()?;
    summary(&last, silent)
}

/// Who may do what; the first of them, if one is to be made.
fn access(arguments: &Arguments) -> Result<Access, Failure> {
    let file = AccessFile::beside(&arguments.site);
    if arguments.first_admin
        && let Some(password) = first_admin(&file)?
    {
        tracing::info!("the first user is {FIRST}, with the password {password}: it is not said again");
    }
    let access = Access::of(file);
    if arguments.insecure {
        let what = match access.is_open() {
            true => "everybody who reaches the map may do everything",
            false => "passwords and tokens go in clear over the network",
        };
        tracing::warn!("--insecure: {what}");
    }
    Ok(access)
}

/// What TLS shows, if it is spoken anywhere.
fn certificate(arguments: &Arguments) -> Result<Option<Certificate>, Failure> {
    if let (Some(certificate), Some(key)) = (&arguments.tls_cert, &arguments.tls_key) {
        return Ok(Some(Certificate::from_files(certificate, key)?));
    }
    let reached = [arguments.http, arguments.door_http].iter().flatten().any(is_reached);
    if !(arguments.tls || (reached && !arguments.insecure)) {
        return Ok(None);
    }
    Ok(Some(Certificate::own(&arguments.site, &names_of_this_machine(&arguments.http_name))?))
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

fn open(file: &Path) -> Result<TracksOut<Box<dyn Write>>, String> {
    if file.as_os_str() == "-" {
        return Ok(TracksOut::new(Box::new(io::stdout()), "standard output".to_owned()));
    }
    let name = file.display().to_string();
    let out = File::create(file).map_err(|error| format!("{name}: {error}"))?;
    Ok(TracksOut::new(Box::new(out), name))
}

/// Logs which alarms have begun and which are over.
fn say(changes: &Changes) {
    for alarm in &changes.begun {
        tracing::warn!("{}: {}: {}", alarm.source, alarm.name(), alarm.text);
    }
    for alarm in &changes.over {
        tracing::info!("{}: {}: over", alarm.source, alarm.name());
    }
}

/// Logs how the modules were. That none has answered is a failure where a run is for its lines, and not of a service, which
/// waits for modules to come.
fn summary(last: &Snapshot, serves: bool) -> Result<(), Failure> {
    let answered: Vec<&ModuleLine> = last.modules.iter().filter(|module| !module.id.is_empty()).collect();
    for module in &answered {
        let offset =
            module.clock_offset_ms.map_or("unknown".to_owned(), |offset_ms| format!("{offset_ms:.1} ms"));
        tracing::info!(
            "module {} ({}): {}, {:.1} scans/s, {:.1} % lost, clock offset {offset}",
            module.name,
            module.id,
            module.state,
            module.scans_hz,
            module.lost_share * 100.0,
        );
    }
    let missing = "no module answered: is it switched on and in this network? kehai-tracker module list shows what is \
                   there; --module gives an address";
    match answered.is_empty() {
        true if serves => tracing::warn!("{missing}"),
        true => return Err(missing.into()),
        false => {}
    }
    Ok(())
}
