//! Card identifiers, as they may be kept: never themselves, only what a secret key of this site makes of them.
//!
//! ```text
//!   card "04:A2:2B:…" ─ plain: one spelling, 04A22B… ─▶ HMAC-SHA-256 (key) ─▶ first 16 bytes ─▶ CardHash
//!   key   32 random bytes in a file of its own, readable by its owner alone, never in the database
//! ```
//!
//! A card's number has few enough digits that a plain hash of it is undone by trying all of them. With a key, a reader
//! of the database, an export or a backup of it cannot do that without the key's file. Deleting that file makes all
//! that was kept meaningless. 16 bytes: two of a million cards of a site collide once in 10²⁶ sites.
//!
//! Source: H. Krawczyk, M. Bellare, R. Canetti, "HMAC: Keyed-Hashing for Message Authentication" (RFC 2104).

use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use data_encoding::{HEXLOWER, HEXLOWER_PERMISSIVE};
use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;

use crate::key_file::{self, KeyFileError};
use crate::owned_file;
use kehai_tracking::door::Card;

/// Bytes of a key: as many as the hash has.
const KEY_LEN: usize = 32;

/// Bytes that are kept of a hash.
const HASH_LEN: usize = 16;

/// What is kept of a card.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CardHash([u8; HASH_LEN]);

/// A site's key.
#[derive(Clone, PartialEq, Eq)]
pub struct CardKey([u8; KEY_LEN]);

/// Why there is no key.
#[derive(Debug, thiserror::Error)]
pub enum CardKeyError {
    /// The system.
    #[error("{}: {error}", file.display())]
    File {
        /// The key's file.
        file: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// The system has no randomness.
    #[error(transparent)]
    Random(#[from] KeyFileError),
    /// Something else is in the file.
    #[error(
        "{}: this is no card key, which has {} hexadecimal digits: restore it, or delete it to begin with a new one", file.display(), 2 * KEY_LEN
    )]
    Wrong {
        /// The key's file.
        file: PathBuf,
    },
}

impl CardKey {
    /// The key of these bytes: for tests, or a key that is kept elsewhere.
    #[must_use]
    pub const fn new(bytes: [u8; KEY_LEN]) -> Self {
        Self(bytes)
    }

    /// The key in `file`. If there is none, a random one is made and written there, for its owner alone. Of several processes
    /// that find none, one makes it, and the others wait for it.
    ///
    /// # Errors
    /// The file cannot be read or made, or holds something else. Nothing is overwritten.
    pub fn load(file: &Path) -> Result<Self, CardKeyError> {
        if let Some(key) = Self::read(file)? {
            return Ok(key);
        }
        let failed = |error| CardKeyError::File { file: file.to_path_buf(), error };
        let folder = owned_file::folder_of(file).map_err(failed)?;
        // On a file system without locks two first starts at a time do not wait for each other.
        let _ = folder.lock();
        if let Some(key) = Self::read(file)? {
            return Ok(key);
        }
        let key = Self(key_file::random()?);
        let text = format!("{}\n", HEXLOWER.encode(&key.0));
        owned_file::write(file, &folder, text.as_bytes()).map_err(failed)?;
        Ok(key)
    }

    fn read(file: &Path) -> Result<Option<Self>, CardKeyError> {
        let text = match fs::read_to_string(file) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(CardKeyError::File { file: file.to_path_buf(), error }),
        };
        let bytes = HEXLOWER_PERMISSIVE.decode(text.trim().as_bytes()).ok();
        let key = bytes.and_then(|bytes| bytes.try_into().ok()).map(Self);
        key.map(Some).ok_or_else(|| CardKeyError::Wrong { file: file.to_path_buf() })
    }

    /// Where the key of a site is kept: `home.toml` → `home.card-key`, beside it.
    #[must_use]
    pub fn beside(site: &Path) -> PathBuf {
        site.with_extension("card-key")
    }

    /// What is kept of `card`, as its reader gives it: space around it, whether letters are small, and what is
    /// between the bytes of a number or the groups of a UUID makes no difference.
    #[must_use]
    pub fn hash(&self, card: &str) -> CardHash {
        let plain = plain(card);
        let mut hash = [0; HASH_LEN];
        // A key of any length will do.
        if let Ok(mut mac) = Hmac::<Sha256>::new_from_slice(&self.0) {
            mac.update(plain.as_bytes());
            hash.iter_mut().zip(mac.finalize().into_bytes()).for_each(|(to, from)| *to = from);
        }
        CardHash(hash)
    }
}

impl CardHash {
    /// Its bytes, as the database has them.
    #[must_use]
    pub const fn bytes(&self) -> &[u8; HASH_LEN] {
        &self.0
    }
}

impl From<Card> for CardHash {
    fn from(card: Card) -> Self {
        Self(card.0.to_be_bytes())
    }
}

impl From<CardHash> for Card {
    fn from(hash: CardHash) -> Self {
        Self(u128::from_be_bytes(hash.0))
    }
}

impl fmt::Display for CardHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&HEXLOWER.encode(&self.0))
    }
}

impl fmt::Debug for CardHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "CardHash({self})")
    }
}

/// Keys are not printed.
impl fmt::Debug for CardKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("CardKey(…)")
    }
}

/// Digits in each group of a UUID.
const UUID: [usize; 5] = [8, 4, 4, 4, 12];

/// One spelling of a card, however its reader writes it: in capitals, without space around it, and without what is
/// between the bytes of a number (`04:A2:2B`) or the groups of a UUID.
///
/// Other separators belong to the card: without them `1-12` and `11-2` would be one.
pub(crate) fn plain(card: &str) -> String {
    let capitals: String = card.trim().chars().flat_map(char::to_uppercase).collect();
    let groups: Vec<&str> = capitals.split(|letter: char| !letter.is_alphanumeric()).collect();
    let is_hexadecimal = groups.iter().all(|group| group.bytes().all(|digit| digit.is_ascii_hexdigit()));
    let are_bytes = groups.iter().all(|group| group.len() == 2);
    let is_uuid = groups.iter().map(|group| group.len()).eq(UUID);
    if is_hexadecimal && (are_bytes || is_uuid) { groups.concat() } else { capitals }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Computed with Python's `hmac`.
    #[test]
    fn a_hash_is_the_hmac_of_one_spelling() {
        let key = CardKey::new([7; KEY_LEN]);
        let hash = key.hash("04:a2:2b:c1");
        assert_eq!(hash.to_string(), "aafebd9e17252351a3e34960447ef802");
        assert_eq!(hash, key.hash("04A22BC1"));
        assert_eq!(hash, key.hash(" 04-A2-2b-C1\n"));
        assert_eq!(hash, key.hash("04 A2 2B C1"));
        assert_ne!(hash, key.hash("04A22BC2"));
        assert_ne!(hash, CardKey::new([8; KEY_LEN]).hash("04A22BC1"));
    }

    #[test]
    fn only_bytes_and_uuids_are_alike_without_their_separators() {
        for card in ["04:A2:2B", "04 A2 2B", "04-a2-2b", "04a22b", " 04:A2:2B\n"] {
            assert_eq!(plain(card), "04A22B", "{card}");
        }
        for uuid in ["f7826da6-4fa2-4e98-8024-bc5b71e0893e", "F7826DA64FA24E988024BC5B71E0893E"] {
            assert_eq!(plain(uuid), "F7826DA64FA24E988024BC5B71E0893E");
        }
        // A four-byte number in decimal digits has no separators.
        assert_eq!(plain("0078945123"), "0078945123");
        let others = "1-12|11-2|112|--|##||04:A2:2|04::A2|:04:A2|040:A2|tag 7|tag7|04:G2|123,45678|12345678";
        let spelled: BTreeSet<String> = others.split('|').map(plain).collect();
        assert_eq!(spelled.len(), others.split('|').count(), "each is a card of its own: {spelled:?}");
        assert_ne!(plain("f7826da6-4fa2-4e98-8024"), plain("f7826da64fa24e988024"), "no whole UUID");
    }

    #[test]
    fn a_key_is_made_once_for_its_owner_alone_and_never_printed() {
        let folder = tempfile::tempdir().unwrap();
        let file = CardKey::beside(&folder.path().join("home.toml"));
        assert!(file.ends_with("home.card-key"));
        let key = CardKey::load(&file).unwrap();
        assert_eq!(CardKey::load(&file).unwrap(), key);
        assert_ne!(CardKey::load(&folder.path().join("other")).unwrap(), key);
        assert_eq!(format!("{key:?}"), "CardKey(…)");
        #[cfg(unix)]
        {
            let mode = std::os::unix::fs::PermissionsExt::mode(&fs::metadata(&file).unwrap().permissions());
            assert_eq!(mode & 0o777, 0o600);
        }
    }

    #[test]
    fn a_key_that_cannot_be_written_whole_leaves_no_file() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("home.card-key");
        // No file takes the place of a folder that is not empty.
        fs::create_dir_all(folder.path().join(".home.card-key.new/in the way")).unwrap();
        assert!(CardKey::load(&file).is_err());
        assert!(!file.exists());
    }

    #[cfg(unix)]
    #[test]
    fn a_key_that_root_makes_is_its_folders_owners() {
        use std::os::unix::fs::{MetadataExt, chown};
        let folder = tempfile::tempdir().unwrap();
        // Only root can give a folder away.
        if chown(folder.path(), Some(4242), Some(4242)).is_err() {
            return;
        }
        let file = folder.path().join("home.card-key");
        CardKey::load(&file).unwrap();
        let made = fs::metadata(&file).unwrap();
        assert_eq!((made.uid(), made.gid()), (4242, 4242));
    }

    #[test]
    fn first_starts_at_once_make_one_key() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("home.card-key");
        let keys: Vec<CardKey> = std::thread::scope(|scope| {
            let starts: Vec<_> = (0..8).map(|_| scope.spawn(|| CardKey::load(&file).unwrap())).collect();
            starts.into_iter().map(|start| start.join().unwrap()).collect()
        });
        assert!(keys.iter().all(|key| *key == keys[0]));
    }

    #[test]
    fn what_is_no_key_is_refused_and_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("home.card-key");
        for text in ["", "12", &"g".repeat(64), &"é".repeat(32)] {
            fs::write(&file, text).unwrap();
            let error = CardKey::load(&file).unwrap_err().to_string();
            assert!(error.contains("home.card-key") && error.contains("64 hexadecimal digits"), "{error}");
            assert_eq!(fs::read_to_string(&file).unwrap(), text);
        }
        assert!(CardKey::load(&folder.path().join("no/folder")).is_err());
    }
}
