//! `kehai-tracker module`: look after modules, one file a command.

mod absorb;
mod claim;
mod get;
mod identify;
mod info;
mod label;
mod learn;
mod list;
mod raw;
mod restart;
mod set;
mod target;
mod update;

use clap::{Args, Subcommand};
use host_tracker::module::ModuleError;
use host_tracker::net::client::ClientError;

use self::claim::Unfinished;
use self::target::NotFound;
use super::failure::Failure;

/// List modules, ask them, set them up
///
/// MODULE is a name, an instance name or an identity as `module list` shows them, or an address (HOST or HOST:PORT).
/// Only a host that a module lists in its setting `hosts` may change it or get raw scans; with none listed, any host.
///
/// Exit status: 0 done; 1 refused or failed; 2 wrong arguments; 3 no module found, or no answer.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    List(list::Arguments),
    Info(info::Arguments),
    Identify(identify::Arguments),
    Learn(learn::Arguments),
    Absorb(absorb::Arguments),
    Get(get::Arguments),
    Set(set::Arguments),
    Raw(raw::Arguments),
    Restart(restart::Arguments),
    Claim(claim::Claim),
    Rotate(claim::Rotate),
    Key(claim::ShowKey),
    Label(label::Arguments),
    Update(update::Arguments),
}

/// Does what the command line says.
///
/// # Errors
/// One line.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.command {
        Command::List(arguments) => list::run(arguments),
        Command::Info(arguments) => info::run(arguments),
        Command::Identify(arguments) => identify::run(arguments),
        Command::Learn(arguments) => learn::run(arguments),
        Command::Absorb(arguments) => absorb::run(arguments),
        Command::Get(arguments) => get::run(arguments),
        Command::Set(arguments) => set::run(arguments),
        Command::Raw(arguments) => raw::run(arguments),
        Command::Restart(arguments) => restart::run(arguments),
        Command::Claim(arguments) => claim::claim(arguments),
        Command::Rotate(arguments) => claim::rotate(arguments),
        Command::Key(arguments) => claim::show(arguments),
        Command::Label(arguments) => label::run(arguments),
        Command::Update(arguments) => update::run(arguments),
    }
}

/// The exit status for an error: 3 when no module answered.
pub fn status(error: &Failure) -> u8 {
    let error = error.downcast_ref().map_or(error, |Unfinished { error }| error);
    let silent = matches!(error.downcast_ref(), Some(ClientError::Silent(_)))
        || matches!(error.downcast_ref(), Some(ModuleError::Client(ClientError::Silent(_))));
    if silent || error.is::<NotFound>() { 3 } else { 1 }
}
