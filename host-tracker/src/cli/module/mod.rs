//! `kehai-tracker module`: look after modules, one file a command.

mod get;
mod info;
mod learn;
mod list;
mod raw;
mod restart;
mod set;

use std::net::{IpAddr, SocketAddr};
use std::time::{Duration, Instant};

use clap::{Args, Subcommand};
use host_tracker::client::{Client, ClientError};
use host_tracker::discovery::{self, Finding, Found, Search};
use kehai::wire::{Message, PORT, Request};
use serde::Serialize;

use super::Failure;

/// List modules, ask them, set them up
///
/// MODULE is a name, an instance name or an identity as `module list` shows them, or an address (HOST or HOST:PORT).
/// Only a host that a module lists as controlling may change it; with none listed, its first subscriber, and so the
/// machine the tracker runs on.
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
    Learn(learn::Arguments),
    Get(get::Arguments),
    Set(set::Arguments),
    Raw(raw::Arguments),
    Restart(restart::Arguments),
}

/// Which module, and how it is told.
#[derive(Debug, Args)]
struct Target {
    /// The module: name, instance name, identity or address
    #[arg(value_name = "MODULE")]
    module: String,

    /// JSON, an object a line
    #[arg(long)]
    json: bool,
}

/// How long a module is looked for.
const SEARCH: Duration = Duration::from_secs(5);

/// No module, or none of that name.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct NotFound(String);

/// Does what the command line says.
///
/// # Errors
/// One line.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.command {
        Command::List(arguments) => list::run(arguments),
        Command::Info(arguments) => info::run(arguments),
        Command::Learn(arguments) => learn::run(arguments),
        Command::Get(arguments) => get::run(arguments),
        Command::Set(arguments) => set::run(arguments),
        Command::Raw(arguments) => raw::run(arguments),
        Command::Restart(arguments) => restart::run(arguments),
    }
}

impl Target {
    /// Meets the module.
    fn connect(&self) -> Result<Client, Failure> {
        Ok(Client::connect(find(&self.module)?)?)
    }

    /// Meets the module and takes a place among its subscribers: what changes a module needs one.
    fn control(&self) -> Result<Client, Failure> {
        let mut client = self.connect()?;
        if !client.subscribe()? {
            return Err(format!(
                "this machine may not control the module at {}: run it where the tracker runs, or add this machine to \
                 the module's setting hosts from there",
                client.address()
            )
            .into());
        }
        Ok(client)
    }
}

/// The address of a module that is named in whatever way.
fn find(module: &str) -> Result<SocketAddr, Failure> {
    if let Ok(ip) = module.parse::<IpAddr>() {
        return Ok((ip, PORT).into());
    }
    if let Ok(address) = module.parse() {
        return Ok(address);
    }
    let wanted = discovery::id(module);
    let search = Search::start()?;
    let end = Instant::now() + SEARCH;
    let mut asked = Vec::new();
    while let Some(finding) = search.next_before(end) {
        let Finding::Found(found) = finding else { continue };
        if asked.contains(&found.addresses) {
            continue;
        }
        let is_it = wanted == Some(found.id) || found.instance == module;
        for &address in &found.addresses {
            let Ok(mut client) = Client::connect(address) else { continue };
            let named =
                || client.ask(Request::Info, |_, message| name(message)).is_ok_and(|name| name == module);
            if is_it || { named }() {
                return Ok(address);
            }
            break;
        }
        asked.push(found.addresses);
    }
    if wanted.is_none()
        && let Ok(address) = super::address(module)
    {
        return Ok(address);
    }
    let seconds = SEARCH.as_secs();
    Err(NotFound(format!(
        "no module \"{module}\" was found within {seconds} s: kehai-tracker module list shows what is there; or give its address"
    ))
    .into())
}

fn name(message: &Message<'_>) -> Option<String> {
    match message {
        Message::Info(info) => Some(info.name.to_owned()),
        _ => None,
    }
}

/// The first address at which what was found answers.
fn meet(found: &Found) -> Option<Client> {
    found.addresses.iter().find_map(|&address| Client::connect(address).ok())
}

/// Prints a line of JSON.
fn print_json(value: &impl Serialize) -> Result<(), Failure> {
    println!("{}", serde_json::to_string(value)?);
    Ok(())
}

/// The exit status for an error: 3 when nobody was there.
pub fn status(error: &Failure) -> u8 {
    let silent = matches!(error.downcast_ref(), Some(ClientError::Silent(_)));
    if silent || error.is::<NotFound>() { 3 } else { 1 }
}
