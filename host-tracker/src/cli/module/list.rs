//! `kehai-tracker module list`: the modules on this network.

use std::time::Duration;

use clap::Args;
use host_tracker::discovery::{Found, Search};
use serde::Serialize;

use super::{NotFound, info, meet, print_json};
use crate::cli::Failure;

/// List the modules that are found on this network
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker module list
  kehai-tracker module list --seconds 10 --json")]
pub struct Arguments {
    /// Look for so long
    #[arg(long, value_name = "N", default_value_t = 3)]
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
    id: String,
    address: String,
    firmware: String,
    model: String,
    serial: String,
}

impl Listed {
    fn new(found: Found) -> Self {
        let info = meet(&found).and_then(|mut client| info::ask(&mut client).ok());
        let announced = found.addresses.first().map_or_else(String::new, ToString::to_string);
        Self {
            answers: info.is_some(),
            name: info.as_ref().map_or_else(String::new, |info| info.name.clone()),
            address: info.map_or(announced, |info| info.address),
            id: found.id.to_string(),
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
        println!("{:<16} {:<18} {:<22} {:<9} SENSOR", "NAME", "IDENTITY", "ADDRESS", "FIRMWARE");
    }
    for found in found {
        let module = Listed::new(found);
        if arguments.json {
            print_json(&module)?;
            continue;
        }
        let name = if module.answers { &module.name } else { "(no answer)" };
        let sensor = if module.model.is_empty() { "none yet" } else { &module.model };
        println!(
            "{name:<16} {:<18} {:<22} {:<9} {sensor} {}",
            module.id, module.address, module.firmware, module.serial
        );
    }
    Ok(())
}
