//! Trials: a scene that shows one thing, and the rule by which a run of it is judged.
//!
//! ```text
//!   Trial: scene, variation, trackers, seeds ─▶ run ─▶ Log ─▶ Rule ─▶ Finding: named figures
//!                                                                        │ pooled over the seeds
//!                                                                        ▼ a row of the table
//! ```
//!
//! The rules are in [`super::rules`], their results in [`super::findings`].

use std::ops::RangeInclusive;

use crate::baselines::Choice;
use kehai_tracking::geometry::Point;

use super::rules::Rule;
use crate::run::Conditions;
use crate::score::Region;
use crate::world::body::Section;
use crate::world::scene::{Scene, SceneError};
use crate::world::variation::{Letter, Variation};

/// The first seed of the published tables. They are development seeds: published, found short, worked on, and
/// published again.
const FIRST: u64 = 10_000;

/// Where identities and places are judged, m.
#[must_use]
pub fn judged() -> Region {
    Region::between(Point::new(-2.0, -2.6), Point::new(2.0, 1.0))
}

/// Where people are counted, m.
#[must_use]
pub fn counted() -> Region {
    Region::between(Point::new(-1.0, -1.0), Point::new(1.0, 1.0))
}

/// One line of a table for each of its trackers.
#[derive(Clone, Debug)]
pub struct Trial {
    /// Name in the table.
    pub name: &'static str,
    /// Its scene.
    pub scene: &'static str,
    /// Changes to the scene.
    pub variation: Variation,
    /// How a run is judged.
    pub rule: Rule,
    /// The network and the clocks; a rule that compares takes several.
    pub networks: Vec<Conditions>,
    /// Where identities and places are judged; the zone that counts without it.
    pub region: Option<Region>,
    /// The trackers.
    pub trackers: Vec<Choice>,
    /// The seeds.
    pub seeds: RangeInclusive<u64>,
}

impl Trial {
    fn new(name: &'static str, scene: &'static str, rule: Rule, trackers: &[Choice], runs: u64) -> Self {
        Self {
            name,
            scene,
            variation: Variation::default(),
            rule,
            networks: vec![Conditions::LAN],
            region: None,
            trackers: trackers.to_vec(),
            seeds: FIRST..=FIRST + runs - 1,
        }
    }

    /// The scene itself.
    ///
    /// # Errors
    /// No such scene, or it cannot be varied so.
    pub fn build(&self) -> Result<Scene, SceneError> {
        let mut scene = Scene::load(self.scene)?;
        scene.vary(&self.variation)?;
        Ok(scene)
    }
}

/// A person stands for an hour.
#[must_use]
pub fn standing(trackers: &[Choice]) -> Vec<Trial> {
    vec![Trial::new("standing for an hour", "standing", Rule::Steady { share: 0.99 }, trackers, 100)]
}

/// A chair is put down at one of twenty places, and its carrier leaves.
#[must_use]
pub fn chairs(trackers: &[Choice]) -> Vec<Trial> {
    let rule = Rule::Settles { within_s: 10.0 };
    vec![
        Trial::new("back of a chair", "chair-back", rule, trackers, 200),
        Trial::new("four legs of a chair", "chair-legs", rule, trackers, 200),
    ]
}

/// Two come in touching, one leaves; the zone is secure.
#[must_use]
pub fn touching(trackers: &[Choice]) -> Vec<Trial> {
    vec![Trial::new(
        "two enter touching, one leaves",
        "touching",
        Rule::Settles { within_s: 3.0 },
        trackers,
        200,
    )]
}

/// Of two one leaves.
#[must_use]
pub fn leaving(trackers: &[Choice]) -> Vec<Trial> {
    let rule = Rule::Settles { within_s: 3.0 };
    vec![
        Trial::new("of two one leaves", "one-of-two", rule, trackers, 200),
        Trial::new("two leave as one", "together", rule, trackers, 200),
    ]
}

/// Paper C's home.
#[must_use]
pub fn home(trackers: &[Choice]) -> Vec<Trial> {
    let home = |name, section| {
        let mut trial = Trial::new(name, "home", Rule::Followed { frames: 700 }, trackers, 10);
        trial.variation.section = Some(section);
        // Learning, coming in, and 700 frames of 0.1 s.
        trial.variation.duration_s = Some(90);
        trial
    };
    vec![home("torso", Section::Torso), home("thighs", Section::Thighs)]
}

/// Paper C's home with what its tracker failed on: bodies by height with arms over tables, things that are moved on them, and a
/// sliding door.
#[must_use]
pub fn home_hard(trackers: &[Choice]) -> Vec<Trial> {
    let home = |name, scene| {
        let mut trial = Trial::new(name, scene, Rule::Followed { frames: 700 }, trackers, 200);
        trial.variation.duration_s = Some(90);
        trial
    };
    vec![
        home("all of it", "home-hard"),
        home("bodies by height, arms over tables", "home-heights"),
        home("the same, a sliding door", "home-sliding"),
        home("the same, things moved on tables of the site", "home-things"),
        home("… on tables that the site does not have", "home-undeclared"),
    ]
}

/// What moves or shines and is no person: 11.3 hours with visitors now and then, 12.7 hours of an empty area.
#[must_use]
pub fn clutter(trackers: &[Choice]) -> Vec<Trial> {
    vec![
        // 48 and 76 runs of ten minutes, 200 of one.
        Trial::new("door leaf, curtain, fan, with visitors", "movers", Rule::Undisturbed, trackers, 48),
        Trial::new("facing sensors, cross-talk, empty area", "facing", Rule::Undisturbed, trackers, 76),
        Trial::new("mirror, with visitors", "mirror", Rule::Undisturbed, trackers, 200),
    ]
}

/// What people carry, push, sit in and do.
#[must_use]
pub fn carried(trackers: &[Choice]) -> Vec<Trial> {
    let names = ["suitcase", "pushchair", "wheelchair", "backpack", "crouching", "embracing", "child"];
    names.map(|name| Trial::new(name, name, Rule::Counted, trackers, 200)).into()
}

/// Five people in condition H, over an ordinary network and over a bad one.
#[must_use]
pub fn disturbed(trackers: &[Choice]) -> Vec<Trial> {
    let mut trial = Trial::new("door area, H, 5 people", "door-area", Rule::Falls, trackers, 100);
    trial.variation = Variation { people: Some(5), condition: Some(Letter::H), ..Variation::default() };
    trial.networks = vec![Conditions::LAN, Conditions::DISTURBED];
    trial.region = Some(judged());
    vec![trial]
}
