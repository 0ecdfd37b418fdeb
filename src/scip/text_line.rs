//! The line being read: echo, status, stamp and info lines whole, of a data line only its end.
//!
//! ```text
//!   … 0 5 Z 0 5 M D 0 0 4 4 0 7 2 5 0 1 0 0 0 \n     the end of a cut line and an echo behind it:
//!                └───── echo ─────────────┘         what is kept suffices to see that
//! ```

use super::command::MAX_ECHO;

/// Longest line that is kept whole. Info lines of recorded sensors have up to 46 bytes.
const CAPACITY: usize = 128;

#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    bytes: [u8; CAPACITY],
    length: usize,
    /// Nothing of this line was left out.
    whole: bool,
    first_byte_us: u64,
}

impl Line {
    pub(super) const EMPTY: Self = Self { bytes: [0; CAPACITY], length: 0, whole: true, first_byte_us: 0 };

    pub(super) fn clear(&mut self) {
        self.length = 0;
        self.whole = true;
    }

    pub(super) fn push(&mut self, byte: u8, now_us: u64) {
        if self.length == 0 {
            self.first_byte_us = now_us;
        }
        if self.length >= CAPACITY {
            self.shorten();
        }
        if let Some(slot) = self.bytes.get_mut(self.length) {
            *slot = byte;
            self.length += 1;
        }
    }

    /// Notes part of a data line, or as much of its end as an echo may take.
    pub(super) fn note(&mut self, part: &[u8], now_us: u64) {
        if let Some(end) = part.last_chunk() {
            self.whole = self.length == 0 && part.len() == MAX_ECHO;
            // One load and store each, where a copy of bytes would be a call.
            if let Some(start) = self.bytes.first_chunk_mut() {
                *start = u128::from_ne_bytes(*end).to_ne_bytes();
            }
            self.length = MAX_ECHO;
            self.first_byte_us = now_us;
        } else {
            for &byte in part {
                self.push(byte, now_us);
            }
        }
    }

    /// Makes place: keeps as much of the end as an echo may take.
    fn shorten(&mut self) {
        self.bytes.copy_within(CAPACITY - MAX_ECHO.., 0);
        self.length = MAX_ECHO;
        self.whole = false;
    }

    pub(super) fn is_empty(&self) -> bool {
        self.length == 0
    }

    pub(super) fn is_full(&self) -> bool {
        self.length >= CAPACITY
    }

    /// The line, or its end.
    pub(super) fn as_slice(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or(&self.bytes)
    }

    /// The last `length` bytes, and the clock at the first of them if that is known: if they are the
    /// whole line.
    pub(super) fn end(&self, length: usize) -> Option<(&[u8], Option<u64>)> {
        let line = self.as_slice();
        let end = line.get(line.len().checked_sub(length)?..)?;
        Some((end, (self.whole && end.len() == line.len()).then_some(self.first_byte_us)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_of_a_line_of_any_length_is_there() {
        for length in [0, 1, 40, 127, 128, 129, 300, 1000] {
            let text: std::vec::Vec<u8> = (0..length).map(|i| i as u8).chain(*b"MD0044072501000").collect();
            let mut pushed = Line::EMPTY;
            text.iter().for_each(|&byte| pushed.push(byte, 7));
            let mut noted = Line::EMPTY;
            text.chunks(65).for_each(|part| noted.note(part, 7));
            for line in [pushed, noted] {
                let (end, first_byte_us) = line.end(15).unwrap();
                assert_eq!(end, b"MD0044072501000");
                assert_eq!(first_byte_us, (length == 0).then_some(7), "{length}");
            }
        }
    }
}
