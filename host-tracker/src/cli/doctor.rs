//! `kehai-tracker doctor`: what is wrong with an installation, and what to do.

use std::fmt::Display;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use clap::{Args, Parser};
use host_tracker::doctor::examine;
use host_tracker::doctor::facts::OptionsState;
use host_tracker::doctor::finding::{Finding, Verdict};
use host_tracker::doctor::gather::{Installation, gather};

use super::failure::Failure;
use super::output::{print, print_json};
use super::run::Arguments as RunArguments;
use super::service;

/// Look at an installation, and say what is wrong with it and what to do
///
/// A line each: ok, unknown, warning or wrong. Exit status 1 if anything is wrong. Nothing is changed. It looks at options,
/// service, site, secrets, database, disk, the tracker that runs, its version and modules, the broker, and the clock.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  sudo kehai-tracker doctor                              the service of this machine
  kehai-tracker doctor home.toml                         a tracker that was started with run --site home.toml --http
  kehai-tracker doctor home.toml -- --db home.db --mqtt mqtt://localhost
  kehai-tracker doctor --json | jq 'select(.verdict == \"wrong\")'")]
pub struct Arguments {
    /// The site of a tracker that was started by hand [default: that of the service, with the options in
    /// /etc/default/kehai-tracker]
    #[arg(value_name = "FILE.toml")]
    site: Option<PathBuf>,

    /// A token with which the tracker is asked; its role view is enough
    #[arg(long, value_name = "TOKEN", env = "KEHAI_TOKEN", hide_env_values = true)]
    token: Option<String>,

    /// JSON, an object a line
    #[arg(long)]
    json: bool,

    /// Options of run with which that tracker was started [default: --http, and --db with the database beside the site's file,
    /// if there is one]
    #[arg(last = true, value_name = "OPTION", requires = "site", allow_hyphen_values = true)]
    options: Vec<String>,
}

/// The arguments of `run`, read from a list.
#[derive(Debug, Parser)]
#[command(name = "run")]
struct Run {
    #[command(flatten)]
    arguments: RunArguments,
}

/// Looks, and says.
///
/// # Errors
/// Something is wrong: how much.
pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let Arguments { site, token, json, options } = arguments;
    let installation = match site {
        Some(site) => by_hand(&site, options)?,
        None => of_service(Path::new(service::OPTIONS))?,
    };
    let findings = examine(&gather(Installation { token, ..installation }));
    for finding in &findings {
        if json { print_json(finding)? } else { print(finding)? }
    }
    failure(&findings)
}

fn failure(findings: &[Finding]) -> Result<(), Failure> {
    match findings.iter().filter(|finding| finding.verdict == Verdict::Wrong).count() {
        0 => Ok(()),
        1 => Err("one thing is wrong".into()),
        count => Err(format!("{count} things are wrong").into()),
    }
}

/// A tracker that was started by hand.
fn by_hand(site: &Path, options: Vec<String>) -> Result<Installation, Failure> {
    let mut arguments = vec!["run".to_owned(), format!("--site={}", site.display())];
    if options.is_empty() {
        arguments.push("--http".to_owned());
        let database = site.with_extension("db");
        arguments.extend(database.exists().then(|| format!("--db={}", database.display())));
    }
    arguments.extend(options);
    read(&arguments).map_err(Into::into)
}

/// The service of this machine. Where its options are wrong or may not be read, everything else is looked at as if there were none.
fn of_service(options: &Path) -> Result<Installation, Failure> {
    let wrong = |why: &dyn Display| OptionsState::Wrong(format!("{}: {why}", options.display()));
    let arguments = service::arguments(options).map_err(|error| match error.kind() {
        ErrorKind::PermissionDenied => OptionsState::Denied(options.to_path_buf()),
        _ => wrong(&error),
    });
    let given = arguments.and_then(|arguments| read(&arguments).map_err(|why| wrong(&why)));
    let (installation, options) = match given {
        Ok(installation) => (installation, OptionsState::Usable),
        Err(state) => (read(&service::usual())?, state),
    };
    Ok(Installation { is_service: true, options, ..installation })
}

/// The installation of a tracker with these arguments, or in one line why there is none.
fn read(arguments: &[String]) -> Result<Installation, String> {
    let run = Run::try_parse_from(arguments).map_err(|error| {
        let text = error.to_string();
        let line = text.lines().next().unwrap_or("they are wrong");
        line.trim_start_matches("error: ").to_owned()
    })?;
    Ok(run.arguments.installation())
}
