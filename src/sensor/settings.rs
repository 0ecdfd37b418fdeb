//! What to ask the sensor for, and how fast the line must be for it.
//!
//! ```text
//!   bytes of a scan's reply × 10 bits ÷ time between scans  =  rate needed
//!   682 steps, MD, 10 Hz:  2137 × 10 ÷ 0.1 s = 213.7 kbaud  →  250 000
//!   682 steps, MD, 10 Hz, cluster 2: 1082 × 10 ÷ 0.1 s      →  115 200
//! ```
//!
//! Source: SCIP 2.0 (C-42-03320B), measurement commands and `SS`.

use crate::scip::{Measurement, Parameters, Width};
use crate::sensor_model::{POWER_UP_BAUD, SensorModel};

/// No sensor is looked for at a slower rate.
const SLOWEST_BAUD: u32 = 9600;

/// Sensors turn up to this much faster than they say (0.4 % was seen), so the line must be faster too: 1 in …
const HEADROOM: u64 = 100;

/// Rates to look for a sensor at, likely ones first: after power-up, set by other programs, the rest.
const SEARCH_ORDER: [u32; 7] = [19_200, 115_200, 250_000, 57_600, 500_000, 750_000, 38_400];

/// The line to the sensor.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LineSettings {
    /// A line without a speed: USB, TCP. `SS` is never sent.
    NoSpeed,
    /// A serial line.
    Serial {
        /// Rate at which the sensor was last spoken to, if that was remembered; tried first.
        last_baud: Option<u32>,
        /// Rate to work at; by default the slowest that carries every scan.
        wanted_baud: Option<u32>,
        /// Fastest rate that board and transceiver can do.
        fastest_baud: u32,
    },
}

/// What to ask the sensor for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SensorSettings {
    /// First step; by default, and at least, the sensor's first.
    pub first_step: Option<u16>,
    /// Last step, inclusive; by default, and at most, the sensor's last.
    pub last_step: Option<u16>,
    /// Steps joined into one beam; taken as 1 to 99.
    pub cluster: u8,
    /// Scans left out after each one sent; taken as 0 to 9.
    pub skip: u8,
    /// Characters a value: two reach 4095 mm only.
    pub width: Width,
    /// The line.
    pub line: LineSettings,
}

impl SensorSettings {
    /// Every step of every scan over a serial line of up to 750 kbaud.
    pub const SERIAL: Self = Self {
        first_step: None,
        last_step: None,
        cluster: 1,
        skip: 0,
        width: Width::Three,
        line: LineSettings::Serial { last_baud: None, wanted_baud: None, fastest_baud: 750_000 },
    };

    /// Every step of every scan over USB or TCP.
    pub const NO_SPEED: Self = Self { line: LineSettings::NoSpeed, ..Self::SERIAL };

    /// The measurement to ask of this sensor. Settings that leave no step give one with its steps inverted.
    #[must_use]
    pub fn measurement(&self, parameters: &Parameters) -> Measurement {
        Measurement {
            first_step: self.first_step.map_or(parameters.first_step, |step| step.max(parameters.first_step)),
            last_step: self.last_step.map_or(parameters.last_step, |step| step.min(parameters.last_step)),
            cluster: self.cluster.clamp(1, 99),
            skip: self.skip.min(9),
            scans: 0,
            width: self.width,
        }
    }

    /// The rate to change to from `baud`, if it is not good as it is, for a sensor of this model.
    pub(super) fn better_baud(
        &self,
        model: &SensorModel,
        measurement: &Measurement,
        period_us: u32,
        baud: u32,
    ) -> Option<u32> {
        let LineSettings::Serial { wanted_baud, fastest_baud, .. } = self.line else { return None };
        let possible = |rate: &u32| *rate <= fastest_baud;
        let rate_baud = match wanted_baud.filter(|rate| model.rates_baud.contains(rate)) {
            Some(rate_baud) => rate_baud,
            None => {
                let needed_baud = needed_baud(measurement, period_us);
                if baud >= needed_baud {
                    return None;
                }
                let mut rates = model.rates_baud.iter().copied().filter(possible);
                let fastest_baud = rates.clone().next_back();
                rates.find(|rate| *rate >= needed_baud).or(fastest_baud)?
            }
        };
        (rate_baud != baud).then_some(rate_baud)
    }

    /// Rates to look for the sensor at; one that means nothing without a speed. Where it was found
    /// before, at `last_baud`, it may only have been silent, and it may have been switched off and on: between
    /// any two other rates these two are tried again.
    pub(super) fn candidates(&self, last_baud: Option<u32>) -> Candidates {
        let mut candidates = Candidates::new();
        let LineSettings::Serial { last_baud: remembered, wanted_baud, .. } = self.line else {
            let _ = candidates.push(POWER_UP_BAUD);
            return candidates;
        };
        let likely = last_baud.or(remembered).into_iter().chain([POWER_UP_BAUD]).chain(wanted_baud);
        for rate_baud in likely.chain(SEARCH_ORDER).filter(|&rate_baud| rate_baud >= SLOWEST_BAUD) {
            if candidates.contains(&rate_baud) {
                continue;
            }
            if let Some(last_baud) = last_baud.filter(|_| candidates.len() > 2) {
                let _ = candidates.push(last_baud);
                let _ = candidates.push(POWER_UP_BAUD);
            }
            let _ = candidates.push(rate_baud);
        }
        candidates
    }

    /// Whether the line has a speed.
    #[must_use]
    pub const fn has_speed(&self) -> bool {
        matches!(self.line, LineSettings::Serial { .. })
    }
}

/// Rates in the order in which they are tried: the seven, two that need not be among them, and two again
/// before each of six.
pub(super) type Candidates = heapless::Vec<u32, 21>;

/// Slowest rate, in baud, that carries every scan of `measurement` when a revolution takes `period_us`.
#[must_use]
pub fn needed_baud(measurement: &Measurement, period_us: u32) -> u32 {
    let interval_us = u64::from(period_us) * (u64::from(measurement.skip) + 1);
    let bits = u64::from(measurement.reply_bytes()) * 10;
    let exact_baud = (bits * 1_000_000).div_ceil(interval_us.max(1));
    u32::try_from(exact_baud + exact_baud / HEADROOM).unwrap_or(u32::MAX)
}

/// Time between scans in µs: revolutions, as many as skipping and a slow line make it.
pub(super) fn interval_us(measurement: &Measurement, period_us: u32, baud: Option<u32>) -> u64 {
    let period_us = u64::from(period_us.max(1));
    let asked_us = period_us * (u64::from(measurement.skip) + 1);
    let line_us =
        baud.map_or(0, |baud| u64::from(measurement.reply_bytes()) * 10_000_000 / u64::from(baud.max(1)));
    asked_us.max(line_us.div_ceil(period_us) * period_us)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scip::command::BIT_RATES;

    const URG: Measurement =
        Measurement { first_step: 44, last_step: 725, cluster: 1, skip: 0, scans: 0, width: Width::Three };

    fn chosen(settings: SensorSettings, measurement: Measurement) -> Option<u32> {
        settings.better_baud(&SensorModel::URG_04LX, &measurement, 100_000, 19_200)
    }

    #[test]
    fn the_line_is_made_fast_enough_for_every_scan() {
        let settings = SensorSettings::SERIAL;
        assert_eq!(chosen(settings, URG), Some(250_000));
        assert_eq!(chosen(settings, Measurement { width: Width::Two, ..URG }), Some(250_000));
        assert_eq!(chosen(settings, Measurement { cluster: 2, ..URG }), Some(115_200));
        assert_eq!(chosen(settings, Measurement { skip: 1, ..URG }), Some(115_200));
        assert_eq!(chosen(settings, Measurement { cluster: 20, ..URG }), None);
        let utm = Measurement { first_step: 0, last_step: 1080, ..URG };
        assert_eq!(chosen(settings, utm), Some(500_000));
        assert_eq!(
            settings.better_baud(&SensorModel::UTM_30LX, &utm, 25_000, 19_200),
            Some(750_000),
            "the fastest, though too slow"
        );
        assert_eq!(settings.better_baud(&SensorModel::URG_04LX, &URG, 100_000, 500_000), None);
    }

    #[test]
    fn a_rate_is_asked_only_of_a_model_that_has_it() {
        let settings = SensorSettings::SERIAL;
        let narrow = Measurement { cluster: 8, ..URG };
        let chosen = |model: &SensorModel| settings.better_baud(model, &narrow, 100_000, 19_200);
        assert_eq!(chosen(&SensorModel::UHG_08LX), Some(38_400));
        assert_eq!(chosen(&SensorModel::URG_04LX), Some(57_600));
    }

    #[test]
    fn a_wanted_rate_is_used_and_a_slow_transceiver_respected() {
        let line =
            LineSettings::Serial { last_baud: None, wanted_baud: Some(115_200), fastest_baud: 750_000 };
        let settings = SensorSettings { line, ..SensorSettings::SERIAL };
        assert_eq!(chosen(settings, URG), Some(115_200));
        assert_eq!(settings.better_baud(&SensorModel::URG_04LX, &URG, 100_000, 115_200), None);
        let line = LineSettings::Serial { last_baud: None, wanted_baud: None, fastest_baud: 200_000 };
        assert_eq!(chosen(SensorSettings { line, ..settings }, URG), Some(115_200));
        assert_eq!(chosen(SensorSettings::NO_SPEED, URG), None);
    }

    #[test]
    fn the_last_good_rate_is_tried_first_and_every_rate_once() {
        let line = LineSettings::Serial {
            last_baud: Some(57_600),
            wanted_baud: Some(500_000),
            fastest_baud: 750_000,
        };
        let settings = SensorSettings { line, ..SensorSettings::SERIAL };
        assert_eq!(
            settings.candidates(None).as_slice(),
            [57_600, 19_200, 500_000, 115_200, 250_000, 750_000, 38_400]
        );
        let again = settings.candidates(Some(250_000));
        assert_eq!(again.get(..6).unwrap(), [250_000, 19_200, 500_000, 250_000, 19_200, 115_200]);
        assert!(BIT_RATES.iter().all(|rate_baud| again.contains(rate_baud)));
        let odd = settings.candidates(Some(31_250));
        assert!(BIT_RATES.iter().all(|rate_baud| odd.contains(rate_baud)));
        assert_eq!(SensorSettings::NO_SPEED.candidates(None).len(), 1);
    }

    #[test]
    fn scans_come_at_whole_revolutions() {
        assert_eq!(interval_us(&URG, 100_000, None), 100_000);
        assert_eq!(interval_us(&URG, 100_000, Some(250_000)), 100_000);
        assert_eq!(interval_us(&URG, 100_000, Some(115_200)), 200_000);
        assert_eq!(interval_us(&Measurement { skip: 3, ..URG }, 100_000, Some(115_200)), 400_000);
        assert_eq!(interval_us(&URG, 100_000, Some(19_200)), 1_200_000);
    }

    #[test]
    fn settings_outside_the_sensor_are_cut_to_it() {
        let parameters = Parameters {
            model: crate::scip::text::Text::default(),
            range_min_mm: 20,
            range_max_mm: 5600,
            steps_per_turn: 1024,
            first_step: 44,
            last_step: 725,
            front_step: 384,
            speed_rpm: 600,
        };
        let asked = SensorSettings {
            first_step: Some(0),
            last_step: Some(9999),
            cluster: 0,
            skip: 99,
            ..SensorSettings::SERIAL
        };
        let measurement = asked.measurement(&parameters);
        assert_eq!((measurement.first_step, measurement.last_step), (44, 725));
        assert_eq!((measurement.cluster, measurement.skip), (1, 9));
    }
}
