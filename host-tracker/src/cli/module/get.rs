//! `kehai-tracker module get`: a module's settings.

use std::collections::BTreeMap;

use clap::Args;
use host_tracker::module;

use super::target::Target;
use crate::cli::failure::Failure;
use crate::cli::output::{print, print_json};

/// Print a module's settings, or one of them
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker module get hall
  kehai-tracker module get hall learn_scans
  kehai-tracker module get hall --json")]
pub struct Arguments {
    #[command(flatten)]
    target: Target,

    /// One setting
    #[arg(value_name = "KEY")]
    key: Option<String>,
}

/// Asks and prints.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut client = arguments.target.connect()?;
    let mut settings = module::settings(&mut client)?;
    if let Some(key) = &arguments.key {
        settings.retain(|(known, _)| known == key);
        if settings.is_empty() {
            return Err(format!(
                "there is no setting \"{key}\": kehai-tracker module get without it shows all"
            )
            .into());
        }
    }
    if arguments.target.json {
        return print_json(&settings.into_iter().collect::<BTreeMap<_, _>>());
    }
    for (key, value) in settings {
        if arguments.key.is_some() { print(value)? } else { print(format_args!("{key}={value}"))? }
    }
    Ok(())
}
