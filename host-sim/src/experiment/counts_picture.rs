//! The reliability diagram: how often what was said is true, against what was said.
//!
//! ```text
//!   true 100 ┤            ╱      a panel for own worlds, one for cases; a line for each tracker and what is asked
//!            │         ╱ ●
//!            │      ╱ ●          on the diagonal: what is said is how often it is true
//!            │   ╱               below it: too sure
//!          0 ┼────────────  said
//! ```
//!
//! Bars are Wilson's intervals at 95 %. Colours follow the reader's preference for light or dark; marks differ in shape, too.

use std::fmt::Write;

use svg::Document;
use svg::node::element::{Group, Path, Text};

use super::counts::Judged;
use super::picture::{MARGIN, mark, sheet};

/// Side of a panel's square.
const SIDE: f64 = 420.0;
/// Space of the numbers at the left of a panel and under it.
const LEFT: f64 = 50.0;
const BOTTOM: f64 = 50.0;
/// Height of title and subtitle, of a row of the legend, of a panel's heading.
const TITLE: f64 = 66.0;
const LEGEND_ROW: f64 = 24.0;
const HEADING: f64 = 28.0;

/// Under the title.
const SUBTITLE: &str =
    "How often it is true that there are k people, against what was said of it; bars hold 95 %";

/// A panel for each pooled group.
#[must_use]
pub fn draw(judged: &[Judged], title: &str) -> Document {
    let pooled: Vec<&Judged> = judged.iter().filter(|one| one.is_pooled()).collect();
    let mut groups: Vec<&str> = Vec::new();
    let mut names: Vec<String> = Vec::new();
    for one in &pooled {
        if !groups.contains(&one.group.as_str()) {
            groups.push(&one.group);
        }
        if !names.contains(&name(one)) {
            names.push(name(one));
        }
    }
    let top = MARGIN + TITLE + LEGEND_ROW * names.len() as f64;
    let width = MARGIN + (LEFT + SIDE + MARGIN) * groups.len().max(1) as f64;
    let height = top + HEADING + SIDE + BOTTOM + MARGIN;
    let mut document = sheet((width, height), title, SUBTITLE);
    for (index, name) in names.iter().enumerate() {
        let y = MARGIN + TITLE + LEGEND_ROW * index as f64;
        let look = format!("look{}", index % 6);
        document = document
            .add(mark(index, &look, MARGIN + 8.0, y - 4.5))
            .add(Text::new(name).set("x", MARGIN + 24.0).set("y", y));
    }
    for (index, group) in groups.iter().enumerate() {
        let x = MARGIN + (LEFT + SIDE + MARGIN) * index as f64;
        let mut panel = axes(group);
        for one in pooled.iter().filter(|one| one.group == *group) {
            let index = names.iter().position(|own| *own == name(one)).unwrap_or(0);
            panel = panel.add(line(one, index));
        }
        document = document.add(panel.set("transform", format!("translate({x:.1} {top:.1})")));
    }
    document
}

fn name(judged: &Judged) -> String {
    format!("{}, {}", judged.tracker, judged.asked.name())
}

fn x(said: f64) -> f64 {
    LEFT + SIDE * said
}

fn y(share: f64) -> f64 {
    HEADING + SIDE * (1.0 - share)
}

fn axes(heading: &str) -> Group {
    let mut grid = String::new();
    let mut group = Group::new().add(Text::new(heading).set("class", "heading").set("x", LEFT).set("y", 16));
    for fifth in 0..=5 {
        let share = f64::from(fifth) / 5.0;
        let _ = write!(grid, "M{LEFT} {:.1}h{SIDE}M{:.1} {HEADING}v{SIDE}", y(share), x(share));
        let label = |anchor: &str| {
            Text::new(format!("{} %", fifth * 20)).set("class", "axis").set("text-anchor", anchor)
        };
        group = group
            .add(label("end").set("x", LEFT - 8.0).set("y", y(share) + 4.5))
            .add(label("middle").set("x", x(share)).set("y", y(0.0) + 19.0));
    }
    let diagonal = format!("M{:.1} {:.1}L{:.1} {:.1}", x(0.0), y(0.0), x(1.0), y(1.0));
    let under = Text::new("said").set("class", "axis").set("text-anchor", "middle");
    group
        .add(under.set("x", x(0.5)).set("y", y(0.0) + 38.0))
        .add(Path::new().set("class", "grid").set("d", grid))
        .add(Path::new().set("class", "base").set("d", diagonal))
}

/// The bins of one line, with their bars.
fn line(judged: &Judged, index: usize) -> Group {
    let look = format!("look{}", index % 6);
    let (mut path, mut bars) = (String::new(), String::new());
    let mut marks = Group::new();
    for (number, bin) in judged.found.bins.iter().enumerate() {
        let (x, interval) = (x(bin.said), bin.interval());
        let to = if number == 0 { 'M' } else { 'L' };
        let _ = write!(path, "{to}{x:.1} {:.1}", y(bin.share()));
        let _ = write!(bars, "M{x:.1} {:.1}V{:.1}", y(interval.low), y(interval.high));
        marks = marks.add(mark(index, &look, x, y(bin.share())));
    }
    let classed = |class: &str, d: String| Path::new().set("class", format!("{class} {look}")).set("d", d);
    Group::new().add(classed("bar", bars)).add(classed("line", path)).add(marks)
}

#[cfg(test)]
mod tests {
    use super::super::counts::Asked;
    use super::*;
    use crate::score::reliability::{Moment, Reliability};

    #[test]
    fn every_bin_has_a_mark_and_too_sure_is_below_the_diagonal() {
        let p: &[f64] = &[0.04, 0.96];
        let moments = (0..10).map(|run| Moment { run, p, people: run % 2 });
        let found = Reliability::of(moments, 1).unwrap();
        let one = Judged {
            group: "own worlds".into(),
            tracker: "a & b".into(),
            asked: Asked::Zone,
            runs: 10,
            found,
        };
        let text = draw(&[one], "counts").to_string();
        // Two bins, and one in the legend.
        assert_eq!(text.matches("class=\"mark look0\"").count(), 3);
        assert!(text.contains("a &amp; b, zone") && !text.contains("NaN"));
        assert!(y(0.5) > y(0.96) && x(0.96) > x(0.04));
    }

    #[test]
    fn a_picture_of_nothing_is_still_one() {
        assert!(draw(&[], "nothing").to_string().contains("viewBox"));
    }
}
