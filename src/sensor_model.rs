//! The sensor models: a row for each, and one for all others. Whatever depends on the model asks this table.
//!
//! ```text
//!   PP:  MODL:UTM-30LX-EW;I  ──▶ first row whose prefix it begins with ──▶ line rates · open range · blind code
//! ```
//!
//! A new model is a new row. The emulator that the tests run against has a table of its own, on purpose.
//!
//! Sources: SCIP 2.0 (C-42-03320B), `SS` and p. 12; the data sheets of the models.

use crate::scip::command::BIT_RATES;

/// Bit rate of a sensor on a serial line after power-up, baud: it is found before its model is known.
pub const POWER_UP_BAUD: u32 = 19_200;

/// How far a model still sees black clothing (10 % reflectance), mm.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum OpenRange {
    /// So far.
    Known(u16),
    /// Half of `DMAX`.
    Half,
    /// Nothing is known: two fifths of `DMAX`, and no farther than this.
    TwoFifthsUpTo(u16),
}

/// What is known of a sensor model beside what it states in `PP`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SensorModel {
    /// How `MODL` of `PP` begins.
    prefix: &'static str,
    /// Bit rates it can be set to on a serial line, baud, slowest first.
    pub rates_baud: &'static [u32],
    open_range: OpenRange,
    /// The least code that says nothing of a step, not even that nothing returned: beams that show
    /// only such codes while the background is learned stay unknown.
    pub blind_code: Option<u16>,
}

impl SensorModel {
    /// URG-04LX and URG-04LX-UG01: 4 m for white paper. Black clothing by the one data sheet that states both: a
    /// UST-10LX reaches 10 m on white and 4 m at 10 % reflectance, two fifths.
    pub const URG_04LX: Self = Self {
        prefix: "URG-04LX",
        rates_baud: &[19_200, 57_600, 115_200, 250_000, 500_000, 750_000],
        open_range: OpenRange::Known(1600),
        blind_code: Some(19),
    };

    /// UBG-04LX-F01: taken to reach as far as its sister.
    pub const UBG_04LX: Self = Self { prefix: "UBG-04LX", rates_baud: &BIT_RATES, ..Self::URG_04LX };

    /// UHG-08LX: two fifths of 8 m.
    pub const UHG_08LX: Self =
        Self { prefix: "UHG-08LX", open_range: OpenRange::Known(3200), ..Self::UBG_04LX };

    /// UTM-30LX and UTM-30LX-EW: two fifths of 30 m. By code 1 nothing returned; 2 is too near, 3 a wrong
    /// measurement, 4 too near as well, 5 anything else.
    pub const UTM_30LX: Self = Self {
        prefix: "UTM-30LX",
        rates_baud: &BIT_RATES,
        open_range: OpenRange::Known(12_000),
        blind_code: Some(2),
    };

    /// UST-10LX: 4 m at 10 % reflectance, by its data sheet. What its codes say is not known.
    pub const UST_10LX: Self =
        Self { prefix: "UST-10LX", open_range: OpenRange::Known(4000), blind_code: None, ..Self::UTM_30LX };

    /// A depth camera as a fan of ranges: the program `kehai-depth` says where it cannot see, and states as `DMAX` twice the range
    /// up to which it finds people.
    pub const DEPTH: Self =
        Self { prefix: "KEHAI-DEPTH", open_range: OpenRange::Half, blind_code: Some(19), ..Self::UTM_30LX };

    /// Any other: no farther than the best that is known of small sensors.
    const OTHER: Self =
        Self { prefix: "", open_range: OpenRange::TwoFifthsUpTo(4000), blind_code: None, ..Self::UTM_30LX };

    const ALL: [Self; 7] = [
        Self::URG_04LX,
        Self::UBG_04LX,
        Self::UHG_08LX,
        Self::UTM_30LX,
        Self::UST_10LX,
        Self::DEPTH,
        Self::OTHER,
    ];

    /// The row of a sensor by its `MODL` text; every text has one.
    #[must_use]
    pub fn of(model: &str) -> Self {
        let is = |row: &Self| model.as_bytes().starts_with(row.prefix.as_bytes());
        Self::ALL.into_iter().find(is).unwrap_or(Self::OTHER)
    }

    /// Range at which it still sees black clothing, mm, for a sensor that states a `DMAX` of `range_max_mm`.
    #[must_use]
    pub const fn open_range_mm(&self, range_max_mm: u16) -> u16 {
        match self.open_range {
            OpenRange::Known(open_mm) => open_mm,
            OpenRange::Half => range_max_mm / 2,
            OpenRange::TwoFifthsUpTo(most_mm) => {
                let two_fifths_mm = range_max_mm / 5 * 2;
                if two_fifths_mm < most_mm { two_fifths_mm } else { most_mm }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_is_found_by_the_start_of_its_text() {
        for (text, row) in [
            ("URG-04LX(Hokuyo Automatic Co.,Ltd.)", SensorModel::URG_04LX),
            ("UBG-04LX-F01", SensorModel::UBG_04LX),
            ("UHG-08LX", SensorModel::UHG_08LX),
            ("UTM-30LX-EW", SensorModel::UTM_30LX),
            ("UST-10LX", SensorModel::UST_10LX),
            ("UST-20LX", SensorModel::OTHER),
            ("KEHAI-DEPTH", SensorModel::DEPTH),
            ("URG", SensorModel::OTHER),
            ("", SensorModel::OTHER),
        ] {
            assert_eq!(SensorModel::of(text), row, "{text}");
        }
    }

    #[test]
    fn an_unknown_sensor_is_trusted_no_farther_than_a_small_one() {
        let open_mm = |model, range_max_mm| SensorModel::of(model).open_range_mm(range_max_mm);
        assert_eq!((open_mm("X", 5000), open_mm("X", 60_000)), (2000, 4000));
        assert_eq!((open_mm("UTM-30LX", 60_000), open_mm("URG-04LX", 5600)), (12_000, 1600));
        assert_eq!(open_mm("KEHAI-DEPTH", 9800), 4900);
    }

    #[test]
    fn codes_say_nothing_from_the_blind_code_on_where_it_is_known() {
        let blind = |model| SensorModel::of(model).blind_code;
        assert_eq!((blind("URG-04LX"), blind("KEHAI-DEPTH")), (Some(19), Some(19)));
        assert_eq!((blind("UTM-30LX-EW"), blind("UST-10LX"), blind("X")), (Some(2), None, None));
    }

    #[test]
    fn the_rates_of_every_model_can_be_asked_for() {
        for row in SensorModel::ALL {
            assert!(row.rates_baud.is_sorted() && row.rates_baud.iter().all(|rate| BIT_RATES.contains(rate)));
        }
    }
}
