//! The commands of `kehai-tracker`, one file each.

mod address;
#[cfg(feature = "zenoh")]
mod area;
mod backup;
mod broker;
mod calibrate;
mod check;
mod doctor;
mod explain;
mod export;
mod failure;
mod firmware;
mod hidden;
mod http;
mod keys;
mod live;
mod log;
mod manual;
mod missing;
mod module;
mod output;
mod refusals;
mod replay;
mod report;
mod restore;
mod run;
mod schema;
mod service;
mod signals;
#[cfg(feature = "zenoh")]
mod site;
mod supervisor;
mod token;
mod tracks_out;
mod user;

use std::io::{self, ErrorKind};
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};
use tracing_subscriber::filter::LevelFilter;

use failure::Failure;

/// Follows people from the reports of kehai modules.
#[derive(Debug, Parser)]
#[command(name = "kehai-tracker", version, propagate_version = true)]
struct Arguments {
    /// Log on stderr what is at least as grave: error, warn, info, debug, trace; or off
    #[arg(long, value_name = "LEVEL", default_value_t = LevelFilter::INFO, global = true)]
    log: LevelFilter,

    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Run(Box<run::Arguments>),
    #[cfg(feature = "zenoh")]
    Site(Box<site::Arguments>),
    Calibrate(calibrate::Arguments),
    User(user::Arguments),
    Token(token::Arguments),
    Module(module::Arguments),
    Firmware(firmware::Arguments),
    Replay(replay::Arguments),
    Export(export::Arguments),
    Report(report::Arguments),
    Explain(explain::Arguments),
    Check(check::Arguments),
    Doctor(doctor::Arguments),
    Backup(backup::Arguments),
    Restore(restore::Arguments),
    Schema(schema::Arguments),
    Completions(manual::Completions),
    #[command(hide = true)]
    Man(manual::Man),
}

/// Does what the command line says. An exit status other than 0 comes with one line on stderr.
pub fn run() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            let (command, words) = (Arguments::command(), std::env::args_os().collect::<Vec<_>>());
            let Some(needs) = missing::said(&error, &command, &words) else {
                hidden::without_secret(error, &command).exit()
            };
            log::say(format_args!("kehai-tracker: {needs}"));
            // As the parser's own.
            return ExitCode::from(2);
        }
    };
    log::start(arguments.log);
    let done = match arguments.command {
        Command::Run(arguments) => run::run(*arguments),
        #[cfg(feature = "zenoh")]
        Command::Site(arguments) => site::run(*arguments),
        Command::Calibrate(arguments) => calibrate::run(&arguments),
        Command::User(arguments) => user::run(arguments),
        Command::Token(arguments) => token::run(arguments),
        Command::Module(arguments) => module::run(&arguments),
        Command::Firmware(arguments) => firmware::run(&arguments),
        Command::Replay(arguments) => replay::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::Report(arguments) => report::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Doctor(arguments) => doctor::run(arguments),
        Command::Backup(arguments) => backup::run(&arguments),
        Command::Restore(arguments) => restore::run(&arguments),
        Command::Schema(arguments) => schema::run(&arguments),
        Command::Completions(arguments) => manual::completions(&arguments, &mut Arguments::command()),
        Command::Man(arguments) => manual::man(&arguments, Arguments::command()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        // The reader of the output, `head` for one, has had enough.
        Err(error) if is_closed_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            log::say(format_args!("kehai-tracker: {error}"));
            ExitCode::from(module::status(&error))
        }
    }
}

/// Whether stdout has no reader any more. The writer of CSV wraps what the system says.
fn is_closed_pipe(error: &Failure) -> bool {
    let of_csv = || match error.downcast_ref::<csv::Error>()?.kind() {
        csv::ErrorKind::Io(error) => Some(error),
        _ => None,
    };
    let of_system = error.downcast_ref::<io::Error>().or_else(of_csv);
    of_system.is_some_and(|error| error.kind() == ErrorKind::BrokenPipe)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reader_that_has_had_enough_is_known_also_behind_csv() {
        let closed = || io::Error::from(ErrorKind::BrokenPipe);
        let full = csv::Error::from(io::Error::from(ErrorKind::StorageFull));
        assert!(is_closed_pipe(&closed().into()) && is_closed_pipe(&csv::Error::from(closed()).into()));
        assert!(!is_closed_pipe(&full.into()) && !is_closed_pipe(&"no".into()));
    }

    #[test]
    fn an_address_with_a_password_that_cannot_be_read_is_not_said() {
        for option in ["--mqtt", "--alarm-webhook"] {
            let words = ["kehai-tracker", "run", option, "//me:secret@"];
            let error = Arguments::try_parse_from(words).unwrap_err();
            let said = hidden::without_secret(error, &Arguments::command()).to_string();
            assert!(said.contains(option) && !said.contains("secret"), "{said}");
        }
    }
}
