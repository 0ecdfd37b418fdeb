//! What a serial receiver makes of bytes sent at another speed than its own.
//!
//! ```text
//! sent at 19 200    ‾‾\_S_/‾0‾\_1_____2_/‾3‾ …
//! heard at 57 600   ‾‾\s 0 1 2 3 4 5 6 7 P    three bits of the receiver in one of the sender's
//! ```
//!
//! Wrong characters, too many or too few: never silence, and no hint of which speed is right.

/// Receivers tolerate a speed that is off by this much.
const TOLERANCE: f64 = 0.03;

/// Bits of a byte on the line.
const FRAME_BITS: usize = 10;

/// The bytes a receiver at `heard_baud` gets when `bytes` are sent without a pause at `sent_baud`. Bytes
/// with a wrong stop bit are delivered, as most receivers do.
#[must_use]
pub fn received(bytes: &[u8], sent_baud: u32, heard_baud: u32) -> Vec<u8> {
    // Bits of the sender in one of the receiver's.
    let ratio = f64::from(sent_baud.max(1)) / f64::from(heard_baud.max(1));
    if (ratio - 1.0).abs() <= TOLERANCE {
        return bytes.to_vec();
    }
    let line: Vec<bool> = bytes.iter().flat_map(|&byte| frame(byte)).collect();
    let level = |time: f64| line.get(time as usize).copied().unwrap_or(true);
    let mut out = Vec::new();
    let mut time = 0.0;
    while let Some(start) = falling_edge(&line, time) {
        let bits = (0..8).filter(|&bit| level(start + (f64::from(bit) + 1.5) * ratio));
        out.push(bits.fold(0, |byte, bit| byte | 1 << bit));
        time = start + 9.5 * ratio;
    }
    out
}

fn frame(byte: u8) -> [bool; FRAME_BITS] {
    std::array::from_fn(|bit| match bit {
        0 => false,
        9 => true,
        _ => byte >> (bit - 1) & 1 == 1,
    })
}

/// The next moment, from `time` on, at which the line falls.
fn falling_edge(line: &[bool], time: f64) -> Option<f64> {
    let from = time as usize;
    let before = from.checked_sub(1).and_then(|at| line.get(at)).copied().unwrap_or(true);
    let mut high = before && time <= from as f64;
    for (at, &level) in line.iter().enumerate().skip(from) {
        if high && !level {
            return Some(at as f64);
        }
        high = level;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_speed_and_nearly_the_same_speed_change_nothing() {
        assert_eq!(received(b"QT\n", 19_200, 19_200), b"QT\n");
        assert_eq!(received(b"QT\n", 19_200, 19_600), b"QT\n");
    }

    #[test]
    fn a_faster_receiver_hears_more_bytes_and_a_slower_one_fewer() {
        let text = b"MD0044072501000\n00P\n\n";
        let faster = received(text, 19_200, 57_600);
        let slower = received(text, 250_000, 19_200);
        assert!(faster.len() > text.len() && !faster.windows(2).any(|pair| pair == b"MD"), "{faster:?}");
        assert!((1..text.len()).contains(&slower.len()), "{slower:?}");
    }

    #[test]
    fn one_byte_at_a_third_of_the_speed_is_what_the_bits_say() {
        // Sent: start 0, data 0000 0000, stop 1. Heard three times as fast: start, 8 zeros; the stop bit is
        // wrong, and no further edge falls.
        assert_eq!(received(&[0x00], 19_200, 57_600), [0x00]);
        // 0xff is low for the start bit only: a start and two more zeros for the fast receiver.
        assert_eq!(received(&[0xff], 19_200, 57_600), [0b1111_1100]);
    }
}
