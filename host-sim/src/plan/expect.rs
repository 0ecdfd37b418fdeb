//! What the simulator says of a layout: how much of the time the count is exact, and how sure that is.
//!
//! ```text
//!   layout × seed ─▶ world, sensors, devices, network, tracker ─▶ every 0.1 s: people in the zones, people counted there
//!                                                                   │ share of the moments with the right number
//!                                                                   ▼ mean over the seeds, Student's interval
//! ```
//!
//! Only moments with a person in the zones count: that an empty room is empty is no merit of a layout. A zone of which nothing
//! is known counts as no people.

use std::ops::RangeInclusive;

use kehai_tracking::explain::Question;
use kehai_tracking::geometry::inside;
use kehai_tracking::ground::{Share, ground};
use kehai_tracking::occupancy::ZoneLine;
use rayon::prelude::*;

use super::ground::zones;
use super::visit::{NoVisit, Visitors};
use crate::baselines;
use crate::run::{Conditions, Options, Record};
use crate::score::statistics::{Mean, mean};
use crate::world::geometry::Point;
use crate::world::site::{Module, Zone};

/// Why nothing can be expected.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum ExpectError {
    /// People cannot walk on the site.
    #[error(transparent)]
    Visit(#[from] NoVisit),
    /// A fault of the simulation.
    #[error("seed {0}: {1}")]
    Run(u64, String),
}

/// What the simulator says of a layout.
#[derive(Clone, PartialEq, Debug)]
pub struct Expected {
    /// Share of the moments in which the number of people in the zones was right, of each seed.
    pub exact: Vec<f64>,
}

impl Expected {
    /// The mean of the seeds and its interval, both between 0 and 1. None without seeds.
    #[must_use]
    pub fn mean(&self) -> Option<Mean> {
        let mut mean = mean(&self.exact)?;
        mean.interval.low = mean.interval.low.max(0.0);
        mean.interval.high = mean.interval.high.min(1.0);
        Some(mean)
    }
}

/// Runs every layout with every seed; `done` is called after each run.
///
/// # Errors
/// The first fault.
pub fn expect(
    visitors: &Visitors,
    layouts: &[Vec<Module>],
    seeds: &RangeInclusive<u64>,
    done: impl Fn() + Sync,
) -> Result<Vec<Expected>, ExpectError> {
    let jobs: Vec<(usize, u64)> =
        (0..layouts.len()).flat_map(|layout| seeds.clone().map(move |seed| (layout, seed))).collect();
    let one = |(layout, seed): &(usize, u64)| {
        let run = run(visitors, &layouts[*layout], *seed)?;
        done();
        Ok((*layout, run.exact))
    };
    let shares: Vec<(usize, f64)> = jobs.par_iter().map(one).collect::<Result<_, ExpectError>>()?;
    let of = |number: usize| Expected {
        exact: shares.iter().filter(|(layout, _)| *layout == number).map(|(_, exact)| *exact).collect(),
    };
    Ok((0..layouts.len()).map(of).collect())
}

/// What one run has shown.
#[derive(Clone, PartialEq, Debug)]
pub struct Run {
    /// Share of the moments with a person in the zones in which the number was right.
    pub exact: f64,
    /// What the modules saw of the zones before the first person came, as the handover page has it.
    pub seen: Share,
}

/// Runs a layout with one seed.
///
/// # Errors
/// People cannot walk there, or a fault of the simulation.
pub fn run(visitors: &Visitors, modules: &[Module], seed: u64) -> Result<Run, ExpectError> {
    let scene = visitors.scene(modules, seed)?;
    let options = Options { conditions: Conditions::LAN, ..Options::default() };
    let record =
        Record::of(&scene, seed, &options).map_err(|stuck| ExpectError::Run(seed, stuck.to_string()))?;
    let zones = zones(&record.site);
    let polygons: Vec<Vec<Point>> = zones.iter().map(Zone::corners).collect();
    let (mut moments, mut right) = (0_u32, 0_u32);
    let mut seen = None;
    record.follow(baselines::Choice::default(), |site_tracker, moment| {
        if seen.is_none() && !moment.people.is_empty() {
            let glances = site_tracker.facts(&Question::Views, moment.t).glances;
            seen = Some(ground(&record.site, &glances).all);
        }
        let within = |polygon: &Vec<Point>| {
            moment.people.iter().filter(|person| inside(Point::new(person.x, person.y), polygon)).count()
                as u32
        };
        let truth: u32 = polygons.iter().map(within).sum();
        let line = site_tracker.line(moment.t);
        let counted = |zone: &Zone| line.zones.get(&zone.name).and_then(ZoneLine::count).unwrap_or(0);
        let counted: u32 = zones.iter().map(counted).sum();
        moments += u32::from(truth > 0);
        right += u32::from(truth > 0 && counted == truth);
    });
    let exact = f64::from(right) / f64::from(moments.max(1));
    Ok(Run { exact, seen: seen.unwrap_or_default() })
}
