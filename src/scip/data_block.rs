//! The data lines of a scan, decoded as they arrive.
//!
//! ```text
//!   c c c c … c c S \n     64 characters, checksum of this line
//!   c c c c … c c S \n     values run on across lines: 3 does not divide 64
//!   c c … c S \n           only the last line may have fewer, but at least one
//!   \n
//! ```
//!
//! A part of a line goes through one tight loop, twelve characters a turn; what is left over, character
//! by character. It cannot see where the last,
//! short line ends, so it may take that line's checksum for a character of data; the line feed
//! behind it then takes the character back.
//! Source: SCIP 2.0 (C-42-03320B), data block; the minimum length of a line is that of the code.

use super::command::{Measurement, Width};
use super::{encoding, event::LossCause};
use crate::scan::NO_RETURN_MM;

/// Data characters of every line but the last.
const LINE: usize = 64;

/// Characters decoded at once: whole values of either width.
const DOZEN: usize = 12;

/// What came of some bytes of a data block.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Step {
    /// All bytes are taken; the block goes on.
    More,
    /// The block is complete and correct, and has so many values.
    Complete(u16),
    /// The last byte taken shows that the block is wrong.
    Wrong(LossCause),
}

/// How far some bytes of a data block led.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Progress<'a> {
    /// What was taken of the last line, if it is not complete and correct.
    pub(super) line: &'a [u8],
    /// Whether `line` starts a line: at least one before it is complete.
    pub(super) fresh: bool,
    /// Bytes not taken.
    pub(super) rest: &'a [u8],
    /// What came of the others.
    pub(super) step: Step,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct DataBlock {
    width: Width,
    /// Fewest and most values allowed.
    min: usize,
    max: usize,
    /// Values decoded so far.
    count: usize,
    /// Codes of the last characters, six bits each, the latest lowest.
    value: u32,
    /// Characters the value being read still misses; all of them between two values.
    missing: usize,
    /// Sum of the codes of this line.
    sum: u32,
    /// Data characters that still fit this line.
    room: usize,
    end: LineEnd,
}

/// What ends the line once there is no room left.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum LineEnd {
    Checksum,
    LineFeed,
    /// The short line is in: only the empty line may follow.
    EmptyLine,
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
        let min = measurement.min_beams() as usize;
        Self {
            width: measurement.width,
            min: if min == 0 { 1 } else { min },
            max: measurement.beams() as usize,
            count: 0,
            value: 0,
            missing: measurement.width.characters() as usize,
            sum: 0,
            room: LINE,
            end: LineEnd::Checksum,
        }
    }

    /// Takes bytes up to the end of the block: at least one of a part that is not empty.
    /// `ranges_mm` must hold as many values as may come.
    #[inline(never)]
    pub(super) fn feed<'a>(&mut self, bytes: &'a [u8], ranges_mm: &mut [u16]) -> Progress<'a> {
        match self.width {
            Width::Two => self.lines::<2, 6>(bytes, ranges_mm, |[a, b, c, d, e, f, g, h, i, j, k, l]| {
                let range_mm = |high, low| u16::from(high) << 6 | u16::from(low);
                Some([
                    range_mm(a, b),
                    range_mm(c, d),
                    range_mm(e, f),
                    range_mm(g, h),
                    range_mm(i, j),
                    range_mm(k, l),
                ])
            }),
            Width::Three => self.lines::<3, 4>(bytes, ranges_mm, |[a, b, c, d, e, f, g, h, i, j, k, l]| {
                let range_mm =
                    |high, middle, low| u16::from(high) << 12 | u16::from(middle) << 6 | u16::from(low);
                let fit = (a | d | g | j) < 16;
                fit.then_some([range_mm(a, b, c), range_mm(d, e, f), range_mm(g, h, i), range_mm(j, k, l)])
            }),
        }
    }

    /// `join` makes the `N` values of a dozen codes, `W` each; `None` when one does not fit 16 bits.
    fn lines<'a, const W: usize, const N: usize>(
        &mut self,
        bytes: &'a [u8],
        ranges_mm: &mut [u16],
        join: impl Fn([u8; DOZEN]) -> Option<[u16; N]>,
    ) -> Progress<'a> {
        let (mut line, mut fresh, mut rest) = (bytes, false, bytes);
        let step = loop {
            if self.room > 0 {
                let (taken, overflow) = self.decode::<W, N>(rest, ranges_mm, &join);
                rest = rest.get(taken..).unwrap_or(&[]);
                if overflow {
                    let too_many = self.count >= self.max;
                    break Step::Wrong(if too_many {
                        LossCause::ValueCount
                    } else {
                        LossCause::BufferTooShort
                    });
                }
            }
            let Some((&byte, behind)) = rest.split_first() else { break Step::More };
            rest = behind;
            if byte != b'\n' {
                if let Some(cause) = self.line_checksum(byte) {
                    break Step::Wrong(cause);
                }
            } else {
                if let Some(step) = self.line_feed::<W>() {
                    break step;
                }
                (line, fresh) = (rest, true);
            }
        };
        let line = line.get(..line.len().wrapping_sub(rest.len())).unwrap_or(line);
        Progress { line, fresh, rest, step }
    }

    /// Decodes characters of one line up to the first one outside the code. Returns how many, and
    /// whether the last of them completed a value for which there is no place.
    fn decode<const W: usize, const N: usize>(
        &mut self,
        bytes: &[u8],
        ranges_mm: &mut [u16],
        join: impl Fn([u8; DOZEN]) -> Option<[u16; N]>,
    ) -> (usize, bool) {
        let Self { mut value, mut missing, mut sum, mut count, .. } = *self;
        let run = bytes.get(..self.room).unwrap_or(bytes);
        let places = ranges_mm.get_mut(..self.max).unwrap_or_default();
        let mut rest = run;
        let full = loop {
            while missing == W
                && let Some((dozen, behind)) = rest.split_first_chunk()
                && let Some((codes, of_dozen)) = codes(dozen)
                && let Some(values) = join(codes)
                && let Some(free) = places.get_mut(count..).and_then(<[u16]>::first_chunk_mut)
            {
                *free = values;
                sum = sum.wrapping_add(of_dozen);
                count = count.wrapping_add(N);
                rest = behind;
            }
            let Some((&character, behind)) = rest.split_first() else { break false };
            let code = code(character);
            if code > 0x3F {
                break false;
            }
            rest = behind;
            value = value << 6 | code;
            sum = sum.wrapping_add(code);
            missing = missing.wrapping_sub(1);
            if missing == 0 {
                missing = W;
                let Some(place) = places.get_mut(count) else { break true };
                *place = range_mm(value & ((1 << (6 * W)) - 1));
                count = count.wrapping_add(1);
            }
        };
        (self.value, self.sum, self.missing, self.count) = (value, sum, missing, count);
        let taken = run.len().wrapping_sub(rest.len());
        self.room = self.room.wrapping_sub(taken);
        (taken, full)
    }

    /// A byte that is neither data nor a line feed: the checksum of a full line, or one too many.
    fn line_checksum(&mut self, character: u8) -> Option<LossCause> {
        if encoding::decode_char(character).is_none() {
            return Some(LossCause::Character);
        }
        if self.end != LineEnd::Checksum {
            return Some(LossCause::LineLength);
        }
        self.end = LineEnd::LineFeed;
        (character != self.checksum(LINE)).then_some(LossCause::Checksum)
    }

    /// A line feed: behind a full line, behind the short last line, or an empty line. `None` when
    /// the block goes on.
    fn line_feed<const W: usize>(&mut self) -> Option<Step> {
        let characters = LINE.wrapping_sub(self.room);
        match (self.end, characters) {
            (LineEnd::LineFeed, _) => {
                self.end = LineEnd::Checksum;
                self.room = LINE;
                self.sum = 0;
                None
            }
            (LineEnd::EmptyLine, _) | (LineEnd::Checksum, 0) => {
                let complete = self.missing == W && self.count >= self.min;
                let beams = u16::try_from(self.count).ok().filter(|_| complete);
                Some(beams.map_or(Step::Wrong(LossCause::ValueCount), Step::Complete))
            }
            (LineEnd::Checksum, 1) => Some(Step::Wrong(LossCause::LineLength)),
            // The last value is complete without its last character, which was the checksum, or
            // else it cannot be.
            (LineEnd::Checksum, _) => {
                let checksum = self.value & 0x3F;
                self.sum = self.sum.wrapping_sub(checksum);
                self.end = LineEnd::EmptyLine;
                self.room = 0;
                if self.missing != W - 1 {
                    return Some(Step::Wrong(LossCause::ValueCount));
                }
                self.missing = W;
                let right = self.checksum(characters - 1) == encoding::encode_char(checksum as u8);
                (!right).then_some(Step::Wrong(LossCause::Checksum))
            }
        }
    }

    /// What the checksum of a line of `characters` must be.
    fn checksum(&self, characters: usize) -> u8 {
        let offsets = characters.wrapping_mul(encoding::FIRST.into());
        encoding::encode_char((self.sum as u8).wrapping_add(offsets as u8))
    }
}

/// The codes of twelve characters and their sum, in the low six bits; `None` when one is not legal.
fn codes(characters: &[u8; DOZEN]) -> Option<([u8; DOZEN], u32)> {
    let (fours, _) = characters.as_chunks::<4>();
    let &[a, b, c] = fours else { return None };
    // Four at once: the lowest that is not legal leaves a bit above its six; what it borrows from the
    // others changes nothing.
    let code = |four| u32::from_le_bytes(four).wrapping_sub(0x0101_0101 * u32::from(encoding::FIRST));
    let (one, two, three) = (code(a), code(b), code(c));
    if (one | two | three) & 0xC0C0_C0C0 != 0 {
        return None;
    }
    // Of the four sums only six bits each count, and so their sum is the product's highest byte.
    let sum = ((one + two + three) & 0x3F3F_3F3F).wrapping_mul(0x0101_0101) >> 24;
    let ([a, b, c, d], [e, f, g, h], [i, j, k, l]) =
        (one.to_le_bytes(), two.to_le_bytes(), three.to_le_bytes());
    Some(([a, b, c, d, e, f, g, h, i, j, k, l], sum))
}

/// The code of a character; above 0x3F when it is not legal.
fn code(character: u8) -> u32 {
    u32::from(character).wrapping_sub(encoding::FIRST.into())
}

/// The stored range: what does not fit 16 bits is far beyond every sensor's reach.
fn range_mm(value: u32) -> u16 {
    (value as i32).clamp(0, NO_RETURN_MM.into()) as u16
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
        DataBlock::new(&measurement).feed(bytes, ranges_mm).step
    }

    #[test]
    fn recorded_first_values_decode() {
        let line = b"06806806706105m05m05h05c05c05c05`05]05Z05W05W05U05S05O05S05P05P0_\n";
        let mut ranges_mm = [0; 682];
        let step = run(measurement(682, Width::Three), line, &mut ranges_mm);
        assert_eq!(step, Step::More);
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
        let cut = [block(&full[..33]), block(&full[..64]), b"\n".to_vec()].concat();
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
