//! Recorded scans: a plain CSV that any tool can read, written and read here.
//!
//! ```text
//! # source=… sensor=…
//! # amin_step=44 front_step=384 ares=1024 beams=682 dmin=20 dmax=5600 period_ms=100 …
//! # invalid: …
//! 0,392,392,391,…            stamp in µs, then one value a beam in mm, from amin_step upwards,
//! 99683,391,392,0,…          counter-clockwise; values below dmin are the sensor's codes
//! ```

pub mod floor;
mod source;

pub use source::RecordingSource;

use std::fmt;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

use kehai::scan::{Geometry, GeometryError, GeometryParts, NO_RETURN_MM};

/// Everything a recording holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recording {
    /// Where the beams point; the scan's own steps, cluster 1.
    pub geometry: GeometryParts,
    /// The scans in the order they were taken, at least one.
    pub scans: Vec<RecordedScan>,
}

/// One scan of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordedScan {
    /// Time of the scan in µs from the start of the recording.
    pub stamp_us: u64,
    /// One value a beam in mm; farther than 65 534 mm is stored as [`NO_RETURN_MM`].
    pub ranges_mm: Vec<u16>,
}

/// A recording that cannot be used: which file, which line, and why.
#[derive(Debug)]
pub struct RecordingError {
    path: PathBuf,
    line: Option<usize>,
    cause: Cause,
}

/// Why a recording cannot be used.
#[derive(Debug)]
pub enum Cause {
    /// The file cannot be opened or read.
    Unreadable(io::Error),
    /// No comment line states the geometry.
    NoGeometry,
    /// The geometry lacks a key.
    MissingKey(&'static str),
    /// A key of the geometry has no usable number.
    BadValue(&'static str, String),
    /// The numbers of the geometry do not describe a sensor.
    Impossible(GeometryError),
    /// A field of a scan is no whole number.
    BadField(usize, String),
    /// A scan has another number of values than the geometry says.
    WrongCount {
        /// Values the geometry asks for.
        expected: usize,
        /// Values on the line.
        found: usize,
    },
    /// A stamp is smaller than the one before.
    TimeRunsBack,
    /// A stamp is more than a week behind the first one.
    TooLong,
    /// The file holds no scan.
    Empty,
}

/// Longest recording, µs: a week. What seems longer has stamps in another unit; whatever plays it adds its own time to them.
pub const LONGEST_US: u64 = 7 * 24 * 3600 * 1_000_000;

impl fmt::Display for RecordingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        f.write_str(": ")?;
        match &self.cause {
            Cause::Unreadable(error) => write!(f, "cannot be read: {error}"),
            Cause::NoGeometry => f.write_str(
                "no comment line before the first scan states the geometry (# amin_step=… front_step=… ares=… beams=… dmin=… dmax=… period_ms=…)",
            ),
            Cause::MissingKey(key) => write!(f, "the geometry lacks {key}=…"),
            Cause::BadValue(key, text) => write!(f, "{key}={text} is not a usable number"),
            Cause::Impossible(error) => write!(f, "impossible geometry: {error}"),
            Cause::BadField(column, text) => write!(f, "field {column} is not a whole number: {text:?}"),
            Cause::WrongCount { expected, found } => {
                write!(f, "{found} values where the geometry says {expected}")
            }
            Cause::TimeRunsBack => f.write_str("the stamp is smaller than the one before"),
            Cause::TooLong => f.write_str("more than a week behind the first scan; is the stamp in µs?"),
            Cause::Empty => f.write_str("holds no scan"),
        }
    }
}

impl std::error::Error for RecordingError {}

impl Recording {
    /// Reads a recording.
    ///
    /// # Errors
    /// [`RecordingError`] with the file, the line and the cause; nothing is repaired silently.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let fail = |line, cause| RecordingError { path: path.to_owned(), line, cause };
        let file = File::open(path).map_err(|error| fail(None, Cause::Unreadable(error)))?;
        Self::read(BufReader::new(file)).map_err(|(line, cause)| fail(line, cause))
    }

    fn read(lines: impl BufRead) -> Result<Self, (Option<usize>, Cause)> {
        let mut geometry = None;
        let mut scans: Vec<RecordedScan> = Vec::new();
        for (number, line) in (1..).zip(lines.lines()) {
            let line = line.map_err(|error| (Some(number), Cause::Unreadable(error)))?;
            let at = |cause| (Some(number), cause);
            let line = line.trim();
            if let Some(comment) = line.strip_prefix('#') {
                if comment.split_whitespace().any(|word| word.starts_with("amin_step=")) {
                    geometry = Some(read_geometry(comment).map_err(at)?);
                }
            } else if !line.is_empty() {
                let geometry = geometry.as_ref().ok_or_else(|| at(Cause::NoGeometry))?;
                let scan = read_scan(line, geometry).map_err(at)?;
                if scans.last().is_some_and(|last| scan.stamp_us < last.stamp_us) {
                    return Err(at(Cause::TimeRunsBack));
                }
                if scans.first().is_some_and(|first| scan.stamp_us - first.stamp_us > LONGEST_US) {
                    return Err(at(Cause::TooLong));
                }
                scans.push(scan);
            }
        }
        let geometry = geometry.ok_or((None, Cause::NoGeometry))?;
        if scans.is_empty() {
            return Err((None, Cause::Empty));
        }
        Ok(Self { geometry, scans })
    }

    /// Writes the recording in the format [`Recording::open`] reads.
    ///
    /// # Errors
    /// What the writer says.
    pub fn write(&self, mut out: impl Write, source: &str) -> io::Result<()> {
        let parts = &self.geometry;
        writeln!(out, "# source={}", source.replace(['\n', '\r'], " "))?;
        writeln!(
            out,
            "# amin_step={} front_step={} ares={} beams={} dmin={} dmax={} period_ms={}",
            parts.first_step,
            parts.front_step,
            parts.steps_per_turn,
            parts.last_step - parts.first_step + 1,
            parts.range_min_mm,
            parts.range_max_mm,
            f64::from(parts.period_us) / 1000.0,
        )?;
        writeln!(out, "# invalid: codes as the sensor sent them")?;
        for scan in &self.scans {
            write!(out, "{}", scan.stamp_us)?;
            for range_mm in &scan.ranges_mm {
                write!(out, ",{range_mm}")?;
            }
            writeln!(out)?;
        }
        Ok(())
    }
}

fn read_geometry(comment: &str) -> Result<GeometryParts, Cause> {
    let text = |key: &'static str| {
        comment
            .split_whitespace()
            .find_map(|word| word.strip_prefix(key)?.strip_prefix('='))
            .ok_or(Cause::MissingKey(key))
    };
    let number = |key: &'static str| {
        let text = text(key)?;
        text.parse::<u16>().map_err(|_| Cause::BadValue(key, text.to_owned()))
    };
    let first_step = number("amin_step")?;
    let beams = number("beams")?;
    let period_text = text("period_ms")?;
    let period_ms: f64 =
        period_text.parse().map_err(|_| Cause::BadValue("period_ms", period_text.to_owned()))?;
    let last_step = first_step
        .checked_add(beams)
        .and_then(|end| end.checked_sub(1))
        .filter(|_| beams > 0)
        .ok_or_else(|| Cause::BadValue("beams", beams.to_string()))?;
    let parts = GeometryParts {
        first_step,
        last_step,
        cluster: 1,
        front_step: number("front_step")?,
        steps_per_turn: number("ares")?,
        period_us: (period_ms * 1000.0).round() as u32,
        range_min_mm: number("dmin")?,
        range_max_mm: number("dmax")?,
    };
    Geometry::new(parts).map_err(Cause::Impossible)?;
    Ok(parts)
}

fn read_scan(line: &str, geometry: &GeometryParts) -> Result<RecordedScan, Cause> {
    let expected = usize::from(geometry.last_step - geometry.first_step) + 1;
    let mut fields = line.split(',').map(str::trim);
    let stamp = fields.next().unwrap_or_default();
    let stamp_us = stamp.parse().map_err(|_| Cause::BadField(1, stamp.to_owned()))?;
    let mut ranges_mm = Vec::with_capacity(expected);
    for (column, field) in (2..).zip(fields) {
        let range_mm: u64 = field.parse().map_err(|_| Cause::BadField(column, field.to_owned()))?;
        ranges_mm.push(u16::try_from(range_mm).unwrap_or(NO_RETURN_MM));
    }
    if ranges_mm.len() != expected {
        return Err(Cause::WrongCount { expected, found: ranges_mm.len() });
    }
    Ok(RecordedScan { stamp_us, ranges_mm })
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str =
        "# source=here\n# amin_step=44 front_step=384 ares=1024 beams=3 dmin=20 dmax=5600 period_ms=66.7\n";

    fn read(text: &str) -> Result<Recording, String> {
        Recording::read(text.as_bytes())
            .map_err(|(line, cause)| RecordingError { path: "walk.csv".into(), line, cause }.to_string())
    }

    #[test]
    fn what_is_written_is_read_back() {
        let recording = read(&format!("{HEAD}0,392,392,7\n66700,400,0,70000\n")).unwrap();
        assert_eq!(recording.geometry.period_us, 66_700);
        assert_eq!(recording.geometry.last_step, 46);
        assert_eq!(recording.scans[1].ranges_mm, [400, 0, NO_RETURN_MM]);
        let mut text = Vec::new();
        recording.write(&mut text, "a test").unwrap();
        assert_eq!(read(std::str::from_utf8(&text).unwrap()).unwrap(), recording);
    }

    #[test]
    fn each_defect_is_named_with_its_place() {
        let said = |text: &str| read(text).unwrap_err();
        assert_eq!(said(&format!("{HEAD}0,1,2\n")), "walk.csv:3: 2 values where the geometry says 3");
        assert_eq!(said(&format!("{HEAD}0,1,x,2\n")), "walk.csv:3: field 3 is not a whole number: \"x\"");
        assert_eq!(said(&format!("{HEAD}0,1,-5,2\n")), "walk.csv:3: field 3 is not a whole number: \"-5\"");
        assert_eq!(
            said(&format!("{HEAD}5,1,1,2\n4,1,1,1\n")),
            "walk.csv:4: the stamp is smaller than the one before"
        );
        let week = "604800000005,1,1,1\n";
        assert!(read(&format!("{HEAD}5,1,1,2\n{week}")).is_ok());
        assert_eq!(
            said(&format!("{HEAD}4,1,1,2\n{week}")),
            "walk.csv:4: more than a week behind the first scan; is the stamp in µs?"
        );
        assert_eq!(said(HEAD), "walk.csv: holds no scan");
        assert!(said("0,1,2,3\n").starts_with("walk.csv:1: no comment line"));
        assert_eq!(said(&HEAD.replace("ares=1024 ", "")), "walk.csv:2: the geometry lacks ares=…");
        assert_eq!(said(&HEAD.replace("beams=3", "beams=0")), "walk.csv:2: beams=0 is not a usable number");
        assert_eq!(
            said(&HEAD.replace("ares=1024", "ares=12")),
            "walk.csv:2: impossible geometry: impossible number of steps in a turn"
        );
    }

    #[test]
    fn a_missing_file_is_named() {
        let error = Recording::open(Path::new("/nowhere/walk.csv")).unwrap_err().to_string();
        assert!(error.starts_with("/nowhere/walk.csv: cannot be read: "), "{error}");
    }
}
