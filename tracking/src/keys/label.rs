//! The secret on a device's label: 128 random bits, as text and as a QR code.
//!
//! ```text
//!   text   AAAAA-BBBBB-CCCCC-DDDDD-EEEEEF        26 characters of base 32, case and dashes do not matter
//!   QR     kehai:1:AAAAABBBBBCCCCCDDDDDEEEEEF
//! ```
//!
//! Source: RFC 4648, section 6.

use data_encoding::BASE32_NOPAD;
use kehai::seal::LABEL_BYTES;

/// In front of the text in a QR code: what it is, and the version.
const QR: &str = "kehai:1:";

/// Characters between two dashes.
const GROUP: usize = 5;

/// A label's secret.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Label(pub [u8; LABEL_BYTES]);

/// Secrets are not printed by the way.
impl std::fmt::Debug for Label {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Label(…)")
    }
}

impl Label {
    /// The secret in a text or in what a QR code says; none if it is neither.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        let text = text.strip_prefix(QR).unwrap_or(text);
        let plain: String = text.chars().filter(|letter| *letter != '-').collect();
        let bytes = BASE32_NOPAD.decode(plain.to_ascii_uppercase().as_bytes()).ok()?;
        bytes.try_into().ok().map(Self)
    }

    /// As it is printed for people.
    #[must_use]
    pub fn text(&self) -> String {
        let plain = BASE32_NOPAD.encode(&self.0);
        let groups: Vec<&str> = (0..plain.len())
            .step_by(GROUP)
            .filter_map(|at| plain.get(at..plain.len().min(at + GROUP)))
            .collect();
        groups.join("-")
    }

    /// As a QR code says it.
    #[must_use]
    pub fn qr(&self) -> String {
        format!("{QR}{}", BASE32_NOPAD.encode(&self.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_is_read_as_it_is_printed_typed_and_scanned() {
        let label = Label([0x5a; LABEL_BYTES]);
        assert!(Label::parse(&label.text()) == Some(label));
        assert!(Label::parse(&format!(" {} ", label.text().to_lowercase())) == Some(label));
        assert!(Label::parse(&label.qr()) == Some(label));
        for wrong in
            ["", "AAAAA", "kehai:2:AAAA", &format!("{}A", label.text()), &label.text().replace('L', "1")]
        {
            assert!(Label::parse(wrong).is_none(), "{wrong}");
        }
    }
}
