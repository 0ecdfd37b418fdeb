//! What the host sends: lines put together from pieces, then taken apart.
//!
//! ```text
//! command [; string] terminator          terminator: LF, CR or CR LF
//! MD 0044 0725 01 0 00 ;tag              measurement: letters, first, last, cluster, skip, scans
//! ```

use std::collections::VecDeque;

/// Longest request line kept; a longer one can only be noise.
const MAX_LINE: usize = 256;

/// Requests kept until they are answered; more are lost.
const MAX_REQUESTS: usize = 32;

/// Characters allowed in the string after `;`.
pub(crate) const MAX_STRING: usize = 16;

/// Puts request lines together.
#[derive(Debug, Default)]
pub(crate) struct Lines {
    line: Vec<u8>,
    too_long: bool,
}

/// The requests that have come in and wait for their answer.
#[derive(Debug, Default)]
pub(super) struct RequestQueue {
    lines: Lines,
    waiting: VecDeque<Vec<u8>>,
    due_us: u64,
}

impl RequestQueue {
    /// Adds a byte; whether it ends a request. If none waits before it, the request is answered at `due_us`.
    pub(super) fn push(&mut self, byte: u8, due_us: u64) -> bool {
        let Some(line) = self.lines.push(byte) else { return false };
        if self.waiting.is_empty() {
            self.due_us = due_us;
        }
        if self.waiting.len() < MAX_REQUESTS {
            self.waiting.push_back(line);
        }
        true
    }

    /// When the waiting requests are answered.
    pub(super) fn due_us(&self) -> Option<u64> {
        (!self.waiting.is_empty()).then_some(self.due_us)
    }

    /// Removes all waiting requests, in order.
    pub(super) fn drain(&mut self) -> VecDeque<Vec<u8>> {
        std::mem::take(&mut self.waiting)
    }

    pub(super) fn clear(&mut self) {
        self.waiting.clear();
    }

    /// Forgets the line that has begun.
    pub(super) fn clear_line(&mut self) {
        self.lines.clear();
    }
}

impl Lines {
    /// Takes one byte; returns the line it ends. Empty lines are no requests, so CR LF is one end. Bytes that
    /// are no printable ASCII are noise of the line and left out: clients that try one speed after another
    /// send no LF in between, and are known to work.
    pub(crate) fn push(&mut self, byte: u8) -> Option<Vec<u8>> {
        if !matches!(byte, b'\n' | b'\r' | b' '..=b'~') {
            return None;
        }
        if byte != b'\n' && byte != b'\r' {
            if self.line.len() < MAX_LINE {
                self.line.push(byte);
            } else {
                self.too_long = true;
            }
            return None;
        }
        let line = std::mem::take(&mut self.line);
        let too_long = std::mem::take(&mut self.too_long);
        (!line.is_empty() && !too_long).then_some(line)
    }

    /// Forgets an unfinished line.
    pub(crate) fn clear(&mut self) {
        self.line.clear();
        self.too_long = false;
    }
}

/// The command and the string of a request.
#[must_use]
pub(crate) fn split_string(line: &[u8]) -> (&[u8], Option<&[u8]>) {
    match line.iter().position(|&byte| byte == b';') {
        Some(at) => (&line[..at], Some(&line[at + 1..])),
        None => (line, None),
    }
}

/// What is wrong with the string, as a status.
#[must_use]
pub(crate) fn string_refusal(string: &[u8]) -> Option<&'static str> {
    let legal = |byte: &u8| byte.is_ascii_alphanumeric() || b" ._+@".contains(byte);
    if string.len() > MAX_STRING {
        Some("0G")
    } else if !string.iter().all(legal) {
        Some("0H")
    } else {
        None
    }
}

/// What one beam's value holds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Coding {
    /// Two characters: ranges up to 4095 mm.
    Two,
    /// Three characters.
    Three,
    /// Three characters of range and three of intensity.
    WithIntensity,
}
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Measurement {
    /// New scans one after another (`M`, `N`) instead of the latest one (`G`, `H`).
    pub running: bool,
    /// Several echoes a step (`N`, `H`).
    pub multi_echo: bool,
    /// Coding of a value.
    pub coding: Coding,
    pub first_step: u16,
    /// Last step, inclusive.
    pub last_step: u16,
    /// Steps joined into one value, at least 1.
    pub cluster: u16,
    /// Scans left out after each scan sent.
    pub skip: u8,
    /// Scans to send; 0: until `QT`.
    pub scans: u8,
}

/// Kind of measurement by its two letters.
#[must_use]
pub(crate) fn measurement_kind(letters: [u8; 2]) -> Option<(bool, bool, Coding)> {
    let (running, multi_echo) = match letters[0] {
        b'M' => (true, false),
        b'N' => (true, true),
        b'G' => (false, false),
        b'H' => (false, true),
        _ => return None,
    };
    let coding = match letters[1] {
        b'D' => Coding::Three,
        b'S' if !multi_echo => Coding::Two,
        b'E' => Coding::WithIntensity,
        _ => return None,
    };
    Some((running, multi_echo, coding))
}
#[must_use]
pub(crate) fn number(digits: &[u8]) -> Option<u32> {
    if digits.is_empty() || !digits.iter().all(u8::is_ascii_digit) {
        return None;
    }
    std::str::from_utf8(digits).ok()?.parse().ok()
}

impl Measurement {
    /// Reads a measurement command whose letters are known.
    ///
    /// # Errors
    /// The status of the refusal.
    pub(crate) fn parse(command: &[u8], max_step: u16) -> Result<Self, &'static str> {
        let letters = [*command.first().ok_or("0C")?, *command.get(1).ok_or("0C")?];
        let (running, multi_echo, coding) = measurement_kind(letters).ok_or("0E")?;
        let wanted = if running { 15 } else { 12 };
        if command.len() != wanted {
            return Err(if command.len() < wanted { "0C" } else { "0D" });
        }
        let first_step = number(&command[2..6]).ok_or("01")?;
        let last_step = number(&command[6..10]).ok_or("02")?;
        let cluster = number(&command[10..12]).ok_or("03")?;
        if last_step > u32::from(max_step) {
            return Err("04");
        }
        if last_step < first_step {
            return Err("05");
        }
        let (skip, scans) = if running {
            (number(&command[12..13]).ok_or("06")?, number(&command[13..15]).ok_or("07")?)
        } else {
            (0, 1)
        };
        Ok(Self {
            running,
            multi_echo,
            coding,
            first_step: first_step as u16,
            last_step: last_step as u16,
            cluster: cluster.max(1) as u16,
            skip: skip as u8,
            scans: scans as u8,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(bytes: &[u8]) -> Vec<String> {
        let mut lines = Lines::default();
        bytes.iter().filter_map(|&byte| lines.push(byte)).map(|l| String::from_utf8(l).unwrap()).collect()
    }

    #[test]
    fn every_terminator_ends_a_line_and_empty_lines_are_ignored() {
        assert_eq!(lines(b"\nQT\n\n\r\nVV\rPP\r\nII"), ["QT", "VV", "PP"]);
        assert_eq!(lines(b"\xf3\x00Q\x80T\n"), ["QT"]);
        assert!(lines(&[[b'x'; 999].as_slice(), b"\n"].concat()).is_empty());
    }

    #[test]
    fn measurements_are_refused_by_the_first_wrong_field() {
        let refused = |command: &str| Measurement::parse(command.as_bytes(), 768).unwrap_err();
        assert_eq!(refused("MD00x4072501000"), "01");
        assert_eq!(refused("MD004407x501000"), "02");
        assert_eq!(refused("MD00440725x1000"), "03");
        assert_eq!(refused("MD0044076901000"), "04");
        assert_eq!(refused("MD0725004401000"), "05");
        assert_eq!(refused("MD0044072501x00"), "06");
        assert_eq!(refused("MD00440725010x0"), "07");
        assert_eq!(refused("MD004407250100"), "0C");
        assert_eq!(refused("MD00440725010000"), "0D");
        assert_eq!(refused("MX0044072501000"), "0E");
        assert_eq!(Measurement::parse(b"GS0044004400", 768).unwrap().cluster, 1);
    }

    #[test]
    fn strings_are_sixteen_legal_characters_at_most() {
        assert_eq!(string_refusal(b"aZ9 ._+@"), None);
        assert_eq!(string_refusal(b"0123456789abcdef"), None);
        assert_eq!(string_refusal(b"0123456789abcdefg"), Some("0G"));
        assert_eq!(string_refusal(b"a-b"), Some("0H"));
        assert_eq!(split_string(b"TM1;a;b"), (&b"TM1"[..], Some(&b"a;b"[..])));
    }
}
