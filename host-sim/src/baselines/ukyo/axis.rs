//! A constant-velocity Kalman filter of one coordinate: the paper's six states are three of them, which nothing couples.

/// Deviation of a measured coordinate, m, and spectral density of a walker's acceleration, m²/s³.
const MEASURED_M: f64 = 0.05;
const PROCESS_NOISE: f64 = 2.0;

/// Variance of an unknown speed, m²/s².
const UNKNOWN_SPEED: f64 = 1.0;

/// Place and speed with their covariance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    pub(super) place: f64,
    speed: f64,
    /// Place, both, speed.
    covariance: [f64; 3],
}

impl Axis {
    pub(super) const fn new(place: f64) -> Self {
        Self { place, speed: 0.0, covariance: [MEASURED_M * MEASURED_M, 0.0, UNKNOWN_SPEED] }
    }

    pub(super) fn predict(&mut self, step_s: f64) {
        let [place, both, speed] = self.covariance;
        self.place += step_s * self.speed;
        self.covariance = [
            place + 2.0 * step_s * both + step_s * step_s * speed + PROCESS_NOISE * step_s.powi(3) / 3.0,
            both + step_s * speed + PROCESS_NOISE * step_s * step_s / 2.0,
            speed + PROCESS_NOISE * step_s,
        ];
    }

    /// Takes a measurement; `trust` multiplies the gain.
    pub(super) fn update(&mut self, measured: f64, trust: f64) {
        let [place, both, speed] = self.covariance;
        let sum = place + MEASURED_M * MEASURED_M;
        let (gain, lead) = (trust * place / sum, trust * both / sum);
        let off = measured - self.place;
        self.place += gain * off;
        self.speed += lead * off;
        // Joseph's form: the gain is not the best one.
        let noise = MEASURED_M * MEASURED_M;
        self.covariance = [
            (1.0 - gain) * (1.0 - gain) * place + gain * gain * noise,
            (1.0 - gain) * (both - lead * place) + gain * lead * noise,
            speed - 2.0 * lead * both + lead * lead * sum,
        ];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn followed(trust: f64, steps: u8) -> Axis {
        let mut axis = Axis::new(0.0);
        for step in 1..=steps {
            axis.predict(0.2);
            axis.update(f64::from(step) * 0.2, trust);
        }
        axis
    }

    #[test]
    fn a_walker_is_followed_and_the_less_so_the_less_is_seen() {
        let known = followed(1.0, 10);
        assert!((known.place - 2.0).abs() < 0.03 && (known.speed - 1.0).abs() < 0.05);
        let (whole, part) = (followed(1.0, 1), followed(0.3, 1));
        assert!(part.place < whole.place && part.covariance[0] > whole.covariance[0]);
    }
}
