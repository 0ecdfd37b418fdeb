//! The strip under the map: how many candidates there were at once, over time.

use std::fmt::Write;

use svg::node::element::{Group, Path, Rectangle, Text};

use super::{Picture, palette};

/// Space for the numbers at the left.
const LEFT: f64 = 30.0;
/// Space for the colours and times at the bottom.
const BOTTOM: f64 = 34.0;

/// Draws the strip with its upper left corner at the origin.
pub fn draw(picture: &Picture, width: f64, height: f64) -> Group {
    let (start_s, end_s) = picture.span_s();
    let (plot_width, plot_height) = (width - LEFT, height - BOTTOM - 18.0);
    let counts = |narrow: bool| {
        picture.scans.iter().map(move |s| (s.t_s, s.candidates.iter().filter(|c| c.narrow == narrow).count()))
    };
    let most = counts(true).zip(counts(false)).map(|((_, a), (_, b))| a + b).max().unwrap_or(0).max(2);
    let x = |t_s: f64| LEFT + (t_s - start_s) / (end_s - start_s) * plot_width;
    let y = |count: usize| 18.0 + plot_height * (1.0 - count as f64 / most as f64);
    let bar = plot_width / picture.scans.len().max(1) as f64;

    let mut grid = String::new();
    let mut group = Group::new().add(
        Text::new("candidates at once (dark: wide, light: narrow on top)")
            .set("class", "axis")
            .set("x", LEFT)
            .set("y", 10),
    );
    // At most six lines, at whole numbers.
    for count in (0..=most).step_by(most.div_ceil(6)) {
        let _ = write!(grid, "M{LEFT} {:.1}H{width}", y(count));
        group =
            group.add(Text::new(count.to_string()).set("class", "axis").set("x", 8).set("y", y(count) + 4.0));
    }
    let mut wide = String::new();
    let mut narrow = String::new();
    for ((t_s, few), (_, many)) in counts(true).zip(counts(false)) {
        let left = x(t_s) - bar / 2.0;
        let _ = write!(wide, "M{left:.1} {:.1}h{bar:.2}V{:.1}h-{bar:.2}z", y(0), y(many));
        if few > 0 {
            let _ = write!(narrow, "M{left:.1} {:.1}h{bar:.2}V{:.1}h-{bar:.2}z", y(many), y(many + few));
        }
    }
    group = group
        .add(Path::new().set("class", "grid").set("d", grid))
        .add(Path::new().set("fill", "#35608f").set("d", wide))
        .add(Path::new().set("fill", "#b7c9dc").set("d", narrow));
    for part in 0..60 {
        let share = f64::from(part) / 60.0;
        let patch =
            Rectangle::new().set("x", LEFT + share * plot_width).set("width", plot_width / 60.0 + 0.5);
        group =
            group.add(patch.set("y", height - BOTTOM + 4.0).set("height", 6).set("fill", palette::at(share)));
    }
    for part in 0..=5 {
        let t_s = start_s + (end_s - start_s) * f64::from(part) / 5.0;
        let label = Text::new(format!("{t_s:.1} s"))
            .set("class", "axis")
            .set("text-anchor", if part == 5 { "end" } else { "middle" });
        group = group.add(label.set("x", x(t_s)).set("y", height - BOTTOM + 26.0));
    }
    group
}
