//! SensFloor's frames on its serial line, and finding them again after damage.
//!
//! ```text
//!    0  FD        begins a frame
//!    1  group     u16, the highest byte first: all tiles of a room
//!    3  x, y      u8 each: the tile
//!    5  sensors   u8                                         not used
//!    6  feature   u8                                         not used
//!    7  meaning   u8: bit 0 a change, 2 a request, 3 an answer to one, 5 configuration, 6 recalibrate, 7 from the
//!                 transceiver
//!    8  parameter u8: 0 the capacitances
//!    9  values    u8 × 8: a triangle each, 127 to 128 at rest
//! ```
//!
//! There is no check sum. A frame is taken for whole if no FD stands behind its group and it is over where it should be: the
//! next byte is FD, or the line is still. Where a byte is lost, the next frame's FD comes too early; where that is lost, too,
//! the frame goes on. A flipped bit in a value passes.
//!
//! Source: the public readers ofxSensfloor and sensfloor-pipeline (docs/bibliography.md), 115 200 baud, 8N1.

/// Bytes of a frame.
pub const FRAME_LEN: usize = 17;

/// Triangles of a tile.
pub const TRIANGLES: usize = 8;

/// Speed of the line.
pub const BAUD: u32 = 115_200;

/// First byte of a frame; and no value is as large: a step adds 10 to 60 to 128.
pub(super) const BEGIN: u8 = 0xfd;

/// Where the tile stands: from here on no byte is [`BEGIN`].
const TILE_AT: usize = 3;

/// A line without a byte for so long is still, and a frame on it is over, µs: half a tick of the floor (66 ms), and twice the
/// time for which USB adapters hold bytes back (16 ms).
pub(super) const GAP_US: u64 = 33_000;

/// Bits of the meaning: what is no word of a tile about its triangles.
const REQUEST: u8 = 1 << 2;
const CONFIGURATION: u8 = 1 << 5;
const FROM_TRANSCEIVER: u8 = 1 << 7;

/// A tile's word about its triangles.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Frame {
    /// All tiles of a room.
    pub group: u16,
    /// Number of the tile along x and along y.
    pub tile: (u8, u8),
    /// Capacitance of each triangle, 127 to 128 at rest.
    pub values: [u8; TRIANGLES],
}

/// What was dropped on the way.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Losses {
    /// Frames that had begun and were not whole.
    pub torn: u32,
    /// Bytes that belong to no whole frame.
    pub skipped: u32,
    /// Whole frames that say nothing of triangles.
    pub others: u32,
}

/// Bytes in, frames out.
#[derive(Clone, Debug, Default)]
pub struct FrameReader {
    bytes: [u8; FRAME_LEN],
    length: usize,
    last_us: u64,
    losses: Losses,
}

impl FrameReader {
    /// Waits for the first frame.
    #[must_use]
    pub const fn new() -> Self {
        let losses = Losses { torn: 0, skipped: 0, others: 0 };
        Self { bytes: [0; FRAME_LEN], length: 0, last_us: 0, losses }
    }

    /// What was dropped so far.
    #[must_use]
    pub const fn losses(&self) -> Losses {
        self.losses
    }

    /// The line has lost bytes: what has begun is not finished.
    pub fn lost(&mut self) {
        self.drop_first(self.length);
    }

    /// Takes a byte that came at `now_us`; the frame that was over before it, if one was, and when its last byte came, µs.
    pub fn push(&mut self, byte: u8, now_us: u64) -> Option<(Frame, u64)> {
        let is_still = self.is_still(now_us);
        let over = if is_still || byte == BEGIN { self.end() } else { None };
        if is_still {
            self.lost();
        } else if self.length == FRAME_LEN {
            // It goes on: it has lost bytes, and has taken the next one's for its own.
            self.give_up();
        }
        self.last_us = now_us;
        if let Some(place) = self.bytes.get_mut(self.length) {
            *place = byte;
            self.length = self.length.saturating_add(1);
        }
        self.find_begin();
        if self.length == FRAME_LEN && self.bytes.iter().skip(TILE_AT).any(|byte| *byte == BEGIN) {
            self.give_up();
        }
        over
    }

    /// The frame that is over since the line is still, if one is at `now_us`, and when its last byte came, µs.
    pub fn still(&mut self, now_us: u64) -> Option<(Frame, u64)> {
        if self.is_still(now_us) { self.end() } else { None }
    }

    const fn is_still(&self, now_us: u64) -> bool {
        now_us.saturating_sub(self.last_us) > GAP_US
    }

    /// When the frame that is held is over at the latest, µs; none while none or not all of one is held.
    #[must_use]
    pub const fn over_us(&self) -> Option<u64> {
        if self.length == FRAME_LEN {
            Some(self.last_us.saturating_add(GAP_US).saturating_add(1))
        } else {
            None
        }
    }

    /// The frame that is held, if all of it is, and says something of triangles.
    fn end(&mut self) -> Option<(Frame, u64)> {
        if self.length < FRAME_LEN {
            return None;
        }
        self.length = 0;
        let [_, high, low, x, y, _, _, meaning, parameter, values @ ..] = self.bytes;
        if meaning & (REQUEST | CONFIGURATION | FROM_TRANSCEIVER) != 0 || parameter != 0 {
            self.losses.others = self.losses.others.saturating_add(1);
            return None;
        }
        Some((Frame { group: u16::from_be_bytes([high, low]), tile: (x, y), values }, self.last_us))
    }

    /// What is held is no frame: another may begin within it.
    fn give_up(&mut self) {
        self.drop_first(1);
        self.find_begin();
    }

    /// Drops what stands before the next beginning.
    fn find_begin(&mut self) {
        let held = self.bytes.iter().take(self.length);
        let before = held.take_while(|byte| **byte != BEGIN).count();
        if before > 0 {
            self.drop_first(before);
        }
    }

    /// Drops so many bytes; a beginning among them is a torn frame.
    fn drop_first(&mut self, count: usize) {
        let count = count.min(self.length);
        if count == 0 {
            return;
        }
        self.losses.torn = self.losses.torn.saturating_add(u32::from(self.bytes.first() == Some(&BEGIN)));
        // At most 17.
        self.losses.skipped = self.losses.skipped.saturating_add(count as u32);
        self.bytes.rotate_left(count.min(FRAME_LEN));
        self.length = self.length.saturating_sub(count);
    }
}

/// The bytes that ask a tile for its triangles.
#[must_use]
pub const fn request(group: u16, (x, y): (u8, u8)) -> [u8; FRAME_LEN] {
    let [high, low] = group.to_be_bytes();
    [BEGIN, high, low, x, y, 0, 0, REQUEST, 0, 0, 0, 0, 0, 0, 0, 0, 0]
}

/// The bytes of a frame, as a floor sends it of itself or as an answer.
#[must_use]
pub const fn encode(frame: &Frame) -> [u8; FRAME_LEN] {
    let ([high, low], (x, y)) = (frame.group.to_be_bytes(), frame.tile);
    let [a, b, c, d, e, f, g, h] = frame.values;
    [BEGIN, high, low, x, y, 0, 0, 1, 0, a, b, c, d, e, f, g, h]
}
