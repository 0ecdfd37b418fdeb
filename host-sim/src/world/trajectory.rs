//! Recorded trajectories: simulated people walk as recorded people walked.
//!
//! ```text
//!   id frame x y z                 cm, 16 frames a second            (corridor experiments, Jülich)
//!   frame id x z y vx vz vy        m, 0.4 s an annotated step        (streets, ETH and UCY)
//! ```
//!
//! Which of the two a file is follows from the number of its columns. Places between the frames lie on a
//! Catmull–Rom curve, which passes through every recorded place. Lengths of frames: the smallest gap
//! between two frames of a file in the second format is one annotated step.

use super::body::Section;
use super::geometry::Point;
use super::motion::Track;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Recorded people in a scene.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recorded {
    /// The file, beside the scene or with a path from there.
    pub file: String,
    /// Where the recording's origin lies in the site.
    #[serde(default)]
    pub x: f64,
    /// Where the recording's origin lies in the site.
    #[serde(default)]
    pub y: f64,
    /// How far the recording is turned about its origin, counter-clockwise.
    #[serde(default)]
    pub turn_deg: f64,
    /// When its first frame is.
    #[serde(default)]
    pub from_s: f64,
    /// What the plane cuts.
    #[serde(default)]
    pub section: Section,
    /// Every person's recorded places, read with the scene.
    #[serde(skip)]
    pub people: Vec<Recording>,
}

/// The recorded places of one person, in the recording's own frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// The number the file gives the person.
    pub id: u32,
    /// Time from the file's first frame and place, in order of time.
    pub places: Vec<(f64, Point)>,
}

/// Time between two samples of a trajectory.
const SAMPLE_S: f64 = 0.04;
/// Of the first format.
const FRAMES_A_SECOND: f64 = 16.0;
/// Of the second format.
const ANNOTATED_STEP_S: f64 = 0.4;

impl Recorded {
    /// Reads the file, whose path starts at `folder`.
    ///
    /// # Errors
    /// The file, the line and what is wrong with it.
    pub fn read(&mut self, folder: &Path) -> Result<(), String> {
        let path = folder.join(&self.file);
        let name = path.display();
        let text =
            std::fs::read_to_string(&path).map_err(|error| format!("{name}: cannot be read: {error}"))?;
        self.people = parse(&text).map_err(|what| format!("{name}:{what}"))?;
        Ok(())
    }

    /// The trajectory of every person, in the site.
    #[must_use]
    pub fn tracks(&self) -> Vec<Track> {
        let axis = Point::towards(self.turn_deg.to_radians());
        let origin = Point::new(self.x, self.y);
        let place = |at: Point| origin + axis * at.x + axis.left() * at.y;
        let track = |recording: &Recording| {
            let (first_s, _) = *recording.places.first()?;
            let (last_s, _) = *recording.places.last()?;
            let samples = ((last_s - first_s) / SAMPLE_S) as usize + 1;
            let positions: Vec<Point> = (0..samples)
                .map(|index| place(between(&recording.places, first_s + SAMPLE_S * index as f64)))
                .collect();
            Some(Track::new(self.from_s + first_s, SAMPLE_S, &positions, 0.0))
        };
        self.people.iter().filter_map(track).collect()
    }
}

/// The place at `time_s` on the curve through the recorded places.
fn between(places: &[(f64, Point)], time_s: f64) -> Point {
    let next = places.partition_point(|(at_s, _)| *at_s <= time_s).clamp(1, places.len().max(2) - 1);
    let at =
        |index: usize| places.get(index.min(places.len().saturating_sub(1))).copied().unwrap_or_default();
    let (from_s, from) = at(next - 1);
    let (to_s, to) = at(next);
    let (_, before) = at(next.saturating_sub(2));
    let (_, after) = at(next + 1);
    let share = ((time_s - from_s) / (to_s - from_s).max(1e-9)).clamp(0.0, 1.0);
    let (leave, arrive) = ((to - before) * 0.5, (after - from) * 0.5);
    let (square, cube) = (share * share, share * share * share);
    from * (2.0 * cube - 3.0 * square + 1.0)
        + leave * (cube - 2.0 * square + share)
        + to * (3.0 * square - 2.0 * cube)
        + arrive * (cube - square)
}

/// The recorded places of every person; errors begin with the line's number.
fn parse(text: &str) -> Result<Vec<Recording>, String> {
    let mut rows: Vec<(u32, f64, Point)> = Vec::new();
    let mut columns = None;
    for (index, line) in text.lines().enumerate() {
        let numbers: Result<Vec<f64>, _> = line.split_whitespace().map(str::parse).collect();
        let numbers = numbers.map_err(|_| format!("{}: not a row of numbers", index + 1))?;
        let row = match *numbers.as_slice() {
            [] => continue,
            [id, frame, x, y, _] => (id as u32, frame / FRAMES_A_SECOND, Point::new(x * 0.01, y * 0.01)),
            [frame, id, x, _, y, _, _, _] => (id as u32, frame, Point::new(x, y)),
            _ => return Err(format!("{}: {} columns, must be 5 or 8", index + 1, numbers.len())),
        };
        if numbers.iter().any(|number| !number.is_finite())
            || *columns.get_or_insert(numbers.len()) != numbers.len()
        {
            return Err(format!("{}: does not fit the rows before it", index + 1));
        }
        rows.push(row);
    }
    if columns.is_none() {
        return Err(String::from("1: holds no row"));
    }
    if columns == Some(8) {
        let mut frames: Vec<f64> = rows.iter().map(|(_, frame, _)| *frame).collect();
        frames.sort_by(f64::total_cmp);
        let gaps = frames.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > 0.0);
        let step = gaps.min_by(f64::total_cmp).unwrap_or(1.0);
        rows.iter_mut().for_each(|(_, frame, _)| *frame *= ANNOTATED_STEP_S / step);
    }
    let first_s = rows.iter().map(|(_, time_s, _)| *time_s).fold(f64::INFINITY, f64::min);
    let mut people: BTreeMap<u32, Vec<(f64, Point)>> = BTreeMap::new();
    for (id, time_s, place) in rows {
        people.entry(id).or_default().push((time_s - first_s, place));
    }
    let recording = |(id, mut places): (u32, Vec<(f64, Point)>)| {
        places.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        places.dedup_by(|(a, _), (b, _)| a == b);
        Recording { id, places }
    };
    Ok(people.into_iter().map(recording).filter(|recording| recording.places.len() > 1).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_formats_are_told_apart_by_their_columns() {
        let corridor = parse("7 32 100 200 170\n7 48 116 200 170\n\n").unwrap();
        assert_eq!(
            corridor,
            [Recording { id: 7, places: vec![(0.0, Point::new(1.0, 2.0)), (1.0, Point::new(1.16, 2.0))] }]
        );
        let street = parse("1.0 3 2.5 0 4.0 0 0 0\n11 3 3.0 0 4 0 0 0\n21 3 3.5 0 4 0 0 0").unwrap();
        assert_eq!(street[0].id, 3);
        assert_eq!(street[0].places[2].1, Point::new(3.5, 4.0));
        assert!((street[0].places[2].0 - 0.8).abs() < 1e-9);
    }

    #[test]
    fn defects_are_named_with_their_line() {
        assert_eq!(parse("1 2 3 4 5\n1 2 3\n").unwrap_err(), "2: 3 columns, must be 5 or 8");
        assert_eq!(parse("1 2 3 4 x").unwrap_err(), "1: not a row of numbers");
        assert_eq!(parse("1 2 3 4 5\n1 2 3 4 5 6 7 8").unwrap_err(), "2: does not fit the rows before it");
        assert_eq!(parse("\n").unwrap_err(), "1: holds no row");
    }

    #[test]
    fn tracks_pass_through_every_recorded_place_where_the_scene_puts_them() {
        let mut recorded: Recorded =
            toml::from_str("file = \"x\"\nx = 5.0\nturn_deg = 90.0\nfrom_s = 10.0").unwrap();
        recorded.people = parse("1 0 0 0 170\n1 16 100 0 170\n1 32 100 100 170\n1 48 200 100 170").unwrap();
        let track = recorded.tracks().remove(0);
        for (time_s, x, y) in [(10.0, 5.0, 0.0), (11.0, 5.0, 1.0), (12.0, 4.0, 1.0), (13.0, 4.0, 2.0)] {
            let at = track.stance(time_s).unwrap().at;
            assert!((at - Point::new(x, y)).length() < 1e-6, "{at:?} at {time_s}");
        }
        assert_eq!(track.stance(13.1), None);
    }

    #[test]
    fn the_shared_recordings_are_read_and_people_in_them_walk() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/trajectories");
        if !folder.is_dir() {
            let missing = format!("no trajectories at {}", folder.display());
            return test_support::fail_in_ci_else_skip(missing);
        }
        for (file, people) in [
            ("uo-050-180-180.txt", 30..),
            ("bot-300-050-050.txt", 60..),
            ("boa-300-frei.txt", 40..),
            ("ucy-zara01-obsmat.txt", 100..),
            ("eth-hotel-obsmat.txt", 300..),
        ] {
            let mut recorded: Recorded = toml::from_str(&format!("file = \"{file}\"")).unwrap();
            recorded.read(&folder).unwrap();
            assert!(people.contains(&recorded.people.len()), "{file}: {}", recorded.people.len());
            let speeds: Vec<f64> = recorded
                .people
                .iter()
                .map(|person| {
                    let ((from_s, from), (to_s, to)) =
                        (person.places[0], person.places[person.places.len() - 1]);
                    (to - from).length() / (to_s - from_s)
                })
                .collect();
            let mean = speeds.iter().sum::<f64>() / speeds.len() as f64;
            println!("{file}: {} people, {mean:.2} m/s", speeds.len());
            assert!((0.3..1.8).contains(&mean), "{file}: {mean} m/s");
        }
    }
}
