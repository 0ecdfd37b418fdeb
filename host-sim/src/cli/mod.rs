//! The commands of `kehai-sim`, one file each.

mod campus;
mod counts;
#[cfg(feature = "daemon")]
mod demo;
mod expect;
mod experiment;
mod floor;
mod halls;
mod image;
mod log;
mod module;
mod plan;
mod replay;
mod replay_floor;
mod replay_site;
mod runs;
mod scene;
mod score;
mod sensor;
mod soak;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use tracing_subscriber::filter::LevelFilter;

/// Emulated range finders, recordings and simulated worlds.
#[derive(Debug, Parser)]
#[command(name = "kehai-sim", version, propagate_version = true)]
struct Arguments {
    /// Log on stderr what is at least as grave: error, warn, info, debug, trace; or off
    #[arg(long, value_name = "LEVEL", default_value_t = LevelFilter::INFO, global = true)]
    log: LevelFilter,

    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Sensor(Box<sensor::Arguments>),
    Module(module::Arguments),
    Floor(floor::Arguments),
    Image(image::Arguments),
    Replay(replay::Arguments),
    Scene(scene::Arguments),
    Score(score::Arguments),
    Plan(plan::Arguments),
    Expect(expect::Arguments),
    Experiment(experiment::Arguments),
    Soak(soak::Arguments),
    Halls(halls::Arguments),
    Campus(campus::Arguments),
    #[cfg(feature = "daemon")]
    Demo(demo::Arguments),
}

/// Does what the command line says. An exit status other than 0 comes with one line on stderr.
pub fn run() -> ExitCode {
    let arguments = Arguments::parse();
    log::start(arguments.log);
    let done = match arguments.command {
        Command::Sensor(arguments) => sensor::run(&arguments),
        Command::Module(arguments) => module::run(&arguments),
        Command::Floor(arguments) => floor::run(&arguments),
        Command::Image(arguments) => image::run(&arguments),
        Command::Replay(arguments) => replay::run(&arguments),
        Command::Scene(arguments) => scene::run(&arguments),
        Command::Score(arguments) => score::run(&arguments),
        Command::Plan(arguments) => plan::run(&arguments),
        Command::Expect(arguments) => expect::run(&arguments),
        Command::Experiment(arguments) => experiment::run(&arguments),
        Command::Soak(arguments) => soak::run(&arguments),
        Command::Halls(arguments) => halls::run(&arguments),
        Command::Campus(arguments) => campus::run(&arguments),
        #[cfg(feature = "daemon")]
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
