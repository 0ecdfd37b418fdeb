//! The commands of `kehai-tracker`, one file each.

mod calibrate;
mod export;
mod module;
mod replay;
mod run;

use std::error::Error;
use std::net::{SocketAddr, ToSocketAddrs};
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use kehai::wire::PORT;

/// Follows people from the reports of kehai modules.
#[derive(Debug, Parser)]
#[command(name = "kehai-tracker", version, propagate_version = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Run(Box<run::Arguments>),
    Calibrate(calibrate::Arguments),
    Module(module::Arguments),
    Replay(replay::Arguments),
    Export(export::Arguments),
}

/// Does what the command line says. An exit status other than 0 comes with one line on stderr.
pub fn run() -> ExitCode {
    let done = match Arguments::parse().command {
        Command::Run(arguments) => run::run(*arguments),
        Command::Calibrate(arguments) => calibrate::run(&arguments),
        Command::Module(arguments) => module::run(&arguments),
        Command::Replay(arguments) => replay::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("kehai-tracker: {error}");
            ExitCode::from(module::status(&error))
        }
    }
}

/// What can go wrong in a command: one line.
type Failure = Box<dyn Error>;

/// The address of a module; port 4040 if none is given.
fn address(text: &str) -> Result<SocketAddr, String> {
    let found = if text.contains(':') { text.to_socket_addrs() } else { (text, PORT).to_socket_addrs() };
    found
        .map_err(|error| format!("{text}: {error}"))?
        .find(SocketAddr::is_ipv4)
        .ok_or_else(|| format!("{text}: no IPv4 address"))
}
