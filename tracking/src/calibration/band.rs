//! Equations in which every unknown meets only its neighbours: Cholesky's decomposition of a band.
//!
//! ```text
//!   ▓▓▓             only BAND numbers a row are kept: a walk of three minutes has 1500 unknowns,
//!   ▓▓▓▓            and is solved in a fraction of a millisecond
//!   ▓▓▓▓▓
//!     ▓▓▓▓▓
//! ```

/// Numbers kept a row: four control points of two coordinates each, the diagonal included.
pub const BAND: usize = 8;

/// A symmetric matrix that is 0 beyond [`BAND`]; its lower half.
#[derive(Clone, Debug)]
pub struct Band {
    /// Row by row: entry `k` is the element `k` columns left of the diagonal.
    rows: Vec<[f64; BAND]>,
}

impl Band {
    /// All zero.
    pub fn new(size: usize) -> Self {
        Self { rows: vec![[0.0; BAND]; size] }
    }

    /// Adds to an element of the lower half; what lies beyond the band is none of it.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        let Some(back) = row.checked_sub(column) else { return };
        if let Some(element) = self.rows.get_mut(row).and_then(|row| row.get_mut(back)) {
            *element += value;
        }
    }

    /// Its Cholesky factor; None if it is not positive.
    pub fn factor(mut self) -> Option<Factor> {
        for row in 0..self.rows.len() {
            let reach = row.min(BAND - 1);
            for back in (0..=reach).rev() {
                let column = row - back;
                let mut value = self.rows[row][back];
                for left in column.saturating_sub(BAND - 1).max(row - reach)..column {
                    value -= self.rows[row][row - left] * self.rows[column][column - left];
                }
                self.rows[row][back] = if back == 0 {
                    if value <= 0.0 || !value.is_finite() {
                        return None;
                    }
                    value.sqrt()
                } else {
                    value / self.rows[column][0]
                };
            }
        }
        Some(Factor { rows: self.rows })
    }
}

/// The lower factor L of a matrix L·Lᵀ.
#[derive(Clone, Debug)]
pub struct Factor {
    rows: Vec<[f64; BAND]>,
}

impl Factor {
    /// Solves L·Lᵀ·x = b in place.
    pub fn solve(&self, values: &mut [f64]) {
        let size = self.rows.len().min(values.len());
        for row in 0..size {
            let mut value = values[row];
            for back in 1..=row.min(BAND - 1) {
                value -= self.rows[row][back] * values[row - back];
            }
            values[row] = value / self.rows[row][0];
        }
        for row in (0..size).rev() {
            let mut value = values[row];
            for ahead in 1..BAND.min(size - row) {
                value -= self.rows[row + ahead][ahead] * values[row + ahead];
            }
            values[row] = value / self.rows[row][0];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_is_solved_as_the_whole_matrix_is() {
        let size = 30;
        let mut band = Band::new(size);
        let mut whole = nalgebra::DMatrix::<f64>::zeros(size, size);
        for row in 0..size {
            for column in row.saturating_sub(BAND - 1)..=row {
                let value = if row == column { 9.0 } else { libm::sin((row * 7 + column) as f64) };
                band.add(row, column, value);
                (whole[(row, column)], whole[(column, row)]) = (value, value);
            }
        }
        let mut values: Vec<f64> = (0..size).map(|row| libm::cos(row as f64)).collect();
        let expected = whole.cholesky().unwrap().solve(&nalgebra::DVector::from_vec(values.clone()));
        band.factor().unwrap().solve(&mut values);
        for (value, expected) in values.iter().zip(expected.iter()) {
            assert!((value - expected).abs() < 1e-12, "{value} {expected}");
        }
    }

    #[test]
    fn what_is_not_positive_has_no_factor() {
        let mut band = Band::new(2);
        band.add(0, 0, 1.0);
        band.add(1, 0, 2.0);
        band.add(1, 1, 1.0);
        assert!(band.factor().is_none());
    }
}
