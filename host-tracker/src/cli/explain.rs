//! `kehai-tracker explain`: why a figure of a running tracker is what it is.

use clap::{Args, ValueEnum};
use percent_encoding::{NON_ALPHANUMERIC, utf8_percent_encode};
use serde_json::Value;

use super::failure::Failure;
use super::live::LiveArguments;
use super::output::{print, print_json};

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

    #[command(flatten)]
    live: LiveArguments,

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
    let Arguments { what, name, live, json } = arguments;
    let name = utf8_percent_encode(name, NON_ALPHANUMERIC);
    let answer: Value = live.get(&format!("/api/explain?{}={name}", what.key()))?;
    if *json {
        return print_json(&answer);
    }
    answer["words"].as_array().into_iter().flatten().filter_map(Value::as_str).try_for_each(print)
}
