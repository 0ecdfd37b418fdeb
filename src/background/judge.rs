//! Judging one scan: what every beam sees, compared with what it sees when nobody is there.
//!
//! ```text
//!             threshold  tolerance
//!            ◀─────────▶ ◀──▶
//!  ●─────────┼──────────┃────┼───────────────▶ range
//!   foreground  background    behind: 20 times in a row, and the wall recedes
//! ```
//!
//! Nine beams of ten are at their background in nine scans of ten, so one comparison settles
//! them and nothing is written. All others go the long way, which also keeps count of how long they hold a range.

use super::{Aside, Background, Band, BeamProfile, BeamState, DILATION_BEAMS, PUBLISH_DRIFT_MM, noise_mm};
use crate::scan::{Geometry, Scan};

/// Consistent returns in a row behind a wall after which it recedes: 2 s at 10 Hz, longer than
/// any drop-out of what stands in front lasts.
pub const RECEDE_RETURNS: u8 = 20;

/// Scans without a return after which a beam no longer holds its range: drop-outs last 1.5 to 2.7.
const LOST_SCANS: u8 = 3;

/// Longest time a beam is said to hold a range, 0.1 s: what fits 16 bits, less room for the pauses
/// between scans.
pub const HELD_MAX_DS: u16 = 60_000;

/// What a beam shows in the latest scan.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Class {
    /// The background, or what lies behind it; or a beam that is not judged.
    Background,
    /// Something nearer than the background.
    Foreground,
    /// A wall beam without a valid return.
    NoReturn,
}

/// Class and counter of a beam in one byte; 0 is "at the background, nothing pending".
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Status(u8);

impl Status {
    pub(super) const QUIET: Self = Self(0);
    /// Behind the wall; counts the returns there.
    const BEHIND: u8 = 1;
    /// Foreground; counts the readings off the range it holds.
    const FOREGROUND: u8 = 2;
    /// A wall beam without a return; counts on for [`Self::BEHIND`].
    const NO_RETURN: u8 = 3;
    /// A wall beam without a return that was foreground before; counts the misses.
    const LOST: u8 = 4;
    /// At its background, foreground in the scan before.
    const LAPSED: u8 = 5;
    const KIND: u8 = 7;
    const COUNT_SHIFT: u32 = 3;

    const fn of(kind: u8, count: u8) -> Self {
        Self((kind & Self::KIND) | (count << Self::COUNT_SHIFT))
    }

    pub(crate) const fn is_quiet(self) -> bool {
        self.0 == 0
    }

    pub(crate) const fn class(self) -> Class {
        match self.0 & Self::KIND {
            Self::FOREGROUND => Class::Foreground,
            Self::NO_RETURN | Self::LOST => Class::NoReturn,
            _ => Class::Background,
        }
    }

    const fn kind(self) -> u8 {
        self.0 & Self::KIND
    }

    const fn count(self) -> u8 {
        self.0 >> Self::COUNT_SHIFT
    }

    /// After a scan in which the beam is at its background.
    const fn at_background(self) -> Self {
        if self.kind() == Self::FOREGROUND { Self::of(Self::LAPSED, 0) } else { Self::QUIET }
    }

    /// After a scan in which a wall beam returns nothing: what it held goes on for a while.
    const fn without_return(self) -> Self {
        match self.kind() {
            Self::BEHIND | Self::NO_RETURN => Self::of(Self::NO_RETURN, self.count()),
            Self::FOREGROUND => Self::of(Self::LOST, 0),
            Self::LOST if self.count() < LOST_SCANS => Self::of(Self::LOST, self.count() + 1),
            _ => Self::of(Self::NO_RETURN, 0),
        }
    }
}

impl<const BEAMS: usize> Background<BEAMS> {
    /// Compares a scan with the background; `now_ds` is the sensor's time in 0.1 s.
    ///
    /// Beams the scan does not hold keep nothing pending.
    pub(crate) fn judge(&mut self, scan: &Scan<'_>, now_ds: u32) {
        let Self { bands, statuses, profiles, asides, published_far_mm, .. } = self;
        let now_ds = now_ds as u16;
        let mut drifted = false;
        let beams = scan.ranges_mm.iter().zip(bands.iter_mut()).zip(statuses.iter_mut());
        for (beam, ((&value_mm, band), status)) in beams.enumerate().take(self.beams) {
            if band.holds(value_mm) {
                if !status.is_quiet() {
                    *status = status.at_background();
                }
                continue;
            }
            let Some(aside) = asides.get_mut(beam) else { continue };
            let verdict = judge_beam(scan.geometry, value_mm, beam, profiles, *status, aside, now_ds);
            *status = match verdict {
                Verdict::Status(status) => status,
                Verdict::Recede => {
                    if let (Some(profile), Some(&published_mm)) =
                        (profiles.get_mut(beam), published_far_mm.get(beam))
                    {
                        profile.far_mm = aside.range_mm;
                        profile.spread_mm = profile.spread_mm.max(noise_mm(aside.range_mm));
                        *band = Band::of(profile, scan.geometry);
                        drifted |= profile.far_mm.abs_diff(published_mm) >= PUBLISH_DRIFT_MM;
                    }
                    Status::QUIET
                }
            };
        }
        for status in statuses.iter_mut().take(self.beams).skip(scan.ranges_mm.len()) {
            *status = Status::QUIET;
        }
        self.drifted |= drifted;
    }

    /// What every beam shows in the latest scan.
    #[must_use]
    pub(crate) fn statuses(&self) -> &[Status] {
        self.statuses.get(..self.beams).unwrap_or(&[])
    }

    /// What beam `beam` shows in the latest scan; background for a beam that does not exist.
    #[must_use]
    pub fn class(&self, beam: usize) -> Class {
        self.statuses().get(beam).map_or(Class::Background, |status| status.class())
    }

    /// For how long beam `beam` has been foreground at its range, in 0.1 s; 0 when it is none.
    pub(crate) fn held_ds(&self, beam: usize, now_ds: u32) -> u16 {
        match (self.class(beam), self.asides.get(beam)) {
            (Class::Foreground, Some(aside)) => (now_ds as u16).wrapping_sub(aside.since_ds),
            _ => 0,
        }
    }
}

enum Verdict {
    Status(Status),
    Recede,
}

/// The long way, for a reading that is not simply the beam's own background.
fn judge_beam(
    geometry: &Geometry,
    value_mm: u16,
    beam: usize,
    profiles: &[BeamProfile],
    status: Status,
    aside: &mut Aside,
    now_ds: u16,
) -> Verdict {
    let Some(profile) = profiles.get(beam) else { return Verdict::Status(Status::QUIET) };
    let Some(range_mm) = geometry.reading(value_mm).range_mm() else {
        let wall = profile.state == BeamState::Wall;
        return Verdict::Status(if wall { status.without_return() } else { status.at_background() });
    };
    let holds = aside.range_mm.abs_diff(range_mm) <= profile.tolerance_mm();
    if profile.state == BeamState::Wall && range_mm > profile.far_mm {
        let count =
            if matches!(status.kind(), Status::BEHIND | Status::NO_RETURN) { status.count() } else { 0 };
        if count == 0 || !holds {
            *aside = Aside { range_mm, since_ds: now_ds };
            return Verdict::Status(Status::of(Status::BEHIND, 1));
        }
        // One millimetre towards each return: settles at their median.
        let farther = range_mm > aside.range_mm;
        aside.range_mm =
            if farther { aside.range_mm.saturating_add(1) } else { aside.range_mm.saturating_sub(1) };
        let receded = count + 1 >= RECEDE_RETURNS;
        return if receded {
            Verdict::Recede
        } else {
            Verdict::Status(Status::of(Status::BEHIND, count + 1))
        };
    }
    let first = beam.saturating_sub(DILATION_BEAMS);
    let mut neighbours = profiles.iter().skip(first).take(beam - first + 1 + DILATION_BEAMS);
    if neighbours.any(|neighbour| neighbour.explains(range_mm)) {
        return Verdict::Status(status.at_background());
    }
    Verdict::Status(hold(range_mm, holds, status, aside, now_ds))
}

/// Keeps a foreground beam's range and since when it holds it; a single reading off it is forgiven.
fn hold(range_mm: u16, holds: bool, status: Status, aside: &mut Aside, now_ds: u16) -> Status {
    let (held, missed) = match status.kind() {
        Status::FOREGROUND => (true, status.count() > 0),
        Status::LAPSED | Status::LOST => (true, true),
        _ => (false, false),
    };
    if held && (holds || !missed) {
        if now_ds.wrapping_sub(aside.since_ds) > HELD_MAX_DS {
            aside.since_ds = now_ds.wrapping_sub(HELD_MAX_DS);
        }
        return Status::of(Status::FOREGROUND, u8::from(!holds));
    }
    *aside = Aside { range_mm, since_ds: now_ds };
    Status::of(Status::FOREGROUND, 0)
}
