//! A site from above with what its modules see of it while people stand about.
//!
//! ```text
//!   ▓▓▒▒░░  cell by cell: seen from two sides, from one, seldom; a cross where no module sees even an empty room
//!   ▓▓▒▒░x  walls, entries, modules with their numbers over it
//! ```

use std::io;
use std::path::Path;

use kehai_tracking::geometry::Point;
use kehai_tracking::site::Site;
use svg::Document;
use svg::node::element::{Circle, Group, Path as Line, Rectangle, Text};

use super::site::{Frame, stroke};
use super::{LEGEND_HEIGHT, MARGIN, TITLE_HEIGHT, WIDTH, page, palette, translate};

/// A cell of the site.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CellShown {
    /// Its middle.
    pub at: Point,
    /// How often a person there is seen by at least one module, and from at least two sides, 0 to 1.
    pub seen: [f64; 2],
    /// No module sees it, not even in the empty room.
    pub is_blind: bool,
}

/// The content of the picture.
#[derive(Clone, Debug)]
pub struct CoveragePicture<'a> {
    /// First line.
    pub title: String,
    /// Second line.
    pub subtitle: String,
    /// Walls, zones, entries, modules.
    pub site: &'a Site,
    /// Side of a cell, m.
    pub cell_m: f64,
    /// All cells.
    pub cells: &'a [CellShown],
}

/// Colours: seen by none, from one side, from two; between them in proportion.
const COLOURS: [[f64; 3]; 3] = [[234.0, 214.0, 214.0], [190.0, 214.0, 234.0], [70.0, 130.0, 180.0]];

/// A module's direction is drawn so long.
const NOSE: f64 = 14.0;

impl CoveragePicture<'_> {
    /// Writes the picture to a file.
    ///
    /// # Errors
    /// What the file system says.
    pub fn save(&self, path: &Path) -> io::Result<()> {
        svg::save(path, &self.to_svg())
    }

    /// The picture as SVG.
    #[must_use]
    pub fn to_svg(&self) -> Document {
        let frame = Frame::around(
            self.site,
            self.cells.iter().map(|cell| [cell.at.x, cell.at.y]),
            WIDTH - 2.0 * MARGIN,
        );
        let legend_top = TITLE_HEIGHT + frame.height() + MARGIN;
        page(&self.title, &self.subtitle, legend_top + LEGEND_HEIGHT + MARGIN)
            .add(self.map(&frame).set("transform", translate(MARGIN, TITLE_HEIGHT + MARGIN / 2.0)))
            .add(legend().set("transform", translate(MARGIN, legend_top)))
    }

    fn map(&self, frame: &Frame) -> Group {
        let mut group = Group::new();
        let side = frame.pixels(self.cell_m);
        for cell in self.cells {
            let (x, y) = frame.place(cell.at.x, cell.at.y);
            let square = Rectangle::new().set("x", tenth(x - 0.5 * side)).set("y", tenth(y - 0.5 * side));
            group = group.add(
                square.set("width", tenth(side)).set("height", tenth(side)).set("fill", colour(cell.seen)),
            );
            if cell.is_blind {
                let arm = 0.25 * side;
                let cross = format!(
                    "M{:.1} {:.1}l{2:.1} {2:.1}m0 -{2:.1}l-{2:.1} {2:.1}",
                    x - arm,
                    y - arm,
                    2.0 * arm
                );
                group = group.add(stroke(cross, "#9b2c2c", 1.5).set("class", "blind"));
            }
        }
        for zone in &self.site.zones {
            group = group.add(stroke(frame.line(zone.polygon.iter().copied()) + "Z", "#718096", 1.0));
        }
        for entry in &self.site.entries {
            group = group.add(stroke(frame.line(entry.line), "#5a9367", 2.0).set("stroke-dasharray", "6 4"));
        }
        for wall in &self.site.walls {
            group = group.add(stroke(frame.line(wall.points.iter().copied()), "#2d3748", 3.0));
        }
        for module in &self.site.modules {
            let (x, y) = frame.place(module.x, module.y);
            let ahead = Point::towards(module.yaw_deg.to_radians()) * NOSE;
            let nose: Line = stroke(format!("M{x:.1} {y:.1}l{:.1} {:.1}", ahead.x, -ahead.y), "#d1495b", 3.0);
            let name = Text::new(&module.name)
                .set("class", "small")
                .set("x", tenth(x + 8.0))
                .set("y", tenth(y - 8.0));
            let dot =
                Circle::new().set("class", "sensor").set("cx", tenth(x)).set("cy", tenth(y)).set("r", 5);
            group = group.add(dot).add(nose).add(name);
        }
        group
    }
}

/// The colour of a cell: from none to one, and on to two.
fn colour([one, two]: [f64; 2]) -> String {
    let [none, by_one, by_two] = COLOURS;
    let mixed = |part: usize| none[part] * (1.0 - one) + by_one[part] * (one - two) + by_two[part] * two;
    let [red, green, blue] = [0, 1, 2].map(|part| mixed(part).clamp(0.0, 255.0).round() as u8);
    format!("#{red:02x}{green:02x}{blue:02x}")
}

fn legend() -> Group {
    let entries = [
        ([0.0, 0.0], "never seen while people stand about"),
        ([1.0, 0.0], "always, from one side"),
        ([1.0, 1.0], "always, from two sides"),
    ];
    let (mut group, mut x) = (Group::new(), 0.0);
    for (seen, words) in entries {
        let square = Rectangle::new().set("x", x).set("y", 2).set("width", 12).set("height", 12);
        let text = Text::new(words).set("class", "axis").set("x", x + 18.0).set("y", 12);
        group = group.add(square.set("fill", colour(seen)).set("stroke", palette::PAPER)).add(text);
        x += 40.0 + 7.0 * words.len() as f64;
    }
    let cross = stroke(format!("M{x:.1} 4l8 8m0 -8l-8 8"), "#9b2c2c", 1.5);
    group.add(cross).add(
        Text::new("blind spot: not seen even in the empty room")
            .set("class", "axis")
            .set("x", x + 18.0)
            .set("y", 12),
    )
}

/// One decimal is finer than a screen shows.
fn tenth(value: f64) -> f64 {
    (value * 10.0).round() / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_have_the_colours_of_what_sees_them_and_blind_spots_a_cross() {
        let cell =
            |x: f64, seen: [f64; 2]| CellShown { at: Point::new(x, 0.0), seen, is_blind: seen[0] == 0.0 };
        let cells = [cell(0.0, [0.0, 0.0]), cell(0.25, [1.0, 0.0]), cell(0.5, [1.0, 1.0])];
        let site = Site::parse("a", "[[module]]\nname = \"a & b\"\nx = 0.1\ny = 0.2\n").unwrap();
        let picture = CoveragePicture {
            title: "t".into(),
            subtitle: String::new(),
            site: &site,
            cell_m: 0.25,
            cells: &cells,
        };
        let text = picture.to_svg().to_string();
        assert_eq!(text.matches("class=\"blind\"").count(), 1);
        for seen in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]] {
            let filled = format!("fill=\"{}\"", colour(seen));
            assert_eq!(text.matches(&filled).count(), 2, "a cell and the legend: {filled}");
        }
        assert!(text.contains("a &amp; b") && !text.contains("NaN"));
    }
}
