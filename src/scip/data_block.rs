//! The data lines of a scan, decoded as they arrive.
//!
//! ```text
//!   c c c c … c c S \n     64 characters, checksum of this line
//!   c c c c … c c S \n     values run on across lines: 3 does not divide 64
//!   c c … c S \n           only the last line may have fewer, but at least one
//!   \n
//! ```
//!
//! A part of a line goes through one tight loop, a value a turn. It cannot see where the last,
//! short line ends, so it may take that line's checksum for a character of data; the line feed
//! behind it then takes the character back.
//! Source: SCIP 2.0 (C-42-03320B), data block; the minimum length of a line is that of the code.

use super::command::{Measurement, Width};
use super::{encoding, event::LossCause};
use crate::scan::NO_RETURN_MM;

/// Data characters of every line but the last.
const LINE: u8 = 64;

/// What came of some bytes of a data block.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Step {
    /// All bytes are taken; the line goes on.
    More,
    /// A line is complete and correct.
    Line,
    /// The block is complete and correct, and has so many values.
    Complete(u16),
    /// The last byte taken shows that the block is wrong.
    Wrong(LossCause),
}

#[derive(Clone, Copy, Debug)]
pub(super) struct DataBlock {
    width: Width,
    /// Fewest and most values allowed.
    min: u16,
    max: u16,
    /// Values decoded so far.
    count: u16,
    /// The value being read, or the last one while no character of the next is in.
    value: u32,
    /// Characters of the value being read.
    characters: usize,
    /// Sum of the six-bit codes of this line.
    sum: u32,
    /// Characters of this line, checksum included.
    line_length: u8,
    /// A short line was seen: only the empty line may follow.
    last: bool,
}

impl DataBlock {
    /// A block of one value, for a reader that reads none yet.
    pub(super) const NONE: Self = Self::new(&Measurement {
        first_step: 0,
        last_step: 0,
        cluster: 1,
        skip: 0,
        scans: 0,
        width: Width::Three,
    });

    pub(super) const fn new(measurement: &Measurement) -> Self {
        let min = measurement.min_beams();
        Self {
            width: measurement.width,
            min: if min == 0 { 1 } else { min },
            max: measurement.beams(),
            count: 0,
            value: 0,
            characters: 0,
            sum: 0,
            line_length: 0,
            last: false,
        }
    }

    /// Takes bytes up to the end of a line. Says how many it took: at least one of a part that is
    /// not empty.
    pub(super) fn feed(&mut self, bytes: &[u8], ranges_mm: &mut [u16]) -> (usize, Step) {
        match self.width {
            Width::Two => self.feed_values::<2>(bytes, ranges_mm),
            Width::Three => self.feed_values::<3>(bytes, ranges_mm),
        }
    }

    fn feed_values<const W: usize>(&mut self, bytes: &[u8], ranges_mm: &mut [u16]) -> (usize, Step) {
        let room = if self.last { 0 } else { LINE.saturating_sub(self.line_length) };
        let run = bytes.get(..room.into()).unwrap_or(bytes);
        let taken = self.decode::<W>(run, ranges_mm);
        self.line_length = self.line_length.wrapping_add(taken as u8);
        if self.count > self.max {
            return (taken, Step::Wrong(LossCause::ValueCount));
        }
        if usize::from(self.count) > ranges_mm.len() {
            return (taken, Step::Wrong(LossCause::BufferTooShort));
        }
        match *bytes.get(taken..).unwrap_or(&[]) {
            [] => (taken, Step::More),
            [b'\n', ..] => (taken + 1, self.line_end::<W>()),
            _ if self.last || self.line_length > LINE => (taken + 1, Step::Wrong(LossCause::LineLength)),
            [character, ..] if encoding::decode_char(character).is_none() => {
                (taken + 1, Step::Wrong(LossCause::Character))
            }
            [checksum, ..] if checksum != self.checksum(LINE) => {
                (taken + 1, Step::Wrong(LossCause::Checksum))
            }
            [_, b'\n', ..] => (taken + 2, self.next_line()),
            [_, ..] => {
                self.line_length = LINE + 1;
                (taken + 1, Step::More)
            }
        }
    }

    /// Decodes characters up to the first one outside the code; returns how many it took. Values
    /// without a place in `ranges_mm` are counted all the same.
    fn decode<const W: usize>(&mut self, run: &[u8], ranges_mm: &mut [u16]) -> usize {
        let mut rest = run;
        while self.characters != 0
            && let Some((&character, behind)) = rest.split_first()
            && self.character::<W>(character, ranges_mm)
        {
            rest = behind;
        }
        if self.characters == 0 {
            let (groups, _) = rest.as_chunks::<W>();
            let whole = self.values(groups, ranges_mm);
            rest = rest.get(whole * W..).unwrap_or(&[]);
        }
        while let Some((&character, behind)) = rest.split_first()
            && self.character::<W>(character, ranges_mm)
        {
            rest = behind;
        }
        run.len().wrapping_sub(rest.len())
    }

    /// Decodes whole values up to the first illegal character or the end of the buffer; returns
    /// how many.
    fn values<const W: usize>(&mut self, groups: &[[u8; W]], ranges_mm: &mut [u16]) -> usize {
        let free = ranges_mm.get_mut(self.count.into()..).unwrap_or_default();
        let (mut value, mut sum, mut done) = (self.value, self.sum, 0);
        for (group, slot) in groups.iter().zip(free) {
            let (mut packed, mut seen, mut group_sum) = (0, 0, 0);
            for &character in group {
                let code = u32::from(character).wrapping_sub(u32::from(encoding::FIRST));
                packed = packed << 6 | code;
                seen |= code;
                group_sum = code.wrapping_add(group_sum);
            }
            if seen > 0x3F {
                break;
            }
            *slot = range_mm(packed);
            (value, sum, done) = (packed, sum.wrapping_add(group_sum), done + 1);
        }
        (self.value, self.sum) = (value, sum);
        self.count = self.count.saturating_add(done);
        done.into()
    }

    /// Decodes one character; says whether it is of the code.
    fn character<const W: usize>(&mut self, character: u8, ranges_mm: &mut [u16]) -> bool {
        let Some(code) = encoding::decode_char(character) else { return false };
        let code = u32::from(code);
        self.sum = self.sum.wrapping_add(code);
        self.value = if self.characters == 0 { code } else { self.value << 6 | code };
        self.characters += 1;
        if self.characters >= W {
            self.characters = 0;
            if let Some(slot) = ranges_mm.get_mut(usize::from(self.count)) {
                *slot = range_mm(self.value);
            }
            self.count = self.count.saturating_add(1);
        }
        true
    }

    /// A line feed: behind a full line, behind the short last line, or an empty line.
    fn line_end<const W: usize>(&mut self) -> Step {
        match self.line_length {
            0 if self.characters == 0 && self.count >= self.min => Step::Complete(self.count),
            0 => Step::Wrong(LossCause::ValueCount),
            1 => Step::Wrong(LossCause::LineLength),
            2..=LINE => {
                let checksum = self.take_back::<W>();
                self.last = true;
                if checksum == self.checksum(self.line_length - 1) {
                    self.next_line()
                } else {
                    Step::Wrong(LossCause::Checksum)
                }
            }
            _ => self.next_line(),
        }
    }

    /// The last character decoded was a checksum: undoes it.
    fn take_back<const W: usize>(&mut self) -> u8 {
        let code = (self.value & 0x3F) as u8;
        self.value >>= 6;
        self.sum = self.sum.wrapping_sub(code.into());
        if self.characters == 0 {
            self.characters = W;
            self.count = self.count.saturating_sub(1);
        }
        self.characters -= 1;
        encoding::encode_char(code)
    }

    fn next_line(&mut self) -> Step {
        self.line_length = 0;
        self.sum = 0;
        Step::Line
    }

    /// What the checksum of a line of `characters` must be.
    fn checksum(&self, characters: u8) -> u8 {
        let offsets = characters.wrapping_mul(encoding::FIRST);
        encoding::encode_char((self.sum as u8).wrapping_add(offsets))
    }
}

/// The stored range: what does not fit 16 bits is far beyond every sensor's reach.
fn range_mm(value: u32) -> u16 {
    value.min(NO_RETURN_MM.into()) as u16
}

#[cfg(test)]
mod tests {
    use super::super::checksum;
    use super::*;
    use std::vec::Vec;

    fn measurement(beams: u16, width: Width) -> Measurement {
        Measurement { first_step: 0, last_step: beams - 1, cluster: 1, skip: 0, scans: 0, width }
    }

    /// The data block of the characters given, without the empty line.
    fn block(characters: &[u8]) -> Vec<u8> {
        let line = |line: &[u8]| [line, &[checksum::of(line), b'\n']].concat();
        characters.chunks(64).flat_map(line).collect()
    }

    fn run(measurement: Measurement, bytes: &[u8], ranges_mm: &mut [u16]) -> Step {
        let mut block = DataBlock::new(&measurement);
        let mut rest = bytes;
        loop {
            let (taken, step) = block.feed(rest, ranges_mm);
            rest = &rest[taken..];
            if rest.is_empty() || !matches!(step, Step::More | Step::Line) {
                return step;
            }
        }
    }

    #[test]
    fn recorded_first_values_decode() {
        let line = b"06806806706105m05m05h05c05c05c05`05]05Z05W05W05U05S05O05S05P05P0_\n";
        let mut ranges_mm = [0; 21];
        let step = run(measurement(682, Width::Three), line, &mut ranges_mm);
        assert_eq!(step, Step::Line);
        assert_eq!(ranges_mm[..8], [392, 392, 391, 385, 381, 381, 376, 371]);
    }

    #[test]
    fn every_length_of_the_last_line_decodes() {
        for width in [Width::Two, Width::Three] {
            for beams in 1..200u16 {
                let characters: Vec<u8> = (0..beams * u16::from(width.characters()))
                    .map(|i| encoding::encode_char((i * 7) as u8))
                    .collect();
                let mut bytes = block(&characters);
                bytes.push(b'\n');
                let mut ranges_mm = [0; 200];
                assert_eq!(run(measurement(beams, width), &bytes, &mut ranges_mm), Step::Complete(beams));
                let last = characters.chunks(width.characters().into()).last().unwrap();
                let last = encoding::decode(last).unwrap().min(65_535) as u16;
                assert_eq!(ranges_mm[usize::from(beams) - 1], last);
            }
        }
    }

    #[test]
    fn values_above_65534_saturate() {
        let mut bytes = block(b"?om?on?oo@00ooo");
        bytes.push(b'\n');
        let mut ranges_mm = [0; 5];
        assert_eq!(run(measurement(5, Width::Three), &bytes, &mut ranges_mm), Step::Complete(5));
        assert_eq!(ranges_mm, [65_533, 65_534, 65_535, 65_535, 65_535]);
    }

    #[test]
    fn faults_are_told_apart() {
        let wrong =
            |bytes: &[u8], beams, space| run(measurement(beams, Width::Three), bytes, &mut [0; 100][..space]);
        let full = [b'1'; 64 + 32];
        let good = block(&full);
        let with = |at: usize, byte: u8| {
            let mut bytes = good.clone();
            bytes[at] = byte;
            bytes.push(b'\n');
            bytes
        };
        assert_eq!(wrong(&with(0, b'1'), 32, 100), Step::Complete(32));
        assert_eq!(wrong(&with(5, b'2'), 32, 100), Step::Wrong(LossCause::Checksum));
        assert_eq!(wrong(&with(5, b'&'), 32, 100), Step::Wrong(LossCause::Character));
        assert_eq!(wrong(&with(64, b'p'), 32, 100), Step::Wrong(LossCause::Character));
        assert_eq!(wrong(&with(65, b'1'), 32, 100), Step::Wrong(LossCause::LineLength));
        assert_eq!(wrong(&with(0, b'\n'), 32, 100), Step::Wrong(LossCause::ValueCount));
        assert_eq!(wrong(&with(1, b'\n'), 32, 100), Step::Wrong(LossCause::LineLength));
        assert_eq!(wrong(&with(0, b'1'), 31, 100), Step::Wrong(LossCause::ValueCount));
        assert_eq!(wrong(&with(0, b'1'), 33, 100), Step::Wrong(LossCause::ValueCount));
        assert_eq!(wrong(&with(0, b'1'), 32, 31), Step::Wrong(LossCause::BufferTooShort));
        let cut = [block(&full[..32]), block(&full[..64]), b"\n".to_vec()].concat();
        assert_eq!(wrong(&cut, 32, 100), Step::Wrong(LossCause::LineLength));
        let incomplete = [block(&full[..32]), b"\n".to_vec()].concat();
        assert_eq!(wrong(&incomplete, 11, 100), Step::Wrong(LossCause::ValueCount));
    }

    #[test]
    fn a_cluster_that_does_not_divide_may_count_up_or_down() {
        let odd = Measurement { cluster: 2, ..measurement(9, Width::Three) };
        for (beams, step) in [
            (3, Step::Wrong(LossCause::ValueCount)),
            (4, Step::Complete(4)),
            (5, Step::Complete(5)),
            (6, Step::Wrong(LossCause::ValueCount)),
        ] {
            let mut bytes = block(&[b'1'; 18][..3 * beams]);
            bytes.push(b'\n');
            assert_eq!(run(odd, &bytes, &mut [0; 9]), step, "{beams}");
        }
    }
}
