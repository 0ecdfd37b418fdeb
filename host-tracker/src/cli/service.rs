//! The service that the package brings: where its files are, and with which options it runs.
//!
//! ```text
//!   /etc/default/kehai-tracker   KEHAI_OPTIONS="--http=0.0.0.0:8420"   ─▶ run --site … --db … --first-admin --http=0.0.0.0:8420
//! ```
//!
//! Sources: `packaging/debian/kehai-tracker.service`; systemd.exec(5), EnvironmentFile.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use clap::Args;
use host_tracker::backup::Places;

use super::failure::Failure;

/// The site of the service.
pub(super) const SITE: &str = "/etc/kehai/site.toml";

/// Its database.
pub(super) const DATABASE: &str = "/var/lib/kehai/site.db";

/// Its options.
pub(super) const OPTIONS: &str = "/etc/default/kehai-tracker";

/// `KEHAI_OPTIONS` where the file does not set it.
const UNSET: &str = "--http";

/// Variables that stand for an option, if the file sets them.
const VARIABLES: [(&str, &str); 3] =
    [("KEHAI_MQTT", "--mqtt"), ("KEHAI_KEYS", "--keys"), ("KEHAI_ALARM_WEBHOOK", "--alarm-webhook")];

/// Whose files a command is for.
#[derive(Debug, Args)]
pub(super) struct Place {
    /// The site's file
    #[arg(long, value_name = "FILE.toml", default_value = SITE)]
    site: PathBuf,

    /// The database [default: /var/lib/kehai/site.db; with another --site, that beside it, as home.db beside home.toml]
    #[arg(long, value_name = "FILE")]
    db: Option<PathBuf>,

    /// The keys of the site's modules [default: beside the site file, as SITE.keys]
    #[arg(long, value_name = "FILE", env = "KEHAI_KEYS")]
    keys: Option<PathBuf>,
}

impl Place {
    /// The database that was named, not the usual one.
    pub(super) fn named_database(&self) -> Option<&Path> {
        self.db.as_deref()
    }

    /// Where everything is; the keys of the service where it is started with them.
    ///
    /// # Errors
    /// The file of the service's options cannot be read.
    pub(super) fn places(&self) -> Result<Places, Failure> {
        self.places_with(Path::new(OPTIONS))
    }

    fn places_with(&self, options: &Path) -> Result<Places, Failure> {
        let is_service = self.site == Path::new(SITE);
        let usual = if is_service { DATABASE.into() } else { self.site.with_extension("db") };
        let database = Some(self.db.clone().unwrap_or(usual));
        let keys = match &self.keys {
            None if is_service => keys_of(options)?,
            named => named.clone(),
        };
        Ok(Places { site: self.site.clone(), database, keys })
    }
}

/// The file of keys that the service is started with, if its options name one.
fn keys_of(options: &Path) -> Result<Option<PathBuf>, Failure> {
    let file = options.display();
    match arguments(options) {
        Ok(arguments) => Ok(keys_in(&arguments)),
        // It is root's. In a container the tracker's own user makes backups, and these options start nothing.
        Err(error) if error.kind() == io::ErrorKind::PermissionDenied => {
            tracing::warn!(
                "{file} may not be read: the keys are those beside the site, unless --keys says where"
            );
            Ok(None)
        }
        Err(error) => Err(format!("{file}: {error}: correct it, or name the keys with --keys").into()),
    }
}

/// The file of keys that arguments of `run` name.
fn keys_in(arguments: &[String]) -> Option<PathBuf> {
    let mut words = arguments.iter().skip_while(|word| !is_option(word, "--keys"));
    let word = words.next()?;
    let file = word.strip_prefix("--keys=").or_else(|| words.next().map(String::as_str))?;
    // The service is started there.
    Some(Path::new("/").join(file))
}

/// Whether a word is this option, with a value in it or not.
fn is_option(word: &str, option: &str) -> bool {
    word.strip_prefix(option).is_some_and(|rest| rest.is_empty() || rest.starts_with('='))
}

/// The arguments of `run` with which the service is started.
///
/// # Errors
/// The file of its options cannot be read.
pub(super) fn arguments(options: &Path) -> io::Result<Vec<String>> {
    match fs::read_to_string(options) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(usual()),
        read => read.map(|text| from_options(&text)),
    }
}

/// Those with which it is started where nothing else is said.
pub(super) fn usual() -> Vec<String> {
    from_options("")
}

fn from_options(text: &str) -> Vec<String> {
    let mut arguments: Vec<String> =
        ["run", "--site", SITE, "--db", DATABASE, "--first-admin"].map(str::to_owned).into();
    let words = |line: &str| shlex::split(line).unwrap_or_default();
    let lines = text.lines().map(str::trim).filter(|line| !line.starts_with(['#', ';']));
    let pairs: Vec<(&str, String)> = lines
        .filter_map(|line| line.split_once('='))
        .map(|(name, value)| (name, words(value).join(" ")))
        .collect();
    // The last of several counts.
    let set = |name: &str| pairs.iter().rev().find(|(key, _)| *key == name).map(|(_, value)| value.as_str());
    arguments.extend(words(set("KEHAI_OPTIONS").unwrap_or(UNSET)));
    for (variable, option) in VARIABLES {
        // Where both are there, the option counts.
        let is_given = arguments.iter().any(|word| is_option(word, option));
        arguments.extend(set(variable).filter(|_| !is_given).map(|value| format!("{option}={value}")));
    }
    arguments
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_options_of_the_service_are_those_that_systemd_gives_it() {
        let of = |text: &str| from_options(text).split_off(6);
        let file = "# KEHAI_OPTIONS=\"--insecure\"\n\nKEHAI_OPTIONS=\"--http=0.0.0.0:8420 --keep-days 30\"\n";
        assert_eq!(of(file), ["--http=0.0.0.0:8420", "--keep-days", "30"]);
        assert_eq!(
            of("KEHAI_OPTIONS=--http\nKEHAI_MQTT='mqtt://me:se cret@here'\n"),
            ["--http", "--mqtt=mqtt://me:se cret@here"]
        );
        assert_eq!(of("KEHAI_OPTIONS=\"--mqtt-site 'my home'\""), ["--mqtt-site", "my home"]);
        assert_eq!(of("OTHER=1\nKEHAI_OPTIONS="), [] as [&str; 0]);
        assert_eq!(of("KEHAI_OPTIONS=--insecure\nKEHAI_OPTIONS=--http=1\n"), ["--http=1"], "the last counts");
        assert_eq!(of("KEHAI_KEYS=/a.keys"), ["--http", "--keys=/a.keys"], "what the unit says stays");
        assert_eq!(of("KEHAI_KEYS=/a.keys\nKEHAI_OPTIONS=--keys=/b.keys"), ["--keys=/b.keys"]);
        let packaged = include_str!("../../../packaging/debian/default");
        assert_eq!(of(packaged), ["--http"]);
        let unit = include_str!("../../../packaging/debian/kehai-tracker.service");
        let started = format!("{} $KEHAI_OPTIONS", from_options("KEHAI_OPTIONS=").join(" "));
        assert!(unit.contains(&started), "{started}");
        assert!(unit.contains(&format!("Environment=KEHAI_OPTIONS={UNSET}\n")));
    }

    #[test]
    fn a_command_about_the_service_takes_the_keys_that_it_is_started_with() {
        let folder = tempfile::tempdir().unwrap();
        let options = folder.path().join("default");
        let place = |site: &str, keys: Option<&str>| Place {
            site: site.into(),
            db: None,
            keys: keys.map(PathBuf::from),
        };
        let keys = |place: &Place| place.places_with(&options).unwrap().keys;
        let service = place(SITE, None);
        assert_eq!(keys(&service), None, "beside the site");
        for text in
            ["KEHAI_KEYS=/a.keys", "KEHAI_OPTIONS=\"--http --keys /a.keys\"", "KEHAI_OPTIONS=--keys=/a.keys"]
        {
            fs::write(&options, text).unwrap();
            assert_eq!(keys(&service), Some("/a.keys".into()), "{text}");
        }
        assert_eq!(keys(&place(SITE, Some("/b.keys"))), Some("/b.keys".into()), "what is named counts");
        assert_eq!(keys(&place("home.toml", None)), None, "of another site");
        // It is there, and is no file.
        let error = service.places_with(folder.path()).unwrap_err().to_string();
        assert!(error.contains("--keys"), "{error}");
    }
}
