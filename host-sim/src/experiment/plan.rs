//! What an experiment runs: scenes with so many people, trackers, seeds.

use host_tracker::trackers::Choice;

use super::table::Cell;
use crate::world::scene::{Scene, SceneError};
use crate::world::variation::{Letter, Variation};

/// One scene with so many people, judged for each of some trackers.
#[derive(Clone, Debug)]
pub struct Case {
    /// What it is called in the table.
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
    /// Paper A's door area, conditions D and H, one to seven people, all trackers
    Door,
    /// Condition H with five to seven people, our tracker with each idea left out in turn
    Ideas,
    /// Thighs instead of torsos, one to five people
    Thighs,
    /// People who come in pairs
    Pairs,
}

impl Table {
    /// Its cases; `trackers` in the place of its own, if there are any.
    #[must_use]
    pub fn cases(self, trackers: &[Choice]) -> Vec<Case> {
        let own = |names: &[&str]| {
            let known: Vec<Choice> = names.iter().filter_map(|name| name.parse().ok()).collect();
            if trackers.is_empty() { known } else { trackers.to_vec() }
        };
        let all = own(&host_tracker::trackers::NAMES);
        let door = |condition: Letter, people: std::ops::RangeInclusive<usize>, trackers: &[Choice]| {
            people.map(|people| Case::door(condition, people, trackers)).collect::<Vec<_>>()
        };
        match self {
            Self::Door => [door(Letter::D, 1..=7, &all), door(Letter::H, 1..=7, &all)].concat(),
            Self::Ideas => {
                let without: Vec<String> = host_tracker::trackers::kehai::ideas::Idea::NAMED
                    .map(|(_, name)| format!("kehai-without-{name}"))
                    .to_vec();
                let names: Vec<&str> =
                    std::iter::once("kehai").chain(without.iter().map(String::as_str)).collect();
                door(Letter::H, 5..=7, &own(&names))
            }
            Self::Thighs => door(Letter::T, 1..=5, &all),
            Self::Pairs => door(Letter::P, 2..=7, &all),
        }
    }
}
