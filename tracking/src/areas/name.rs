//! The name of an area: a part of topics, and in front of the names of its zones.
//!
//! ```text
//!   hall-2   ─▶   kehai/campus/hall-2/frame   ·   zone "hall-2/desk"
//! ```

use std::fmt;
use std::str::FromStr;

/// Longest name, bytes: as long as that of a host.
const LONGEST: usize = 63;

/// A name: letters, digits, `-`, `_`, `.`; what stands for something else in keys of Zenoh or topics of MQTT is in none.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct AreaName(String);

/// Why a text is no name of an area.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum NameError {
    /// It is empty or too long.
    #[error("a name has 1 to {LONGEST} bytes")]
    Length,
    /// It has a character that means something else.
    #[error("a name has letters, digits, -, _ and . only")]
    Character,
}

impl AreaName {
    /// The text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for AreaName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FromStr for AreaName {
    type Err = NameError;

    fn from_str(text: &str) -> Result<Self, NameError> {
        if !(1..=LONGEST).contains(&text.len()) {
            return Err(NameError::Length);
        }
        let is_plain = |letter: char| letter.is_alphanumeric() || matches!(letter, '-' | '_' | '.');
        if !text.chars().all(is_plain) {
            return Err(NameError::Character);
        }
        Ok(Self(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_means_nothing_else_in_any_key() {
        assert_eq!("hall-2".parse::<AreaName>().unwrap().as_str(), "hall-2");
        assert!("玄関".parse::<AreaName>().is_ok());
        assert_eq!("".parse::<AreaName>(), Err(NameError::Length));
        assert_eq!("x".repeat(64).parse::<AreaName>(), Err(NameError::Length));
        for text in ["a/b", "a*", "a+", "#", "a$", "a?", "a b", "a\n"] {
            assert_eq!(text.parse::<AreaName>(), Err(NameError::Character), "{text}");
        }
    }
}
