//! Learning: the few ranges a beam keeps returning to, in memory that does not grow.
//!
//! ```text
//!  samples of a beam │····▂█▃·········▁▂▁······│ range        a mode: centre, samples, deviation,
//!                        mode 0      mode 1                   and in which eighths of the
//!  eighths of the     ▮▮▮▮▮▮▮▮    ▯▮▮▯▮▯▮▮                    learning time it was seen
//!  learning time
//! ```
//!
//! Three modes a beam, as in a sketch of heavy hitters: a range that fits no mode takes a free or
//! a stale place. A mode is background when it holds two fifths of the samples, or when it holds a
//! twelfth and *keeps coming and going*: it was seen in five of the eight eighths. What comes once and stays a while is somebody.
//!
//! More scans than [`SAMPLES_MAX`] are sampled evenly.
//!
//! **People moving.** Two tests, both for runs of [`RUN_BEAMS`] neighbouring beams, since noise has
//! no width: readings where the beam never returned before, in three samples more than not
//! (somebody walks), and modes confined to a part of the time (somebody shifted or left). Either
//! starts the learning anew, unless the request says otherwise.

use super::{
    Background, Beam, BeamProfile, BeamState, FOREGROUND_MIN_MM, FOREGROUND_SPREADS, Status, noise_mm,
    suspects,
};
use crate::pipeline::Settings;
use crate::scan::{Geometry, Scan};

/// Scans a background is learned from by default: fewer leave edges of furniture unlearned.
pub const LEARN_SCANS: u16 = 60;

/// Fewest scans a background may be learned from: paper D's 30 frames.
pub const LEARN_SCANS_MIN: u16 = 30;

/// Most samples a beam takes, so that they count in a byte; longer learning samples evenly.
pub const SAMPLES_MAX: u16 = 250;

/// Neighbouring beams that make a thing: the size of the smallest candidate.
const RUN_BEAMS: u16 = 3;

/// Samples before new ranges say anything: a beam that flickers has shown most of its modes by then.
const SETTLED_SAMPLES: u16 = 10;

/// Samples with movement, less those without, that mean people.
const MOVING_SAMPLES: u8 = 3;

const MODES: usize = 3;

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

/// The modes of one beam. 16 bytes.
#[derive(Clone, Copy, Debug)]
struct Modes {
    centre_mm: [u16; MODES],
    samples: [u8; MODES],
    eighths: [u8; MODES],
    deviation_mm: [u8; MODES],
    /// Samples with a return.
    returns: u8,
}

/// One mode, taken out of [`Modes`].
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Mode {
    centre_mm: u16,
    samples: u8,
    eighths: u8,
    deviation_mm: u8,
}

impl Modes {
    const EMPTY: Self = Self {
        centre_mm: [0; MODES],
        samples: [0; MODES],
        eighths: [0; MODES],
        deviation_mm: [0; MODES],
        returns: 0,
    };

    fn modes(&self) -> impl Iterator<Item = Mode> + '_ {
        let numbers = self.centre_mm.iter().zip(&self.samples).zip(&self.eighths).zip(&self.deviation_mm);
        numbers.map(|(((&centre_mm, &samples), &eighths), &deviation_mm)| Mode {
            centre_mm,
            samples,
            eighths,
            deviation_mm,
        })
    }

    fn put(&mut self, slot: usize, mode: Mode) {
        let numbers = (self.centre_mm.get_mut(slot), self.samples.get_mut(slot));
        if let ((Some(centre_mm), Some(samples)), (Some(eighths), Some(deviation_mm))) =
            (numbers, (self.eighths.get_mut(slot), self.deviation_mm.get_mut(slot)))
        {
            *centre_mm = mode.centre_mm;
            *samples = mode.samples;
            *eighths = mode.eighths;
            *deviation_mm = mode.deviation_mm;
        }
    }

    /// Takes a reading in eighth `eighth` (0 to 7) of the learning time, `protected` samples making
    /// a mode safe from being forgotten. True when the reading fits no mode.
    fn take(&mut self, range_mm: u16, eighth: u16, protected: u8) -> bool {
        self.returns = self.returns.saturating_add(1);
        let bit = 1u8.wrapping_shl(u32::from(eighth));
        let window_mm = mode_window_mm(range_mm);
        let mut fitting: Option<(usize, Mode)> = None;
        let mut weakest: Option<(usize, Mode)> = None;
        for (slot, mode) in self.modes().enumerate() {
            let off_mm = mode.centre_mm.abs_diff(range_mm);
            if mode.samples > 0
                && off_mm <= window_mm
                && fitting.is_none_or(|(_, best)| off_mm < best.centre_mm.abs_diff(range_mm))
            {
                fitting = Some((slot, mode));
            }
            if weakest.is_none_or(|(_, least)| mode.samples < least.samples) {
                weakest = Some((slot, mode));
            }
        }
        if let Some((slot, mode)) = fitting {
            self.put(slot, mode.with(range_mm, bit));
            return false;
        }
        if let Some((slot, mode)) = weakest {
            let recent = bit | bit.wrapping_shr(1);
            let stale = mode.eighths & recent == 0 && mode.samples < protected;
            if mode.samples <= 2 || stale {
                let deviation_mm = noise_mm(range_mm);
                self.put(slot, Mode { centre_mm: range_mm, samples: 1, eighths: bit, deviation_mm });
            }
        }
        true
    }

    /// The background these samples of `total` make.
    fn finish(&self, total: u16) -> BeamProfile {
        let mut far = Surface::default();
        let mut second = Surface::default();
        let mut background_samples = 0;
        for &surface in self.surfaces().iter().filter(|surface| surface.is_background(total)) {
            background_samples += surface.samples;
            // Nearest first: what was far until now stands in front of this one.
            if far.samples > second.samples {
                second = far;
            }
            far = surface;
        }
        let spread_mm = far.spread_mm.max(second.spread_mm).max(noise_mm(far.centre_mm));
        let wall = far.samples > 0 && background_samples * 2 >= total;
        BeamProfile {
            far_mm: far.centre_mm,
            near_mm: second.centre_mm,
            spread_mm,
            state: if wall { BeamState::Wall } else { BeamState::Open },
        }
    }

    /// The surfaces these modes show, nearest first: modes less than a foreground threshold apart
    /// are one, a curtain that moves a little.
    fn surfaces(&self) -> heapless::Vec<Surface, MODES> {
        let mut modes = heapless::Vec::<Mode, MODES>::new();
        self.modes().filter(|mode| mode.samples > 0).for_each(|mode| {
            let _ = modes.push(mode);
        });
        // Returns whose range was forgotten again were mostly somebody's, in front.
        let known: u16 = modes.iter().map(|mode| u16::from(mode.samples)).sum();
        let mut nearer = u16::from(self.returns).saturating_sub(known);
        let mut surfaces = heapless::Vec::new();
        while let Some(nearest) = modes.iter().copied().min_by_key(|mode| mode.centre_mm) {
            let mut surface = Surface::default();
            let mut reach_mm = nearest.centre_mm;
            let mut members = heapless::Vec::<Mode, MODES>::new();
            while let Some(next) = modes.iter().copied().min_by_key(|mode| mode.centre_mm)
                && next.centre_mm.saturating_sub(reach_mm) <= FOREGROUND_MIN_MM
            {
                reach_mm = next.centre_mm;
                modes.retain(|mode| *mode != next);
                surface.samples += u16::from(next.samples);
                surface.eighths |= next.eighths;
                let _ = members.push(next);
            }
            surface.settle(&members, nearer, u16::from(self.returns));
            nearer += surface.samples;
            let _ = surfaces.push(surface);
        }
        surfaces
    }
}

/// One or several modes that belong together.
#[derive(Clone, Copy, Debug, Default)]
struct Surface {
    centre_mm: u16,
    spread_mm: u8,
    samples: u16,
    eighths: u8,
}

impl Surface {
    /// Centre: the mode in which the median of the beam's `returns` lies, `nearer` of them being
    /// nearer than this surface; or else the median of its own samples. `members` are nearest
    /// first. The spread reaches them all.
    fn settle(&mut self, members: &[Mode], nearer: u16, returns: u16) {
        let holds_median = nearer * 2 <= returns && returns < (nearer + self.samples) * 2;
        let (mut before, of) = if holds_median { (nearer, returns) } else { (0, self.samples) };
        for mode in members {
            if before * 2 <= of {
                self.centre_mm = mode.centre_mm;
            }
            before += u16::from(mode.samples);
        }
        for mode in members {
            let off_mm = mode.centre_mm.abs_diff(self.centre_mm).div_ceil(FOREGROUND_SPREADS);
            let spread_mm = off_mm.saturating_add(u16::from(mode.deviation_mm)).min(255) as u8;
            self.spread_mm = self.spread_mm.max(spread_mm);
        }
    }

    /// Two fifths of the samples, or a twelfth that keeps coming and going.
    fn is_background(&self, total: u16) -> bool {
        self.samples * 5 >= total * 2 || (self.samples * 12 >= total && self.eighths.count_ones() >= 5)
    }
}

impl Mode {
    /// This mode with one more reading: the mean of the first eight, then a step of 1 mm towards
    /// each, which settles at the median; the deviation settles at the 3/4 quantile of |off|, 1.15 σ.
    fn with(self, range_mm: u16, bit: u8) -> Self {
        let off_mm = i32::from(range_mm) - i32::from(self.centre_mm);
        let place = i32::from(self.samples) + 1;
        let dither = (i32::from(range_mm) * 7 + place * 13).rem_euclid(place);
        let step_mm = (off_mm + dither).div_euclid(place);
        let centre_mm = (i32::from(self.centre_mm) + step_mm).clamp(0, i32::from(u16::MAX)) as u16;
        let wide = off_mm.unsigned_abs() > u32::from(self.deviation_mm);
        let deviation_mm =
            if wide { self.deviation_mm.saturating_add(3) } else { self.deviation_mm.saturating_sub(1) };
        Self { centre_mm, samples: self.samples.saturating_add(1), eighths: self.eighths | bit, deviation_mm }
    }

    /// Seen often, but only during a part of the time: at least four samples to every eighth it was
    /// seen in, and in half of the eighths at most. By chance 8 samples lie in 2 eighths 1 time in 2 300.
    fn is_confined(self) -> bool {
        let eighths = self.eighths.count_ones();
        self.samples >= 8 && eighths <= 4 && eighths * 4 <= u32::from(self.samples)
    }
}

/// How far from its centre a mode reaches, mm: the largest foreground-free scatter, growing with
/// the noise.
const fn mode_window_mm(range_mm: u16) -> u16 {
    20 + range_mm / 200
}

/// Learning under way.
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

    /// Takes a scan; true when it was the last one wanted.
    fn take(&mut self, scan: &Scan<'_>, beams: usize) -> bool {
        let stride = self.stride();
        if self.scans.checked_rem(stride) == Some(0) {
            self.sample(scan, beams);
        }
        self.scans = self.scans.saturating_add(1);
        self.scans >= self.request.scans
    }

    fn sample(&mut self, scan: &Scan<'_>, beams: usize) {
        let wanted = self.request.scans.max(1);
        let eighth = (u32::from(self.scans) * 8 / u32::from(wanted)).min(7) as u16;
        let protected = (u32::from(wanted) / u32::from(self.stride()) / 10).clamp(3, 255) as u8;
        let settled = self.samples >= SETTLED_SAMPLES;
        let mut runs = Runs::default();
        for (beam, (&value_mm, modes)) in scan.ranges_mm.iter().zip(&mut self.modes).take(beams).enumerate() {
            let new = match scan.geometry.reading(value_mm).range_mm() {
                Some(range_mm) => modes.take(range_mm, eighth, protected),
                None => false,
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
            runs.next(beam, modes.modes().any(Mode::is_confined));
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

    /// Gives a scan to the learning under way. True when a new background came of it.
    pub(crate) fn learn_scan(&mut self, scan: &Scan<'_>, settings: Settings, now_ds: u32) -> bool {
        if !self.learner.running || !self.learner.take(scan, self.beams) {
            return false;
        }
        if !self.learner.request.even_if_moving
            && let Some(moved) = self.learner.shifted(self.beams)
        {
            self.learner.restart(moved);
            return false;
        }
        self.install(scan, settings, now_ds);
        true
    }

    fn install(&mut self, scan: &Scan<'_>, settings: Settings, now_ds: u32) {
        let Settings { blind_code, spread_min_mm, .. } = settings;
        self.learner.running = false;
        let total = self.learner.samples;
        for (at, (beam, modes)) in
            self.per_beam.iter_mut().zip(&self.learner.modes).take(self.beams).enumerate()
        {
            let mut profile = modes.finish(total);
            profile.spread_mm = profile.spread_mm.max(spread_min_mm);
            // A step the sensor cannot measure says so by a code of its own, always the same.
            let silent = profile.state == BeamState::Open && profile.far_mm == 0;
            let blind = silent && blind_code.is_some() && scan.ranges_mm.get(at).copied() == blind_code;
            *beam = Beam { profile: if blind { BeamProfile::default() } else { profile }, ..Beam::UNKNOWN };
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
    use super::super::bench::Bench;
    use super::*;

    #[test]
    fn what_returns_half_of_the_time_is_a_wall_and_what_returns_less_is_open() {
        let mut bench = Bench::new();
        bench.learn(60, |scan, beam| match beam {
            0..10 => 2000,
            // Comes and goes, a third of the time.
            10..20 if scan % 3 == 0 => 3000,
            // A fence: itself and what is behind it.
            20..30 if scan % 5 < 2 => 1500,
            20..30 => 2500,
            30..40 => 19,
            _ => 0,
        });
        let wall = BeamProfile { far_mm: 2000, near_mm: 0, spread_mm: 8, state: BeamState::Wall };
        assert_eq!(bench.profile(5), wall);
        let limited = bench.profile(15);
        assert_eq!((limited.state, limited.far_mm), (BeamState::Open, 3000));
        let fence = bench.profile(25);
        assert_eq!((fence.state, fence.near_mm, fence.far_mm), (BeamState::Wall, 1500, 2500));
        assert_eq!(bench.profile(35).state, BeamState::Unknown);
        let open = bench.profile(45);
        assert_eq!((open.state, open.far_mm, open.near_mm), (BeamState::Open, 0, 0));
    }

    #[test]
    fn who_stays_a_while_and_leaves_is_no_background() {
        let mut bench = Bench::new();
        // A third of the time, in front of a wall and in front of nothing.
        bench.learn(90, |scan, beam| match beam {
            25..35 | 55..60 if (20..50).contains(&scan) => 1000,
            _ => Bench::room(beam),
        });
        assert_eq!((bench.profile(32).far_mm, bench.profile(32).near_mm), (4000, 0));
        assert_eq!((bench.profile(57).state, bench.profile(57).far_mm), (BeamState::Open, 0));
    }

    #[test]
    fn thousands_of_scans_are_sampled_evenly() {
        let mut bench = Bench::new();
        bench.learn(2000, |scan, beam| if scan < 1200 { 3000 } else { 2000 } + (beam % 3) as u16);
        let profile = bench.profile(9);
        assert_eq!((profile.near_mm, profile.far_mm), (2000, 3000));
    }

    #[test]
    fn a_curtain_that_moves_a_little_is_one_wall_at_its_median() {
        let mut bench = Bench::new();
        bench.learn(60, |scan, _| if scan % 3 == 0 { 3070 } else { 3000 });
        let profile = bench.profile(3);
        assert_eq!((profile.far_mm, profile.near_mm, profile.state), (3000, 0, BeamState::Wall));
        assert!(profile.explains(3070 + 30));
    }

    #[test]
    fn too_few_scans_and_an_unknown_sensor_are_refused_by_name() {
        let mut bench = Bench::new();
        let few = LearnRequest { scans: LEARN_SCANS_MIN - 1, even_if_moving: false };
        assert_eq!(bench.background.learn(few), Err(LearnRefusal::TooFewScans));
        let mut nobody = Background::<4>::new();
        assert_eq!(nobody.learn(LearnRequest::default()), Err(LearnRefusal::NotConfigured));
    }

    #[test]
    fn somebody_who_walks_makes_the_learning_wait_and_is_named() {
        let mut bench = Bench::new();
        bench.background.learn(LearnRequest::default()).unwrap();
        for scan in 0..100 {
            bench
                .scan(|beam| if (scan / 2..scan / 2 + 8).contains(&beam) { 1500 } else { Bench::room(beam) });
        }
        let Learning::Running { restarts, moved: Some((first, last)), .. } =
            bench.background.learning(&bench.geometry)
        else {
            panic!("still learning, with a place")
        };
        assert!(restarts > 0 && first >= 300 && last <= 363 && last - first >= 2, "{first} {last}");
        // The learning under way may still begin anew once, at its end.
        for _ in 0..120 {
            bench.scan(Bench::room);
        }
        assert!(bench.background.is_known());
        assert_eq!(bench.background.learning(&bench.geometry), Learning::Idle);
    }

    #[test]
    fn somebody_who_shifts_once_makes_the_learning_wait() {
        let mut bench = Bench::new();
        bench.background.learn(LearnRequest::default()).unwrap();
        for scan in 0..60 {
            let aside = usize::from(scan > 30) * 3;
            bench
                .scan(|beam| if (10 + aside..16 + aside).contains(&beam) { 1500 } else { Bench::room(beam) });
        }
        assert!(!bench.background.is_known());
    }

    #[test]
    fn the_old_background_stays_until_the_new_one_is_complete() {
        let mut bench = Bench::learned();
        let version = bench.background.version();
        bench.background.learn(LearnRequest::default()).unwrap();
        for _ in 0..59 {
            bench.scan(|_| 3000);
        }
        assert_eq!((bench.profile(3).far_mm, bench.background.version()), (4000, version));
        bench.scan(|_| 3000);
        assert_eq!((bench.profile(3).far_mm, bench.background.version()), (3000, version + 1));
    }
}
