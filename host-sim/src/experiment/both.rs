//! People in the door area on a floor of panels and before two modules: what each sees alone, and both together.
//!
//! ```text
//!   world ─┬─ beams ──▶ modules ─▶ datagrams ─┬─▶ modules alone
//!          │                                  ├─▶ both
//!          └─ feet ───▶ panels ──▶ readings ──┼─▶ both
//!                                             └─▶ floor alone
//! ```
//!
//! The floor is the zone in which people are counted, 2 × 2 m in 25 × 25 panels; all three are judged there.

use std::fmt;
use std::ops::{Range, RangeInclusive};
use std::sync::Arc;

use kehai::floor::READING_US;
use kehai_tracking::estimate::Estimate as Known;
use kehai_tracking::site::Site;
use kehai_tracking::site::floor::Floor as Mat;
use kehai_tracking::site_tracker::SiteTracker;
use serde::{Deserialize, Serialize};

use super::jobs::Runs;
use super::line::Run as Recorded;
use super::plan::Case;
use super::table::{Cell, Outcome, Row};
use super::trial::counted;
use crate::baselines::Choice;
use crate::floor::crowd::Crowd;
use crate::floor::panels::{FloorReader, PITCH_M};
use crate::run::{Arrival, Moment, Options, Outage, Run, TICK_US};
use crate::score::{Estimate, Frame, Scorer, Settings, Target};
use crate::world::Events;
use crate::world::variation::Letter;

/// Panels along a side.
const SIDE: u8 = 25;

/// What is installed.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize)]
pub enum Sources {
    /// Only the floor.
    Floor,
    /// Only the two modules.
    Modules,
    /// The floor and the modules.
    Both,
}

impl Sources {
    /// All.
    pub const ALL: [Self; 3] = [Self::Floor, Self::Modules, Self::Both];

    /// The site with what is installed.
    fn site(self, all: &Site) -> Site {
        let mut site = all.clone();
        if self == Self::Floor {
            site.modules.clear();
        }
        if self != Self::Modules {
            let corner = -0.5 * f64::from(SIDE) * PITCH_M;
            let name = "mat".to_owned();
            site.floors = vec![Mat {
                name,
                x: corner,
                y: corner,
                yaw_deg: 0.0,
                columns: SIDE,
                rows: SIDE,
                pitch_m: PITCH_M,
            }];
        }
        site
    }
}

impl fmt::Display for Sources {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Floor => "floor alone",
            Self::Modules => "two modules alone",
            Self::Both => "both",
        })
    }
}

/// Every condition and number of people with these seeds: the rows, and what every run gave.
///
/// # Errors
/// The first fault of the simulation, or the kept file cannot be written.
pub fn table(seeds: &RangeInclusive<u64>, runs: &Runs) -> Result<(Vec<Row>, Vec<Recorded>), String> {
    let cases = || {
        [Letter::D, Letter::H]
            .into_iter()
            .flat_map(|letter| (1..=7_usize).map(move |people| (letter, people)))
    };
    let cases: Vec<(Letter, usize)> = cases().collect();
    let jobs: Vec<(usize, u64)> =
        (0..cases.len()).flat_map(|case| seeds.clone().map(move |seed| (case, seed))).collect();
    let outcomes = runs.results("floor-and-modules", &jobs, |(case, seed)| {
        let (condition, people) = cases[case];
        one(condition, people, seed)
    })?;
    let (mut rows, mut all) = (Vec::new(), Vec::new());
    for (index, (condition, people)) in cases.iter().enumerate() {
        for (number, sources) in Sources::ALL.into_iter().enumerate() {
            let cell = Cell {
                scene: format!("door area, {condition}"),
                sensors: if sources == Sources::Floor { 0 } else { 2 },
                people: u32::try_from(*people).unwrap_or(u32::MAX),
                tracker: sources.to_string(),
            };
            let own = outcomes.range((index, 0)..=(index, u64::MAX));
            let own: Vec<(u64, Outcome)> = own
                .filter_map(|((_, seed), outcomes)| Some((*seed, outcomes.get(number)?.clone())))
                .collect();
            all.extend(own.iter().map(|(seed, outcome)| Row::run(&cell, *seed, outcome)));
            rows.push(Row::new(cell, &own));
        }
    }
    Ok((rows, all))
}

/// What is unplugged during a run.
#[derive(Clone, Debug, Default)]
pub struct Cuts {
    /// When the floor is not read, s.
    pub floor_s: Option<Range<f64>>,
    /// Modules without power.
    pub modules: Vec<Outage>,
}

/// One run with each of [`Sources::ALL`].
///
/// # Errors
/// A fault of the simulation, in words.
pub fn one(condition: Letter, people: usize, seed: u64) -> Result<Vec<Outcome>, String> {
    let settings = || Settings { region: Some(counted()), area: Some(counted()), ..Settings::default() };
    let mut scorers = Sources::ALL.map(|_| Scorer::new(settings()));
    let events = play(condition, people, seed, &Cuts::default(), |moment, estimates| {
        let truth: Vec<Target> = moment.people.iter().map(Target::from).collect();
        for (estimate, scorer) in estimates.iter().zip(&mut scorers) {
            let tracks: Vec<Estimate> = estimate.tracks.iter().map(Estimate::from).collect();
            scorer.frame(&Frame { t_s: moment.t, truth: &truth, tracks: &tracks });
        }
    })?;
    Ok(scorers.into_iter().map(|scorer| Outcome::of(scorer, events.as_ref())).collect())
}

/// Lets people come, wait and leave; `look` sees ten times a second what is true, and what is known with each of
/// [`Sources::ALL`].
///
/// # Errors
/// A fault of the simulation, in words.
pub fn play(
    condition: Letter,
    people: usize,
    seed: u64,
    cuts: &Cuts,
    mut look: impl FnMut(&Moment, &[Known; 3]),
) -> Result<Option<Events>, String> {
    let scene = Case::door(condition, people, &[]).build().map_err(|error| error.to_string())?;
    let options = Options { outages: cuts.modules.clone(), ..Options::default() };
    let mut run = Run::new(&scene, seed, &options);
    let site = |sources: Sources| Arc::new(sources.site(&scene.site));
    let mut followers = Sources::ALL.map(|sources| SiteTracker::new(&site(sources), Choice::default()));
    let mut reader = FloorReader::all(&site(Sources::Both)).pop().ok_or("no floor")?;
    let mut crowd = Crowd::new(run.world().people().len());
    let receive = |followers: &mut [SiteTracker; 3], arrival: &Arrival| {
        // The floor alone comes first.
        followers
            .iter_mut()
            .skip(1)
            .for_each(|site_tracker| _ = site_tracker.receive(&arrival.bytes, arrival.at_us));
    };
    let end_us = (run.world().duration_s() * 1e6) as u64;
    let mut reading_us = READING_US;
    for tick in 1..=end_us / TICK_US {
        let now_us = tick * TICK_US;
        let arrivals = run.until(now_us).map_err(|error| error.to_string())?;
        let mut arrivals = arrivals.iter().peekable();
        while reading_us <= now_us {
            crowd.follow(run.world().people(), reading_us);
            let at_s = reading_us as f64 * 1e-6;
            let read = reader.read(&crowd.soles(), at_s);
            while let Some(arrival) = arrivals.next_if(|arrival| arrival.at_us <= reading_us) {
                receive(&mut followers, arrival);
            }
            let is_cut = cuts.floor_s.as_ref().is_some_and(|cut_s| cut_s.contains(&at_s));
            for (site_tracker, sources) in followers.iter_mut().zip(Sources::ALL) {
                if sources != Sources::Modules && !is_cut {
                    site_tracker.read(&read);
                }
            }
            reading_us += READING_US;
        }
        arrivals.for_each(|arrival| receive(&mut followers, arrival));
        let moment = run.moment(now_us);
        let known = followers.each_mut().map(|site_tracker| site_tracker.estimate(moment.t));
        look(&moment, &known);
    }
    Ok(run.world().events())
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai_tracking::occupancy::ZoneKnown;
    use proptest::prelude::*;

    /// A person nearer to the zone's middle than this is not at its edge, m: half a metre from it, as a floor shows a person who stops
    /// up to 0.4 m farther along the way until a foot is set again.
    const INSIDE_M: f64 = 0.5;

    /// As long as it takes to find a person, s.
    const FOUND_S: f64 = 1.5;

    /// A floor that takes the feet of two people for those of one may lose one of them for so long, s: until its next reading
    /// but one.
    const LOST_S: f64 = 0.2;

    /// So sure is a zone that says *empty*. A person who came in while nothing was seen, and stands, may be a thing: the count
    /// is 0 then, but only with a probability of one half.
    const EMPTY: f64 = 0.9;

    proptest! {
        #![proptest_config(ProptestConfig { cases: 8, failure_persistence: None, ..ProptestConfig::default() })]

        /// Whatever is unplugged whenever: a zone in which a person stands is never said to be empty, and when all sources of
        /// a site are silent for 3 s nothing is known.
        #[test]
        fn no_source_that_is_unplugged_leaves_an_empty_zone(
            seed in 0_u64..1000,
            people in 1_usize..4,
            floor_s in (3.0..20.0_f64, 1.0..30.0_f64),
            modules_s in prop::array::uniform2((3.0..20.0_f64, 1.0..30.0_f64)),
        ) {
            let modules = modules_s.iter().enumerate().map(|(module, (from_s, for_s))| Outage {
                module,
                from_s: *from_s,
                until_s: Some(from_s + for_s),
            });
            let span = |(from_s, for_s): (f64, f64)| from_s..from_s + for_s;
            let cuts = Cuts { floor_s: Some(span(floor_s)), modules: modules.collect() };
            let mut inside_s = None;
            let mut empty_s = [None; 3];
            let mut faults = Vec::new();
            play(Letter::D, people, seed, &cuts, |moment, known| {
                let t_s = moment.t;
                let is_inside = moment.people.iter().any(|person| {
                    person.x.abs() < INSIDE_M && person.y.abs() < INSIDE_M
                });
                inside_s = is_inside.then(|| inside_s.unwrap_or(t_s));
                let is_found = inside_s.is_some_and(|since_s| t_s - since_s > FOUND_S);
                for ((estimate, sources), empty_s) in known.iter().zip(Sources::ALL).zip(&mut empty_s) {
                    for zone in estimate.zones.values() {
                        let is_empty = is_found && zone.p().first().is_some_and(|none| *none > EMPTY);
                        *empty_s = is_empty.then(|| empty_s.unwrap_or(t_s));
                        if empty_s.is_some_and(|since_s| t_s - since_s > LOST_S - 0.01) {
                            faults.push(format!("{sources} at {t_s:.1} s: {zone:?}"));
                        }
                        let are_silent = |spans: &[(f64, f64)]| {
                            spans.iter().all(|(from_s, for_s)| (from_s + 3.0..from_s + for_s).contains(&t_s))
                        };
                        let all_silent = match sources {
                            Sources::Floor => are_silent(&[floor_s]),
                            Sources::Modules => are_silent(&modules_s),
                            Sources::Both => are_silent(&[floor_s]) && are_silent(&modules_s),
                        };
                        if all_silent && zone.state() != ZoneKnown::Unknown {
                            faults.push(format!("{sources} at {t_s:.1} s, all silent: {zone:?}"));
                        }
                    }
                }
            })
            .unwrap();
            prop_assert!(faults.is_empty(), "{} faults: {:?}", faults.len(), faults.first());
        }
    }
}
