//! What the sensor measures of the empty room, beam by beam.
//!
//! ```text
//!             wall                     open, with a limit           open
//!  sensor ●━━━━━━━━━━━━━━━┃▒     ●━━━━━━━━━━━━━━━━━━┊        ●━━━━━━━━━━━━━━━━━ ─ ─
//!           foreground   │ far     foreground       far        every return counts
//!                far − threshold
//!
//!             near ▒▒  ┃ far        two modes: a door leaf open and shut, a fence and what is
//!                                   behind it; both are background, between them is foreground
//! ```
//!
//! *Wall*: returns at least half of the time. *Open*: returns less often, or never; returns that
//! keep coming and going at one range make the limit, and whatever is nearer counts. *Unknown*:
//! not learned, not judged, never seen through.
//!
//! A reading is foreground when it is nearer than the wall by max([`FOREGROUND_MIN_MM`],
//! [`FOREGROUND_SPREADS`] · spread). It is no foreground when it lies as close as that to a mode of
//! a beam at most [`DILATION_BEAMS`] away: an edge of furniture jitters by a beam or two.
//!
//! | file | what |
//! |---|---|
//! | `learn` | scans in, a background out; whether anything moved meanwhile |
//! | `modes` | the few ranges a beam keeps returning to, in bounded memory |
//! | `judge` | one scan against the model; a wall recedes, and never comes nearer |
//! | `absorb` | a place the host has looked at becomes background |
//! | `stored` | the background as bytes, for a store |
//! | `suspects` | things in a new background that have the shape of a person |

mod absorb;
#[cfg(test)]
mod fixture;
mod judge;
mod learn;
mod modes;
mod stored;
mod suspects;

pub use absorb::{Absorb, AbsorbRefusal};
pub use judge::Class;
pub(crate) use judge::Status;
pub use learn::{LEARN_SCANS, LEARN_SCANS_MIN, LearnRefusal, LearnRequest, Learning};
pub use stored::BEAM_BYTES;
pub use suspects::{SUSPECTS, Suspect};

use crate::scan::Geometry;
use learn::Learner;

/// Least distance in front of a background that counts, mm: the 10 cm of Ukyo et al. 2020. Twice the largest
/// range noise of a URG-04LX inside 4 m (5σ of 10 mm), so that only real things reach it.
pub const FOREGROUND_MIN_MM: u16 = 100;

/// Spreads in front of a background that count, where that is more than [`FOREGROUND_MIN_MM`].
/// Readings beyond 4 robust σ are 0.5–4 % of all on real sensors; 5 leaves single ones, no runs.
pub const FOREGROUND_SPREADS: u16 = 5;

/// Least distance at which two readings of one surface are said to differ, mm: 3 σ of a URG-04LX at 4 m.
pub const TOLERANCE_MIN_MM: u16 = 30;

/// Beams by which an edge of the background is widened to either side. Without it one walker in
/// a furnished home grew a second track in a quarter of the scans; with it in none.
pub const DILATION_BEAMS: usize = 2;

/// Range change that makes a beam differ from the published profile, mm: half the foreground threshold.
pub const PUBLISH_DRIFT_MM: u16 = 50;

/// Least time between two profiles published because of drift, sensor time, 0.1 s: one minute.
pub const PUBLISH_INTERVAL_DS: u32 = 600;

/// What a beam measures in the empty room.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BeamState {
    /// Not learned: not judged, not seen through.
    #[default]
    Unknown,
    /// Often or always without a return.
    Open,
    /// A surface returns at least half of the time.
    Wall,
}

/// The background of one beam. 6 bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BeamProfile {
    /// Far mode in mm: the wall, or the limit of an open beam; 0 for an open beam without one.
    pub far_mm: u16,
    /// Near mode in mm, 0 for none.
    pub near_mm: u16,
    /// How widely readings scatter around the modes, about one σ, in mm.
    pub spread_mm: u8,
    /// Wall, open or unknown.
    pub state: BeamState,
}

impl BeamProfile {
    /// How far in front of a mode a reading must lie to be foreground, mm.
    #[must_use]
    pub const fn threshold_mm(&self) -> u16 {
        let spreads_mm = FOREGROUND_SPREADS * self.spread_mm as u16;
        if spreads_mm > FOREGROUND_MIN_MM { spreads_mm } else { FOREGROUND_MIN_MM }
    }

    /// How far apart two readings of the same surface may lie, mm: three spreads,
    /// [`TOLERANCE_MIN_MM`] at least.
    #[must_use]
    pub const fn tolerance_mm(&self) -> u16 {
        let spreads_mm = 3 * self.spread_mm as u16;
        if spreads_mm > TOLERANCE_MIN_MM { spreads_mm } else { TOLERANCE_MIN_MM }
    }

    /// Whether `range_mm` lies at one of the modes.
    #[must_use]
    pub const fn explains(&self, range_mm: u16) -> bool {
        let threshold_mm = self.threshold_mm();
        (self.far_mm != 0 && self.far_mm.abs_diff(range_mm) <= threshold_mm)
            || (self.near_mm != 0 && self.near_mm.abs_diff(range_mm) <= threshold_mm)
    }

    /// Where the nearest mode begins, mm: nothing nearer is ever taken for background.
    #[must_use]
    pub fn nearest_edge_mm(&self) -> Option<u16> {
        let nearest_mm = if self.near_mm != 0 { self.near_mm.min(self.far_mm.max(1)) } else { self.far_mm };
        let nearest_mm = if self.far_mm == 0 { self.near_mm } else { nearest_mm };
        (nearest_mm != 0).then(|| nearest_mm.saturating_sub(self.threshold_mm()))
    }
}

/// Ties a background to one sensor and one set of beams.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fingerprint(pub u32);

impl Fingerprint {
    /// Fingerprint of a sensor's serial number, as it reports it, and of a geometry: 32-bit FNV-1a.
    #[must_use]
    pub fn of(serial: &[u8], geometry: &Geometry) -> Self {
        let parts = geometry.parts();
        let numbers = [
            u32::from(parts.first_step),
            u32::from(parts.last_step),
            u32::from(parts.cluster),
            u32::from(parts.front_step),
            u32::from(parts.steps_per_turn),
            u32::from(parts.range_min_mm),
            u32::from(parts.range_max_mm),
        ];
        let bytes = serial.iter().copied().chain(numbers.into_iter().flat_map(u32::to_le_bytes));
        Self(bytes.fold(0x811c_9dc5, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193)))
    }
}

/// Readings that are background without further thought: `value.wrapping_sub(base) <= width`.
///
/// The wrap puts codes (below the smallest range) above every range, so that one comparison
/// covers "the limit and beyond, or no return at all" for open beams. Both numbers share a word,
/// the base below: one load in the loop that looks at every beam.
#[derive(Clone, Copy, Debug)]
struct Band(u32);

impl Band {
    const EVERYTHING: Self = Self::new(0, u16::MAX);

    const fn new(base: u16, width: u16) -> Self {
        Self(base as u32 | (width as u32) << 16)
    }

    const fn holds(self, value_mm: u16) -> bool {
        (value_mm as u32).wrapping_sub(self.0) & 0xffff <= self.0 >> 16
    }

    /// `blind_code`: the least code that says nothing of a step, not even that nothing returned.
    fn of(profile: &BeamProfile, geometry: &Geometry, blind_code: Option<u16>) -> Self {
        let edge_mm = profile.far_mm.saturating_sub(profile.threshold_mm()).max(geometry.range_min_mm());
        match profile.state {
            BeamState::Unknown => Self::EVERYTHING,
            BeamState::Open => {
                let base =
                    if profile.far_mm == 0 { geometry.range_max_mm().saturating_add(1) } else { edge_mm };
                let end = geometry.range_min_mm();
                let codes = blind_code.map_or(end, |blind| blind.min(end)).saturating_sub(1);
                Self::new(base, codes.wrapping_sub(base))
            }
            BeamState::Wall => {
                let end_mm =
                    profile.far_mm.saturating_add(profile.tolerance_mm()).min(geometry.range_max_mm());
                Self::new(edge_mm, end_mm.saturating_sub(edge_mm))
            }
        }
    }
}

/// What a beam is, and what it does while it is not at its background. 12 bytes.
#[derive(Clone, Copy, Debug)]
struct Beam {
    /// Whatever is nearer than this is foreground: where the nearest mode of the beam and of those
    /// within the dilation begins.
    clear_mm: u16,
    /// The range it holds while it is foreground or behind, mm.
    held_mm: u16,
    /// Since when, low 16 bits of the sensor's time in 0.1 s.
    since_ds: u16,
    profile: BeamProfile,
}

impl Beam {
    const UNKNOWN: Self = Self {
        clear_mm: 0,
        held_mm: 0,
        since_ds: 0,
        profile: BeamProfile { far_mm: 0, near_mm: 0, spread_mm: 0, state: BeamState::Unknown },
    };

    fn hold(&mut self, range_mm: u16, now_ds: u16) {
        (self.held_mm, self.since_ds) = (range_mm, now_ds);
    }
}

/// The background of a sensor, and everything needed to learn it, judge by it and keep it right.
///
/// Memory: 35 bytes a beam, whatever the number of scans learned from.
#[derive(Debug)]
pub struct Background<const BEAMS: usize> {
    bands: [Band; BEAMS],
    statuses: [Status; BEAMS],
    per_beam: [Beam; BEAMS],
    published_far_mm: [u16; BEAMS],
    learner: Learner<BEAMS>,
    suspects: heapless::Vec<Suspect, SUSPECTS>,
    beams: usize,
    version: u16,
    known: bool,
    /// Profiles came from a store; what follows from them is still to be worked out.
    restored: bool,
    drifted: bool,
    published_ds: u32,
    judged_ds: u32,
    fingerprint: Fingerprint,
    blind_code: Option<u16>,
}

impl<const BEAMS: usize> Background<BEAMS> {
    /// Nothing known, nothing being learned.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            bands: [Band::EVERYTHING; BEAMS],
            statuses: [Status::QUIET; BEAMS],
            per_beam: [Beam::UNKNOWN; BEAMS],
            published_far_mm: [0; BEAMS],
            learner: Learner::new(),
            suspects: heapless::Vec::new(),
            beams: 0,
            version: 0,
            known: false,
            restored: false,
            drifted: false,
            published_ds: 0,
            judged_ds: 0,
            fingerprint: Fingerprint(0),
            blind_code: None,
        }
    }

    /// Binds this background to a sensor and a geometry of at most `BEAMS` beams.
    ///
    /// A background bound to the same fingerprint is kept; any other is forgotten, and the version
    /// steps if there was one. Learning under way ends. `blind_code` is the least code of the model
    /// that says nothing of a step.
    pub fn bind(&mut self, geometry: &Geometry, fingerprint: Fingerprint, blind_code: Option<u16>) {
        self.blind_code = blind_code;
        let beams = usize::from(geometry.beams()).min(BEAMS);
        if fingerprint == self.fingerprint && beams == self.beams {
            self.settle(geometry);
            return;
        }
        self.restored = false;
        self.learner.stop();
        self.fingerprint = fingerprint;
        self.beams = beams;
        self.per_beam.fill(Beam::UNKNOWN);
        self.published_far_mm.fill(0);
        self.bands.fill(Band::EVERYTHING);
        self.statuses.fill(Status::QUIET);
        self.suspects.clear();
        self.drifted = false;
        if self.known {
            self.version = self.version.wrapping_add(1);
        }
        self.known = false;
    }

    /// Names the sensor otherwise that the background is bound to: its serial number has become known. True if a background is known
    /// and was bound to `before`.
    pub fn rename(&mut self, before: Fingerprint, now: Fingerprint) -> bool {
        let is_renamed = self.known && self.fingerprint == before && before != now;
        if is_renamed {
            self.fingerprint = now;
        }
        is_renamed
    }

    /// Version of the published profile. Steps with every `learn` and `absorb`, and at most once
    /// a minute of sensor time when a beam has left it by [`PUBLISH_DRIFT_MM`]. 0: never learned.
    #[must_use]
    pub const fn version(&self) -> u16 {
        self.version
    }

    /// Whether a background has been learned.
    #[must_use]
    pub const fn is_known(&self) -> bool {
        self.known
    }

    /// What the background is bound to.
    #[must_use]
    pub const fn fingerprint(&self) -> Fingerprint {
        self.fingerprint
    }

    /// The published profile of version [`version`](Self::version), beam by beam.
    pub fn profile(&self) -> impl ExactSizeIterator<Item = BeamProfile> + Clone + '_ {
        let published = self.per_beam.iter().zip(&self.published_far_mm).take(self.beams);
        published.map(|(beam, &far_mm)| BeamProfile { far_mm, ..beam.profile })
    }

    /// The model now in use: the published profile and what has receded since.
    pub fn model(&self) -> impl ExactSizeIterator<Item = BeamProfile> + Clone + '_ {
        self.per_beam.iter().take(self.beams).map(|beam| beam.profile)
    }

    /// What the newest learned background holds that has the shape of a person.
    #[must_use]
    pub fn suspects(&self) -> &[Suspect] {
        &self.suspects
    }

    /// Publishes drift when it is time: at most once a minute. True when the version stepped.
    pub(crate) fn publish_drift(&mut self, now_ds: u32) -> bool {
        let due = self.drifted && now_ds.wrapping_sub(self.published_ds) >= PUBLISH_INTERVAL_DS;
        if due {
            self.publish(now_ds);
        }
        due
    }

    /// Works out again what follows from the profiles of the beams `first..end`.
    fn refresh(&mut self, first: usize, end: usize, geometry: &Geometry) {
        for (band, beam) in self.bands.iter_mut().zip(&self.per_beam).take(end).skip(first) {
            *band = Band::of(&beam.profile, geometry, self.blind_code);
        }
        for at in first.saturating_sub(DILATION_BEAMS)..(end + DILATION_BEAMS).min(self.beams) {
            let start = at.saturating_sub(DILATION_BEAMS);
            let around =
                self.per_beam.iter().take(self.beams).skip(start).take(at - start + 1 + DILATION_BEAMS);
            let edge_mm = around.filter_map(|beam| beam.profile.nearest_edge_mm()).min();
            if let Some(beam) = self.per_beam.get_mut(at) {
                beam.clear_mm = edge_mm.unwrap_or(u16::MAX);
            }
        }
    }

    fn publish(&mut self, now_ds: u32) {
        for (published_mm, beam) in self.published_far_mm.iter_mut().zip(&self.per_beam) {
            *published_mm = beam.profile.far_mm;
        }
        self.version = self.version.wrapping_add(1).max(1);
        self.published_ds = now_ds;
        self.drifted = false;
    }
}

impl<const BEAMS: usize> Default for Background<BEAMS> {
    fn default() -> Self {
        Self::new()
    }
}

/// Range noise of the sensors this is made for, mm: 3 at the sensor, 13 at 4 m, 28 at 10 m.
/// No learned spread is smaller: a beam that happened to repeat itself is not that good.
const fn noise_mm(range_mm: u16) -> u8 {
    let noise_mm = 3 + range_mm / 400;
    if noise_mm > 250 { 250 } else { noise_mm as u8 }
}

#[cfg(test)]
mod tests {
    use super::fixture::BackgroundFixture;
    use super::*;

    #[test]
    fn a_band_holds_the_wall_and_a_little_behind_and_nothing_else() {
        let fixture = BackgroundFixture::new();
        let wall = BeamProfile { far_mm: 3000, near_mm: 0, spread_mm: 4, state: BeamState::Wall };
        let band = Band::of(&wall, &fixture.geometry, Some(19));
        assert!([2900, 3000, 3030].into_iter().all(|value_mm| band.holds(value_mm)));
        assert!(![0, 19, 2899, 3031, 5601, u16::MAX].into_iter().any(|value_mm| band.holds(value_mm)));
    }

    #[test]
    fn an_open_band_holds_codes_the_limit_and_everything_beyond() {
        let fixture = BackgroundFixture::new();
        let open = |far_mm| BeamProfile { far_mm, near_mm: 0, spread_mm: 4, state: BeamState::Open };
        let limited = Band::of(&open(3000), &fixture.geometry, Some(19));
        assert!([0, 7, 18, 2900, 5600, u16::MAX].into_iter().all(|value_mm| limited.holds(value_mm)));
        assert!(![19, 20, 2899].into_iter().any(|value_mm| limited.holds(value_mm)));
        let free = Band::of(&open(0), &fixture.geometry, None);
        assert!([0, 7, 19, 5601, u16::MAX].into_iter().all(|value_mm| free.holds(value_mm)));
        assert!(!free.holds(20) && !free.holds(5600));
    }

    #[test]
    fn another_sensor_or_geometry_forgets_the_background_and_steps_the_version() {
        let mut fixture = BackgroundFixture::learned();
        let version = fixture.background.version();
        fixture.background.bind(&fixture.geometry, Fingerprint(1), Some(19));
        assert!(fixture.background.is_known());
        fixture.background.bind(&fixture.geometry, Fingerprint(2), Some(19));
        assert!(!fixture.background.is_known());
        assert_eq!(fixture.profile(0).state, BeamState::Unknown);
        assert_eq!(fixture.background.version(), version + 1);
    }

    #[test]
    fn a_serial_number_that_becomes_known_keeps_the_background() {
        let mut fixture = BackgroundFixture::learned();
        let version = fixture.background.version();
        assert!(!fixture.background.rename(Fingerprint(7), Fingerprint(2)), "of another sensor");
        assert!(fixture.background.rename(Fingerprint(1), Fingerprint(2)));
        fixture.background.bind(&fixture.geometry, Fingerprint(2), Some(19));
        assert_eq!((fixture.background.is_known(), fixture.background.version()), (true, version));
    }

    #[test]
    fn fingerprints_differ_by_serial_and_by_geometry() {
        let fixture = BackgroundFixture::new();
        let other = Geometry::new(crate::scan::URG_04LX).unwrap();
        let prints = [
            Fingerprint::of(b"H0804123", &fixture.geometry),
            Fingerprint::of(b"H0804124", &fixture.geometry),
            Fingerprint::of(b"H0804123", &other),
        ];
        assert!(prints[0] != prints[1] && prints[0] != prints[2] && prints[1] != prints[2]);
    }

    #[test]
    fn drift_is_published_at_most_once_a_minute() {
        let mut fixture = BackgroundFixture::learned();
        let version = fixture.background.version();
        for _ in 0..30 {
            fixture.scan(|beam| BackgroundFixture::room(beam) + 200 * u16::from(beam == 25));
        }
        assert_eq!(fixture.model(25).far_mm, 2200);
        assert_eq!((fixture.profile(25).far_mm, fixture.background.version()), (2000, version));
        while fixture.now_ds < 60 + PUBLISH_INTERVAL_DS {
            fixture.scan(|beam| BackgroundFixture::room(beam) + 200 * u16::from(beam == 25));
        }
        assert_eq!((fixture.profile(25).far_mm, fixture.background.version()), (2200, version + 1));
        for _ in 0..40 {
            fixture.scan(|beam| BackgroundFixture::room(beam) + 400 * u16::from(beam == 25));
        }
        assert_eq!(fixture.background.version(), version + 1);
    }

    #[test]
    fn a_small_drift_is_not_worth_a_version() {
        let mut fixture = BackgroundFixture::learned();
        let version = fixture.background.version();
        for _ in 0..700 {
            fixture.scan(|beam| BackgroundFixture::room(beam) + 40 * u16::from(beam == 10));
        }
        assert_eq!((fixture.model(10).far_mm, fixture.background.version()), (4040, version));
    }
}
