//! One depth frame through the depth front end, beside one laser scan: both through the core's pipeline.
//!
//! ```text
//!   320 × 240 depths ─▶ foreground ─▶ fan, clusters, sizes ─┐
//!                                                           ├─▶ kehai::pipeline: background, candidates
//!   769 ranges of a UHG-08LX ───────────────────────────────┘
//! ```

use std::error::Error;
use std::hint::black_box;
use std::time::{Duration, Instant};

use host_sim::entrance::live::LOW;
use host_sim::entrance::pacing::{COME_S, IN_S, entrance, laser};
use host_sim::entrance::{CAMERA, Entrance};
use kehai::background::Fingerprint;
use kehai::pipeline::{Pipeline, Settings};
use kehai::scan::{Geometry, GeometryParts, MAX_BEAMS, Scan, ScanTime};
use kehai::sensor_model::SensorModel;
use kehai_depth::device::FanSource;
use kehai_depth::frame::Frame;
use kehai_depth::source::{BadFrame, Frames};
use kehai_emulator::source::{RangeSource, Revolution, SensorGeometry};

/// People before both.
pub const PEOPLE: u16 = 4;

/// Frames, and scans, that are measured.
pub const MEASURED: usize = 20;

/// Scans without people that the pipeline learns from.
const LEARNED: usize = 100;

/// One after another, for as long as there are any.
struct Clip(std::vec::IntoIter<Frame>);

impl Frames for Clip {
    fn next_frame(&mut self) -> Option<Result<Frame, BadFrame>> {
        self.0.next().map(Ok)
    }
}

/// The core behind a sensor.
struct Core {
    pipeline: Box<Pipeline<MAX_BEAMS>>,
    geometry: Geometry,
    scans: u64,
}

impl Core {
    fn new(of: SensorGeometry, model: &str) -> Option<Self> {
        let geometry = Geometry::new(GeometryParts {
            first_step: of.first_step,
            last_step: of.last_step,
            cluster: 1,
            front_step: of.front_step,
            steps_per_turn: of.steps_per_turn,
            period_us: of.period_us,
            range_min_mm: u16::try_from(of.range_min_mm).ok()?,
            range_max_mm: u16::try_from(of.range_max_mm).ok()?,
        })
        .ok()?;
        let settings = Settings::of(&SensorModel::of(model), geometry.parts().range_max_mm);
        let mut pipeline = Box::new(Pipeline::new());
        pipeline.configure(&geometry, settings, Fingerprint::of(model.as_bytes(), &geometry)).ok()?;
        Some(Self { pipeline, geometry, scans: 0 })
    }

    fn process(&mut self, ranges_mm: &[u16]) -> usize {
        self.scans += 1;
        let time =
            ScanTime { sensor_ms: self.scans * 100, stamp_us: self.scans * 100_000, uncertainty_us: 0 };
        self.pipeline.process(&Scan { geometry: &self.geometry, ranges_mm, time }).candidates().len()
    }
}

/// Ranges as the sensor's line has them.
fn ranges_mm(source: &mut dyn RangeSource, start_us: u64) -> Option<Vec<u16>> {
    let period_us = source.geometry().period_us;
    let scan = source.scan(Revolution { start_us, period_us, earliest_us: 0 })?;
    Some(scan.ranges_mm.into_iter().map(|range_mm| u16::try_from(range_mm).unwrap_or(u16::MAX)).collect())
}

/// A frame, from its depths to candidates and their bodies' sizes.
#[inline(never)]
fn counted_frame(source: &mut FanSource, core: &mut Core, start_us: u64) -> usize {
    ranges_mm(source, start_us).map_or(0, |ranges_mm| core.process(&ranges_mm))
}

/// A scan, from its ranges to candidates.
#[inline(never)]
fn counted_scan(ranges_mm: &[u16], core: &mut Core) -> usize {
    core.process(ranges_mm)
}

/// The names of what is counted.
pub const FRAME: &str = "counted_frame";
pub const SCAN: &str = "counted_scan";

/// What all frames, and all scans, took; and how many candidates were in them.
pub struct Took {
    pub frames: Duration,
    pub scans: Duration,
    pub in_frames: usize,
    pub in_scans: usize,
}

/// Takes [`MEASURED`] of both with [`PEOPLE`] in view, once the background of both is learned.
pub fn run() -> Result<Took, Box<dyn Error>> {
    let (frames, in_frames) = frames().ok_or("the camera shows nothing")?;
    let (scans, in_scans) = scans().ok_or("the laser measures nothing")?;
    Ok(Took { frames, scans, in_frames, in_scans })
}

fn frames() -> Option<(Duration, usize)> {
    let people = entrance(PEOPLE);
    let first = ((IN_S - COME_S) * f64::from(CAMERA.frames_per_s)) as usize;
    let unused = Entrance::pacing(0, LEARNED);
    let empty = (0..LEARNED).map(|number| unused.shot(number));
    let shots = empty.chain((first..first + MEASURED).map(|number| people.shot(number)));
    let clip: Vec<Frame> = shots.map(|shot| Some(shot?.frame)).collect::<Option<_>>()?;
    let background = people.background()?;
    let mut source = FanSource::new(Box::new(Clip(clip.into_iter())), LOW, background, Box::new(|_| {}));
    let mut core = Core::new(source.geometry(), source.config().model.model_text)?;
    let at_us = |number: usize| number as u64 * CAMERA.period_us();
    for number in 0..LEARNED {
        core.process(&ranges_mm(&mut source, at_us(number))?);
    }
    let (begun, mut found) = (Instant::now(), 0);
    for number in LEARNED..LEARNED + MEASURED {
        found += black_box(counted_frame(&mut source, &mut core, at_us(number)));
    }
    Some((begun.elapsed(), found))
}

fn scans() -> Option<(Duration, usize)> {
    let mut laser = laser(&entrance(PEOPLE));
    let period_us = u64::from(laser.geometry().period_us);
    let (config, _) = laser.config();
    let mut core = Core::new(laser.geometry(), config.model.model_text)?;
    for number in 0..LEARNED as u64 {
        core.process(&ranges_mm(&mut laser, number * period_us)?);
    }
    let first_us = (IN_S * 1e6) as u64;
    let scans: Vec<Vec<u16>> = (0..MEASURED as u64)
        .map(|number| ranges_mm(&mut laser, first_us + number * period_us))
        .collect::<Option<_>>()?;
    let (begun, mut found) = (Instant::now(), 0);
    for scan in &scans {
        found += black_box(counted_scan(scan, &mut core));
    }
    Some((begun.elapsed(), found))
}
