//! A SensFloor at the end of a serial line: it answers requests, and says what happens on it.
//!
//! ```text
//!   requests ─▶ a tile is asked ─▶ signal ─▶ frames, 17 bytes each, 115 200 baud
//!                soles at a time ──▲             └ cut: nothing passes; noisy: a byte in forty is lost
//! ```

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::{Signal, Sole, bytes};
use crate::serve::SerialDevice;
use crate::urg::Sent;

/// Speed of its line.
const BAUD: u32 = 115_200;

/// Bytes of a frame, and of a request.
const FRAME_LEN: usize = 17;

/// On a noisy line one byte of so many is lost.
const NOISE: u64 = 40;

/// What becomes of bytes on its line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LineState {
    /// They arrive.
    Up,
    /// One in forty is lost.
    Noisy,
    /// None passes.
    Cut,
}

/// A floor, what is on it, and its line.
pub struct SensFloor {
    signal: Signal,
    /// The soles on it at a time, µs.
    soles: Box<dyn FnMut(u64) -> Vec<Sole>>,
    state: LineState,
    /// The beginning of a request.
    request: Vec<u8>,
    noise: Pcg64Mcg,
}

impl SensFloor {
    /// A floor with these soles on it at any time, µs. Its line is up.
    #[must_use]
    pub fn new(signal: Signal, soles: impl FnMut(u64) -> Vec<Sole> + 'static) -> Self {
        let (soles, noise) = (Box::new(soles), Pcg64Mcg::seed_from_u64(1));
        Self { signal, soles, state: LineState::Up, request: Vec::new(), noise }
    }

    /// From now on, these soles.
    pub fn walk(&mut self, soles: impl FnMut(u64) -> Vec<Sole> + 'static) {
        self.soles = Box::new(soles);
    }

    /// From now on, such a line.
    pub fn set_line(&mut self, state: LineState) {
        self.state = state;
    }

    fn is_lost(&mut self) -> bool {
        match self.state {
            LineState::Up => false,
            LineState::Noisy => self.noise.next_u64().is_multiple_of(NOISE),
            LineState::Cut => true,
        }
    }
}

impl SerialDevice for SensFloor {
    fn receive(&mut self, bytes: &[u8], _now_us: u64) {
        for byte in bytes {
            if self.is_lost() {
                continue;
            }
            self.request.push(*byte);
            if self.request.first() != Some(&0xfd) {
                self.request.clear();
            } else if self.request.len() == FRAME_LEN {
                if let Some(tile) = asked(&self.request) {
                    self.signal.ask(tile);
                }
                self.request.clear();
            }
        }
    }

    fn take_output(&mut self, now_us: u64) -> Vec<Sent> {
        let mut sent = Vec::new();
        while self.signal.next_us() <= now_us {
            let soles = (self.soles)(self.signal.next_us());
            for frame in self.signal.tick(&soles) {
                sent.extend(bytes(&frame));
            }
        }
        sent.retain(|_| !self.is_lost());
        if sent.is_empty() { Vec::new() } else { vec![Sent { baud: Some(BAUD), bytes: sent }] }
    }

    fn baud(&self) -> u32 {
        BAUD
    }

    fn paced(&self) -> bool {
        true
    }
}

/// The tile that a request asks, if these bytes are one.
fn asked(request: &[u8]) -> Option<(u8, u8)> {
    match request {
        [0xfd, _, _, x, y, _, _, meaning, 0, rest @ ..] if meaning & 0x04 != 0 && rest.len() == 8 => {
            Some((*x, *y))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use kehai::floor::sensfloor::{Frame, FrameReader, Layout, request};

    use super::*;

    fn floor() -> SensFloor {
        let layout = Layout::new(10, (1, 1), (2, 2)).unwrap();
        SensFloor::new(Signal::new(&layout, 3), |_| Vec::new())
    }

    /// What is heard of it in ten seconds, while a tile is asked each second.
    fn heard(floor: &mut SensFloor) -> (Vec<Frame>, u32) {
        let (mut reader, mut frames) = (FrameReader::new(), Vec::new());
        for tenth in 1..=100_u64 {
            let now_us = tenth * 100_000;
            if tenth % 10 == 0 {
                floor.receive(&request(10, (1, 2)), now_us);
            }
            for sent in floor.take_output(now_us) {
                frames.extend(sent.bytes.iter().filter_map(|byte| Some(reader.push(*byte, now_us)?.0)));
            }
        }
        (frames, reader.losses().torn)
    }

    #[test]
    fn a_tile_that_is_asked_answers_and_a_cut_or_noisy_line_loses_what_it_loses() {
        let asked = |frames: &[Frame]| frames.iter().filter(|frame| frame.tile == (1, 2)).count();
        let (frames, torn) = heard(&mut floor());
        assert!(asked(&frames) >= 8 && torn == 0, "{frames:?}");
        let mut noisy = floor();
        noisy.set_line(LineState::Noisy);
        let (frames, torn) = heard(&mut noisy);
        assert!(torn > 0 && !frames.is_empty(), "{torn}");
        let mut cut = floor();
        cut.set_line(LineState::Cut);
        assert_eq!(heard(&mut cut), (Vec::new(), 0));
    }
}
