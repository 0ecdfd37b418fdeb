//! `kehai-tracker module learn`: lets a module learn its background, and waits until it has.

use clap::Args;
use host_tracker::module;
use host_tracker::net::client::Reaction;
use kehai::wire::{EventKind, Health, LearningProgress, Message};
use serde::Serialize;

use super::super::log::say;
use super::target::Target;
use crate::cli::failure::Failure;
use crate::cli::output::{print, print_json};

/// Let a module learn its background anew
///
/// No person may be in its view meanwhile: as long as something moves it begins anew. Waits until it has learned.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker module learn hall
  kehai-tracker module learn hall --scans 600
  kehai-tracker module learn hall --no-wait")]
pub struct Arguments {
    #[command(flatten)]
    target: Target,

    /// Scans to learn from [default: the module's setting learn_scans]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(30..=6000))]
    scans: Option<u16>,

    /// Come back as soon as it has begun
    #[arg(long)]
    no_wait: bool,
}

/// How far it is.
#[derive(Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Step {
    /// So many scans of so many.
    Learning { scans: u16, of: u16, restarts: u16 },
    /// Done; so many things have the shape of a person.
    Learned { background_version: u16, suspects: usize },
}

/// Asks for it and waits.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut client = arguments.target.control()?;
    module::learn(&mut client, arguments.scans.unwrap_or(0))?;
    if arguments.no_wait {
        return Ok(());
    }
    let (mut told, mut begun) = (None, None);
    let learned = client.watch(None, |message| {
        let Message::Health(health) = message else { return None };
        let step = step(health, &mut begun)?;
        if told.as_ref() != Some(&step)
            && let Err(error) = tell(&step, arguments.target.json)
        {
            return Some(Reaction::Done(Err(error)));
        }
        let done = matches!(step, Step::Learned { .. });
        told = Some(step);
        done.then_some(Reaction::Done(Ok(())))
    })?;
    learned.unwrap_or_else(|| Err("the module has stopped learning".into()))
}

/// Learning began with the newest such event, and has ended when one that says so is newer.
fn step(health: &Health<'_>, begun: &mut Option<u32>) -> Option<Step> {
    let newest = |kind: EventKind| {
        health.events.iter().filter(|event| event.kind == kind).map(|event| event.number).max()
    };
    let started = *begun.get_or_insert(newest(EventKind::LearnStarted)?);
    if newest(EventKind::Learned).is_some_and(|number| number > started) {
        let background_version = health.head.background_version;
        return Some(Step::Learned { background_version, suspects: health.suspects.len() });
    }
    let LearningProgress { scans, of, restarts, .. } = health.head.learning?;
    Some(Step::Learning { scans, of, restarts })
}

fn tell(step: &Step, json: bool) -> Result<(), Failure> {
    if json {
        return print_json(step);
    }
    match step {
        Step::Learning { scans, of, restarts: 0 } => say(format_args!("{scans} of {of} scans")),
        Step::Learning { scans, of, restarts } => {
            say(format_args!("{scans} of {of} scans; began anew {restarts} times, because something moved"));
        }
        Step::Learned { background_version, suspects: 0 } => {
            print(format_args!("learned: background version {background_version}"))?;
        }
        Step::Learned { background_version, suspects } => print(format_args!(
            "learned: background version {background_version}; {suspects} things in it have the shape of a person: if a person stood there, learn again"
        ))?,
    }
    Ok(())
}
