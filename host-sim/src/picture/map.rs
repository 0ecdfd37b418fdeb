//! The map: background, foreground points and candidates from above, the sensor looking up.

use std::fmt::Write;

use svg::node::element::{Circle, Group, Path, Text};

use super::{BeamKind, BeamShown, Picture, palette};

/// Largest height of the map; a deep room is drawn smaller rather than endless.
const MAX_HEIGHT: f64 = 900.0;

/// Cut of the world that is drawn, and its scale.
pub struct Frame {
    /// Left edge, m to the left of the sensor.
    left_m: f64,
    /// Upper edge, m in front of the sensor.
    front_m: f64,
    width_m: f64,
    height_m: f64,
    pixels_per_m: f64,
    width: f64,
}

impl Frame {
    /// The cut that holds everything in `picture`, at most `width` wide.
    pub fn around(picture: &Picture, width: f64) -> Self {
        let background =
            picture.background.iter().filter_map(|beam| Some(point(beam.bearing_rad, beam.kind.reach_m()?)));
        let foreground = picture.scans.iter().flat_map(|scan| scan.foreground.iter().copied());
        let mut low = [-0.5_f64, -1.0];
        let mut high = [1.0_f64, 1.0];
        for place in background.chain(foreground) {
            for axis in 0..2 {
                low[axis] = low[axis].min(place[axis]);
                high[axis] = high[axis].max(place[axis]);
            }
        }
        let (height_m, width_m) = (high[0] - low[0] + 0.4, high[1] - low[1] + 0.4);
        let pixels_per_m = (width / width_m).min(MAX_HEIGHT / height_m);
        let spare_m = width / pixels_per_m - width_m;
        Self {
            left_m: high[1] + 0.2 + spare_m / 2.0,
            front_m: high[0] + 0.2,
            width_m: width_m + spare_m,
            height_m,
            pixels_per_m,
            width,
        }
    }

    /// Height on the picture.
    pub fn height(&self) -> f64 {
        self.height_m * self.pixels_per_m
    }

    fn place(&self, [x_m, y_m]: [f64; 2]) -> (f64, f64) {
        ((self.left_m - y_m) * self.pixels_per_m, (self.front_m - x_m) * self.pixels_per_m)
    }

    /// Draws the map with its upper left corner at the origin.
    pub fn draw(&self, picture: &Picture) -> Group {
        let (start_s, end_s) = picture.span_s();
        let share = |t_s: f64| (t_s - start_s) / (end_s - start_s);
        let mut group = Group::new().add(self.grid());
        for (class, ground) in self.ground(&picture.background) {
            group = group.add(Path::new().set("class", class).set("d", ground));
        }
        group = group.add(self.background(&picture.background));
        for scan in picture.scans.iter().filter(|scan| !scan.foreground.is_empty()) {
            let dots = self.dots(scan.foreground.iter().copied(), 1.1);
            group = group.add(
                Path::new()
                    .set("fill", palette::at(share(scan.t_s)))
                    .set("fill-opacity", 0.45)
                    .set("d", dots),
            );
        }
        for truth in &picture.truth {
            let (x, y) = self.place(truth.position_m);
            group = group
                .add(Circle::new().set("class", "truth").set("cx", round(x)).set("cy", round(y)).set("r", 5));
        }
        for (t_s, candidate) in
            picture.scans.iter().flat_map(|s| s.candidates.iter().map(move |c| (s.t_s, c)))
        {
            let (x, y) = self.place(candidate.centre_m);
            let colour = palette::at(share(t_s));
            let dot = Circle::new().set("cx", round(x)).set("cy", round(y));
            group = group.add(if candidate.narrow {
                dot.set("class", "narrow").set("r", 2.2).set("stroke", colour)
            } else {
                dot.set("class", "wide").set("r", 3.6).set("fill", colour)
            });
        }
        let (x, y) = self.place([0.0, 0.0]);
        let nose =
            format!("M{x:.1} {:.1}L{:.1} {:.1}L{:.1} {:.1}Z", y - 11.0, x - 7.0, y + 6.0, x + 7.0, y + 6.0);
        group.add(Path::new().set("class", "sensor").set("d", nose)).add(self.legend())
    }

    /// Lines one metre apart.
    fn grid(&self) -> Group {
        let mut lines = String::new();
        let mut group = Group::new();
        let bottom_m = self.front_m - self.height_m;
        for x_m in (bottom_m.ceil() as i32)..=(self.front_m.floor() as i32) {
            let (_, y) = self.place([f64::from(x_m), 0.0]);
            let _ = write!(lines, "M0 {y:.1}H{:.1}", self.width);
            group = group
                .add(Text::new(format!("{x_m} m")).set("class", "axis").set("x", 2).set("y", round(y - 3.0)));
        }
        let right_m = self.left_m - self.width_m;
        for y_m in (right_m.ceil() as i32)..=(self.left_m.floor() as i32) {
            let (x, _) = self.place([0.0, f64::from(y_m)]);
            let _ = write!(lines, "M{x:.1} 0V{:.1}", self.height());
        }
        group.add(Path::new().set("class", "grid").set("d", lines))
    }

    /// The floor the beams pass over, coloured by the state of their background.
    fn ground(&self, beams: &[BeamShown]) -> [(&'static str, String); 3] {
        let half_rad = match beams {
            [first, second, ..] => (second.bearing_rad - first.bearing_rad) / 2.0,
            _ => 0.0,
        };
        let mut areas = [("seen", String::new()), ("open", String::new()), ("unknown", String::new())];
        for beam in beams {
            let (area, reach_m) = match beam.kind {
                BeamKind::Wall { range_m, .. } => (0, range_m),
                BeamKind::Open { limit_m } => (1, limit_m.unwrap_or(1.0)),
                BeamKind::Unknown => (2, 0.6),
            };
            let (x, y) = self.place([0.0, 0.0]);
            let (right_x, right_y) = self.place(point(beam.bearing_rad - half_rad, reach_m));
            let (left_x, left_y) = self.place(point(beam.bearing_rad + half_rad, reach_m));
            let _ =
                write!(areas[area].1, "M{x:.1} {y:.1}L{right_x:.1} {right_y:.1}L{left_x:.1} {left_y:.1}Z");
        }
        areas
    }

    /// Walls, second walls and the limits of open beams, as dots.
    fn background(&self, beams: &[BeamShown]) -> Group {
        let of = |pick: &dyn Fn(BeamKind) -> Option<f64>| {
            beams.iter().filter_map(|b| Some(point(b.bearing_rad, pick(b.kind)?))).collect::<Vec<_>>()
        };
        let walls = of(&|kind| if let BeamKind::Wall { range_m, .. } = kind { Some(range_m) } else { None });
        let near = of(&|kind| if let BeamKind::Wall { near_m, .. } = kind { near_m } else { None });
        let limits = of(&|kind| if let BeamKind::Open { limit_m } = kind { limit_m } else { None });
        Group::new()
            .add(Path::new().set("class", "limit").set("d", self.dots(limits, 1.0)))
            .add(Path::new().set("class", "wall").set("d", self.dots(walls, 1.6)))
            .add(Path::new().set("class", "near").set("d", self.dots(near, 1.6)))
    }

    /// Squares around the points, as one path.
    fn dots(&self, points: impl IntoIterator<Item = [f64; 2]>, half: f64) -> String {
        let mut path = String::new();
        for place in points {
            let (x, y) = self.place(place);
            let _ = write!(path, "M{:.1} {:.1}h{w}v{w}h-{w}z", x - half, y - half, w = 2.0 * half);
        }
        path
    }

    /// The legend of the colours, in a row under the map.
    fn legend(&self) -> Group {
        let entries = [
            ("wall", "wall"),
            ("near", "second wall (door leaf)"),
            ("limit", "open: farthest seen there"),
            ("unknown", "not judged"),
            ("sensor", "sensor, looking up"),
        ];
        let (mut x, y) = (0.0, self.height() + 20.0);
        let mut group = Group::new();
        for (class, words) in entries {
            let square = format!("M{x:.1} {:.1}h8v8h-8z", y - 8.0);
            group = group
                .add(Path::new().set("class", class).set("d", square))
                .add(Text::new(words).set("class", "axis").set("x", round(x + 14.0)).set("y", y));
            x += 40.0 + 7.0 * words.chars().count() as f64;
        }
        let dot =
            Circle::new().set("cx", x + 4.0).set("cy", y - 4.0).set("r", 4).set("fill", palette::at(0.5));
        let words = "● wide, ○ narrow candidate's centre, blue to yellow by time";
        group.add(dot).add(
            Text::new(words.trim_start_matches("● "))
                .set("class", "axis")
                .set("x", round(x + 14.0))
                .set("y", y),
        )
    }
}

impl BeamKind {
    /// How far the beam is known to reach.
    fn reach_m(self) -> Option<f64> {
        match self {
            Self::Wall { range_m, .. } => Some(range_m),
            Self::Open { limit_m } => limit_m,
            Self::Unknown => None,
        }
    }
}

fn point(bearing_rad: f64, range_m: f64) -> [f64; 2] {
    [range_m * bearing_rad.cos(), range_m * bearing_rad.sin()]
}

/// One decimal is finer than a screen shows.
fn round(value: f64) -> f64 {
    (value * 10.0).round() / 10.0
}
