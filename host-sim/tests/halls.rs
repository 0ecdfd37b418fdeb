//! Four halls, by one tracker and by a tracker of each: people keep their numbers and names over the borders, and the totals agree.

use host_sim::halls::simulated::{Outcome, play};
use host_sim::halls::world::{Borders, Halls};
use kehai_tracking::tracker::Selected;

fn halls(borders: Borders) -> Halls {
    Halls { borders, people: 6, seconds: 60.0, seed: 2, silent: None, tracker: Selected::default() }
}

/// A minute, judged when all frames arrive and when three of ten are lost.
fn outcomes(halls: &Halls) -> [Outcome; 2] {
    let followed = play(halls).unwrap();
    [0.0, 0.3].map(|lost| followed.together(lost))
}

/// As good as one tracker, but for this much of the IDF1; as many numbers may change by the border alone.
fn judge(borders: Borders) {
    for (outcome, idf1_less) in outcomes(&halls(borders)).iter().zip([0.005, 0.01]) {
        let (one, four, totals) = (&outcome.one, &outcome.four, outcome.totals);
        println!("{borders:?}: {:?}, {:?}, {totals:?}", one.crossings, four.crossings);
        assert!(four.crossings.all >= 20, "{borders:?}: {:?}", four.crossings);
        assert_eq!(four.crossings.at_border, 0, "{borders:?}: {:?}", four.renumbered);
        let idf1 = [one, four].map(|side| side.tally.figures().idf1.unwrap());
        println!("{borders:?}: IDF1 {idf1:?}");
        assert!(idf1[1] >= idf1[0] - idf1_less, "{borders:?}: {idf1:?}");
        // A name is known before as many crossings as by one tracker, but for a few, and lost at no more.
        let named = [one, four].map(|side| side.crossings.named);
        let unnamed = [one, four].map(|side| side.crossings.unnamed);
        assert!(
            named[1] + 3 >= named[0] && unnamed[1] <= unnamed[0] + 2,
            "{borders:?}: {named:?} {unnamed:?}"
        );
        assert!(totals.worse * 100 <= totals.frames, "{borders:?}: {totals:?}");
        assert!(totals.longest_worse_s() <= 0.35, "{borders:?}: {totals:?}");
    }
}

#[test]
fn through_doorways_people_stay_who_they_are_and_are_counted_once() {
    judge(Borders::Doorways);
}

#[test]
fn over_open_borders_people_stay_who_they_are_and_are_counted_once() {
    judge(Borders::Open);
}

#[test]
fn a_module_at_a_border_that_falls_silent_harms_four_trackers_as_little_as_one() {
    for borders in [Borders::Doorways, Borders::Open] {
        let whole = Halls { people: 12, ..halls(borders) };
        let silent = whole.module("south border");
        for outcome in outcomes(&Halls { silent, ..whole }) {
            let idf1 = [&outcome.one, &outcome.four].map(|side| side.tally.figures().idf1.unwrap());
            println!("{borders:?}: IDF1 {idf1:?}, {:?}, {:?}", outcome.four.crossings, outcome.totals);
            assert!(idf1[1] >= idf1[0] - 0.01, "{borders:?}: {idf1:?}");
            assert_eq!(outcome.four.crossings.at_border, 0, "{borders:?}: {:?}", outcome.four.renumbered);
            assert!(outcome.totals.longest_worse_s() <= 0.35, "{borders:?}: {:?}", outcome.totals);
        }
    }
}

/// Three people meet on the border: `kehai-rules` gives two of them each other's numbers, by one tracker and by four.
#[test]
fn people_who_meet_on_an_open_border_keep_their_numbers() {
    let met = Halls { people: 12, seconds: 45.0, seed: 41, ..halls(Borders::Open) };
    for outcome in outcomes(&met) {
        for side in [&outcome.one, &outcome.four] {
            println!("{:?}", side.crossings);
            assert!(side.crossings.all >= 20 && side.crossings.renumbered == 0, "{:?}", side.renumbered);
            assert!(side.tally.figures().idf1.unwrap() > 0.98);
        }
    }
}
