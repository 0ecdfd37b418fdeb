//! The commands of `kehai-sim`, one file each.

mod demo;
mod experiment;
mod module;
mod replay;
mod replay_site;
mod scene;
mod score;
mod sensor;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Emulated range finders, recordings and simulated worlds.
#[derive(Debug, Parser)]
#[command(name = "kehai-sim", version, propagate_version = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Sensor(Box<sensor::Arguments>),
    Module(module::Arguments),
    Replay(replay::Arguments),
    Scene(scene::Arguments),
    Score(score::Arguments),
    Experiment(experiment::Arguments),
    Demo(demo::Arguments),
}

/// Does what the command line says. An exit status other than 0 comes with one line on stderr.
pub fn run() -> ExitCode {
    let done = match Arguments::parse().command {
        Command::Sensor(arguments) => sensor::run(&arguments),
        Command::Module(arguments) => module::run(&arguments),
        Command::Replay(arguments) => replay::run(&arguments),
        Command::Scene(arguments) => scene::run(&arguments),
        Command::Score(arguments) => score::run(&arguments),
        Command::Experiment(arguments) => experiment::run(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("kehai-sim: {error}");
            ExitCode::FAILURE
        }
    }
}
