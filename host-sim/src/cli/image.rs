//! `kehai-sim image`: an image for a module on this PC, to try updates with.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use kehai::update::Version;
use kehai_emulator::pc::image::{Fault, Image};

/// As many bytes as a board's image has, about.
const LEN: usize = 200_000;

/// An image for a module on this PC, to try updates with: it is not signed
///
/// A module with --store that has installed it says it runs this version. kehai-tracker firmware sign signs it, and
/// kehai-tracker module update brings it to the module.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The version that the module will say it runs
    #[arg(long, value_name = "X.Y.Z", value_parser = version)]
    image_version: String,

    /// It hangs: the module's watchdog brings the one before back
    #[arg(long)]
    hangs: bool,

    /// Its bytes
    #[arg(long, value_name = "N", default_value_t = LEN)]
    size: usize,

    /// The file
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

const EXAMPLES: &str = "Examples:
  kehai-sim image --image-version 0.2.0 -o pc.bin
  kehai-tracker firmware sign --key maker.key --program pc --image-version 0.2.0 pc.bin -o pc.kehai";

fn version(text: &str) -> Result<String, String> {
    match Version::of_text(text) {
        Some(version) if version.to_string() == text => Ok(text.to_owned()),
        _ => Err("a version is three numbers, for example 0.2.0".to_owned()),
    }
}

/// Writes the image.
///
/// # Errors
/// The file cannot be written.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let fault = if arguments.hangs { Fault::Hangs } else { Fault::None };
    let image = Image { version: arguments.image_version.clone(), fault };
    std::fs::write(&arguments.output, image.bytes(arguments.size))
        .map_err(|error| format!("{}: {error}", arguments.output.display()).into())
}
