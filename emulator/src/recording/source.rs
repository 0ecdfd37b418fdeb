//! A recording as what an emulated sensor measures.

use super::Recording;
use crate::source::{RangeSource, Revolution, SensorGeometry, SourceScan};

/// Least time between the starts of two scans, in µs. Recorded times are when a scan *arrived*: after a stall, two
/// may share a millisecond, as no sensor's own stamps do.
const APART_US: u64 = 1000;

/// Plays a recording once, scan for scan, with the times at which it was taken.
///
/// The first scan starts with the first measurement command, or at a time given.
#[derive(Clone, Debug)]
pub struct RecordingSource {
    recording: Recording,
    next: usize,
    origin_us: Option<u64>,
    last_us: Option<u64>,
}

impl RecordingSource {
    /// A sensor that measures what `recording` holds.
    #[must_use]
    pub fn new(recording: Recording) -> Self {
        Self { recording, next: 0, origin_us: None, last_us: None }
    }

    /// One whose first scan starts at `start_us`, whenever the measurement begins.
    #[must_use]
    pub fn starting_at(recording: Recording, start_us: u64) -> Self {
        Self { origin_us: Some(start_us), ..Self::new(recording) }
    }

    fn at(&self, index: usize, start_us: u64, period_us: u32) -> Option<SourceScan> {
        let scan = self.recording.scans.get(index)?;
        let ranges_mm = scan.ranges_mm.iter().map(|&range_mm| u32::from(range_mm)).collect();
        Some(SourceScan { start_us, ready_us: start_us + u64::from(period_us), ranges_mm })
    }
}

impl RangeSource for RecordingSource {
    fn geometry(&self) -> SensorGeometry {
        let parts = &self.recording.geometry;
        SensorGeometry {
            first_step: parts.first_step,
            last_step: parts.last_step,
            front_step: parts.front_step,
            steps_per_turn: parts.steps_per_turn,
            range_min_mm: parts.range_min_mm.into(),
            range_max_mm: parts.range_max_mm.into(),
            period_us: parts.period_us,
        }
    }

    fn scan(&mut self, revolution: Revolution) -> Option<SourceScan> {
        let first_us = self.recording.scans.first()?.stamp_us;
        let origin_us = *self.origin_us.get_or_insert(revolution.start_us);
        loop {
            let recorded_us = origin_us + (self.recording.scans.get(self.next)?.stamp_us - first_us);
            let start_us = recorded_us.max(self.last_us.map_or(0, |last_us| last_us + APART_US));
            self.last_us = Some(start_us);
            self.next += 1;
            if start_us >= revolution.earliest_us {
                return self.at(self.next - 1, start_us, revolution.period_us);
            }
        }
    }

    fn latest(&mut self, revolution: Revolution) -> Option<SourceScan> {
        self.at(self.next.saturating_sub(1), revolution.start_us, revolution.period_us)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::RecordedScan;
    use kehai::scan::GeometryParts;

    fn recording() -> Recording {
        let geometry = GeometryParts {
            first_step: 44,
            last_step: 46,
            cluster: 1,
            front_step: 384,
            steps_per_turn: 1024,
            period_us: 100_000,
            range_min_mm: 20,
            range_max_mm: 5600,
        };
        let scans = [500_000, 599_700, 989_700]
            .into_iter()
            .map(|stamp_us| RecordedScan { stamp_us, ranges_mm: vec![(stamp_us / 1000) as u16; 3] })
            .collect();
        Recording { geometry, scans }
    }

    #[test]
    fn a_recording_keeps_its_own_times_and_ends_once() {
        let mut source = RecordingSource::new(recording());
        let ask = |earliest_us| Revolution { start_us: 7_000_000, period_us: 99_700, earliest_us };
        let starts: Vec<_> = std::iter::from_fn(|| source.scan(ask(0))).map(|scan| scan.start_us).collect();
        assert_eq!(starts, [7_000_000, 7_099_700, 7_489_700]);
        assert_eq!(source.scan(ask(0)), None);
    }

    #[test]
    fn what_was_not_received_is_left_out() {
        let mut source = RecordingSource::new(recording());
        let first = source.scan(Revolution { start_us: 0, period_us: 99_700, earliest_us: 0 }).unwrap();
        assert_eq!(first.ranges_mm, [500; 3]);
        let later =
            source.scan(Revolution { start_us: 300_000, period_us: 99_700, earliest_us: 200_000 }).unwrap();
        assert_eq!((later.start_us, later.ranges_mm[0]), (489_700, 989));
    }
}
