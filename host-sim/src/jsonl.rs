//! The lines of `candidates.jsonl`: one JSON object a scan, times in seconds, places in metres.

use kehai::candidate::{Candidate, EndKind};
use kehai::centre::{Estimator, centre};
use kehai::pipeline::Judgement;
use kehai::scan::Geometry;
use kehai::unseen::UnseenSpan;
use kehai::wire::Report;
use kehai_tracking::observation::{Detection, Observation};
use serde::Serialize;

/// A scan as the module reports it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CandidatesLine {
    /// Stamp of the recording or of the report, s.
    pub t: f64,
    /// Name of the module.
    pub module: String,
    /// Sequence of the report.
    pub seq: u32,
    /// What was seen.
    pub candidates: Vec<CandidateLine>,
    /// Where nothing can be said.
    pub unseen: Vec<UnseenLine>,
}

/// One candidate, with the centre made of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CandidateLine {
    /// Centre, forward, m.
    pub x: f64,
    /// Centre, left, m.
    pub y: f64,
    /// Covariance of the centre: xx, xy, yy in m².
    pub cov: [f64; 3],
    /// First step.
    pub first_step: u16,
    /// Last step.
    pub last_step: u16,
    /// Beams with a return.
    pub beams: u16,
    /// Range of the first beam.
    pub first_mm: u16,
    /// Range at the middle bearing.
    pub mid_mm: u16,
    /// Range of the last beam.
    pub last_mm: u16,
    /// Nearest range.
    pub near_mm: u16,
    /// Its step.
    pub near_step: u16,
    /// Ranges at equal bearings between the ends.
    pub contour_mm: Vec<u16>,
    /// How the first end ends.
    pub first_end: &'static str,
    /// How the last end ends.
    pub last_end: &'static str,
    /// Too narrow for a person seen whole.
    pub narrow: bool,
    /// For how long it has not moved, s.
    pub static_s: f64,
}

/// Directions that are neither background nor candidate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UnseenLine {
    /// First step.
    pub first_step: u16,
    /// Last step.
    pub last_step: u16,
    /// Nearest reading in it, if any.
    pub near_mm: Option<u16>,
}

impl CandidatesLine {
    /// What `judgement` says, under the time and the name given.
    #[must_use]
    pub fn new(t: f64, module: &str, geometry: &Geometry, judgement: &Judgement) -> Self {
        Self {
            t,
            module: module.to_owned(),
            seq: judgement.sequence,
            candidates: judgement.candidates().iter().map(|c| CandidateLine::new(c, geometry)).collect(),
            unseen: judgement.unseen().iter().map(|span| UnseenLine::new(span, geometry)).collect(),
        }
    }

    /// What a host makes of a report: places in the site's frame, time on the host's clock.
    #[must_use]
    pub fn of_observation(module: &str, observation: &Observation, report: &Report<'_>) -> Self {
        let candidate = |seen: &Detection| {
            let (centre, covariance) = (seen.centre, seen.covariance);
            let cov = [covariance.m11, covariance.m12, covariance.m22];
            CandidateLine::at([centre.x, centre.y], cov, &seen.candidate)
        };
        let geometry = &observation.view.geometry;
        Self {
            t: rounded(observation.start_s, 6),
            module: module.to_owned(),
            seq: report.head.sequence,
            candidates: observation.detections.iter().map(candidate).collect(),
            unseen: report.unseen.iter().map(|span| UnseenLine::new(&span, geometry)).collect(),
        }
    }
}

impl CandidateLine {
    fn new(candidate: &Candidate, geometry: &Geometry) -> Self {
        let place = centre(candidate, geometry, Estimator::default());
        let at = [place.x_m, place.y_m].map(f64::from);
        Self::at(at, place.covariance_m2.map(f64::from), candidate)
    }

    fn at([x, y]: [f64; 2], cov: [f64; 3], candidate: &Candidate) -> Self {
        Self {
            x: rounded(x, 4),
            y: rounded(y, 4),
            cov: cov.map(|value| rounded(value, 6)),
            first_step: candidate.first_step,
            last_step: candidate.last_step,
            beams: candidate.beams,
            first_mm: candidate.first_mm,
            mid_mm: candidate.mid_mm,
            last_mm: candidate.last_mm,
            near_mm: candidate.near_mm,
            near_step: candidate.near_step,
            contour_mm: (0..candidate.contour.len())
                .filter_map(|point| candidate.contour_mm(point))
                .collect(),
            first_end: end(candidate.first_end.kind),
            last_end: end(candidate.last_end.kind),
            narrow: candidate.narrow,
            static_s: f64::from(candidate.static_ds) / 10.0,
        }
    }
}

impl UnseenLine {
    fn new(span: &UnseenSpan, geometry: &Geometry) -> Self {
        let steps = span.beams.saturating_mul(geometry.cluster());
        Self {
            first_step: span.first_step,
            last_step: span.first_step.saturating_add(steps).saturating_sub(1),
            near_mm: span.near_mm,
        }
    }
}

const fn end(kind: EndKind) -> &'static str {
    match kind {
        EndKind::Free => "free",
        EndKind::Body => "body",
        EndKind::Wall => "wall",
        EndKind::View => "view",
        EndKind::Neck => "neck",
    }
}

/// As many decimals as mean something, so that lines stay short and alike on every machine.
fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10_f64.powi(decimals);
    (value * scale).round() / scale
}
