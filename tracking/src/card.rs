//! An identity as it may be kept: what a secret key of the site makes of a card's number or of a tag's.
//!
//! ```text
//!   "04:A2:2B:…" ─▶ keyed hash, by the daemon ─▶ Card(16 bytes) ─▶ label: its first four digits
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A card or a tag, as a hash that only this site can make: the number on it is never kept.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(into = "String", try_from = "String")]
pub struct Card(pub u128);

impl Card {
    /// Its first four digits: enough to tell the cards of a room apart, too few to find one by.
    #[must_use]
    pub fn label(self) -> String {
        String::from(self).chars().take(4).collect()
    }
}

impl From<Card> for String {
    fn from(card: Card) -> Self {
        format!("{:032x}", card.0)
    }
}

impl TryFrom<String> for Card {
    type Error = std::num::ParseIntError;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        u128::from_str_radix(&text, 16).map(Self)
    }
}
