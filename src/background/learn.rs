//! Learning a background, and waiting while people move.
//!
//! Two tests for movement, both for runs of [`RUN_BEAMS`] neighbouring beams, since noise has no width:
//!
//! ```text
//!  a person walks     readings where the beam never returned before,     ▁▁▁▁▂▂▂▃▃▃▃▃
//!                     in three samples more than not                          ╱╱╱╱  new ranges
//!  a person shifted   ranges that were seen often, but only during       ▮▮▮▯▯▯▯▯  one range
//!  or left            a part of the time                                 ▯▯▯▮▮▮▮▮  another
//! ```
//!
//! Either starts the learning anew, and says where, unless the request overrides it. More scans
//! than [`SAMPLES_MAX`] are sampled evenly.

use super::modes::{Modes, SAMPLES_MAX};
use super::{Background, Beam, BeamState, Status, suspects};
use crate::scan::{Geometry, Reading, Scan};

/// Scans a background is learned from by default: fewer leave edges of furniture unlearned.
pub const LEARN_SCANS: u16 = 60;

/// Fewest scans a background may be learned from: the 30 frames of Ukyo et al. 2020.
pub const LEARN_SCANS_MIN: u16 = 30;

/// Neighbouring beams that make a thing: the size of the smallest candidate.
const RUN_BEAMS: u16 = 3;

/// Samples before new ranges say anything: a beam that flickers has shown most of its modes by then.
const SETTLED_SAMPLES: u16 = 10;

/// Samples with movement, less those without, that mean people.
const MOVING_SAMPLES: u8 = 3;

/// A wish to learn.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LearnRequest {
    /// Scans to learn from, [`LEARN_SCANS_MIN`] at least.
    pub scans: u16,
    /// Learn although people move in view: for recordings, offline.
    pub even_if_moving: bool,
}

impl Default for LearnRequest {
    fn default() -> Self {
        Self { scans: LEARN_SCANS, even_if_moving: false }
    }
}

/// Why a wish to learn is refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LearnRefusal {
    /// Fewer scans than [`LEARN_SCANS_MIN`].
    TooFewScans,
    /// No geometry yet.
    NotConfigured,
}

impl core::fmt::Display for LearnRefusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::TooFewScans => "a background needs at least 30 scans",
            Self::NotConfigured => "no sensor is known yet",
        })
    }
}

impl core::error::Error for LearnRefusal {}

/// How far learning is.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Learning {
    /// Nothing is being learned.
    #[default]
    Idle,
    /// A background is being learned; the old one, if any, stays in use.
    Running {
        /// Scans taken since the last start.
        scans: u16,
        /// Scans wanted.
        of: u16,
        /// How often people moving in view made it start anew (saturating).
        restarts: u16,
        /// Where, the last time: first and last beam's step.
        moved: Option<(u16, u16)>,
    },
}
#[derive(Debug)]
pub(super) struct Learner<const BEAMS: usize> {
    modes: [Modes; BEAMS],
    request: LearnRequest,
    running: bool,
    scans: u16,
    samples: u16,
    restarts: u16,
    moving: u8,
    moved: Option<(u16, u16)>,
}

impl<const BEAMS: usize> Learner<BEAMS> {
    pub(super) const fn new() -> Self {
        Self {
            modes: [Modes::EMPTY; BEAMS],
            request: LearnRequest { scans: LEARN_SCANS, even_if_moving: false },
            running: false,
            scans: 0,
            samples: 0,
            restarts: 0,
            moving: 0,
            moved: None,
        }
    }

    pub(super) fn stop(&mut self) {
        self.running = false;
    }

    fn start(&mut self, request: LearnRequest) {
        self.request = request;
        self.running = true;
        self.restarts = 0;
        self.moved = None;
        self.clear();
    }

    fn clear(&mut self) {
        self.modes.fill(Modes::EMPTY);
        self.scans = 0;
        self.samples = 0;
        self.moving = 0;
    }

    fn restart(&mut self, moved: (u16, u16)) {
        self.restarts = self.restarts.saturating_add(1);
        self.moved = Some(moved);
        self.clear();
    }

    /// Every how many scans a sample is taken.
    fn stride(&self) -> u16 {
        self.request.scans.div_ceil(SAMPLES_MAX).max(1)
    }

    /// Adds a scan; true when it was the last one wanted.
    fn push(&mut self, scan: &Scan<'_>, beams: usize, blind_code: Option<u16>) -> bool {
        let stride = self.stride();
        if self.scans.checked_rem(stride) == Some(0) {
            self.sample(scan, beams, blind_code);
        }
        self.scans = self.scans.saturating_add(1);
        self.scans >= self.request.scans
    }

    fn sample(&mut self, scan: &Scan<'_>, beams: usize, blind_code: Option<u16>) {
        let wanted = self.request.scans.max(1);
        let eighth = (u32::from(self.scans) * 8 / u32::from(wanted)).min(7) as u16;
        let protected = (u32::from(wanted) / u32::from(self.stride()) / 10).clamp(3, 255) as u8;
        let settled = self.samples >= SETTLED_SAMPLES;
        let mut runs = Runs::default();
        for (beam, (&value_mm, modes)) in scan.ranges_mm.iter().zip(&mut self.modes).take(beams).enumerate() {
            let new = match scan.geometry.reading(value_mm) {
                Reading::Range(range_mm) => modes.record(range_mm, eighth, protected),
                Reading::Code(code) if blind_code.is_some_and(|blind| code >= blind) => false,
                Reading::Code(_) | Reading::Beyond => {
                    modes.record_nothing();
                    false
                }
            };
            runs.next(beam, new);
        }
        self.samples = self.samples.saturating_add(1);
        let moved = runs.longest();
        if let (true, Some(moved)) = (settled, moved) {
            self.moving = self.moving.saturating_add(1);
            if self.moving >= MOVING_SAMPLES && !self.request.even_if_moving {
                self.restart(moved);
            }
        } else {
            self.moving = self.moving.saturating_sub(1);
        }
    }

    /// Where something shifted during the learning: the longest run of beams with a confined mode.
    fn shifted(&self, beams: usize) -> Option<(u16, u16)> {
        let mut runs = Runs::default();
        for (beam, modes) in self.modes.iter().take(beams).enumerate() {
            runs.next(beam, modes.is_confined());
        }
        runs.longest()
    }
}

/// Finds the longest run of marked beams.
#[derive(Default)]
struct Runs {
    length: u16,
    best_length: u16,
    best_last: u16,
}

impl Runs {
    fn next(&mut self, beam: usize, marked: bool) {
        self.length = if marked { self.length.saturating_add(1) } else { 0 };
        if self.length > self.best_length {
            self.best_length = self.length;
            self.best_last = beam.min(usize::from(u16::MAX)) as u16;
        }
    }

    /// First and last beam of the longest run of at least [`RUN_BEAMS`].
    fn longest(&self) -> Option<(u16, u16)> {
        let first = self.best_last.saturating_sub(self.best_length.saturating_sub(1));
        (self.best_length >= RUN_BEAMS).then_some((first, self.best_last))
    }
}

impl<const BEAMS: usize> Background<BEAMS> {
    /// Starts learning with the next scan; the background in use stays until a new one is complete.
    ///
    /// # Errors
    /// [`LearnRefusal`].
    pub fn learn(&mut self, request: LearnRequest) -> Result<(), LearnRefusal> {
        if request.scans < LEARN_SCANS_MIN {
            return Err(LearnRefusal::TooFewScans);
        }
        if self.beams == 0 {
            return Err(LearnRefusal::NotConfigured);
        }
        self.learner.start(request);
        Ok(())
    }

    /// How far learning is, with beams as steps of `geometry`.
    #[must_use]
    pub fn learning(&self, geometry: &Geometry) -> Learning {
        let learner = &self.learner;
        if !learner.running {
            return Learning::Idle;
        }
        Learning::Running {
            scans: learner.scans,
            of: learner.request.scans,
            restarts: learner.restarts,
            moved: learner.moved.map(|(first, last)| (geometry.step(first), geometry.step(last))),
        }
    }

    /// Gives a scan to the learning under way. True when a new background came of it. `spread_min_mm` is the least spread a
    /// beam gets.
    pub(crate) fn learn_scan(&mut self, scan: &Scan<'_>, spread_min_mm: u8, now_ds: u32) -> bool {
        if !self.learner.running || !self.learner.push(scan, self.beams, self.blind_code) {
            return false;
        }
        if !self.learner.request.even_if_moving
            && let Some(moved) = self.learner.shifted(self.beams)
        {
            self.learner.restart(moved);
            return false;
        }
        self.install(scan, spread_min_mm, now_ds);
        true
    }

    fn install(&mut self, scan: &Scan<'_>, spread_min_mm: u8, now_ds: u32) {
        self.learner.running = false;
        let total = self.learner.samples;
        for (beam, modes) in self.per_beam.iter_mut().zip(&self.learner.modes).take(self.beams) {
            let mut profile = modes.finish(total);
            if profile.state != BeamState::Unknown {
                profile.spread_mm = profile.spread_mm.max(spread_min_mm);
            }
            *beam = Beam { profile, ..Beam::UNKNOWN };
        }
        self.statuses.fill(Status::QUIET);
        self.known = true;
        self.refresh(0, self.beams, scan.geometry);
        self.suspects = suspects::find(self.per_beam.get(..self.beams).unwrap_or(&[]), scan.geometry);
        self.publish(now_ds);
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixture::BackgroundFixture;
    use super::*;

    #[test]
    fn too_few_scans_and_an_unknown_sensor_are_refused_by_name() {
        let mut fixture = BackgroundFixture::new();
        let few = LearnRequest { scans: LEARN_SCANS_MIN - 1, even_if_moving: false };
        assert_eq!(fixture.background.learn(few), Err(LearnRefusal::TooFewScans));
        let mut unconfigured = Background::<4>::new();
        assert_eq!(unconfigured.learn(LearnRequest::default()), Err(LearnRefusal::NotConfigured));
    }

    #[test]
    fn a_walking_person_makes_the_learning_wait_and_is_located() {
        let mut fixture = BackgroundFixture::new();
        fixture.background.learn(LearnRequest::default()).unwrap();
        for scan in 0..100 {
            fixture.scan(|beam| {
                if (scan / 2..scan / 2 + 8).contains(&beam) { 1500 } else { BackgroundFixture::room(beam) }
            });
        }
        let Learning::Running { restarts, moved: Some((first, last)), .. } =
            fixture.background.learning(&fixture.geometry)
        else {
            panic!("still learning, with a place")
        };
        assert!(restarts > 0 && first >= 300 && last <= 363 && last - first >= 2, "{first} {last}");
        // The learning under way may still begin anew once, at its end.
        for _ in 0..120 {
            fixture.scan(BackgroundFixture::room);
        }
        assert!(fixture.background.is_known());
        assert_eq!(fixture.background.learning(&fixture.geometry), Learning::Idle);
    }

    #[test]
    fn a_person_who_shifts_once_makes_the_learning_wait() {
        let mut fixture = BackgroundFixture::new();
        fixture.background.learn(LearnRequest::default()).unwrap();
        for scan in 0..60 {
            let aside = usize::from(scan > 30) * 3;
            fixture.scan(|beam| {
                if (10 + aside..16 + aside).contains(&beam) { 1500 } else { BackgroundFixture::room(beam) }
            });
        }
        assert!(!fixture.background.is_known());
    }

    #[test]
    fn the_old_background_stays_until_the_new_one_is_complete() {
        let mut fixture = BackgroundFixture::learned();
        let version = fixture.background.version();
        fixture.background.learn(LearnRequest::default()).unwrap();
        for _ in 0..59 {
            fixture.scan(|_| 3000);
        }
        assert_eq!((fixture.profile(3).far_mm, fixture.background.version()), (4000, version));
        fixture.scan(|_| 3000);
        assert_eq!((fixture.profile(3).far_mm, fixture.background.version()), (3000, version + 1));
    }
}
