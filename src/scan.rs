//! One revolution of the sensor: ranges, where they point, and when they were measured.
//!
//! ```text
//!                 front step (angle 0, x forward)
//!                      │        beam k covers steps first + k·cluster … + cluster − 1
//!            left (+)  │  right (−)           and points at the middle of them
//!      last step  ╲    │    ╱ first step
//!                  ╲   │   ╱
//!                   ╲  │  ╱      the mirror turns counter-clockwise; step 0 passes at the
//!                    sensor      stamp, step s at stamp + period · s / steps_per_turn
//! ```
//!
//! Source: SCIP 2.0 (C-42-03320B), the `PP` reply and the timing of the measurement commands.

use crate::math;

/// Most beams of any supported sensor: UTM-30LX and UST-10LX, steps 0 to 1080.
pub const MAX_BEAMS: usize = 1081;

/// Range stored for "farther than can be said": ranges are `u16` millimetres, and whatever
/// exceeds 65 534 mm saturates to this value, which every sensor's maximum is below.
pub const NO_RETURN_MM: u16 = u16::MAX;

/// Where the beams of a scan point and how far they reach. Valid by construction.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Geometry {
    first_step: u16,
    last_step: u16,
    cluster: u16,
    front_step: u16,
    steps_per_turn: u16,
    period_us: u32,
    range_min_mm: u16,
    range_max_mm: u16,
}

/// What a [`Geometry`] is made from, as the sensor states it in `PP` and as the scan was asked for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GeometryParts {
    /// First step of the scan (not of the sensor).
    pub first_step: u16,
    /// Last step of the scan, inclusive.
    pub last_step: u16,
    /// Steps joined into one beam, 1 to 99; the sensor sends the smallest range of each group.
    pub cluster: u16,
    /// The step that points forward (`AFRT`).
    pub front_step: u16,
    /// Steps in a full turn (`ARES`).
    pub steps_per_turn: u16,
    /// Time of one revolution in µs (60 000 000 / `SCAN`).
    pub period_us: u32,
    /// Smallest distance (`DMIN`); smaller values are codes.
    pub range_min_mm: u16,
    /// Largest distance (`DMAX`), at most 65 534; larger values are no return.
    pub range_max_mm: u16,
}

/// Why [`GeometryParts`] do not describe a sensor.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum GeometryError {
    /// The last step comes before the first.
    StepsInverted,
    /// A scan of more steps than a full turn has, or a turn of fewer than 64 or more than 14 400 steps.
    StepsPerTurn,
    /// The front step is not on the turn.
    FrontStep,
    /// A cluster of 0 or more than 99 steps.
    Cluster,
    /// A revolution shorter than 1 ms or longer than 10 s.
    Period,
    /// The smallest range is 0, or not below the largest, or the largest is above 65 534 mm.
    RangeLimits,
}

impl core::fmt::Display for GeometryError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::StepsInverted => "the last step comes before the first",
            Self::StepsPerTurn => "impossible number of steps in a turn",
            Self::FrontStep => "the front step lies outside the turn",
            Self::Cluster => "cluster must be 1 to 99 steps",
            Self::Period => "impossible time of a revolution",
            Self::RangeLimits => "impossible range limits",
        })
    }
}

impl core::error::Error for GeometryError {}

impl Geometry {
    /// Checks the parts against each other.
    ///
    /// # Errors
    /// The first [`GeometryError`] that applies, in the order of its variants.
    pub const fn new(parts: GeometryParts) -> Result<Self, GeometryError> {
        let GeometryParts { first_step, last_step, cluster, front_step, .. } = parts;
        let GeometryParts { steps_per_turn, period_us, range_min_mm, range_max_mm, .. } = parts;
        if last_step < first_step {
            return Err(GeometryError::StepsInverted);
        }
        if !matches!(steps_per_turn, 64..=14_400) || last_step - first_step >= steps_per_turn {
            return Err(GeometryError::StepsPerTurn);
        }
        if front_step >= steps_per_turn {
            return Err(GeometryError::FrontStep);
        }
        if !matches!(cluster, 1..=99) {
            return Err(GeometryError::Cluster);
        }
        if !matches!(period_us, 1_000..=10_000_000) {
            return Err(GeometryError::Period);
        }
        if range_min_mm == 0 || range_min_mm >= range_max_mm || range_max_mm == NO_RETURN_MM {
            return Err(GeometryError::RangeLimits);
        }
        Ok(Self {
            first_step,
            last_step,
            cluster,
            front_step,
            steps_per_turn,
            period_us,
            range_min_mm,
            range_max_mm,
        })
    }

    /// The parts this was made from.
    #[must_use]
    pub const fn parts(&self) -> GeometryParts {
        GeometryParts {
            first_step: self.first_step,
            last_step: self.last_step,
            cluster: self.cluster,
            front_step: self.front_step,
            steps_per_turn: self.steps_per_turn,
            period_us: self.period_us,
            range_min_mm: self.range_min_mm,
            range_max_mm: self.range_max_mm,
        }
    }

    /// Beams in a scan: steps divided by the cluster, a last incomplete group included.
    /// A sensor may leave that group out, so a scan may hold one beam less.
    #[must_use]
    pub const fn beams(&self) -> u16 {
        let steps = self.last_step - self.first_step + 1;
        steps.div_ceil(if self.cluster == 0 { 1 } else { self.cluster })
    }

    /// Step in the middle of beam `beam`'s group, in half steps, so that it is exact.
    #[must_use]
    pub const fn half_steps(&self, beam: u16) -> i32 {
        2 * (self.first_step as i32 + beam as i32 * self.cluster as i32) + self.cluster as i32 - 1
    }

    /// First step of beam `beam`.
    #[must_use]
    pub const fn step(&self, beam: u16) -> u16 {
        self.first_step.saturating_add(beam.saturating_mul(self.cluster))
    }

    /// The beam that covers step `step`; the first for steps before it.
    #[must_use]
    pub const fn beam(&self, step: u16) -> u16 {
        step.saturating_sub(self.first_step) / if self.cluster == 0 { 1 } else { self.cluster }
    }

    /// Direction of beam `beam` in the sensor's frame, counter-clockwise, 0 forward.
    #[must_use]
    pub fn bearing_rad(&self, beam: u16) -> f32 {
        (self.half_steps(beam) - 2 * self.front_step as i32) as f32 * (0.5 * self.step_rad())
    }

    /// Angle between neighbouring beams.
    #[must_use]
    pub fn beam_rad(&self) -> f32 {
        self.cluster as f32 * self.step_rad()
    }

    /// Angle between neighbouring steps.
    #[must_use]
    pub fn step_rad(&self) -> f32 {
        math::TAU / f32::from(if self.steps_per_turn == 0 { 1 } else { self.steps_per_turn })
    }

    /// Time from the stamp (step 0) to beam `beam`, in µs.
    #[must_use]
    pub const fn beam_delay_us(&self, beam: u16) -> u32 {
        let turn = if self.steps_per_turn == 0 { 1 } else { self.steps_per_turn as i64 };
        (self.half_steps(beam) as i64 * self.period_us as i64 / (2 * turn)) as u32
    }

    /// Time of one revolution in µs.
    #[must_use]
    pub const fn period_us(&self) -> u32 {
        self.period_us
    }

    /// Steps joined into one beam.
    #[must_use]
    pub const fn cluster(&self) -> u16 {
        self.cluster
    }

    /// What a stored value means.
    #[must_use]
    pub const fn reading(&self, value_mm: u16) -> Reading {
        if value_mm < self.range_min_mm {
            Reading::Code(value_mm)
        } else if value_mm > self.range_max_mm {
            Reading::Beyond
        } else {
            Reading::Range(value_mm)
        }
    }

    /// Smallest distance in mm; smaller values are codes.
    #[must_use]
    pub const fn range_min_mm(&self) -> u16 {
        self.range_min_mm
    }

    /// Largest distance in mm; larger values are no return.
    #[must_use]
    pub const fn range_max_mm(&self) -> u16 {
        self.range_max_mm
    }
}

/// What one beam measured.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Reading {
    /// A distance, within the sensor's limits.
    Range(u16),
    /// Farther than the sensor can say.
    Beyond,
    /// No distance: the sensor's own code (its meaning depends on the model).
    Code(u16),
}

impl Reading {
    /// The distance in mm, if there is one.
    #[must_use]
    pub const fn range_mm(self) -> Option<u16> {
        match self {
            Self::Range(range_mm) => Some(range_mm),
            Self::Beyond | Self::Code(_) => None,
        }
    }
}

/// When a scan was taken. Every field refers to the moment step 0 passed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ScanTime {
    /// The sensor's own stamp in ms, its 24 bits unwrapped; starts anew when the sensor does.
    pub sensor_ms: u64,
    /// The same moment on the module's clock, in µs since boot.
    pub stamp_us: u64,
    /// How far `stamp_us` may be off, in µs.
    pub uncertainty_us: u32,
}

/// One scan, borrowed from the buffer it was decoded into.
#[derive(Clone, Copy, Debug)]
pub struct Scan<'a> {
    /// Where the beams point.
    pub geometry: &'a Geometry,
    /// One stored value a beam, in beam order; see [`Geometry::reading`].
    pub ranges_mm: &'a [u16],
    /// When it was taken.
    pub time: ScanTime,
}

impl<'a> Scan<'a> {
    /// What beam `beam` measured; a beam the scan does not hold reads as code 0.
    #[must_use]
    pub fn reading(&self, beam: usize) -> Reading {
        self.ranges_mm.get(beam).map_or(Reading::Code(0), |&value_mm| self.geometry.reading(value_mm))
    }
}

/// The parameters of a URG-04LX as its `PP` reply states them: 682 steps, 240°, 10 Hz.
pub const URG_04LX: GeometryParts = GeometryParts {
    first_step: 44,
    last_step: 725,
    cluster: 1,
    front_step: 384,
    steps_per_turn: 1024,
    period_us: 100_000,
    range_min_mm: 20,
    range_max_mm: 5600,
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_urg_has_682_beams_and_looks_forward_at_step_384() {
        let urg = Geometry::new(URG_04LX).unwrap();
        assert_eq!(urg.beams(), 682);
        assert_eq!(urg.bearing_rad(340), 0.0);
        assert_eq!(urg.beam_delay_us(340), 37_500);
        assert!(urg.bearing_rad(0) < 0.0);
    }

    #[test]
    fn clustered_beams_point_at_the_middle_of_their_group() {
        let urg = Geometry::new(GeometryParts { cluster: 2, ..URG_04LX }).unwrap();
        assert_eq!(urg.beams(), 341);
        assert_eq!(urg.half_steps(0), 89);
        assert_eq!(urg.step(1), 46);
        assert_eq!((urg.beam(43), urg.beam(45), urg.beam(46)), (0, 0, 1));
    }

    #[test]
    fn impossible_geometries_are_refused_by_name() {
        let refused = |parts| Geometry::new(parts).unwrap_err();
        assert_eq!(refused(GeometryParts { last_step: 3, ..URG_04LX }), GeometryError::StepsInverted);
        assert_eq!(refused(GeometryParts { steps_per_turn: 0, ..URG_04LX }), GeometryError::StepsPerTurn);
        assert_eq!(refused(GeometryParts { steps_per_turn: 600, ..URG_04LX }), GeometryError::StepsPerTurn);
        assert_eq!(refused(GeometryParts { front_step: 1024, ..URG_04LX }), GeometryError::FrontStep);
        assert_eq!(refused(GeometryParts { cluster: 0, ..URG_04LX }), GeometryError::Cluster);
        assert_eq!(refused(GeometryParts { period_us: 0, ..URG_04LX }), GeometryError::Period);
        assert_eq!(refused(GeometryParts { range_min_mm: 0, ..URG_04LX }), GeometryError::RangeLimits);
        assert_eq!(refused(GeometryParts { range_max_mm: 20, ..URG_04LX }), GeometryError::RangeLimits);
    }

    #[test]
    fn small_values_are_codes_and_large_ones_no_return() {
        let urg = Geometry::new(URG_04LX).unwrap();
        assert_eq!(urg.reading(19), Reading::Code(19));
        assert_eq!(urg.reading(20), Reading::Range(20));
        assert_eq!(urg.reading(5600), Reading::Range(5600));
        assert_eq!(urg.reading(5601), Reading::Beyond);
        assert_eq!(urg.reading(NO_RETURN_MM), Reading::Beyond);
    }
}
