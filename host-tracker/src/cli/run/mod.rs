//! `kehai-tracker run`: follows people with live modules.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use clap::Args;
use host_tracker::alarm_handle::AlarmChange;
use host_tracker::backup;
use host_tracker::daemon::{Daemon, DaemonError, Database, Next, Settings, card_key};
use host_tracker::doctor::gather::Installation;
use host_tracker::key_file;
use host_tracker::links::LinkSettings;
use host_tracker::output_file;
use host_tracker::site_file::SiteFile;
use host_tracker::store::Keep;
use host_tracker::webhook::Target;
use kehai_tracking::alarm::AlarmKind;
use kehai_tracking::alarm_list::Became;
use kehai_tracking::keys::Clear;
use kehai_tracking::snapshot::{ModuleLine, Snapshot};
use kehai_tracking::tracker::Selected;

use super::address::address;
#[cfg(feature = "zenoh")]
use super::area::ZenohArguments;
use super::broker::MqttArguments;
use super::failure::Failure;
use super::http::{HttpArguments, Served, advised};
use super::refusals::Refusals;
use super::signals::Signals;
use super::supervisor::Supervisor;
use super::tracks_out::TracksOut;

/// Follow people with live modules
///
/// Modules that the site names are found by themselves, by DNS-SD as _kehai._udp; others are only asked who they
/// are. What is wrong with a module is logged on stderr, when it begins and when it ends. Ends with Ctrl-C.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The site: where the modules, walls, zones and entries are. If there is no such file, the live map guides to one and
    /// makes it [default: site.toml in this folder, with --http]
    #[arg(long, value_name = "FILE.toml")]
    site: Option<PathBuf>,

    /// A module's address, beside those that are found; port 4040 if none is given
    #[arg(long, value_name = "HOST[:PORT]")]
    module: Vec<String>,

    /// The keys of the site's modules, made by kehai-tracker module claim [default: beside the site file, as SITE.keys]
    #[arg(long, value_name = "FILE", env = "KEHAI_KEYS")]
    keys: Option<PathBuf>,

    /// Believe modules without a key, too, when others of the site have one
    #[arg(long)]
    also_in_clear: bool,

    /// Look for no modules on the network: only those at --module
    #[arg(long, requires = "module")]
    no_mdns: bool,

    /// Write tracks and zones, a JSON line every 0.1 s; - is the terminal, and the default when nothing else is told. What an
    /// earlier run has written there is kept beside, with its time in the name
    #[arg(long, value_name = "FILE")]
    tracks_out: Option<PathBuf>,

    #[command(flatten)]
    http: HttpArguments,

    /// The tracker: kehai, or kehai-rules, which follows people by rules; it takes far less of the processor, and loses
    /// people who crowd together
    #[arg(long, value_name = "NAME", default_value_t = Selected::default())]
    tracker: Selected,

    #[command(flatten)]
    mqtt: MqttArguments,

    /// Tell this address, by a POST of JSON, when an alarm begins, is acknowledged and ends
    #[arg(long, value_name = "URL", env = "KEHAI_ALARM_WEBHOOK", hide_env_values = true)]
    alarm_webhook: Option<Target>,

    /// Keep what happens in this database, made if missing
    #[arg(long, value_name = "FILE")]
    db: Option<PathBuf>,

    /// Days it is kept
    #[arg(long, value_name = "N", default_value_t = Keep::USUAL.days, requires = "db")]
    keep_days: u32,

    /// Days for what is kept of cards: their hash by this site's key
    #[arg(long, value_name = "N", default_value_t = Keep::USUAL.card_days, requires = "db")]
    keep_card_days: u32,

    /// Record everything that comes in, for kehai-tracker replay and Foxglove. A recording that is there is kept beside, with
    /// its time in the name
    #[arg(long, value_name = "FILE.mcap")]
    record: Option<PathBuf>,

    #[cfg(feature = "zenoh")]
    #[command(flatten)]
    zenoh: ZenohArguments,

    /// Show everything live to Foxglove or Lichtblick on this machine: open a connection to ws://localhost:PORT [default: 8765]
    #[cfg(feature = "foxglove")]
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = "8765")]
    foxglove: Option<u16>,

    /// Stop after so long
    #[arg(long, value_name = "N")]
    seconds: Option<u64>,
}

const EXAMPLES: &str = "Examples:
  kehai-tracker run                                      no site yet: the live map guides to one
  kehai-tracker run --site door.toml --tracks-out -
  kehai-tracker run --site door.toml --http
  kehai-tracker run --site door.toml --module 192.168.1.20 --module 192.168.1.21
  kehai-tracker run --site door.toml --mqtt mqtt://homeassistant.local
  kehai-tracker run --site door.toml --db door.db --keep-days 30
  kehai-tracker run --site east.toml --area campus/east  one of the areas that kehai-tracker site puts together
  kehai-tracker run --site door.toml --ros2              people for ROS 2, over rmw_zenoh
  kehai-tracker run --site door.toml --foxglove          everything live in Foxglove, at ws://localhost:8765
  kehai-tracker run --site door.toml --no-mdns --module 127.0.0.1:4040 --tracks-out tracks.jsonl --seconds 60";

/// The site if none is named.
const SITE: &str = "site.toml";

/// Between two looks at whether it is to end.
const WAIT: Duration = Duration::from_millis(200);

impl Arguments {
    /// Whether anything but the lines of tracks comes of the run: then they are not printed unless asked for.
    fn tells_others(&self) -> bool {
        #[cfg(feature = "zenoh")]
        let over_zenoh = self.zenoh.is_given();
        #[cfg(not(feature = "zenoh"))]
        let over_zenoh = false;
        #[cfg(feature = "foxglove")]
        let to_viewers = self.foxglove.is_some();
        #[cfg(not(feature = "foxglove"))]
        let to_viewers = false;
        over_zenoh
            || to_viewers
            || self.mqtt.is_given()
            || self.alarm_webhook.is_some()
            || self.db.is_some()
            || self.record.is_some()
            || self.http.is_given()
    }

    /// What the daemon is started with, and what of it is served where.
    fn settings(self, site_path: &Path) -> Result<(Settings, Served), Failure> {
        // Only the map can make a site.
        let load = if self.http.is_given() { SiteFile::load_or_begin } else { SiteFile::load };
        let site = load(site_path)?;
        let given = |text: &String| address(text).map_err(|error| format!("--module {error}"));
        let modules = self.module.iter().map(given).collect::<Result<_, _>>()?;
        let mqtt = self.mqtt.broker(site_path)?;
        let card_key = card_key(site_path, &site.current().site).unwrap_or_else(|error| {
            tracing::warn!("{error}; cards of before are not known again");
            None
        });
        let served = self.http.served(site_path)?;
        let map = self.http.map(&served, site_path)?;
        let keys_file = self.keys.clone().unwrap_or_else(|| key_file::beside(site_path));
        if key_file::load(&keys_file)?.is_none() && self.keys.is_some() {
            return Err(format!("{}: there is no such file", keys_file.display()).into());
        }
        let keep = Keep { days: self.keep_days, card_days: self.keep_card_days };
        #[cfg(feature = "foxglove")]
        let foxglove = self.foxglove;
        #[cfg(not(feature = "foxglove"))]
        let foxglove = None;
        #[cfg(feature = "zenoh")]
        let (area, ros2) = self.zenoh.settings();
        #[cfg(not(feature = "zenoh"))]
        let (area, ros2) = (None, None);
        let settings = Settings {
            site,
            modules,
            discover: !self.no_mdns,
            tracker: self.tracker,
            record: self.record,
            database: self.db.map(|file| Database { file, keep, restore: true }),
            map,
            mqtt,
            webhook: self.alarm_webhook,
            card_key,
            keys: Some(keys_file),
            clear: if self.also_in_clear { Clear::Believed } else { Clear::Listed },
            links: LinkSettings { area, ros2, foxglove },
        };
        Ok((settings, served))
    }

    /// What there is to look at where the tracker is started with these.
    pub fn installation(mut self) -> Installation {
        if self.site.is_none() {
            self.http.serve_this_machine();
        }
        let site = self.site.unwrap_or_else(|| SITE.into());
        let broker = self.mqtt.broker(&site).map_err(|error| error.to_string());
        Installation {
            options: None,
            is_service: false,
            keys: self.keys,
            database: self.db,
            map: self.http.place(&site),
            discover: !self.no_mdns,
            broker: broker.transpose(),
            token: None,
            site,
        }
    }
}

/// Runs the tracker until Ctrl-C.
///
/// # Errors
/// One line: what is wrong with which file or address.
pub fn run(mut arguments: Arguments) -> Result<(), Failure> {
    if arguments.site.is_none() {
        arguments.http.serve_this_machine();
    }
    let site_path = arguments.site.take().unwrap_or_else(|| SITE.into());
    if backup::finish(&site_path)? {
        tracing::warn!("a restoration that was interrupted is finished");
    }
    let tells_others = arguments.tells_others();
    let end_s = arguments.seconds.map_or(f64::INFINITY, |seconds| seconds as f64);
    let tracks_out = arguments.tracks_out.take().or_else(|| (!tells_others).then(|| "-".into()));
    let signals = Signals::taken()?;
    let (settings, served) = arguments.settings(&site_path)?;
    let mut out = tracks_out.as_deref().map(open).transpose()?;
    let is_new = !site_path.exists();
    let mut daemon =
        Daemon::start(settings, |text| tracing::info!("{text}")).map_err(|error| match error {
            DaemonError::Map(error) => advised(error, &site_path),
            error => error.into(),
        })?;
    say_begun(&daemon, &served, is_new.then_some(&site_path));
    let mut supervisor = Supervisor::ready();
    let mut refusals = Refusals::default();
    let mut last = Arc::<Snapshot>::default();
    while !signals.end.load(Ordering::Relaxed) && last.line.t < end_s {
        if signals.hang_up.swap(false, Ordering::Relaxed) {
            read_anew(&daemon, &site_path);
        }
        let has_snapshot = match daemon.next(WAIT) {
            Next::Snapshot(snapshot) => {
                last = snapshot;
                supervisor.lives();
                true
            }
            Next::Waiting => false,
            Next::Ended => break,
        };
        refusals.log(daemon.outputs());
        daemon.alarm_changes().iter().for_each(say);
        if let Some(out) = out.as_mut().filter(|_| has_snapshot) {
            match out.line(&last.line) {
                // The reader of the lines has had enough, and there is no other.
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe && !tells_others => break,
                _ => daemon.alarms().set(AlarmKind::TracksOut, out.trouble()),
            }
        }
    }
    drop(supervisor);
    daemon.stop()?;
    summary(&last, tells_others)
}

/// Logs where everything is served, and who makes the site's file if it is still to be made.
fn say_begun(daemon: &Daemon, served: &Served, new_site: Option<&PathBuf>) {
    served.say(daemon.map_address(), daemon.door_address());
    if let Some(address) = daemon.viewers_address() {
        tracing::info!("Foxglove and Lichtblick are served at ws://{address}");
    }
    if let Some(file) = new_site {
        let file = file.display();
        tracing::info!(
            "there is no {file} yet: the live map guides from the modules to a site, and makes it"
        );
    }
}

/// Uses the site's file as it is now, and logs what became of it.
fn read_anew(daemon: &Daemon, site: &Path) {
    let file = site.display();
    if let Err(error) = fs::metadata(site) {
        return tracing::error!("{file}: not used, the site stays as it was: {error}");
    }
    match daemon.read_site_anew() {
        Ok(true) => tracing::info!("{file}: read anew"),
        Ok(false) => tracing::info!("{file}: read anew, nothing has changed"),
        Err(error) => tracing::error!("{file}: not used, the site stays as it was: {error}"),
    }
}

fn open(file: &Path) -> Result<TracksOut<Box<dyn Write>>, String> {
    if file.as_os_str() == "-" {
        return Ok(TracksOut::new(Box::new(io::stdout()), "standard output".to_owned()));
    }
    let name = file.display().to_string();
    let out = output_file::begin(file).map_err(|error| format!("{name}: {error}"))?;
    Ok(TracksOut::new(Box::new(out), name))
}

/// Logs what has become of an alarm.
fn say(change: &AlarmChange) {
    let alarm = &change.alarm;
    match change.became {
        Became::Raised => tracing::warn!("{alarm}: {}", alarm.text),
        Became::Acknowledged => {
            let by = alarm.acknowledged.as_ref().map_or("", |seen| &seen.by);
            tracing::info!("{alarm}: acknowledged by {by}");
        }
        Became::Ended => tracing::info!("{alarm}: over"),
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

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;

    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        arguments: Arguments,
    }

    #[test]
    fn tracks_are_printed_only_where_no_other_output_is_asked_for() {
        let tells_others = |line: &str| {
            let words = format!("run --site home.toml {line}");
            Line::try_parse_from(words.split_whitespace()).unwrap().arguments.tells_others()
        };
        assert!(!tells_others("") && !tells_others("--module 127.0.0.1 --no-mdns --seconds 3"));
        for line in [
            "--http",
            "--mqtt mqtt://here",
            "--db home.db",
            "--record home.mcap",
            "--alarm-webhook http://here/",
            #[cfg(feature = "zenoh")]
            "--area campus/east",
            #[cfg(feature = "zenoh")]
            "--ros2",
            #[cfg(feature = "foxglove")]
            "--foxglove",
        ] {
            assert!(tells_others(line), "{line}");
        }
    }
}
