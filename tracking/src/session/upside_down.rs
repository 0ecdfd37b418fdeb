//! What a module that hangs head down reports, as one that stands upright would have seen it.
//!
//! ```text
//!            front                       front
//!     last ╲   │   ╱ first        first ╲   │   ╱ last      the first beam is the leftmost one:
//!           ╲  │  ╱                      ╲  │  ╱            beams are numbered from the other end,
//!            ● upright                    ● head down       and step s becomes step K − s,
//!         mirror turns to the left    … to the right         K = steps in a turn − 1
//! ```
//!
//! This is the only place that mirrors anything: behind it, in [`crate::observation`], every module looks to the left with
//! rising numbers. Only the time of a beam goes on running the other way: [`View::delay_s`](crate::observation::View::delay_s).

use kehai::candidate::Candidate;
use kehai::scan::{Geometry, GeometryParts};
use kehai::unseen::UnseenSpan;

/// The beams of a module as its sensor counts them, and as they are used.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Beams {
    own: Geometry,
    used: Geometry,
}

impl Beams {
    /// The beams of a sensor; None if it hangs head down and has more steps than a turn.
    #[must_use]
    pub fn new(own: Geometry, upside_down: bool) -> Option<Self> {
        let used = if upside_down { mirrored(&own)? } else { own };
        Some(Self { own, used })
    }

    /// As they are used.
    #[must_use]
    pub const fn used(&self) -> &Geometry {
        &self.used
    }

    fn is_upright(&self) -> bool {
        self.own == self.used
    }

    /// What stands at a step of the sensor's.
    fn step(&self, step: u16) -> u16 {
        self.used.step(self.own.beams().saturating_sub(1).saturating_sub(self.own.beam(step)))
    }

    /// A candidate as it is used.
    #[must_use]
    pub fn candidate(&self, mut seen: Candidate) -> Candidate {
        if self.is_upright() {
            return seen;
        }
        (seen.first_step, seen.last_step) = (self.step(seen.last_step), self.step(seen.first_step));
        (seen.first_mm, seen.last_mm) = (seen.last_mm, seen.first_mm);
        (seen.first_end, seen.last_end) = (seen.last_end, seen.first_end);
        seen.near_step = self.step(seen.near_step);
        seen.contour.reverse();
        for neck in &mut seen.necks {
            neck.step = self.step(neck.step);
        }
        seen.necks.reverse();
        seen
    }

    /// A span as it is used.
    #[must_use]
    pub fn span(&self, span: UnseenSpan) -> UnseenSpan {
        if self.is_upright() {
            return span;
        }
        let last = span.beams_of(&self.own).end.saturating_sub(1);
        let last = u16::try_from(last).unwrap_or(u16::MAX).min(self.own.beams().saturating_sub(1));
        let first = self.own.beams().saturating_sub(1) - last;
        UnseenSpan { first_step: self.used.step(first), ..span }
    }

    /// A list by bearing as it is used.
    pub fn order<T>(&self, list: &mut [T]) {
        if !self.is_upright() {
            list.reverse();
        }
    }
}

/// The beams of a sensor that hangs head down, numbered from right to left.
fn mirrored(own: &Geometry) -> Option<Geometry> {
    let parts = own.parts();
    let most = parts.steps_per_turn.checked_sub(1)?;
    // The last group may be incomplete, and is used as if it were not.
    let last = own.step(own.beams().checked_sub(1)?).checked_add(parts.cluster.checked_sub(1)?)?;
    Geometry::new(GeometryParts {
        first_step: most.checked_sub(last)?,
        last_step: most.checked_sub(parts.first_step)?,
        front_step: most.checked_sub(parts.front_step)?,
        ..parts
    })
    .ok()
}

#[cfg(test)]
mod tests {
    use kehai::candidate::{End, EndKind, Neck};

    use kehai::scan::URG_04LX;
    use kehai::unseen::UnseenReason;

    use super::*;
    use crate::geometry::{Point, Pose};
    use crate::observation::View;

    fn beams(cluster: u16) -> Beams {
        Beams::new(Geometry::new(GeometryParts { cluster, ..URG_04LX }).unwrap(), true).unwrap()
    }

    #[test]
    fn a_beam_to_the_left_points_to_the_right_and_keeps_its_time() {
        for cluster in [1, 2, 3] {
            let beams = beams(cluster);
            let pose = Pose { at: Point::default(), yaw_rad: 0.0 };
            let view = View { module: 0, pose, height_m: 0.6, geometry: beams.used, upside_down: true };
            let last = beams.own.beams() - 1;
            for beam in 0..=last {
                let (own, used) = (beams.own.bearing_rad(beam), beams.used.bearing_rad(last - beam));
                assert!((own + used).abs() < 1e-6, "cluster {cluster}, beam {beam}: {own} {used}");
                let late_s = view.delay_s(last - beam) - f64::from(beams.own.beam_delay_us(beam)) * 1e-6;
                assert!(late_s.abs() < 2e-6, "cluster {cluster}, beam {beam}: {late_s}");
            }
        }
    }

    #[test]
    fn a_candidate_and_a_span_change_sides() {
        let beams = beams(2);
        let end = |kind, step_mm| End { kind, step_mm };
        let own = Candidate {
            first_step: 44,
            last_step: 144,
            first_mm: 1000,
            last_mm: 1200,
            near_step: 64,
            near_mm: 990,
            first_end: end(EndKind::View, 1),
            last_end: end(EndKind::Body, -7),
            contour: heapless::Vec::from_slice(&[0, 1, 2]).unwrap(),
            necks: heapless::Vec::from_slice(&[
                Neck { step: 54, depth_mm: 60 },
                Neck { step: 100, depth_mm: 80 },
            ])
            .unwrap(),
            ..Candidate::default()
        };
        let used = beams.candidate(own.clone());
        let bearing = |geometry: &Geometry, step: u16| geometry.bearing_rad(geometry.beam(step));
        for (of_own, of_used) in [
            (own.first_step, used.last_step),
            (own.last_step, used.first_step),
            (own.near_step, used.near_step),
            (own.necks[0].step, used.necks[1].step),
            (own.necks[1].step, used.necks[0].step),
        ] {
            let sum = bearing(&beams.own, of_own) + bearing(&beams.used, of_used);
            assert!(sum.abs() < 1e-6, "{of_own} and {of_used}");
        }
        assert!(used.first_step < used.last_step);
        assert_eq!((used.first_mm, used.last_mm, used.near_mm), (1200, 1000, 990));
        assert_eq!((used.first_end.kind, used.last_end.kind), (EndKind::Body, EndKind::View));
        assert_eq!((used.contour.as_slice(), used.necks[0].depth_mm), (&[2, 1, 0][..], 80));
        let span = UnseenSpan { first_step: 46, beams: 3, reason: UnseenReason::NoReturn, near_mm: None };
        let last = usize::from(beams.own.beams()) - 1;
        assert_eq!(span.beams_of(&beams.own), 1..4);
        assert_eq!(beams.span(span).beams_of(&beams.used), last - 3..last);
    }

    #[test]
    fn every_sensor_can_hang_head_down() {
        let utm = GeometryParts {
            first_step: 0,
            last_step: 1080,
            front_step: 540,
            steps_per_turn: 1440,
            period_us: 25_000,
            ..URG_04LX
        };
        for cluster in [1, 2, 99] {
            let own = Geometry::new(GeometryParts { cluster, ..utm }).unwrap();
            assert_eq!(Beams::new(own, true).unwrap().used.beams(), own.beams());
        }
        let round = GeometryParts { last_step: 1439, cluster: 7, ..utm };
        assert_eq!(Beams::new(Geometry::new(round).unwrap(), true), None, "its last group goes round");
    }
}
