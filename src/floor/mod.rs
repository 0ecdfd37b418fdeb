//! A floor of pressure panels, each ON or OFF: which are down, and which do not work.
//!
//! ```text
//!   panel (column, row): bit row · columns + column, the lowest bit of a byte first
//!
//!        ┌──┬──┬──┐ row 2      read       ▁▁▔▁▁▁▔▔▔▔▔▁▔▔▔▁▁▁▁
//!        ├──┼──┼──┤ row 1      down       ▁▁▁▁▁▁▁▔▔▔▔▔▔▔▔▔▁▁▁     a single reading that differs is a flicker
//!        └──┴──┴──┘ row 0
//!     column 0  1  2
//! ```
//!
//! | file | what |
//! |---|---|
//! | `bits` | a bit for each panel |
//! | `sensfloor` | a floor of capacitive triangles as such panels: its serial protocol |
//!
//! Two faults are learned. A panel that stays down for an hour is *stuck*: a person who stands shifts within minutes. One
//! that stays up while the panels on both its sides go down, again and again, is *dead*: a sole covers all three. Either
//! works again as soon as it changes. Panels that are larger than a sole are not learned to be dead: two feet stand on both
//! sides of one that is up. A panel that does not work is neither down nor up: unknown is never empty.
//!
//! Source: the floor of Ota et al. 2006 (docs/bibliography.md, B): 8 cm panels, read at 9 Hz.

mod bits;
pub mod sensfloor;

pub use bits::Bits;

/// Between two readings, µs: the 9 Hz for which panels are debounced and bodies are followed.
pub const READING_US: u64 = 111_111;

/// When the reading after one that was due at `due_us` is due, µs; it was made at `now_us`. Readings that were missed are not made
/// up for: two in a row would debounce nothing.
#[must_use]
pub const fn next_reading_us(due_us: u64, now_us: u64) -> u64 {
    let next_us = due_us.saturating_add(READING_US);
    if next_us > now_us { next_us } else { now_us.saturating_add(READING_US) }
}

/// Most panels of a floor: a square of 2.56 m of 8 cm panels. A larger area is several floors.
pub const PANELS: usize = 1024;

/// Most panels that are reported as faulty; a floor with more needs a repair, not a list.
pub const FAULTY: usize = 32;

/// Readings for which a panel stays down until it is stuck: an hour at 9 Hz.
const STUCK_READINGS: u16 = 9 * 3600;

/// Times that both neighbours go down without a panel until it is dead: each time, two feet may have stood beside it.
const DEAD_TIMES: u8 = 12;

/// Why a panel does not work.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Fault {
    /// It is always down.
    Stuck,
    /// It is never down, or cannot be read.
    Dead,
}

/// A reading does not have as many bits as the floor has panels.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WrongLength;

/// What is remembered of a panel.
#[derive(Clone, Copy, Debug, Default)]
struct Panel {
    /// Readings since it changed.
    held: u16,
    /// Times that both its neighbours went down and it did not.
    passed_over: u8,
}

/// A floor: readings in, panels that are down and panels that do not work out.
#[derive(Clone, Debug)]
pub struct Floor {
    columns: u8,
    rows: u8,
    /// A sole covers three panels in a line.
    is_fine: bool,
    /// The reading before.
    read: Bits,
    /// After debouncing.
    down: Bits,
    /// Panels that cannot be read now.
    unread: Bits,
    panels: [Panel; PANELS],
    /// Readings so far.
    sequence: u32,
}

impl Floor {
    /// A floor of so many panels, none of which is down; None without panels, or with more than [`PANELS`].
    #[must_use]
    pub fn new(columns: u8, rows: u8) -> Option<Self> {
        let panels = usize::from(columns) * usize::from(rows);
        (1..=PANELS).contains(&panels).then(|| Self {
            columns,
            rows,
            is_fine: true,
            read: Bits::default(),
            down: Bits::default(),
            unread: Bits::default(),
            panels: [Panel::default(); PANELS],
            sequence: 0,
        })
    }

    /// The same of panels that are larger than a sole.
    #[must_use]
    pub fn coarse(columns: u8, rows: u8) -> Option<Self> {
        Self::new(columns, rows).map(|floor| Self { is_fine: false, ..floor })
    }

    /// Columns.
    #[must_use]
    pub const fn columns(&self) -> u8 {
        self.columns
    }

    /// Rows.
    #[must_use]
    pub const fn rows(&self) -> u8 {
        self.rows
    }

    /// Number of panels.
    #[must_use]
    pub fn panels(&self) -> usize {
        usize::from(self.columns) * usize::from(self.rows)
    }

    /// Counts the readings.
    #[must_use]
    pub const fn sequence(&self) -> u32 {
        self.sequence
    }

    /// It goes on counting readings from `sequence`, those of the floor before it.
    #[must_use]
    pub const fn after(mut self, sequence: u32) -> Self {
        self.sequence = sequence;
        self
    }

    /// Takes a reading: a bit for each panel, the rest of the last byte 0.
    ///
    /// # Errors
    /// [`WrongLength`]; nothing has changed then.
    pub fn read(&mut self, reading: &[u8]) -> Result<(), WrongLength> {
        let panels = self.panels();
        if reading.len() != panels.div_ceil(8) {
            return Err(WrongLength);
        }
        let reading = Bits::of(reading);
        let before = self.down;
        for panel in 0..panels {
            let now = reading.get(panel);
            let changes = now != self.down.get(panel) && now == self.read.get(panel);
            if changes {
                self.down.set(panel, now);
            }
            if let Some(known) = self.panels.get_mut(panel) {
                known.held = if changes { 0 } else { known.held.saturating_add(1) };
                if changes && now {
                    known.passed_over = 0;
                }
            }
        }
        self.read = reading;
        self.sequence = self.sequence.wrapping_add(1);
        for panel in 0..panels {
            let passed = |down: &Bits| !self.down.get(panel) && self.is_between(down, panel);
            if self.is_fine
                && passed(&self.down)
                && !self.is_between(&before, panel)
                && let Some(known) = self.panels.get_mut(panel)
            {
                known.passed_over = known.passed_over.saturating_add(1);
            }
        }
        Ok(())
    }

    /// These panels cannot be read, until the next call: their bits in a reading mean nothing.
    pub const fn cannot_read(&mut self, unread: Bits) {
        self.unread = unread;
    }

    /// Why a panel does not work, if it does not.
    #[must_use]
    pub fn fault(&self, panel: usize) -> Option<Fault> {
        let known = self.panels.get(panel).filter(|_| panel < self.panels())?;
        if self.unread.get(panel) {
            Some(Fault::Dead)
        } else if self.down.get(panel) && known.held >= STUCK_READINGS {
            Some(Fault::Stuck)
        } else if known.passed_over >= DEAD_TIMES {
            Some(Fault::Dead)
        } else {
            None
        }
    }

    /// The panels that are down and work.
    #[must_use]
    pub fn pressed(&self) -> Bits {
        let mut pressed = Bits::default();
        for panel in 0..self.panels() {
            pressed.set(panel, self.down.get(panel) && self.fault(panel).is_none());
        }
        pressed
    }

    /// The panels that do not work, the first [`FAULTY`] of them: if there are so many, nothing is known behind the last one.
    pub fn faulty(&self) -> impl Iterator<Item = (usize, Fault)> {
        let faults = (0..self.panels()).filter_map(|panel| Some((panel, self.fault(panel)?)));
        faults.take(FAULTY)
    }

    /// Whether the panels on both sides of one, along a row or along a column, are down.
    fn is_between(&self, down: &Bits, panel: usize) -> bool {
        let columns = usize::from(self.columns).max(1);
        let (column, row) = (panel % columns, panel / columns);
        let both = |step: usize| {
            let before = panel.checked_sub(step);
            before.is_some_and(|before| down.get(before)) && down.get(panel.saturating_add(step))
        };
        let within_row = column > 0 && column + 1 < columns;
        let within_column = row > 0 && row + 1 < usize::from(self.rows);
        (within_row && both(1)) || (within_column && both(columns))
    }
}

#[cfg(test)]
mod tests;
