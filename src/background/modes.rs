//! The few ranges a beam keeps returning to, in memory that does not grow.
//!
//! ```text
//!  samples of a beam  │····▂█▃·········▁▂▁······│ range      a mode: centre, samples, deviation,
//!                         mode 0      mode 1                 and in which eighths of the
//!  eighths of the      ▮▮▮▮▮▮▮▮    ▯▮▮▮▯▮▯▮▮                  learning time it was seen
//!  learning time
//! ```
//!
//! Three modes a beam, as in a sketch of heavy hitters: a range that fits none takes a free or a
//! stale place. Modes closer together than a foreground threshold are one surface. A surface is
//! background when it holds two fifths of the samples, or when it holds a twelfth and *keeps coming
//! and going*: it was seen in five of the eight eighths. A surface that comes once and stays a while is a person.

use super::{BeamProfile, BeamState, FOREGROUND_MIN_MM, FOREGROUND_SPREADS, noise_mm};

/// Most samples a beam takes, so that they count in a byte; longer learning samples evenly.
pub(crate) const SAMPLES_MAX: u16 = 250;

/// Modes a beam can have while it is learned: near and far, and one for what passes.
const MODES: usize = 3;

/// Instead of a number of returns: no sample says anything of the beam, not even that nothing returned. More than [`SAMPLES_MAX`].
const UNHEARD: u8 = u8::MAX;

/// The modes of one beam. 16 bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Modes {
    centre_mm: [u16; MODES],
    samples: [u8; MODES],
    eighths: [u8; MODES],
    deviation_mm: [u8; MODES],
    /// Samples with a return; [`UNHEARD`] while none says anything.
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
    pub(super) const EMPTY: Self = Self {
        centre_mm: [0; MODES],
        samples: [0; MODES],
        eighths: [0; MODES],
        deviation_mm: [0; MODES],
        returns: UNHEARD,
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

    /// Records a reading in eighth `eighth` (0 to 7) of the learning time, `protected` samples making
    /// a mode safe from being forgotten. True when the reading fits no mode.
    pub(super) fn record(&mut self, range_mm: u16, eighth: u16, protected: u8) -> bool {
        self.returns = self.returns().saturating_add(1);
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

    /// Records that nothing returned.
    pub(super) fn record_nothing(&mut self) {
        self.returns = self.returns();
    }

    const fn returns(&self) -> u8 {
        if self.returns == UNHEARD { 0 } else { self.returns }
    }

    /// The background these samples of `total` make. Unknown when none says anything: the sensor cannot measure this step.
    pub(super) fn finish(&self, total: u16) -> BeamProfile {
        if self.returns == UNHEARD {
            return BeamProfile::default();
        }
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

    /// Whether a mode was seen often, but only during a part of the time.
    pub(super) fn is_confined(&self) -> bool {
        self.modes().any(Mode::is_confined)
    }

    /// The surfaces these modes show, nearest first: modes less than a foreground threshold apart
    /// are one, a curtain that moves a little.
    fn surfaces(&self) -> heapless::Vec<Surface, MODES> {
        let mut modes = heapless::Vec::<Mode, MODES>::new();
        self.modes().filter(|mode| mode.samples > 0).for_each(|mode| {
            let _ = modes.push(mode);
        });
        // Returns at a range that was forgotten again came mostly from people in front.
        let known: u16 = modes.iter().map(|mode| u16::from(mode.samples)).sum();
        let mut nearer = u16::from(self.returns()).saturating_sub(known);
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
            surface.settle(&members, nearer, u16::from(self.returns()));
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

/// How far from its centre a mode reaches, mm: three times the noise and a little.
const fn mode_window_mm(range_mm: u16) -> u16 {
    20 + range_mm / 200
}

#[cfg(test)]
mod tests {
    use super::super::fixture::BackgroundFixture;
    use super::*;

    #[test]
    fn what_returns_half_of_the_time_is_a_wall_and_what_returns_less_is_open() {
        let mut fixture = BackgroundFixture::new();
        fixture.learn(60, |scan, beam| match beam {
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
        assert_eq!(fixture.profile(5), wall);
        let limited = fixture.profile(15);
        assert_eq!((limited.state, limited.far_mm), (BeamState::Open, 3000));
        let fence = fixture.profile(25);
        assert_eq!((fence.state, fence.near_mm, fence.far_mm), (BeamState::Wall, 1500, 2500));
        assert_eq!(fixture.profile(35).state, BeamState::Unknown);
        let open = fixture.profile(45);
        assert_eq!((open.state, open.far_mm, open.near_mm), (BeamState::Open, 0, 0));
    }

    #[test]
    fn a_beam_is_unknown_if_no_sample_says_anything_of_it_and_not_by_the_last_one() {
        let mut fixture = BackgroundFixture::new();
        fixture.learn(60, |scan, beam| match beam {
            0..10 if scan == 59 => 19,
            10..20 => 19,
            // A wall behind a sensor that is blind two thirds of the time is known as the limit it is.
            20..30 if scan % 3 == 0 => 2000,
            20..30 => 19,
            _ => 0,
        });
        assert_eq!(fixture.profile(5).state, BeamState::Open);
        assert_eq!(fixture.profile(15), BeamProfile::default());
        assert_eq!((fixture.profile(25).state, fixture.profile(25).far_mm), (BeamState::Open, 2000));
    }

    #[test]
    fn who_stays_a_while_and_leaves_is_no_background() {
        let mut fixture = BackgroundFixture::new();
        // A third of the time, in front of a wall and in front of nothing.
        fixture.learn(90, |scan, beam| match beam {
            25..35 | 55..60 if (20..50).contains(&scan) => 1000,
            _ => BackgroundFixture::room(beam),
        });
        assert_eq!((fixture.profile(32).far_mm, fixture.profile(32).near_mm), (4000, 0));
        assert_eq!((fixture.profile(57).state, fixture.profile(57).far_mm), (BeamState::Open, 0));
    }

    #[test]
    fn thousands_of_scans_are_sampled_evenly() {
        let mut fixture = BackgroundFixture::new();
        fixture.learn(2000, |scan, beam| if scan < 1200 { 3000 } else { 2000 } + (beam % 3) as u16);
        let profile = fixture.profile(9);
        assert_eq!((profile.near_mm, profile.far_mm), (2000, 3000));
    }

    #[test]
    fn a_curtain_that_moves_a_little_is_one_wall_at_its_median() {
        let mut fixture = BackgroundFixture::new();
        fixture.learn(60, |scan, _| if scan % 3 == 0 { 3070 } else { 3000 });
        let profile = fixture.profile(3);
        assert_eq!((profile.far_mm, profile.near_mm, profile.state), (3000, 0, BeamState::Wall));
        assert!(profile.explains(3070 + 30));
    }
}
