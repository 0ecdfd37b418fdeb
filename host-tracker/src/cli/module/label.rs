//! `kehai-tracker module label`: a new secret for a board that is being made, to be printed and put on it.

use clap::Args;
use host_tracker::key_file;
use kehai_tracking::keys::Label;
use qrcode::QrCode;
use qrcode::render::unicode::Dense1x2;

use crate::cli::failure::Failure;
use crate::cli::output::{print, print_json};

/// Make the code of a label for a new module: the code, and a QR code that says it
#[derive(Debug, Args)]
#[command(
    after_help = "The module is given the same code when it is made: kehai-sim module --label CODE. Who knows it can give a module
without keys its first ones, so it stays with the module.

Examples:
  kehai-tracker module label
  kehai-tracker module label --json"
)]
pub struct Arguments {
    /// JSON: code and qr
    #[arg(long)]
    json: bool,
}

/// Prints it.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let label = Label(key_file::random()?);
    if arguments.json {
        return print_json(&serde_json::json!({ "code": label.text(), "qr": label.qr() }));
    }
    let code = QrCode::new(label.qr()).map_err(|error| error.to_string())?;
    print(format_args!("{}", code.render::<Dense1x2>().build()))?;
    print(format_args!("{}", label.text()))
}
