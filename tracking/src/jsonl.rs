//! `tracks.jsonl` and `truth.jsonl`: what was found and what was there, one JSON object a line.
//!
//! ```text
//! tracks  {"t":…,"tracks":[{"id":…,"x":…,"y":…,"vx":…,"vy":…,"cov":[xx,xy,yy],"state":"confirmed",
//!                           "existence":…,"reason":"…","origin":"unexplained" or {"part-of":ID}}],"zones":{"NAME":{"count":…,"p":[…],…}}}
//! truth   {"t":…,"people":[{"id":…,"x":…,"y":…,"beams":…}]}
//! ```
//!
//! Seconds, metres, the site's frame. Files are read and written a line at a time; a line that cannot be
//! right is refused with the file, the line's number and what is wrong.

use std::collections::BTreeMap;
use std::fmt;
use std::io::{self, BufRead, Write};
use std::marker::PhantomData;

use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::figures::rounded;
use crate::geometry::Point;
pub use crate::occupancy::{ZoneKnown, ZoneLine};
use crate::tracker::{LifeCycle, Origin, TrackId, TrackState};

/// A line of `tracks.jsonl`: what the tracker says at one time, from the datagrams that had arrived by then.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TracksLine {
    /// Time the states are predicted to, s.
    pub t: f64,
    /// All tracks, tentative ones included.
    pub tracks: Vec<TrackLine>,
    /// What is known of each zone, by its name.
    #[serde(default)]
    pub zones: BTreeMap<String, ZoneLine>,
}

/// One track.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrackLine {
    /// Never used for another track.
    pub id: TrackId,
    /// m.
    pub x: f64,
    /// m.
    pub y: f64,
    /// m/s.
    #[serde(default)]
    pub vx: f64,
    /// m/s.
    #[serde(default)]
    pub vy: f64,
    /// Covariance of the place: xx, xy, yy in m².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cov: Option<[f64; 3]>,
    /// Where in its life.
    pub state: LifeCycle,
    /// Probability that a person is there at all.
    #[serde(default = "certain")]
    pub existence: f64,
    /// Why it is in this state.
    #[serde(default)]
    pub reason: String,
    /// How it came to be; not written of a track that was seen to come in.
    #[serde(default, skip_serializing_if = "has_entered")]
    pub origin: Origin,
}

fn has_entered(origin: &Origin) -> bool {
    *origin == Origin::Entered
}

/// A line of `truth.jsonl`: where people are at one time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TruthLine {
    /// s, on the same clock as the tracks.
    pub t: f64,
    /// All people.
    pub people: Vec<PersonLine>,
}

/// One person.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PersonLine {
    /// Never used for another person.
    pub id: u64,
    /// Middle of the body, m.
    pub x: f64,
    /// m.
    pub y: f64,
    /// How many beams of the sensor that saw this person best hit it within the last 0.2 s; absent where they were not
    /// counted. 10 or more: visible.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beams: Option<u32>,
}

const fn certain() -> f64 {
    1.0
}

impl From<&TrackState> for TrackLine {
    /// As many decimals as mean something, so that lines stay short: 0.1 mm, 0.1 mm/s, 0.1 mm².
    fn from(track: &TrackState) -> Self {
        Self {
            id: track.id,
            x: rounded(track.at.x, 1e4),
            y: rounded(track.at.y, 1e4),
            vx: rounded(track.velocity.x, 1e4),
            vy: rounded(track.velocity.y, 1e4),
            cov: Some(track.covariance_m2.map(|value| rounded(value, 1e7))),
            state: track.state,
            existence: rounded(track.existence, 1e4),
            reason: track.reason.to_owned(),
            origin: track.origin,
        }
    }
}

impl From<&TrackLine> for TrackState {
    /// Its reason was that of another process.
    fn from(line: &TrackLine) -> Self {
        Self {
            id: line.id,
            at: Point::new(line.x, line.y),
            velocity: Point::new(line.vx, line.vy),
            covariance_m2: line.cov.unwrap_or([0.04, 0.0, 0.04]),
            state: line.state,
            existence: line.existence,
            reason: "",
            origin: line.origin,
        }
    }
}

/// A line with a time and numbered people.
pub trait Line: DeserializeOwned {
    /// s.
    fn time_s(&self) -> f64;

    /// Numbers of the tracks in it.
    fn ids(&self) -> impl Iterator<Item = u64>;
}

impl Line for TracksLine {
    fn time_s(&self) -> f64 {
        self.t
    }

    fn ids(&self) -> impl Iterator<Item = u64> {
        self.tracks.iter().map(|track| track.id)
    }
}

impl Line for TruthLine {
    fn time_s(&self) -> f64 {
        self.t
    }

    fn ids(&self) -> impl Iterator<Item = u64> {
        self.people.iter().map(|person| person.id)
    }
}

/// Writes one line.
///
/// # Errors
/// What the writer says.
pub fn write_line(out: &mut impl Write, line: &impl Serialize) -> io::Result<()> {
    serde_json::to_writer(&mut *out, line)?;
    out.write_all(b"\n")
}

/// Reads a file line by line. Empty lines are skipped; after an error there is nothing more.
pub struct Lines<R, T> {
    from: R,
    file: String,
    number: usize,
    text: Vec<u8>,
    last_s: f64,
    over: bool,
    kind: PhantomData<T>,
}

impl<R: BufRead, T: Line> Lines<R, T> {
    /// Reads `from`; `file` is its name in errors.
    #[must_use]
    pub fn new(from: R, file: &str) -> Self {
        Self {
            from,
            file: file.to_owned(),
            number: 0,
            text: Vec::new(),
            last_s: f64::NEG_INFINITY,
            over: false,
            kind: PhantomData,
        }
    }

    fn read(&mut self) -> Result<Option<T>, Fault> {
        loop {
            self.text.clear();
            self.number += 1;
            if self.from.read_until(b'\n', &mut self.text).map_err(Fault::Unreadable)? == 0 {
                return Ok(None);
            }
            if !self.text.trim_ascii().is_empty() {
                return self.parse().map(Some);
            }
        }
    }

    fn parse(&mut self) -> Result<T, Fault> {
        let line: T = serde_json::from_slice(&self.text).map_err(|error| Fault::malformed(&error))?;
        if line.time_s() <= self.last_s {
            return Err(Fault::Backwards { t_s: line.time_s(), last_s: self.last_s });
        }
        self.last_s = line.time_s();
        let mut ids: Vec<u64> = line.ids().collect();
        ids.sort_unstable();
        match ids.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(pair) => Err(Fault::Twice { id: pair[0] }),
            None => Ok(line),
        }
    }
}

impl<R: BufRead, T: Line> Iterator for Lines<R, T> {
    type Item = Result<T, LineError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.over {
            return None;
        }
        let read = self.read();
        self.over = !matches!(read, Ok(Some(_)));
        let place = |fault| LineError { file: self.file.clone(), number: self.number, fault };
        read.map_err(place).transpose()
    }
}

/// A line that cannot be used.
#[derive(Debug)]
pub struct LineError {
    /// Name of the file.
    pub file: String,
    /// Number of the line, from 1.
    pub number: usize,
    /// What is wrong with it.
    pub fault: Fault,
}

/// What is wrong with a line.
#[derive(Debug)]
pub enum Fault {
    /// It cannot be read.
    Unreadable(io::Error),
    /// It is not such a line.
    Malformed {
        /// What was found or is missing.
        what: String,
        /// Where, in bytes from 1.
        column: usize,
    },
    /// It is not later than the line before.
    Backwards {
        /// Its time, s.
        t_s: f64,
        /// Time of the line before, s.
        last_s: f64,
    },
    /// A number stands for two.
    Twice {
        /// That number.
        id: u64,
    },
}

impl Fault {
    fn malformed(error: &serde_json::Error) -> Self {
        let text = error.to_string();
        let what = text.rsplit_once(" at line ").map_or(text.as_str(), |(what, _)| what);
        Self::Malformed { what: what.to_owned(), column: error.column() }
    }
}

impl fmt::Display for LineError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: {}", self.file, self.number, self.fault)
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreadable(error) => write!(f, "cannot be read: {error}"),
            Self::Malformed { what, column } => write!(f, "{what}, at column {column}"),
            Self::Backwards { t_s, last_s } => write!(f, "t = {t_s} s does not come after {last_s} s"),
            Self::Twice { id } => write!(f, "duplicate id {id}"),
        }
    }
}

impl std::error::Error for LineError {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::occupancy::Found;

    fn said<T: Line>(text: &str) -> String {
        let mut lines = Lines::<_, T>::new(text.as_bytes(), "a.jsonl");
        let error = lines.find_map(Result::err).expect("every line was taken");
        assert!(lines.next().is_none(), "goes on after an error");
        error.to_string()
    }

    #[test]
    fn a_track_survives_the_file() {
        let state = TrackState {
            id: 7,
            at: Point::new(1.23456, -0.5),
            velocity: Point::new(0.0, -1.0),
            covariance_m2: [0.01, -0.002, 0.03],
            state: LifeCycle::Occluded,
            existence: 0.98765,
            reason: "hidden by 3",
            origin: Origin::Entered,
        };
        let zone = ZoneLine::new(Found::inside(1, vec![0.1, 0.9]), 0.7, ZoneKnown::Partly);
        let line = TracksLine {
            t: 12.3,
            tracks: vec![TrackLine::from(&state)],
            zones: BTreeMap::from([("area".to_owned(), zone)]),
        };
        let mut file = Vec::new();
        write_line(&mut file, &line).unwrap();
        let text = String::from_utf8(file.clone()).unwrap();
        assert!(text.contains(r#""x":1.2346,"y":-0.5"#), "{text}");
        assert!(text.contains(r#""state":"occluded","existence":0.9877,"reason":"hidden by 3""#), "{text}");
        assert!(
            text.contains(r#""zones":{"area":{"count":1,"p":[0.1,0.9],"seen_share":0.7,"state":"partly"}}"#)
        );
        let read: Vec<TracksLine> =
            Lines::new(file.as_slice(), "tracks.jsonl").collect::<Result<_, _>>().unwrap();
        assert_eq!(read, [line]);
    }

    #[test]
    fn truth_may_say_how_well_a_person_is_seen() {
        let text = "{\"t\":0,\"people\":[{\"id\":1,\"x\":0.5,\"y\":1}]}\n\n\
                    {\"t\":0.1,\"people\":[{\"id\":1,\"x\":0.5,\"y\":1,\"beams\":12,\"more\":true}]}";
        let lines: Vec<TruthLine> = Lines::new(text.as_bytes(), "t").collect::<Result<_, _>>().unwrap();
        assert_eq!(lines.iter().map(|line| line.people[0].beams).collect::<Vec<_>>(), [None, Some(12)]);
    }

    #[test]
    fn a_bad_line_is_named_with_its_file_number_and_fault() {
        let good = r#"{"t":1,"people":[]}"#;
        assert_eq!(
            said::<TruthLine>(&format!("{good}\n\n{{\"t\":2}}")),
            "a.jsonl:3: missing field `people`, at column 7"
        );
        assert_eq!(
            said::<TruthLine>(&format!("{good}\n{good}\n")),
            "a.jsonl:2: t = 1 s does not come after 1 s"
        );
        assert_eq!(
            said::<TruthLine>(r#"{"t":1,"people":[{"id":4,"x":0,"y":0},{"id":4,"x":1,"y":0}]}"#),
            "a.jsonl:1: duplicate id 4"
        );
        assert!(said::<TracksLine>("[").starts_with("a.jsonl:1: EOF while parsing"));
        assert!(
            said::<TracksLine>(r#"{"t":1,"tracks":[{"id":4,"x":0,"y":0,"state":"lost"}]}"#)
                .contains("unknown variant `lost`")
        );
        assert!(
            said::<TracksLine>(r#"{"t":1,"tracks":[{"id":4,"x":1e999,"y":0}]}"#).contains("out of range")
        );
    }
}
