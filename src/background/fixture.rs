//! A background with a small sensor in front of it, for the tests of this folder.

use super::{Background, BeamProfile, Fingerprint, LearnRequest};
use crate::scan::Geometry;
use crate::scan::{GeometryParts, Scan, ScanTime, URG_04LX};
use std::boxed::Box;
use std::vec::Vec;

pub const BEAMS: usize = 64;

pub struct BackgroundFixture {
    pub geometry: Geometry,
    pub background: Box<Background<BEAMS>>,
    pub now_ds: u32,
}

impl BackgroundFixture {
    pub fn new() -> Self {
        Self::with(Some(19))
    }

    /// In front of a sensor whose codes say nothing from `blind_code` on.
    pub fn with(blind_code: Option<u16>) -> Self {
        let parts = GeometryParts { first_step: 300, last_step: 363, ..URG_04LX };
        let geometry = Geometry::new(parts).unwrap();
        let mut background = Box::new(Background::new());
        background.bind(&geometry, Fingerprint(1), blind_code);
        Self { geometry, background, now_ds: 0 }
    }

    /// The empty room: 4 m away, a pillar of ten beams at 2 m, and nothing from beam 50 on.
    pub fn room(beam: usize) -> u16 {
        match beam {
            20..30 => 2000,
            50.. => 0,
            _ => 4000,
        }
    }

    /// Judges, then learns, a scan of `value_mm(beam)` a tenth of a second after the last.
    pub fn scan(&mut self, value_mm: impl Fn(usize) -> u16) {
        let ranges_mm: Vec<u16> = (0..BEAMS).map(value_mm).collect();
        let scan = Scan { geometry: &self.geometry, ranges_mm: &ranges_mm, time: ScanTime::default() };
        self.now_ds += 1;
        self.background.judge(&scan, self.now_ds);
        self.background.learn_scan(&scan, 0, self.now_ds);
        self.background.publish_drift(self.now_ds);
    }

    /// Learns from `scans` scans of `value_mm(scan, beam)`, moving things or not.
    pub fn learn(&mut self, scans: u16, value_mm: impl Fn(usize, usize) -> u16) {
        self.background.learn(LearnRequest { scans, even_if_moving: true }).unwrap();
        for scan in 0..usize::from(scans) {
            self.scan(|beam| value_mm(scan, beam));
        }
        assert!(self.background.is_known());
    }

    pub fn learned() -> Self {
        let mut fixture = Self::new();
        fixture.learn(60, |_, beam| Self::room(beam));
        fixture
    }

    pub fn profile(&self, beam: usize) -> BeamProfile {
        self.background.profile().nth(beam).unwrap()
    }

    pub fn model(&self, beam: usize) -> BeamProfile {
        self.background.model().nth(beam).unwrap()
    }
}
