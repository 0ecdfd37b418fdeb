//! Where an emulated sensor gets its ranges from: a recording, a simulated world, or a still room.
//!
//! ```text
//! revolution   step 0          first_step … last_step            step 0 again
//!              │ start_us      ranges_mm[0] … ranges_mm[n-1]      │ start_us + period_us
//!              ▼                                                  ▼
//! ─────────────┴──────────────────────────────────────────────────┴──▶ world time, µs
//!                                                                 ready_us: the scan may leave
//! ```
//!
//! Step `k` is measured `period_us · k / steps_per_turn` after `start_us`, so a source that simulates
//! fires its beams one after another.

/// What the sensor's `PP` reply states about the ranges of a source.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SensorGeometry {
    /// First step measured (`AMIN`).
    pub first_step: u16,
    /// Last step measured, inclusive (`AMAX`).
    pub last_step: u16,
    /// The step that points forward (`AFRT`).
    pub front_step: u16,
    /// Steps in a full turn (`ARES`).
    pub steps_per_turn: u16,
    /// Smallest distance in mm (`DMIN`); smaller values are codes.
    pub range_min_mm: u32,
    /// Largest distance in mm (`DMAX`).
    pub range_max_mm: u32,
    /// Time of one revolution by the sensor's own clock, in µs (60 000 000 / `SCAN`).
    pub period_us: u32,
}

impl SensorGeometry {
    /// Number of steps measured.
    #[must_use]
    pub fn steps(&self) -> usize {
        usize::from(self.last_step.saturating_sub(self.first_step)) + 1
    }

    /// Direction of a step, counter-clockwise, 0 forward, in radians.
    #[must_use]
    pub fn bearing_rad(&self, step: u16) -> f64 {
        (f64::from(step) - f64::from(self.front_step)) * std::f64::consts::TAU
            / f64::from(self.steps_per_turn.max(1))
    }
}

/// The revolution for which the sensor wants ranges. All times are µs of the simulated world.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Revolution {
    /// When step 0 passes, as the turning mirror has it.
    pub start_us: u64,
    /// True time of one revolution (the sensor's clock may run fast or slow).
    pub period_us: u32,
    /// A source that keeps its own times gives the next of its scans that starts at or after this time, and
    /// leaves out what lies before: no client was listening then. In a running measurement this is the start
    /// of the scan before.
    pub earliest_us: u64,
}

/// One scan of a source.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SourceScan {
    /// When step 0 passed. [`Revolution::start_us`], unless the source keeps its own times.
    pub start_us: u64,
    /// When the sensor has the whole scan and may send it; late in a stall. Usually
    /// [`Revolution::start_us`] + [`Revolution::period_us`].
    pub ready_us: u64,
    /// One value for each step from [`SensorGeometry::first_step`] to [`SensorGeometry::last_step`], in
    /// mm, counter-clockwise; values below [`SensorGeometry::range_min_mm`] are the sensor's codes.
    pub ranges_mm: Vec<u32>,
}

/// Gives an emulated sensor its ranges, one revolution after another.
pub trait RangeSource: Send {
    /// The sensor's geometry; does not change.
    fn geometry(&self) -> SensorGeometry;

    /// The next scan of a running measurement (`M` and `N` commands). Called once for every scan
    /// of the stream, skipped ones included, with growing times; the first call is what starts a recording.
    /// None: there are no more.
    fn scan(&mut self, revolution: Revolution) -> Option<SourceScan>;

    /// The scan a single request (`G` and `H` commands) gets. It does not start a recording and takes
    /// nothing from it. As [`scan`](Self::scan) for sources without times of their own.
    fn latest(&mut self, revolution: Revolution) -> Option<SourceScan> {
        self.scan(revolution)
    }
}

/// A room in which nothing moves: the built-in source, and the simplest for tests.
///
/// A wall 1.5 m to the left, right and front of the sensor's axis, open behind; steps that see nothing
/// within the sensor's reach read 0.
#[derive(Clone, Debug)]
pub struct StillRoom {
    geometry: SensorGeometry,
    ranges_mm: Vec<u32>,
}

impl StillRoom {
    /// Half the width of the room, and the distance of its front wall, in mm.
    pub const HALF_WIDTH_MM: f64 = 1500.0;

    /// The room as a sensor of this geometry sees it.
    #[must_use]
    pub fn new(geometry: SensorGeometry) -> Self {
        let ranges_mm = (geometry.first_step..=geometry.last_step)
            .map(|step| {
                let (sin, cos) = geometry.bearing_rad(step).sin_cos();
                let side_mm = Self::HALF_WIDTH_MM / sin.abs().max(1e-9);
                let front_mm = if cos > 0.0 { Self::HALF_WIDTH_MM / cos.max(1e-9) } else { f64::MAX };
                let range_mm = side_mm.min(front_mm).round();
                if range_mm > f64::from(geometry.range_max_mm) { 0 } else { range_mm as u32 }
            })
            .collect();
        Self { geometry, ranges_mm }
    }
}

impl RangeSource for StillRoom {
    fn geometry(&self) -> SensorGeometry {
        self.geometry
    }

    fn scan(&mut self, revolution: Revolution) -> Option<SourceScan> {
        Some(SourceScan {
            start_us: revolution.start_us,
            ready_us: revolution.start_us + u64::from(revolution.period_us),
            ranges_mm: self.ranges_mm.clone(),
        })
    }
}

/// A source that ends, again and again: after its last scan it starts anew.
#[derive(Clone, Debug)]
pub struct Repeating<S> {
    fresh: S,
    running: S,
}

impl<S: RangeSource + Clone> Repeating<S> {
    /// Repeats `source`, which has not given a scan yet.
    #[must_use]
    pub fn new(source: S) -> Self {
        Self { running: source.clone(), fresh: source }
    }
}

impl<S: RangeSource + Clone> RangeSource for Repeating<S> {
    fn geometry(&self) -> SensorGeometry {
        self.fresh.geometry()
    }

    fn scan(&mut self, revolution: Revolution) -> Option<SourceScan> {
        self.running.scan(revolution).or_else(|| {
            self.running = self.fresh.clone();
            self.running.scan(revolution)
        })
    }

    fn latest(&mut self, revolution: Revolution) -> Option<SourceScan> {
        self.running.latest(revolution)
    }
}

/// Rows given beforehand, with times of their own: the n-th scan of a test.
#[derive(Clone, Debug)]
pub struct Rows {
    geometry: SensorGeometry,
    /// Start of each row relative to the first, delay until it may leave, ranges.
    rows: Vec<(u64, u64, Vec<u32>)>,
    next: usize,
    origin_us: Option<u64>,
}

impl Rows {
    /// Each row: its start relative to the first one's in µs, the time from its start until it may leave,
    /// and its ranges. The rows begin at the first measurement command; they end once.
    #[must_use]
    pub fn new(geometry: SensorGeometry, rows: Vec<(u64, u64, Vec<u32>)>) -> Self {
        Self { geometry, rows, next: 0, origin_us: None }
    }
}

impl RangeSource for Rows {
    fn geometry(&self) -> SensorGeometry {
        self.geometry
    }

    fn scan(&mut self, revolution: Revolution) -> Option<SourceScan> {
        let origin_us = *self.origin_us.get_or_insert(revolution.start_us);
        loop {
            let (offset_us, delay_us, ranges_mm) = self.rows.get(self.next)?;
            self.next += 1;
            let start_us = origin_us + offset_us;
            if start_us >= revolution.earliest_us {
                return Some(SourceScan {
                    start_us,
                    ready_us: start_us + delay_us,
                    ranges_mm: ranges_mm.clone(),
                });
            }
        }
    }

    fn latest(&mut self, revolution: Revolution) -> Option<SourceScan> {
        let row = self.rows.get(self.next.saturating_sub(1))?;
        Some(SourceScan {
            start_us: revolution.start_us,
            ready_us: revolution.start_us + u64::from(revolution.period_us),
            ranges_mm: row.2.clone(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const URG: SensorGeometry = SensorGeometry {
        first_step: 44,
        last_step: 725,
        front_step: 384,
        steps_per_turn: 1024,
        range_min_mm: 20,
        range_max_mm: 5600,
        period_us: 100_000,
    };

    fn revolution(start_us: u64, earliest_us: u64) -> Revolution {
        Revolution { start_us, period_us: 99_700, earliest_us }
    }

    #[test]
    fn the_still_room_is_one_and_a_half_metres_wide() {
        let scan = StillRoom::new(URG).scan(revolution(1000, 0)).unwrap();
        assert_eq!(scan.ranges_mm.len(), 682);
        assert_eq!(scan.ranges_mm[384 - 44], 1500);
        assert_eq!(scan.ranges_mm[384 + 256 - 44], 1500);
        assert_eq!(scan.ready_us, 100_700);
    }

    #[test]
    fn rows_begin_at_the_first_request_and_skip_what_was_not_received() {
        let row = |offset_us, value_mm| (offset_us, 100_000, vec![value_mm; 682]);
        let mut rows = Rows::new(URG, vec![row(0, 100), row(90_000, 200), row(300_000, 300)]);
        assert_eq!(rows.latest(revolution(1, 0)).unwrap().ranges_mm[0], 100);
        let first = rows.scan(revolution(50_000, 50_000)).unwrap();
        assert_eq!((first.start_us, first.ready_us), (50_000, 150_000));
        let third = rows.scan(revolution(250_000, 250_000)).unwrap();
        assert_eq!((third.start_us, third.ranges_mm[0]), (350_000, 300));
        assert_eq!(rows.scan(revolution(450_000, 350_001)), None);
    }

    #[test]
    fn what_repeats_begins_anew_after_its_last_row() {
        let rows = Rows::new(URG, vec![(0, 100_000, vec![1; 682]), (100_000, 100_000, vec![2; 682])]);
        let mut repeating = Repeating::new(rows);
        let scans = [0, 100_000, 200_000, 300_000].map(|at_us| {
            let scan = repeating.scan(revolution(at_us, at_us)).unwrap();
            (scan.start_us, scan.ranges_mm[0])
        });
        assert_eq!(scans, [(0, 1), (100_000, 2), (200_000, 1), (300_000, 2)]);
    }
}
