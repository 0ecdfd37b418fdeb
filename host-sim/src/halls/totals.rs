//! Two totals side by side, and both against the truth.
//!
//! ```text
//!   one tracker   8 8 8 8 8 8        they differ for two frames: 0.2 s, by 1
//!   the site      8 8 9 9 8 8
//! ```

/// A time between two pictures, s.
const EVERY_S: f64 = 0.1;

/// Sums over pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Totals {
    /// Pictures.
    pub frames: u64,
    /// Those in which the two differ; or one is not known.
    pub different: u64,
    /// For so many pictures in a row, at most.
    pub longest: u64,
    /// By so many people, at most.
    pub most: u32,
    /// Pictures in which the one, and the other, is as many as there are.
    pub right: [u64; 2],
    /// Those in which the other is not, while the one is.
    pub worse: u64,
    /// For so many pictures in a row, at most.
    pub longest_worse: u64,
    row: u64,
    row_worse: u64,
}

impl Totals {
    /// Takes both totals, and how many there are.
    pub fn frame(&mut self, [one, other]: [Option<u32>; 2], people: u32) {
        self.frames += 1;
        for (right, said) in self.right.iter_mut().zip([one, other]) {
            *right += u64::from(said == Some(people));
        }
        let is_worse = one == Some(people) && other != one;
        self.worse += u64::from(is_worse);
        self.row_worse = if is_worse { self.row_worse + 1 } else { 0 };
        self.longest_worse = self.longest_worse.max(self.row_worse);
        if one == other {
            self.row = 0;
            return;
        }
        self.different += 1;
        self.row += 1;
        self.longest = self.longest.max(self.row);
        let by = one.zip(other).map_or(people, |(one, other)| one.abs_diff(other));
        self.most = self.most.max(by);
    }

    /// Adds another run.
    pub fn add(&mut self, other: &Self) {
        self.frames += other.frames;
        self.different += other.different;
        self.longest = self.longest.max(other.longest);
        self.most = self.most.max(other.most);
        self.worse += other.worse;
        self.longest_worse = self.longest_worse.max(other.longest_worse);
        self.right[0] += other.right[0];
        self.right[1] += other.right[1];
    }

    /// The longest time during which they differed, s.
    #[must_use]
    pub fn longest_s(&self) -> f64 {
        self.longest as f64 * EVERY_S
    }

    /// The longest time during which only the one was right, s.
    #[must_use]
    pub fn longest_worse_s(&self) -> f64 {
        self.longest_worse as f64 * EVERY_S
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_is_counted_by_pictures_rows_and_people() {
        let mut totals = Totals::default();
        for (one, other) in [(3, 3), (3, 4), (3, 5), (3, 3), (2, 3)] {
            totals.frame([Some(one), Some(other)], 3);
        }
        totals.frame([Some(3), None], 3);
        assert_eq!((totals.frames, totals.different, totals.longest, totals.most), (6, 4, 2, 3));
        assert_eq!(totals.right, [5, 3]);
        // When the one said 2, it was the one that was wrong.
        assert_eq!((totals.worse, totals.longest_worse), (3, 2));
    }
}
