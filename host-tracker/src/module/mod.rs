//! What can be asked of a module: for commands and for the map.
//!
//! ```text
//!   kehai-tracker module … ─╮                              ╭─ settings, set, rename
//!                           ├─▶ control ─▶ Client ─▶ ask ──┼─ learn, restart
//!   POST /api/module/… ─────╯                              ├─ absorb
//!                                                          ╰─ identify, which needs no control
//! ```
//!
//! Each blocks until the module has answered, or not.

pub mod absorb;
pub mod kept;

use std::net::SocketAddr;

use kehai::wire::{Message, Refusal, Request, SETTINGS_TEXT_MAX, SettingFault};
use kehai_tracking::text::printable;

use crate::net::client::{Client, ClientError};

/// How long a module blinks unless something else is said, s: long enough to look for it.
pub const IDENTIFY_S: u16 = 30;

/// Why a module did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum ModuleError {
    /// It is not reached, or refuses.
    #[error(transparent)]
    Client(#[from] ClientError),
    /// It takes orders from other hosts.
    #[error(
        "this machine may not control the module at {0}: run it where the tracker runs, or add this machine to the \
         module's setting hosts from there"
    )]
    MayNot(SocketAddr),
    /// A setting is none, or has no such value.
    #[error("{setting}: {fault}; nothing was changed")]
    Setting {
        /// As it was asked for.
        setting: String,
        /// What is wrong.
        fault: String,
    },
    /// Too much at once.
    #[error("more than {SETTINGS_TEXT_MAX} bytes of settings: change them in two steps")]
    TooLong,
    /// It does not know its own directions.
    #[error("the module has found no sensor yet: kehai-tracker module info says when")]
    NoSensor,
    /// It does not know the request.
    #[error("this module's firmware is too old to blink: kehai-tracker module update, or flash it anew")]
    TooOldToBlink,
    /// Nothing is seen.
    #[error("the module sends no reports")]
    NoReports,
    /// What is to be absorbed is not there, or not to be absorbed.
    #[error("{0}")]
    NotAbsorbed(String),
}

/// Takes a place among the subscribers of the module: what changes it needs one.
///
/// # Errors
/// [`ModuleError`].
pub fn control(client: &mut Client) -> Result<(), ModuleError> {
    match client.subscribe()? {
        true => Ok(()),
        false => Err(ModuleError::MayNot(client.address())),
    }
}

/// Its settings, in its order: key and value.
///
/// # Errors
/// [`ClientError`].
pub fn settings(client: &mut Client) -> Result<Vec<(String, String)>, ClientError> {
    let text = client.ask(Request::GetSettings, |_, message| match message {
        Message::Settings { text, .. } => Some((*text).to_owned()),
        _ => None,
    })?;
    let pair = |line: String| line.split_once('=').map(|(key, value)| (key.to_owned(), value.to_owned()));
    Ok(text.lines().map(printable).filter_map(pair).collect())
}

/// Whether this is a setting, `KEY=VALUE`, as far as can be said without the module.
///
/// # Errors
/// What is wrong with it.
pub fn check_setting(text: &str) -> Result<(), &'static str> {
    if text.chars().any(char::is_control) {
        return Err("a setting has no control characters");
    }
    match text.split_once('=') {
        Some(("name", "")) => {
            Err("a module has a name of 1 to 32 bytes: without one it could not be found by it")
        }
        Some((key, _)) if !key.is_empty() => Ok(()),
        _ => Err("a setting is KEY=VALUE"),
    }
}

/// Changes settings, `KEY=VALUE` each: all of them or none. They are stored when this comes back.
///
/// # Errors
/// [`ModuleError`].
pub fn set(client: &mut Client, settings: &[String]) -> Result<(), ModuleError> {
    for setting in settings {
        check_setting(setting).map_err(|fault| refused(setting, fault))?;
    }
    let text = settings.join("\n");
    if text.len() > SETTINGS_TEXT_MAX {
        return Err(ModuleError::TooLong);
    }
    match done(client, Request::SetSettings { text: &text }) {
        Err(ClientError::Refused(Refusal::Setting { line, fault })) => {
            let setting = settings.get(usize::from(line)).map_or("", String::as_str);
            let key = setting.split_once('=').map_or("", |(key, _)| key);
            let takes = match fault {
                SettingFault::Value | SettingFault::Range => takes(key),
                SettingFault::Syntax | SettingFault::Key | SettingFault::Conflict | SettingFault::Unknown => {
                    None
                }
            };
            let takes = takes.map_or_else(String::new, |takes| format!(": {key} is {takes}"));
            Err(refused(setting, &format!("{fault}{takes}")))
        }
        answer => Ok(answer?),
    }
}

/// Begins to learn the background anew, from `scans` scans; 0: as many as its settings say.
///
/// # Errors
/// [`ClientError`].
pub fn learn(client: &mut Client, scans: u16) -> Result<(), ClientError> {
    done(client, Request::Learn { scans })
}

/// Starts it anew.
///
/// # Errors
/// [`ClientError`].
pub fn restart(client: &mut Client) -> Result<(), ClientError> {
    done(client, Request::Restart)
}

/// Lets its LED blink for so long, so that a person finds it; 0 s: no more.
///
/// # Errors
/// [`ModuleError`].
pub fn identify(client: &mut Client, seconds: u16) -> Result<(), ModuleError> {
    match done(client, Request::Identify { seconds }) {
        Err(ClientError::Refused(Refusal::Unsupported)) => Err(ModuleError::TooOldToBlink),
        answer => Ok(answer?),
    }
}

/// What a setting can be, as `docs/wire.md` has it.
fn takes(key: &str) -> Option<&'static str> {
    Some(match key {
        "name" => "1 to 32 bytes",
        "foreground_mm" => "100 to 1000",
        "open_range_mm" => "auto, or 500 to 60000",
        "learn_scans" => "30 to 6000",
        "first_step" | "last_step" => "auto, or 0 to 9999",
        "cluster" => "1 to 99",
        "skip" => "0 to 9",
        "tiles" => "none, or as 10,1,1,6,4",
        "address" => "dhcp, or as 10.0.0.7/24,10.0.0.1",
        "hosts" => "up to 8 addresses of hosts",
        _ => return None,
    })
}

fn done(client: &mut Client, request: Request<'_>) -> Result<(), ClientError> {
    client.ask(request, |_, message| matches!(message, Message::Done { .. }).then_some(()))
}

fn refused(setting: &str, fault: &str) -> ModuleError {
    ModuleError::Setting { setting: printable(setting), fault: fault.to_owned() }
}

#[cfg(test)]
mod tests {
    use kehai::device::Settings;

    use super::takes;

    /// Without what wire.md adds for people who read it.
    fn plain(cell: &str) -> String {
        cell.replace('`', "").replace("auto, 0", "auto, or 0").replace("auto, 5", "auto, or 5")
    }

    #[test]
    fn what_a_setting_can_be_is_said_as_wire_md_has_it() {
        let page = include_str!("../../../docs/wire.md");
        let (_, table) = page.split_once("| key | value | default | counts from |").unwrap();
        let rows = table.lines().skip(2).take_while(|line| line.starts_with('|'));
        let mut keys = 0;
        for row in rows {
            let cells: Vec<&str> = row.split('|').map(str::trim).collect();
            for key in cells[1].split(", ").map(|key| key.trim_matches('`')) {
                let said = takes(key).unwrap_or_else(|| panic!("{key} is not known"));
                keys += 1;
                let is_listed = !["tiles", "address", "hosts"].contains(&key);
                assert!(!is_listed || plain(cells[2]) == said, "{key}: {} is not {said}", cells[2]);
            }
        }
        assert_eq!(keys, 11);
    }

    #[test]
    fn a_number_is_said_to_be_possible_where_a_module_takes_it() {
        let of_numbers =
            ["foreground_mm", "open_range_mm", "learn_scans", "first_step", "last_step", "cluster", "skip"];
        for key in of_numbers {
            let range = takes(key).unwrap().trim_start_matches("auto, or ");
            let (least, most) = range.split_once(" to ").unwrap();
            let [least, most]: [i64; 2] = [least, most].map(|number| number.parse().unwrap());
            let is_taken = |value: i64| Settings::new().changed_by(&format!("{key}={value}")).is_ok();
            let around = [least - 1, least, most, most + 1].map(is_taken);
            assert_eq!(around, [false, true, true, false], "{key}: {range}");
        }
    }
}
