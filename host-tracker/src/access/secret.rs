//! Secrets that are made here, and what is kept of them.
//!
//! ```text
//!   random bytes ─▶ 32 letters, 5 bits each ─┬─▶ token     kehai_…              160 bits
//!                                            ├─▶ session   in the cookie        160 bits
//!                                            └─▶ password  xxxx-xxxx-xxxx-…     100 bits, to be typed once
//!   kept: SHA-256 of tokens and sessions, Argon2id of passwords, which people choose and guess
//! ```
//!
//! A plain hash will do for what is random: 2¹⁶⁰ of them cannot be tried. Which of its first letters agree is no secret
//! either, as a hash cannot be chosen, so it is compared as any text is.

use data_encoding::HEXLOWER;
use sha2::{Digest, Sha256};

/// Letters and digits that are not taken for each other: without l, o, 0 and 1.
const LETTERS: &[u8; 32] = b"abcdefghijkmnpqrstuvwxyz23456789";

/// Letters of a token or a session.
const LONG: usize = 32;

/// Groups of a password, and letters of a group.
const GROUPS: (usize, usize) = (5, 4);

/// In front of every token, so that one that leaked is found by searching.
const TOKEN: &str = "kehai_";

/// What is kept of a random secret, in hexadecimal digits.
#[must_use]
pub fn fingerprint(secret: &str) -> String {
    HEXLOWER.encode(&Sha256::digest(secret.as_bytes()))
}

/// A token.
///
/// # Errors
/// The system has no randomness.
pub fn token() -> Result<String, getrandom::Error> {
    Ok(format!("{TOKEN}{}", letters(LONG)?))
}

/// What a browser shows for its session.
///
/// # Errors
/// As [`token`].
pub fn session() -> Result<String, getrandom::Error> {
    letters(LONG)
}

/// A password.
///
/// # Errors
/// As [`token`].
pub fn password() -> Result<String, getrandom::Error> {
    let groups: Result<Vec<String>, _> = (0..GROUPS.0).map(|_| letters(GROUPS.1)).collect();
    Ok(groups?.join("-"))
}

fn letters(count: usize) -> Result<String, getrandom::Error> {
    let mut bytes = vec![0; count];
    getrandom::fill(&mut bytes)?;
    // 256 is a multiple of 32: each letter is as likely as any other.
    let letter = |byte: &u8| LETTERS.get(usize::from(byte % 32)).copied().map_or('a', char::from);
    Ok(bytes.iter().map(letter).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn secrets_are_long_and_none_comes_twice() {
        let (first, second) = (token().unwrap(), token().unwrap());
        assert_ne!(first, second);
        assert!(first.starts_with("kehai_") && first.len() == 38, "{first}");
        assert_eq!((session().unwrap().len(), password().unwrap().len()), (32, 24));
        let mut letters = *LETTERS;
        letters.sort_unstable();
        assert!(letters.windows(2).all(|pair| pair[0] != pair[1]));
    }

    /// Computed with Python's `hashlib`.
    #[test]
    fn a_fingerprint_is_the_sha_256() {
        let empty = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
        assert_eq!(fingerprint(""), empty);
    }
}
