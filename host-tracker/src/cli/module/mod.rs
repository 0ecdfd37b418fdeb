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
use kehai::wire::Refusal;

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
    done(&arguments.command).map_err(in_words)
}

fn done(command: &Command) -> Result<(), Failure> {
    match command {
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

/// An error, with what to do where a module listens to holders of a key only.
fn in_words(error: Failure) -> Failure {
    let of_client = match error.downcast_ref() {
        Some(ModuleError::Client(error)) => Some(error),
        _ => error.downcast_ref(),
    };
    if matches!(of_client, Some(ClientError::Refused(Refusal::NeedsKey))) {
        return format!("{error}: name the site's with --keys SITE.keys").into();
    }
    error
}

/// The exit status for an error: 3 when no module answered.
pub fn status(error: &Failure) -> u8 {
    let error = error.downcast_ref().map_or(error, |Unfinished { error }| error);
    let silent = matches!(error.downcast_ref(), Some(ClientError::Silent(_)))
        || matches!(error.downcast_ref(), Some(ModuleError::Client(ClientError::Silent(_))));
    if silent || error.is::<NotFound>() { 3 } else { 1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_refusal_of_a_module_with_keys_says_how_they_are_named() {
        let refused = || ClientError::Refused(Refusal::NeedsKey);
        for error in [Failure::from(refused()), ModuleError::Client(refused()).into()] {
            let said = in_words(error).to_string();
            assert!(said.ends_with("holders of a key only: name the site's with --keys SITE.keys"), "{said}");
        }
        let busy = in_words(ClientError::Refused(Refusal::Busy).into());
        assert_eq!(busy.to_string(), ClientError::Refused(Refusal::Busy).to_string());
        let silent = ClientError::Silent(([127, 0, 0, 1], 9).into());
        assert_eq!(status(&in_words(silent.into())), 3, "its exit status stays");
    }
}
