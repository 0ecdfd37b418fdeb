//! The background as bytes, so that it survives a loss of power.
//!
//! ```text
//!   beam 0           beam 1                          the version, the number of beams and the
//!   0  far    u16    6  …                            fingerprint are kept beside them
//!   2  near   u16
//!   4  spread u8                                     restore_part … restore_part, restored, bind
//!   5  state  u8: 0 unknown, 1 open, 2 wall
//! ```

use super::{Background, Band, Beam, BeamProfile, BeamState, Fingerprint, Status, suspects};
use crate::scan::Geometry;

/// Bytes a beam takes.
pub const BEAM_BYTES: usize = 6;

impl BeamProfile {
    fn to_bytes(self) -> [u8; BEAM_BYTES] {
        let ([a, b], [c, d]) = (self.far_mm.to_le_bytes(), self.near_mm.to_le_bytes());
        let state = match self.state {
            BeamState::Unknown => 0,
            BeamState::Open => 1,
            BeamState::Wall => 2,
        };
        [a, b, c, d, self.spread_mm, state]
    }

    fn from_bytes([a, b, c, d, spread_mm, state]: [u8; BEAM_BYTES]) -> Self {
        Self {
            far_mm: u16::from_le_bytes([a, b]),
            near_mm: u16::from_le_bytes([c, d]),
            spread_mm,
            state: match state {
                1 => BeamState::Open,
                2 => BeamState::Wall,
                _ => BeamState::Unknown,
            },
        }
    }
}

impl<const BEAMS: usize> Background<BEAMS> {
    /// Beams of the background.
    #[must_use]
    pub const fn beams(&self) -> usize {
        self.beams
    }

    /// Writes the beams from `first` on to `out`, as many as there are and as fit whole; returns the bytes
    /// written.
    pub fn store_part(&self, first: usize, out: &mut [u8]) -> usize {
        let (places, _) = out.as_chunks_mut::<BEAM_BYTES>();
        let mut written = 0;
        for (place, profile) in places.iter_mut().zip(self.model().skip(first)) {
            *place = profile.to_bytes();
            written += BEAM_BYTES;
        }
        written
    }

    /// Takes the beams from `first` on back; nothing is known until [`restored`](Self::restored).
    pub fn restore_part(&mut self, first: usize, bytes: &[u8]) {
        self.known = false;
        let (beams, _) = bytes.as_chunks::<BEAM_BYTES>();
        for (beam, &bytes) in self.per_beam.iter_mut().skip(first).zip(beams) {
            *beam = Beam { profile: BeamProfile::from_bytes(bytes), ..Beam::UNKNOWN };
        }
    }

    /// All beams are back: they were those of `version`, bound to `fingerprint`. In use after
    /// [`bind`](Self::bind), if that is for the same; else forgotten.
    pub fn restored(&mut self, beams: usize, version: u16, fingerprint: Fingerprint) {
        self.beams = beams.min(BEAMS);
        self.version = version;
        self.fingerprint = fingerprint;
        self.known = true;
        self.restored = true;
    }

    /// Forgets what was restored in part only.
    pub fn forget(&mut self) {
        self.per_beam.fill(Beam::UNKNOWN);
        self.bands.fill(Band::EVERYTHING);
        self.statuses.fill(Status::QUIET);
        (self.beams, self.known, self.restored) = (0, false, false);
        self.fingerprint = Fingerprint::default();
    }

    /// Works out what follows from profiles that came from a store.
    pub(super) fn settle(&mut self, geometry: &Geometry) {
        if !core::mem::take(&mut self.restored) {
            return;
        }
        self.statuses.fill(Status::QUIET);
        self.refresh(0, self.beams, geometry);
        self.suspects = suspects::find(self.per_beam.get(..self.beams).unwrap_or(&[]), geometry);
        for (published_mm, beam) in self.published_far_mm.iter_mut().zip(&self.per_beam) {
            *published_mm = beam.profile.far_mm;
        }
        self.drifted = false;
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixture::BackgroundFixture;
    use super::*;
    use std::vec::Vec;

    #[test]
    fn a_restored_background_judges_as_the_learned_one() {
        let mut fixture = BackgroundFixture::learned();
        let learned: Vec<_> = fixture.background.profile().collect();
        let (version, fingerprint) = (fixture.background.version(), fixture.background.fingerprint());
        let mut parts = Vec::new();
        let mut part = [0; 45];
        while let written @ 1.. = fixture.background.store_part(parts.len() / BEAM_BYTES, &mut part) {
            assert!(written <= 42, "whole beams only");
            parts.extend_from_slice(&part[..written]);
        }
        assert_eq!(parts.len(), learned.len() * BEAM_BYTES);
        let with_person = |beam| if (5..15).contains(&beam) { 1500 } else { BackgroundFixture::room(beam) };
        fixture.scan(with_person);
        let judged: Vec<_> = (0..learned.len()).map(|beam| fixture.background.class(beam)).collect();

        *fixture.background = Background::new();
        for (at, part) in parts.chunks(48).enumerate() {
            fixture.background.restore_part(at * 8, part);
        }
        fixture.background.restored(learned.len(), version, fingerprint);
        fixture.background.bind(&fixture.geometry, fingerprint, Some(19));
        assert!(fixture.background.is_known());
        assert_eq!(fixture.background.version(), version);
        assert!(fixture.background.profile().eq(learned.iter().copied()));
        fixture.scan(with_person);
        assert!((0..learned.len()).map(|beam| fixture.background.class(beam)).eq(judged));
    }

    #[test]
    fn a_background_restored_for_another_sensor_is_forgotten() {
        let mut fixture = BackgroundFixture::learned();
        let fingerprint = fixture.background.fingerprint();
        let mut part = [0; 1024];
        let written = fixture.background.store_part(0, &mut part);
        *fixture.background = Background::new();
        fixture.background.restore_part(0, &part[..written]);
        fixture.background.restored(written / BEAM_BYTES, 7, fingerprint);
        fixture.background.bind(&fixture.geometry, Fingerprint(fingerprint.0 ^ 1), Some(19));
        assert!(!fixture.background.is_known());
        assert_eq!(fixture.background.version(), 8, "a new version: the old one is gone");
    }
}
