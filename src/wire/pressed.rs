//! Which panels of a pressure floor are down: one message for every reading of the floor.
//!
//! ```text
//!    0  head       as a report's: sequence, setup, …, lost readings                  32 bytes
//!   32  columns    u8
//!   33  rows       u8          columns · rows is at most 1024
//!   34  down       list of u8  a bit for each panel, row by row, the lowest bit of a byte first
//!       faulty     list, 32 at most: u16 each: the panel in bits 0 to 14; bit 15: 0 stuck, 1 dead
//! ```
//!
//! 24 × 24 panels are 72 bytes of bits. A panel that does not work is not down, and nothing is known of it.

use super::codec::{Item, List, Malformed, Reader, TooLong, Writer, count_bytes};
use super::report::{HEAD_LEN, ReportHead};
use super::{DATAGRAM_MAX, HEADER_LEN};
use crate::floor::{FAULTY, Fault, PANELS};

/// Bit of a faulty panel that is dead.
const DEAD: u16 = 1 << 15;

/// Most bytes of this message.
pub const PRESSED_MAX: usize =
    HEAD_LEN + 2 + count_bytes(PANELS / 8) + PANELS / 8 + count_bytes(FAULTY) + FAULTY * FaultyPanel::MAX;

const _: () = assert!(HEADER_LEN + PRESSED_MAX <= DATAGRAM_MAX);

/// Which panels are down, to be sent or as received.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Pressed<'a> {
    /// When it was read, and which reading it is.
    pub head: ReportHead,
    /// Columns of the floor.
    pub columns: u8,
    /// Rows of the floor.
    pub rows: u8,
    /// A bit for each panel.
    pub down: List<'a, u8>,
    /// Panels that do not work.
    pub faulty: List<'a, FaultyPanel>,
}

/// A panel that does not work.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct FaultyPanel {
    /// Its number: row · columns + column.
    pub panel: u16,
    /// Why.
    pub fault: Fault,
}

impl<'a> Pressed<'a> {
    pub(super) fn write(&self, writer: &mut Writer<'_>) -> Result<(), TooLong> {
        writer.put(&self.head)?;
        writer.put(&(self.columns, self.rows))?;
        self.down.write(writer)?;
        self.faulty.write(writer)
    }

    pub(super) fn read(reader: &mut Reader<'a>) -> Result<Self, Malformed> {
        let (head, (columns, rows)) = (reader.required()?, reader.required::<(u8, u8)>()?);
        let (down, faulty) = (reader.list()?, reader.list::<FaultyPanel>()?);
        let panels = usize::from(columns) * usize::from(rows);
        let fits = (1..=PANELS).contains(&panels) && down.len() == panels.div_ceil(8);
        let is_there = |faulty: FaultyPanel| usize::from(faulty.panel) < panels;
        if fits && faulty.len() <= FAULTY && faulty.iter().all(is_there) {
            Ok(Self { head, columns, rows, down, faulty })
        } else {
            Err(Malformed)
        }
    }
}

impl Item for u8 {
    const MAX: usize = 1;

    fn write(&self, writer: &mut Writer<'_>) -> Result<(), TooLong> {
        writer.put(self)
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        reader.required()
    }
}

impl Item for FaultyPanel {
    const MAX: usize = 2;

    fn write(&self, writer: &mut Writer<'_>) -> Result<(), TooLong> {
        let dead = if self.fault == Fault::Dead { DEAD } else { 0 };
        writer.put_u16(self.panel & !DEAD | dead)
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        let code = reader.required_u16()?;
        let fault = if code & DEAD == 0 { Fault::Stuck } else { Fault::Dead };
        Ok(Self { panel: code & !DEAD, fault })
    }
}
