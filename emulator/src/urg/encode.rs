//! How a sensor writes: characters of 6 bits, checksums, lines.
//!
//! ```text
//! status line     2 characters  sum LF
//! stamp line      4 characters  sum LF          24 bits, ms
//! info line       KEY:VALUE  ;  sum LF          the sum leaves the `;` out
//! data line       up to 64 characters  sum LF   values run across lines
//! end of a reply  LF
//! ```
//!
//! Source: SCIP 2.0 (C-42-03320B), checksum and character encoding. Written apart from the driver in
//! `kehai`, so that one mistake cannot cancel another.

/// Characters in a full data line, without its checksum.
pub const LINE_CHARACTERS: usize = 64;

/// Sum of the bytes, low 6 bits, plus 0x30.
#[must_use]
pub fn checksum(text: &[u8]) -> u8 {
    let sum: u32 = text.iter().map(|&byte| u32::from(byte)).sum();
    (sum & 0x3f) as u8 + 0x30
}

/// Appends `value` as `characters` characters of 6 bits, most significant first; larger values lose their
/// upper bits.
pub fn push_value(out: &mut Vec<u8>, value: u32, characters: u32) {
    let character = |place: u32| ((value >> (6 * place)) & 0x3f) as u8 + 0x30;
    match characters {
        // Three at once: nearly all there is to write.
        3 => out.extend_from_slice(&[character(2), character(1), character(0)]),
        _ => out.extend((0..characters).rev().map(character)),
    }
}

/// Appends `text`, its checksum and LF.
pub fn push_line(out: &mut Vec<u8>, text: &[u8]) {
    out.extend_from_slice(text);
    out.push(checksum(text));
    out.push(b'\n');
}

/// Appends `KEY:VALUE;`, the checksum of `KEY:VALUE`, and LF.
pub fn push_info(out: &mut Vec<u8>, key: &str, value: &str) {
    let text = format!("{key}:{value}");
    out.extend_from_slice(text.as_bytes());
    out.push(b';');
    out.push(checksum(text.as_bytes()));
    out.push(b'\n');
}

/// Appends a 24-bit stamp in ms as a line.
pub fn push_stamp(out: &mut Vec<u8>, stamp_ms: u32) {
    let mut text = Vec::with_capacity(4);
    push_value(&mut text, stamp_ms, 4);
    push_line(out, &text);
}

/// Appends data characters as lines of 64 with their checksums.
pub fn push_block(out: &mut Vec<u8>, characters: &[u8]) {
    for line in characters.chunks(LINE_CHARACTERS) {
        push_line(out, line);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(value: u32, characters: u32) -> String {
        let mut out = Vec::new();
        push_value(&mut out, value, characters);
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn values_have_the_published_characters() {
        assert_eq!(value(1234, 2), "CB");
        assert_eq!(value(19, 2), "0C");
        assert_eq!(value(0, 2), "00");
        assert_eq!(value(4095, 2), "oo");
        assert_eq!(value(5432, 3), "1Dh");
        assert_eq!(value(20, 3), "00D");
        assert_eq!(value(4096, 3), "100");
        assert_eq!(value(5600, 3), "1GP");
        assert_eq!(value(30_000, 3), "7D`");
        assert_eq!(value(60_000, 3), ">YP");
        assert_eq!(value(65_533, 3), "?om");
        assert_eq!(value(16_000_000, 4), "m2@0");
        assert_eq!(value(6_968_830, 4), "JUGn");
        assert_eq!(value(3_292_603, 4), "<Sfk");
    }

    #[test]
    fn status_sums_match_the_known_pairs() {
        for pair in [
            "00P", "01Q", "02R", "03S", "04T", "05U", "06V", "07W", "10Q", "98a", "99b", "0Aa", "0Bb", "0Cc",
            "0Dd", "0Ee", "0Ff", "0Gg", "0Hh", "0Ii", "0Ll", "0Mm",
        ] {
            let (text, sum) = pair.as_bytes().split_at(2);
            assert_eq!(checksum(text), sum[0], "{pair}");
        }
        assert_eq!(checksum(b"Hokuyo"), b'o');
    }

    #[test]
    fn a_block_of_a_whole_number_of_lines_has_no_empty_last_line() {
        let mut out = Vec::new();
        push_block(&mut out, &[b'0'; 128]);
        assert_eq!(out.len(), 2 * 66);
        out.clear();
        push_block(&mut out, &[b'0'; 129]);
        assert_eq!(out.len(), 2 * 66 + 3);
    }
}
