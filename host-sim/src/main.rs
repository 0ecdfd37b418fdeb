//! `kehai-sim`: emulated range finders, recordings and simulated worlds on a PC.
#![forbid(unsafe_code)]

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run()
}
