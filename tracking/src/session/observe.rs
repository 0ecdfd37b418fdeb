//! From a report to an observation, or to the count of what was dropped and why.
//!
//! ```text
//!   report ─▶ sequence: far, repeated ─▶ clock, setup: early ─▶ place: none ─▶ time: late, ahead ─▶ Observation
//! ```

use std::sync::Arc;

use kehai::centre::Estimator;
use kehai::visibility;
use kehai::wire::{Report, ReportHead};

use super::Session;
use super::outstanding::ANSWER_US;
use super::sequence::{Arrival, Sequences};
use super::start::SILENT_US;
use crate::observation::{AHEAD_S, BodySize, Detection, LATE_S, Observation};
use crate::snapshot::Drops;

impl Session {
    /// What a report says that arrived at `now_us` on the host's clock; none if it is not to be used, which is counted.
    pub(super) fn observe(
        &mut self,
        report: &Report<'_>,
        now_us: u64,
        estimator: Estimator,
        drops: &mut Drops,
    ) -> Option<Observation> {
        let head = &report.head;
        let (arrival, sequences) = self.order(head, now_us, drops)?;
        if let Some(monitor) = &mut self.monitor {
            monitor.report(report, arrival, now_us);
        }
        if arrival == Arrival::Repeated {
            drops.repeated += 1;
            return None;
        }
        self.last_report_us = now_us;
        let (Some(setup), Some(start_s)) = (&self.setup, self.clock.host_s(head.stamp_us)) else {
            drops.early += 1;
            return None;
        };
        if setup.number != head.setup {
            drops.early += 1;
            return None;
        }
        let Some((view, beams)) = setup.view.as_ref().zip(setup.beams.as_ref()) else {
            drops.unplaced += 1;
            return None;
        };
        let period_s = f64::from(view.geometry.period_us()) * 1e-6;
        let now_s = now_us as f64 * 1e-6;
        if !is_timely(start_s, period_s, now_s, drops) {
            return None;
        }
        self.sequences = sequences;
        // Nothing but arrivals moves the clock of what follows.
        let start_s = start_s.min(now_s);
        let sizes = report.sizes.iter().map(BodySize::of).chain(std::iter::repeat(None));
        let mut candidates: Vec<_> =
            report.candidates.iter().map(|candidate| beams.candidate(candidate)).zip(sizes).collect();
        beams.order(&mut candidates);
        let background_mm = self.profile.empty_mm(head.background_version, setup.geometry.beams());
        let mut empty_mm = background_mm.to_vec();
        let unseen = report.unseen.iter().map(|span| beams.span(span));
        visibility::cover(
            &view.geometry,
            candidates.iter().map(|(candidate, _)| candidate),
            unseen,
            &mut empty_mm,
        );
        let detections = candidates
            .into_iter()
            .map(|(candidate, size)| Detection {
                size,
                ..Detection::new(candidate, view, start_s, estimator)
            })
            .collect();
        Some(Observation { view: Arc::clone(view), start_s, detections, empty_mm, background_mm })
    }

    /// Where a report stands among those of the device, and the numbers from now on if it is used; None if it is far from
    /// all of them.
    pub(super) fn order(
        &mut self,
        head: &ReportHead,
        now_us: u64,
        drops: &mut Drops,
    ) -> Option<(Arrival, Sequences)> {
        let has_answered =
            self.answered_us.is_some_and(|answered_us| now_us.saturating_sub(answered_us) <= ANSWER_US);
        let may_jump = has_answered && now_us.saturating_sub(self.last_report_us) >= SILENT_US;
        let (arrival, sequences) = self.sequences.with(head.sequence, may_jump);
        if arrival == Arrival::Far {
            drops.jump += 1;
            return None;
        }
        // A number far ahead counts once its report is used: else one with a false time would pass over the true ones.
        if arrival.is_near() {
            self.sequences = sequences;
        }
        if let Arrival::Ahead(_) = arrival {
            self.current = Some((head.setup, head.background_version));
        }
        Some((arrival, sequences))
    }
}

/// Whether what began at `start_s`, and took `period_s`, is used at `now_s`.
pub(super) fn is_timely(start_s: f64, period_s: f64, now_s: f64, drops: &mut Drops) -> bool {
    if now_s - start_s > LATE_S + period_s {
        drops.late += 1;
        return false;
    }
    if start_s - now_s > AHEAD_S {
        drops.ahead += 1;
        return false;
    }
    true
}
