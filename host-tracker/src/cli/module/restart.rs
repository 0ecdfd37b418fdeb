//! `kehai-tracker module restart`: restarts a module.

use clap::Args;
use host_tracker::module;

use super::target::Target;
use crate::cli::failure::Failure;

/// Start a module anew; settings and background are kept
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker module restart hall")]
pub struct Arguments {
    #[command(flatten)]
    target: Target,
}

/// Asks for it.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    Ok(module::restart(&mut arguments.target.control()?)?)
}
