//! The file of users and tokens, beside the site's: for its owner alone, written whole or not at all.
//!
//! ```text
//!   home.toml ─ beside it ─▶ home.access, mode 0600 ◀─ kehai-tracker user, token
//!                                 └─▶ read by the tracker, again within a second after each change
//! ```

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use kehai_tracking::site::line_of;

use crate::owned_file::{self, Stamp};

use super::directory::{Directory, DirectoryError};

/// Longest file that is read: of the most users and tokens there may be, with room.
const LONGEST: u64 = 1 << 20;

/// First line of the file.
const HEAD: &str = "# Who may do what. Written by kehai-tracker user and kehai-tracker token.\n\n";

/// The file.
#[derive(Clone, Debug)]
pub struct AccessFile(PathBuf);

/// Why the file cannot be used, in one line.
#[derive(Debug, thiserror::Error)]
pub enum AccessFileError {
    /// The system.
    #[error("{}: {error}", file.display())]
    System {
        /// The file.
        file: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// It is something else.
    #[error("{}: {why}", file.display())]
    Wrong {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        why: String,
    },
    /// An entry in it is wrong.
    #[error("{}: {error}", file.display())]
    Directory {
        /// The file.
        file: PathBuf,
        /// Who, and why.
        error: DirectoryError,
    },
}

impl AccessFile {
    /// That of a site: `home.toml` → `home.access`.
    #[must_use]
    pub fn beside(site: &Path) -> Self {
        Self(site.with_extension("access"))
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Which state of the file this is; none if it is not there or cannot be asked.
    #[must_use]
    pub fn stamp(&self) -> Option<Stamp> {
        Stamp::of(&self.0)
    }

    /// Who is known; empty if there is no file.
    ///
    /// # Errors
    /// It cannot be read, or is something else.
    pub fn load(&self) -> Result<Directory, AccessFileError> {
        let system = |error| AccessFileError::System { file: self.0.clone(), error };
        let wrong = |why| AccessFileError::Wrong { file: self.0.clone(), why };
        let file = match File::open(&self.0) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Directory::default()),
            Err(error) => return Err(system(error)),
        };
        let mut text = String::new();
        file.take(LONGEST + 1).read_to_string(&mut text).map_err(system)?;
        if text.len() as u64 > LONGEST {
            return Err(wrong(format!("it is longer than {LONGEST} bytes")));
        }
        let directory: Directory = toml::from_str(&text).map_err(|error| {
            let line = error.span().map_or(1, |span| line_of(&text, span.start));
            wrong(format!("line {line}: {}", error.message()))
        })?;
        match directory.check() {
            Ok(()) => Ok(directory),
            Err(error) => Err(AccessFileError::Directory { file: self.0.clone(), error }),
        }
    }

    /// Reads it, changes what it says, and writes it. Who else does so waits.
    ///
    /// # Errors
    /// As [`load`](Self::load), the change's own, or it cannot be written. Nothing has changed then.
    pub fn change<T>(
        &self,
        change: impl FnOnce(&mut Directory) -> Result<T, DirectoryError>,
    ) -> Result<T, AccessFileError> {
        let system = |error| AccessFileError::System { file: self.0.clone(), error };
        // The folder is locked, as the file itself is another one after each change.
        let folder = owned_file::folder_of(&self.0).map_err(system)?;
        // On a file system without locks two changes at a time do not wait for each other.
        let _ = folder.lock();
        let mut directory = self.load()?;
        let changed = change(&mut directory)
            .map_err(|error| AccessFileError::Directory { file: self.0.clone(), error })?;
        self.write(&directory, &folder).map_err(system)?;
        Ok(changed)
    }

    fn write(&self, directory: &Directory, folder: &File) -> io::Result<()> {
        let body = toml::to_string(directory).map_err(io::Error::other)?;
        owned_file::write(&self.0, folder, format!("{HEAD}{body}").as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::access::directory::Token;
    use crate::access::roles::Role;
    use crate::access::secret::fingerprint;
    use std::fs;

    fn token(name: &str) -> Token {
        Token { name: name.into(), roles: vec![Role::View], door: None, sha256: fingerprint(name) }
    }

    #[test]
    fn a_change_is_kept_for_the_owner_alone_and_seen() {
        let folder = tempfile::tempdir().unwrap();
        let file = AccessFile::beside(&folder.path().join("home.toml"));
        assert!(file.path().ends_with("home.access"));
        assert_eq!(file.load().unwrap(), Directory::default(), "there is none");
        assert_eq!(file.stamp(), None);
        file.change(|directory| directory.add_token(token("one"))).unwrap();
        let first = file.stamp();
        file.change(|directory| directory.add_token(token("two"))).unwrap();
        assert!(first.is_some() && file.stamp() != first);
        let names: Vec<String> = file.load().unwrap().tokens.into_iter().map(|token| token.name).collect();
        assert_eq!(names, ["one", "two"]);
        #[cfg(unix)]
        {
            let mode =
                std::os::unix::fs::PermissionsExt::mode(&fs::metadata(file.path()).unwrap().permissions());
            assert_eq!(mode & 0o777, 0o600);
        }
        let said = file.change(|directory| directory.add_token(token("two"))).unwrap_err().to_string();
        assert!(said.contains("home.access: token two is there already"), "{said}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left beside it");
    }

    #[cfg(unix)]
    #[test]
    fn what_root_writes_belongs_to_the_service() {
        use std::os::unix::fs::{MetadataExt, chown};
        let folder = tempfile::tempdir().unwrap();
        if fs::metadata(folder.path()).unwrap().uid() != 0 {
            return;
        }
        chown(folder.path(), Some(1234), Some(2345)).unwrap();
        let file = AccessFile::beside(&folder.path().join("home.toml"));
        file.change(|directory| directory.add_token(token("one"))).unwrap();
        let data = fs::metadata(file.path()).unwrap();
        assert_eq!((data.uid(), data.gid(), data.mode() & 0o777), (1234, 2345, 0o600));
    }

    #[test]
    fn changes_at_once_are_all_kept() {
        let folder = tempfile::tempdir().unwrap();
        let file = AccessFile::beside(&folder.path().join("home.toml"));
        std::thread::scope(|scope| {
            for number in 0..20 {
                let file = file.clone();
                scope.spawn(move || {
                    file.change(|directory| directory.add_token(token(&format!("{number}")))).unwrap();
                });
            }
        });
        assert_eq!(file.load().unwrap().tokens.len(), 20);
    }

    #[test]
    fn what_is_no_such_file_is_one_line_with_its_place() {
        let folder = tempfile::tempdir().unwrap();
        let file = AccessFile::beside(&folder.path().join("home.toml"));
        for (text, part) in [
            ("# all\n[[user]\n", "line 2: "),
            ("[[user]]\nname = \"a\"\nrole = \"root\"\npassword = \"\"\n", "line 3: unknown variant `root`"),
            ("[[door]]\n", "unknown field `door`"),
            ("# all\n\n[[door]]\n", "line 3: unknown field `door`"),
            ("[[user]]\nname = \"a\"\nrole = \"view\"\npassword = \"a\"\n", "user a: what is kept"),
            (&"#".repeat((1 << 20) + 1), "longer than"),
        ] {
            fs::write(file.path(), text).unwrap();
            let said = file.load().unwrap_err().to_string();
            assert!(
                said.contains("home.access: ") && said.contains(part) && said.lines().count() == 1,
                "{said}"
            );
            assert!(file.change(|_| Ok(())).is_err());
            assert_eq!(fs::read_to_string(file.path()).unwrap(), text, "left alone");
        }
        fs::write(file.path(), [0xff]).unwrap();
        assert!(file.load().is_err());
    }
}
