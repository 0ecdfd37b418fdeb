//! The table: for each ID what is known of it, under each explanation of what was seen.
//!
//! ```text
//!   moments, 2 s of them   │ │ │ │ │ │ │     a sign is compared with the moment of its own time
//!   explanations           4  7  5           each with names of its own; without floors there is one
//!   IDs                    a11ce000  b0b00000  …
//! ```
//!
//! IDs know nothing of each other, as in the paper: a person may carry two.

use std::collections::{BTreeMap, VecDeque};
use std::slice;

use super::believed::{self, Believed};
use super::known::HALF_LIFE_S;
use super::line::{NameLine, Whereabouts, zones_at};
use super::message::LATE_MS;
use super::person::{Person, swaps};
use super::sign::{NotTaken, Sign};
use crate::card::Card;
use crate::explanation::Explanation;
use crate::figures::rounded;
use crate::geometry::Point;
use crate::site::Site;
use crate::tracker::rendering::BODIES;
use crate::tracker::{TrackId, TrackState};

/// Tracks are remembered for so long, s: a sign may be that late.
const HISTORY_S: f64 = LATE_MS as f64 * 1e-3;

/// Most moments that are remembered: twenty of them, and some more after a stall.
const MOMENTS_MAX: usize = 32;

/// Between a sign and the nearest moment, at most, s: five frames; further, a walker is a stride away.
const GAP_S: f64 = 0.5;

/// Most tracks that can have a name: as many as the tracker has bodies at most. Those beyond have none.
const TRACKS_MAX: usize = BODIES;

/// Most IDs, and after so long without a sign one gives way to another, s.
const IDS_MAX: usize = 256;
const FORGOTTEN_S: f64 = 3600.0;

/// Most explanations with names of their own: as many as a floor keeps.
const EXPLANATIONS_MAX: usize = 16;

/// Where nothing has two explanations, this is the one.
static ONLY: Explanation = Explanation { line: Vec::new(), surprise: 0.0, people: Vec::new() };

/// All tracks at one moment.
#[derive(Clone, Debug)]
struct Moment {
    at_s: f64,
    /// Those whose places are the same in all explanations.
    others: Vec<Person>,
    /// Of each explanation its number and the rest; the first one's are tracks.
    explained: Vec<(Option<u64>, Vec<Person>)>,
}

impl Moment {
    /// All people of the explanation of this line: its own, or those of the newest that it grew out of, or else all tracks.
    fn people(&self, line: &[u64]) -> impl Iterator<Item = &Person> + Clone {
        let of = |number: &u64| self.explained.iter().find(|(own, _)| *own == Some(*number));
        let own = line.iter().find_map(of).or_else(|| self.explained.first());
        self.others.iter().chain(own.into_iter().flat_map(|(_, people)| people))
    }

    fn tracks(&self) -> impl Iterator<Item = &Person> + Clone {
        self.people(&[])
    }
}

/// When an ID was read.
#[derive(Clone, Debug, Default)]
struct Heard {
    at_s: f64,
    /// The last place it was read at, and when.
    read: Option<(Point, f64)>,
}

/// Which track is whom: signs and tracks in, names out.
#[derive(Clone, Debug, Default)]
pub struct Names {
    heard: BTreeMap<Card, Heard>,
    /// In the order of the explanations; none before the first moment.
    believed: Vec<Believed>,
    /// Oldest first.
    moments: VecDeque<Moment>,
}

impl Names {
    /// Notes where all tracks are at `now_s`. A time that is not after the last one changes nothing.
    pub fn follow(&mut self, tracks: &[TrackState], now_s: f64) {
        self.follow_explained(tracks, &[], now_s);
    }

    /// The same where some of the tracks may be elsewhere: by each of these explanations, the likeliest first, whose people are
    /// tracks.
    pub fn follow_explained(&mut self, tracks: &[TrackState], explanations: &[Explanation], now_s: f64) {
        let last_s = self.moments.back().map_or(f64::NEG_INFINITY, |moment| moment.at_s);
        // Neither is a time that is no number.
        if !(now_s > last_s && now_s.is_finite()) {
            return;
        }
        let passed_s = if last_s.is_finite() { now_s - last_s } else { 0.0 };
        let explanations = if explanations.is_empty() { slice::from_ref(&ONLY) } else { explanations };
        let explanations = explanations.get(..EXPLANATIONS_MAX).unwrap_or(explanations);
        let moment = Moment::new(tracks, explanations, now_s);
        self.believed = believed::descend(std::mem::take(&mut self.believed), explanations);
        if !self.heard.is_empty() {
            self.fade(&moment, passed_s);
        }
        let too_old = |moment: &Moment| now_s - moment.at_s > HISTORY_S;
        while self.moments.len() >= MOMENTS_MAX || self.moments.front().is_some_and(too_old) {
            self.moments.pop_front();
        }
        self.moments.push_back(moment);
    }

    /// Time passes up to a moment.
    fn fade(&mut self, moment: &Moment, passed_s: f64) {
        let mut people = moment.others.clone();
        let common = swaps(&people, 0, passed_s);
        for (believed, (_, own)) in self.believed.iter_mut().zip(&moment.explained) {
            people.truncate(moment.others.len());
            people.extend(own);
            let own = swaps(&people, moment.others.len(), passed_s);
            for known in believed.ids.values_mut() {
                known.fade(&people, passed_s, HALF_LIFE_S, common.iter().chain(&own));
            }
        }
        let Self { heard, believed, .. } = self;
        heard.retain(|card, heard| {
            let has_share =
                |believed: &Believed| believed.ids.get(card).is_some_and(|known| !known.shares.is_empty());
            moment.at_s - heard.at_s < FORGOTTEN_S || believed.iter().any(has_share)
        });
        for believed in believed {
            believed.ids.retain(|card, _| heard.contains_key(card));
        }
    }

    /// Takes a sign.
    ///
    /// # Errors
    /// Why it changes nothing.
    pub fn sign(&mut self, sign: &Sign) -> Result<(), NotTaken> {
        let place = sign.read.gaussian()?;
        let away_s = |moment: &Moment| (moment.at_s - sign.at_s).abs();
        let nearest = self.moments.iter().min_by(|one, other| away_s(one).total_cmp(&away_s(other)));
        let moment = nearest.filter(|moment| away_s(moment) <= GAP_S).ok_or(NotTaken::Untracked)?;
        if !self.heard.contains_key(&sign.card) && self.heard.len() >= IDS_MAX {
            let oldest = self.heard.iter().min_by(|one, other| one.1.at_s.total_cmp(&other.1.at_s));
            let gives_way = oldest.filter(|(_, heard)| sign.at_s - heard.at_s > FORGOTTEN_S);
            let card = gives_way.map(|(card, _)| *card).ok_or(NotTaken::Full)?;
            self.heard.remove(&card);
            self.believed.iter_mut().for_each(|believed| _ = believed.ids.remove(&card));
        }
        let heard = self.heard.entry(sign.card).or_default();
        heard.at_s = heard.at_s.max(sign.at_s);
        let Some((at, spread)) = place else { return Ok(()) };
        // One that was overtaken is weighed as well, but is not where the ID was read last.
        if heard.read.is_none_or(|(_, read_s)| read_s <= sign.at_s) {
            heard.read = Some((at, sign.at_s));
        }
        for believed in &mut self.believed {
            let known = believed.ids.entry(sign.card).or_default();
            let people = moment.people(&believed.line);
            let likelihood = known.weigh(people, sign.at_s - moment.at_s, at, spread);
            believed.doubt(likelihood);
        }
        believed::level(&mut self.believed);
        Ok(())
    }

    /// What is known of each ID at the newest moment.
    #[must_use]
    pub fn lines(&self, site: &Site) -> Vec<NameLine> {
        let told = self.told();
        self.heard.iter().map(|(card, heard)| self.line(*card, heard, &told, site).0).collect()
    }

    /// Where an ID is; none if it was not read within the last hour, and no track is known to be it.
    #[must_use]
    pub fn where_is(&self, card: Card, site: &Site) -> Option<Whereabouts> {
        let heard = self.heard.get(&card)?;
        let (name, at) = self.line(card, heard, &self.told(), site);
        Some(Whereabouts { at: at.map(centimetres), read: heard.read.map(|(at, _)| centimetres(at)), name })
    }

    /// The names that are told, and for which track each of its people stands where it is not its own.
    fn told(&self) -> Told<'_> {
        let (index, believed) = believed::likeliest(&self.believed).unzip();
        let tracks = match (index, self.moments.back()) {
            (Some(1..), Some(moment)) => {
                let [people, tracks] = [believed.map_or(&[][..], |believed| &believed.line), &[]]
                    .map(|line| moment.people(line).copied().collect::<Vec<_>>());
                Some(believed::on_tracks(&people, &tracks))
            }
            // The first one's people are tracks.
            _ => None,
        };
        Told { believed, tracks }
    }

    /// What is known of an ID, and where its likeliest track is.
    fn line(&self, card: Card, heard: &Heard, told: &Told<'_>, site: &Site) -> (NameLine, Option<Point>) {
        let known = told.believed.and_then(|believed| believed.ids.get(&card));
        let track = |person: TrackId| match &told.tracks {
            Some(tracks) => tracks.get(&person).copied(),
            None => Some(person),
        };
        let tracks = known.map(|known| known.told(track)).unwrap_or_default();
        let likeliest = tracks.first().map(|likelihood| likelihood.track);
        let mut people = self.moments.back().into_iter().flat_map(Moment::tracks);
        let at = people.find(|person| Some(person.track) == likeliest).map(|person| person.at);
        let zones = at.map(|at| zones_at(site, at)).unwrap_or_default();
        let heard_s = self.since_s(heard.at_s);
        let read_s = heard.read.map(|(_, at_s)| self.since_s(at_s));
        (NameLine { card: Some(card), label: card.label(), heard_s, read_s, tracks, zones }, at)
    }

    /// Since a time, s, to the tenth.
    fn since_s(&self, at_s: f64) -> f64 {
        let now_s = self.moments.back().map_or(at_s, |moment| moment.at_s);
        rounded((now_s - at_s).max(0.0), 10.0)
    }
}

/// Names as they are told.
struct Told<'a> {
    believed: Option<&'a Believed>,
    tracks: Option<BTreeMap<TrackId, TrackId>>,
}

impl Moment {
    fn new(tracks: &[TrackState], explanations: &[Explanation], at_s: f64) -> Self {
        let is_explained = |track: &&TrackState| {
            explanations.first().is_some_and(|first| first.people.iter().any(|person| person.id == track.id))
        };
        let others = tracks.iter().filter(|track| !is_explained(track)).filter_map(Person::of);
        let people = |explanation: &Explanation| {
            let by_feet = |person| Person { is_told_apart: false, ..person };
            let people = explanation.people.iter().filter_map(Person::of).map(by_feet).take(TRACKS_MAX);
            (explanation.line.first().copied(), people.collect())
        };
        Self {
            at_s,
            others: others.take(TRACKS_MAX).collect(),
            explained: explanations.iter().map(people).collect(),
        }
    }
}

fn centimetres(at: Point) -> [f64; 2] {
    [at.x, at.y].map(|metres| rounded(metres, 100.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_explanations_have_names_than_a_floor_keeps() {
        let many: Vec<Explanation> =
            (0..100).map(|number| Explanation { line: vec![number], ..Explanation::default() }).collect();
        let mut names = Names::default();
        names.follow_explained(&[], &many, 0.0);
        let moment = names.moments.back().unwrap();
        assert_eq!((names.believed.len(), moment.explained.len()), (16, 16));
        names.follow(&[], 0.1);
        assert_eq!(names.believed.len(), 1);
    }

    #[test]
    fn times_and_places_are_written_as_short_as_they_are_known() {
        let mut names = Names::default();
        names.follow(&[], 0.3);
        assert_eq!(names.since_s(0.0).to_string(), "0.3");
        assert_eq!(centimetres(Point::new(0.07, 2.3)).map(|metres| metres.to_string()), ["0.07", "2.3"]);
    }
}
