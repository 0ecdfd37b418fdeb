//! The keys of modules in a restoration: none that a module may have is lost, as then only its button helps.
//!
//! ```text
//!   the archive has none ─────────▶ those that are there stay
//!   both are of one secret ───────▶ every module of both, each with the later generation of its keys
//!   another secret, or damaged ───▶ those that are there stay beside, as site.keys.before-restore
//! ```

use std::path::{Path, PathBuf};

use kehai_tracking::keys::Keys;

use super::error::{BackupError, of};
use super::plan::waiting;
use crate::key_file::{self, KeyFileError};

/// Joins the keys that wait for `place` with those that are there; where the latter go, if they cannot be joined.
pub(super) fn join(place: &Path) -> Result<Option<PathBuf>, BackupError> {
    if !place.exists() {
        return Ok(None);
    }
    let waits = waiting(place);
    match (readable(place)?, readable(&waits)?) {
        (Some(present), Some(restored)) if present.secret() == restored.secret() => {
            key_file::save(&waits, &newest(&present, restored)).map_err(in_words(&waits))?;
            Ok(None)
        }
        _ => Ok(Some(free_name(place))),
    }
}

/// The keys in a file; none if it holds something else.
fn readable(file: &Path) -> Result<Option<Keys>, BackupError> {
    match key_file::load(file) {
        Err(KeyFileError::Wrong { .. }) => Ok(None),
        read => read.map_err(in_words(file)),
    }
}

fn in_words(file: &Path) -> impl Fn(KeyFileError) -> BackupError + '_ {
    move |error| match error {
        KeyFileError::File { error, .. } => of(file)(error),
        other => of(file)(std::io::Error::other(other)),
    }
}

/// The modules of both. The later generation is the one that a rotation has given the module.
fn newest(present: &Keys, mut restored: Keys) -> Keys {
    for (device, claimed) in present.devices() {
        if restored.get(device).is_none_or(|before| before.generation < claimed.generation) {
            restored.insert(device, claimed.clone());
        }
    }
    restored
}

/// `site.keys.before-restore`, or the first with a number behind it that is free.
fn free_name(place: &Path) -> PathBuf {
    let name = place.file_name().unwrap_or_default().to_string_lossy();
    let numbers = std::iter::once(String::new()).chain((2_u32..).map(|number| number.to_string()));
    let mut names = numbers.map(|number| place.with_file_name(format!("{name}.before-restore{number}")));
    names.find(|free| !free.exists()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use kehai::seal::Key;
    use kehai::wire::ModuleId;
    use kehai_tracking::keys::Claimed;

    use super::super::tests::Home;
    use super::super::{Part, restore};
    use super::*;

    /// Keys of these modules, each with its generation.
    fn keys(secret: u8, modules: &[(u8, u8)]) -> Keys {
        let mut keys = Keys::new(Key([secret; 32]));
        for &(last, generation) in modules {
            keys.insert(ModuleId([2, 0, 0, 0, 0, last]), Claimed { name: last.to_string(), generation });
        }
        keys
    }

    #[test]
    fn modules_that_were_claimed_or_rotated_since_keep_their_keys() {
        let home = Home::full("home");
        let file = home.places.of(Part::Keys).unwrap();
        let write = |modules: &[(u8, u8)]| key_file::save(&file, &keys(1, modules)).unwrap();
        let restored = |archive: &Path| {
            assert_eq!(restore(archive, &home.places, true).unwrap().keys_before, None);
            key_file::load(&file).unwrap().unwrap()
        };
        fs::remove_file(&file).unwrap();
        let archive = home.backup();
        write(&[(1, 1)]);
        assert_eq!(restored(&archive), keys(1, &[(1, 1)]), "the archive has none");
        write(&[(1, 1), (2, 3)]);
        let archive = home.backup();
        write(&[(1, 2), (2, 2), (3, 1)]);
        assert_eq!(restored(&archive), keys(1, &[(1, 2), (2, 3), (3, 1)]));
    }

    #[test]
    fn keys_of_another_secret_stay_beside() {
        let home = Home::full("home");
        let file = home.places.of(Part::Keys).unwrap();
        key_file::save(&file, &keys(1, &[(1, 1)])).unwrap();
        let archive = home.backup();
        let beside = |number: &str| file.with_file_name(format!("home.keys.before-restore{number}"));
        key_file::save(&file, &keys(2, &[(1, 9)])).unwrap();
        for number in ["", "2"] {
            let before = fs::read(&file).unwrap();
            let restored = restore(&archive, &home.places, true).unwrap();
            assert_eq!(restored.keys_before, Some(beside(number)));
            assert_eq!(fs::read(beside(number)).unwrap(), before);
            assert_eq!(key_file::load(&file).unwrap(), Some(keys(1, &[(1, 1)])));
            fs::write(&file, "damaged").unwrap();
        }
    }
}
