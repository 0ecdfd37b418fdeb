//! Cards that went in a short time ago: shown again so soon, they were passed back.

use super::terms::Card;

/// Cards that are remembered: more than pass a door in a minute.
const CARDS_MAX: usize = 64;

/// Cards and when they went in, s, oldest first.
#[derive(Clone, Debug, Default)]
pub struct Cards(Vec<(Card, f64)>);

impl Cards {
    /// It went in at `now_s`.
    pub fn went_in(&mut self, card: Card, now_s: f64) {
        self.0.retain(|(known, _)| *known != card);
        if self.0.len() >= CARDS_MAX {
            self.0.remove(0);
        }
        self.0.push((card, now_s));
    }

    /// A person with this card came out.
    pub fn came_out(&mut self, card: Card) {
        self.0.retain(|(known, _)| *known != card);
    }

    /// Whether it went in less than `within_s` ago.
    #[must_use]
    pub fn is_inside(&self, card: Card, now_s: f64, within_s: f64) -> bool {
        self.0.iter().any(|(known, at_s)| *known == card && now_s - at_s < within_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_card_is_inside_for_its_time_or_until_it_comes_out() {
        let mut cards = Cards::default();
        cards.went_in(Card(1), 0.0);
        assert!(cards.is_inside(Card(1), 59.0, 60.0) && !cards.is_inside(Card(1), 60.0, 60.0));
        cards.came_out(Card(1));
        assert!(!cards.is_inside(Card(1), 1.0, 60.0));
        (0..1000).for_each(|number| cards.went_in(Card(number), 0.0));
        assert!(cards.0.len() == CARDS_MAX && cards.is_inside(Card(999), 0.0, 60.0));
    }
}
