//! A depth image.
//!
//! ```text
//!   column 0 ──────▶ width − 1
//!   row 0   ┌──────────────┐   a value: distance along the optical axis, mm
//!     │     │ 0  2310 2312 │            0: nothing came back, which says nothing
//!     ▼     │ …            │
//!   height−1└──────────────┘
//! ```

/// The value of a pixel without a measurement.
pub const MISSING: u16 = 0;

/// What some cameras write into every pixel that is too bright or too far.
const SATURATED: u16 = u16::MAX;

/// One image of a depth camera.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Frame {
    width: usize,
    height: usize,
    depth_mm: Vec<u16>,
    /// When it was taken, µs since the source began.
    pub stamp_us: u64,
}

/// Why an image says nothing at all.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum Blind {
    /// No pixel has a measurement.
    #[error("no pixel has a depth; is the lens covered, or the projector off?")]
    AllMissing,
    /// Every pixel is at the end of the scale.
    #[error("every pixel is at the end of the scale; is the camera in full sun?")]
    Saturated,
}

impl Frame {
    /// An image of these values, row by row; None if there are not `width · height` of them, or none at all.
    #[must_use]
    pub fn new(width: usize, height: usize, depth_mm: Vec<u16>, stamp_us: u64) -> Option<Self> {
        let pixels = width.checked_mul(height)?;
        let fits = pixels > 0 && depth_mm.len() == pixels;
        fits.then_some(Self { width, height, depth_mm, stamp_us })
    }

    /// An image in which nothing was seen: what stands for one that could not be read.
    #[must_use]
    pub fn unseen(width: usize, height: usize, stamp_us: u64) -> Self {
        Self { width, height, depth_mm: vec![MISSING; width * height], stamp_us }
    }

    /// Columns.
    #[must_use]
    pub const fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    #[must_use]
    pub const fn height(&self) -> usize {
        self.height
    }

    /// All values in mm, row by row; [`is_measured`] says which are depths.
    #[must_use]
    pub fn depth_mm(&self) -> &[u16] {
        &self.depth_mm
    }

    /// Column, row and depth in mm of every pixel that has a measurement.
    pub fn measured(&self) -> impl Iterator<Item = (usize, usize, u16)> + '_ {
        let seen = self.depth_mm.iter().enumerate().filter(|&(_, &value_mm)| is_measured(value_mm));
        seen.map(|(index, &value_mm)| (index % self.width, index / self.width, value_mm))
    }

    /// Why nothing was seen, if nothing was. It does not mean that nothing is there.
    #[must_use]
    pub fn blind(&self) -> Option<Blind> {
        let all = |value_mm| self.depth_mm.iter().all(|&value| value == value_mm);
        if all(MISSING) {
            Some(Blind::AllMissing)
        } else if all(SATURATED) {
            Some(Blind::Saturated)
        } else {
            None
        }
    }
}

/// Whether a value is a depth.
#[must_use]
pub const fn is_measured(value_mm: u16) -> bool {
    value_mm != MISSING && value_mm != SATURATED
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_has_as_many_values_as_pixels() {
        assert_eq!(Frame::new(2, 2, vec![1; 3], 0), None);
        assert_eq!(Frame::new(0, 2, vec![], 0), None);
        assert_eq!(Frame::new(usize::MAX, 2, vec![1; 3], 0), None);
        let frame = Frame::new(2, 2, vec![1, 0, 3, SATURATED], 0).unwrap();
        assert_eq!(frame.measured().collect::<Vec<_>>(), [(0, 0, 1), (0, 1, 3)]);
        assert_eq!(frame.blind(), None);
    }

    #[test]
    fn a_blind_frame_says_why_and_measures_nothing() {
        let frame = |value_mm| Frame::new(3, 1, vec![value_mm; 3], 0).unwrap();
        assert_eq!(frame(MISSING).blind(), Some(Blind::AllMissing));
        assert_eq!(frame(SATURATED).blind(), Some(Blind::Saturated));
        assert_eq!(frame(SATURATED).measured().count(), 0);
        assert_eq!(Frame::unseen(3, 1, 0).blind(), Some(Blind::AllMissing));
    }
}
