//! `kehai-tracker module label`: a new secret for a board that is being made, to be printed and put on it.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use host_tracker::key_file;
use host_tracker::label_flash::{LabelBoard, label_flash};
use host_tracker::owned_file;
use kehai_tracking::keys::Label;
use qrcode::QrCode;
use qrcode::render::unicode::Dense1x2;

use super::super::log::say;
use crate::cli::failure::Failure;
use crate::cli::output::{print, print_json};

/// Make the code of a label for a new module: the code, and a QR code that says it
#[derive(Debug, Args)]
#[command(
    after_help = "The module is given the same code when it is made: what --flash writes goes into the board's flash, at the address
that is said, before its first start; kehai-sim module takes --label CODE. Who knows the code can give a module without keys its
first ones, so it stays with the module, inside the case. --map prints what belongs on its lid.

Examples:
  kehai-tracker module label --board w5500-evb-pico2 --flash label.bin
  probe-rs download --chip RP235x --binary-format bin --base-address 0x101e0000 label.bin
  kehai-tracker module label --map http://10.0.0.2:8420/
  kehai-tracker module label --json"
)]
pub struct Arguments {
    /// JSON: code and qr
    #[arg(long)]
    json: bool,

    /// For the lid: also a QR code of the live map at this address
    #[arg(long, value_name = "URL", value_parser = map_address)]
    map: Option<String>,

    /// The board it is for
    #[arg(long, value_enum, requires = "flash")]
    board: Option<BoardName>,

    /// Write what the board's flash is to hold: its settings, erased but for the label
    #[arg(long, value_name = "FILE.bin", requires = "board")]
    flash: Option<PathBuf>,
}

/// An address that a telephone opens.
fn map_address(text: &str) -> Result<String, String> {
    let (scheme, rest) = text.split_once("://").unwrap_or_default();
    let host = rest.split(['/', '?', '#']).next().unwrap_or_default();
    let is_address =
        matches!(scheme, "http" | "https") && !host.is_empty() && !text.contains(char::is_whitespace);
    if is_address {
        Ok(text.to_owned())
    } else {
        Err("the map's address is like http://10.0.0.2:8420/".to_owned())
    }
}

/// A board, on the command line.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum BoardName {
    NucleoH563zi,
    #[value(name = "w5500-evb-pico2")]
    W5500EvbPico2,
}

impl From<BoardName> for LabelBoard {
    fn from(name: BoardName) -> Self {
        match name {
            BoardName::NucleoH563zi => Self::NucleoH563zi,
            BoardName::W5500EvbPico2 => Self::W5500EvbPico2,
        }
    }
}

/// Prints it.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let label = Label(key_file::random()?);
    if let (Some(board), Some(file)) = (arguments.board.map(LabelBoard::from), &arguments.flash) {
        let said = |error| format!("{}: {error}", file.display());
        let folder = owned_file::folder_of(file).map_err(said)?;
        owned_file::write(file, &folder, &label_flash(board, &label.0)).map_err(said)?;
        say(format_args!("{}: for address {:#010x} of the board", file.display(), board.address()));
    }
    if arguments.json {
        let mut both = serde_json::json!({ "code": label.text(), "qr": label.qr() });
        if let Some(map) = &arguments.map {
            both["map"] = map.as_str().into();
        }
        return print_json(&both);
    }
    show(&label.qr(), &label.text())?;
    match &arguments.map {
        Some(map) => show(map, map),
        None => Ok(()),
    }
}

/// Prints a QR code, and below it what it says to people.
fn show(qr: &str, text: &str) -> Result<(), Failure> {
    let code = QrCode::new(qr).map_err(|error| error.to_string())?;
    print(format_args!("{}", code.render::<Dense1x2>().build()))?;
    print(text)
}
