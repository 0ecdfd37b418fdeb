//! Small pieces of text, without the formatting machinery: it could panic for all the compiler knows.

use heapless::String;

use crate::wire::{ModuleId, SettingFault};

/// What comes before the first `at`, and behind it, if there is one.
pub(super) fn cut(text: &[u8], at: u8) -> (&[u8], Option<&[u8]>) {
    let found = text.iter().position(|&byte| byte == at).and_then(|found| text.split_at_checked(found));
    match found {
        Some((before, behind)) => (before, behind.get(1..)),
        None => (text, None),
    }
}

/// A decimal number from `least` to `most`.
pub(super) fn number(text: &[u8], least: u16, most: u16) -> Result<u16, SettingFault> {
    let mut value: u32 = 0;
    for &digit in text {
        if !digit.is_ascii_digit() {
            return Err(SettingFault::Value);
        }
        value = value.saturating_mul(10).saturating_add(u32::from(digit.wrapping_sub(b'0')));
    }
    if text.is_empty() {
        return Err(SettingFault::Value);
    }
    let value = u16::try_from(value).map_err(|_| SettingFault::Range)?;
    if value < least || value > most { Err(SettingFault::Range) } else { Ok(value) }
}

/// An address as `10.0.0.7`.
pub(super) fn ipv4(text: &[u8]) -> Result<[u8; 4], SettingFault> {
    let mut address = [0; 4];
    let mut rest = Some(text);
    for byte in &mut address {
        let (part, behind) = cut(rest.ok_or(SettingFault::Value)?, b'.');
        *byte = number(part, 0, 255).map_err(|_| SettingFault::Value)? as u8;
        rest = behind;
    }
    if rest.is_some() { Err(SettingFault::Value) } else { Ok(address) }
}

/// A number as text.
pub(super) struct Number {
    digits: [u8; 10],
    count: usize,
}

impl Number {
    pub(super) fn of(mut value: u32) -> Self {
        let mut number = Self { digits: [b'0'; 10], count: 0 };
        for digit in number.digits.iter_mut().rev() {
            *digit = b'0' + (value % 10) as u8;
            number.count += 1;
            value /= 10;
            if value == 0 {
                break;
            }
        }
        number
    }

    pub(super) fn as_str(&self) -> &str {
        let digits = self.digits.get(self.digits.len().saturating_sub(self.count)..).unwrap_or(&[]);
        core::str::from_utf8(digits).unwrap_or("")
    }
}

/// Adds to a text; what does not fit is left out. The callers' texts always fit.
pub(super) fn push<const N: usize>(to: &mut String<N>, text: &str) {
    let _ = to.push_str(text);
}

pub(super) fn push_ipv4<const N: usize>(to: &mut String<N>, [a, b, c, d]: [u8; 4]) {
    for (byte, behind) in [(a, "."), (b, "."), (c, "."), (d, "")] {
        push(to, Number::of(u32::from(byte)).as_str());
        push(to, behind);
    }
}

/// Adds `key=value` and the end of the line.
pub(super) fn line<const N: usize>(to: &mut String<N>, key: &str, value: &str) {
    for part in [key, "=", value, "\n"] {
        push(to, part);
    }
}

/// The host name of a module: as [`address::host_name`](crate::address::host_name).
pub(super) fn host_name(ModuleId([.., a, b, c]): ModuleId) -> String<12> {
    let mut name = String::new();
    push(&mut name, "kehai-");
    push_hex(&mut name, &[a, b, c]);
    name
}

/// Adds two hexadecimal digits a byte; what does not fit is left out. The callers' texts always fit.
pub(super) fn push_hex<const N: usize>(to: &mut String<N>, bytes: &[u8]) {
    for byte in bytes {
        for digit in [byte >> 4, byte & 15] {
            let _ = to.push(char::from(if digit < 10 { b'0' + digit } else { b'a' + digit - 10 }));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_everybody_writes_them() {
        for value in [0, 7, 10, 99, 100, 65_535, u32::MAX] {
            assert_eq!(Number::of(value).as_str(), std::format!("{value}"));
        }
    }

    #[test]
    fn the_host_name_is_the_one_of_dhcp() {
        let mac = [2, 0, 0, 0x1f, 0xa0, 0x9c];
        assert_eq!(host_name(ModuleId(mac)), crate::address::host_name(mac));
    }

    #[test]
    fn a_text_is_cut_at_the_first_mark() {
        assert_eq!(cut(b"a=b=c", b'='), (&b"a"[..], Some(&b"b=c"[..])));
        assert_eq!(cut(b"a=", b'='), (&b"a"[..], Some(&b""[..])));
        assert_eq!(cut(b"a", b'='), (&b"a"[..], None));
    }
}
