//! An identity as it may be kept: what a secret key of the site makes of a card's number or of a tag's.
//!
//! ```text
//!   "04:A2:2B:…" ─▶ keyed hash, by the daemon ─▶ Card(16 bytes) ─▶ label: its first eight digits
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A card or a tag, as a hash that only this site can make: the number on it is never kept.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(into = "String", try_from = "String")]
pub struct Card(pub u128);

impl Card {
    /// Its first eight digits: enough to tell the cards of a site apart, too few to find one by. Of 256 cards two have the same label
    /// in one case of 130 000; with four digits that was so in two cases of five.
    #[must_use]
    pub fn label(self) -> String {
        String::from(self).chars().take(8).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cards_that_differ_in_their_eighth_digit_have_two_labels() {
        let label = |digits: u128| Card(digits << 96).label();
        assert_eq!(label(0xa11c_e001), "a11ce001");
        assert_ne!(label(0xa11c_e001), label(0xa11c_e002));
        assert_eq!(Card(7).label(), "00000000", "its first digits, also where they are 0");
    }
}
