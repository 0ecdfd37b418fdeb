//! What a sensor can measure: the `PP` reply, by key.
//!
//! ```text
//!   PP \n 0 0 P \n                          lines in any order, unknown keys passed over
//!   MODL:URG-04LX(Hokuyo Automatic Co.,Ltd.);N \n
//!   DMIN:20;4 \n    DMAX:5600;_ \n          mm
//!   ARES:1024;\ \n                          steps in a turn
//!   AMIN:44;7 \n    AMAX:725;o \n           first and last step that can be measured
//!   AFRT:384;6 \n                           the step that points forward
//!   SCAN:600;e \n \n                        turns per minute
//! ```
//!
//! Source: SCIP 2.0 (C-42-03320B), `PP`; recorded replies of three models.

use super::{command::Measurement, command::Width, text::Text};
use crate::scan::{Geometry, GeometryError, GeometryParts, NO_RETURN_MM};

/// The values of a `PP` reply, as stated: nothing here is checked against anything else, see
/// [`geometry`](Self::geometry).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Parameters {
    /// `MODL` up to the bracket, for example `UTM-30LX`; empty when not stated.
    pub model: Text<16>,
    /// `DMIN`, mm; smaller values are codes.
    pub range_min_mm: u32,
    /// `DMAX`, mm.
    pub range_max_mm: u32,
    /// `ARES`, steps in a turn.
    pub steps_per_turn: u16,
    /// `AMIN`, first step that can be measured; 0 on many models.
    pub first_step: u16,
    /// `AMAX`, last step that can be measured.
    pub last_step: u16,
    /// `AFRT`, the step that points forward.
    pub front_step: u16,
    /// `SCAN`, turns per minute.
    pub speed_rpm: u16,
}

impl Parameters {
    /// An endless measurement of every step this sensor can measure.
    #[must_use]
    pub const fn measure_all(&self, cluster: u8, width: Width) -> Measurement {
        let &Self { first_step, last_step, .. } = self;
        Measurement { first_step, last_step, cluster, skip: 0, scans: 0, width }
    }

    /// Where the beams of `measurement` point and how far they reach. A `DMAX` above 65 534 mm
    /// counts as 65 534 mm, the largest range that is stored.
    ///
    /// # Errors
    /// The values do not describe a sensor, or the measurement does not lie on its turn.
    pub fn geometry(&self, measurement: &Measurement) -> Result<Geometry, GeometryError> {
        let largest = u32::from(NO_RETURN_MM) - 1;
        let range_max_mm = u16::try_from(self.range_max_mm.min(largest)).unwrap_or(0);
        let range_min_mm = u16::try_from(self.range_min_mm).unwrap_or(0);
        Geometry::new(GeometryParts {
            first_step: measurement.first_step,
            last_step: measurement.last_step,
            cluster: measurement.cluster.into(),
            front_step: self.front_step,
            steps_per_turn: self.steps_per_turn,
            period_us: 60_000_000u32.checked_div(self.speed_rpm.into()).unwrap_or(0),
            range_min_mm,
            range_max_mm,
        })
    }
}

/// A `PP` reply as far as it has come in.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct PartialParameters {
    model: Text<16>,
    range_min_mm: Option<u32>,
    range_max_mm: Option<u32>,
    steps_per_turn: Option<u16>,
    first_step: Option<u16>,
    last_step: Option<u16>,
    front_step: Option<u16>,
    speed_rpm: Option<u16>,
}

impl PartialParameters {
    pub(super) const NONE: Self = Self {
        model: Text::EMPTY,
        range_min_mm: None,
        range_max_mm: None,
        steps_per_turn: None,
        first_step: None,
        last_step: None,
        front_step: None,
        speed_rpm: None,
    };

    /// Takes one line, `KEY:VALUE`. A value that is not a number leaves its key unstated.
    pub(super) fn set_field(&mut self, key: &[u8], value: &[u8]) {
        match key {
            b"MODL" => {
                let end = value.iter().position(|&c| c == b'(').unwrap_or(value.len());
                self.model = Text::new(value.get(..end).unwrap_or(value));
            }
            b"DMIN" => self.range_min_mm = number(value),
            b"DMAX" => self.range_max_mm = number(value),
            b"ARES" => self.steps_per_turn = step(value),
            b"AMIN" => self.first_step = step(value),
            b"AMAX" => self.last_step = step(value),
            b"AFRT" => self.front_step = step(value),
            b"SCAN" => self.speed_rpm = step(value),
            _ => {}
        }
    }

    /// The whole, once all seven numbers are there.
    pub(super) fn complete(&self) -> Option<Parameters> {
        Some(Parameters {
            model: self.model,
            range_min_mm: self.range_min_mm?,
            range_max_mm: self.range_max_mm?,
            steps_per_turn: self.steps_per_turn?,
            first_step: self.first_step?,
            last_step: self.last_step?,
            front_step: self.front_step?,
            speed_rpm: self.speed_rpm?,
        })
    }
}

/// A decimal number of up to nine digits and nothing else.
pub(super) fn number(text: &[u8]) -> Option<u32> {
    if text.is_empty() || text.len() > 9 {
        return None;
    }
    text.iter().try_fold(0u32, |number, &c| {
        c.is_ascii_digit().then(|| number.wrapping_mul(10).wrapping_add(u32::from(c & 0x0F)))
    })
}

fn step(text: &[u8]) -> Option<u16> {
    number(text).and_then(|number| u16::try_from(number).ok())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::URG_04LX;

    fn of(lines: &[(&str, &str)]) -> Option<Parameters> {
        let mut partial = PartialParameters::NONE;
        for (key, value) in lines {
            partial.set_field(key.as_bytes(), value.as_bytes());
        }
        partial.complete()
    }

    const UXM: [(&str, &str); 8] = [
        ("SCAN", "1200"),
        ("MODL", "UXM-30LX-E(Hokuyo Automatic Co.,Ltd.)"),
        ("DMIN", "100"),
        ("DMAX", "100000"),
        ("ARES", "1440"),
        ("AMIN", "0"),
        ("AMAX", "760"),
        ("AFRT", "380"),
    ];

    #[test]
    fn keys_come_in_any_order_and_far_ranges_are_capped() {
        let uxm = of(&UXM).unwrap();
        assert_eq!(uxm.model.as_str(), "UXM-30LX-E");
        assert_eq!(uxm.first_step, 0);
        let parts = uxm.geometry(&uxm.measure_all(1, Width::Three)).unwrap().parts();
        assert_eq!((parts.period_us, parts.range_max_mm), (50_000, 65_534));
    }

    #[test]
    fn a_urg_gives_its_geometry() {
        let mut lines = UXM;
        for (key, value) in &mut lines {
            *value = match *key {
                "MODL" => "URG-04LX(Hokuyo Automatic Co.,Ltd.)",
                "DMIN" => "20",
                "DMAX" => "5600",
                "ARES" => "1024",
                "AMIN" => "44",
                "AMAX" => "725",
                "AFRT" => "384",
                _ => "600",
            };
        }
        let urg = of(&lines).unwrap();
        assert_eq!(urg.geometry(&urg.measure_all(1, Width::Three)).unwrap().parts(), URG_04LX);
    }

    #[test]
    fn a_missing_or_odd_number_leaves_the_reply_incomplete() {
        for missing in 0..UXM.len() {
            let mut lines = UXM;
            if lines[missing].0 != "MODL" {
                lines[missing].1 = "12x";
                assert_eq!(of(&lines), None, "{}", lines[missing].0);
                lines[missing].0 = "ROTA";
                assert_eq!(of(&lines), None);
            }
        }
        assert_eq!(number(b"1234567890"), None);
        assert_eq!(number(b""), None);
        assert_eq!(step(b"65536"), None);
    }

    #[test]
    fn an_impossible_sensor_has_no_geometry() {
        let uxm = of(&UXM).unwrap();
        let all = uxm.measure_all(1, Width::Three);
        let refused = |parameters: Parameters| parameters.geometry(&all).unwrap_err();
        assert_eq!(refused(Parameters { steps_per_turn: 0, ..uxm }), GeometryError::StepsPerTurn);
        assert_eq!(refused(Parameters { speed_rpm: 0, ..uxm }), GeometryError::Period);
        assert_eq!(refused(Parameters { range_min_mm: 70_000, ..uxm }), GeometryError::RangeLimits);
        let inverted = Parameters { last_step: 0, first_step: 9, ..uxm }.measure_all(1, Width::Three);
        assert_eq!(uxm.geometry(&inverted), Err(GeometryError::StepsInverted));
    }
}
