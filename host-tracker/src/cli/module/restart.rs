//! `kehai-tracker module restart`: restarts a module.

use clap::Args;
use kehai::wire::{Message, Request};

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
    let mut client = arguments.target.control()?;
    Ok(client.ask(Request::Restart, |_, message| matches!(message, Message::Done { .. }).then_some(()))?)
}
