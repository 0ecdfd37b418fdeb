//! What the camera sees without people: the median of 30 frames, pixel by pixel.
//!
//! ```text
//!   pixel   3012  0  3010  3011  0  3013 …     values that are missing now and then fill up from the others
//!           └───── median of those measured ─────▶ 3012;   never measured: unknown
//! ```

use crate::frame::{Frame, MISSING, is_measured};

/// Frames a background is made of, after the paper: an odd flaw in a few of them does not move the median.
pub const FRAMES: usize = 30;

/// The scene without people.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Background {
    width: usize,
    depth_mm: Vec<u16>,
    /// In how many of the [`FRAMES`] each pixel was measured.
    seen: Vec<u8>,
}

impl Background {
    /// Depth of a pixel in mm; None where nothing ever came back.
    #[must_use]
    pub fn depth_mm(&self, column: usize, row: usize) -> Option<u16> {
        let value_mm = *self.depth_mm.get(row * self.width + column)?;
        is_measured(value_mm).then_some(value_mm)
    }

    /// The background as a frame: [`MISSING`] where nothing ever came back; and in how many of the [`FRAMES`] each pixel was
    /// measured.
    pub fn pixels(&self) -> impl Iterator<Item = (u16, u8)> + '_ {
        self.depth_mm.iter().copied().zip(self.seen.iter().copied())
    }
}

/// Collects frames until there are [`FRAMES`].
#[derive(Clone, Debug, Default)]
pub struct Learner {
    frames: Vec<Frame>,
}

impl Learner {
    /// Takes a frame without people; the background once there are enough. Frames of another size than the first
    /// are left out.
    pub fn push(&mut self, frame: Frame) -> Option<Background> {
        let fits = self
            .frames
            .first()
            .is_none_or(|first| (first.width(), first.height()) == (frame.width(), frame.height()));
        if fits {
            self.frames.push(frame);
        }
        if self.frames.len() < FRAMES {
            return None;
        }
        let frames = std::mem::take(&mut self.frames);
        Some(of(&frames))
    }

    /// Frames still wanted.
    #[must_use]
    pub fn wanted(&self) -> usize {
        FRAMES.saturating_sub(self.frames.len())
    }
}

fn of(frames: &[Frame]) -> Background {
    let (width, pixels) = frames.first().map_or((1, 0), |frame| (frame.width(), frame.depth_mm().len()));
    let mut values = Vec::with_capacity(frames.len());
    let median = (0..pixels)
        .map(|pixel| {
            values.clear();
            let measured = frames.iter().filter_map(|frame| frame.depth_mm().get(pixel).copied());
            values.extend(measured.filter(|&value_mm| is_measured(value_mm)));
            values.sort_unstable();
            let seen = u8::try_from(values.len()).unwrap_or(u8::MAX);
            (values.get(values.len() / 2).copied().unwrap_or(MISSING), seen)
        })
        .unzip();
    let (depth_mm, seen) = median;
    Background { width, depth_mm, seen }
}

#[cfg(test)]
pub(crate) fn still(width: usize, depth_mm: Vec<u16>) -> Background {
    let seen =
        depth_mm.iter().map(|value_mm| if is_measured(*value_mm) { FRAMES as u8 } else { 0 }).collect();
    Background { width, depth_mm, seen }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_ignores_what_is_missing_and_what_passes() {
        let mut learner = Learner::default();
        let mut learned = None;
        for n in 0..FRAMES {
            assert!(learned.is_none());
            assert_eq!(learner.wanted(), FRAMES - n);
            // Missing two times of three; something in front in a third of the frames; never seen.
            let values = vec![if n % 3 == 0 { 3000 } else { 0 }, if n % 3 == 0 { 900 } else { 2500 }, 0];
            learned = learner.push(Frame::new(3, 1, values, 0).unwrap());
        }
        let background = learned.unwrap();
        let depths = [0, 1, 2].map(|column| background.depth_mm(column, 0));
        assert_eq!(depths, [Some(3000), Some(2500), None]);
        assert_eq!(background.depth_mm(0, 1), None);
    }

    #[test]
    fn frames_of_another_size_are_left_out() {
        let mut learner = Learner::default();
        learner.push(Frame::new(3, 1, vec![1; 3], 0).unwrap());
        learner.push(Frame::new(1, 3, vec![1; 3], 0).unwrap());
        assert_eq!(learner.wanted(), FRAMES - 1);
    }
}
