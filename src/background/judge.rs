//! Judging one scan: what every beam sees, compared with what it measures in the empty room.
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

use core::cmp::Ordering;

use super::{Background, Beam, BeamState, DILATION_BEAMS, PUBLISH_DRIFT_MM, noise_mm};
use crate::scan::Scan;

/// Consistent returns in a row behind a wall after which it recedes: 2 s at 10 Hz, longer than
/// any drop-out of what stands in front lasts.
pub(crate) const RECEDE_RETURNS: u8 = 20;

/// Scans without a return after which a beam no longer holds its range: drop-outs last 1.5 to 2.7.
const LOST_SCANS: u8 = 3;

/// Longest time a beam is said to hold a range, 0.1 s: what fits 16 bits, less the time between two
/// sweeps and the longest pause between scans.
pub(crate) const HELD_MAX_DS: u16 = 60_000;

/// Ages are limited whenever the time in 0.1 s passes a multiple of this plus one: every 410 s.
const HELD_SWEEP_MASK_DS: u32 = 0xfff;

/// What a beam shows in the latest scan.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Class {
    /// The background, or what lies behind it; or a beam that is not judged.
    Background,
    /// Something nearer than the background.
    Foreground,
    /// A wall beam without a valid return, or any that could not be measured.
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

    /// A status of the class, for the tests of what comes after.
    #[cfg(test)]
    pub(crate) const fn showing(class: Class) -> Self {
        match class {
            Class::Background => Self::QUIET,
            Class::Foreground => Self(Self::FOREGROUND),
            Class::NoReturn => Self(Self::NO_RETURN),
        }
    }

    const fn of(kind: u8, count: u8) -> Self {
        Self((kind & Self::KIND) | (count << Self::COUNT_SHIFT))
    }

    pub(crate) const fn is_quiet(self) -> bool {
        self.0 == 0
    }

    /// Whether all of `four` are quiet; compiles to one comparison.
    pub(crate) const fn all_quiet(four: &[Self; 4]) -> bool {
        let [a, b, c, d] = four;
        u32::from_ne_bytes([a.0, b.0, c.0, d.0]) == 0
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
    pub fn judge(&mut self, scan: &Scan<'_>, now_ds: u32) {
        let beams = scan.ranges_mm.len().min(self.beams);
        if let Some(missing) = self.statuses.get_mut(beams..self.beams) {
            missing.fill(Status::QUIET);
        }
        if (now_ds ^ self.judged_ds) & !HELD_SWEEP_MASK_DS != 0 {
            self.limit_ages(now_ds as u16);
        }
        self.judged_ds = now_ds;
        let mut at = 0;
        while at < beams {
            at += self.quiet_beams(scan, at, beams);
            at = self.judge_some(scan, at, beams, now_ds as u16);
        }
    }

    /// Beams from `from` on, four by four, that are quietly at their background: nothing is to be done.
    fn quiet_beams(&self, scan: &Scan<'_>, from: usize, end: usize) -> usize {
        let values_mm = scan.ranges_mm.get(from..end).unwrap_or(&[]).as_chunks::<4>().0;
        let bands = self.bands.get(from..end).unwrap_or(&[]).as_chunks::<4>().0;
        let statuses = self.statuses.get(from..end).unwrap_or(&[]).as_chunks::<4>().0;
        let fours = values_mm.iter().zip(bands).zip(statuses);
        let quiet = fours.take_while(|((values_mm, bands), statuses)| {
            let ([a, b, c, d], [first, second, third, fourth]) = (values_mm, bands);
            Status::all_quiet(statuses)
                && first.holds(*a)
                && second.holds(*b)
                && third.holds(*c)
                && fourth.holds(*d)
        });
        4 * quiet.count()
    }

    /// Judges four beams from `from` on, and more up to the next that is quietly at its background.
    /// Returns where it stopped.
    #[inline(never)]
    fn judge_some(&mut self, scan: &Scan<'_>, from: usize, end: usize, now_ds: u16) -> usize {
        let (Some(values_mm), Some(bands), Some(per_beam), Some(statuses)) = (
            scan.ranges_mm.get(from..end),
            self.bands.get(from..end),
            self.per_beam.get_mut(from..end),
            self.statuses.get_mut(from..end),
        ) else {
            return end;
        };
        let valid_mm = scan.geometry.range_min_mm()..=scan.geometry.range_max_mm();
        let mut at = from;
        for (((&value_mm, band), beam), status) in values_mm.iter().zip(bands).zip(per_beam).zip(statuses) {
            if band.holds(value_mm) {
                if status.is_quiet() && at >= from + 4 {
                    break;
                }
                *status = status.at_background();
            } else if value_mm < beam.clear_mm && valid_mm.contains(&value_mm) {
                *status = foreground(value_mm, *status, beam, now_ds);
            } else {
                self.judge_beam(scan, at, now_ds);
                return at + 1;
            }
            at += 1;
        }
        at
    }

    /// The long way, for a reading that is not simply the beam's own background.
    fn judge_beam(&mut self, scan: &Scan<'_>, at: usize, now_ds: u16) {
        let (Some(&value_mm), Some(&band), Some(status), Some(beam)) = (
            scan.ranges_mm.get(at),
            self.bands.get(at),
            self.statuses.get_mut(at),
            self.per_beam.get_mut(at),
        ) else {
            return;
        };
        let wall = beam.profile.state == BeamState::Wall;
        let Some(range_mm) = scan.geometry.reading(value_mm).range_mm() else {
            // In the open nothing returns, but a step that cannot be measured does not say so.
            let is_background = !wall && band.holds(value_mm);
            *status = if is_background { status.at_background() } else { status.without_return() };
            return;
        };
        if band.holds(value_mm) {
            *status = status.at_background();
        } else if range_mm < beam.clear_mm {
            *status = foreground(range_mm, *status, beam, now_ds);
        } else if wall && range_mm > beam.profile.far_mm {
            self.behind(scan, at, range_mm, now_ds);
        } else {
            let first = at.saturating_sub(DILATION_BEAMS);
            let mut around = self.per_beam.iter().skip(first).take(at - first + 1 + DILATION_BEAMS);
            let explained = around.any(|beam| beam.profile.explains(range_mm));
            if let (Some(status), Some(beam)) = (self.statuses.get_mut(at), self.per_beam.get_mut(at)) {
                *status = if explained {
                    status.at_background()
                } else {
                    foreground(range_mm, *status, beam, now_ds)
                };
            }
        }
    }

    /// Keeps the ages of what is held within the reach of their 16 bits.
    fn limit_ages(&mut self, now_ds: u16) {
        for beam in self.per_beam.iter_mut().take(self.beams) {
            if now_ds.wrapping_sub(beam.since_ds) > HELD_MAX_DS {
                beam.since_ds = now_ds.wrapping_sub(HELD_MAX_DS);
            }
        }
    }

    /// A return behind the wall: when enough of them agree, the wall recedes to them.
    fn behind(&mut self, scan: &Scan<'_>, at: usize, range_mm: u16, now_ds: u16) {
        let (Some(status), Some(beam)) = (self.statuses.get_mut(at), self.per_beam.get_mut(at)) else {
            return;
        };
        let count =
            if matches!(status.kind(), Status::BEHIND | Status::NO_RETURN) { status.count() } else { 0 };
        if count == 0 || beam.held_mm.abs_diff(range_mm) > beam.profile.tolerance_mm() {
            beam.hold(range_mm, now_ds);
            *status = Status::of(Status::BEHIND, 1);
            return;
        }
        // One millimetre towards each return: settles at their median.
        beam.held_mm = match range_mm.cmp(&beam.held_mm) {
            Ordering::Less => beam.held_mm.saturating_sub(1),
            Ordering::Equal => beam.held_mm,
            Ordering::Greater => beam.held_mm.saturating_add(1),
        };
        if count + 1 < RECEDE_RETURNS {
            *status = Status::of(Status::BEHIND, count + 1);
            return;
        }
        *status = Status::QUIET;
        let far_mm = beam.held_mm;
        beam.profile.far_mm = far_mm;
        beam.profile.spread_mm = beam.profile.spread_mm.max(noise_mm(far_mm));
        let published_mm = self.published_far_mm.get(at).copied().unwrap_or(far_mm);
        self.drifted |= far_mm.abs_diff(published_mm) >= PUBLISH_DRIFT_MM;
        self.refresh(at, at + 1, scan.geometry);
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
        match (self.class(beam), self.per_beam.get(beam)) {
            (Class::Foreground, Some(beam)) => (now_ds as u16).wrapping_sub(beam.since_ds),
            _ => 0,
        }
    }
}

/// Keeps a foreground beam's range and since when it holds it; a single reading off it is forgiven.
fn foreground(range_mm: u16, status: Status, beam: &mut Beam, now_ds: u16) -> Status {
    let off_mm = beam.held_mm.abs_diff(range_mm);
    let holds = off_mm <= beam.profile.tolerance_mm();
    let (held, missed) = match status.kind() {
        Status::FOREGROUND => (true, status.count() > 0),
        Status::LAPSED | Status::LOST => (true, true),
        _ => (false, false),
    };
    if held && (holds || !missed) {
        return Status::of(Status::FOREGROUND, u8::from(!holds));
    }
    beam.hold(range_mm, now_ds);
    Status::of(Status::FOREGROUND, 0)
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{BEAMS, BackgroundFixture};
    use super::*;
    use crate::sensor_model::SensorModel;

    fn foreground_beams(fixture: &BackgroundFixture) -> std::vec::Vec<usize> {
        (0..BEAMS).filter(|&beam| fixture.background.class(beam) == Class::Foreground).collect()
    }

    #[test]
    fn a_hand_in_front_of_the_wall_is_foreground_and_less_is_not() {
        let mut fixture = BackgroundFixture::learned();
        fixture.scan(|beam| {
            BackgroundFixture::room(beam) - 95 * u16::from(beam == 5) - 105 * u16::from(beam == 8)
        });
        assert_eq!(foreground_beams(&fixture), [8]);
    }

    #[test]
    fn any_return_of_an_open_beam_is_foreground_and_none_is_background() {
        let mut fixture = BackgroundFixture::learned();
        fixture.scan(|beam| if beam == 55 { 5000 } else { BackgroundFixture::room(beam) });
        assert_eq!(foreground_beams(&fixture), [55]);
        assert_eq!(fixture.background.class(56), Class::Background);
    }

    #[test]
    fn an_open_beam_that_could_not_be_measured_is_not_empty() {
        let mut fixture = BackgroundFixture::learned();
        // A person leans on the sensor, which reads 19 everywhere; then goes.
        fixture.scan(|_| 19);
        assert!([5, 25, 55].into_iter().all(|beam| fixture.background.class(beam) == Class::NoReturn));
        fixture.scan(BackgroundFixture::room);
        assert_eq!(fixture.background.class(55), Class::Background);
    }

    #[test]
    fn an_open_beam_of_a_utm_is_empty_by_the_code_for_nothing_and_by_no_other() {
        let mut fixture = BackgroundFixture::with(SensorModel::UTM_30LX.blind_code);
        // From beam 50 on nothing returns, but for one that cannot be measured.
        let room = |scan: usize, beam: usize| match beam {
            63 => 2 + (scan % 4) as u16,
            50.. => 1,
            _ => BackgroundFixture::room(beam),
        };
        fixture.learn(60, room);
        let state = |beam| fixture.profile(beam).state;
        assert_eq!((state(55), state(63)), (BeamState::Open, BeamState::Unknown));
        for code in 2..=5 {
            fixture.scan(|beam| if beam == 55 { code } else { room(0, beam) });
            assert_eq!(fixture.background.class(55), Class::NoReturn, "code {code}");
            assert_eq!(fixture.background.class(56), Class::Background);
        }
        fixture.scan(|beam| room(0, beam));
        assert_eq!(fixture.background.class(55), Class::Background);
        fixture.scan(|beam| if beam == 55 { crate::scan::NO_RETURN_MM } else { room(0, beam) });
        assert_eq!(fixture.background.class(55), Class::Background, "farther than can be said");
    }

    #[test]
    fn a_wall_without_a_return_is_neither() {
        let mut fixture = BackgroundFixture::learned();
        fixture.scan(|beam| if beam == 5 { 0 } else { BackgroundFixture::room(beam) });
        assert_eq!(fixture.background.class(5), Class::NoReturn);
    }

    #[test]
    fn an_edge_of_furniture_may_jitter_by_two_beams() {
        let mut fixture = BackgroundFixture::learned();
        fixture.scan(|beam| if (17..20).contains(&beam) { 2000 } else { BackgroundFixture::room(beam) });
        assert_eq!(foreground_beams(&fixture), [17]);
    }

    #[test]
    fn before_a_background_is_learned_nothing_is_foreground() {
        let mut fixture = BackgroundFixture::new();
        fixture.scan(|_| 500);
        assert!(foreground_beams(&fixture).is_empty());
    }

    #[test]
    fn who_stands_still_never_becomes_wall() {
        let mut fixture = BackgroundFixture::learned();
        for _ in 0..20_000 {
            fixture.scan(|beam| if (5..15).contains(&beam) { 1500 } else { BackgroundFixture::room(beam) });
        }
        assert_eq!(foreground_beams(&fixture).len(), 10);
        assert_eq!((fixture.model(10).far_mm, fixture.model(10).near_mm), (4000, 0));
    }

    #[test]
    fn a_wall_recedes_after_twenty_returns_that_agree() {
        let behind = |beam| if beam == 25 { 3500 } else { BackgroundFixture::room(beam) };
        let mut fixture = BackgroundFixture::learned();
        for _ in 0..19 {
            fixture.scan(behind);
        }
        assert_eq!(fixture.model(25).far_mm, 2000);
        fixture.scan(behind);
        assert_eq!(fixture.model(25).far_mm, 3500);
        fixture.scan(|beam| if beam == 25 { 2000 } else { BackgroundFixture::room(beam) });
        // Its neighbours are still at 2 m: within the dilation.
        assert_eq!(fixture.background.class(25), Class::Background);
    }

    #[test]
    fn returns_behind_that_do_not_agree_or_come_with_the_wall_between_move_nothing() {
        let mut fixture = BackgroundFixture::learned();
        for scan in 0..200 {
            fixture.scan(|beam| match beam {
                25 => 3000 + 100 * (scan % 5),
                27 if scan % 15 != 0 => 3500,
                _ => BackgroundFixture::room(beam),
            });
        }
        assert_eq!((fixture.model(25).far_mm, fixture.model(27).far_mm), (2000, 2000));
    }

    #[test]
    fn a_drop_out_does_not_interrupt_a_receding_wall() {
        let mut fixture = BackgroundFixture::learned();
        for scan in 0..24 {
            fixture.scan(|beam| {
                if beam == 25 { 3500 * u16::from(scan % 6 != 5) } else { BackgroundFixture::room(beam) }
            });
        }
        assert_eq!(fixture.model(25).far_mm, 3500);
    }

    #[test]
    fn holding_a_range_is_timed_and_a_single_miss_forgiven() {
        let mut fixture = BackgroundFixture::learned();
        for scan in 0..50 {
            fixture.scan(|beam| match beam {
                10 => 1500 + 10 * (scan % 3),
                // One reading off, a drop-out, one look at the wall.
                11 => [1500, 1500, 1500, 1700, 1500, 0, 1500, 4000][usize::from(scan) % 8],
                // Moves on every second; the first reading elsewhere is still forgiven.
                12 => 1500 + 100 * (scan / 10),
                _ => BackgroundFixture::room(beam),
            });
        }
        let held = |beam| fixture.background.held_ds(beam, fixture.now_ds);
        assert_eq!((held(10), held(11), held(12)), (49, 49, 8));
        assert_eq!(held(5), 0);
    }

    #[test]
    fn a_long_time_is_cut_off_and_never_wraps() {
        let mut fixture = BackgroundFixture::learned();
        let stander = |beam| if (5..15).contains(&beam) { 1500 } else { BackgroundFixture::room(beam) };
        fixture.scan(stander);
        for _ in 0..400 {
            fixture.now_ds += 999;
            fixture.scan(stander);
        }
        let held_ds = fixture.background.held_ds(10, fixture.now_ds);
        assert!((HELD_MAX_DS..u16::MAX).contains(&held_ds), "{held_ds}");
    }
}
