//! One scene in several variants: how many people, how they come and wait, how many sensors and where.
//!
//! | letter | condition |
//! |---|---|
//! | D | single file, waiting at least 0.62 m apart |
//! | H | densely before the door, milling about |
//! | P | in pairs, waiting as in D |
//! | T | as D, seen at the thighs |

use super::body::Section;
use super::gathering::{Condition, MOST_PEOPLE};
use super::scene::{Scene, SceneError};
use std::str::FromStr;

/// How people come and wait, by its letter.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash, PartialOrd, Ord)]
pub enum Letter {
    /// Spread.
    D,
    /// Dense.
    H,
    /// In pairs.
    P,
    /// Spread, thighs.
    T,
}

impl Letter {
    const fn meaning(self) -> (Condition, Section) {
        match self {
            Self::D => (Condition::Spread, Section::Torso),
            Self::H => (Condition::Dense, Section::Torso),
            Self::P => (Condition::Pairs, Section::Torso),
            Self::T => (Condition::Spread, Section::Thighs),
        }
    }
}

impl std::fmt::Display for Letter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{self:?}")
    }
}

impl FromStr for Letter {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "D" | "d" => Ok(Self::D),
            "H" | "h" => Ok(Self::H),
            "P" | "p" => Ok(Self::P),
            "T" | "t" => Ok(Self::T),
            _ => Err(String::from("a condition is D (spread), H (dense), P (pairs) or T (thighs)")),
        }
    }
}

/// Changes to a scene; a field that is None changes nothing.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Variation {
    /// Number of people of the door scenario.
    pub people: Option<usize>,
    /// How they come and wait.
    pub condition: Option<Letter>,
    /// Name of an arrangement of sensors.
    pub sensors: Option<String>,
    /// The section of every person in the sensor's plane.
    pub section: Option<Section>,
    /// Least duration of the scene.
    pub duration_s: Option<u32>,
}

impl Scene {
    /// Changes the scene.
    ///
    /// # Errors
    /// One line: the scene has no `[gathering]` or no such arrangement, or the number of people is impossible.
    pub fn vary(&mut self, variation: &Variation) -> Result<(), SceneError> {
        if variation.people.is_some() || variation.condition.is_some() {
            let gathering = self.gathering.as_mut().ok_or_else(|| {
                SceneError::new("the scene has no gathering: number of people and condition are fixed")
            })?;
            if let Some(people) = variation.people {
                if !(1..=MOST_PEOPLE).contains(&people) {
                    return Err(SceneError::new(&format!("people must be 1 to {MOST_PEOPLE}, is {people}")));
                }
                gathering.people = people;
            }
            if let Some(letter) = variation.condition {
                (gathering.condition, gathering.section) = letter.meaning();
            }
        }
        if let Some(duration_s) = variation.duration_s {
            self.duration_s = f64::from(duration_s.clamp(1, 86_400));
        }
        if let Some(section) = variation.section {
            self.gathering.iter_mut().for_each(|gathering| gathering.section = section);
            self.people.iter_mut().for_each(|person| person.section = section);
            self.recorded.iter_mut().for_each(|recorded| recorded.section = section);
        }
        if let Some(name) = &variation.sensors {
            let arrangement = self.arrangements.iter().find(|arrangement| arrangement.name == *name);
            let arrangement = arrangement.ok_or_else(|| {
                let names: Vec<&str> =
                    self.arrangements.iter().map(|arrangement| arrangement.name.as_str()).collect();
                let known = if names.is_empty() { String::from("none") } else { names.join(", ") };
                SceneError::new(&format!("no sensors \"{name}\" in this scene; there are: {known}"))
            })?;
            self.site.modules = arrangement.modules.clone();
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_condition_and_sensors_change_and_nothing_else() {
        let whole = Scene::load("door-area").unwrap();
        for sensors in ["1", "2", "3", "4", "corners"] {
            let mut scene = whole.clone();
            let variation = Variation {
                people: Some(7),
                condition: Some(Letter::T),
                sensors: Some(String::from(sensors)),
                ..Variation::default()
            };
            scene.vary(&variation).unwrap();
            let gathering = scene.gathering.unwrap();
            assert_eq!((gathering.people, gathering.section), (7, Section::Thighs));
            assert_eq!(scene.site.modules.len(), sensors.parse().unwrap_or(4), "{sensors}");
            assert_eq!(scene.site.walls, whole.site.walls);
        }
    }

    #[test]
    fn what_cannot_be_is_refused_by_name() {
        let mut scene = Scene::load("door-area").unwrap();
        let refused = |scene: &mut Scene, variation| scene.vary(&variation).unwrap_err().to_string();
        let none = Variation::default();
        let many = refused(&mut scene, Variation { people: Some(99), ..none.clone() });
        assert!(many.contains("people must be 1 to 16"), "{many}");
        let unknown = refused(&mut scene, Variation { sensors: Some(String::from("9")), ..none.clone() });
        assert!(unknown.contains("there are: 1, "), "{unknown}");
        let fixed = refused(&mut Scene::load("crossing").unwrap(), Variation { people: Some(2), ..none });
        assert!(fixed.contains("no gathering"), "{fixed}");
    }
}
