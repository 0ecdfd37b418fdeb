//! The halls in memory: the same datagrams to one tracker, and to those of the areas, whose frames are put together.
//!
//! ```text
//!   ms        25      50      75      100
//!   frames  ── a ───── b ───── c ───── d ─╮     each area at its own time, as trackers on different hosts; some are lost
//!   picture ──────────────────────────────┴─    one tracker's line of the same moment beside it
//! ```

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use kehai_tracking::areas::{AreaFrame, AreaName, Campus};
use kehai_tracking::card::Card;
use kehai_tracking::geometry::Point;
use kehai_tracking::names::{Names, Read, Sign};
use kehai_tracking::site::Site;
use kehai_tracking::site_tracker::SiteTracker;
use kehai_tracking::snapshot::Snapshot;
use kehai_tracking::total::total;
use kehai_tracking::tracker::Selected;

use super::cards::{Cards, Due, SIGMA_M};
use super::judge::{Crossings, Judge, Numbers, Renumbered, numbers};
use super::totals::Totals;
use super::world::{AREAS, Halls, area};
use crate::run::{Arrival, Moment, Options, Record, TICK_US};
use crate::score::{Tally, Target};
use crate::world::random::{Purpose, Stream};

/// A frame is on its way for so long, µs: a network's millisecond, and what the encoding of it takes.
const ON_ITS_WAY_US: u64 = 5_000;

/// Between the frames of two areas, µs: they share no clock.
const APART_US: u64 = TICK_US / AREAS.len() as u64;

/// How a site did.
#[derive(Clone, Debug, Default)]
pub struct Side {
    /// Its scores.
    pub tally: Tally,
    /// Its crossings.
    pub crossings: Crossings,
    /// Those with another number.
    pub renumbered: Vec<Renumbered>,
}

/// One run: the same world followed in both ways.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// One tracker of all halls.
    pub one: Side,
    /// A tracker of each, put together.
    pub four: Side,
    /// Their totals, of the one first.
    pub totals: Totals,
    /// Frames of areas that were lost.
    pub lost: u64,
}

impl Outcome {
    /// Of what was judged in both ways.
    #[must_use]
    pub fn of(one: Judge, four: Judge, totals: Totals, lost: u64) -> Self {
        let named = [&one, &four].map(|judge| judge.named().to_vec());
        let [one, four] = [(one, &named[1]), (four, &named[0])].map(|(judge, other)| {
            let (tally, crossings, renumbered) = judge.finish(other);
            Side { tally, crossings, renumbered }
        });
        Self { one, four, totals, lost }
    }

    /// Adds another run.
    pub fn add(&mut self, other: Self) {
        for (side, more) in [(&mut self.one, other.one), (&mut self.four, other.four)] {
            side.tally += &more.tally;
            side.crossings += more.crossings;
            side.renumbered.extend(more.renumbered);
        }
        self.totals.add(&other.totals);
        self.lost += other.lost;
    }
}

/// A tracker of some modules, as it would run alone.
struct Tracker {
    site: Arc<Site>,
    tracker: SiteTracker,
    names: Names,
    /// Which modules of all it subscribes to.
    takes: Vec<bool>,
    next: usize,
}

impl Tracker {
    fn new(site: Site, all: &Site, model: Selected) -> Self {
        let takes = all.modules.iter().map(|module| site.modules.contains(module)).collect();
        let site = Arc::new(site);
        let tracker = SiteTracker::new(&site, model);
        Self { site, tracker, names: Names::default(), takes, next: 0 }
    }

    /// What it says at `at_us`, from what had arrived by then.
    fn says(&mut self, arrivals: &[Arrival], at_us: u64, signs: &[Sign]) -> Snapshot {
        while let Some(arrival) = arrivals.get(self.next).filter(|arrival| arrival.at_us <= at_us) {
            self.next += 1;
            if self.takes.get(usize::from(arrival.module)).copied().unwrap_or(false) {
                self.tracker.receive(&arrival.bytes, arrival.at_us);
            }
        }
        let at_s = at_us as f64 * 1e-6;
        let estimate = self.tracker.estimate(at_s);
        self.names.follow(&estimate.tracks, at_s);
        for sign in signs {
            // One that comes before any track changes nothing.
            let _ = self.names.sign(&Sign { at_s, ..*sign });
        }
        let mut frame = Snapshot::of(at_us / 1000, (&estimate).into());
        frame.total = total(&self.site, &frame.line, &frame.modules);
        frame.names = self.names.lines(&self.site);
        frame
    }
}

/// The card of a person: the number in the digits that a label shows.
const fn card(person: u64) -> Card {
    Card((person as u128) << 112)
}

/// What all trackers said at one moment, and what was true.
struct Said {
    t_s: f64,
    truth: Vec<Target>,
    /// The one tracker.
    whole: Snapshot,
    /// The trackers of the areas, each at its own time.
    areas: Vec<(u64, Snapshot)>,
}

/// The halls as they were followed, by the one tracker and by those of the areas.
pub struct Followed {
    halls: Halls,
    /// The areas, and the site of each.
    areas: Vec<(AreaName, Site)>,
    moments: Vec<Said>,
    /// The names of people whose cards were read.
    labels: BTreeMap<u64, String>,
}

/// Plays the halls, and follows them in both ways.
///
/// # Errors
/// A fault of the simulation.
pub fn play(halls: &Halls) -> Result<Followed, String> {
    let scene = halls.scene().map_err(|error| error.to_string())?;
    let record = Record::of(&scene, halls.seed, &Options::default()).map_err(|error| error.to_string())?;
    Ok(follow(halls, &record))
}

/// Follows what was recorded, in both ways.
#[must_use]
pub fn follow(halls: &Halls, record: &Record) -> Followed {
    let all = &record.site;
    let arrivals = heard(halls, &record.arrivals);
    let mut one = Tracker::new(all.clone(), all, halls.tracker);
    let names = AREAS.iter().filter_map(|name| name.parse().ok());
    let areas: Vec<(AreaName, Site)> = names.zip((0..).map(|hall| area(all, hall))).collect();
    let of_area = |(_, site): &(AreaName, Site)| Tracker::new(site.clone(), all, halls.tracker);
    let mut trackers: Vec<Tracker> = areas.iter().map(of_area).collect();
    let mut labels: BTreeMap<u64, String> = BTreeMap::new();
    let mut cards = Cards::default();
    let mut said = |moment: &Moment| {
        let at_us = (moment.t * 1e6).round() as u64;
        let signs = read(moment, &mut cards, &mut labels);
        let whole = one.says(&arrivals, at_us, &signs.iter().map(|sign| sign.1).collect::<Vec<_>>());
        let says = |(hall, tracker): (usize, &mut Tracker)| {
            let own: Vec<Sign> = signs.iter().filter(|sign| sign.0 == hall).map(|sign| sign.1).collect();
            let said_us = at_us.saturating_sub(APART_US * (AREAS.len() - hall) as u64);
            (said_us, tracker.says(&arrivals, said_us, &own))
        };
        let areas = trackers.iter_mut().enumerate().map(says).collect();
        Said { t_s: moment.t, truth: moment.people.iter().map(Target::from).collect(), whole, areas }
    };
    let moments = record.truth.iter().map(&mut said).collect();
    Followed { halls: *halls, areas, moments, labels }
}

/// What arrives: a module that falls silent is heard no more.
fn heard<'a>(halls: &Halls, arrivals: &'a [Arrival]) -> Cow<'a, [Arrival]> {
    let Some(silent) = halls.silent else { return arrivals.into() };
    let from_us = (halls.seconds * 0.5e6) as u64;
    let is_heard = |arrival: &&Arrival| usize::from(arrival.module) != silent || arrival.at_us < from_us;
    arrivals.iter().filter(is_heard).cloned().collect()
}

impl Followed {
    /// The areas put together, and judged beside the one tracker; this share of their frames is lost.
    #[must_use]
    pub fn together(&self, lost_share: f64) -> Outcome {
        let names: Vec<AreaName> = self.areas.iter().map(|(name, _)| name.clone()).collect();
        let mut campus = Campus::new(&names, names.len());
        for (name, site) in &self.areas {
            campus.set_site(name, site.clone());
        }
        let site = campus.site();
        let mut stream = Stream::new(self.halls.seed, Purpose::Network, [u64::MAX, 0]);
        let (mut judge_one, mut judge_four) = (Judge::default(), Judge::default());
        let (mut totals, mut lost) = (Totals::default(), 0);
        for (number, said) in (1..).zip(&self.moments) {
            let Said { t_s, truth, whole, areas } = said;
            for (name, (said_us, frame)) in names.iter().zip(areas) {
                if stream.chance(lost_share) {
                    lost += 1;
                } else {
                    let frame = AreaFrame { epoch: 1, number, frame: frame.clone() };
                    campus.hear(name, frame, said_us + ON_ITS_WAY_US);
                }
            }
            let at_us = (t_s * 1e6).round() as u64;
            let picture = campus.picture(&site, at_us, at_us / 1000);
            if *t_s < self.halls.judged_from_s() {
                continue;
            }
            let local: Vec<Numbers> =
                areas.iter().map(|(_, frame)| numbers(truth, &frame.line.tracks)).collect();
            judge_one.frame(*t_s, truth, &whole.line.tracks, &whole.names, &self.labels, &[]);
            judge_four.frame(*t_s, truth, &picture.line.tracks, &picture.names, &self.labels, &local);
            let people = u32::try_from(truth.len()).unwrap_or(u32::MAX);
            totals.frame([whole.total.count, picture.total.count], people);
        }
        Outcome::of(judge_one, judge_four, totals, lost)
    }
}

/// The cards that are read at this moment, each with the hall it is read in.
fn read(moment: &Moment, cards: &mut Cards, labels: &mut BTreeMap<u64, String>) -> Vec<(usize, Sign)> {
    let people = moment.people.iter().map(|person| (u64::from(person.id), Point::new(person.x, person.y)));
    let sign = |due: Due| {
        labels.insert(due.person, card(due.person).label());
        let variance_m2 = SIGMA_M * SIGMA_M;
        let read = Read::Place { at: due.at, covariance_m2: [variance_m2, 0.0, variance_m2] };
        (due.hall, Sign { card: card(due.person), at_s: moment.t, read })
    };
    cards.due(moment.t, people).into_iter().map(sign).collect()
}
