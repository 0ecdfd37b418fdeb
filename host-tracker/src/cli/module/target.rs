//! The module that a command is for: found by name, identity or address.

use std::net::{IpAddr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::Args;
use host_tracker::key_file;
use host_tracker::module;
use host_tracker::module_id;
use host_tracker::net::client::Client;
use host_tracker::net::discovery::Search;
use kehai::wire::{Message, PORT, Request};
use kehai_tracking::keys::Keys;
use kehai_tracking::registry::{Finding, Found};
use kehai_tracking::text::printable;

use crate::cli::address::address;
use crate::cli::failure::Failure;

/// Which module, and how it is told.
#[derive(Debug, Args)]
pub(super) struct Target {
    /// The module: name, instance name, identity or address
    #[arg(value_name = "MODULE")]
    pub(super) module: String,

    /// JSON, an object a line
    #[arg(long)]
    pub(super) json: bool,

    /// The keys of the site, for a module that has been given one
    #[arg(long, value_name = "FILE", env = "KEHAI_KEYS")]
    pub(super) keys: Option<PathBuf>,
}

/// How long a module is looked for.
const SEARCH: Duration = Duration::from_secs(5);

/// No module, or none of that name.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(super) struct NotFound(pub(super) String);

impl Target {
    /// Meets the module.
    pub(super) fn connect(&self) -> Result<Client, Failure> {
        let keys = self.keys.as_deref().map_or_else(|| Ok(Keys::none()), keys_in)?;
        Ok(Client::with_keys(find(&self.module)?, Arc::new(keys))?)
    }

    /// Meets the module and takes a place among its subscribers: what changes a module needs one.
    pub(super) fn control(&self) -> Result<Client, Failure> {
        let mut client = self.connect()?;
        module::control(&mut client)?;
        Ok(client)
    }
}

/// The keys in a file that must be there: a name that is mistyped is no site without keys.
pub(super) fn keys_in(file: &Path) -> Result<Keys, Failure> {
    key_file::load(file)?.ok_or_else(|| format!("{}: there is no such file", file.display()).into())
}

/// The address of a module that is named in whatever way.
pub(super) fn find(module: &str) -> Result<SocketAddr, Failure> {
    if let Ok(ip) = module.parse::<IpAddr>() {
        return Ok((ip, PORT).into());
    }
    if let Ok(address) = module.parse() {
        return Ok(address);
    }
    let wanted = module_id::read(module);
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
        && let Ok(address) = address(module)
    {
        return Ok(address);
    }
    let seconds = SEARCH.as_secs();
    Err(NotFound(format!(
        "no module \"{module}\" was found within {seconds} s: kehai-tracker module list shows what is there; or give its address"
    ))
    .into())
}

pub(super) fn name(message: &Message<'_>) -> Option<String> {
    match message {
        Message::Info(info) => Some(printable(info.name)),
        _ => None,
    }
}

/// The first address at which what was found answers.
pub(super) fn meet(found: &Found) -> Option<Client> {
    found.addresses.iter().find_map(|&address| Client::connect(address).ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_keys_that_is_named_must_be_there() {
        let folder = tempfile::tempdir().unwrap();
        let keys = Some(folder.path().join("hal.keys"));
        let target = Target { module: "127.0.0.1:9".to_owned(), json: false, keys };
        let error = target.connect().unwrap_err().to_string();
        assert!(error.ends_with("hal.keys: there is no such file"), "{error}");
    }
}
