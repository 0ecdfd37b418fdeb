//! The figures of the halls, for people: a column for each way in which they were followed.

use std::fmt::Write;

use super::judge::Crossings;
use super::simulated::{Outcome, Side};

/// A heading, and what was found under it.
pub type Column = (String, Outcome);

/// The table: one tracker, and the areas under each of these conditions.
#[must_use]
pub fn markdown(columns: &[Column]) -> String {
    let mut text = String::from("| |");
    let Some((_, first)) = columns.first() else { return text };
    let mut sides: Vec<(&str, &Side)> = vec![("one tracker", &first.one)];
    sides.extend(columns.iter().map(|(heading, outcome)| (heading.as_str(), &outcome.four)));
    for (heading, _) in &sides {
        let _ = write!(text, " {heading} |");
    }
    text += "\n|---|";
    text += &"--:|".repeat(sides.len());
    text += "\n";
    let mut row = |name: &str, of: &dyn Fn(&Side) -> String| {
        let _ = write!(text, "| {name} |");
        for (_, side) in &sides {
            let _ = write!(text, " {} |", of(side));
        }
        text += "\n";
    };
    let crossed = |of: fn(&Crossings) -> u64| move |side: &Side| of(&side.crossings).to_string();
    row("IDF1", &|side| share(side.tally.figures().idf1));
    row("crossings with a number before and after", &crossed(|crossings| crossings.all));
    row("of these another number after", &crossed(|crossings| crossings.renumbered));
    row("of these by the border alone", &crossed(|crossings| crossings.at_border));
    row("crossings with a name before", &crossed(|crossings| crossings.named));
    row("of these without it after", &crossed(|crossings| crossings.unnamed));
    row("of these with it by the other way", &crossed(|crossings| crossings.unnamed_alone));
    let totals = |name: &str, first: String, of: &dyn Fn(&Outcome) -> String| {
        let mut line = format!("| {name} | {first} |");
        for (_, outcome) in columns {
            let _ = write!(line, " {} |", of(outcome));
        }
        line + "\n"
    };
    let percent = |part: u64, whole: u64| format!("{:.2} %", 100.0 * part as f64 / whole.max(1) as f64);
    let right = percent(first.totals.right[0], first.totals.frames);
    text += &totals("total as many as there are", right, &|outcome| {
        percent(outcome.totals.right[1], outcome.totals.frames)
    });
    text += &totals("total another than that of one tracker", "–".into(), &|outcome| {
        percent(outcome.totals.different, outcome.totals.frames)
    });
    text += &totals("for at most, and by at most", "–".into(), &|outcome| {
        format!("{:.1} s, {}", outcome.totals.longest_s(), outcome.totals.most)
    });
    text += &totals("total wrong while that of one tracker is right", "–".into(), &|outcome| {
        percent(outcome.totals.worse, outcome.totals.frames)
    });
    text +=
        &totals("for at most", "–".into(), &|outcome| format!("{:.1} s", outcome.totals.longest_worse_s()));
    text += &totals("frames of areas lost", "–".into(), &|outcome| outcome.lost.to_string());
    text
}

fn share(value: Option<f64>) -> String {
    value.map_or_else(|| "–".into(), |value| format!("{value:.4}"))
}
