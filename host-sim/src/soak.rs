//! A soak: devices and tracker for simulated weeks, and whether memory, clocks or backgrounds drift meanwhile.
//!
//! ```text
//!   scene soak ─▶ Run: sensors, firmware's tasks, network ─▶ SiteTracker      N scans
//!                  │ true start of each scan                  │
//!                  ▼                                          ▼
//!   each tenth:  clock error ◀── start by the session ──  heap, background − the first one, tracks
//!                └────────────▶ drift(first tenth, this one): too much of anything is said
//! ```
//!
//! Paper C's home ran for a year without stopping (docs/bibliography.md, C). Counters of milliseconds in the sensor wrap
//! every 4.7 hours, so that a day holds five wraps; a room that people sit in tempts the background to take them for walls.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use kehai_emulator::simulated_time::Stuck;
use kehai_tracking::geometry::{Point, inside};
use kehai_tracking::site_tracker::SiteTracker;
use kehai_tracking::tracker::LifeCycle;

use crate::baselines::Choice;
use crate::experiment::log::zone;
use crate::run::{Options, Run, TICK_US, module_id};
use crate::world::scene::Scene;
use crate::world::site::Zone;

/// Samples of a soak.
const TENTHS: u64 = 10;

/// Before this the session has few exchanges, and the room is being learned, s: histories are full after 150 s
/// (`tests/tracker_memory.rs`).
const BEGUN_S: f64 = 150.0;

/// Fewest scans of a soak: the first tenth has to go beyond what is left out at its begin.
pub const SCANS_MIN: u64 = 40_000;

/// What one module and one person may take more than at first, bytes: a third of their shares of the tracker's bound
/// (`docs/design.md`), which holds samples that are there from the first scan on.
const MODULE_BYTES: u64 = 16_000;
const PERSON_BYTES: u64 = 8_000;

/// A session follows the sensor's clock to this, or an alarm says so, ms.
const CLOCK_MS: f64 = 20.0;

/// A walker at 1.1 m/s is one standard deviation of a place, 5 mm, farther after so long, ms: the mean error may not grow by
/// more.
const CLOCK_GROWS_MS: f64 = 5.0;

/// A wall is elsewhere if its range differs by more, mm: what the paper's foreground stands out by.
const ELSEWHERE_MM: u16 = 100;

/// Share of the beams whose wall may be elsewhere: those at the edges of furniture, where a beam meets one or the other.
const ELSEWHERE_SHARE: f64 = 0.02;

/// Tells the bytes in use.
pub type Heap<'a> = &'a dyn Fn() -> u64;

/// How everything was in one tenth of a soak.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Sample {
    /// Scans that the tracker has used so far.
    pub scans: u64,
    /// Simulated time so far.
    pub days: f64,
    /// Bytes in use at the end of the tenth.
    pub heap_bytes: u64,
    /// Most bytes in use at any frame of the tenth.
    pub most_bytes: u64,
    /// Start of a scan by the session less the true one, ms: mean of the tenth. Beyond half a revolution it cannot be told.
    pub clock_ms: f64,
    /// The same: the one farthest from 0, without its sign.
    pub worst_clock_ms: f64,
    /// Share of the beams whose wall is elsewhere than in the first background.
    pub elsewhere_share: f64,
    /// Tracks now, tentative ones included.
    pub tracks: u64,
    /// Numbers given to tracks so far.
    pub numbers: u64,
    /// Times so far that a person came into the zone that counts.
    pub visits: u64,
    /// Share of the tenth's frames with as many tracks as people there.
    pub right_share: f64,
}

/// What has drifted too far.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Drift {
    /// Most bytes of the first tenth, of this one, and how much more is allowed.
    Memory(u64, u64, u64),
    /// The mean error of a clock at first and now, ms.
    Clock(f64, f64),
    /// The worst error of a clock, ms.
    ClockWorst(f64),
    /// Share of the beams.
    Background(f64),
}

impl fmt::Display for Drift {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Memory(first, now, more) => {
                write!(f, "memory: {now} bytes after {first} in the first tenth, {more} more are allowed")
            }
            Self::Clock(first_ms, now_ms) => {
                write!(
                    f,
                    "clock: {now_ms:.2} ms off in the mean after {first_ms:.2}, {CLOCK_GROWS_MS} allowed"
                )
            }
            Self::ClockWorst(worst_ms) => {
                write!(f, "clock: {worst_ms:.2} ms off at worst, {CLOCK_MS} allowed")
            }
            Self::Background(share) => write!(
                f,
                "background: {:.2} % of the walls are elsewhere, {:.0} allowed",
                100.0 * share,
                100.0 * ELSEWHERE_SHARE
            ),
        }
    }
}

/// What has drifted too far from the first tenth to `now`, in a site of so many modules and people.
#[must_use]
pub fn drift(first: &Sample, now: &Sample, (modules, people): (u64, u64)) -> Vec<Drift> {
    let more = MODULE_BYTES * modules + PERSON_BYTES * people;
    let found = [
        (now.most_bytes > first.most_bytes + more).then_some(Drift::Memory(
            first.most_bytes,
            now.most_bytes,
            more,
        )),
        ((now.clock_ms - first.clock_ms).abs() > CLOCK_GROWS_MS)
            .then_some(Drift::Clock(first.clock_ms, now.clock_ms)),
        (now.worst_clock_ms > CLOCK_MS).then_some(Drift::ClockWorst(now.worst_clock_ms)),
        (now.elsewhere_share > ELSEWHERE_SHARE).then_some(Drift::Background(now.elsewhere_share)),
    ];
    found.into_iter().flatten().collect()
}

/// No module of the scene has a place: the tracker would use no scan, however long it went on.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("the scene has no module that has a place")]
pub struct NoModule;

/// A soak in progress.
pub struct Soak {
    run: Run,
    site_tracker: SiteTracker,
    /// Frames of 0.1 s that are over.
    tick: u64,
    /// Time of a revolution of each sensor, µs.
    periods_us: Vec<u64>,
    /// Walls of each module as learned first, mm.
    first_mm: BTreeMap<usize, Arc<[u16]>>,
    /// Corners of the zone in which people are judged: the first that counts. None: everywhere.
    area: Option<Vec<Point>>,
    inside: Vec<u32>,
    sample: Sample,
    tally: Tally,
}

/// Sums over a tenth.
#[derive(Clone, Copy, Default)]
struct Tally {
    frames: u64,
    right: u64,
    timed: u64,
    clock_ms: f64,
}

impl Soak {
    /// The built-in scene, or another one, under a seed.
    ///
    /// # Errors
    /// [`NoModule`].
    pub fn new(scene: &Scene, seed: u64) -> Result<Self, NoModule> {
        if !scene.site.modules.iter().any(|module| module.placed) {
            return Err(NoModule);
        }
        let run = Run::new(scene, seed, &Options::default());
        let periods_us =
            run.world().sensors().iter().map(|(_, sensor)| sensor.clock().period_us.into()).collect();
        Ok(Self {
            site_tracker: SiteTracker::new(&Arc::new(scene.site.clone()), Choice::default()),
            run,
            tick: 0,
            periods_us,
            first_mm: BTreeMap::new(),
            area: zone(&scene.site).map(Zone::corners),
            inside: Vec::new(),
            sample: Sample::default(),
            tally: Tally::default(),
        })
    }

    /// Modules and people of the site.
    #[must_use]
    pub fn size(&self) -> (u64, u64) {
        (self.periods_us.len() as u64, self.run.world().people().len() as u64)
    }

    /// Goes on until `scans` of the tracker's scans are reached, and says how all was from the last call on.
    ///
    /// # Errors
    /// [`Stuck`]: a fault of the simulation.
    pub fn until(&mut self, scans: u64, heap: Heap<'_>) -> Result<Sample, Stuck> {
        self.tally = Tally::default();
        (self.sample.most_bytes, self.sample.worst_clock_ms) = (0, 0.0);
        while self.sample.scans < scans {
            self.frame()?;
            self.sample.most_bytes = self.sample.most_bytes.max(heap());
        }
        let Tally { frames, right, timed, clock_ms } = self.tally;
        self.sample.heap_bytes = heap();
        self.sample.days = (self.tick * TICK_US) as f64 * 1e-6 / 86_400.0;
        self.sample.clock_ms = clock_ms / timed.max(1) as f64;
        self.sample.right_share = right as f64 / frames.max(1) as f64;
        self.sample.elsewhere_share = self.elsewhere_share();
        Ok(self.sample)
    }

    fn frame(&mut self) -> Result<(), Stuck> {
        self.tick += 1;
        let (at_us, at_s) = (self.tick * TICK_US, (self.tick * TICK_US) as f64 * 1e-6);
        for arrival in self.run.until(at_us)? {
            let Some(observation) = self.site_tracker.receive(&arrival.bytes, arrival.at_us) else {
                continue;
            };
            self.sample.scans += 1;
            let module = observation.view.module;
            if let Some(error_ms) =
                self.clock_error_ms(module, observation.start_s).filter(|_| at_s > BEGUN_S)
            {
                self.tally.timed += 1;
                self.tally.clock_ms += error_ms;
                self.sample.worst_clock_ms = self.sample.worst_clock_ms.max(error_ms.abs());
            }
        }
        let line = self.site_tracker.line(at_s);
        self.sample.tracks = line.tracks.len() as u64;
        self.sample.numbers = line.tracks.iter().map(|track| track.id).fold(self.sample.numbers, u64::max);
        let area = self.area.as_deref();
        let is_inside = |x: f64, y: f64| area.is_none_or(|corners| inside(Point::new(x, y), corners));
        let people = self.run.moment(at_us).people;
        let there: Vec<u32> =
            people.iter().filter(|person| is_inside(person.x, person.y)).map(|person| person.id).collect();
        self.sample.visits += there.iter().filter(|id| !self.inside.contains(id)).count() as u64;
        self.inside = there;
        if at_s > BEGUN_S {
            let sure = |state| state != LifeCycle::Tentative;
            let found = line.tracks.iter().filter(|track| sure(track.state) && is_inside(track.x, track.y));
            self.tally.frames += 1;
            self.tally.right += u64::from(found.count() == self.inside.len());
        }
        if self.first_mm.len() < self.periods_us.len() {
            let known = self.site_tracker.sessions().iter().filter(|session| !session.walls_mm().is_empty());
            for session in known {
                if let Some(module) = session.place_in_site() {
                    self.first_mm.entry(module).or_insert_with(|| Arc::clone(session.walls_mm()));
                }
            }
        }
        Ok(())
    }

    /// How much later than in truth a scan of a module began by its session, ms.
    fn clock_error_ms(&self, module: usize, start_s: f64) -> Option<f64> {
        let period_us = *self.periods_us.get(module)? as f64;
        let errors_ms = self.run.fronts_us(module).into_iter();
        errors_ms
            .map(|front_us| (start_s * 1e6 - (front_us as f64 - 0.5 * period_us)) * 1e-3)
            .min_by(|one, other| one.abs().total_cmp(&other.abs()))
    }

    fn elsewhere_share(&self) -> f64 {
        let (mut beams, mut elsewhere) = (0_u64, 0_u64);
        for index in 0..self.periods_us.len() {
            let session = self.site_tracker.sessions().get(module_id(index));
            let (Some(first_mm), Some(session)) = (self.first_mm.get(&index), session) else { continue };
            for (first_mm, now_mm) in first_mm.iter().zip(session.walls_mm().iter()) {
                beams += 1;
                elsewhere += u64::from(first_mm.abs_diff(*now_mm) > ELSEWHERE_MM);
            }
        }
        elsewhere as f64 / beams.max(1) as f64
    }
}

/// Where a soak of `scans` scans is sampled.
#[must_use]
pub fn tenths(scans: u64) -> Vec<u64> {
    (1..=TENTHS).map(|tenth| scans.max(SCANS_MIN) * tenth / TENTHS).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_drifts_is_said_and_what_does_not_is_not() {
        let first =
            Sample { most_bytes: 1_000_000, clock_ms: -1.0, worst_clock_ms: 3.0, ..Sample::default() };
        assert_eq!(drift(&first, &first, (2, 3)), []);
        let leak = Sample { most_bytes: 1_056_001, ..first };
        assert_eq!(drift(&first, &leak, (2, 3)), [Drift::Memory(1_000_000, 1_056_001, 56_000)]);
        let slow = Sample { clock_ms: 4.1, worst_clock_ms: 21.0, ..first };
        assert_eq!(drift(&first, &slow, (2, 3)), [Drift::Clock(-1.0, 4.1), Drift::ClockWorst(21.0)]);
        let absorbed = Sample { elsewhere_share: 0.021, ..first };
        assert_eq!(drift(&first, &absorbed, (2, 3)), [Drift::Background(0.021)]);
    }
}
