//! For how long each beam has not seen its background, and how much of it that makes.
//!
//! ```text
//!   beam      in a candidate, or unseen     at its background
//!   doubt     grows with time, to 60 s      falls four times as fast
//!
//!   ▁▁▁▁▁▁██████████▁▁▁▁ a quarter of the view at 60 s: covered or moved
//!   ▁▂▁▁▃▁▁▂▁▁▁▄▁▁▂▁▁▁▁▁ people come and go
//! ```

use kehai::scan::Geometry;
use kehai::unseen::UnseenReason;
use kehai::wire::Report;

use crate::figures::seconds;

/// Doubt at which a beam is taken to be lost, s.
const LOST_S: f32 = 60.0;

/// How much faster doubt falls than it grows: a person who stands still for a minute sways, and one who leaves is gone.
const FALL: f32 = 4.0;

/// Longest time between two reports that counts, s: what was in a longer one is not known.
const GAP_S: f32 = 1.0;

/// Time constant of the share that returns nothing, s.
const MISSING_S: f64 = 60.0;

/// What a module's beams contradict of its background.
#[derive(Clone, Debug)]
pub struct Doubt {
    geometry: Geometry,
    doubt_s: Vec<f32>,
    /// Whether the newest report contradicts a beam's background.
    contradicted: Vec<bool>,
    /// When the newest report came, µs of the host's clock.
    at_us: Option<u64>,
    unseen_share: f64,
    missing_share: f64,
    judged_s: f64,
}

impl Doubt {
    /// With nothing seen yet.
    pub fn new(geometry: Geometry) -> Self {
        let beams = usize::from(geometry.beams());
        Self {
            geometry,
            doubt_s: vec![0.0; beams],
            contradicted: vec![false; beams],
            at_us: None,
            unseen_share: 1.0,
            missing_share: 0.0,
            judged_s: 0.0,
        }
    }

    /// Where the beams point.
    pub const fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Adds a report, newer by its number than all before, that came at `now_us`. Time is that of arrivals: after one stamp from the
    /// future every true one would be older.
    pub fn update(&mut self, report: &Report<'_>, now_us: u64) {
        let last_us = self.at_us.replace(now_us).unwrap_or(now_us);
        if report.head.background_version == 0 {
            self.doubt_s.fill(0.0);
            (self.unseen_share, self.missing_share, self.judged_s) = (1.0, 0.0, 0.0);
            return;
        }
        let passed_s = (seconds(last_us, now_us) as f32).min(GAP_S);
        self.contradicted.fill(false);
        let (mut unseen, mut missing) = (0, 0);
        for candidate in report.candidates.iter() {
            let first = usize::from(self.geometry.beam(candidate.first_step));
            let last = usize::from(self.geometry.beam(candidate.last_step));
            mark(&mut self.contradicted, first..last + 1);
        }
        for span in report.unseen.iter() {
            let marked = mark(&mut self.contradicted, span.beams_of(&self.geometry));
            unseen += marked;
            missing += if span.reason == UnseenReason::Overflow { 0 } else { marked };
        }
        for (doubt_s, &contradicted) in self.doubt_s.iter_mut().zip(&self.contradicted) {
            let change_s = if contradicted { passed_s } else { -FALL * passed_s };
            *doubt_s = (*doubt_s + change_s).clamp(0.0, LOST_S);
        }
        let beams = self.contradicted.len().max(1) as f64;
        let missing = missing as f64 / beams;
        self.unseen_share = unseen as f64 / beams;
        self.judged_s += f64::from(passed_s);
        // A mean at first, later one that forgets.
        let weight = f64::from(passed_s) / self.judged_s.min(MISSING_S);
        self.missing_share = if weight.is_finite() {
            self.missing_share + weight * (missing - self.missing_share)
        } else {
            missing
        };
    }

    /// Share of the beams that the newest report says nothing of; everything without a background.
    pub const fn unseen_share(&self) -> f64 {
        self.unseen_share
    }

    /// Share of the beams that return nothing or nothing usable, over a minute; 0 before there was one.
    pub fn missing_share(&self) -> f64 {
        if self.judged_s < MISSING_S { 0.0 } else { self.missing_share }
    }

    /// The angle in which the background has not been seen for a minute, and the whole view, rad.
    pub fn lost_rad(&self) -> (f64, f64) {
        let beam_rad = f64::from(self.geometry.beam_rad());
        let lost = self.doubt_s.iter().filter(|doubt_s| **doubt_s >= LOST_S).count();
        (lost as f64 * beam_rad, self.doubt_s.len() as f64 * beam_rad)
    }

    /// Bearings of the first and the last beam in which that is so, rad, counter-clockwise from ahead.
    pub fn lost_between_rad(&self) -> Option<(f64, f64)> {
        let lost = |doubt_s: &f32| *doubt_s >= LOST_S;
        let first = self.doubt_s.iter().position(lost)?;
        let last = self.doubt_s.iter().rposition(lost)?;
        let [first, last] = [first, last]
            .map(|beam| f64::from(self.geometry.bearing_rad(u16::try_from(beam).unwrap_or(u16::MAX))));
        Some((first, last))
    }
}

/// Marks beams; how many of them there are.
fn mark(marks: &mut [bool], beams: std::ops::Range<usize>) -> usize {
    let marks = marks.iter_mut().skip(beams.start).take(beams.len());
    marks.map(|mark| *mark = true).count()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use kehai::candidate::Candidate;
    use kehai::scan::URG_04LX;
    use kehai::unseen::UnseenSpan;
    use kehai::wire::{List, ReportHead};

    pub fn geometry() -> Geometry {
        Geometry::new(URG_04LX).unwrap()
    }

    /// Steps from `first` to `last` in which something stands.
    pub fn standing(first_step: u16, last_step: u16) -> Candidate {
        Candidate { first_step, last_step, beams: last_step - first_step + 1, ..Candidate::default() }
    }

    pub fn unseen(first_step: u16, beams: u16, reason: UnseenReason) -> UnseenSpan {
        UnseenSpan { first_step, beams, reason, near_mm: None }
    }

    /// A report at this time, of a module that has a background.
    pub fn report<'a>(at_s: f64, candidates: &'a [Candidate], unseen: &'a [UnseenSpan]) -> Report<'a> {
        let stamp_us = (at_s * 1e6) as u64;
        let head = ReportHead { stamp_us, background_version: 1, ..ReportHead::default() };
        Report { head, candidates: List::new(candidates), unseen: List::new(unseen), sizes: List::default() }
    }

    fn feed(doubt: &mut Doubt, from_s: u32, to_s: u32, candidates: &[Candidate], spans: &[UnseenSpan]) {
        for tenth in 10 * from_s..10 * to_s {
            let report = report(f64::from(tenth) * 0.1, candidates, spans);
            doubt.update(&report, report.head.stamp_us);
        }
    }

    #[test]
    fn what_stands_before_the_background_for_a_minute_is_lost_and_comes_back_when_it_goes() {
        let mut doubt = Doubt::new(geometry());
        let board = [standing(200, 455)];
        feed(&mut doubt, 0, 59, &board, &[]);
        assert_eq!(doubt.lost_rad().0, 0.0);
        feed(&mut doubt, 59, 62, &board, &[]);
        let (lost_rad, view_rad) = doubt.lost_rad();
        assert!((lost_rad.to_degrees() - 90.0).abs() < 0.1, "{lost_rad}");
        assert!((view_rad.to_degrees() - 239.8).abs() < 0.1, "{view_rad}");
        let (first_rad, last_rad) = doubt.lost_between_rad().unwrap();
        assert!((first_rad.to_degrees() + 64.7).abs() < 0.1 && (last_rad.to_degrees() - 25.0).abs() < 0.1);
        feed(&mut doubt, 62, 64, &[], &[]);
        assert_eq!(doubt.lost_rad().0, 0.0);
    }

    #[test]
    fn people_who_walk_past_all_day_lose_nothing() {
        let mut doubt = Doubt::new(geometry());
        for second in 0..3600u16 {
            // 60° wide at 0.4 m, there for two seconds of every three.
            let person = [standing(44 + second % 500, 44 + second % 500 + 171)];
            let there = if second % 3 == 0 { &[][..] } else { &person[..] };
            feed(&mut doubt, second.into(), u32::from(second) + 1, there, &[]);
            assert_eq!(doubt.lost_rad().0, 0.0);
        }
    }

    #[test]
    fn the_share_that_returns_nothing_is_a_minute_s_mean() {
        let mut doubt = Doubt::new(geometry());
        let spans = [unseen(100, 100, UnseenReason::NoReturn), unseen(400, 36, UnseenReason::TooShort)];
        feed(&mut doubt, 0, 60, &[], &spans);
        assert_eq!(doubt.missing_share(), 0.0, "too early to tell");
        feed(&mut doubt, 60, 62, &[], &spans);
        assert!((doubt.missing_share() - 136.0 / 682.0).abs() < 0.001, "{}", doubt.missing_share());
        assert!((doubt.unseen_share() - 136.0 / 682.0).abs() < 1e-9);
        feed(&mut doubt, 62, 66, &[], &[]);
        assert!(doubt.missing_share() > 0.18, "a few good seconds change little");
        // What there was no room for was not missing.
        feed(&mut doubt, 66, 400, &[], &[unseen(100, 300, UnseenReason::Overflow)]);
        assert!(doubt.missing_share() < 0.01, "{}", doubt.missing_share());
    }

    #[test]
    fn without_a_background_nothing_is_judged_and_nothing_contradicted() {
        let mut doubt = Doubt::new(geometry());
        let mut none = report(1.0, &[], &[]);
        none.head.background_version = 0;
        doubt.update(&none, 1_000_000);
        assert_eq!(doubt.unseen_share(), 1.0);
        assert_eq!(doubt.lost_rad().0, 0.0);
    }
}
