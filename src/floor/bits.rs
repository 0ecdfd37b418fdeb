//! A bit for each panel of a floor, the lowest bit of a byte first.
//!
//! ```text
//!   byte 0            byte 1
//!   76543210          ……98        panel numbers
//! ```

use super::PANELS;

/// Bytes of the bits of all panels.
const BYTES: usize = PANELS / 8;

/// A bit for each panel.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Bits([u8; BYTES]);

impl Default for Bits {
    fn default() -> Self {
        Self([0; BYTES])
    }
}

impl Bits {
    /// From bytes; what is missing is 0, and what is too much is left out.
    #[must_use]
    pub fn of(bytes: &[u8]) -> Self {
        let mut bits = Self::default();
        bits.0.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        bits
    }

    /// Its bytes for so many panels.
    #[must_use]
    pub fn bytes(&self, panels: usize) -> &[u8] {
        self.0.get(..panels.div_ceil(8)).unwrap_or(&self.0)
    }

    /// One bit; 0 beyond the last.
    #[must_use]
    pub fn get(&self, panel: usize) -> bool {
        self.0.get(panel / 8).is_some_and(|byte| byte >> (panel % 8) & 1 != 0)
    }

    /// Changes one bit; nothing beyond the last.
    pub fn set(&mut self, panel: usize, on: bool) {
        if let Some(byte) = self.0.get_mut(panel / 8) {
            let bit = 1 << (panel % 8);
            *byte = if on { *byte | bit } else { *byte & !bit };
        }
    }
}
