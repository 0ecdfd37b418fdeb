//! The character code: six bits a character, most significant first, plus 0x30.
//!
//! ```text
//!   value 5432 =  000001 010100 111000      3 characters: 18 bits, ranges (MD, GD)
//!                    1     20     56        2 characters: 12 bits, ranges (MS, GS)
//!                  +0x30  +0x30  +0x30      4 characters: 24 bits, time stamps in ms
//!                   '1'    'D'    'h'
//! ```
//!
//! Legal characters are 0x30 `0` to 0x6F `o`, `;` among them. Everything else is refused even
//! where a checksum would match. Source: SCIP 2.0 (C-42-03320B), encoding.

/// Lowest character of the code; it stands for 0.
pub const FIRST: u8 = 0x30;

/// Highest character of the code; it stands for 63.
pub const LAST: u8 = 0x6F;

/// The six bits of one character, 0 to 63; `None` outside the code.
#[must_use]
pub const fn decode_char(character: u8) -> Option<u8> {
    if character >= FIRST && character <= LAST { Some(character - FIRST) } else { None }
}

/// The character that stands for the low six bits of `value`.
#[must_use]
pub const fn encode_char(value: u8) -> u8 {
    (value & 0x3F) + FIRST
}

/// The number two to four characters stand for; `None` when one of them is outside the code, or
/// there are none or more than four.
#[must_use]
pub fn decode(characters: &[u8]) -> Option<u32> {
    if characters.is_empty() || characters.len() > 4 {
        return None;
    }
    let mut value = 0;
    for &character in characters {
        value = value << 6 | u32::from(decode_char(character)?);
    }
    Some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_examples_of_the_specification_decode() {
        let two: [(&[u8], u32); 4] = [(b"CB", 1234), (b"0C", 19), (b"00", 0), (b"oo", 4095)];
        let three: [(&[u8], u32); 9] = [
            (b"1Dh", 5432),
            (b"00D", 20),
            (b"100", 4096),
            (b"1GP", 5600),
            (b"7D`", 30_000),
            (b">YP", 60_000),
            (b"?om", 65_533),
            (b"00C", 19),
            (b"ooo", 262_143),
        ];
        let four: [(&[u8], u32); 4] =
            [(b"m2@0", 16_000_000), (b"JUGn", 6_968_830), (b"<Sfk", 3_292_603), (b"oooo", 16_777_215)];
        for (characters, value) in two.iter().chain(&three).chain(&four) {
            assert_eq!(decode(characters), Some(*value), "{characters:?}");
        }
    }

    #[test]
    fn characters_outside_the_code_are_refused() {
        let legal = (0..=255u8).filter(|&c| decode_char(c).is_some()).count();
        assert_eq!(legal, 64);
        for bad in [0, b'\n', b'&', 0x2F, 0x70, 0x80, 0xFF] {
            assert_eq!(decode(&[b'0', bad, b'0']), None);
        }
        assert_eq!(decode(b""), None);
        assert_eq!(decode(b"00000"), None);
    }

    #[test]
    fn every_value_of_a_character_comes_back() {
        for value in 0..64 {
            assert_eq!(decode_char(encode_char(value)), Some(value));
        }
    }
}
