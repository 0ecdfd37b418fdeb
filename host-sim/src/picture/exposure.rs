//! From the core's state to the shapes of a picture.

use kehai::background::{BeamProfile, BeamState};
use kehai::candidate::Candidate;
use kehai::centre::{Estimator, centre};
use kehai::pipeline::Judgement;
use kehai::scan::{Geometry, Scan};

use super::{BeamKind, BeamShown, CandidateShown, ScanShown};

/// The background as it is now, beam by beam.
#[must_use]
pub fn background(geometry: &Geometry, model: impl Iterator<Item = BeamProfile>) -> Vec<BeamShown> {
    let metres = |range_mm: u16| (range_mm != 0).then(|| f64::from(range_mm) / 1000.0);
    let shown = |(beam, profile): (u16, BeamProfile)| BeamShown {
        bearing_rad: f64::from(geometry.bearing_rad(beam)),
        kind: match profile.state {
            BeamState::Unknown => BeamKind::Unknown,
            BeamState::Open => BeamKind::Open { limit_m: metres(profile.far_mm) },
            BeamState::Wall => BeamKind::Wall {
                range_m: metres(profile.far_mm).unwrap_or_default(),
                near_m: metres(profile.near_mm),
            },
        },
    };
    (0..).zip(model).map(shown).collect()
}

/// One scan: the points inside its candidates, and the candidates.
#[must_use]
pub fn scan(t_s: f64, scan: &Scan<'_>, judgement: &Judgement) -> ScanShown {
    let foreground = judgement.candidates().iter().flat_map(|candidate| points(scan, candidate)).collect();
    let candidates = judgement
        .candidates()
        .iter()
        .map(|candidate| CandidateShown {
            centre_m: centre_m(candidate, scan.geometry),
            narrow: candidate.narrow,
        })
        .collect();
    ScanShown { t_s, foreground, candidates }
}

/// The points a candidate was made of, m.
pub fn points<'a>(scan: &'a Scan<'a>, candidate: &Candidate) -> impl Iterator<Item = [f64; 2]> + use<'a> {
    let beams = scan.geometry.beam(candidate.first_step)..=scan.geometry.beam(candidate.last_step);
    beams.filter_map(|beam| {
        let range_m = f64::from(scan.reading(beam.into()).range_mm()?) / 1000.0;
        let (sine, cosine) = f64::from(scan.geometry.bearing_rad(beam)).sin_cos();
        Some([range_m * cosine, range_m * sine])
    })
}

/// The estimated centre of the person, m.
#[must_use]
pub fn centre_m(candidate: &Candidate, geometry: &Geometry) -> [f64; 2] {
    let place = centre(candidate, geometry, Estimator::default());
    [f64::from(place.x_m), f64::from(place.y_m)]
}
