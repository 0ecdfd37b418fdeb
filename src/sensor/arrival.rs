//! When the first byte of a scan left the sensor, seen through reads that come late and in pieces.
//!
//! ```text
//!   on the line   ├b┼b┼b┼b┼b┼b┼b┼b┼b┼b┼b┼b┼b┼b┼b┼─ …      a byte every 10 bits / rate
//!   reads                        ▲8 bytes    ▲12 ▲16
//!   start         ◀──── 8 · b ───┘           │   │        the earliest of what the reads imply;
//!                 ◀──────────── 12 · b ──────┘   …        each is late by its own jitter
//! ```
//!
//! On a line without a speed a read says nothing about the reads before it.

/// Bytes at the start of a scan that are looked at: at 250 kbaud, those of 82 ms. A rate 0.5 % off the
/// nominal one, five times what a quartz may be, puts the start no more than 0.4 ms wrong.
const LOOKED_AT: u32 = 2048;

/// Follows the bytes since the end of the last scan.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrival {
    bytes: u32,
    earliest_us: u64,
}

impl Arrival {
    pub(super) const NONE: Self = Self { bytes: 0, earliest_us: u64::MAX };

    /// `count` more bytes, the last of them read at `now_us` from a line of this speed.
    pub(super) fn push(&mut self, count: usize, now_us: u64, baud: Option<u32>) {
        let Some(baud) = baud else { return };
        self.bytes = self.bytes.saturating_add(u32::try_from(count).unwrap_or(u32::MAX));
        if self.bytes <= LOOKED_AT {
            let since_us = u64::from(self.bytes) * 10_000_000 / u64::from(baud.max(1));
            self.earliest_us = self.earliest_us.min(now_us.saturating_sub(since_us));
        }
    }

    /// A scan of `scan_bytes` is complete: the time of its first byte, `first_byte_us` by the read it was
    /// in. Only if nothing came between it and the scan before is there more to know.
    pub(super) fn scan_end(&mut self, scan_bytes: u32, first_byte_us: u64) -> u64 {
        let seen = core::mem::replace(self, Self::NONE);
        if seen.bytes == scan_bytes { first_byte_us.min(seen.earliest_us) } else { first_byte_us }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_earliest_start_any_read_implies_counts() {
        let mut arrival = Arrival::NONE;
        // 250 kbaud: 40 µs a byte; the scan starts to leave at 10 000.
        arrival.push(64, 10_000 + 2_560 + 9_000, Some(250_000));
        arrival.push(64, 10_000 + 5_120 + 300, Some(250_000));
        arrival.push(2009, 95_480 - 7_000, Some(250_000));
        assert_eq!(arrival.scan_end(2137, 19_000), 10_300);
        // Something else came in between.
        arrival.push(2138, 5, Some(250_000));
        assert_eq!(arrival.scan_end(2137, 19_000), 19_000);
        arrival.push(2137, 5, None);
        assert_eq!(arrival.scan_end(2137, 19_000), 19_000);
    }
}
