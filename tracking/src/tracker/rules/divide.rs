//! Merged detections: a candidate that covers several tracks is split between them.
//!
//! ```text
//!   predicted   ○       ○             ○     ○
//!              ╭──╮╱╲╭──╮            ╭─────────╮
//!   detected   ●         ●    ─▶     ●   │     ●    at the concavity between the two, or at the bearing half way
//! ```
//!
//! A device never splits: only the host knows which tracks were there before.

use kehai::candidate::{Candidate, End, EndKind};
use kehai::centre::Estimator;

use crate::geometry::Point;
use crate::observation::{Detection, View};

/// Candidates narrower than this are one body's, m: a large torso with its arms.
const ONE_BODY_M: f64 = 0.50;

/// How far behind the outline a predicted centre may be and still belong to it, m.
const BEHIND_M: f64 = 0.55;

/// Two bodies' middles are farther apart than this, m.
const APART_M: f64 = 0.3;

/// How far before the outline, m: what a prediction is off by.
const BEFORE_M: f64 = 0.15;

/// Cuts `seen` where it covers several of the predicted `places`; `None` when it does not.
pub fn divide(
    seen: &Detection,
    view: &View,
    start_s: f64,
    places: &[Point],
    estimator: Estimator,
) -> Option<Vec<Detection>> {
    let candidate = &seen.candidate;
    if seen.width_m < ONE_BODY_M && candidate.necks.is_empty() {
        return None;
    }
    let geometry = &view.geometry;
    let mut covered: Vec<(u16, Point)> = places
        .iter()
        .filter_map(|&place| {
            let (distance_m, beam) = view.beam_at(place);
            let step = geometry.step(beam?);
            let outline_m = f64::from(range_mm(candidate, step)) * 0.001;
            let inside = (candidate.first_step..=candidate.last_step).contains(&step);
            let behind_m = distance_m - outline_m;
            (inside && (-BEFORE_M..BEHIND_M).contains(&behind_m)).then_some((step, place))
        })
        .collect();
    covered.sort_unstable_by_key(|(step, _)| *step);
    covered.dedup_by(|one, other| (one.1 - other.1).length() < APART_M);
    let steps: Vec<u16> = covered.into_iter().map(|(step, _)| step).collect();
    if steps.len() < 2 {
        return None;
    }
    let mut pieces = Vec::new();
    let mut rest = candidate.clone();
    for pair in steps.windows(2) {
        let middle = pair[0].midpoint(pair[1]);
        let between = |step: u16| (pair[0]..=pair[1]).contains(&step);
        let neck = candidate.necks.iter().filter(|neck| between(neck.step)).max_by_key(|neck| neck.depth_mm);
        let cut = neck.map_or(middle, |neck| neck.step);
        if let Some((left, right)) = cut_at(&rest, cut) {
            pieces.push(left);
            rest = right;
        }
    }
    pieces.push(rest);
    Some(pieces.into_iter().map(|piece| Detection::new(piece, view, start_s, estimator)).collect())
}

/// Range of the outline at a step, mm, between the points that are known.
pub fn range_mm(candidate: &Candidate, step: u16) -> u16 {
    let points = candidate.contour.len();
    let span = f64::from(candidate.last_step - candidate.first_step).max(1.0);
    let place = (f64::from(step.saturating_sub(candidate.first_step)) / span * (points + 1) as f64).round();
    match (place as usize).min(points + 1) {
        0 => candidate.first_mm,
        point if point == points + 1 => candidate.last_mm,
        point => candidate.contour_mm(point - 1).unwrap_or(candidate.mid_mm),
    }
}

/// Two candidates of one, the second beginning after `step`; None when nothing of one is left.
fn cut_at(whole: &Candidate, step: u16) -> Option<(Candidate, Candidate)> {
    if step <= whole.first_step || step >= whole.last_step {
        return None;
    }
    let part = |first_step: u16, last_step: u16| {
        let inside = |at: u16| range_mm(whole, at);
        let span = last_step - first_step;
        let point = |number: u16| inside(first_step + (u32::from(span) * u32::from(number) / 8) as u16);
        let points: Vec<u16> = (1..8).map(point).collect();
        let (first_mm, last_mm) = (inside(first_step), inside(last_step));
        let near_mm = points.iter().copied().chain([first_mm, last_mm]).min().unwrap_or(whole.near_mm);
        let beams = u32::from(whole.beams) * u32::from(span + 1)
            / (u32::from(whole.last_step - whole.first_step) + 1);
        Candidate {
            first_step,
            last_step,
            first_mm,
            mid_mm: points[3],
            last_mm,
            near_mm,
            near_step: first_step.midpoint(last_step),
            beams: (beams as u16).max(1),
            first_end: if first_step == whole.first_step { whole.first_end } else { CUT },
            last_end: if last_step == whole.last_step { whole.last_end } else { CUT },
            contour: points
                .iter()
                .map(|&range_mm| ((range_mm - near_mm) / kehai::candidate::CONTOUR_UNIT_MM).min(255) as u8)
                .collect(),
            necks: heapless::Vec::new(),
            touches: true,
            narrow: false,
            static_ds: whole.static_ds,
        }
    };
    Some((part(whole.first_step, step), part(step + 1, whole.last_step)))
}

const CUT: End = End { kind: EndKind::Neck, step_mm: 0 };
