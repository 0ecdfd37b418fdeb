//! Count success against the number of people, one line a tracker, paper A's Table 1 beside it.
//!
//! ```text
//!   title                                        one panel for each scene and its sensors
//!   ●── kehai  ■── lee  ○┄┄ paper A
//!   100 ┤ ●──●──●──●──●                          bars: Wilson's interval at 95 %
//!       │          ■╲   ╲┄○                      the trackers stand a little beside each other,
//!     0 ┤             ■───■                      so that equal ones can be told apart
//!         1  2  3  4  5  6  people
//! ```
//!
//! Colours follow the reader's preference for light or dark; the marks differ in shape as well.

use std::fmt::Write;

use svg::Document;
use svg::node::element::{Group, Path, Rectangle, Style, Text};

use super::paper::{PAPER_A_SUCCESSES, PAPER_A_TRIALS};
use super::table::{Row, by_scene, trackers};
use crate::score::statistics::{Interval, wilson};

/// Width of a panel with its axes.
const PANEL_WIDTH: f64 = 560.0;
/// Height of a panel with its axes and heading.
const PANEL_HEIGHT: f64 = 350.0;
/// Space around everything, and between panels.
pub(super) const MARGIN: f64 = 28.0;
/// Height of title and subtitle.
const TITLE_HEIGHT: f64 = 66.0;
/// Height of a row of the legend.
const LEGEND_ROW: f64 = 26.0;
/// Space of a panel's heading.
const HEADING: f64 = 34.0;
/// Space for the shares at the left of a panel.
const LEFT: f64 = 46.0;
/// Space for the numbers under a panel.
const BOTTOM: f64 = 46.0;
/// Half a mark, and half the foot of a bar.
const MARK: f64 = 4.5;
/// How far neighbours that stand beside each other are apart, at most.
const BESIDE: f64 = 10.0;
/// Name of the paper's line.
const PAPER_A_LEGEND: &str = "paper A, Table 1 (10 trials each)";
/// Number of line styles.
const LOOKS: usize = 6;

/// Light first, dark where it is preferred. The six colours are told apart by colour-blind eyes as well.
const STYLE: &str = "
text { font-family: 'DejaVu Sans', Helvetica, Arial, sans-serif; font-size: 13px; fill: #1d2430; }
.sheet { fill: #fcfcfa; }
.title { font-size: 21px; font-weight: 600; }
.small { font-size: 13.5px; fill: #4a5568; }
.heading { font-size: 15px; font-weight: 600; }
.axis { font-size: 12.5px; fill: #5b6676; }
.grid { stroke: #e1e4e9; stroke-width: 1; fill: none; }
.base { stroke: #8a94a3; stroke-width: 1; fill: none; }
.line { fill: none; stroke-width: 2.4; stroke-linejoin: round; }
.bar { fill: none; stroke-width: 1.3; opacity: .75; }
.mark { stroke-width: 2; }
.look0 { stroke: #0067a5; } .look0.mark { fill: #0067a5; }
.look1 { stroke: #c44e00; } .look1.mark { fill: #c44e00; }
.look2 { stroke: #00805c; } .look2.mark { fill: #00805c; }
.look3 { stroke: #a8518a; } .look3.mark { fill: #a8518a; }
.look4 { stroke: #8a6d00; } .look4.mark { fill: #8a6d00; }
.look5 { stroke: #3a93c4; } .look5.mark { fill: #3a93c4; }
.paper { stroke: #6b7583; } .paper.line { stroke-width: 1.8; stroke-dasharray: 6 5; } .paper.mark { fill: #fcfcfa; }
";

/// Changes for the dark colour scheme.
const DARK: &str = "
text { fill: #e8ebf0; }
.sheet { fill: #14181f; }
.small { fill: #b3bcc9; }
.axis { fill: #a3adba; }
.grid { stroke: #2a313c; }
.base { stroke: #6b7583; }
.look0 { stroke: #5cb3f0; } .look0.mark { fill: #5cb3f0; }
.look1 { stroke: #ff9252; } .look1.mark { fill: #ff9252; }
.look2 { stroke: #3fcf9f; } .look2.mark { fill: #3fcf9f; }
.look3 { stroke: #e394c8; } .look3.mark { fill: #e394c8; }
.look4 { stroke: #e0c04a; } .look4.mark { fill: #e0c04a; }
.look5 { stroke: #a5dcf7; } .look5.mark { fill: #a5dcf7; }
.paper { stroke: #9aa5b3; } .paper.mark { fill: #14181f; }
";

/// A line of a panel.
struct Series {
    /// Class of its colour.
    look: String,
    /// Shape of its marks.
    shape: usize,
    /// People, share counted right, its interval.
    points: Vec<(u32, f64, Interval)>,
}

/// The picture of these rows, a panel for each scene.
#[must_use]
pub fn draw(rows: &[Row], title: &str) -> Document {
    let panels = by_scene(rows);
    let names = trackers(&rows.iter().collect::<Vec<_>>());
    let across = if panels.len() > 1 { 2 } else { 1 };
    let width = 2.0 * MARGIN + PANEL_WIDTH * across as f64 + MARGIN * (across - 1) as f64;
    let (legend, legend_height) = legend(&names, width - 2.0 * MARGIN);
    let top = MARGIN + TITLE_HEIGHT + legend_height;
    let height = top + PANEL_HEIGHT * panels.len().div_ceil(across) as f64 + MARGIN;
    let mut document = sheet((width, height), title, &subtitle(rows))
        .add(legend.set("transform", translate(MARGIN, MARGIN + TITLE_HEIGHT)));
    for (index, panel) in panels.iter().enumerate() {
        let x = MARGIN + (PANEL_WIDTH + MARGIN) * (index % across) as f64;
        let y = top + PANEL_HEIGHT * (index / across) as f64;
        document = document.add(self::panel(panel, &names).set("transform", translate(x, y)));
    }
    document
}

/// An empty sheet of this width and height, with its title and a line under it.
pub(super) fn sheet((width, height): (f64, f64), title: &str, subtitle: &str) -> Document {
    Document::new()
        .set("viewBox", (0, 0, width, height))
        .set("width", width)
        .set("height", height)
        .add(Style::new(format!("{STYLE}@media (prefers-color-scheme: dark) {{{DARK}}}")))
        .add(Rectangle::new().set("width", "100%").set("height", "100%").set("class", "sheet"))
        .add(Text::new(title).set("class", "title").set("x", MARGIN).set("y", MARGIN + 18.0))
        .add(Text::new(subtitle).set("class", "small").set("x", MARGIN).set("y", MARGIN + 42.0))
}

fn subtitle(rows: &[Row]) -> String {
    let least = rows.iter().map(|row| row.runs).min().unwrap_or(0);
    let most = rows.iter().map(|row| row.runs).max().unwrap_or(0);
    let runs = if least == most { format!("{most}") } else { format!("{least} to {most}") };
    format!("Runs in which the people are counted right, {runs} each; bars hold 95 % (Wilson)")
}

/// The legend, in as many rows as it needs.
fn legend(names: &[&str], width: f64) -> (Group, f64) {
    let (mut x, mut row) = (0.0, 0);
    let mut group = Group::new();
    let own = names.iter().enumerate().map(|(index, name)| (look(index), index, *name));
    for (look, shape, name) in own.chain([("paper".to_owned(), 0, PAPER_A_LEGEND)]) {
        let wide = 50.0 + 8.2 * name.chars().count() as f64;
        if x + wide > width && x > 0.0 {
            (x, row) = (0.0, row + 1);
        }
        let y = LEGEND_ROW * f64::from(row);
        let line = format!("M{x:.1} {:.1}h28", y - 4.5);
        group = group
            .add(Path::new().set("class", format!("line {look}")).set("d", line))
            .add(mark(shape, &look, x + 14.0, y - 4.5))
            .add(Text::new(name).set("x", x + 35.0).set("y", y));
        x += wide;
    }
    (group, LEGEND_ROW * f64::from(row + 1))
}

fn look(index: usize) -> String {
    format!("look{}", index % LOOKS)
}

/// One scene.
fn panel(rows: &[&Row], names: &[&str]) -> Group {
    let mut series: Vec<Series> = vec![paper()];
    for (index, name) in names.iter().enumerate() {
        let mut points: Vec<_> = rows
            .iter()
            .filter(|row| row.tracker == *name)
            .map(|row| (row.people, row.success(), Interval { low: row.success_low, high: row.success_high }))
            .collect();
        points.sort_by_key(|point| point.0);
        if !points.is_empty() {
            series.push(Series { look: look(index), shape: index, points });
        }
    }
    let people = || series.iter().flat_map(|series| series.points.iter().map(|point| point.0));
    let (least, most) = (people().min().unwrap_or(1), people().max().unwrap_or(1));
    let step = (PANEL_WIDTH - LEFT) / f64::from(most - least + 1);
    let beside = BESIDE.min(0.7 * step / series.len() as f64);
    let x = |people: u32| LEFT + step * (f64::from(people - least) + 0.5);
    let y = |share: f64| HEADING + (PANEL_HEIGHT - HEADING - BOTTOM) * (1.0 - share);

    let heading = rows.first().map(|row| row.heading()).unwrap_or_default();
    let mut group = Group::new()
        .add(Text::new(heading).set("class", "heading").set("x", LEFT).set("y", 16))
        .add(axes(least..=most, &x, &y));
    // Ours on top: the first tracker is drawn last.
    let middle = (series.len() - 1) as f64 / 2.0;
    let order = std::iter::once(0).chain((1..series.len()).rev());
    for index in order {
        let Some(series) = series.get(index) else { continue };
        // Side by side as in the legend: the paper at the right.
        let place = if index == 0 { middle } else { index as f64 - 1.0 - middle };
        group = group.add(line(series, &|people| x(people) + place * beside, &y));
    }
    group
}

/// Paper A as one of them.
fn paper() -> Series {
    let points = PAPER_A_SUCCESSES.iter().zip(1..).map(|(&right, people)| {
        (people, right as f64 / PAPER_A_TRIALS as f64, wilson(right, PAPER_A_TRIALS))
    });
    Series { look: "paper".into(), shape: 0, points: points.collect() }
}

fn axes(people: std::ops::RangeInclusive<u32>, x: &dyn Fn(u32) -> f64, y: &dyn Fn(f64) -> f64) -> Group {
    let mut grid = String::new();
    let mut group = Group::new();
    for fifth in 0..=5 {
        let share = f64::from(fifth) / 5.0;
        if fifth > 0 {
            let _ = write!(grid, "M{LEFT} {:.1}H{PANEL_WIDTH}", y(share));
        }
        let unit = if fifth == 5 { " %" } else { "" };
        group = group.add(
            Text::new(format!("{}{unit}", fifth * 20))
                .set("class", "axis")
                .set("text-anchor", "end")
                .set("x", LEFT - 8.0)
                .set("y", round(y(share) + 4.5)),
        );
    }
    let under = |text: String, x: f64, below: f64| {
        Text::new(text)
            .set("class", "axis")
            .set("text-anchor", "middle")
            .set("x", round(x))
            .set("y", round(y(0.0) + below))
    };
    let (first, last) = (*people.start(), *people.end());
    for number in people {
        group = group.add(under(number.to_string(), x(number), 19.0));
    }
    let base = format!("M{LEFT} {:.1}H{PANEL_WIDTH}", y(0.0));
    group
        .add(under("people".into(), (x(first) + x(last)) / 2.0, 37.0))
        .add(Path::new().set("class", "grid").set("d", grid))
        .add(Path::new().set("class", "base").set("d", base))
}

/// A line with its bars and marks.
fn line(series: &Series, x: &dyn Fn(u32) -> f64, y: &dyn Fn(f64) -> f64) -> Group {
    let (mut path, mut bars) = (String::new(), String::new());
    let mut marks = Group::new();
    for (index, &(people, share, interval)) in series.points.iter().enumerate() {
        let (x, to) = (x(people), if index == 0 { 'M' } else { 'L' });
        let _ = write!(path, "{to}{x:.1} {:.1}", y(share));
        for end in [interval.low, interval.high] {
            let _ = write!(bars, "M{:.1} {:.1}h6", x - 3.0, y(end));
        }
        let _ = write!(bars, "M{x:.1} {:.1}V{:.1}", y(interval.low), y(interval.high));
        marks = marks.add(mark(series.shape, &series.look, x, y(share)));
    }
    let classed = |class: &str, path: String| {
        Path::new().set("class", format!("{class} {}", series.look)).set("d", path)
    };
    Group::new().add(classed("bar", bars)).add(classed("line", path)).add(marks)
}

/// A mark around a point: circle, square, triangle, diamond, triangle upside down, cross.
pub(super) fn mark(shape: usize, look: &str, x: f64, y: f64) -> Path {
    let (m, d) = (MARK, 2.0 * MARK);
    let (start_x, outline) = match shape % LOOKS {
        0 => (x - m, format!("a{m} {m} 0 1 0 {d} 0a{m} {m} 0 1 0 -{d} 0z")),
        1 => (x - m, format!("m0 -{m}h{d}v{d}h-{d}z")),
        2 => (x, format!("m0 -{m}l{m} {d}h-{d}z")),
        3 => (x, format!("m0 -{t}l{t} {t}l-{t} {t}l-{t} -{t}z", t = m * 1.3)),
        4 => (x, format!("m0 {m}l{m} -{d}h-{d}z")),
        _ => (x, format!("m-{m} -{m}l{d} {d}m0 -{d}l-{d} {d}")),
    };
    Path::new().set("class", format!("mark {look}")).set("d", format!("M{start_x:.1} {y:.1}{outline}"))
}

fn translate(x: f64, y: f64) -> String {
    format!("translate({x:.1} {y:.1})")
}

/// One decimal is finer than a screen shows.
fn round(value: f64) -> f64 {
    (value * 10.0).round() / 10.0
}

#[cfg(test)]
mod tests {
    use super::super::table::tests::row;
    use super::*;

    /// Two scenes with three trackers, as it might come out.
    fn rows() -> Vec<Row> {
        let mut rows = Vec::new();
        for (scene, kehai, lee) in [
            (
                "door area D",
                [200, 200, 199, 198, 197, 193, 186, 170, 150, 120],
                [200, 196, 198, 190, 176, 140, 74, 40, 22, 8],
            ),
            (
                "door area H",
                [200, 200, 198, 196, 195, 192, 182, 160, 131, 90],
                [200, 200, 196, 184, 130, 50, 44, 18, 6, 2],
            ),
        ] {
            for (people, (&kehai, &lee)) in (1..).zip(kehai.iter().zip(&lee)) {
                rows.push(row(scene, people, "kehai", kehai));
                rows.push(row(scene, people, "lee, r_c 19 cm", lee));
                rows.push(row(scene, people, "particle <C>", lee / 2));
            }
        }
        rows
    }

    #[test]
    fn every_point_has_a_mark_and_the_paper_stands_in_every_panel() {
        let text = draw(&rows(), "a & b").to_string();
        let number = |class: &str| text.matches(&format!("class=\"{class}\"")).count();
        // One in the legend each.
        assert_eq!(number("mark look0"), 2 * 10 + 1);
        assert_eq!(number("mark look2"), 2 * 10 + 1);
        assert_eq!(number("mark paper"), 2 * 7 + 1);
        assert_eq!(number("heading"), 2);
        assert!(text.contains("a &amp; b") && text.contains("particle &lt;C&gt;"), "not escaped");
        assert!(text.contains("prefers-color-scheme: dark"));
    }

    #[test]
    fn more_right_is_higher_up() {
        let ends = |successes| {
            let text = draw(&[row("hall", 1, "kehai", successes)], "").to_string();
            let mark = text.rsplit("class=\"mark look0\" d=\"M").next().unwrap().to_owned();
            mark.split([' ', 'a']).nth(1).unwrap().parse::<f64>().unwrap()
        };
        assert!(ends(200) < ends(100) && ends(100) < ends(0), "{} {} {}", ends(200), ends(100), ends(0));
    }

    #[test]
    fn a_picture_of_nothing_is_still_one() {
        let text = draw(&[], "nothing").to_string();
        assert!(text.contains("viewBox") && !text.contains("NaN") && !text.contains("inf"));
    }
}
