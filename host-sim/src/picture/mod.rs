//! A recording, or a run in a simulated scene, as one picture.
//!
//! ```text
//! ┌──────────────────────────────────────┐
//! │ title                                │
//! │        ·····wall·····                │   the map, seen from above, sensor looking up:
//! │   ╱ open ╲    ○ ○ ● ● wide           │   what is background, every foreground point and
//! │  ╱        ╲  · · narrow              │   every candidate's centre, coloured by time
//! │      ▲ sensor                        │
//! │ ▁▂▂▁▁▃▃▂ candidates at once, by time │
//! └──────────────────────────────────────┘
//! ```

mod content;
pub mod coverage;
pub mod exposure;
mod map;
mod palette;
pub mod site;
mod timeline;

use std::io;
use std::path::Path;

pub use content::{BeamKind, BeamShown, CandidateShown, Picture, ScanShown, TruthShown};
use svg::Document;
use svg::node::element::{Rectangle, Style, Text};

/// Width of the whole picture in its own units.
const WIDTH: f64 = 1200.0;
/// Space around everything.
const MARGIN: f64 = 36.0;
/// Height of the title's two lines.
const TITLE_HEIGHT: f64 = 64.0;
/// Height of the row that explains the colours.
const LEGEND_HEIGHT: f64 = 24.0;
/// Height of the strip under the map.
const TIMELINE_HEIGHT: f64 = 150.0;

impl Picture {
    /// The picture as SVG.
    #[must_use]
    pub fn to_svg(&self) -> Document {
        let map = map::Frame::around(self, WIDTH - 2.0 * MARGIN);
        let timeline_top = TITLE_HEIGHT + map.height() + 2.0 * MARGIN + LEGEND_HEIGHT;
        let height = timeline_top + TIMELINE_HEIGHT + MARGIN;
        page(&self.title, &self.subtitle, height)
            .add(map.draw(self).set("transform", translate(MARGIN, TITLE_HEIGHT + MARGIN / 2.0)))
            .add(
                timeline::draw(self, WIDTH - 2.0 * MARGIN, TIMELINE_HEIGHT)
                    .set("transform", translate(MARGIN, timeline_top)),
            )
    }

    /// Writes the picture to a file.
    ///
    /// # Errors
    /// What the file system says.
    pub fn save(&self, path: &Path) -> io::Result<()> {
        svg::save(path, &self.to_svg())
    }
}

/// A sheet of paper with its two lines.
fn page(title: &str, subtitle: &str, height: f64) -> Document {
    Document::new()
        .set("viewBox", (0, 0, WIDTH, height))
        .set("width", WIDTH)
        .set("height", height)
        .add(Style::new(palette::STYLE))
        .add(Rectangle::new().set("width", "100%").set("height", "100%").set("fill", palette::PAPER))
        .add(Text::new(title).set("class", "title").set("x", MARGIN).set("y", 40))
        .add(Text::new(subtitle).set("class", "small").set("x", MARGIN).set("y", 62))
}

fn translate(x: f64, y: f64) -> String {
    format!("translate({x:.1} {y:.1})")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> Picture {
        let wall = |i: i32| BeamShown {
            bearing_rad: f64::from(i) * 0.1,
            kind: BeamKind::Wall { range_m: 3.0, near_m: None },
        };
        let scan = |i: i32| ScanShown {
            t_s: f64::from(i) * 0.1,
            foreground: vec![[1.0, f64::from(i) * 0.05]],
            candidates: vec![CandidateShown { centre_m: [1.1, f64::from(i) * 0.05], narrow: i % 2 == 0 }],
        };
        Picture {
            title: "a & b".into(),
            background: (-10..10).map(wall).collect(),
            scans: (0..20).map(scan).collect(),
            ..Picture::default()
        }
    }

    #[test]
    fn every_candidate_is_drawn() {
        let text = picture().to_svg().to_string();
        assert_eq!(text.matches("class=\"narrow\"").count(), 10);
        assert_eq!(text.matches("class=\"wide\"").count(), 10);
        assert!(text.contains("a &amp; b"), "the title is not escaped");
    }

    #[test]
    fn an_empty_picture_is_still_one() {
        let text = Picture::default().to_svg().to_string();
        assert!(text.contains("viewBox") && !text.contains("NaN"));
    }
}
