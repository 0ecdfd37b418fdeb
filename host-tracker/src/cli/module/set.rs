//! `kehai-tracker module set`: changes a module's settings.

use clap::Args;
use host_tracker::net::client::ClientError;
use kehai::wire::{Message, Refusal, Request, SETTINGS_TEXT_MAX};

use super::target::Target;
use crate::cli::failure::Failure;
use crate::cli::output::print_json;

/// Change a module's settings: all that are named, or none
#[derive(Debug, Args)]
#[command(
    after_help = "Settings: name, foreground_mm, open_range_mm, learn_scans, first_step, last_step, cluster,
skip, tiles, address, hosts; docs/wire.md has their values.

Examples:
  kehai-tracker module set 192.168.1.20 name=hall
  kehai-tracker module set hall learn_scans=300 foreground_mm=150
  kehai-tracker module set hall address=10.0.0.7/24,10.0.0.1"
)]
pub struct Arguments {
    #[command(flatten)]
    target: Target,

    /// What to change
    #[arg(value_name = "KEY=VALUE", required = true, value_parser = setting)]
    settings: Vec<String>,
}

fn setting(text: &str) -> Result<String, String> {
    if text.chars().any(char::is_control) {
        return Err("a setting has no control characters".to_owned());
    }
    match text.split_once('=') {
        Some(("name", "")) => {
            Err("a module has a name of 1 to 32 bytes: without one it could not be found by it".to_owned())
        }
        Some((key, _)) if !key.is_empty() => Ok(text.to_owned()),
        _ => Err("a setting is KEY=VALUE".to_owned()),
    }
}

/// Asks for the change, which is stored when this comes back.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let text = arguments.settings.join("\n");
    if text.len() > SETTINGS_TEXT_MAX {
        return Err(
            format!("more than {SETTINGS_TEXT_MAX} bytes of settings: change them in two steps").into()
        );
    }
    let mut client = arguments.target.control()?;
    let done = client.ask(Request::SetSettings { text: &text }, |_, message| {
        matches!(message, Message::Done { .. }).then_some(())
    });
    if let Err(ClientError::Refused(Refusal::Setting { line, fault })) = &done {
        let setting = arguments.settings.get(usize::from(*line)).map_or("", String::as_str);
        return Err(format!("{setting}: {fault}; nothing was changed").into());
    }
    done?;
    if arguments.target.json { print_json(&arguments.settings) } else { Ok(()) }
}
