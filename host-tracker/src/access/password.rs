//! Passwords, as they are kept: Argon2id with a salt of its own each, so that who gets the file must guess each anew.
//!
//! ```text
//!   $argon2id$v=19$m=19456,t=2,p=1$salt$hash        19 MiB and some hundredths of a second a try
//! ```
//!
//! Source: RFC 9106; parameters by the OWASP Password Storage Cheat Sheet.

use argon2::Argon2;
use argon2::password_hash::phc::PasswordHash;
use argon2::password_hash::{PasswordHasher, PasswordVerifier};

/// Bytes of a salt: those of RFC 9106, 3.1.
const SALT: usize = 16;

/// Fewest letters of a password that a user chose: NIST SP 800-63B-4, 3.1.1.2, for the only factor.
pub const SHORTEST: usize = 15;

/// Most bytes of a password: longer ones are no passwords, and cost the hash time.
pub const LONGEST: usize = 256;

/// Hash of an unknown password: compared where there is no such user, so that this takes as long.
const NOBODYS: &str =
    "$argon2id$v=19$m=19456,t=2,p=1$a2VoYWlrZWhhaWtlaGFp$9tqUEv9rvVf2Nbdx3a4JqB0Sg0FT7kSxC3kBSnE0m0o";

/// Why there is no hash.
#[derive(Debug, thiserror::Error)]
pub enum PasswordError {
    /// Too few letters.
    #[error("a password has at least {SHORTEST} letters: five words will do")]
    Short,
    /// Too many.
    #[error("a password has at most {LONGEST} bytes")]
    Long,
    /// No randomness.
    #[error("the system has no randomness: {0}")]
    Random(#[from] getrandom::Error),
    /// No memory, or the like.
    #[error("the password cannot be hashed: {0}")]
    Hash(#[from] argon2::password_hash::Error),
}

/// What is kept of a password.
///
/// # Errors
/// [`PasswordError`].
pub fn hash(password: &str) -> Result<String, PasswordError> {
    match password {
        _ if password.chars().count() < SHORTEST => Err(PasswordError::Short),
        _ if password.len() > LONGEST => Err(PasswordError::Long),
        _ => {
            let mut salt = [0; SALT];
            getrandom::fill(&mut salt)?;
            Ok(Argon2::default().hash_password_with_salt(password.as_bytes(), &salt)?.to_string())
        }
    }
}

/// Whether this is the password. Without a hash it takes as long and is not, so that names cannot be guessed by time.
#[must_use]
pub fn is(password: &str, hash: Option<&str>) -> bool {
    let Ok(kept) = PasswordHash::new(hash.unwrap_or(NOBODYS)) else { return false };
    password.len() <= LONGEST
        && Argon2::default().verify_password(password.as_bytes(), &kept).is_ok()
        && hash.is_some()
}

/// Whether this is a hash that can be compared with.
#[must_use]
pub fn is_hash(text: &str) -> bool {
    PasswordHash::new(text).is_ok_and(|hash| hash.algorithm.as_str() == "argon2id" && hash.hash.is_some())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_password_is_known_again_and_no_other() {
        let kept = hash("correct horse battery").unwrap();
        assert!(is_hash(&kept) && kept.starts_with("$argon2id$v=19$m=19456,t=2,p=1$"), "{kept}");
        assert!(is("correct horse battery", Some(&kept)));
        assert!(!is("correct horse batterz", Some(&kept)));
        assert!(!is("", Some(&kept)) && !is(&"a".repeat(257), Some(&kept)));
        assert_ne!(kept, hash("correct horse battery").unwrap(), "a salt of its own");
        assert!(!is("correct horse battery", None) && !is("x", Some("no hash")));
    }

    #[test]
    fn a_name_that_is_not_known_takes_as_long() {
        let kept = hash("correct horse battery").unwrap();
        let cost = |hash: &str| hash.rsplitn(3, '$').nth(2).map(str::to_owned);
        assert!(is_hash(NOBODYS) && cost(NOBODYS) == cost(&kept), "{kept}");
    }

    #[test]
    fn short_and_endless_ones_are_refused() {
        assert!(matches!(hash("fourteen chars"), Err(PasswordError::Short)));
        assert!(hash("fifteen letters").is_ok());
        assert!(matches!(hash(&"a".repeat(257)), Err(PasswordError::Long)));
    }
}
