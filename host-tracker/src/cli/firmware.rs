//! `kehai-tracker firmware`: keys of makers, signed images, and what is in one.

use std::fs;
use std::path::PathBuf;

use clap::{Args, Subcommand};
use data_encoding::{HEXLOWER, HEXLOWER_PERMISSIVE};
use host_tracker::firmware::{MakerKey, SignedImage, flatten};
use kehai::update::Version;
use kehai::update::maker::DEVELOPMENT;
use serde::Serialize;

use super::failure::Failure;
use super::output::{print, print_json};

/// Sign images for modules, and look at signed ones
///
/// A module starts an image only if it is signed by a maker whose public key its boot loader was built with
/// (KEHAI_UPDATE_KEYS). kehai-tracker module update brings a signed image to modules.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Key(Key),
    Sign(Sign),
    Show(Show),
}

/// Make a maker's key, or say the public one
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker firmware key --make maker.key      keep it off the network, and a copy
  kehai-tracker firmware key maker.key             the public key, for KEHAI_UPDATE_KEYS")]
struct Key {
    /// Make one, in this file
    #[arg(long, value_name = "FILE", conflicts_with = "file", required_unless_present = "file")]
    make: Option<PathBuf>,

    /// Say the public key of this one
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
}

/// Sign an image: what cargo has built for a board, or raw bytes
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker firmware sign --key maker.key --program w5500-evb-pico2 --image-version 0.2.0 \\
      target/thumbv8m.main-none-eabihf/release/w5500-evb-pico2 -o pico2.kehai")]
struct Sign {
    /// The maker's key
    #[arg(long, value_name = "FILE")]
    key: PathBuf,

    /// The board, as module info names it
    #[arg(long, value_name = "NAME")]
    program: String,

    /// Its version
    #[arg(long, value_name = "X.Y.Z", value_parser = version)]
    image_version: Version,

    /// Once it works, no version below this starts any more
    #[arg(long, value_name = "X.Y.Z", value_parser = version, default_value = "0.0.0")]
    least: Version,

    /// The image: ELF or bytes
    #[arg(value_name = "IMAGE")]
    image: PathBuf,

    /// The signed image
    #[arg(short, long, value_name = "FILE.kehai")]
    output: PathBuf,
}

/// Say what is in a signed image
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker firmware show pico2.kehai
  kehai-tracker firmware show pico2.kehai --maker 6706042b…")]
struct Show {
    /// The signed image
    #[arg(value_name = "FILE.kehai")]
    file: PathBuf,

    /// Whether this public key's owner has signed it
    #[arg(long, value_name = "KEY", value_parser = public_key)]
    maker: Option<[u8; 32]>,

    /// JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Shown<'a> {
    program: &'a str,
    version: String,
    least: String,
    size: u32,
    sha512: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    signed_by_maker: Option<bool>,
    /// Everybody can sign so.
    development: bool,
}

pub(super) fn version(text: &str) -> Result<Version, String> {
    Version::of_text(text)
        .filter(|version| version.to_string() == text)
        .ok_or_else(|| "a version is three numbers, for example 0.2.0".to_owned())
}

fn public_key(text: &str) -> Result<[u8; 32], String> {
    let key = HEXLOWER_PERMISSIVE.decode(text.as_bytes()).ok().and_then(|key| key.try_into().ok());
    key.ok_or_else(|| "a public key has 64 hexadecimal digits".to_owned())
}

/// Does what the command line says.
pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.command {
        Command::Key(arguments) => key(arguments),
        Command::Sign(arguments) => sign(arguments),
        Command::Show(arguments) => show(arguments),
    }
}

fn key(arguments: &Key) -> Result<(), Failure> {
    let key = match (&arguments.make, &arguments.file) {
        (Some(file), _) => MakerKey::create(file)?,
        (None, Some(file)) => MakerKey::load(file)?,
        (None, None) => return Err("which file? --make FILE makes one".into()),
    };
    print(HEXLOWER.encode(&key.public()))
}

fn sign(arguments: &Sign) -> Result<(), Failure> {
    let key = MakerKey::load(&arguments.key)?;
    let name = arguments.image.display();
    let file = fs::read(&arguments.image).map_err(|error| format!("{name}: {error}"))?;
    let bytes = flatten(file).map_err(|error| format!("{name}: {error}"))?;
    let about = (arguments.program.as_str(), arguments.image_version, arguments.least);
    let image = SignedImage::sign(bytes, about, &key).map_err(|error| format!("{name}: {error}"))?;
    image.save(&arguments.output)?;
    print(format_args!(
        "{}: {} {}, {} bytes",
        arguments.output.display(),
        arguments.program,
        arguments.image_version,
        image.about.size
    ))
}

fn show(arguments: &Show) -> Result<(), Failure> {
    let image = SignedImage::load(&arguments.file)?;
    let about = &image.about;
    let signed_by_maker = arguments.maker.map(|maker| image.is_signed_by(&maker));
    let development = image.is_signed_by(&DEVELOPMENT);
    let shown = Shown {
        program: about.program_name(),
        version: about.version.to_string(),
        least: about.least.to_string(),
        size: about.size,
        sha512: HEXLOWER.encode(&about.digest),
        signed_by_maker,
        development,
    };
    if arguments.json {
        print_json(&shown)?;
    } else {
        print(format_args!("program    {}", shown.program))?;
        print(format_args!("version    {}", shown.version))?;
        print(format_args!("least      {}: no version below starts once this one works", shown.least))?;
        print(format_args!("size       {} bytes", shown.size))?;
        print(format_args!("SHA-512    {}", shown.sha512))?;
        if development {
            print("signature  by the development key, which everybody has: for trying out only")?;
        }
        if let Some(right) = signed_by_maker {
            print(format_args!("signature  {}", if right { "by this maker" } else { "not by this maker" }))?;
        }
    }
    match signed_by_maker {
        Some(false) => Err(format!("{}: not signed by this maker", arguments.file.display()).into()),
        _ => Ok(()),
    }
}
