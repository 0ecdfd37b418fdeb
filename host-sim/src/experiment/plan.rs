//! What an experiment runs: scenes with so many people, trackers, seeds.

use std::ops::RangeInclusive;

use crate::baselines::Choice;
use kehai_tracking::tracker::rendering::Part;

use super::passages;
use super::table::Cell;
use super::trial::{self, Trial};
use crate::world::scene::{Scene, SceneError};
use crate::world::variation::{Letter, Variation};

/// One scene with so many people, judged for each of some trackers.
#[derive(Clone, Debug)]
pub struct Case {
    /// Name in the table.
    pub scene: String,
    /// How many people.
    pub people: usize,
    /// How they come and wait.
    pub condition: Letter,
    /// An arrangement of sensors, by its name in the scene.
    pub sensors: Option<String>,
    /// The trackers.
    pub trackers: Vec<Choice>,
}

impl Case {
    /// The door area in this condition.
    #[must_use]
    pub fn door(condition: Letter, people: usize, trackers: &[Choice]) -> Self {
        let scene = format!("door area, {condition}");
        Self { scene, people, condition, sensors: None, trackers: trackers.to_vec() }
    }

    /// The scene itself.
    ///
    /// # Errors
    /// No such arrangement, or an impossible number of people.
    pub fn build(&self) -> Result<Scene, SceneError> {
        let mut scene = Scene::load("door-area")?;
        scene.vary(&Variation {
            people: Some(self.people),
            condition: Some(self.condition),
            sensors: self.sensors.clone(),
            ..Variation::default()
        })?;
        Ok(scene)
    }

    /// The cell of one of its trackers.
    #[must_use]
    pub fn cell(&self, tracker: Choice, sensors: usize) -> Cell {
        Cell {
            scene: self.scene.clone(),
            sensors: u32::try_from(sensors).unwrap_or(u32::MAX),
            people: u32::try_from(self.people).unwrap_or(u32::MAX),
            tracker: tracker.to_string(),
        }
    }
}

/// The tables there are.
#[derive(Clone, Copy, PartialEq, Eq, Debug, clap::ValueEnum)]
pub enum Table {
    /// Every one of those below, one after the other: all figures of docs/accuracy.md
    All,
    /// Paper A's door area, conditions D and H, one to seven people, all trackers
    Door,
    /// Condition H with five to seven people, our tracker with each part left out in turn
    Ideas,
    /// Thighs instead of torsos, one to five people
    Thighs,
    /// People who come in pairs
    Pairs,
    /// One of two leaves, and two leave as one
    Leaving,
    /// Two come in touching, one leaves; the zone is secure
    Touching,
    /// A person stands still for an hour
    Standing,
    /// A chair is put down at twenty places
    Chairs,
    /// Suitcase, pushchair, wheelchair, backpack, crouching, embracing, a child
    Carried,
    /// Paper C's furnished home, torso and thighs
    Home,
    /// The same with bodies by height, arms over tables, things moved on them, a sliding door
    HomeHard,
    /// Door leaf, curtain, fan and a mirror with visitors; cross-talk in an empty area
    Clutter,
    /// Condition H with five people over a network that loses, repeats and delays
    Disturbed,
    /// Paper D's entrance before a depth camera: its method and ours, each idea left out in turn
    Entrance,
    /// The guarded door: tailgaters, and everything else that happens there; of docs/door.md
    Passages,
    /// Paper A's experiment from end to end: authenticate, enter a number, pass; of docs/door.md
    PaperA,
    /// Paper B's experiments: who is where on a pressure floor, by optical tags; and through silences of a minute
    Floor,
    /// The door area on a floor and before two modules: what each sees alone, and both together
    FloorAndModules,
    /// Poses found by walking, and modules that were turned or covered; of docs/calibration.md
    Poses,
    /// Where a floor is, found by walking over it; of docs/calibration.md
    FloorPoses,
    /// Counting lines: crossings counted, missed and false, in a home and in the door area
    Lines,
}

/// Runs of a table.
#[derive(Clone, Debug)]
pub enum Work {
    /// Door areas, judged by success.
    Door(Vec<Case>, RangeInclusive<u64>),
    /// Scenes, each judged by its own rule.
    Trials(Vec<Trial>),
    /// Passages through a guarded door.
    Passages(Vec<passages::Row>, RangeInclusive<u64>),
    /// Paper B's experiments on a floor.
    Floor(RangeInclusive<u64>),
    /// The door area on a floor and before modules.
    FloorAndModules(RangeInclusive<u64>),
    /// Poses by walking.
    Poses(RangeInclusive<u64>),
    /// A floor's pose by walking.
    FloorPoses(RangeInclusive<u64>),
    /// The entrance before a depth camera.
    Entrance(RangeInclusive<u64>),
    /// Counting lines.
    Lines(RangeInclusive<u64>),
}

impl std::fmt::Display for Table {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = clap::ValueEnum::to_possible_value(self);
        f.write_str(name.as_ref().map_or("", clap::builder::PossibleValue::get_name))
    }
}

impl Table {
    /// The tables of docs/accuracy.md, in the order of the page.
    pub const EACH: [Self; 12] = [
        Self::Door,
        Self::Ideas,
        Self::Thighs,
        Self::Pairs,
        Self::Leaving,
        Self::Touching,
        Self::Standing,
        Self::Chairs,
        Self::Carried,
        Self::Home,
        Self::Clutter,
        Self::Disturbed,
    ];

    /// The tables this one stands for.
    #[must_use]
    pub fn each(self) -> Vec<Self> {
        if self == Self::All { Self::EACH.to_vec() } else { vec![self] }
    }

    /// The runs of this table; `trackers` and `seeds` replace its own unless they are empty.
    #[must_use]
    pub fn work(self, trackers: &[Choice], seeds: Option<&RangeInclusive<u64>>) -> Work {
        let own = |names: &[&str]| chosen(trackers, names);
        let mut trials = match self {
            Self::All | Self::Door | Self::Ideas | Self::Thighs | Self::Pairs => {
                let last = if self == Self::Ideas { 10_049 } else { 10_199 };
                return Work::Door(self.cases(trackers), seeds.cloned().unwrap_or(10_000..=last));
            }
            Self::Floor => return Work::Floor(seeds.cloned().unwrap_or(10_000..=10_199)),
            Self::FloorAndModules => {
                return Work::FloorAndModules(seeds.cloned().unwrap_or(10_000..=10_199));
            }
            Self::Poses => return Work::Poses(seeds.cloned().unwrap_or(10_000..=10_039)),
            Self::FloorPoses => return Work::FloorPoses(seeds.cloned().unwrap_or(10_000..=10_099)),
            Self::Lines => return Work::Lines(seeds.cloned().unwrap_or(10_000..=10_199)),
            Self::Entrance => return Work::Entrance(seeds.cloned().unwrap_or(10_000..=10_199)),
            Self::Leaving => trial::leaving(&own(&["kehai", "kehai-rules", "lee", "particle"])),
            // Only ours report unexplained measurements.
            Self::Touching => trial::touching(&own(&["kehai", "kehai-rules"])),
            Self::Standing => trial::standing(&own(&["kehai"])),
            Self::Chairs => trial::chairs(&own(&["kehai", "kehai-rules", "lee", "particle"])),
            Self::Carried => trial::carried(&own(&["kehai", "kehai-rules", "lee", "particle"])),
            Self::Home => trial::home(&own(&crate::baselines::NAMES)),
            Self::HomeHard => trial::home_hard(&own(&crate::baselines::NAMES)),
            Self::Passages => {
                let rows = [
                    passages::tailgaters(),
                    passages::behind_loads(),
                    passages::others(),
                    passages::loads(),
                    passages::groups(),
                ]
                .concat();
                return Work::Passages(rows, seeds.cloned().unwrap_or(10_000..=10_199));
            }
            Self::PaperA => {
                return Work::Passages(passages::paper(), seeds.cloned().unwrap_or(10_000..=10_049));
            }
            Self::Clutter => trial::clutter(&own(&["kehai", "lee"])),
            Self::Disturbed => trial::disturbed(&own(&["kehai", "lee"])),
        };
        if let Some(seeds) = seeds {
            trials.iter_mut().for_each(|trial| trial.seeds = seeds.clone());
        }
        Work::Trials(trials)
    }

    /// The door areas of a table; empty for a table of another kind. `trackers` replace its own unless they are empty.
    #[must_use]
    pub fn cases(self, trackers: &[Choice]) -> Vec<Case> {
        let own = |names: &[&str]| chosen(trackers, names);
        let all = own(&crate::baselines::NAMES);
        let door = |condition: Letter, people: RangeInclusive<usize>, trackers: &[Choice]| {
            people.map(|people| Case::door(condition, people, trackers)).collect::<Vec<_>>()
        };
        match self {
            Self::Door => [door(Letter::D, 1..=7, &all), door(Letter::H, 1..=7, &all)].concat(),
            Self::Ideas => {
                let without = Part::NAMED.map(|(_, name)| format!("kehai-without-{name}"));
                let names: Vec<&str> =
                    std::iter::once("kehai").chain(without.iter().map(String::as_str)).collect();
                door(Letter::H, 5..=7, &own(&names))
            }
            Self::Thighs => door(Letter::T, 1..=5, &all),
            Self::Pairs => door(Letter::P, 2..=7, &all),
            _ => Vec::new(),
        }
    }
}

/// `trackers`, or if there are none the trackers with these names.
fn chosen(trackers: &[Choice], names: &[&str]) -> Vec<Choice> {
    if trackers.is_empty() {
        names.iter().filter_map(|name| name.parse().ok()).collect()
    } else {
        trackers.to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::super::poses::QUIET_SEEDS;
    use super::*;

    #[test]
    fn every_table_has_its_scenes_and_its_seeds() {
        for table in Table::EACH.into_iter().chain([
            Table::HomeHard,
            Table::Passages,
            Table::PaperA,
            Table::Poses,
            Table::FloorPoses,
            Table::Lines,
        ]) {
            let published = |seeds: &RangeInclusive<u64>| {
                assert!(*seeds.start() == 10_000 && *seeds.end() < 10_200 && !seeds.is_empty(), "{table}");
            };
            match table.work(&[], None) {
                Work::Door(cases, seeds) => {
                    published(&seeds);
                    assert!(!cases.is_empty());
                    cases.iter().for_each(|case| assert!(case.build().is_ok() && !case.trackers.is_empty()));
                }
                Work::Floor(seeds) | Work::FloorAndModules(seeds) | Work::FloorPoses(seeds) => {
                    published(&seeds)
                }
                // More seeds where nothing happens.
                Work::Poses(seeds) => {
                    let first = *seeds.start();
                    published(&(first..=first + QUIET_SEEDS * seeds.count() as u64 - 1));
                }
                Work::Entrance(seeds) | Work::Lines(seeds) => published(&seeds),
                Work::Trials(trials) => {
                    assert!(!trials.is_empty());
                    for trial in &trials {
                        published(&trial.seeds);
                        assert!(trial.build().is_ok() && !trial.trackers.is_empty(), "{}", trial.name);
                    }
                }
                Work::Passages(rows, seeds) => {
                    published(&seeds);
                    assert!(!rows.is_empty());
                }
            }
        }
        assert_eq!(Table::All.each(), Table::EACH);
    }

    #[test]
    fn clutter_is_watched_for_a_day_half_of_it_with_visitors() {
        let Work::Trials(trials) = Table::Clutter.work(&[], None) else { panic!("trials") };
        let seconds = |trial: &Trial| {
            trial.seeds.clone().count() as u64 * trial.build().unwrap().duration_s.round() as u64
        };
        assert_eq!(trials.iter().map(seconds).sum::<u64>(), 24 * 3600);
    }
}
