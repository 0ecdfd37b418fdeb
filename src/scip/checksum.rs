//! The checksum: low six bits of the sum of the bytes, plus 0x30. One character.
//!
//! ```text
//!   status line   0 0 P \n             over the two status characters
//!   stamp line    J U G n D \n         over the four characters
//!   data line     c c … c S \n         over that line's characters alone
//!   info line     KEY:VALUE ; S \n     over KEY:VALUE, without the `;`
//!   echo          no checksum
//! ```
//!
//! Some UTM-30LX firmware leaves everything from `<-` onward out of the sum of an `II` line.
//! Source: SCIP 2.0 (C-42-03320B), checked against recorded replies.

use super::encoding;

/// The checksum character of `bytes`.
#[must_use]
pub fn of(bytes: &[u8]) -> u8 {
    encoding::encode_char(bytes.iter().fold(0u8, |sum, &byte| sum.wrapping_add(byte)))
}

/// The line without its checksum character, if that character is right.
#[must_use]
pub fn verified(line: &[u8]) -> Option<&[u8]> {
    let (&sum, content) = line.split_last()?;
    (of(content) == sum).then_some(content)
}

/// `KEY:VALUE` of an info line `KEY:VALUE;S`, and whether its checksum is right, by the plain
/// rule or by the one that stops at `<-`. `None` when the line has not that form.
#[must_use]
pub fn info_line(line: &[u8]) -> Option<(&[u8], bool)> {
    let (&sum, rest) = line.split_last()?;
    let (&semicolon, content) = rest.split_last()?;
    if semicolon != b';' {
        return None;
    }
    let short = content.windows(2).position(|pair| pair == b"<-").and_then(|at| content.get(..at));
    let right = of(content) == sum || short.is_some_and(|short| of(short) == sum);
    Some((content, right))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_known_pairs_hold() {
        let pairs = "00P 01Q 02R 03S 04T 05U 06V 07W 10Q 98a 99b 0Aa 0Bb 0Cc 0Dd 0Ee 0Ff 0Gg 0Hh 0Ii 0Ll 0Mm";
        for pair in pairs.split(' ') {
            assert!(verified(pair.as_bytes()).is_some(), "{pair}");
        }
        assert_eq!(of(b"Hokuyo"), b'o');
        assert_eq!(verified(b"<SfkP"), Some(&b"<Sfk"[..]));
        assert_eq!(verified(b"00Q"), None);
        assert_eq!(verified(b""), None);
    }

    #[test]
    fn the_semicolon_of_an_info_line_is_not_summed() {
        assert_eq!(info_line(b"DMIN:20;4"), Some((&b"DMIN:20"[..], true)));
        assert_eq!(info_line(b"TIME:j;o[;H").map(|(content, _)| content), Some(&b"TIME:j;o["[..]));
        assert_eq!(info_line(b"DMIN:20;5"), Some((&b"DMIN:20"[..], false)));
        assert_eq!(info_line(b"DMIN:20"), None);
        assert_eq!(info_line(b";"), None);
    }

    #[test]
    fn a_sum_that_stops_at_the_arrow_is_right_too() {
        let plain = b"SBPS:19200[bps]<-Default setting by user;A";
        assert_eq!(info_line(plain).map(|(_, right)| right), Some(true));
        let mut short = std::vec::Vec::from(&plain[..]);
        *short.last_mut().unwrap() = of(b"SBPS:19200[bps]");
        assert_ne!(short.last(), plain.last());
        assert_eq!(info_line(&short).map(|(_, right)| right), Some(true));
    }
}
