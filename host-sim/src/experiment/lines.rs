//! Counting lines against the truth: which people crossed, which were missed, and what was counted though no person crossed.
//!
//! ```text
//!   truth, every 0.1 s ─▶ true crossings ─┐ the same line and direction, at most 2 s apart
//!                                         ├─▶ right · missed · false
//!   tracker ─▶ counted crossings ─────────┘
//! ```
//!
//! The same of stays in zones: by how much the length of each differs from the true one.

use std::collections::BTreeMap;
use std::error::Error;
use std::ops::RangeInclusive;

use kehai_tracking::assignment::{Alone, assign};
use kehai_tracking::geometry::{Point, distance_to_segment};
use kehai_tracking::lines::Direction;
use kehai_tracking::site::line::CountingLine;
use kehai_tracking::stays::{Change, Stays};
use kehai_tracking::tracker::{LifeCycle, Origin, TrackState};

use super::figure::Figure;
use super::findings::{Figures, Pooled};
use super::jobs::Runs;
use crate::baselines::Choice;
use crate::run::{Moment, Options, Record, SeenPerson};
use crate::world::scene::{Scene, SceneError};
use crate::world::variation::{Letter, Variation};

/// A counted crossing so far in time from a true one is another, s: as long as the cells of a line count as seen.
const SAME_S: f64 = 2.0;

/// What a crossing costs that is not matched, s: more than all of a run that are, each at most [`SAME_S`].
const UNMATCHED_S: f64 = 500.0;

/// A person so far from a line has all of the body on one side, m: half of 0.45 m.
const WHOLE_BODY_M: f64 = 0.225;

/// Beside the ends of a line this far a way still leads across it, m: half a body.
const BESIDE_M: f64 = 0.25;

/// A scene of the table.
#[derive(Clone, Copy, Debug)]
pub enum Place {
    /// A home of four rooms, four people, for so many seconds.
    Building(u32),
    /// The door area with so many people.
    DoorArea(Letter, usize),
}

/// The scenes of the table.
pub const PLACES: [Place; 9] = [
    Place::Building(120),
    Place::DoorArea(Letter::D, 1),
    Place::DoorArea(Letter::D, 3),
    Place::DoorArea(Letter::D, 5),
    Place::DoorArea(Letter::D, 7),
    Place::DoorArea(Letter::H, 1),
    Place::DoorArea(Letter::H, 3),
    Place::DoorArea(Letter::H, 5),
    Place::DoorArea(Letter::H, 7),
];

impl Place {
    /// The scene with its lines.
    ///
    /// # Errors
    /// No such scene.
    pub fn build(self) -> Result<Scene, SceneError> {
        match self {
            Self::Building(duration_s) => {
                let mut scene = Scene::load("building")?;
                scene.duration_s = f64::from(duration_s);
                Ok(scene)
            }
            Self::DoorArea(letter, people) => {
                let mut scene = Scene::load("door-area")?;
                let (people, condition) = (Some(people), Some(letter));
                scene.vary(&Variation { people, condition, ..Variation::default() })?;
                let line = |name: &str, y, half_m: f64| CountingLine {
                    name: name.into(),
                    from: [-half_m, y],
                    to: [half_m, y],
                };
                scene.site.lines = vec![line("entrance", -1.0, 1.0), line("door", 1.0, 0.45)];
                Ok(scene)
            }
        }
    }

    fn name(self) -> String {
        match self {
            Self::Building(_) => "building".into(),
            Self::DoorArea(letter, people) => format!("door area, {letter}, {people}"),
        }
    }
}

/// A person crossed a line.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Crossed {
    /// When, s; if no sensor saw it, at the latest.
    pub at_s: f64,
    /// If no sensor saw it, at the earliest; else the same.
    pub since_s: f64,
    /// Number of the line in the site.
    pub line: usize,
    /// Which way.
    pub direction: Direction,
}

/// What became of the crossings of a line in one run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Verdict {
    /// Counted when they happened.
    pub right: u64,
    /// True, and not counted.
    pub missed: Vec<Crossed>,
    /// Counted, and not true.
    pub wrong: Vec<Crossed>,
}

/// The crossings of a record by its truth, in order of time.
#[must_use]
pub fn truth(record: &Record) -> Vec<Crossed> {
    let mut ways: BTreeMap<u32, Vec<(f64, Point)>> = BTreeMap::new();
    for moment in &record.truth {
        for person in &moment.people {
            ways.entry(person.id).or_default().push((moment.t, Point::new(person.x, person.y)));
        }
    }
    let of_line = |(number, line): (usize, &CountingLine)| {
        ways.values().flat_map(move |way| across(number, line, way)).collect::<Vec<_>>()
    };
    let mut all: Vec<Crossed> = record.site.lines.iter().enumerate().flat_map(of_line).collect();
    all.sort_by(|one, other| one.at_s.total_cmp(&other.at_s));
    all
}

/// The crossings of one person: from whole on one side to whole on the other, through the line and not beside it.
fn across(number: usize, line: &CountingLine, way: &[(f64, Point)]) -> Vec<Crossed> {
    let (from, to) = line.ends();
    let side = to - from;
    let is_left = |at: Point| side.cross(at - from) >= 0.0;
    let along_m = |at: Point| (at - from).dot(side) / side.length();
    let is_clear = |at: Point| distance_to_segment(at, from, to) > WHOLE_BODY_M;
    let mut all = Vec::new();
    // Since the person was clear of the line: how often it was passed, to the left less to the right, and when last.
    let (mut net, mut passed_s) = (0, 0.0);
    for (&(_, before), &(at_s, after)) in way.iter().zip(way.iter().skip(1)) {
        let is_beside = !(-BESIDE_M..=line.length_m() + BESIDE_M).contains(&along_m((before + after) * 0.5));
        if is_left(before) != is_left(after) && !is_beside {
            net += if is_left(after) { 1 } else { -1 };
            passed_s = at_s;
        }
        if is_clear(after) && net != 0 {
            let direction = if net > 0 { Direction::In } else { Direction::Out };
            all.push(Crossed { at_s: passed_s, since_s: passed_s, line: number, direction });
        }
        if is_clear(after) {
            net = 0;
        }
    }
    all
}

/// The stays of one run in a zone.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dwelled {
    /// By how much the length of each differs from the true one, s.
    pub off_s: Vec<f64>,
    /// True stays that have no counterpart.
    pub missed: u64,
    /// Stays without a true counterpart.
    pub wrong: u64,
}

/// Follows a record and judges each of its lines, and each of its zones that count.
#[must_use]
pub fn judge(record: &Record, choice: Choice) -> (Vec<Verdict>, Vec<Dwelled>) {
    let (mut counted, mut changes) = (Vec::new(), Vec::new());
    record.follow(choice, |site_tracker, moment| {
        let estimate = site_tracker.estimate(moment.t);
        changes.extend(estimate.stays);
        counted.extend(estimate.crossings.iter().map(|crossing| Crossed {
            at_s: crossing.at_s,
            since_s: crossing.since_s,
            line: crossing.line,
            direction: crossing.direction,
        }));
    });
    let lines = compare(&truth(record), &counted, record.site.lines.len(), record.duration_s);
    let real = true_stays(record);
    let counts = record.site.zones.iter().filter(|zone| zone.count);
    (lines, counts.map(|zone| dwelled(&zone.name, &real, &changes, record.duration_s)).collect())
}

/// Comings and goings by the truth: by the rule for tracks, as if every person had a perfect one.
fn true_stays(record: &Record) -> Vec<Change> {
    let mut stays = Stays::new(&record.site);
    let track = |person: &SeenPerson| TrackState {
        id: person.id.into(),
        at: Point::new(person.x, person.y),
        velocity: Point::default(),
        covariance_m2: [0.0; 3],
        state: LifeCycle::Confirmed,
        existence: 1.0,
        reason: "",
        origin: Origin::Entered,
    };
    let people = |moment: &Moment| moment.people.iter().map(track).collect::<Vec<_>>();
    record.truth.iter().flat_map(|moment| stays.observe(&people(moment), moment.t)).collect()
}

/// Each true stay with the nearest that ended at most [`SAME_S`] from it. With a run the stays of everybody end, and are left out.
fn dwelled(zone: &str, real: &[Change], found: &[Change], end_s: f64) -> Dwelled {
    let of_zone = |changes: &[Change]| -> Vec<(f64, f64)> {
        let own = changes.iter().filter(|change| change.zone == zone && change.at_s <= end_s - SAME_S);
        own.filter_map(|change| Some((change.at_s, change.at_s - change.since_s?))).collect()
    };
    let (mut open, mut dwelled) = (of_zone(found), Dwelled::default());
    for (left_s, stay_s) in of_zone(real) {
        let same = open.iter().enumerate().filter(|(_, (at_s, _))| (at_s - left_s).abs() <= SAME_S);
        let off_s = |(_, (_, other_s)): &(usize, &(f64, f64))| (other_s - stay_s).abs();
        match same.min_by(|one, other| off_s(one).total_cmp(&off_s(other))).map(|(index, _)| index) {
            Some(index) => dwelled.off_s.push((open.remove(index).1 - stay_s).abs()),
            None => dwelled.missed += 1,
        }
    }
    dwelled.wrong = open.len() as u64;
    dwelled
}

/// As many as can be are matched, and of these ways to match the one that is nearest in time: each alone would take the nearest that is
/// left, and one whose own crossing was not seen would take the next person's, and so on to the last one. What happened in the last
/// seconds of a run may be counted after its end, and is left out.
fn compare(truth: &[Crossed], counted: &[Crossed], lines: usize, end_s: f64) -> Vec<Verdict> {
    let off_s = |real: &Crossed, other: &Crossed| {
        let off_s = (other.since_s - real.at_s).max(real.at_s - other.at_s).max(0.0);
        let is_same = other.line == real.line && other.direction == real.direction && off_s <= SAME_S;
        is_same.then_some(off_s)
    };
    let matched = assign(truth.len(), counted.len(), &Alone::all(UNMATCHED_S), |real, other| {
        off_s(truth.get(real)?, counted.get(other)?)
    });
    let is_judged = |crossed: &Crossed| crossed.at_s <= end_s - SAME_S;
    let mut verdicts = vec![Verdict::default(); lines];
    for (real, other) in truth.iter().zip(&matched).filter(|(real, _)| is_judged(real)) {
        let Some(verdict) = verdicts.get_mut(real.line) else { continue };
        if other.is_some() {
            verdict.right += 1;
        } else {
            verdict.missed.push(*real);
        }
    }
    let open = counted.iter().enumerate().filter(|(index, _)| !matched.contains(&Some(*index)));
    for (_, other) in open.filter(|(_, other)| is_judged(other)) {
        if let Some(verdict) = verdicts.get_mut(other.line) {
            verdict.wrong.push(*other);
        }
    }
    verdicts
}

fn figures(verdict: &Verdict) -> Figures {
    let (missed, wrong) = (verdict.missed.len() as u64, verdict.wrong.len() as u64);
    let all = verdict.right + missed + wrong;
    [
        ("exact, %", Figure::Share { yes: verdict.right, of: all }),
        ("crossings", Figure::Sum((verdict.right + missed) as f64)),
        ("missed", Figure::Sum(missed as f64)),
        ("false", Figure::Sum(wrong as f64)),
        ("runs without a fault, %", Figure::of(missed + wrong == 0)),
    ]
    .map(|(name, figure)| (name.to_owned(), figure))
    .into()
}

fn stay_figures(dwelled: &Dwelled) -> Figures {
    let stays = dwelled.off_s.len() as u64 + dwelled.missed;
    [
        ("stays", Figure::Sum(stays as f64)),
        ("length off by, median, s", Figure::Median(dwelled.off_s.clone())),
        ("missed", Figure::Sum(dwelled.missed as f64)),
        ("false", Figure::Sum(dwelled.wrong as f64)),
    ]
    .map(|(name, figure)| (name.to_owned(), figure))
    .into()
}

/// Runs the table: a row for each line of each scene, the worst first; then one for each zone.
///
/// # Errors
/// A fault of a scene or of the simulation.
pub fn run(seeds: &RangeInclusive<u64>, choice: Choice, runs: &Runs) -> Result<Vec<Pooled>, Box<dyn Error>> {
    let scenes = PLACES.iter().map(|place| place.build()).collect::<Result<Vec<_>, _>>()?;
    let jobs: Vec<(usize, u64)> =
        (0..scenes.len()).flat_map(|scene| seeds.clone().map(move |seed| (scene, seed))).collect();
    let results: BTreeMap<(usize, u64), Vec<Figures>> = runs.results("lines", &jobs, |(scene, seed)| {
        let record = scenes.get(scene).map(|scene| Record::of(scene, seed, &Options::default()));
        let record = record.transpose().map_err(|error| format!("lines, seed {seed}: {error}"))?;
        let Some((lines, zones)) = record.map(|record| judge(&record, choice)) else { return Ok(Vec::new()) };
        Ok(lines.iter().map(figures).chain(zones.iter().map(stay_figures)).collect())
    })?;
    let (mut lines, mut zones) = (Vec::new(), Vec::new());
    for (index, (place, scene)) in PLACES.iter().zip(&scenes).enumerate() {
        let row = |number: usize, what: String| {
            let own = results.range((index, 0)..=(index, u64::MAX));
            let own = own.filter_map(|((_, seed), all)| Some((*seed, all.get(number)?.clone())));
            Pooled { trial: what, tracker: choice.to_string(), runs: own.collect() }
        };
        let named = |name: &str| format!("{}: {name}", place.name());
        lines.extend(scene.site.lines.iter().enumerate().map(|(line, of)| row(line, named(&of.name))));
        let counts = scene.site.zones.iter().filter(|zone| zone.count).enumerate();
        let first = scene.site.lines.len();
        zones.extend(counts.map(|(zone, of)| row(first + zone, named(&format!("zone {}", of.name)))));
    }
    let value = |row: &Pooled, figure: usize| row.figures().get(figure).map_or(0.0, |(_, of)| of.numbers().0);
    lines.sort_by(|one, other| value(one, 0).total_cmp(&value(other, 0)));
    zones.sort_by(|one, other| value(other, 1).total_cmp(&value(one, 1)));
    let groups =
        [("all lines", ""), ("building: all lines", "building"), ("door area, D: all lines", "door area, D")];
    let groups = groups.into_iter().chain([("door area, H: all lines", "door area, H")]);
    let all: Vec<Pooled> = groups.map(|(name, begin)| together(name, begin, &lines)).collect();
    Ok([all, lines, zones].concat())
}

/// All rows whose names begin so, as one; run by run.
fn together(name: &str, begin: &str, rows: &[Pooled]) -> Pooled {
    let mut runs: BTreeMap<u64, Figures> = BTreeMap::new();
    for (seed, figures) in rows.iter().filter(|row| row.trial.starts_with(begin)).flat_map(|row| &row.runs) {
        match runs.get_mut(seed) {
            None => {
                runs.insert(*seed, figures.clone());
            }
            Some(all) => {
                all.iter_mut().zip(figures).for_each(|((_, figure), (_, more))| figure.add(more));
            }
        }
    }
    let tracker = rows.first().map(|row| row.tracker.clone()).unwrap_or_default();
    Pooled { trial: name.to_owned(), tracker, runs }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crossed(since_s: f64, at_s: f64, direction: Direction) -> Crossed {
        Crossed { at_s, since_s, line: 0, direction }
    }

    #[test]
    fn a_true_crossing_is_from_whole_on_one_side_to_whole_on_the_other_through_the_line() {
        let line = CountingLine { name: "front".into(), from: [0.0, 0.0], to: [1.0, 0.0] };
        let across = |places: &[(f64, f64)]| {
            let way: Vec<(f64, Point)> =
                (0..).zip(places).map(|(step, (x, y))| (f64::from(step), Point::new(*x, *y))).collect();
            across(0, &line, &way).iter().map(|crossed| crossed.direction).collect::<Vec<_>>()
        };
        assert_eq!(across(&[(0.5, -1.0), (0.5, 1.0), (0.5, -1.0)]), [Direction::In, Direction::Out]);
        assert_eq!(across(&[(0.5, -1.0), (0.5, 0.2), (0.5, -1.0)]), []);
        assert_eq!(across(&[(0.5, -1.0), (0.5, 0.1), (0.5, -0.1), (0.5, 0.3)]), [Direction::In]);
        assert_eq!(across(&[(2.0, -1.0), (2.0, 1.0)]), []);
    }

    #[test]
    fn a_crossing_is_right_once_at_its_time_and_in_its_direction() {
        use Direction::{In, Out};
        let truth = [
            crossed(10.0, 10.0, In),
            crossed(20.0, 20.0, Out),
            crossed(30.0, 30.0, In),
            crossed(59.0, 59.0, In),
        ];
        let counted = [
            crossed(10.5, 10.5, In),
            crossed(10.6, 10.6, In),
            crossed(20.0, 20.0, In),
            crossed(25.0, 33.0, In),
        ];
        let [verdict] = &compare(&truth, &counted, 1, 60.0)[..] else { panic!("one line") };
        assert_eq!((verdict.right, verdict.missed.len(), verdict.wrong.len()), (2, 1, 2));
        assert_eq!(verdict.missed, [truth[1]]);
    }

    #[test]
    fn a_crossing_that_was_not_seen_takes_no_later_one_from_its_person() {
        use Direction::In;
        let truth = [35.6, 36.7, 38.4, 40.0].map(|at_s| crossed(at_s, at_s, In));
        let seen = [36.75, 40.03].map(|at_s| crossed(at_s, at_s, In));
        let counted = [seen[0], seen[1], crossed(38.5, 39.2, In), crossed(23.0, 39.7, In)];
        let [verdict] = &compare(&truth, &counted, 1, 60.0)[..] else { panic!("one line") };
        assert_eq!((verdict.right, &verdict.missed[..], &verdict.wrong[..]), (4, &[][..], &[][..]));
    }

    #[test]
    fn at_some_seeds_everybody_is_counted() {
        for place in [Place::Building(60), Place::DoorArea(Letter::D, 3), Place::DoorArea(Letter::H, 3)] {
            let record = Record::of(&place.build().unwrap(), 4, &Options::default()).unwrap();
            let (lines, zones) = judge(&record, Choice::default());
            let right: u64 = lines.iter().map(|verdict| verdict.right).sum();
            let faults = lines.iter().flat_map(|verdict| verdict.missed.iter().chain(&verdict.wrong));
            assert_eq!(faults.collect::<Vec<_>>(), Vec::<&Crossed>::new(), "{place:?}");
            assert!(right >= 6 && !zones.is_empty(), "{place:?}: {right}");
        }
    }
}
