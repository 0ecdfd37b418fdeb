//! Cards that went in a short time ago: shown again so soon, they were passed back.

use super::terms::Card;

/// Cards that are remembered at most, 128 KiB: one went in each 21 s all day, the longest that `passback_s` may be.
const CARDS_MAX: usize = 4096;

/// Cards and when they went in, s, oldest first.
#[derive(Clone, Debug, Default)]
pub struct Cards(Vec<(Card, f64)>);

impl Cards {
    /// It went in at `now_s`. Those that did more than `within_s` ago are asked after no more.
    pub fn went_in(&mut self, card: Card, now_s: f64, within_s: f64) {
        self.0.retain(|(known, at_s)| *known != card && now_s - at_s < within_s);
        if self.0.len() >= CARDS_MAX {
            self.0.remove(0);
        }
        self.0.push((card, now_s));
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
    fn a_card_is_inside_for_its_time() {
        let mut cards = Cards::default();
        cards.went_in(Card(1), 0.0, 60.0);
        assert!(cards.is_inside(Card(1), 59.0, 60.0) && !cards.is_inside(Card(1), 60.0, 60.0));
    }

    #[test]
    fn a_card_is_remembered_for_its_time_however_many_go_in_after_it() {
        let (mut cards, shift_s) = (Cards::default(), 28_800.0);
        (1..=65).for_each(|number| cards.went_in(Card(number), 0.0, shift_s));
        assert!(cards.is_inside(Card(1), 10.0, shift_s));
        cards.went_in(Card(66), shift_s, shift_s);
        assert_eq!(cards.0.len(), 1, "those of before are not asked after");
        (0..5000).for_each(|number| cards.went_in(Card(number), shift_s, shift_s));
        assert!(cards.0.len() == CARDS_MAX && cards.is_inside(Card(4999), shift_s, shift_s));
    }
}
