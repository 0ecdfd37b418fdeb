//! The pipeline: a scan in, the judgement of it out. Owns all buffers, never waits.
//!
//! ```text
//!  scan ─▶ background.judge ─▶ cluster.segment ─▶ candidates ─┐
//!                │                    └─────────▶ unseen ─────┼─▶ judgement
//!                └─▶ learn · recede · publish ─▶ version ─────┘
//! ```
//!
//! Time inside is the sensor's: the same scans give the same judgements, whenever they arrive.
//!
//! A scan that does not fit the configured geometry is not judged: no candidate, one unseen span over
//! everything, and a counter.

mod judgement;
mod settings;

use crate::background::{
    Absorb, AbsorbRefusal, Background, Class, Fingerprint, LearnRefusal, LearnRequest, Learning,
};
use crate::breaks::Breaks;
use crate::candidate::{self, CANDIDATES, Candidate, Surroundings};
use crate::cluster::{Piece, segment};
use crate::scan::{Geometry, Scan};
use crate::unseen::UnseenReason;
pub use judgement::{Counters, Judgement};
pub use settings::Settings;

/// Scans a report may lie back when a host asks to absorb what it shows: 10 s at 10 Hz, the time
/// to look at it.
pub const ABSORB_AGE_SCANS: u32 = 100;

/// Longest pause between two scans that counts as time passing, ms. More is another recording or
/// a sensor that started anew; it counts as one period.
const PAUSE_MAX_MS: u64 = 10_000;

/// Why a geometry is refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ConfigureError {
    /// More beams than this pipeline has room for.
    TooManyBeams {
        /// Beams of the geometry.
        beams: u16,
        /// Beams of the pipeline.
        room: u16,
    },
}

impl core::fmt::Display for ConfigureError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self::TooManyBeams { beams, room } = self;
        write!(f, "the sensor has {beams} beams, there is room for {room}")
    }
}

impl core::error::Error for ConfigureError {}

/// Background, clusters and candidates of one sensor of at most `BEAMS` beams.
#[derive(Debug)]
pub struct Pipeline<const BEAMS: usize> {
    background: Background<BEAMS>,
    geometry: Option<Geometry>,
    settings: Settings,
    breaks: Breaks,
    judgement: Judgement,
    counters: Counters,
    /// Sensor time passed, ms; pauses and restarts of the sensor's own clock taken out.
    clock_ms: u64,
    last_sensor_ms: Option<u64>,
}

impl<const BEAMS: usize> Pipeline<BEAMS> {
    /// Knows no sensor yet; every scan is foreign until [`configure`](Self::configure).
    #[must_use]
    pub const fn new() -> Self {
        Self {
            background: Background::new(),
            geometry: None,
            settings: Settings::URG_04LX,
            breaks: Breaks::NONE,
            judgement: Judgement::new(),
            counters: Counters {
                foreign_scans: 0,
                short_scans: 0,
                candidates_over: 0,
                spans_merged: 0,
                absorbs_refused: 0,
            },
            clock_ms: 0,
            last_sensor_ms: None,
        }
    }

    /// Prepares for a sensor. A background bound to the same `fingerprint` stays in use; otherwise
    /// it is forgotten, and learning starts with the first scan.
    ///
    /// # Errors
    /// [`ConfigureError`]; then nothing has changed.
    pub fn configure(
        &mut self,
        geometry: &Geometry,
        settings: Settings,
        fingerprint: Fingerprint,
    ) -> Result<(), ConfigureError> {
        if usize::from(geometry.beams()) > BEAMS {
            return Err(ConfigureError::TooManyBeams {
                beams: geometry.beams(),
                room: BEAMS.min(usize::from(u16::MAX)) as u16,
            });
        }
        self.geometry = Some(*geometry);
        self.settings = settings;
        self.breaks = Breaks::of(geometry);
        self.background.bind(geometry, fingerprint, settings.blind_code);
        Ok(())
    }

    /// Judges a scan.
    pub fn process(&mut self, scan: &Scan<'_>) -> &Judgement {
        let Self { judgement, counters, .. } = self;
        judgement.sequence = judgement.sequence.wrapping_add(1);
        judgement.time = scan.time;
        judgement.candidates.clear();
        judgement.unseen.clear();
        let Some(geometry) = self.geometry.filter(|geometry| geometry == scan.geometry) else {
            counters.foreign_scans = counters.foreign_scans.saturating_add(1);
            judgement.background_version = 0;
            judgement.unseen.add(0, usize::from(scan.geometry.beams()), UnseenReason::NoReturn, scan);
            return &self.judgement;
        };
        let now_ds = self.tick(scan.time.sensor_ms, &geometry);
        self.judge(scan, now_ds);
        if !self.background.is_known() && self.background.learning(&geometry) == Learning::Idle {
            // Refused only for too few scans; then the background stays unknown, and says so.
            let _ = self.background.learn(self.settings.learn);
        }
        self.background.learn_scan(scan, self.settings.spread_min_mm, now_ds);
        self.background.publish_drift(now_ds);
        self.judgement.learning = self.background.learning(&geometry);
        &self.judgement
    }

    fn judge(&mut self, scan: &Scan<'_>, now_ds: u32) {
        let Self { background, judgement, counters, breaks, .. } = self;
        judgement.background_version = background.version();
        background.judge(scan, now_ds);
        let around = Around { background, now_ds };
        let Judgement { candidates, unseen, .. } = judgement;
        let count =
            |counter: &mut u32, happened: bool| *counter = counter.saturating_add(u32::from(happened));
        let breaks = *breaks;
        segment(background.statuses(), scan, breaks, |piece| match piece {
            Piece::Cluster(cluster) => {
                if let Some(over) = keep(candidates, candidate::describe(scan, cluster, breaks, &around)) {
                    count(&mut counters.candidates_over, true);
                    let first = usize::from(scan.geometry.beam(over.first_step));
                    let last = usize::from(scan.geometry.beam(over.last_step));
                    let merged =
                        unseen.add(first, last.saturating_sub(first) + 1, UnseenReason::Overflow, scan);
                    count(&mut counters.spans_merged, merged);
                }
            }
            Piece::Short(first, beams) => {
                let merged = unseen.add(first, beams, UnseenReason::TooShort, scan);
                count(&mut counters.spans_merged, merged);
            }
            Piece::NoReturn(first, beams) => {
                let merged = unseen.add(first, beams, UnseenReason::NoReturn, scan);
                count(&mut counters.spans_merged, merged);
            }
        });
        let expected = usize::from(scan.geometry.beams());
        let held = scan.ranges_mm.len();
        if held < expected {
            count(&mut counters.short_scans, true);
            let merged = unseen.add(held, expected - held, UnseenReason::NoReturn, scan);
            count(&mut counters.spans_merged, merged);
        }
    }

    /// Moves the clock on by the time between two sensor stamps; returns it in 0.1 s.
    fn tick(&mut self, sensor_ms: u64, geometry: &Geometry) -> u32 {
        let passed_ms = self.last_sensor_ms.and_then(|last_ms| sensor_ms.checked_sub(last_ms));
        let period_ms = u64::from(geometry.period_us() / 1000);
        self.clock_ms = self
            .clock_ms
            .wrapping_add(passed_ms.filter(|&passed_ms| passed_ms <= PAUSE_MAX_MS).unwrap_or(period_ms));
        self.last_sensor_ms = Some(sensor_ms);
        (self.clock_ms / 100) as u32
    }

    fn now_ds(&self) -> u32 {
        (self.clock_ms / 100) as u32
    }

    /// Learns a new background from the next scans; the one in use stays until that is complete.
    ///
    /// # Errors
    /// [`LearnRefusal`].
    pub fn learn(&mut self, request: LearnRequest) -> Result<(), LearnRefusal> {
        self.background.learn(request)
    }

    /// Makes a part of what the latest scan shows background.
    /// Returns the number of beams that took it.
    ///
    /// # Errors
    /// [`AbsorbRefusal`]; then nothing has changed but the counter.
    pub fn absorb(&mut self, wish: Absorb) -> Result<u16, AbsorbRefusal> {
        let age = self.judgement.sequence.wrapping_sub(wish.sequence);
        let result = match self.geometry {
            Some(_) if age > ABSORB_AGE_SCANS => Err(AbsorbRefusal::Report),
            Some(geometry) => {
                let now_ds = self.now_ds();
                self.background.absorb(wish, &geometry, now_ds)
            }
            None => Err(AbsorbRefusal::NoBackground),
        };
        self.counters.absorbs_refused =
            self.counters.absorbs_refused.saturating_add(u32::from(result.is_err()));
        result
    }

    /// Takes other settings, from the next scan on.
    pub fn set(&mut self, settings: Settings) {
        self.settings = settings;
    }

    /// The background, to be restored from a store.
    pub fn background_mut(&mut self) -> &mut Background<BEAMS> {
        &mut self.background
    }

    /// The background: profile, version, suspects.
    #[must_use]
    pub const fn background(&self) -> &Background<BEAMS> {
        &self.background
    }

    /// The latest judgement.
    #[must_use]
    pub const fn judgement(&self) -> &Judgement {
        &self.judgement
    }

    /// What was dropped or refused.
    #[must_use]
    pub const fn counters(&self) -> Counters {
        self.counters
    }

    /// The settings in use.
    #[must_use]
    pub const fn settings(&self) -> Settings {
        self.settings
    }
}

impl<const BEAMS: usize> Default for Pipeline<BEAMS> {
    fn default() -> Self {
        Self::new()
    }
}

struct Around<'a, const BEAMS: usize> {
    background: &'a Background<BEAMS>,
    now_ds: u32,
}

impl<const BEAMS: usize> Surroundings for Around<'_, BEAMS> {
    fn is_foreground(&self, beam: usize) -> bool {
        self.background.class(beam) == Class::Foreground
    }

    fn held_ds(&self, beam: usize) -> u16 {
        self.background.held_ds(beam, self.now_ds)
    }
}

/// Adds a candidate. When there is no room, the one that matters least gives way and is returned:
/// narrow ones before wide ones, then the farthest.
fn keep(candidates: &mut heapless::Vec<Candidate, CANDIDATES>, new: Candidate) -> Option<Candidate> {
    let new = match candidates.push(new) {
        Ok(()) => return None,
        Err(new) => new,
    };
    let worth = |candidate: &Candidate| (candidate.narrow, candidate.near_mm);
    let least = candidates.iter().map(worth).max()?;
    if worth(&new) >= least {
        return Some(new);
    }
    let mut over = None;
    candidates.retain(|candidate| {
        let goes = over.is_none() && worth(candidate) == least;
        if goes {
            over = Some(candidate.clone());
        }
        !goes
    });
    let _ = candidates.push(new);
    over
}

#[cfg(test)]
mod tests;
