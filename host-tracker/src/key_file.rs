//! The file of a site's keys: its secret, and which devices have been given keys made of it.
//!
//! ```toml
//! secret = "64 hexadecimal digits"
//!
//! [[module]]
//! id = "02:00:00:00:00:01"
//! name = "left"
//! generation = 1
//! ```
//!
//! It lies beside the site file, as `SITE.keys`, readable by its owner alone. A program that has it speaks for the site and
//! reads everything; an installer who loses it needs the button of each board. It is replaced as a whole: it is the old or the
//! new one.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use data_encoding::{HEXLOWER, HEXLOWER_PERMISSIVE};
use kehai::seal::{Key, Nonces};
use kehai::wire::ModuleId;
use kehai_tracking::keys::{Claimed, Keys};
use serde::{Deserialize, Serialize};

use crate::module_id;
use crate::owned_file::{self, Stamp};

/// First line of the file.
const HEAD: &str = "# The keys of this site's modules. A holder of this file speaks for the site: keep it, and a copy, in safe places.\n";

/// Why there are no keys.
#[derive(Debug, thiserror::Error)]
pub enum KeyFileError {
    /// The system.
    #[error("{}: {error}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// The system has no randomness.
    #[error("no key can be made: {0}")]
    Random(#[from] getrandom::Error),
    /// Something else is in the file.
    #[error("{}: {what}: restore the file from a copy", file.display())]
    Wrong {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        what: String,
    },
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    secret: String,
    #[serde(default)]
    module: Vec<WrittenModule>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenModule {
    id: String,
    name: String,
    generation: u8,
}

/// Where the keys of a site are: beside its file.
#[must_use]
pub fn beside(site_file: &Path) -> PathBuf {
    site_file.with_extension("keys")
}

/// The keys in `file`; none if there is no such file.
///
/// # Errors
/// It cannot be read, or holds something else.
pub fn load(file: &Path) -> Result<Option<Keys>, KeyFileError> {
    let text = match fs::read_to_string(file) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(KeyFileError::File { file: file.to_path_buf(), error }),
    };
    let wrong = |what: String| KeyFileError::Wrong { file: file.to_path_buf(), what };
    let written: Written = toml::from_str(&text).map_err(|error| wrong(error.message().to_owned()))?;
    let secret = HEXLOWER_PERMISSIVE.decode(written.secret.as_bytes()).ok();
    let secret = secret
        .and_then(|secret| secret.try_into().ok())
        .ok_or_else(|| wrong("its secret has not 64 hexadecimal digits".to_owned()))?;
    let mut keys = Keys::new(Key(secret));
    for module in written.module {
        let id: ModuleId = module_id::read(&module.id)
            .ok_or_else(|| wrong(format!("\"{}\" is no identity of a module", module.id)))?;
        if module.generation == 0 {
            return Err(wrong(format!("module {}: generations count from 1", module.id)));
        }
        keys.insert(id, Claimed { name: module.name, generation: module.generation });
    }
    Ok(Some(keys))
}

/// The keys in `file`; new ones, of no device yet, are made and written there if there are none. Of several processes that
/// find none, one makes them, and the others wait for it.
///
/// # Errors
/// As [`load`]; they cannot be made or written.
pub fn load_or_create(file: &Path) -> Result<Keys, KeyFileError> {
    let _folder = locked_folder(file)?;
    if let Some(keys) = load(file)? {
        return Ok(keys);
    }
    let keys = Keys::new(Key(random()?));
    save(file, &keys)?;
    Ok(keys)
}

/// Notes in `file` what `device` was given of `keys`, beside all that was noted there meanwhile; the keys with it. Another
/// process that does so waits.
///
/// # Errors
/// As [`load`]; the file has another secret by now, or cannot be written. It is the old or the new one.
pub fn note(file: &Path, keys: &Keys, device: ModuleId, claimed: Claimed) -> Result<Keys, KeyFileError> {
    let _folder = locked_folder(file)?;
    let mut newest = load(file)?.unwrap_or_else(|| keys.clone());
    if newest.secret() != keys.secret() {
        let what = format!("its secret was replaced while {device} was given a key of the one before");
        return Err(KeyFileError::Wrong { file: file.to_path_buf(), what });
    }
    newest.insert(device, claimed);
    save(file, &newest)?;
    Ok(newest)
}

/// The folder of `file`, locked until it is dropped. The file itself is another one after each change.
fn locked_folder(file: &Path) -> Result<File, KeyFileError> {
    let folder = owned_file::folder_of(file)
        .map_err(|error| KeyFileError::File { file: file.to_path_buf(), error })?;
    // On a file system without locks two changes at a time do not wait for each other.
    let _ = folder.lock();
    Ok(folder)
}

/// Writes the keys, for their owner alone. The file is the old or the new one.
pub(crate) fn save(file: &Path, keys: &Keys) -> Result<(), KeyFileError> {
    let failed = |error| KeyFileError::File { file: file.to_path_buf(), error };
    let module = |(id, claimed): (ModuleId, &Claimed)| WrittenModule {
        id: id.to_string(),
        name: claimed.name.clone(),
        generation: claimed.generation,
    };
    let Key(secret) = keys.secret();
    let written = Written { secret: HEXLOWER.encode(&secret), module: keys.devices().map(module).collect() };
    let body = toml::to_string(&written).map_err(|error| failed(io::Error::other(error)))?;
    let folder = owned_file::folder_of(file).map_err(failed)?;
    owned_file::write(file, &folder, format!("{HEAD}{body}").as_bytes()).map_err(failed)
}

/// A file of keys that is looked at again and again: modules are claimed, and keys rotated, while the tracker runs.
#[derive(Debug)]
pub struct Watched {
    file: PathBuf,
    stamp: Option<Stamp>,
    /// The system did not let the file of this stamp be read.
    is_unread: bool,
}

impl Watched {
    /// Looks at `file`, which may not be there yet.
    #[must_use]
    pub const fn new(file: PathBuf) -> Self {
        Self { file, stamp: None, is_unread: false }
    }

    /// The keys, if the file has changed since they were asked for; with an error it counts as changed once. A file that the system
    /// did not let be read counts as changed until it was.
    pub fn changed(&mut self) -> Option<Result<Keys, KeyFileError>> {
        self.changed_as(load)
    }

    fn changed_as(
        &mut self,
        load: impl FnOnce(&Path) -> Result<Option<Keys>, KeyFileError>,
    ) -> Option<Result<Keys, KeyFileError>> {
        let stamp = Stamp::of(&self.file)?;
        if self.stamp == Some(stamp) && !self.is_unread {
            return None;
        }
        let keys = load(&self.file);
        self.is_unread = matches!(keys, Err(KeyFileError::File { .. }));
        self.stamp = Some(stamp);
        keys.transpose()
    }
}

/// A row of nonces that cannot be foretold.
///
/// # Errors
/// The system has no randomness.
pub fn nonces() -> Result<Nonces, KeyFileError> {
    random().map(Nonces::new)
}

/// Random bytes.
///
/// # Errors
/// The system has none.
pub fn random<const LEN: usize>() -> Result<[u8; LEN], KeyFileError> {
    let mut bytes = [0; LEN];
    getrandom::fill(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_read_as_they_were_written_and_for_their_owner_alone() {
        let folder = tempfile::tempdir().unwrap();
        let file = beside(&folder.path().join("door.toml"));
        assert_eq!(load(&file).unwrap(), None);
        let mut keys = load_or_create(&file).unwrap();
        assert_eq!(load_or_create(&file).unwrap(), keys, "the same secret");
        keys.insert(ModuleId([2, 0, 0, 0, 0, 1]), Claimed { name: "left".to_owned(), generation: 3 });
        save(&file, &keys).unwrap();
        assert_eq!(load(&file).unwrap(), Some(keys));
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o600);
        }
    }

    #[test]
    fn keys_that_are_noted_at_once_are_all_kept_with_one_secret() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("door.keys");
        let both_ready = std::sync::Barrier::new(8);
        let claim = |number: u8| {
            both_ready.wait();
            let keys = load_or_create(&file);
            // Each has read the file before any has written into it, as while they speak with their devices.
            both_ready.wait();
            let keys = keys.unwrap();
            let claimed = Claimed { name: format!("{number}"), generation: 1 };
            note(&file, &keys, ModuleId([2, 0, 0, 0, 0, number]), claimed).unwrap().secret()
        };
        let secrets: Vec<Key> = std::thread::scope(|scope| {
            let claims: Vec<_> = (0..8).map(|number| scope.spawn(move || claim(number))).collect();
            claims.into_iter().map(|claim| claim.join().unwrap()).collect()
        });
        let keys = load(&file).unwrap().unwrap();
        assert_eq!(keys.devices().count(), 8);
        assert!(secrets.iter().all(|secret| *secret == keys.secret()));
    }

    #[test]
    fn a_key_of_another_secret_is_not_noted_and_one_of_a_file_that_is_gone_is() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("door.keys");
        let (device, claimed) = (ModuleId([2; 6]), Claimed { name: "left".to_owned(), generation: 1 });
        let keys = Keys::new(Key([1; 32]));
        assert_eq!(note(&file, &keys, device, claimed.clone()).unwrap(), load(&file).unwrap().unwrap());
        let before = fs::read(&file).unwrap();
        let error = note(&file, &Keys::new(Key([2; 32])), device, claimed).unwrap_err().to_string();
        assert!(
            error.contains("door.keys: its secret was replaced") && error.lines().count() == 1,
            "{error}"
        );
        assert_eq!(fs::read(&file).unwrap(), before);
    }

    #[test]
    fn keys_that_could_not_be_read_for_a_moment_are_read_again_and_wrong_ones_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("door.keys");
        let keys = load_or_create(&file).unwrap();
        let mut watched = Watched::new(file.clone());
        let moment = io::Error::other("too many open files");
        let failed = KeyFileError::File { file: file.clone(), error: moment };
        assert!(watched.changed_as(|_| Err(failed)).unwrap().is_err());
        assert_eq!(watched.changed().unwrap().unwrap(), keys);
        assert!(watched.changed().is_none());
        fs::write(&file, "secret = 1").unwrap();
        assert!(watched.changed().unwrap().is_err());
        assert!(watched.changed().is_none(), "it is said once");
    }

    #[test]
    fn what_are_no_keys_is_said_in_one_line_and_never_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("door.keys");
        let digits = "ab".repeat(32);
        for text in [
            "",
            "secret = \"12\"",
            &format!("secret = \"{digits}\"\n[[module]]\nid = \"x\"\nname = \"a\"\ngeneration = 1"),
            &format!(
                "secret = \"{digits}\"\n[[module]]\nid = \"02:00:00:00:00:01\"\nname = \"a\"\ngeneration = 0"
            ),
        ] {
            fs::write(&file, text).unwrap();
            let error = load_or_create(&file).unwrap_err().to_string();
            assert!(error.contains("door.keys") && error.lines().count() == 1, "{error}");
            assert_eq!(fs::read_to_string(&file).unwrap(), text);
        }
    }
}
