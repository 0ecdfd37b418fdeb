//! Updates: a signed image is received while the old one runs, tried once, and kept only if it says itself that it works.
//!
//! ```text
//!   host ─ manifest, chunks ─▶ image that runs ─▶ flash: spare │ notes
//!                                   │ starts anew
//!                                   ▼
//!   boot loader: complete? ─▶ maker, program, version, digest right? ─▶ active ⇄ spare ─▶ the new image, on trial
//!                                         │ no: says why                                      │
//!                                         ▼                                                   ├─ works: confirms itself
//!                              the old image as before  ◀── active ⇄ spare ◀─ boot loader ◀───┴─ does not, or hangs
//! ```
//!
//! | file | what |
//! |---|---|
//! | `boot` | what a boot loader decides, with the feature of that name |
//! | `maker` | whose signature an image needs |
//! | `manifest` | what an image says of itself, and its signature |
//! | `notes` | what image and boot loader tell each other over a restart |
//! | `plan` | what is written to flash for an image |
//! | `slots` | where on a flash the images are |
//! | `standing` | how a module stands with them at its start |
//!
//! The signature alone decides what starts: the key by which a host may send an image only keeps strangers from filling
//! flash and starting modules anew.

#[cfg(feature = "boot")]
pub mod boot;
pub mod maker;
pub mod manifest;
pub mod notes;
pub mod plan;
pub mod slots;
pub mod standing;

/// A version of the firmware: major, minor, patch.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Version(pub [u16; 3]);

impl Version {
    /// The version that a text such as `1.20.3` names; what is behind the three numbers does not count.
    #[must_use]
    pub fn of_text(text: &str) -> Option<Self> {
        let mut numbers =
            text.split(|letter: char| !letter.is_ascii_digit()).map(|number| number.parse().ok());
        Some(Self([numbers.next()??, numbers.next()??, numbers.next()??]))
    }

    /// As in a manifest.
    #[must_use]
    pub const fn bytes(self) -> [u8; 6] {
        let Self([major, minor, patch]) = self;
        let ([a, b], [c, d], [e, f]) = (major.to_le_bytes(), minor.to_le_bytes(), patch.to_le_bytes());
        [a, b, c, d, e, f]
    }

    /// See [`bytes`](Self::bytes).
    #[must_use]
    pub const fn from_bytes([a, b, c, d, e, f]: [u8; 6]) -> Self {
        Self([u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]), u16::from_le_bytes([e, f])])
    }
}

impl core::fmt::Display for Version {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self([major, minor, patch]) = self;
        write!(f, "{major}.{minor}.{patch}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_read_and_ordered_by_their_numbers() {
        assert_eq!(Version::of_text("0.1.0"), Some(Version([0, 1, 0])));
        assert_eq!(Version::of_text("2.10.3-rc1"), Some(Version([2, 10, 3])));
        assert_eq!(Version::of_text("1.2"), None);
        assert_eq!(Version::of_text("1.2.70000"), None);
        assert!(Version([0, 10, 0]) > Version([0, 9, 9]));
        assert_eq!(Version::from_bytes(Version([1, 256, 65_535]).bytes()), Version([1, 256, 65_535]));
    }
}
