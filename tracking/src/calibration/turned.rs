//! Rotation check: a device that was turned sees its own walls some beams further. Told within seconds, without a walk.
//!
//! ```text
//!   as learned    ▔▔▔╲______╱▔▔▔▔▔▔     nearer than learned: stands before the wall, from the contours of candidates
//!   now           ▔▔▔▔▔▔╲______╱▔▔▔     farther: the wall has receded, in the background's newer versions
//!                    ├─┤                one turn explains all of both, and nothing that it would bring nearer is missing
//! ```
//!
//! A chair, a door or a crowd puts something before the walls as well. It looks like the walls from elsewhere only by
//! chance, and a turn would have brought other things nearer, too: those are missing then.

use std::sync::Arc;

use crate::observation::{Observation, View};

/// The least and the greatest turn looked for, rad.
pub const TURN_RAD: f64 = 5.0 * std::f64::consts::PI / 180.0;
pub const MOST_RAD: f64 = 45.0 * std::f64::consts::PI / 180.0;

/// What is elsewhere than learned must cover so much of the view, rad: half of a body at 1 m.
const LEAST_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// The turn must explain so much of it; and of what it would bring nearer so much may be missing.
const EXPLAINED: f64 = 0.7;
const MISSING: f64 = 0.3;

/// Two ranges of one surface differ by at most this, m, and share of the range.
const SAME_M: f64 = 0.06;
const SAME_SHARE: f64 = 0.015;

/// By so much a wall has receded, or would stand nearer for sure, m, and share of the range: half as much again as what
/// a module calls foreground.
const OTHER_M: f64 = 0.15;
const OTHER_SHARE: f64 = 0.03;

/// It has stood for so long, 0.1 s.
const STOOD_DS: u16 = 15;

/// Judgements in a row that must say the same turn, rad.
const SURE: u32 = 3;
const SAME_RAD: f64 = 0.02;

/// Walls that are other than learned are as good as learned if nothing is said of them for so many judgements, of a
/// second each: a wardrobe has been moved.
const SETTLED: u32 = 60;

/// Judges one module's walls.
#[derive(Clone, Debug, Default)]
pub struct Walls {
    /// As learned, and as they are said to be now; mm by beam, 0: none.
    learned_mm: Arc<[u16]>,
    now_mm: Arc<[u16]>,
    /// What the last scan showed, and beams that saw nothing before the background.
    stands: Vec<Point>,
    clear: Vec<bool>,
    /// The turn they say, and in how many judgements in a row.
    turned: Option<(f64, u32)>,
    /// Judgements since the walls changed, without a word of a turn.
    quiet: u32,
}

/// Something that stands: its beam, its range, m, and how much of the view it takes, beams.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Point {
    beam: i64,
    range_m: f64,
    beams: f64,
}

impl Walls {
    /// The wall behind every beam, mm; 0 where there is none.
    pub fn know(&mut self, walls_mm: &Arc<[u16]>) {
        if self.learned_mm.len() != walls_mm.len() {
            self.learned_mm = Arc::clone(walls_mm);
        }
        if !Arc::ptr_eq(&self.now_mm, walls_mm) {
            self.now_mm = Arc::clone(walls_mm);
            self.quiet = 0;
        }
    }

    /// Takes a scan.
    pub fn observe(&mut self, observation: &Observation) {
        self.stands = stands(observation);
        let beams = observation.empty_mm.iter().zip(observation.background_mm.iter());
        self.clear = beams.map(|(empty_mm, background_mm)| empty_mm >= background_mm).collect();
    }

    /// Once a second: the turn to the left that the walls say for sure, rad.
    pub fn judge(&mut self, view: &View) -> Option<f64> {
        let found = turn(view, &self.learned_mm, &self.elsewhere(), &self.quiet_beams());
        self.turned = match (found, self.turned) {
            (Some(turn_rad), Some((before_rad, times))) if (turn_rad - before_rad).abs() < SAME_RAD => {
                Some((turn_rad, times.saturating_add(1)))
            }
            (Some(turn_rad), _) => Some((turn_rad, 1)),
            (None, _) => None,
        };
        self.quiet = if found.is_some() { 0 } else { self.quiet.saturating_add(1) };
        if self.quiet >= SETTLED {
            self.learned_mm = Arc::clone(&self.now_mm);
        }
        self.turned.filter(|(_, times)| *times >= SURE).map(|(turn_rad, _)| turn_rad)
    }

    /// Whether a beam ends at its wall, and that wall is as learned.
    fn quiet_beams(&self) -> Vec<bool> {
        let walls = self.learned_mm.iter().zip(self.now_mm.iter());
        let same = walls.map(|(learned_mm, now_mm)| !is_other(metres(*learned_mm), metres(*now_mm)));
        same.zip(&self.clear).map(|(same, clear)| same && *clear).collect()
    }

    /// All that is elsewhere than learned: what stands before the walls, and walls that are others.
    fn elsewhere(&self) -> Vec<Point> {
        let walls = self.learned_mm.iter().zip(self.now_mm.iter()).zip(&self.clear).enumerate();
        let others = walls.filter_map(|(beam, ((learned_mm, now_mm), clear))| {
            let range_m = metres(*now_mm);
            let other = *clear && is_other(metres(*learned_mm), range_m);
            other.then_some(Point { beam: beam as i64, range_m, beams: 1.0 })
        });
        self.stands.iter().copied().chain(others).collect()
    }
}

fn metres(range_mm: u16) -> f64 {
    f64::from(range_mm) * 1e-3
}

/// Whether two walls are not the same; nothing is known where there is none.
fn is_other(one_m: f64, other_m: f64) -> bool {
    one_m > 0.0 && other_m > 0.0 && (one_m - other_m).abs() > OTHER_M + OTHER_SHARE * one_m
}

/// The turn that makes what is elsewhere the walls as they were learned, rad to the left; `quiet`: beams that end at their
/// wall as ever.
fn turn(view: &View, walls_mm: &[u16], elsewhere: &[Point], quiet: &[bool]) -> Option<f64> {
    let beam_rad = f64::from(view.geometry.beam_rad());
    let all: f64 = elsewhere.iter().map(|point| point.beams).sum();
    if walls_mm.is_empty() || all * beam_rad < LEAST_RAD {
        return None;
    }
    // The nearest and the farthest wall within a beam: along a slanted wall a beam is a hand's breadth.
    let ends = walls_mm.windows(3).map(|three| {
        let near = three.iter().copied().filter(|wall_mm| *wall_mm > 0).min().unwrap_or(0);
        (metres(near), metres(three.iter().copied().max().unwrap_or(0)))
    });
    let ends: Vec<(f64, f64)> = [(0.0, 0.0)].into_iter().chain(ends).collect();
    let at = |beam: i64| {
        usize::try_from(beam).ok().and_then(|beam| ends.get(beam)).copied().filter(|ends| ends.1 > 0.0)
    };
    // How much is explained and how much missing, in beams, and how well: what is explained closely counts more.
    let judge = |shift: i64| {
        let (mut explained, mut closely, mut missing) = (0.0, 0.0, 0.0);
        for point in elsewhere {
            let Some((near_m, far_m)) = at(point.beam + shift) else { continue };
            let off_m = (near_m - point.range_m).max(point.range_m - far_m).max(0.0);
            let same_m = SAME_M + SAME_SHARE * point.range_m;
            if off_m < same_m {
                explained += point.beams;
                closely += point.beams * (1.0 - off_m / same_m);
            }
        }
        for (beam, wall_mm) in walls_mm.iter().enumerate() {
            let Some((_, far_m)) = at(beam as i64 + shift) else { continue };
            if quiet.get(beam) == Some(&true) && far_m < metres(*wall_mm) && is_other(metres(*wall_mm), far_m)
            {
                missing += 1.0;
            }
        }
        (explained, missing, closely - missing)
    };
    let (least, most) = ((TURN_RAD / beam_rad) as i64, (MOST_RAD / beam_rad) as i64);
    let shifts = (least..=most).flat_map(|shift| [shift, -shift]);
    let judged = shifts.map(|shift| (judge(shift), shift));
    let ((explained, missing, _), shift) = judged.max_by(|(one, _), (other, _)| one.2.total_cmp(&other.2))?;
    let is_it = explained >= EXPLAINED * all && missing <= MISSING * explained;
    // A beam that sees what was `shift` beams further to the left has been turned to the left by as much.
    is_it.then_some(shift as f64 * beam_rad)
}

/// What stands before the background, from the contours of candidates.
fn stands(observation: &Observation) -> Vec<Point> {
    let geometry = &observation.view.geometry;
    let mut points = Vec::new();
    for seen in observation.detections.iter().filter(|seen| seen.candidate.static_ds >= STOOD_DS) {
        let candidate = &seen.candidate;
        let (first, last) = (geometry.beam(candidate.first_step), geometry.beam(candidate.last_step));
        let gaps = candidate.contour.len() + 1;
        let wide = f64::from(last.saturating_sub(first));
        for place in 0..=gaps {
            let range_mm = match place {
                0 => Some(candidate.first_mm),
                _ if place == gaps => Some(candidate.last_mm),
                // The greatest number a point can be says "that or more".
                _ => candidate
                    .contour_mm(place - 1)
                    .filter(|_| candidate.contour.get(place - 1) != Some(&u8::MAX)),
            };
            let Some(range_mm) = range_mm else { continue };
            let beam = f64::from(first) + wide * place as f64 / gaps as f64;
            let beams = (wide + 1.0) / (gaps + 1) as f64;
            points.push(Point { beam: beam.round() as i64, range_m: metres(range_mm), beams });
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use kehai::candidate::Candidate;

    use super::*;
    use crate::calibration::watch::{Finding, PoseWatch};
    use crate::site::Site;

    /// A room whose walls change from beam to beam, as a module sees it that is turned by so many beams.
    fn room_m(beam: i64) -> f64 {
        2.0 + libm::sin(beam as f64 * 0.012) + 0.4 * libm::sin(beam as f64 * 0.031)
    }

    fn walls(turned: i64) -> Arc<[u16]> {
        let beams = i64::from(View::at_origin().geometry.beams());
        (0..beams).map(|beam| (room_m(beam + turned) * 1e3) as u16).collect()
    }

    /// A scan in which `nearer` stands before the walls, in candidates of up to 60 beams.
    fn scan(nearer: impl Fn(i64) -> Option<f64>) -> Observation {
        let view = Arc::new(View::at_origin());
        let background_mm = walls(0);
        let mut empty_mm = background_mm.to_vec();
        let mut seen = Vec::new();
        let mut run: Vec<(i64, u16)> = Vec::new();
        let mut close = |run: &mut Vec<(i64, u16)>| {
            if run.len() > 4 {
                let step = |beam: i64| view.geometry.step(beam as u16);
                let near_mm = run.iter().map(|point| point.1).min().unwrap();
                let gaps = 16;
                let contour = (1..gaps).map(|place| {
                    let range_mm = run[place * (run.len() - 1) / gaps].1;
                    ((range_mm - near_mm) / 4).min(255) as u8
                });
                let (first, last) = (run[0], run[run.len() - 1]);
                let candidate = Candidate {
                    first_step: step(first.0),
                    last_step: step(last.0),
                    first_mm: first.1,
                    last_mm: last.1,
                    near_mm,
                    contour: contour.collect(),
                    static_ds: 30,
                    ..Candidate::default()
                };
                seen.push(crate::observation::Detection::new(
                    candidate,
                    &view,
                    0.0,
                    kehai::centre::Estimator::default(),
                ));
            }
            run.clear();
        };
        for (beam, empty_mm) in empty_mm.iter_mut().enumerate() {
            match nearer(beam as i64) {
                Some(range_m) => {
                    *empty_mm = (range_m * 1e3) as u16;
                    run.push((beam as i64, *empty_mm));
                }
                None => close(&mut run),
            }
            if run.len() == 60 {
                close(&mut run);
            }
        }
        close(&mut run);
        Observation { view: Arc::clone(&view), start_s: 0.0, detections: seen, empty_mm, background_mm }
    }

    /// What a turned module shows: what is nearer than learned.
    fn turned(by: i64) -> impl Fn(i64) -> Option<f64> {
        move |beam| {
            let (was_m, is_m) = (room_m(beam), room_m(beam + by));
            (is_m < was_m - 0.1).then_some(is_m)
        }
    }

    fn after(judgements: u32, walls_now: &Arc<[u16]>, observation: &Observation) -> Option<f64> {
        let mut own = Walls::default();
        own.know(&walls(0));
        own.know(walls_now);
        let mut said = None;
        for _ in 0..judgements {
            own.observe(observation);
            said = own.judge(&View::at_origin());
        }
        said
    }

    #[test]
    fn a_turn_either_way_is_told_and_by_how_much() {
        for by in [28, -28, 60] {
            let said = after(SURE, &walls(0), &scan(turned(by)))
                .map(|turn_rad| turn_rad / f64::from(View::at_origin().geometry.beam_rad()));
            assert!(said.is_some_and(|said| (said - by as f64).abs() < 2.0), "{by}: {said:?}");
            assert_eq!(after(SURE - 1, &walls(0), &scan(turned(by))), None, "not at once");
        }
        assert_eq!(after(SURE, &walls(0), &scan(|_| None)), None);
    }

    #[test]
    fn the_watch_names_a_turned_module_although_no_person_walks() {
        let module = crate::site::Module {
            name: "hall".into(),
            x: 0.0,
            y: 0.0,
            yaw_deg: 0.0,
            height_m: 0.6,
            upside_down: false,
            placed: true,
            furniture: Vec::new(),
        };
        let mut watch = PoseWatch::new(&Site { modules: vec![module], ..Site::default() });
        watch.know_walls(0, &walls(0));
        let mut found = Vec::new();
        for second in 1..5 {
            watch.observe(&scan(turned(28)));
            found = watch.findings(f64::from(second));
        }
        let [(0, Finding::Moved { turn_rad, .. })] = found[..] else { panic!("{found:?}") };
        assert!((turn_rad.to_degrees() - 9.8).abs() < 0.8, "{found:?}");
    }

    #[test]
    fn a_background_that_has_followed_the_turn_hides_nothing() {
        // Where the walls are farther now they have receded; the background's newest version has them there.
        let receded: Arc<[u16]> =
            walls(0).iter().zip(walls(28).iter()).map(|(was, is)| *was.max(is)).collect();
        let mut observation = scan(turned(28));
        let stood: Vec<bool> =
            observation.empty_mm.iter().zip(observation.background_mm.iter()).map(|(a, b)| a < b).collect();
        observation.background_mm = Arc::clone(&receded);
        for ((empty_mm, far_mm), stood) in observation.empty_mm.iter_mut().zip(receded.iter()).zip(stood) {
            if !stood {
                *empty_mm = *far_mm;
            }
        }
        assert!(after(SURE, &receded, &observation).is_some());
        // And one that was learned anew since.
        let anew = Observation { empty_mm: walls(28).to_vec(), background_mm: walls(28), ..scan(|_| None) };
        assert!(after(SURE, &walls(28), &anew).is_some());
    }

    #[test]
    fn what_stands_before_the_walls_is_no_turn() {
        // People in a row, a board, and a piece of the walls as they are elsewhere.
        let row = |beam: i64| (beam % 60 < 30 && room_m(beam) > 1.2).then_some(0.9);
        assert_eq!(after(5, &walls(0), &scan(row)), None);
        let board = |beam: i64| (200..300).contains(&beam).then_some(room_m(beam) - 0.4);
        assert_eq!(after(5, &walls(0), &scan(board)), None);
        let copy = |beam: i64| {
            ((100..200).contains(&beam)).then(|| room_m(beam + 28)).filter(|is_m| *is_m < room_m(beam) - 0.1)
        };
        assert_eq!(after(5, &walls(0), &scan(copy)), None, "the rest would have moved with it");
    }

    #[test]
    fn a_wardrobe_that_was_moved_is_learned_after_a_while() {
        let now: Arc<[u16]> = walls(0)
            .iter()
            .enumerate()
            .map(|(beam, wall_mm)| wall_mm + 600 * u16::from((150..210).contains(&beam)))
            .collect();
        let mut own = Walls::default();
        own.know(&walls(0));
        own.know(&now);
        let observation =
            Observation { empty_mm: now.to_vec(), background_mm: Arc::clone(&now), ..scan(|_| None) };
        for _ in 0..SETTLED {
            own.observe(&observation);
            assert_eq!(own.judge(&View::at_origin()), None);
        }
        assert_eq!(own.learned_mm, now);
    }
}
