//! One stream of pictures against the truth: IDF1, and what becomes of numbers and names over borders.
//!
//! ```text
//!   hall 0                  │                  hall 1
//!   ●───────────●           │           ○────────────▶
//!          number 7, "a11c" ├─ border ──┤ number 7: kept, "a11c": kept     1.2 m from the border on both sides
//! ```
//!
//! A person has the number of the track that stands for them: tracks and people are paired one to one within 0.5 m.

use std::collections::BTreeMap;

use kehai_tracking::geometry::Point;
use kehai_tracking::jsonl::TrackLine;
use kehai_tracking::names::NameLine;
use kehai_tracking::tracker::LifeCycle;

use super::named::{Named, lost_alone};
use super::world::{AREAS, depth_m};
use crate::score::assign::nearest;
use crate::score::{Estimate, Frame, Scorer, Settings, Tally, Target};

/// A person is settled in a hall this far from its borders, m: beyond the strip of two metres that both areas see, and a stride.
pub const SETTLED_M: f64 = 1.2;

/// A track farther away is not the person, m: as in all scores.
const GATE_M: f64 = 0.5;

/// The name of a track is what it is more probably than all else.
const NAMED: f64 = 0.5;

/// The numbers that tracks give to people at one time.
pub type Numbers = BTreeMap<u64, u64>;

/// What was crossed, and what became of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Crossings {
    /// Crossings of people who had a number before and after.
    pub all: u64,
    /// Those with another number after it.
    pub renumbered: u64,
    /// Of these, those whose number no tracker of an area has changed meanwhile.
    pub at_border: u64,
    /// Those who had their name before, and a number after.
    pub named: u64,
    /// Of these, those without it, or with another one, after.
    pub unnamed: u64,
    /// Of these, those whom the other way of following has named after, too.
    pub unnamed_alone: u64,
}

impl std::ops::AddAssign for Crossings {
    fn add_assign(&mut self, other: Self) {
        self.all += other.all;
        self.renumbered += other.renumbered;
        self.at_border += other.at_border;
        self.named += other.named;
        self.unnamed += other.unnamed;
        self.unnamed_alone += other.unnamed_alone;
    }
}

/// A crossing with another number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Renumbered {
    /// When the person was settled in the next hall, s.
    pub t_s: f64,
    /// The person.
    pub person: u64,
    /// From which hall to which.
    pub halls: [usize; 2],
    /// The numbers.
    pub numbers: [u64; 2],
    /// Whether no tracker of an area has changed its number for them.
    pub at_border: bool,
}

/// A person on the way.
#[derive(Clone, Debug, Default)]
struct Walk {
    /// The hall they were settled in last, and the number and whether they had their name there.
    settled: Option<(usize, u64, bool)>,
    /// The last number that the tracker of each area had for them.
    local: [Option<u64>; AREAS.len()],
    /// One of those has changed since they were settled.
    changed: bool,
}

/// Judges pictures, one after the other.
#[derive(Debug)]
pub struct Judge {
    scorer: Scorer,
    walks: BTreeMap<u64, Walk>,
    crossings: Crossings,
    renumbered: Vec<Renumbered>,
    named: Vec<Named>,
}

impl Default for Judge {
    fn default() -> Self {
        let settings = Settings::default();
        Self {
            scorer: Scorer::new(settings),
            walks: BTreeMap::new(),
            crossings: Crossings::default(),
            renumbered: Vec::new(),
            named: Vec::new(),
        }
    }
}

/// The number of the track that stands for each person.
#[must_use]
pub fn numbers(truth: &[Target], tracks: &[TrackLine]) -> Numbers {
    let sure: Vec<&TrackLine> = tracks.iter().filter(|track| track.state != LifeCycle::Tentative).collect();
    let apart_m = |person: usize, track: usize| {
        let (person, track) = (truth.get(person)?, sure.get(track)?);
        let apart_m = (person.at - Point::new(track.x, track.y)).length();
        (apart_m <= GATE_M).then_some(apart_m)
    };
    let pairs = nearest(truth.len(), sure.len(), apart_m);
    pairs
        .into_iter()
        .filter_map(|(person, track)| Some((truth.get(person)?.id, sure.get(track)?.id)))
        .collect()
}

impl Judge {
    /// Takes the picture at `t_s`. `labels` are the names by person; `local` has what each tracker of an area calls each person, none
    /// where there are no areas.
    pub fn frame(
        &mut self,
        t_s: f64,
        truth: &[Target],
        tracks: &[TrackLine],
        names: &[NameLine],
        labels: &BTreeMap<u64, String>,
        local: &[Numbers],
    ) {
        let estimates: Vec<Estimate> = tracks.iter().map(Estimate::from).collect();
        self.scorer.frame(&Frame { t_s, truth, tracks: &estimates });
        let now = numbers(truth, tracks);
        for person in truth {
            let walk = self.walks.entry(person.id).or_default();
            for (hall, (last, numbers)) in walk.local.iter_mut().zip(local).enumerate() {
                // Tracks that an area has far behind the border do not matter.
                let is_asked = depth_m(hall, person.at) > -SETTLED_M;
                let Some(number) = numbers.get(&person.id).filter(|_| is_asked) else { continue };
                walk.changed |= last.is_some_and(|last| last != *number);
                *last = Some(*number);
            }
            let hall = (0..AREAS.len()).find(|hall| depth_m(*hall, person.at) > SETTLED_M);
            let Some((hall, number)) = hall.zip(now.get(&person.id).copied()) else { continue };
            let named = labels.get(&person.id).is_some_and(|label| is_named(names, label, number));
            if let Some((from, before, was_named)) = walk.settled
                && from != hall
            {
                let at_border = before != number && !walk.changed;
                self.crossings += Crossings {
                    all: 1,
                    renumbered: u64::from(before != number),
                    at_border: u64::from(at_border),
                    named: u64::from(was_named),
                    unnamed: u64::from(was_named && !named),
                    // Known once both ways have been followed.
                    unnamed_alone: 0,
                };
                if was_named {
                    self.named.push(Named { t_s, person: person.id, halls: [from, hall], kept: named });
                }
                if before != number {
                    self.renumbered.push(Renumbered {
                        t_s,
                        person: person.id,
                        halls: [from, hall],
                        numbers: [before, number],
                        at_border,
                    });
                }
            }
            walk.settled = Some((hall, number, named));
            walk.changed = false;
        }
    }

    /// The crossings of people who had their name before.
    #[must_use]
    pub fn named(&self) -> &[Named] {
        &self.named
    }

    /// The scores, and the crossings: all, and those with another number. `other` followed the same people in the other way.
    #[must_use]
    pub fn finish(mut self, other: &[Named]) -> (Tally, Crossings, Vec<Renumbered>) {
        self.crossings.unnamed_alone = lost_alone(&self.named, other);
        (self.scorer.finish().0, self.crossings, self.renumbered)
    }
}

/// Whether the likeliest track of this name is that one.
fn is_named(names: &[NameLine], label: &str, number: u64) -> bool {
    let line = names.iter().find(|line| line.label == label);
    let likeliest = line.and_then(|line| line.tracks.first());
    likeliest.is_some_and(|likely| likely.track == number && likely.probability > NAMED)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(id: u64, x: f64) -> TrackLine {
        let text = format!("{{\"id\":{id},\"x\":{x},\"y\":3.0,\"state\":\"confirmed\"}}");
        serde_json::from_str(&text).unwrap()
    }

    /// A person at `x` who has this number by the site, and these by the trackers of the areas.
    fn at(judge: &mut Judge, x: f64, number: u64, local: [Option<u64>; 2]) {
        let truth = [Target { id: 1, at: Point::new(x, 3.0), beams: None }];
        let of = |number: Option<u64>| number.into_iter().map(|number| (1, number)).collect::<Numbers>();
        judge.frame(0.0, &truth, &[track(number, x + 0.1)], &[], &BTreeMap::new(), &local.map(of));
    }

    #[test]
    fn a_number_that_changes_at_the_border_is_told_from_one_that_a_tracker_changes() {
        let mut judge = Judge::default();
        at(&mut judge, 4.0, 7, [Some(1), None]);
        // In the strip nothing is judged.
        at(&mut judge, 6.0, 8, [Some(1), Some(5)]);
        at(&mut judge, 8.0, 7, [None, Some(5)]);
        assert_eq!(judge.crossings, Crossings { all: 1, ..Crossings::default() });
        at(&mut judge, 4.0, 9, [Some(1), Some(5)]);
        assert_eq!((judge.crossings.renumbered, judge.crossings.at_border), (1, 1));
        at(&mut judge, 6.0, 9, [Some(2), Some(5)]);
        at(&mut judge, 8.0, 10, [None, Some(5)]);
        assert_eq!((judge.crossings.renumbered, judge.crossings.at_border), (2, 1));
        assert_eq!(judge.renumbered[0].halls, [1, 0]);
    }

    #[test]
    fn a_name_is_lost_if_its_likeliest_track_is_another_one_after_the_border() {
        let name = |track: u64| -> NameLine {
            let text = format!(
                "{{\"label\":\"a\",\"heard_s\":0.0,\"tracks\":[{{\"track\":{track},\"probability\":0.9}}]}}"
            );
            serde_json::from_str(&text).unwrap()
        };
        let mut judge = Judge::default();
        let labels: BTreeMap<u64, String> = [(1, "a".to_owned())].into();
        for (x, named) in [(4.0, 7), (8.0, 7), (4.0, 3)] {
            let truth = [Target { id: 1, at: Point::new(x, 3.0), beams: None }];
            judge.frame(0.0, &truth, &[track(7, x)], &[name(named)], &labels, &[]);
        }
        assert_eq!((judge.crossings.named, judge.crossings.unnamed), (2, 1));
    }
}
