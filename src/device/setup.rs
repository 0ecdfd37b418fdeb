//! The setup: the sensor and its measurement settings. Every report carries its number; info explains the number.

use crate::background::{Background, Fingerprint};
use crate::scan::Geometry;
use crate::scip::Text;
use crate::sensor::Session;
use crate::wire::SensorInfo;

/// A sensor and its measurement settings.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Described {
    model: Text<16>,
    serial: Text<16>,
    firmware: Text<32>,
    geometry: Geometry,
    skip: u8,
}

/// The present setup and its number.
#[derive(Clone, Debug)]
pub(super) struct Setup {
    number: u16,
    described: Option<Described>,
    /// Time between two scans on the line as it is now, µs. It is no part of the setup: reports mean the same on a faster line.
    interval_us: Option<u64>,
    /// The last known serial number: sensors do not always report it.
    serial: Text<16>,
}

impl Setup {
    pub(super) const fn new() -> Self {
        Self { number: 0, described: None, interval_us: None, serial: Text::EMPTY }
    }

    /// 0 until there is a sensor.
    pub(super) const fn number(&self) -> u16 {
        self.number
    }

    pub(super) const fn serial(&self) -> &Text<16> {
        &self.serial
    }

    /// The serial number as it was when the background was stored.
    pub(super) fn remember_serial(&mut self, serial: Text<16>) {
        self.serial = serial;
    }

    /// Steps the number if anything has changed; true then.
    pub(super) fn changed(&mut self, session: &Session, geometry: &Geometry, skip: u8) -> bool {
        self.interval_us = session.interval_us();
        let version = session.version();
        let model = session.parameters().map_or(Text::EMPTY, |parameters| parameters.model);
        if let Some(version) = version.filter(|version| !version.serial.as_str().is_empty()) {
            self.serial = version.serial;
        } else if self.described.is_some_and(|before| before.model != model) {
            // It was the number of the sensor before.
            self.serial = Text::EMPTY;
        }
        let described = Described {
            model,
            serial: self.serial,
            firmware: version.map_or(Text::EMPTY, |version| version.firmware),
            geometry: *geometry,
            skip,
        };
        if self.described == Some(described) {
            return false;
        }
        self.described = Some(described);
        self.number = self.number.checked_add(1).unwrap_or(1);
        true
    }

    pub(super) fn geometry(&self) -> Option<&Geometry> {
        self.described.as_ref().map(|described| &described.geometry)
    }

    /// Model and serial number; empty until there is a sensor.
    pub(super) fn sensor(&self) -> (Text<16>, Text<16>) {
        self.described.map_or((Text::EMPTY, Text::EMPTY), |described| (described.model, described.serial))
    }

    pub(super) fn model(&self) -> &str {
        self.described.as_ref().map_or("", |described| described.model.as_str())
    }

    /// Time between two scans, µs; none until there is a sensor.
    pub(super) const fn interval_us(&self) -> Option<u64> {
        self.interval_us
    }

    pub(super) fn fingerprint(&self) -> Fingerprint {
        match &self.described {
            Some(described) => Fingerprint::of(self.serial.as_str().as_bytes(), &described.geometry),
            None => Fingerprint::default(),
        }
    }

    /// A background that was learned before the sensor told its serial number is that of this sensor; true if it was one.
    pub(super) fn name_background<const BEAMS: usize>(&self, background: &mut Background<BEAMS>) -> bool {
        let Some(described) = &self.described else { return false };
        background.rename(Fingerprint::of(&[], &described.geometry), self.fingerprint())
    }

    pub(super) fn info(&self, open_range_mm: u16) -> Option<SensorInfo<'_>> {
        let Described { model, serial, firmware, geometry, skip } = self.described.as_ref()?;
        Some(SensorInfo::new(
            [model.as_str(), serial.as_str(), firmware.as_str()],
            geometry,
            *skip,
            open_range_mm,
        ))
    }
}
