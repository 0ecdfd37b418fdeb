//! `kehai-tracker module identify`: lets a module blink.

use clap::Args;
use host_tracker::module;
use kehai::wire::IDENTIFY_MAX_S;

use super::target::Target;
use crate::cli::failure::Failure;

/// Let a module blink, to find out which box it is
///
/// Its LED flickers for a second and is on for a second, in turn; then it shows the module's state again. Nothing else
/// changes: it goes on counting.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker module identify hall
  kehai-tracker module identify 192.168.1.40 --seconds 60
  kehai-tracker module identify hall --seconds 0")]
pub struct Arguments {
    #[command(flatten)]
    target: Target,

    /// For so long; 0 ends it
    #[arg(long, value_name = "N", default_value_t = module::IDENTIFY_S,
        value_parser = clap::value_parser!(u16).range(0..=i64::from(IDENTIFY_MAX_S)))]
    seconds: u16,
}

/// Asks for it.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    Ok(module::identify(&mut arguments.target.connect()?, arguments.seconds)?)
}
