//! A site from above, with the true and the estimated trajectory of every person, and the count over time.
//!
//! ```text
//! ┌──────────────────────────────────────┐
//! │ title                                │
//! │   ┌──wall──┐                         │   the map, x to the right: walls, zones, entries, modules,
//! │   │ ~~~ ┄┄ │  ~ true   ┄ found       │   true trajectories grey, each track in a colour of its own
//! │   └── ▲ ───┘                         │
//! │ ▔▔▁▁▔▔  true and counted, by time    │
//! └──────────────────────────────────────┘
//! ```

use std::collections::BTreeMap;
use std::fmt::Write;
use std::io;
use std::path::Path;

use kehai_tracking::geometry::Point;
use kehai_tracking::jsonl::{TracksLine, TruthLine};
use kehai_tracking::site::Site;
use kehai_tracking::tracker::LifeCycle;
use svg::Document;
use svg::node::element::{Circle, Group, Path as Line, Text};

use super::{MARGIN, TIMELINE_HEIGHT, TITLE_HEIGHT, WIDTH, page, palette, translate};

/// Largest height of the map.
const MAX_HEIGHT: f64 = 900.0;
/// Two places of one track farther apart are not joined, in m.
const JUMP_M: f64 = 0.5;

/// The content of the picture.
#[derive(Clone, Debug)]
pub struct SitePicture<'a> {
    /// First line.
    pub title: String,
    /// Second line.
    pub subtitle: String,
    /// Walls, zones, entries, modules.
    pub site: &'a Site,
    /// True trajectories.
    pub truth: &'a [TruthLine],
    /// Tracks.
    pub tracks: &'a [TracksLine],
    /// Moments worth a mark: name and time in s.
    pub marks: Vec<(&'static str, f64)>,
}

/// From metres to the picture.
pub(super) struct Frame {
    left_m: f64,
    top_m: f64,
    pixels_per_m: f64,
    height: f64,
}

impl Frame {
    /// Around walls and modules of a site and some more places, at most `width` wide.
    pub(super) fn around(site: &Site, more: impl Iterator<Item = [f64; 2]>, width: f64) -> Self {
        let walls = site.walls.iter().flat_map(|wall| wall.points.iter().copied());
        let modules = site.modules.iter().map(|module| [module.x, module.y]);
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for place in walls.chain(modules).chain(more) {
            for ((low, high), value) in low.iter_mut().zip(&mut high).zip(place) {
                (*low, *high) = (low.min(value), high.max(value));
            }
        }
        if !low.iter().chain(&high).all(|value| value.is_finite()) {
            (low, high) = ([-1.0; 2], [1.0; 2]);
        }
        let [width_m, height_m] = [high[0] - low[0] + 0.4, high[1] - low[1] + 0.4];
        let pixels_per_m = (width / width_m).min(MAX_HEIGHT / height_m);
        let spare_m = width / pixels_per_m - width_m;
        Self {
            left_m: low[0] - 0.2 - spare_m / 2.0,
            top_m: high[1] + 0.2,
            pixels_per_m,
            height: height_m * pixels_per_m,
        }
    }

    pub(super) const fn height(&self) -> f64 {
        self.height
    }

    /// A length in the picture.
    pub(super) const fn pixels(&self, metres: f64) -> f64 {
        metres * self.pixels_per_m
    }

    pub(super) fn place(&self, x_m: f64, y_m: f64) -> (f64, f64) {
        ((x_m - self.left_m) * self.pixels_per_m, (self.top_m - y_m) * self.pixels_per_m)
    }

    pub(super) fn line(&self, points: impl IntoIterator<Item = [f64; 2]>) -> String {
        let mut path = String::new();
        for ([x_m, y_m], first) in
            points.into_iter().zip(std::iter::once(true).chain(std::iter::repeat(false)))
        {
            let (x, y) = self.place(x_m, y_m);
            let _ = write!(path, "{}{x:.1} {y:.1}", if first { 'M' } else { 'L' });
        }
        path
    }
}

/// A line without a filling.
pub(super) fn stroke(path: String, colour: &str, width: f64) -> Line {
    Line::new().set("d", path).set("fill", "none").set("stroke", colour).set("stroke-width", width)
}

impl SitePicture<'_> {
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
        let width = WIDTH - 2.0 * MARGIN;
        let people = self.truth.iter().flat_map(|line| line.people.iter().map(|person| [person.x, person.y]));
        let frame = Frame::around(self.site, people, width);
        let timeline_top = TITLE_HEIGHT + frame.height + 2.0 * MARGIN;
        let height = timeline_top + TIMELINE_HEIGHT + MARGIN;
        page(&self.title, &self.subtitle, height)
            .add(self.map(&frame).set("transform", translate(MARGIN, TITLE_HEIGHT + MARGIN / 2.0)))
            .add(self.timeline(width).set("transform", translate(MARGIN, timeline_top)))
    }

    fn map(&self, frame: &Frame) -> Group {
        let mut group = Group::new();
        for zone in &self.site.zones {
            let area = frame.line(zone.polygon.iter().copied()) + "Z";
            group = group.add(Line::new().set("d", area).set("class", "seen"));
        }
        for mover in &self.site.movers {
            let area = frame.line(mover.polygon.iter().copied()) + "Z";
            group = group.add(Line::new().set("d", area).set("class", "open"));
        }
        for entry in &self.site.entries {
            let line = stroke(frame.line(entry.line), "#5a9367", 2.0);
            group = group.add(line.set("stroke-dasharray", "6 4"));
        }
        for wall in &self.site.walls {
            group = group.add(stroke(frame.line(wall.points.iter().copied()), "#2d3748", 3.0));
        }
        for trajectory in trajectories(
            self.truth.iter().map(|line| line.people.iter().map(|person| (person.id, [person.x, person.y]))),
        ) {
            group = group.add(stroke(frame.line(trajectory.1), "#a0aec0", 5.0));
        }
        let found = self.tracks.iter().map(|line| {
            let sure = line.tracks.iter().filter(|track| track.state != LifeCycle::Tentative);
            sure.map(|track| (track.id, [track.x, track.y]))
        });
        for (number, (_, trajectory)) in (0u32..).zip(trajectories(found)) {
            // Neighbouring numbers lie far apart on the scale.
            let colour = palette::at(f64::from(number) * 0.381_966 % 1.0);
            group = group.add(stroke(frame.line(trajectory), &colour, 1.6));
        }
        for module in &self.site.modules {
            let (x, y) = frame.place(module.x, module.y);
            let ahead = Point::towards(module.yaw_deg.to_radians()) * 14.0;
            let nose = format!("M{x:.1} {y:.1}l{:.1} {:.1}", ahead.x, -ahead.y);
            group = group
                .add(Circle::new().set("class", "sensor").set("cx", x).set("cy", y).set("r", 5))
                .add(stroke(nose, "#d1495b", 3.0));
        }
        group
    }

    /// The true number of people, and that of confirmed or occluded tracks.
    fn timeline(&self, width: f64) -> Group {
        let end_s = self.truth.last().map_or(1.0, |line| line.t).max(0.1);
        let true_counts: Vec<(f64, usize)> =
            self.truth.iter().map(|line| (line.t, line.people.len())).collect();
        let sure = |line: &TracksLine| {
            line.tracks.iter().filter(|track| track.state != LifeCycle::Tentative).count()
        };
        let found: Vec<(f64, usize)> = self.tracks.iter().map(|line| (line.t, sure(line))).collect();
        let most = true_counts.iter().chain(&found).map(|(_, count)| *count).max().unwrap_or(0).max(2);
        let x = |t_s: f64| 30.0 + t_s / end_s * (width - 30.0);
        let y = |count: usize| 18.0 + (TIMELINE_HEIGHT - 52.0) * (1.0 - count as f64 / most as f64);
        let steps = |counts: &[(f64, usize)]| {
            let mut path = String::new();
            for (t_s, count) in counts {
                let _ = write!(
                    path,
                    "{}{:.1} {:.1}",
                    if path.is_empty() { 'M' } else { 'L' },
                    x(*t_s),
                    y(*count)
                );
            }
            path
        };
        let mut group = Group::new().add(
            Text::new("people (grey: true, blue: found)").set("class", "axis").set("x", 30).set("y", 10),
        );
        for count in (0..=most).step_by(most.div_ceil(6)) {
            let grid = format!("M30 {:.1}H{width}", y(count));
            let label =
                Text::new(count.to_string()).set("class", "axis").set("x", 8).set("y", y(count) + 4.0);
            group = group.add(Line::new().set("class", "grid").set("d", grid)).add(label);
        }
        for (name, t_s) in &self.marks {
            let line = format!("M{0:.1} {1:.1}V{2:.1}", x(*t_s), y(most), y(0));
            let label =
                Text::new(*name).set("class", "axis").set("x", x(*t_s) + 3.0).set("y", y(most) + 10.0);
            group = group.add(Line::new().set("d", line).set("stroke", "#d1495b")).add(label);
        }
        for (counts, colour, wide) in [(&true_counts, "#a0aec0", 5.0), (&found, "#35608f", 1.8)] {
            let line = Line::new().set("d", steps(counts)).set("fill", "none").set("stroke", colour);
            group = group.add(line.set("stroke-width", wide));
        }
        for part in 0..=5 {
            let t_s = end_s * f64::from(part) / 5.0;
            let label = Text::new(format!("{t_s:.1} s")).set("class", "axis");
            let anchor = if part == 5 { "end" } else { "middle" };
            group =
                group.add(label.set("text-anchor", anchor).set("x", x(t_s)).set("y", TIMELINE_HEIGHT - 8.0));
        }
        group
    }
}

/// The places of each number in order, cut where they jump.
fn trajectories<P: Iterator<Item = (u64, [f64; 2])>>(
    lines: impl Iterator<Item = P>,
) -> Vec<(u64, Vec<[f64; 2]>)> {
    let mut open: BTreeMap<u64, Vec<[f64; 2]>> = BTreeMap::new();
    let mut done = Vec::new();
    for places in lines {
        for (id, place) in places {
            let points = open.entry(id).or_default();
            let jumped =
                points.last().is_some_and(|last| (Point::from(*last) - place.into()).length() > JUMP_M);
            if jumped {
                done.push((id, std::mem::take(points)));
            }
            points.push(place);
        }
    }
    done.extend(open);
    done.sort_by_key(|(id, _)| *id);
    done
}
