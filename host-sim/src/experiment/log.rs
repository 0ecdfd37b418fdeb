//! A run as a rule judges it: line by line the true people, the tracks, and the count of the zone.
//!
//! ```text
//!   Record ─▶ tracker, every 0.1 s ─▶ Line { people, tracks, inside, counted } …    and a Tally of all scores
//! ```

use crate::baselines::Choice;
use kehai_tracking::geometry::{Point, inside};
use kehai_tracking::occupancy::ZoneLine;
use kehai_tracking::tracker::LifeCycle;

use crate::run::Record;
use crate::score::{Estimate, Frame, Region, Scorer, Settings, Tally, Target};
use crate::world::site::{Site, Zone};

/// A whole run.
#[derive(Clone, Debug)]
pub struct Log {
    /// Every 0.1 s.
    pub lines: Vec<Line>,
    /// All scores.
    pub tally: Tally,
}

/// One time.
#[derive(Clone, Debug)]
pub struct Line {
    /// s.
    pub t_s: f64,
    /// All people in the world.
    pub people: Vec<Target>,
    /// Confirmed and occluded tracks.
    pub tracks: Vec<Estimate>,
    /// People in the zone that counts.
    pub inside: usize,
    /// People found there.
    pub counted: usize,
}

/// The zone that counts: the first of them.
#[must_use]
pub fn zone(site: &Site) -> Option<&Zone> {
    site.zones.iter().find(|zone| zone.count)
}

/// The rectangle around it.
#[must_use]
pub fn around(zone: &Zone) -> Option<Region> {
    let corners = || zone.polygon.iter().map(|&[x, y]| Point::new(x, y));
    let fold = |pick: fn(f64, f64) -> f64| {
        corners().reduce(|one, other| Point::new(pick(one.x, other.x), pick(one.y, other.y)))
    };
    Some(Region::between(fold(f64::min)?, fold(f64::max)?))
}

impl Log {
    /// Runs the tracker on a record; the scores are those of the region, or else of the counting zone.
    #[must_use]
    pub fn of(record: &Record, choice: Choice, region: Option<Region>) -> Self {
        let zone = zone(&record.site);
        let area = zone.and_then(around);
        let polygon: Vec<Point> =
            zone.iter().flat_map(|zone| &zone.polygon).map(|&corner| corner.into()).collect();
        let settings = Settings { region: region.or(area), area, ..Settings::default() };
        let mut scorer = Scorer::new(settings);
        let lines = record.follow(choice, |site_tracker, moment| {
            let known = site_tracker.line(moment.t);
            let people: Vec<Target> = moment.people.iter().map(Target::from).collect();
            let mut tracks: Vec<Estimate> = known.tracks.iter().map(Estimate::from).collect();
            scorer.frame(&Frame { t_s: moment.t, truth: &people, tracks: &tracks });
            tracks.retain(|track| track.state != LifeCycle::Tentative);
            let counted =
                zone.and_then(|zone| known.zones.get(&zone.name)).and_then(ZoneLine::count).unwrap_or(0);
            let inside = people.iter().filter(|person| inside(person.at, &polygon)).count();
            Line { t_s: moment.t, people, tracks, inside, counted: counted as usize }
        });
        Self { lines, tally: scorer.finish().0 }
    }
}
