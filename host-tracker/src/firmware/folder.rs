//! Firmware that lies on the tracker's machine: what an installer takes from the map to a new board.
//!
//! ```text
//!   /usr/share/kehai/firmware/
//!     BOARD-complete.uf2      to drag onto a board that shows itself as a drive
//!     BOARD-complete.hex      for a board with a debugger
//!     BOARD.elf               what updates are signed from, and what decodes the log
//!     69-kehai-probes.rules   for udev: who may use the debugger
//!     SHA256SUMS
//!     MAKERS                  whose updates the boot loaders take: a public key a line, or "development"
//! ```
//!
//! packaging/firmware.sh makes these files and the package brings them. Others in the folder are not handed out.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use data_encoding::HEXLOWER;
use kehai::update::maker::DEVELOPMENT;
use schemars::JsonSchema;
use serde::Serialize;

/// Where the package puts them.
pub const USUAL: &str = "/usr/share/kehai/firmware";
const MAKERS: &str = "MAKERS";
/// How that names the development key.
const DEVELOPERS: &str = "development";

/// A folder with firmware; it need not be there.
#[derive(Clone, Debug)]
pub struct FirmwareFolder(PathBuf);

/// What a file is for.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Purpose {
    /// Is dragged onto a board that shows itself as a drive.
    Drive,
    /// Is written by a debugger.
    Debugger,
    /// Is signed for updates, and decodes the log.
    Program,
    /// Lets a user of this PC use the debugger.
    Udev,
    /// Compares all of them.
    Sums,
}

/// A file that is handed out.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, JsonSchema)]
pub struct FirmwareFile {
    /// The board; null: it is of none.
    pub board: Option<String>,
    /// What it is for.
    pub purpose: Purpose,
    /// Its name.
    pub name: String,
    /// Its length.
    pub bytes: u64,
}

/// All that is handed out.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, JsonSchema)]
pub struct FirmwareFiles {
    /// Board by board.
    pub files: Vec<FirmwareFile>,
    /// Whether the boot loaders take updates signed with the development key, whose secret everybody has; null: not known.
    pub development_key: Option<bool>,
    /// Where on the tracker's machine they lie.
    pub folder: String,
}

impl Default for FirmwareFolder {
    fn default() -> Self {
        Self::at(USUAL)
    }
}

impl FirmwareFolder {
    /// The folder at a path.
    pub fn at(path: impl Into<PathBuf>) -> Self {
        Self(path.into())
    }

    /// What is handed out from it: nothing, if there is no such folder.
    ///
    /// # Errors
    /// It is there and cannot be read.
    pub fn list(&self) -> io::Result<FirmwareFiles> {
        let mut files = Vec::new();
        for entry in present(fs::read_dir(&self.0))?.into_iter().flatten() {
            let entry = entry?;
            let about = fs::metadata(entry.path())?;
            if let Some(name) = entry.file_name().to_str().filter(|_| about.is_file())
                && let Some((purpose, board)) = purpose(name)
            {
                files.push(FirmwareFile { board, purpose, name: name.to_owned(), bytes: about.len() });
            }
        }
        files.sort_unstable();
        let makers = present(fs::read_to_string(self.0.join(MAKERS)))?;
        let names = [DEVELOPERS.to_owned(), HEXLOWER.encode(&DEVELOPMENT)];
        let is_development = |key: &str| names.iter().any(|name| key.trim() == name);
        let development_key = makers.map(|keys| keys.lines().any(is_development));
        Ok(FirmwareFiles { files, development_key, folder: self.path().display().to_string() })
    }

    /// The bytes of a file that is handed out; none, if there is no such file.
    ///
    /// # Errors
    /// It is there and cannot be read.
    pub fn read(&self, name: &str) -> io::Result<Option<Vec<u8>>> {
        // Names that are listed hold no way out of the folder.
        if !self.list()?.files.iter().any(|file| file.name == name) {
            return Ok(None);
        }
        present(fs::read(self.0.join(name)))
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.0
    }
}

/// What a file of this name is for, and which board it is of; none, if it is not handed out.
fn purpose(name: &str) -> Option<(Purpose, Option<String>)> {
    let of = |purpose, board: &str| Some((purpose, Some(board.to_owned())));
    if let Some(board) = name.strip_suffix("-complete.uf2") {
        return of(Purpose::Drive, board);
    }
    if let Some(board) = name.strip_suffix("-complete.hex") {
        return of(Purpose::Debugger, board);
    }
    match name.strip_suffix(".elf") {
        Some(loader) if loader.ends_with("-boot") => None,
        Some(board) => of(Purpose::Program, board),
        None if name == "SHA256SUMS" => Some((Purpose::Sums, None)),
        None => name.ends_with(".rules").then_some((Purpose::Udev, None)),
    }
}

/// None, where there is nothing.
fn present<T>(found: io::Result<T>) -> io::Result<Option<T>> {
    match found {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        found => found.map(Some),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PICO: &str = "w5500-evb-pico2";

    #[test]
    fn files_for_boards_are_handed_out_and_no_others() {
        let folder = tempfile::tempdir().unwrap();
        let firmware = FirmwareFolder::at(folder.path());
        for name in [
            "w5500-evb-pico2-complete.uf2",
            "w5500-evb-pico2-complete.hex",
            "w5500-evb-pico2.elf",
            "w5500-evb-pico2-boot.elf",
            "nucleo-h563zi-complete.hex",
            "69-kehai-probes.rules",
            "SHA256SUMS",
            "maker.key",
            "MAKERS",
        ] {
            fs::write(folder.path().join(name), name).unwrap();
        }
        fs::create_dir(folder.path().join("a-complete.hex")).unwrap();
        let listed = firmware.list().unwrap();
        let names: Vec<&str> = listed.files.iter().map(|file| file.name.as_str()).collect();
        assert_eq!(
            names,
            [
                "69-kehai-probes.rules",
                "SHA256SUMS",
                "nucleo-h563zi-complete.hex",
                "w5500-evb-pico2-complete.uf2",
                "w5500-evb-pico2-complete.hex",
                "w5500-evb-pico2.elf",
            ]
        );
        let drive = FirmwareFile {
            board: Some(PICO.to_owned()),
            purpose: Purpose::Drive,
            name: "w5500-evb-pico2-complete.uf2".to_owned(),
            bytes: 28,
        };
        assert_eq!(listed.files[3], drive);
        assert_eq!(firmware.read(&drive.name).unwrap().unwrap(), drive.name.as_bytes());
        for other in
            ["maker.key", "w5500-evb-pico2-boot.elf", "MAKERS", "../../etc/passwd", "a-complete.hex", ""]
        {
            assert_eq!(firmware.read(other).unwrap(), None, "{other}");
        }
    }

    #[test]
    fn whose_updates_are_taken_is_said_or_not_known() {
        let folder = tempfile::tempdir().unwrap();
        let firmware = FirmwareFolder::at(folder.path());
        assert_eq!(firmware.list().unwrap().development_key, None);
        let makers = folder.path().join(MAKERS);
        let development = HEXLOWER.encode(&DEVELOPMENT);
        for (keys, is_development) in [
            (format!("{}\n{development}\n", "0a".repeat(32)), true),
            ("development\n".to_owned(), true),
            (format!("{}\n", "0a".repeat(32)), false),
        ] {
            fs::write(&makers, keys).unwrap();
            assert_eq!(firmware.list().unwrap().development_key, Some(is_development));
        }
    }

    #[test]
    fn without_a_folder_nothing_is_handed_out_and_the_place_is_said() {
        let listed = FirmwareFolder::at("/no/such/folder").list().unwrap();
        let nothing =
            FirmwareFiles { files: Vec::new(), development_key: None, folder: "/no/such/folder".to_owned() };
        assert_eq!(listed, nothing);
    }
}
