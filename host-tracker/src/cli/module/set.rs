//! `kehai-tracker module set`: changes a module's settings.

use clap::Args;
use host_tracker::module;

use super::target::Target;
use crate::cli::failure::Failure;
use crate::cli::output::print_json;

/// Change a module's settings: all that are named, or none
#[derive(Debug, Args)]
#[command(
    after_help = "Settings: name, foreground_mm, open_range_mm, learn_scans, first_step, last_step, cluster,
skip, tiles, address, hosts; docs/wire.md has their values.

Examples:
  kehai-tracker module set 192.168.1.20 name=hall
  kehai-tracker module set hall learn_scans=300 foreground_mm=150
  kehai-tracker module set hall address=10.0.0.7/24,10.0.0.1"
)]
pub struct Arguments {
    #[command(flatten)]
    target: Target,

    /// What to change
    #[arg(value_name = "KEY=VALUE", required = true, value_parser = setting)]
    settings: Vec<String>,
}

fn setting(text: &str) -> Result<String, &'static str> {
    module::check_setting(text).map(|()| text.to_owned())
}

/// Asks for the change, which is stored when this comes back.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    module::set(&mut arguments.target.control()?, &arguments.settings)?;
    if arguments.target.json { print_json(&arguments.settings) } else { Ok(()) }
}
