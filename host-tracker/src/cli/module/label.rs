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
first ones, so it stays with the module.

Examples:
  kehai-tracker module label --board w5500-evb-pico2 --flash label.bin
  probe-rs download --chip RP235x --binary-format bin --base-address 0x101e0000 label.bin
  kehai-tracker module label --json"
)]
pub struct Arguments {
    /// JSON: code and qr
    #[arg(long)]
    json: bool,

    /// The board it is for
    #[arg(long, value_enum, requires = "flash")]
    board: Option<BoardName>,

    /// Write what the board's flash is to hold: its settings, erased but for the label
    #[arg(long, value_name = "FILE.bin", requires = "board")]
    flash: Option<PathBuf>,
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
        return print_json(&serde_json::json!({ "code": label.text(), "qr": label.qr() }));
    }
    let code = QrCode::new(label.qr()).map_err(|error| error.to_string())?;
    print(format_args!("{}", code.render::<Dense1x2>().build()))?;
    print(format_args!("{}", label.text()))
}
