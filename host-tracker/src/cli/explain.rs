//! `kehai-tracker explain`: why a figure of a running tracker is what it is.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueEnum};
use host_tracker::http_agent::agent;
use percent_encoding::{NON_ALPHANUMERIC, utf8_percent_encode};
use serde_json::Value;

use super::failure::Failure;
use super::output::{print, print_json};

/// Longest wait for an answer: the tracker answers after its next snapshot.
const PATIENCE: Duration = Duration::from_secs(10);

/// Say why a zone, a line, a person or an alarm of a running tracker is as it is
///
/// Asks its live map (kehai-tracker run --http).
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker explain zone hall            who is in it, what of it is not seen, behind what, since when
  kehai-tracker explain line front           which part of it is not seen
  kehai-tracker explain person 7             seen by whom when last, hidden behind what
  kehai-tracker explain alarm dirty          what is measured at each device, and the limit")]
pub struct Arguments {
    /// What it is
    #[arg(value_enum)]
    what: What,

    /// Its name; of a person the number
    name: String,

    /// Where the live map is
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:8420")]
    tracker: String,

    /// A token that may look, once there are users
    #[arg(long, value_name = "TOKEN", env = "KEHAI_TOKEN", hide_env_values = true)]
    token: Option<String>,

    /// The certificate to trust at https://, as home.cert.pem beside the site's file
    #[arg(long, value_name = "FILE")]
    ca: Option<PathBuf>,

    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// What can be explained.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum What {
    Zone,
    Line,
    Person,
    Alarm,
}

impl What {
    const fn key(self) -> &'static str {
        match self {
            Self::Zone => "zone",
            Self::Line => "line",
            Self::Person => "person",
            Self::Alarm => "alarm",
        }
    }
}

/// Explains.
///
/// # Errors
/// One line: why there is no answer.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { what, name, tracker, token, ca, json } = arguments;
    let name = utf8_percent_encode(name, NON_ALPHANUMERIC);
    let url = format!("{}/api/explain?{}={name}", tracker.trim_end_matches('/'), what.key());
    let agent = agent(PATIENCE, ca.as_deref())
        .map_err(|why| format!("{}: {why}", ca.as_deref().unwrap_or("".as_ref()).display()))?;
    let mut request = agent.get(&url);
    if let Some(token) = token {
        request = request.header("Authorization", format!("Bearer {token}"));
    }
    let mut answered = request.call().map_err(|why| format!("{tracker}: {why}"))?;
    let status = answered.status();
    let text = answered.body_mut().read_to_string().map_err(|why| format!("{tracker}: {why}"))?;
    let answer: Value =
        serde_json::from_str(&text).map_err(|_| format!("{tracker}: no tracker answers there"))?;
    if !status.is_success() {
        let why = answer["error"].as_str().unwrap_or("it does not say why");
        return Err(format!("{tracker}: {why}").into());
    }
    if *json {
        return print_json(&answer);
    }
    answer["words"].as_array().into_iter().flatten().filter_map(Value::as_str).try_for_each(print)
}
