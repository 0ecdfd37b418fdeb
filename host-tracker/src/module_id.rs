//! The identity of a module, as it is written on its label and in files.
//!
//! ```text
//!   52:54:00:12:34:01  525400123401      six bytes, those of its MAC address
//! ```

use data_encoding::HEXLOWER_PERMISSIVE;

use kehai::wire::ModuleId;

/// A module's identity from twelve hexadecimal digits, with or without colons between the bytes.
#[must_use]
pub fn read(text: &str) -> Option<ModuleId> {
    let digits: String = text.chars().filter(|letter| *letter != ':').collect();
    let bytes = HEXLOWER_PERMISSIVE.decode(digits.as_bytes()).ok()?;
    bytes.try_into().ok().map(ModuleId)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_identity_is_read_with_and_without_colons() {
        let expected = Some(ModuleId([0x52, 0x54, 0, 0x12, 0x34, 1]));
        assert_eq!(read("525400123401"), expected);
        assert_eq!(read("52:54:00:12:34:01"), expected);
        for wrong in ["", "52540012340", "5254001234011", "52540012340g", "kehai-123401", "＋25400123401"] {
            assert_eq!(read(wrong), None, "{wrong}");
        }
    }
}
