//! A SensFloor: tiles of eight capacitive triangles that speak when something changes, as a floor of panels.
//!
//! ```text
//!   a tile, 0.5 m     its 2 × 2 panels, 0.25 m
//!   7 ╲ │ ╱ 0         ┌────┬────┐
//!   6  ╲│╱  1         │ 67 │ 01 │ row 1     a panel is down while one of its two triangles is
//!   ────┼────         ├────┼────┤
//!   5  ╱│╲  2         │ 45 │ 23 │ row 0
//!   4 ╱ │ ╲ 3         └────┴────┘           x to the right, y up
//!
//!   bytes ─▶ frame ─▶ triangles: rest learned, down ─▶ panels, at 9 Hz ─▶ super::Floor ─▶ `pressed`
//!   line  ◀─ request ◀─ a tile in turn
//! ```
//!
//! A floor on which no foot moves sends nothing, and so does a cut cable. So the device asks a tile for its state ten
//! times a second, one after the other. A line without a frame for a second is *silent*: no reading, all is unknown. A tile
//! that three rounds have not heard is *unread*: its panels do not work. A floor that answers no request is known while
//! feet move on it, and unknown a second later.
//!
//! Source: the public readers ofxSensfloor and sensfloor-pipeline (docs/bibliography.md).

pub mod frame;
mod triangle;

pub use frame::{BAUD, FRAME_LEN, Frame, FrameReader, Losses, TRIANGLES, request};

use super::Bits;
use frame::GAP_US;
use triangle::Triangle;

/// Panels along a side of a tile.
pub const PANELS_PER_SIDE: u8 = 2;

/// Side of a panel, mm.
pub const PITCH_MM: u16 = 250;

/// Most tiles of a floor, 16 m²: all are asked within 6.4 s, so that a tile that is cut off is unread within 20 s. A larger
/// room is several floors.
pub const TILES: usize = 64;

/// Between two requests, µs: longer than a tick of the floor (66 ms), so that answers do not pile up.
const ASK_US: u64 = 100_000;

/// A line without a frame for so long is silent, µs: ten requests, each answered within two ticks.
const SILENT_US: u64 = 1_000_000;

/// Rounds of requests after which a tile that was not heard is unread: radio loses frames, not three in a row.
const ROUNDS: u64 = 3;

/// Numbers of tiles stay below that of the byte with which frames begin.
const NUMBER_SPARE: u8 = u8::MAX - frame::BEGIN;

/// The triangles in each panel of a tile, a bit each; row by row from the lowest.
const IN_PANEL: [u8; 4] = [0b0011_0000, 0b0000_1100, 0b1100_0000, 0b0000_0011];

/// Which tiles a floor has: a rectangle of those of one group.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Layout {
    group: u16,
    first: (u8, u8),
    columns: u8,
    rows: u8,
}

impl Layout {
    /// Columns (along x) and rows (along y) of tiles of `group` from tile `first` on. None without a tile, with more than
    /// [`TILES`], or where their numbers go beyond 252.
    #[must_use]
    pub const fn new(group: u16, first: (u8, u8), (columns, rows): (u8, u8)) -> Option<Self> {
        let is_numbered =
            columns <= u8::MAX - first.0 - NUMBER_SPARE && rows <= u8::MAX - first.1 - NUMBER_SPARE;
        let fits = columns as usize * rows as usize <= TILES;
        if columns == 0 || rows == 0 || !fits || !is_numbered {
            return None;
        }
        Some(Self { group, first, columns, rows })
    }

    /// The group of its tiles.
    #[must_use]
    pub const fn group(&self) -> u16 {
        self.group
    }

    /// The tile in the corner.
    #[must_use]
    pub const fn first(&self) -> (u8, u8) {
        self.first
    }

    /// Columns and rows of tiles.
    #[must_use]
    pub const fn tiles(&self) -> (u8, u8) {
        (self.columns, self.rows)
    }

    /// Columns and rows of panels.
    #[must_use]
    pub const fn panels(&self) -> (u8, u8) {
        (self.columns.saturating_mul(PANELS_PER_SIDE), self.rows.saturating_mul(PANELS_PER_SIDE))
    }

    fn count(&self) -> usize {
        usize::from(self.columns).saturating_mul(usize::from(self.rows))
    }

    /// The place of a tile, row by row; None beside the floor.
    fn index(&self, (x, y): (u8, u8)) -> Option<usize> {
        let column = x.checked_sub(self.first.0).filter(|column| *column < self.columns)?;
        let row = y.checked_sub(self.first.1).filter(|row| *row < self.rows)?;
        Some(usize::from(row).saturating_mul(usize::from(self.columns)).saturating_add(usize::from(column)))
    }
}

/// What is known of a tile.
#[derive(Clone, Copy, Debug, Default)]
struct Tile {
    /// When it was heard last; none: never.
    heard_us: Option<u64>,
    triangles: Option<[Triangle; TRIANGLES]>,
}

/// A reading of a floor.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Reading {
    /// Panels with a foot on them.
    pub down: Bits,
    /// Panels of tiles that are not heard.
    pub unread: Bits,
}

/// A SensFloor: bytes of its line and the time in; readings, and requests for the line, out.
#[derive(Clone, Debug)]
pub struct SensFloor {
    layout: Layout,
    reader: FrameReader,
    tiles: [Tile; TILES],
    heard_us: Option<u64>,
    ask_us: u64,
    asked: usize,
    /// Whole frames of another group, or of tiles beside the floor.
    foreign: u32,
}

impl SensFloor {
    /// A floor of which nothing has been heard, switched on at `now_us`.
    #[must_use]
    pub fn new(layout: Layout, now_us: u64) -> Self {
        Self {
            layout,
            reader: FrameReader::new(),
            tiles: [Tile::default(); TILES],
            heard_us: None,
            ask_us: now_us,
            asked: 0,
            foreign: 0,
        }
    }

    /// Its tiles.
    #[must_use]
    pub const fn layout(&self) -> &Layout {
        &self.layout
    }

    /// What its line has lost.
    #[must_use]
    pub const fn losses(&self) -> Losses {
        self.reader.losses()
    }

    /// Whole frames of another group, or of tiles beside the floor.
    #[must_use]
    pub const fn foreign(&self) -> u32 {
        self.foreign
    }

    /// The line has lost bytes.
    pub fn lost(&mut self) {
        self.reader.lost();
    }

    /// Takes bytes that came at `now_us`.
    pub fn receive(&mut self, bytes: &[u8], now_us: u64) {
        for byte in bytes {
            if let Some((frame, at_us)) = self.reader.push(*byte, now_us) {
                self.take(&frame, at_us);
            }
        }
    }

    /// Takes a frame that came at `now_us`.
    pub fn take(&mut self, frame: &Frame, now_us: u64) {
        let index = self.layout.index(frame.tile).filter(|_| frame.group == self.layout.group);
        let Some(tile) = index.and_then(|index| self.tiles.get_mut(index)) else {
            self.foreign = self.foreign.saturating_add(1);
            return;
        };
        let past_us = tile.heard_us.map_or(0, |heard_us| now_us.saturating_sub(heard_us));
        match &mut tile.triangles {
            Some(triangles) => {
                triangles
                    .iter_mut()
                    .zip(frame.values)
                    .for_each(|(triangle, value)| triangle.take(value, past_us));
            }
            None => tile.triangles = Some(frame.values.map(Triangle::new)),
        }
        tile.heard_us = Some(now_us);
        self.heard_us = Some(now_us);
    }

    /// Whether nothing has been heard for a second.
    #[must_use]
    pub fn is_silent(&self, now_us: u64) -> bool {
        self.heard_us.is_none_or(|heard_us| now_us.saturating_sub(heard_us) > SILENT_US)
    }

    /// When it is best read, µs, if a reading is due at `due_us`: a frame that has just come may go on, and its word counts
    /// once it is over.
    #[must_use]
    pub fn read_us(&self, due_us: u64) -> u64 {
        self.reader.over_us().map_or(due_us, |over_us| over_us.max(due_us).min(due_us.saturating_add(GAP_US)))
    }

    /// Which panels are down at `now_us`; none while the line is silent.
    #[must_use]
    pub fn reading(&mut self, now_us: u64) -> Option<Reading> {
        if let Some((frame, at_us)) = self.reader.still(now_us) {
            self.take(&frame, at_us);
        }
        if self.is_silent(now_us) {
            return None;
        }
        let round_us = ASK_US.saturating_mul(self.layout.count() as u64);
        let unread_us = round_us.saturating_mul(ROUNDS).max(SILENT_US);
        let mut reading = Reading { down: Bits::default(), unread: Bits::default() };
        let columns = usize::from(self.layout.panels().0);
        let side = usize::from(PANELS_PER_SIDE);
        let tile_columns = usize::from(self.layout.columns).max(1);
        for (index, tile) in self.tiles.iter().enumerate().take(self.layout.count()) {
            let corner = (index / tile_columns) * side * columns + (index % tile_columns) * side;
            let past_us = tile.heard_us.map(|heard_us| now_us.saturating_sub(heard_us));
            let is_read = past_us.is_some_and(|past_us| past_us <= unread_us);
            let down = tile.triangles.map_or(0, |triangles| {
                let is_down = |triangle: &Triangle| triangle.is_down(past_us.unwrap_or(0));
                let bit = |(number, triangle)| u8::from(is_down(triangle)) << (number % 8);
                triangles.iter().enumerate().map(bit).fold(0, |bits, bit| bits | bit)
            });
            for (number, triangles) in IN_PANEL.iter().enumerate() {
                let panel = corner + (number / side) * columns + number % side;
                reading.down.set(panel, is_read && down & triangles != 0);
                reading.unread.set(panel, !is_read);
            }
        }
        Some(reading)
    }

    /// When the next request is due, µs.
    #[must_use]
    pub const fn ask_us(&self) -> u64 {
        self.ask_us
    }

    /// The request that is due at `now_us`, if one is.
    pub fn ask(&mut self, now_us: u64) -> Option<[u8; FRAME_LEN]> {
        if now_us < self.ask_us {
            return None;
        }
        self.ask_us = now_us.saturating_add(ASK_US);
        let columns = usize::from(self.layout.columns).max(1);
        let (column, row) = (self.asked % columns, self.asked / columns);
        self.asked = self.asked.saturating_add(1);
        if self.asked >= self.layout.count() {
            self.asked = 0;
        }
        let (x, y) = self.layout.first;
        // At most 64 each.
        Some(request(self.layout.group, (x.saturating_add(column as u8), y.saturating_add(row as u8))))
    }
}

#[cfg(test)]
mod tests;
