//! `kehai-tracker module claim`, `rotate` and `key`: gives a module its keys, others in their place, and says one.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::{Args, ValueEnum};
use data_encoding::HEXLOWER;
use host_tracker::key_file;
use host_tracker::net::client::{Client, ClientError};
use kehai::seal::{Key, Role};
use kehai::wire::{Message, ModuleId, Refusal, Request};
use kehai_tracking::keys::{Claimed, Keys, Label};

use super::target::{self, Target};
use crate::cli::failure::Failure;
use crate::cli::output::print;

/// Give a new module the keys of this site, by the code on its label
#[derive(Debug, Args)]
#[command(
    after_help = "From then on the module listens to holders of these keys only, and all it says is encrypted. The first claim of a
site makes its file of keys, beside its site file.

Examples:
  kehai-tracker module claim hall --code ABCDE-FGHIJ-KLMNO-PQRST-UVWXYZ --keys door.keys
  kehai-tracker run --site door.toml          takes door.keys by itself"
)]
pub struct Claim {
    #[command(flatten)]
    target: Target,

    /// The code on its label, or what its QR code says
    #[arg(long, value_name = "CODE", env = "KEHAI_CODE", hide_env_values = true)]
    code: String,

    /// Make the file of keys if there is none, also where no site file lies beside it
    #[arg(long)]
    new: bool,
}

/// Give a module new keys in the place of those it has
#[derive(Debug, Args)]
#[command(
    after_help = "A tracker that runs takes the new keys by itself. For five seconds the old ones count, too; if it is
interrupted before, they count until it is run again.

Examples:
  kehai-tracker module rotate hall --keys door.keys"
)]
pub struct Rotate {
    #[command(flatten)]
    target: Target,
}

/// Say the key of a module for another program
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker module key hall --role read --keys door.keys")]
pub struct ShowKey {
    /// The module, by its name or identity in the file of keys
    #[arg(value_name = "MODULE")]
    module: String,

    /// What the program is to do
    #[arg(long, value_enum)]
    role: RoleName,

    /// The file of keys
    #[arg(long, value_name = "FILE", env = "KEHAI_KEYS")]
    keys: PathBuf,
}

/// A role, on the command line.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum RoleName {
    /// Reports, health and profiles
    Read,
    /// Raw scans, too
    Raw,
    /// Settings, learning, restarts and keys, too
    Control,
}

impl From<RoleName> for Role {
    fn from(name: RoleName) -> Self {
        match name {
            RoleName::Read => Self::Read,
            RoleName::Raw => Self::Raw,
            RoleName::Control => Self::Control,
        }
    }
}

/// A tracker looks at the file each second, and has a session under the new key within two more.
const TAKEN: Duration = Duration::from_secs(5);

/// A rotation that has stopped between its first step and its last one.
#[derive(Debug, thiserror::Error)]
#[error("{error}; the old keys still count: run rotate again")]
pub(super) struct Unfinished {
    /// Why.
    pub(super) error: Failure,
}

/// Claims.
pub fn claim(arguments: &Claim) -> Result<(), Failure> {
    let label = Label::parse(&arguments.code).ok_or(
        "this is no code of a label: it has 26 letters and digits, as ABCDE-FGHIJ-KLMNO-PQRST-UVWXYZ",
    )?;
    let file = keys_file(&arguments.target)?;
    let (keys, origin) = keys_of_site(file, arguments.new)?;
    let mut client = Client::connect(target::find(&arguments.target.module)?)?;
    let (device, name) = (client.identity().module, name(&mut client)?);
    // Keys that were in use before a reset come never again: another program may hold them still.
    let next = next_generation(keys.get(device));
    client.open_by_label(&Key::of_label(&label.0));
    let generation = match set(&mut client, &keys.records(device, &[next])) {
        Ok(()) => next,
        Err(error) => match known(&client, &keys, device, &name, next) {
            Some(generation) => generation,
            None => return Err(not_claimed(error, device, &name)),
        },
    };
    let keys = key_file::note(file, &keys, device, Claimed { name: name.clone(), generation })?;
    check(&client, &keys)?;
    let file = file.display();
    print(match origin {
        Origin::There => format!("{name} ({device}) has its keys; they are in {file}: keep a copy of it"),
        Origin::Made => format!(
            "{name} ({device}) has its keys, of a new secret in {file}: a tracker takes that file beside its site file, or by \
             --keys. Keep a copy of it"
        ),
    })
}

/// Where the secret of a site comes from.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Origin {
    /// The file was there.
    There,
    /// It was made, and the file with it.
    Made,
}

/// The keys in a file. If there is none, they are made where a tracker looks for them, beside its site's file, or if that is wanted:
/// a module with a key of a secret that no tracker has needs its button.
fn keys_of_site(file: &Path, is_new: bool) -> Result<(Keys, Origin), Failure> {
    if let Some(keys) = key_file::load(file)? {
        return Ok((keys, Origin::There));
    }
    let site = file.with_extension("toml");
    if !is_new && !site.exists() {
        let (file, site) = (file.display(), site.display());
        return Err(format!(
            "{file}: there is no such file, and no site file {site} whose keys it would hold: is the name right? --new makes it"
        )
        .into());
    }
    Ok((key_file::load_or_create(file)?, Origin::Made))
}

/// Why a module has not taken its keys.
fn not_claimed(error: ClientError, device: ModuleId, name: &str) -> Failure {
    match error {
        ClientError::Silent(_) | ClientError::Refused(Refusal::NoSuchKey) => format!(
            "{name} ({device}) does not take this code: it is another's, or the module has keys already. Holding its button \
             for ten seconds while it starts erases them"
        )
        .into(),
        error => error.into(),
    }
}

/// Rotates.
pub fn rotate(arguments: &Rotate) -> Result<(), Failure> {
    let file = keys_file(&arguments.target)?;
    let keys = target::keys_in(file)?;
    let mut client = arguments.target.control()?;
    let device = client.identity().module;
    let Some(claimed) = keys.get(device).cloned() else {
        return Err(format!("{device} has no keys in {}: kehai-tracker module claim", file.display()).into());
    };
    let next = next_generation(Some(&claimed));
    // Both count until the new ones have been used: a tracker that has the old ones goes on.
    set(&mut client, &keys.records(device, &[claimed.generation, next]))?;
    replace(&client, file, &keys, device, Claimed { generation: next, ..claimed })
        .map_err(|error| Unfinished { error })?;
    print(format_args!("{device} has new keys, number {next}: keep a copy of {}", file.display()))
}

/// Notes the new keys of a module that has the old ones, too, and takes those from it.
fn replace(
    client: &Client,
    file: &Path,
    keys: &Keys,
    device: ModuleId,
    claimed: Claimed,
) -> Result<(), Failure> {
    let next = claimed.generation;
    let keys = key_file::note(file, keys, device, claimed)?;
    let mut client = check(client, &keys)?;
    // A closed pipe is no reason to leave it half done.
    let _ = print(format_args!(
        "{device}: the old keys still count; if this ends before it says more, run rotate again"
    ));
    std::thread::sleep(TAKEN);
    Ok(set(&mut client, &keys.records(device, &[next]))?)
}

/// Says a key.
pub fn show(arguments: &ShowKey) -> Result<(), Failure> {
    let keys = target::keys_in(&arguments.keys)?;
    let is_it = |id: &ModuleId, claimed: &Claimed| {
        claimed.name == arguments.module || id.to_string() == arguments.module
    };
    let found = keys.devices().find(|(id, claimed)| is_it(id, claimed));
    let (device, _) = found
        .ok_or_else(|| format!("\"{}\" has no keys in {}", arguments.module, arguments.keys.display()))?;
    let Some((id, Key(key))) = keys.key(device, arguments.role.into()) else { return Ok(()) };
    print(format_args!("{id}:{}", HEXLOWER.encode(&key)))
}

fn keys_file(target: &Target) -> Result<&Path, Failure> {
    let file = target.keys.as_deref();
    file.ok_or_else(|| "in which file? --keys SITE.keys, beside the site file".into())
}

fn name(client: &mut Client) -> Result<String, ClientError> {
    client.ask(Request::Info, |_, message| target::name(message))
}

fn set(client: &mut Client, records: &[u8]) -> Result<(), ClientError> {
    client.ask(Request::SetKeys { keys: records }, |_, message| {
        matches!(message, Message::Done { .. }).then_some(())
    })
}

/// Which keys a module is given next.
fn next_generation(claimed: Option<&Claimed>) -> u8 {
    claimed.map_or(1, |claimed| claimed.generation.checked_add(1).unwrap_or(1))
}

/// Which of the site's keys the module already has: those of the file, or the next, if a claim was interrupted after the module had
/// stored them.
fn known(client: &Client, keys: &Keys, device: ModuleId, name: &str, next: u8) -> Option<u8> {
    let noted = keys.get(device).map(|claimed| claimed.generation);
    noted.into_iter().chain([next]).find(|&generation| {
        let mut with = keys.clone();
        with.insert(device, Claimed { name: name.to_owned(), generation });
        check(client, &with).is_ok()
    })
}

/// Meets the module with these keys.
fn check(client: &Client, keys: &Keys) -> Result<Client, Failure> {
    let mut again = Client::with_keys(client.address(), keys.clone().into())?;
    again
        .ask(Request::GetSettings, |_, message| matches!(message, Message::Settings { .. }).then_some(()))?;
    Ok(again)
}
