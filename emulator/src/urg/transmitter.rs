//! The sensor's transmitter: bytes leave one after another, at the speed of the line.
//!
//! ```text
//! enqueue ─▶ [piece][piece]…  byte k of a piece is complete at start + (k + 1) · 10 bits / baud
//! ```
//!
//! On USB and Ethernet every byte is complete as soon as it is queued.

use std::collections::VecDeque;

/// Bits on the line for one byte: start bit, 8 data bits, stop bit.
const BITS_PER_BYTE: u64 = 10;

/// Bytes that have left the sensor, in order.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Sent {
    /// Speed at which they were sent; None where the link has none (USB, Ethernet).
    pub baud: Option<u32>,
    /// The bytes.
    pub bytes: Vec<u8>,
}

#[derive(Debug)]
struct Piece {
    start_ns: u64,
    byte_ns: u64,
    baud: Option<u32>,
    bytes: Vec<u8>,
    /// How many of them have left.
    taken: usize,
}

impl Piece {
    /// When byte `index` of what is left is complete.
    fn due_us(&self, index: usize) -> u64 {
        (self.start_ns + ((self.taken + index) as u64 + 1) * self.byte_ns).div_ceil(1000)
    }

    fn left(&self) -> usize {
        self.bytes.len() - self.taken
    }
}

/// The queue of bytes to send.
#[derive(Debug, Default)]
pub(crate) struct Transmitter {
    pieces: VecDeque<Piece>,
    end_ns: u64,
}

impl Transmitter {
    /// Queues bytes at `now_us`, to be sent at `baud` or at once.
    pub(crate) fn enqueue(&mut self, now_us: u64, bytes: Vec<u8>, baud: Option<u32>) {
        if bytes.is_empty() {
            return;
        }
        let byte_ns = baud.map_or(0, |baud| BITS_PER_BYTE * 1_000_000_000 / u64::from(baud.max(1)));
        let start_ns = self.end_ns.max(now_us * 1000);
        self.end_ns = start_ns + byte_ns * bytes.len() as u64;
        self.pieces.push_back(Piece { start_ns, byte_ns, baud, bytes, taken: 0 });
    }

    /// When `count` bytes are complete, or all of them if there are fewer. None: nothing is queued.
    #[must_use]
    pub(crate) fn due_us(&self, count: usize) -> Option<u64> {
        let mut left = count.max(1);
        let mut due_us = None;
        for piece in &self.pieces {
            let here = left.min(piece.left());
            due_us = here.checked_sub(1).map(|last| piece.due_us(last)).or(due_us);
            left -= here;
            if left == 0 {
                break;
            }
        }
        due_us
    }

    /// Takes what is complete at `now_us`.
    pub(crate) fn sent_until(&mut self, now_us: u64) -> Vec<Sent> {
        let mut sent: Vec<Sent> = Vec::new();
        while let Some(piece) = self.pieces.front_mut() {
            let since_ns = (now_us * 1000).checked_sub(piece.start_ns);
            let complete = since_ns.map_or(0, |since_ns| match since_ns.checked_div(piece.byte_ns) {
                Some(bytes) => bytes.saturating_sub(piece.taken as u64) as usize,
                None => piece.left(),
            });
            let complete = complete.min(piece.left());
            let bytes = piece.bytes.get(piece.taken..piece.taken + complete).unwrap_or_default();
            let baud = piece.baud;
            match sent.last_mut() {
                Some(last) if last.baud == baud => last.bytes.extend_from_slice(bytes),
                _ if bytes.is_empty() => {}
                _ => sent.push(Sent { baud, bytes: bytes.to_vec() }),
            }
            piece.taken += complete;
            if piece.left() > 0 {
                break;
            }
            self.pieces.pop_front();
        }
        sent
    }

    /// When the last queued byte is complete; in the past if nothing is queued.
    #[must_use]
    pub(crate) fn end_us(&self) -> u64 {
        self.end_ns.div_ceil(1000)
    }

    /// Sends nothing further for `pause_us`.
    pub(crate) fn pause(&mut self, now_us: u64, pause_us: u64) {
        self.end_ns = self.end_ns.max((now_us + pause_us) * 1000);
    }

    /// Forgets everything queued: the power is gone.
    pub(crate) fn clear(&mut self, now_us: u64) {
        self.pieces.clear();
        self.end_ns = now_us * 1000;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_byte_takes_ten_bits_at_the_speed_of_the_line() {
        let mut transmitter = Transmitter::default();
        transmitter.enqueue(1000, b"QT\n".to_vec(), Some(19_200));
        assert_eq!(transmitter.due_us(1), Some(1521));
        assert_eq!(transmitter.due_us(99), Some(1000 + 1563));
        assert_eq!(transmitter.sent_until(1520), []);
        assert_eq!(transmitter.sent_until(1521), [Sent { baud: Some(19_200), bytes: b"Q".to_vec() }]);
        assert_eq!(transmitter.sent_until(9999), [Sent { baud: Some(19_200), bytes: b"T\n".to_vec() }]);
        assert_eq!(transmitter.due_us(1), None);
    }

    #[test]
    fn a_change_of_speed_keeps_the_order() {
        let mut transmitter = Transmitter::default();
        transmitter.enqueue(0, b"ab".to_vec(), Some(19_200));
        transmitter.enqueue(0, b"cd".to_vec(), Some(250_000));
        let sent = transmitter.sent_until(10_000);
        assert_eq!(sent.iter().map(|part| part.baud).collect::<Vec<_>>(), [Some(19_200), Some(250_000)]);
        assert_eq!(transmitter.end_us(), 1041 + 80 + 1);
    }

    #[test]
    fn links_without_a_speed_send_at_once() {
        let mut transmitter = Transmitter::default();
        transmitter.enqueue(5, b"abc".to_vec(), None);
        assert_eq!(transmitter.due_us(1), Some(5));
        assert_eq!(transmitter.sent_until(4), []);
        assert_eq!(transmitter.sent_until(5), [Sent { baud: None, bytes: b"abc".to_vec() }]);
    }
}
