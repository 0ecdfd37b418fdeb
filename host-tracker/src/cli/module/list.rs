//! `kehai-tracker module list`: the modules on this network.

use std::time::Duration;

use clap::Args;
use host_tracker::net::discovery::Search;
use kehai::wire::ModuleId;
use kehai_tracking::registry::Found;
use serde::Serialize;
use unicode_width::UnicodeWidthStr as _;

use super::info;
use super::target::{NotFound, meet};
use crate::cli::failure::Failure;
use crate::cli::output::{print, print_json};

/// List the modules that are found on this network
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker module list
  kehai-tracker module list --seconds 10 --json")]
pub struct Arguments {
    /// Look for so long
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u64).range(..=3600))]
    seconds: u64,

    /// JSON, an object a line
    #[arg(long)]
    json: bool,
}

/// A module as it is listed.
#[derive(Debug, Serialize)]
struct Listed {
    instance: String,
    /// Whether it answers, too.
    answers: bool,
    name: String,
    /// None while it starts: it neither says so itself nor announces it yet.
    id: Option<String>,
    address: String,
    firmware: String,
    model: String,
    serial: String,
    /// It has keys, and tells who has none its name only.
    has_keys: bool,
}

impl Listed {
    fn new(found: Found) -> Self {
        let info = meet(&found).and_then(|mut client| info::ask(&mut client).ok());
        let announced_id = (found.id != ModuleId::ANY).then(|| found.id.to_string());
        let announced = found.addresses.first().map_or_else(String::new, ToString::to_string);
        // In clear a module with keys says neither its firmware nor its sensor.
        let has_keys = info.as_ref().is_some_and(|info| info.firmware.is_empty());
        Self {
            has_keys,
            answers: info.is_some(),
            name: info.as_ref().map_or_else(String::new, |info| info.name.clone()),
            id: info.as_ref().map(|info| info.id.clone()).or(announced_id),
            address: info.map_or(announced, |info| info.address),
            instance: found.instance,
            firmware: found.firmware,
            model: found.model,
            serial: found.serial,
        }
    }
}

/// Looks and prints.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let found = Search::start()?.all_within(Duration::from_secs(arguments.seconds));
    if found.is_empty() {
        let seconds = arguments.seconds;
        return Err(NotFound(format!(
            "no module was found within {seconds} s: are they switched on and in this network? Switches and Wi-Fi must pass multicast"
        ))
        .into());
    }
    if !arguments.json {
        print(format_args!(
            "{:<16} {:<18} {:<22} {:<5} {:<9} SENSOR",
            "NAME", "IDENTITY", "ADDRESS", "KEYS", "FIRMWARE"
        ))?;
    }
    for found in found {
        let module = Listed::new(found);
        if arguments.json {
            print_json(&module)?;
            continue;
        }
        let name = if module.answers { &module.name } else { "(no answer)" };
        let sensor = if module.model.is_empty() { "none yet" } else { &module.model };
        let keys = match (module.answers, module.has_keys) {
            (false, _) => "?",
            (true, true) => "yes",
            (true, false) => "none",
        };
        let id = module.id.as_deref().unwrap_or("(starting)");
        print(format_args!(
            "{} {id:<18} {:<22} {:<5} {:<9} {sensor} {}",
            column(name, 16),
            module.address,
            keys,
            module.firmware,
            module.serial
        ))?;
    }
    Ok(())
}

/// A text as wide as a column of a terminal, in which 玄 takes two places.
fn column(text: &str, width: usize) -> String {
    format!("{text}{}", " ".repeat(width.saturating_sub(text.width())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_looked_for_an_hour_at_most() {
        #[derive(clap::Parser)]
        struct Line {
            #[command(flatten)]
            arguments: Arguments,
        }
        let asked = |seconds: &str| {
            let line = <Line as clap::Parser>::try_parse_from(["list", "--seconds", seconds]);
            line.map(|line| line.arguments.seconds).ok()
        };
        assert_eq!((asked("3600"), asked("18446744073709551615")), (Some(3600), None));
    }

    #[test]
    fn a_name_in_any_script_takes_the_width_of_its_column() {
        for name in ["hall", "玄関", "Café", ""] {
            assert_eq!(column(name, 16).width(), 16, "{name}");
        }
        assert_eq!(column("玄関", 16), format!("玄関{}", " ".repeat(12)));
        assert_eq!(column("a name that is longer", 4), "a name that is longer");
    }

    #[test]
    fn a_module_that_does_not_say_yet_which_it_is_has_no_identity() {
        let found = |id| Found { id, addresses: Vec::new(), ..Found::default() };
        assert_eq!(Listed::new(found(ModuleId::ANY)).id, None);
        let id = ModuleId([2, 0, 0, 0, 0, 1]);
        assert_eq!(Listed::new(found(id)).id.as_deref(), Some("02:00:00:00:00:01"));
    }
}
