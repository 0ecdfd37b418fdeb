//! What the devices beside a guarded door say, by a scene's script: a card is shown, a number is entered, an alarm is reset.
//!
//! ```toml
//! [[told]]
//! at_s = 15
//! door = "front"
//! card = "04A201"        # or: number = 2, or: reset = true
//! ```
//!
//! Only a demonstration tells it to a tracker; in an experiment the door obeys people ([`crate::passage`]).

use serde::Deserialize;

/// A message to a door.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Told {
    /// When.
    pub at_s: f64,
    /// The door of the site.
    pub door: String,
    /// A card that is shown.
    pub card: Option<String>,
    /// A number of people that is entered.
    pub number: Option<u32>,
    /// The alarm was looked after.
    #[serde(default)]
    pub reset: bool,
}

/// What one message says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Says<'a> {
    /// A card is shown.
    Card(&'a str),
    /// So many people want to go in.
    Number(u32),
    /// The alarm was looked after.
    Reset,
}

impl Told {
    /// What it says; none if that is nothing, or more than one thing.
    #[must_use]
    pub fn says(&self) -> Option<Says<'_>> {
        match (self.card.as_deref(), self.number, self.reset) {
            (Some(card), None, false) => Some(Says::Card(card)),
            (None, Some(number), false) => Some(Says::Number(number)),
            (None, None, true) => Some(Says::Reset),
            _ => None,
        }
    }

    /// Checks the description.
    ///
    /// # Errors
    /// One sentence without its number.
    pub(super) fn check(&self) -> Result<(), &'static str> {
        if !(self.at_s >= 0.0 && self.at_s.is_finite()) {
            return Err("at_s must be 0 or more");
        }
        self.says().map(drop).ok_or("give it a card, a number, or reset = true: one of them")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::scene::Scene;

    fn check(text: &str) -> Result<(), &'static str> {
        toml::from_str::<Told>(&format!("at_s = 1\ndoor = \"front\"\n{text}")).unwrap().check()
    }

    #[test]
    fn a_message_says_one_thing() {
        assert_eq!(check("card = \"7\""), Ok(()));
        assert_eq!(check("number = 2"), Ok(()));
        assert_eq!(check("reset = true"), Ok(()));
        assert!(check("").unwrap_err().contains("one of them"));
        assert!(check("card = \"7\"\nnumber = 2").unwrap_err().contains("one of them"));
    }

    #[test]
    fn the_guarded_door_is_told_of_cards_in_the_order_of_time() {
        let scene = Scene::load("guarded").unwrap();
        assert!(scene.told.is_sorted_by(|before, after| before.at_s <= after.at_s));
        let cards = scene.told.iter().filter(|told| matches!(told.says(), Some(Says::Card(_)))).count();
        assert_eq!((cards, scene.site.doors.len()), (6, 1));
        assert!(scene.told.iter().all(|told| told.door == scene.site.doors[0].name));
    }
}
