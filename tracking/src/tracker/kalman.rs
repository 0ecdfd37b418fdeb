//! Motion of a person: constant velocity with white acceleration as process noise; a Kalman filter (Lee et al. 2006,
//! eq. 1–5; docs/bibliography.md, A).
//!
//! ```text
//!   state (x, y, vx, vy)      x ← F x,  P ← F P Fᵀ + Q        P: covariance, Q: process noise between scans
//!                             measured: x, y with covariance R
//! ```
//!
//! A report may arrive after a younger one (out of sequence). It is used where it belongs: the state is compared as it
//! was then, with the process noise of the time between added to the measurement's covariance.

use nalgebra::{Matrix2, Matrix2x4, Matrix4, Vector2, Vector4};

use crate::geometry::Point;

/// Process noise: spectral density of a pedestrian's acceleration, m²/s³: a person turns or stops within half a second.
pub const PROCESS_NOISE: f64 = 0.4;

/// Place and velocity with their covariance, at a time.
#[derive(Clone, Debug)]
pub struct Kinematics {
    /// Time of the state, s on the host's clock.
    pub at_s: f64,
    /// x, y, vx, vy.
    pub mean: Vector4<f64>,
    /// Its covariance.
    pub covariance: Matrix4<f64>,
    /// Spectral density of the acceleration, m²/s³.
    pub process_noise: f64,
}

impl Kinematics {
    /// A track with a known position and an unknown velocity.
    #[must_use]
    pub fn new(
        at_s: f64,
        place: Vector2<f64>,
        spread: &Matrix2<f64>,
        speed_mps: f64,
        process_noise: f64,
    ) -> Self {
        let mut covariance = Matrix4::zeros();
        covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(spread);
        covariance[(2, 2)] = speed_mps * speed_mps;
        covariance[(3, 3)] = speed_mps * speed_mps;
        Self { at_s, mean: Vector4::new(place.x, place.y, 0.0, 0.0), covariance, process_noise }
    }

    /// Place at `at_s`, in the future or the past.
    #[must_use]
    pub fn place(&self, at_s: f64) -> Point {
        let step_s = at_s - self.at_s;
        Point::new(self.mean[0] + step_s * self.mean[2], self.mean[1] + step_s * self.mean[3])
    }

    /// Velocity, m/s.
    #[must_use]
    pub fn velocity(&self) -> Point {
        Point::new(self.mean[2], self.mean[3])
    }

    /// Covariance of the place at `at_s`, m².
    #[must_use]
    pub fn spread(&self, at_s: f64) -> Matrix2<f64> {
        let step_s = at_s - self.at_s;
        let [places, speeds] = self.cross_covariances(step_s);
        places + speeds * step_s + noise_place(step_s, self.process_noise)
    }

    /// Covariances of the place `step_s` later, or before, with the state's place and with its velocity.
    fn cross_covariances(&self, step_s: f64) -> [Matrix2<f64>; 2] {
        let block = |row, column| self.covariance.fixed_view::<2, 2>(row, column);
        [block(0, 0) + block(2, 0) * step_s, block(0, 2) + block(2, 2) * step_s]
    }

    /// Lets time pass; a time before the state's own does nothing.
    pub fn predict(&mut self, at_s: f64) {
        let step_s = at_s - self.at_s;
        if step_s <= 0.0 {
            return;
        }
        // F P Fᵀ block by block: F is the identity, and `step_s` from the velocity to the place.
        let place = self.place(at_s);
        (self.mean[0], self.mean[1]) = (place.x, place.y);
        let [places, speeds] = self.cross_covariances(step_s);
        let speed = self.covariance.fixed_view::<2, 2>(2, 2);
        let back = self.covariance.fixed_view::<2, 2>(2, 0) + speed * step_s;
        self.covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&(places + speeds * step_s));
        self.covariance.fixed_view_mut::<2, 2>(0, 2).copy_from(&speeds);
        self.covariance.fixed_view_mut::<2, 2>(2, 0).copy_from(&back);
        let (place, cross, speed) = (
            self.process_noise * step_s * step_s * step_s / 3.0,
            self.process_noise * step_s * step_s / 2.0,
            self.process_noise * step_s,
        );
        for axis in 0..2 {
            self.covariance[(axis, axis)] += place;
            self.covariance[(axis, axis + 2)] += cross;
            self.covariance[(axis + 2, axis)] += cross;
            self.covariance[(axis + 2, axis + 2)] += speed;
        }
        self.at_s = at_s;
    }

    /// Stops the track at `at_s`: from then on it stays where it is.
    pub fn stop(&mut self, at_s: f64) {
        self.predict(at_s);
        self.mean[2] = 0.0;
        self.mean[3] = 0.0;
    }

    /// Squared Mahalanobis distance of a measurement at `at_s`, and the logarithm of its covariance's determinant.
    #[must_use]
    pub fn distance(&self, at_s: f64, place: Vector2<f64>, noise: &Matrix2<f64>) -> (f64, f64) {
        let expected = self.place(at_s);
        let off = place - Vector2::new(expected.x, expected.y);
        let spread = self.spread(at_s) + noise;
        let Some(inverse) = spread.try_inverse() else { return (f64::INFINITY, 0.0) };
        ((off.transpose() * inverse * off)[(0, 0)], libm::log(spread.determinant()))
    }

    /// Takes a measured place.
    pub fn update(&mut self, at_s: f64, place: Vector2<f64>, noise: &Matrix2<f64>) {
        self.predict(at_s);
        let step_s = at_s - self.at_s;
        let noise = noise + noise_place(step_s, self.process_noise);
        let [places, speeds] = self.cross_covariances(step_s);
        let spread = places + speeds * step_s + noise;
        let Some(inverse) = spread.try_inverse() else { return };
        let look = look(step_s);
        let columns = |column| self.covariance.fixed_view::<4, 2>(0, column);
        let gain = (columns(0) + columns(2) * step_s) * inverse;
        let expected = self.place(at_s);
        self.mean += gain * (place - Vector2::new(expected.x, expected.y));
        // Joseph's form: stays symmetric and positive.
        let rest = Matrix4::identity() - gain * look;
        self.covariance = rest * self.covariance * rest.transpose() + gain * noise * gain.transpose();
    }
}

/// What the place was a time before the state's own.
fn look(step_s: f64) -> Matrix2x4<f64> {
    Matrix2x4::new(1.0, 0.0, step_s, 0.0, 0.0, 1.0, 0.0, step_s)
}

fn noise_place(step_s: f64, process_noise: f64) -> Matrix2<f64> {
    let step_s = step_s.abs();
    Matrix2::identity() * (process_noise * step_s * step_s * step_s / 3.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walker() -> Kinematics {
        let mut walker = Kinematics::new(0.0, Vector2::zeros(), &(Matrix2::identity() * 0.01), 1.0, 1.0);
        for step in 1..40 {
            let at_s = f64::from(step) * 0.05;
            walker.update(at_s, Vector2::new(at_s, -0.5 * at_s), &(Matrix2::identity() * 0.0009));
        }
        walker
    }

    #[test]
    fn a_walker_is_followed() {
        let walker = walker();
        assert!((walker.velocity() - Point::new(1.0, -0.5)).length() < 0.1);
        assert!((walker.place(2.5) - Point::new(2.5, -1.25)).length() < 0.1);
    }

    #[test]
    fn a_late_measurement_is_compared_with_the_past() {
        let mut walker = walker();
        let before = walker.clone();
        walker.update(1.9, Vector2::new(1.9, -0.95), &(Matrix2::identity() * 0.0009));
        assert_eq!(walker.at_s, before.at_s);
        assert!((walker.place(1.95) - before.place(1.95)).length() < 0.01);
        assert!(walker.covariance.trace() < before.covariance.trace());
    }
}
