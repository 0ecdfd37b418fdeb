//! What `kehai-tracker run` is told, and what the daemon is started with by that.

use std::path::{Path, PathBuf};

use clap::Args;
use host_tracker::daemon::{Database, Settings, card_key};
use host_tracker::doctor::facts::OptionsState;
use host_tracker::doctor::gather::Installation;
use host_tracker::links::LinkSettings;
use host_tracker::site_file::SiteFile;
use host_tracker::store::Keep;
use host_tracker::webhook::Target;
use kehai_tracking::keys::Clear;
use kehai_tracking::tracker::Selected;

use crate::cli::address::address;
#[cfg(feature = "zenoh")]
use crate::cli::area::ZenohArguments;
use crate::cli::broker::MqttArguments;
use crate::cli::failure::Failure;
use crate::cli::http::{HttpArguments, Served};
use crate::cli::keys::keys_file;

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
    pub(super) site: Option<PathBuf>,

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
    pub(super) tracks_out: Option<PathBuf>,

    #[command(flatten)]
    pub(super) http: HttpArguments,

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

    /// Days it is kept, at least one
    #[arg(long, value_name = "N", default_value_t = Keep::USUAL.days, requires = "db", value_parser = clap::value_parser!(u32).range(1..))]
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
    pub(super) seconds: Option<u64>,
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
pub(super) const SITE: &str = "site.toml";

impl Arguments {
    /// Whether anything but the lines of tracks comes of the run: then they are not printed unless asked for.
    pub(super) fn tells_others(&self) -> bool {
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
    pub(super) fn settings(self, site_path: &Path) -> Result<(Settings, Served), Failure> {
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
        let keys_file = keys_file(self.keys.as_deref(), site_path)?;
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
            options: OptionsState::Usable,
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
    fn no_database_is_kept_for_less_than_a_day() {
        let days = |days: &str| {
            let words = ["run", "--db", "home.db", "--keep-days", days];
            Line::try_parse_from(words).map(|line| line.arguments.keep_days)
        };
        assert!(days("0").is_err(), "the run itself would be deleted each minute");
        assert_eq!(days("1").unwrap(), 1);
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
