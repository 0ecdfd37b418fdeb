//! The line along the bottom of (arrival − stamp): offset and drift of the sensor's clock.
//!
//! ```text
//!  lag = arrival − 1000 µs · stamp
//!        │                            · ·  a stall
//!        │     ·      ·        ·     ·            ·     ·  one scan
//!        │  ·    · ·     ·  ·    · ·   ·  ·   ·  ·   ·
//!        │ ──o───────o────────o─────────o────────────o── ─  slope = drift
//!        │    ▲ the lowest of each second, and the line below them
//!        └────────────────────┼─────────────────────────▶ stamp
//!                         mean stamp
//! ```
//!
//! Transport only ever adds, so the truth runs along the bottom, a constant lower. Of every second of
//! stamps the lowest point is kept, [`WINDOWS`] of them. Of all lines below them, that which is highest
//! at their mean stamp is the most likely; it is an edge of their lower convex hull (S. B. Moon,
//! P. Skelly, D. Towsley, *Estimation and removal of clock skew from network delay measurements*,
//! 1999). Lines a little lower there are nearly as likely, and the middle of the slopes they may
//! have is the better guess: after 10 s of 20 ms of jitter it is off by 3.9 ms in 1 of 100 cases, the
//! edge by 5.5 ms. A stall has no say in all that, since it lies above. Integers only.

/// Stamp time of which the lowest point is kept.
const WINDOW_MS: u64 = 1000;

/// Lowest points kept: 64 s, in which a quartz that warms up bends less than 0.1 ms away from a line.
pub(crate) const WINDOWS: usize = 64;

/// Points older than this are dropped even when no newer ones pushed them out (a gap in the stream).
const OLDEST_MS: u64 = 4 * WINDOWS as u64 * WINDOW_MS;

/// Finished windows needed before the drift is fitted; until then the drift last known is used.
const FIT_WINDOWS: usize = 3;

/// Fastest drift believed: 1 %, three times what is seen of real sensors (99.63–99.74 ms for 100).
pub(crate) const DRIFT_MAX_PPB: i64 = 10_000_000;

const ANY_DRIFT_PPB: (i64, i64) = (-DRIFT_MAX_PPB, DRIFT_MAX_PPB);

/// What an unknown sensor's drift may be: 0.4 %.
const DRIFT_UNKNOWN_PPB: i64 = 4_000_000;

/// By how much the drift of a sensor that was reset may differ from before: a quartz over 50 °C.
const DRIFT_RECALLED_PPB: i64 = 50_000;

/// Windows after which the drift found is better than one recalled, and worth recalling.
const SETTLED_WINDOWS: usize = 32;

/// How much lower than the highest line is still likely: with n points of mean height h above it, one
/// lower by h/n is e times less likely (h: the median, which no stall moves); three times that gave the smallest errors in simulations.
const LIKELY: i64 = 3;

/// A window this many times the median higher than the line was stalled, if it is also higher than the least.
const STALLED: i64 = 10;
const STALLED_MIN_US: i64 = 4_000;

/// Jitter to be expected before there is any to be seen: what the first point may lie too high.
const JITTER_UNKNOWN_US: i64 = 20_000;

/// A stamp, and how much later than 1000 µs a tick its scan arrived.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) sensor_ms: u64,
    pub(super) lag_us: i64,
}

impl Point {
    pub(super) const fn new(sensor_ms: u64, arrival_us: u64) -> Self {
        let lag_us = (arrival_us as i64).saturating_sub((sensor_ms as i64).saturating_mul(1000));
        Self { sensor_ms, lag_us }
    }
}

/// A lag that changes evenly with the stamp.
#[derive(Clone, Copy, Debug)]
struct Line {
    sensor_ms: i64,
    lag_us: i64,
    drift_ppb: i64,
}

impl Line {
    const fn lag_us(&self, sensor_ms: i64) -> i64 {
        self.lag_us.saturating_add(drifted_us(sensor_ms.saturating_sub(self.sensor_ms), self.drift_ppb))
    }

    const fn height_us(&self, point: &Point) -> i64 {
        point.lag_us.saturating_sub(self.lag_us(point.sensor_ms as i64))
    }
}

/// The lower envelope of the scans taken in.
#[derive(Clone, Debug)]
pub(super) struct Envelope {
    /// Lowest point of each finished window, in the order of their stamps.
    points: heapless::Deque<Point, WINDOWS>,
    /// Lowest point of the running one.
    current: Option<Point>,
    line: Option<Line>,
    /// Mean stamp of the points.
    mean_ms: i64,
    drift_ppb: i64,
    /// Half the width of what the drift may be.
    spread_ppb: i64,
    /// Bounds of the drift from before the stamps started anew.
    recalled_ppb: (i64, i64),
    /// Median height of the points above the line: how rough the transport is.
    roughness_us: i64,
}

impl Envelope {
    pub(super) const fn new() -> Self {
        Self {
            points: heapless::Deque::new(),
            current: None,
            line: None,
            mean_ms: 0,
            drift_ppb: 0,
            spread_ppb: DRIFT_UNKNOWN_PPB,
            recalled_ppb: ANY_DRIFT_PPB,
            roughness_us: 0,
        }
    }

    /// Stamps start anew; the drift is the quartz's and stays.
    pub(super) fn restart(&mut self) {
        if self.points.len() >= SETTLED_WINDOWS {
            self.spread_ppb = self.spread_ppb.saturating_mul(2).max(DRIFT_RECALLED_PPB);
            self.recalled_ppb = (
                self.drift_ppb.saturating_sub(self.spread_ppb),
                self.drift_ppb.saturating_add(self.spread_ppb),
            );
        }
        self.points.clear();
        self.current = None;
        self.line = None;
        self.roughness_us = 0;
    }

    /// How much longer than a millisecond the sensor's is, in parts per billion.
    pub(super) const fn drift_ppb(&self) -> i64 {
        self.drift_ppb
    }

    /// The envelope at `sensor_ms`, before the first stamp too.
    pub(super) fn lag_us(&self, sensor_ms: i64) -> Option<i64> {
        self.line.map(|line| line.lag_us(sensor_ms))
    }

    /// How far the envelope may be off at `sensor_ms` compared with `other_ms`.
    pub(super) fn tilt_us(&self, sensor_ms: i64, other_ms: i64) -> i64 {
        drifted_us(sensor_ms.saturating_sub(other_ms).saturating_abs(), 2 * self.spread_ppb)
    }

    /// How far the envelope may be off at `sensor_ms`.
    pub(super) fn uncertainty_us(&self, sensor_ms: i64) -> i64 {
        let count = self.points.len() as i64 + 1;
        (2 * LIKELY * self.roughness_us / count.max(1))
            .saturating_add(JITTER_UNKNOWN_US / (count * count).max(1))
            .saturating_add(self.tilt_us(sensor_ms, self.mean_ms))
    }

    /// Adds a scan; says whether the line has moved. Stamps that do not go forward say nothing new.
    pub(super) fn push(&mut self, point: Point) -> bool {
        let oldest_ms = point.sensor_ms.saturating_sub(OLDEST_MS);
        while self.points.front().is_some_and(|kept| kept.sensor_ms < oldest_ms) {
            self.points.pop_front();
        }
        let below = self.line.is_none_or(|line| line.height_us(&point) < 0);
        let finished = match self.current {
            Some(lowest) if lowest.sensor_ms >= point.sensor_ms => return false,
            Some(lowest) if lowest.sensor_ms / WINDOW_MS == point.sensor_ms / WINDOW_MS => {
                let distance_ms = point.sensor_ms.saturating_sub(lowest.sensor_ms) as i64;
                let level_us = lowest.lag_us.saturating_add(drifted_us(distance_ms, self.drift_ppb));
                if point.lag_us < level_us {
                    self.current = Some(point);
                }
                false
            }
            finished => {
                if self.points.is_full() {
                    self.points.pop_front();
                }
                if let Some(lowest) = finished.filter(|lowest| lowest.sensor_ms >= oldest_ms) {
                    let _ = self.points.push_back(lowest);
                }
                self.current = Some(point);
                true
            }
        };
        if below || finished {
            self.fit(below);
        }
        below || finished
    }

    /// A new line. The running window has a say in its slope only if its lowest point lies below the line
    /// there was: otherwise it may have had few scans.
    fn fit(&mut self, below: bool) {
        let Some(newest) = self.current else { return };
        let newest_ms = newest.sensor_ms as i64;
        if self.points.len() >= FIT_WINDOWS
            && let Some(fitted) = self.likely(newest, below)
        {
            self.mean_ms = newest_ms.saturating_add(fitted.mean_ms);
            self.roughness_us = fitted.roughness_us;
            let (mut least_ppb, mut greatest_ppb) = fitted.drifts_ppb;
            let (floor_ppb, ceiling_ppb) = self.recalled_ppb;
            if self.points.len() >= SETTLED_WINDOWS || least_ppb > ceiling_ppb || greatest_ppb < floor_ppb {
                // Good enough by itself, or another sensor.
                self.recalled_ppb = ANY_DRIFT_PPB;
            } else {
                least_ppb = least_ppb.max(floor_ppb);
                greatest_ppb = greatest_ppb.min(ceiling_ppb);
            }
            self.drift_ppb = least_ppb.midpoint(greatest_ppb);
            self.spread_ppb = greatest_ppb.saturating_sub(least_ppb) / 2;
        } else {
            self.mean_ms = newest_ms;
        }
        let line = Line { sensor_ms: newest_ms, lag_us: newest.lag_us, drift_ppb: self.drift_ppb };
        let lowest_us = self.points.iter().map(|point| line.height_us(point)).fold(0, i64::min);
        self.line = Some(Line { lag_us: line.lag_us.saturating_add(lowest_us), ..line });
    }

    /// The slopes the line may have. Points high above the likeliest line, a stall's, are left out
    /// and the rest is looked at anew.
    fn likely(&self, newest: Point, below: bool) -> Option<Likely> {
        // From the newest point on, so that no product overflows: |x| < 2^19 ms, |y| <= 2^40 µs.
        let mut points = Points::new();
        for point in self.points.iter().chain(self.current.iter().filter(|_| below)) {
            let x = (point.sensor_ms as i64).saturating_sub(newest.sensor_ms as i64);
            let y = point.lag_us.saturating_sub(newest.lag_us).clamp(-(1 << 40), 1 << 40);
            let _ = points.push((x, y));
        }
        let first = highest_below(&points)?;
        let stalled_us = first.median_height_us(&points).saturating_mul(STALLED).max(STALLED_MIN_US);
        points.retain(|point| first.height_us(point) <= stalled_us);
        let line = highest_below(&points)?;
        let roughness_us = line.median_height_us(&points);
        let count = (points.len() as i64).max(1);
        let floor_us = line.level_us.saturating_sub(LIKELY * roughness_us / count).saturating_sub(1);
        // A line of slope s through (mean, floor) is below (x, y) when s · (x − mean) <= y − floor.
        let (mut least_ppb, mut greatest_ppb) = ANY_DRIFT_PPB;
        for &(x, y) in &points {
            let x = x - line.mean_ms;
            let Some(slope_ppb) = (y - floor_us).saturating_mul(1_000_000).checked_div(x) else { continue };
            if x > 0 {
                greatest_ppb = greatest_ppb.min(slope_ppb);
            } else {
                least_ppb = least_ppb.max(slope_ppb);
            }
        }
        let drifts_ppb = (least_ppb, greatest_ppb);
        (least_ppb <= greatest_ppb).then_some(Likely { mean_ms: line.mean_ms, roughness_us, drifts_ppb })
    }
}

/// Stamps in ms and lags in µs, from those of the newest point.
type Points = heapless::Vec<(i64, i64), { WINDOWS + 1 }>;

/// What was found about the line.
struct Likely {
    mean_ms: i64,
    roughness_us: i64,
    drifts_ppb: (i64, i64),
}

/// A line by its height at the mean stamp and an edge of the hull.
struct Edge {
    mean_ms: i64,
    level_us: i64,
    /// Rise over run.
    rise_us: i64,
    run_ms: i64,
}

impl Edge {
    fn height_us(&self, &(x, y): &(i64, i64)) -> i64 {
        let slope_us = (x - self.mean_ms).saturating_mul(self.rise_us) / self.run_ms.max(1);
        y.saturating_sub(self.level_us).saturating_sub(slope_us)
    }

    fn median_height_us(&self, points: &Points) -> i64 {
        let mut heights_us = heapless::Vec::<i64, { WINDOWS + 1 }>::new();
        for point in points {
            let height_us = self.height_us(point);
            let at =
                heights_us.iter().position(|&higher_us| higher_us > height_us).unwrap_or(heights_us.len());
            let _ = heights_us.insert(at, height_us);
        }
        heights_us.get(heights_us.len() / 2).copied().unwrap_or(0).max(0)
    }
}

/// Of all lines below the points that which is highest at their mean stamp.
fn highest_below(points: &Points) -> Option<Edge> {
    let count = points.len() as i64;
    let mean_ms = points.iter().map(|(x, _)| x).sum::<i64>().checked_div(count)?;
    // Monotone chain: what lies on or above the line to the next point goes.
    let mut hull = Points::new();
    for &(x, y) in points {
        while let [.., (x0, y0), (x1, y1)] = *hull.as_slice()
            && (x1 - x0).saturating_mul(y - y0) <= (y1 - y0).saturating_mul(x - x0)
        {
            hull.pop();
        }
        let _ = hull.push((x, y));
    }
    let (&(x0, y0), &(x1, y1)) = hull.iter().zip(hull.iter().skip(1)).find(|(_, (x, _))| *x > mean_ms)?;
    let (rise_us, run_ms) = (y1 - y0, (x1 - x0).max(1));
    let level_us = y0.saturating_add((mean_ms - x0).saturating_mul(rise_us) / run_ms);
    Some(Edge { mean_ms, level_us, rise_us, run_ms })
}

/// What a drift comes to over `distance_ms`: a part per billion of a ms is a millionth of a µs.
const fn drifted_us(distance_ms: i64, drift_ppb: i64) -> i64 {
    distance_ms.saturating_mul(drift_ppb) / 1_000_000
}
