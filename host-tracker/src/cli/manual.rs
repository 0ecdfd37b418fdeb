//! What a package installs beside the program: completions for shells, and manual pages. Both are made from the command line
//! itself, so that they say what it says.

use std::io;
use std::path::PathBuf;

use clap::{Args, Command};
use clap_complete::Shell;

use super::failure::Failure;

/// Print the completions of a shell
#[derive(Debug, Args)]
#[command(after_help = "Example:
  kehai-tracker completions bash > ~/.local/share/bash-completion/completions/kehai-tracker")]
pub struct Completions {
    /// The shell
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

/// Write the manual pages, one for each command
#[derive(Debug, Args)]
pub struct Man {
    /// Folder for the files, made if missing
    #[arg(value_name = "DIR")]
    out: PathBuf,
}

/// Prints the completions.
///
/// # Errors
/// The reader of the output has gone.
pub fn completions(arguments: &Completions, command: &mut Command) -> Result<(), Failure> {
    let mut text = Vec::new();
    clap_complete::generate(arguments.shell, command, "kehai-tracker", &mut text);
    Ok(io::Write::write_all(&mut io::stdout(), &text)?)
}

/// Writes the manual pages.
///
/// # Errors
/// The folder cannot be written.
pub fn man(arguments: &Man, command: Command) -> Result<(), Failure> {
    std::fs::create_dir_all(&arguments.out)
        .map_err(|error| format!("{}: {error}", arguments.out.display()))?;
    Ok(clap_mangen::generate_to(command, &arguments.out)?)
}
