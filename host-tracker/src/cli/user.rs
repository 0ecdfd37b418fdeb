//! `kehai-tracker user`: who may log in.

use std::io::Read;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use host_tracker::access::directory::User;
use host_tracker::access::file::AccessFile;
use host_tracker::access::roles::Role;
use host_tracker::access::{password, secret};
use host_tracker::backup;

use super::failure::Failure;
use super::output::print;

/// Say who may log in to the live map: add, remove, list people, give them other passwords
///
/// They are kept beside the site's file, as home.access beside home.toml. A tracker that runs follows a change within a
/// second. As long as there is no user, the map is for its own machine alone, and open to all there.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  sudo kehai-tracker user list                            the service of this machine
  sudo kehai-tracker user password admin
  kehai-tracker user add anna --role admin --site home.toml")]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Add a user, and print a password that is made for it
    Add {
        /// By which it logs in
        #[arg(value_name = "NAME")]
        name: String,
        /// view: looks; edit: draws the site, too, if it has no door; operator: looks, and resets doors; admin: everything
        #[arg(long, value_name = "ROLE")]
        role: Role,
        #[command(flatten)]
        chosen: Chosen,
        #[command(flatten)]
        place: Place,
    },
    /// Give a user another password, and print it: its sessions end
    Password {
        /// Whom
        #[arg(value_name = "NAME")]
        name: String,
        #[command(flatten)]
        chosen: Chosen,
        #[command(flatten)]
        place: Place,
    },
    /// Remove a user: its sessions end
    Remove {
        /// Whom
        #[arg(value_name = "NAME")]
        name: String,
        #[command(flatten)]
        place: Place,
    },
    /// List who may log in, as what
    List {
        #[command(flatten)]
        place: Place,
    },
}

#[derive(Debug, Args)]
struct Chosen {
    /// Take the password from standard input instead of making one: 15 letters at least
    #[arg(long)]
    stdin: bool,
}

/// Whose users and tokens.
#[derive(Debug, Args)]
pub(super) struct Place {
    /// The site's file
    #[arg(long, value_name = "FILE.toml", default_value = "/etc/kehai/site.toml")]
    site: PathBuf,
}

impl Place {
    /// The file of them.
    ///
    /// # Errors
    /// There is no such site, or what was killed while it restored it cannot be finished.
    pub(super) fn file(&self) -> Result<AccessFile, Failure> {
        backup::finish(&self.site)?;
        let file = AccessFile::beside(&self.site);
        // The first user may have been added before the live map has made the site.
        if self.site.is_file() || file.path().is_file() {
            return Ok(file);
        }
        Err(format!("{}: there is no such site; --site says which", self.site.display()).into())
    }

    /// The same, also of a site that the live map is still to make: others are let in to that only when there is a user.
    fn file_or_begin(&self) -> Result<AccessFile, Failure> {
        let folder = self.site.parent().filter(|folder| !folder.as_os_str().is_empty());
        if self.site.exists() || !folder.unwrap_or(Path::new(".")).is_dir() {
            return self.file();
        }
        backup::finish(&self.site)?;
        if !self.site.exists() {
            tracing::warn!("there is no {} yet: the live map makes it", self.site.display());
        }
        Ok(AccessFile::beside(&self.site))
    }
}

impl Chosen {
    /// The password, whether it was made here, and what is kept of it.
    fn get(&self) -> Result<(String, bool, String), Failure> {
        let (password, is_made) = if self.stdin {
            let mut text = String::new();
            std::io::stdin().take(password::LONGEST as u64 + 2).read_to_string(&mut text)?;
            (text.trim_end_matches(['\r', '\n']).to_owned(), false)
        } else {
            (secret::password()?, true)
        };
        let kept = password::hash(&password)?;
        Ok((password, is_made, kept))
    }
}

/// Does what the command line says.
///
/// # Errors
/// One line.
pub fn run(arguments: Arguments) -> Result<(), Failure> {
    match arguments.command {
        Command::Add { name, role, chosen, place } => {
            let file = place.file_or_begin()?;
            let (password, is_made, kept) = chosen.get()?;
            file.change(|directory| directory.add_user(User { name: name.clone(), role, password: kept }))?;
            say(&name, &password, is_made)
        }
        Command::Password { name, chosen, place } => {
            let file = place.file()?;
            let (password, is_made, kept) = chosen.get()?;
            file.change(|directory| directory.set_password(&name, kept))?;
            say(&name, &password, is_made)
        }
        Command::Remove { name, place } => {
            place.file()?.change(|directory| directory.remove_user(&name))?;
            print(format_args!("{name} may no longer log in"))
        }
        Command::List { place } => {
            for user in place.file()?.load()?.users {
                print(format_args!("{}\t{}", user.name, user.role))?;
            }
            Ok(())
        }
    }
}

fn say(name: &str, password: &str, is_made: bool) -> Result<(), Failure> {
    if is_made {
        print(format_args!("the password of {name} is {password}: it is not said again"))
    } else {
        print(format_args!("the password of {name} is the one that was given"))
    }
}
