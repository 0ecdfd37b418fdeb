//! The entrance before a depth camera: paper D's method and ours, each with its own front end, and each without its ideas.
//!
//! ```text
//!             ┌─ 1024 points, above the lens ─▶ ukyo  ─┐
//!   frame ────┤                                        ├─▶ judge ─▶ detection, identification, by people at a time
//!             └─ all points, above 0.7 m ─────▶ kehai ─┘
//! ```

use std::error::Error;
use std::ops::RangeInclusive;

use kehai_depth::background::Background;
use kehai_depth::cluster::{Density, subsample};
use kehai_depth::foreground::{self, Limits};
use kehai_depth::segment::Segment;
use kehai_tracking::depth::{Bodies, Ideas, Seen, Sight, Where};

use super::figure::Figure;
use super::findings::{Figures, Pooled};
use super::jobs::Runs;
use super::line::{Heading, Line};
use super::paper::{PAPER_D, PAPER_D_NAME};
use crate::baselines::ukyo::{self, Ukyo, UkyoSettings};
use crate::entrance::judge::{ByMost, Judge, Ratio, Reported, Verdict};
use crate::entrance::labels::{Labelled, labelled};
use crate::entrance::live::LOW;
use crate::entrance::{CAMERA, Entrance, FRAMES, Shot};
use crate::world::geometry::Point;

/// Its row.
const ROW: &str = "entrance";

/// Points of the paper's frames, and what makes a cluster of them: a quarter of what it takes among all points.
const SAMPLE: usize = 1024;
const SAMPLED: Density = Density { least: 5, ..Density::USUAL };

/// A tracker with its ideas.
#[derive(Clone, Copy, Debug)]
enum Method {
    Kehai(Ideas),
    Ukyo(UkyoSettings),
}

/// All that are run, by name; ours first.
const METHODS: [(&str, Method); 6] = [
    ("kehai", Method::Kehai(Ideas { has_size: true, has_gain: false })),
    ("kehai-without-size", Method::Kehai(Ideas { has_size: false, has_gain: false })),
    ("kehai-with-gain", Method::Kehai(Ideas { has_size: true, has_gain: true })),
    ("ukyo", Method::Ukyo(UkyoSettings { has_size: true, has_gain: true })),
    ("ukyo-without-size", Method::Ukyo(UkyoSettings { has_size: false, has_gain: true })),
    ("ukyo-without-gain", Method::Ukyo(UkyoSettings { has_size: true, has_gain: false })),
];

/// The figures, by name: as in the paper's tables 2, 3 and 4. P: precision, R: recall; at so many people at a time.
pub const FIGURES: [&str; 13] = [
    "detected: P, %",
    "detected: R, %",
    "F, %",
    "identified: P, %",
    "identified: R, %",
    "P at 1",
    "P at 2",
    "P at 3",
    "P at 4–5",
    "R at 1",
    "R at 2",
    "R at 3",
    "R at 4–5",
];

/// Runs every method with these seeds.
///
/// # Errors
/// A fault of the simulation, or of the file in which results are kept.
pub fn run(seeds: &RangeInclusive<u64>, runs: &Runs) -> Result<Vec<Pooled>, Box<dyn Error>> {
    let jobs: Vec<(u8, u64)> = seeds.clone().map(|seed| (0, seed)).collect();
    let results =
        runs.results(ROW, &jobs, |(_, seed)| one(seed).ok_or(format!("entrance, seed {seed}: no frames")))?;
    let pooled = |(index, (name, _)): (usize, &(&str, Method))| {
        let own = results.iter().filter_map(|((_, seed), all)| Some((*seed, figures(all.get(index)?))));
        Pooled { trial: ROW.into(), tracker: (*name).into(), runs: own.collect() }
    };
    Ok(METHODS.iter().enumerate().map(pooled).collect())
}

/// The paper's own figures, beside ours.
#[must_use]
pub fn paper(like: &[Line]) -> Vec<Line> {
    let Some(first) = like.first() else { return Vec::new() };
    let heading = Heading {
        row: ROW.into(),
        tracker: PAPER_D_NAME.into(),
        seeds: (first.first_seed, first.last_seed),
        runs: 1,
    };
    FIGURES
        .iter()
        .zip(PAPER_D)
        .map(|(name, value)| heading.line(name, Some(value), format!("{value:.1}")))
        .collect()
}

/// The verdict on every method in one run.
fn one(seed: u64) -> Option<Vec<Verdict>> {
    let entrance = Entrance::new(seed);
    let background = entrance.background()?;
    let mut judges: Vec<(Running, Judge)> =
        METHODS.iter().map(|(_, method)| (Running::new(*method), Judge::default())).collect();
    for number in 0..FRAMES {
        let shot = entrance.shot(number)?;
        let sampled = of_paper(&shot, &background, seed.wrapping_mul(FRAMES as u64) + number as u64);
        let points = foreground::of(&shot.frame, &background, &LOW, &Limits::USUAL);
        let own = labelled(&points, &shot, &LOW, &Density::USUAL);
        for (running, judge) in &mut judges {
            let segments = if matches!(running, Running::Kehai(_)) { &own } else { &sampled };
            let reported = running.observe(segments, shot.frame.stamp_us as f64 * 1e-6);
            judge.frame(&shot, segments, &reported);
        }
    }
    Some(judges.iter().map(|(_, judge)| judge.finish()).collect())
}

/// The paper's segments. Fewer points than it samples make an empty frame.
fn of_paper(shot: &Shot, background: &Background, seed: u64) -> Vec<Labelled> {
    let points = foreground::of(&shot.frame, background, &CAMERA, &Limits::PAPER);
    let points = subsample(&points, SAMPLE, seed).unwrap_or_default();
    labelled(&points, shot, &CAMERA, &SAMPLED)
}

enum Running {
    Kehai(Bodies),
    Ukyo(Ukyo),
}

impl Running {
    fn new(method: Method) -> Self {
        let aside = f64::from((CAMERA.fov_deg / 2.0).to_radians().tan());
        let up = aside * CAMERA.height as f64 / CAMERA.width as f64;
        let sight = Sight { aside, lens_m: f64::from(CAMERA.height_m), up };
        match method {
            Method::Kehai(ideas) => Self::Kehai(Bodies::new(ideas, sight)),
            Method::Ukyo(settings) => {
                let period_s = CAMERA.period_us() as f64 * 1e-6;
                Self::Ukyo(Ukyo::new(settings, period_s, f64::from(CAMERA.plane_m())))
            }
        }
    }

    fn observe(&mut self, segments: &[Labelled], at_s: f64) -> Vec<Reported> {
        let segments = segments.iter().map(|labelled| &labelled.segment);
        match self {
            Self::Kehai(bodies) => {
                bodies.observe(&segments.map(seen).collect::<Vec<_>>(), at_s);
                let reported = |track: kehai_tracking::depth::Followed| Reported {
                    id: track.id,
                    at: track.at,
                    segment: match track.is {
                        Where::Own(segment) | Where::Shared(segment) => Some(segment),
                        Where::Unseen => None,
                    },
                };
                bodies.followed().into_iter().map(reported).collect()
            }
            Self::Ukyo(ukyo) => {
                let reported =
                    |ukyo::Followed { id, at, segment }: ukyo::Followed| Reported { id, at, segment };
                let followed = ukyo.observe(&segments.cloned().collect::<Vec<_>>());
                followed.into_iter().map(reported).collect()
            }
        }
    }
}

fn seen(segment: &Segment) -> Seen {
    let point = |[x, y]: &[f32; 2]| Point::new(f64::from(*x), f64::from(*y));
    Seen {
        at: point(&segment.centre_m),
        outline: segment.outline_m.iter().map(point).collect(),
        top_m: f64::from(segment.top_cm) / 100.0,
        volume_l: f64::from(segment.volume_l),
    }
}

/// The figures of a run, as [`FIGURES`]. Of detection a mean over runs, of identification over identities and people.
fn figures(verdict: &Verdict) -> Figures {
    let percent = |ratio: Ratio| 100.0 * ratio.right as f64 / ratio.of.max(1) as f64;
    let (precision, recall) = (percent(verdict.precision), percent(verdict.recall));
    let both = 2.0 * precision * recall / (precision + recall).max(f64::MIN_POSITIVE);
    let found = [precision, recall, both].map(|value| Figure::time(value, 1)).into_iter();
    FIGURES.iter().map(|name| (*name).to_owned()).zip(found.chain(shares(verdict))).collect()
}

/// Of identification: the figures from the fourth on.
pub(super) fn shares(verdict: &Verdict) -> Vec<Figure> {
    let shares = |all: &ByMost, most: RangeInclusive<usize>| {
        let own = all.iter().filter(|(at_once, _)| most.contains(at_once));
        Figure::Mean { values: own.map(|(_, share)| 100.0 * share).collect(), digits: 1, shares: true }
    };
    // An identity without a judged person in view belongs to none of these numbers of people.
    let ranges = [1..=1, 2..=2, 3..=3, 4..=usize::MAX];
    let together = [&verdict.identities, &verdict.people].map(|all| shares(all, 0..=usize::MAX));
    let apart = [&verdict.identities, &verdict.people]
        .into_iter()
        .flat_map(|all| ranges.clone().into_iter().map(|most| shares(all, most)).collect::<Vec<_>>());
    together.into_iter().chain(apart).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_figure_has_its_place_and_the_paper_s_beside_it() {
        let verdict = Verdict {
            precision: Ratio { right: 9, of: 10 },
            recall: Ratio { right: 4, of: 5 },
            identities: vec![(1, 1.0), (5, 0.5)],
            people: vec![(2, 1.0), (2, 0.5)],
        };
        let figures = figures(&verdict);
        let value =
            |name: &str| figures.iter().find(|(own, _)| own == name).map(|(_, figure)| figure.words());
        assert_eq!(figures.len(), FIGURES.len());
        assert!(value("detected: P, %").unwrap().starts_with("90.0"));
        assert!(value("identified: P, %").unwrap().starts_with("75.0"));
        assert!(value("P at 4–5").unwrap().starts_with("50.0"));
        assert_eq!(value("R at 3").unwrap(), "–");
        assert!(value("R at 2").unwrap().starts_with("75.0"));
        let heading = Heading { row: ROW.into(), tracker: "kehai".into(), seeds: (1, 2), runs: 2 };
        let paper = paper(&[heading.line("", None, String::new())]);
        assert_eq!((paper.len(), paper[0].printed.as_str(), paper[0].last_seed), (13, "99.5", 2));
    }
}
