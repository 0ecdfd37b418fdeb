//! `kehai-tracker token`: what programs and devices show instead of a password.

use clap::{Args, Subcommand};
use host_tracker::access::directory::Token;
use host_tracker::access::roles::Role;
use host_tracker::access::secret;

use super::failure::Failure;
use super::output::print;
use super::user::Place;

/// Say which programs and devices may use the API: add, remove, list their tokens
///
/// A token is sent with each request, as Authorization: Bearer kehai_…. Only a hash of it is kept, beside the site's file.
/// What each role may is a table in docs/security.md.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  sudo kehai-tracker token list                           the service of this machine
  sudo kehai-tracker token add \"front controller\" --role reader --role contact --role lock --door front
  kehai-tracker token add prometheus --role view --site home.toml")]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Make a token, and print it
    Add {
        /// What it is for
        #[arg(value_name = "NAME")]
        name: String,
        /// What it may; several may be given: view, edit, operator, admin, or of devices: reader, keypad, contact, lock, alarm,
        /// button
        #[arg(long, value_name = "ROLE", required = true)]
        role: Vec<Role>,
        /// The only door that it is for
        #[arg(long, value_name = "DOOR")]
        door: Option<String>,
        #[command(flatten)]
        place: Place,
    },
    /// Take a token back
    Remove {
        /// Which
        #[arg(value_name = "NAME")]
        name: String,
        #[command(flatten)]
        place: Place,
    },
    /// List the tokens, their roles, and their doors
    List {
        #[command(flatten)]
        place: Place,
    },
}

/// Does what the command line says.
///
/// # Errors
/// One line.
pub fn run(arguments: Arguments) -> Result<(), Failure> {
    match arguments.command {
        Command::Add { name, role: roles, door, place } => {
            let file = place.file()?;
            let shown = secret::token()?;
            let token = Token { name, roles, door, sha256: secret::fingerprint(&shown) };
            file.change(|directory| directory.add_token(token))?;
            print(format_args!("{shown}"))
        }
        Command::Remove { name, place } => {
            place.file()?.change(|directory| directory.remove_token(&name))?;
            print(format_args!("the token {name} is no longer taken"))
        }
        Command::List { place } => {
            for token in place.file()?.load()?.tokens {
                let roles: Vec<&str> = token.roles.iter().map(|role| role.name()).collect();
                print(format_args!(
                    "{}\t{}\t{}",
                    token.name,
                    roles.join(","),
                    token.door.unwrap_or_default()
                ))?;
            }
            Ok(())
        }
    }
}
