//! The pipeline's settings: of all sensors, and by model.

use crate::background::{LEARN_SCANS, LearnRequest};
use crate::sensor_model::SensorModel;

/// The pipeline's settings, beside the geometry.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    /// How a background is learned when there is none: by itself, with the first scan.
    pub learn: LearnRequest,
    /// Range at which the model still sees black clothing (10 % reflectance), mm: an open beam is
    /// seen empty no farther.
    pub open_range_mm: u16,
    /// The least code of the model that says nothing of a step: beams that show only such codes while
    /// the background is learned stay unknown.
    pub blind_code: Option<u16>,
    /// Least spread a learned beam is given, mm: what is nearer than the background by
    /// [`FOREGROUND_SPREADS`](crate::background::FOREGROUND_SPREADS) of these is foreground.
    pub spread_min_mm: u8,
}

impl Settings {
    /// For a URG-04LX.
    pub const URG_04LX: Self = Self::of(&SensorModel::URG_04LX, 5600);

    /// For a UHG-08LX.
    pub const UHG_08LX: Self = Self::of(&SensorModel::UHG_08LX, 11_000);

    /// For a UTM-30LX.
    pub const UTM_30LX: Self = Self::of(&SensorModel::UTM_30LX, 60_000);

    /// For a UST-10LX.
    pub const UST_10LX: Self = Self::of(&SensorModel::UST_10LX, 30_000);

    /// For a sensor of this model that states a `DMAX` of `range_max_mm`.
    #[must_use]
    pub const fn of(model: &SensorModel, range_max_mm: u16) -> Self {
        Self {
            learn: LearnRequest { scans: LEARN_SCANS, even_if_moving: false },
            open_range_mm: model.open_range_mm(range_max_mm),
            blind_code: model.blind_code,
            spread_min_mm: 0,
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self::URG_04LX
    }
}
