//! What commands print on stdout.

use std::fmt::Display;
use std::io::{self, Write as _};

use serde::Serialize;

use super::failure::Failure;

/// Prints a line. Unlike `println!` it returns what cannot be written, a closed pipe for one, instead of panicking.
pub(super) fn print(line: impl Display) -> Result<(), Failure> {
    Ok(writeln!(io::stdout(), "{line}")?)
}

/// Prints a line of JSON.
pub(super) fn print_json(value: &impl Serialize) -> Result<(), Failure> {
    print(serde_json::to_string(value)?)
}
