//! What a value below `DMIN` means. It is a code, not a distance, and the meaning depends on the model.
//!
//! ```text
//!   0 ……… DMIN ……………………………… DMAX ………
//!   codes  │   distances, mm    │  no return
//! ```
//!
//! Source: SCIP 2.0 (C-42-03320B) p. 12, whose table covers the phase-measuring sensors and the
//! UTM-30LX. For other models no table is known: every code reads [`RangeCode::Other`].

/// Sensors that share a table of codes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Family {
    /// URG-04LX, UBG-04LX-F01, UHG-08LX: distance from the phase of two modulated waves.
    Phase,
    /// UTM-30LX and its kin: distance from the time of flight.
    Utm,
    /// Any other model.
    #[default]
    Other,
}

impl Family {
    /// The family of a sensor by the start of its `MODL` text.
    #[must_use]
    pub fn of_model(model: &[u8]) -> Self {
        let is = |name: &[u8]| model.starts_with(name);
        if is(b"URG-04LX") || is(b"UBG-04LX") || is(b"UHG-08LX") {
            Self::Phase
        } else if is(b"UTM-30LX") {
            Self::Utm
        } else {
            Self::Other
        }
    }
}

/// Why a beam has no distance.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RangeCode {
    /// An object possibly near 22 m, where the two waves agree again.
    Ambiguous,
    /// Too little light came back.
    LowReflection,
    /// The neighbouring steps are bad.
    NeighboursBad,
    /// The two waves came back with different strength.
    WavesDiffer,
    /// This step was bad in the last two scans.
    BadTwice,
    /// Possibly farther than 12 bits can say.
    BeyondTwelveBits,
    /// A strong reflector.
    StrongReflector,
    /// This step cannot be measured: it lies outside `AMIN` to `AMAX`.
    NotMeasured,
    /// Nothing in range.
    NoObject,
    /// An object nearer than can be measured.
    TooNear,
    /// Measurement error, perhaps interference.
    Interference,
    /// Out of range at the near end.
    OutOfRangeNear,
    /// A code without a stated meaning.
    Other,
}

impl RangeCode {
    /// The meaning of `code`, a value below `DMIN`, for a sensor of `family`.
    #[must_use]
    pub const fn new(family: Family, code: u16) -> Self {
        match (family, code) {
            (Family::Phase, 0) => Self::Ambiguous,
            (Family::Phase, 1..=5) => Self::LowReflection,
            (Family::Phase, 7) => Self::NeighboursBad,
            (Family::Phase, 8) => Self::WavesDiffer,
            (Family::Phase, 9) => Self::BadTwice,
            (Family::Phase, 16) => Self::BeyondTwelveBits,
            (Family::Phase, 18) => Self::StrongReflector,
            (Family::Phase, 19) => Self::NotMeasured,
            (Family::Utm, 1) => Self::NoObject,
            (Family::Utm, 2) => Self::TooNear,
            (Family::Utm, 3) => Self::Interference,
            (Family::Utm, 4) => Self::OutOfRangeNear,
            _ => Self::Other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_code_means_different_things_to_different_families() {
        assert_eq!(RangeCode::new(Family::Phase, 1), RangeCode::LowReflection);
        assert_eq!(RangeCode::new(Family::Utm, 1), RangeCode::NoObject);
        assert_eq!(RangeCode::new(Family::Other, 1), RangeCode::Other);
        assert_eq!(RangeCode::new(Family::Phase, 19), RangeCode::NotMeasured);
        assert_eq!(RangeCode::new(Family::Utm, 19), RangeCode::Other);
    }

    #[test]
    fn models_find_their_family() {
        assert_eq!(Family::of_model(b"URG-04LX(Hokuyo Automatic Co.,Ltd.)"), Family::Phase);
        assert_eq!(Family::of_model(b"UTM-30LX-EW"), Family::Utm);
        assert_eq!(Family::of_model(b"UST-10LX"), Family::Other);
        assert_eq!(Family::of_model(b""), Family::Other);
    }
}
