//! Recorded frames of a SensFloor: a plain CSV that any tool can read, written and read here.
//!
//! ```text
//! stamp_us,group,x,y,0,1,2,3,4,5,6,7         the first line: the names of the columns, in any order
//! 5137104,10,6,4,127,122,120,132,135,130,131,128
//! ```
//!
//! A line is a frame (`kehai::floor::sensfloor`): when it came, its tile, the value of each triangle. Instead of `stamp_us`
//! there may be `timestamp`, in ns, and instead of `group` `group_id`, as sensfloor-pipeline writes them. Other columns are
//! passed over; lines that begin with # too.

use std::fmt;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

use kehai::floor::sensfloor::{Frame, TRIANGLES};

use super::LONGEST_US;

/// A frame and when it came, µs.
pub type StampedFrame = (u64, Frame);

/// A recording of a floor.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct FloorRecording {
    /// Its frames in the order in which they came.
    pub frames: Vec<StampedFrame>,
}

/// A recording that cannot be used: which file, which line, and why.
#[derive(Debug)]
pub struct FloorRecordingError {
    path: PathBuf,
    line: Option<usize>,
    cause: Cause,
}

#[derive(Debug)]
enum Cause {
    Unreadable(io::Error),
    MissingColumn(&'static str),
    WrongCount { expected: usize, found: usize },
    BadField { column: &'static str, text: String, most: u64 },
    TimeRunsBack,
    TooLong,
    Empty,
}

/// Largest stamp: whatever is added to it up to [`LONGEST_US`] is a number still.
const STAMP_MAX: u64 = i64::MAX as u64;

impl fmt::Display for FloorRecordingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        f.write_str(": ")?;
        match &self.cause {
            Cause::Unreadable(error) => write!(f, "cannot be read: {error}"),
            Cause::MissingColumn(name) => write!(
                f,
                "the first line names no column {name}: a recording of a floor begins with stamp_us,group,x,y,0,1,2,3,4,5,6,7"
            ),
            Cause::WrongCount { expected, found } => {
                write!(f, "{found} fields where the first line names {expected}")
            }
            Cause::BadField { column, text, most } => {
                write!(f, "{column} is no whole number from 0 to {most}: {text:?}")
            }
            Cause::TimeRunsBack => f.write_str("the stamp is smaller than the one before"),
            Cause::TooLong => f.write_str("more than a week behind the first frame; is stamp_us in µs?"),
            Cause::Empty => f.write_str("holds no frame"),
        }
    }
}

impl std::error::Error for FloorRecordingError {}

/// Where each field stands in a line.
struct Columns {
    count: usize,
    stamp: usize,
    /// Units of the stamp in a µs.
    per_us: u64,
    group: usize,
    tile: [usize; 2],
    values: [usize; TRIANGLES],
}

const VALUES: [&str; TRIANGLES] = ["0", "1", "2", "3", "4", "5", "6", "7"];

impl Columns {
    fn of(line: &str) -> Result<Self, Cause> {
        let names: Vec<&str> = line.split(',').map(str::trim).collect();
        let place = |name: &str| names.iter().position(|other| *other == name);
        let needs = |name| place(name).ok_or(Cause::MissingColumn(name));
        let (stamp, per_us) = match (place("stamp_us"), place("timestamp")) {
            (Some(stamp), _) => (stamp, 1),
            (None, Some(stamp)) => (stamp, 1000),
            (None, None) => return Err(Cause::MissingColumn("stamp_us")),
        };
        let group = place("group").or_else(|| place("group_id")).ok_or(Cause::MissingColumn("group"))?;
        let mut values = [0; TRIANGLES];
        for (value, name) in values.iter_mut().zip(VALUES) {
            *value = needs(name)?;
        }
        Ok(Self { count: names.len(), stamp, per_us, group, tile: [needs("x")?, needs("y")?], values })
    }

    fn frame(&self, line: &str) -> Result<StampedFrame, Cause> {
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        if fields.len() != self.count {
            return Err(Cause::WrongCount { expected: self.count, found: fields.len() });
        }
        let number = |column, place: usize, most: u64| {
            let text = fields.get(place).copied().unwrap_or_default();
            let bad = || Cause::BadField { column, text: text.to_owned(), most };
            text.parse::<u64>().ok().filter(|number| *number <= most).ok_or_else(bad)
        };
        let byte = |column, place| number(column, place, 255).map(|number| number as u8);
        let stamp = number("the stamp", self.stamp, STAMP_MAX)?;
        let group = number("group", self.group, u16::MAX.into())? as u16;
        let tile = (byte("x", self.tile[0])?, byte("y", self.tile[1])?);
        let mut values = [0; TRIANGLES];
        for ((value, place), name) in values.iter_mut().zip(self.values).zip(VALUES) {
            *value = byte(name, place)?;
        }
        Ok((stamp / self.per_us, Frame { group, tile, values }))
    }
}

impl FloorRecording {
    /// Reads a recording.
    ///
    /// # Errors
    /// One line with the file, the line and the cause; nothing is repaired silently.
    pub fn open(path: &Path) -> Result<Self, FloorRecordingError> {
        let fail = |line, cause| FloorRecordingError { path: path.to_owned(), line, cause };
        let file = File::open(path).map_err(|error| fail(None, Cause::Unreadable(error)))?;
        Self::read(BufReader::new(file)).map_err(|(line, cause)| fail(line, cause))
    }

    fn read(lines: impl BufRead) -> Result<Self, (Option<usize>, Cause)> {
        let mut columns = None;
        let mut frames: Vec<StampedFrame> = Vec::new();
        for (number, line) in (1..).zip(lines.lines()) {
            let line = line.map_err(|error| (Some(number), Cause::Unreadable(error)))?;
            let line = line.trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let at = |cause| (Some(number), cause);
            match &columns {
                None => columns = Some(Columns::of(line).map_err(at)?),
                Some(columns) => {
                    let frame = columns.frame(line).map_err(at)?;
                    if frames.last().is_some_and(|last| frame.0 < last.0) {
                        return Err(at(Cause::TimeRunsBack));
                    }
                    if frames.first().is_some_and(|first| frame.0 - first.0 > LONGEST_US) {
                        return Err(at(Cause::TooLong));
                    }
                    frames.push(frame);
                }
            }
        }
        if frames.is_empty() { Err((None, Cause::Empty)) } else { Ok(Self { frames }) }
    }

    /// Writes it.
    ///
    /// # Errors
    /// What `to` says.
    pub fn write(&self, mut to: impl Write) -> io::Result<()> {
        writeln!(to, "stamp_us,group,x,y,{}", VALUES.join(","))?;
        for (stamp_us, Frame { group, tile: (x, y), values }) in &self.frames {
            let values: Vec<String> = values.iter().map(u8::to_string).collect();
            writeln!(to, "{stamp_us},{group},{x},{y},{}", values.join(","))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "stamp_us,group,x,y,0,1,2,3,4,5,6,7\n5,10,6,4,127,122,120,132,135,130,131,128\n";

    fn read(text: &str) -> Result<FloorRecording, String> {
        let fail = |(line, cause)| FloorRecordingError { path: "walk.csv".into(), line, cause }.to_string();
        FloorRecording::read(text.as_bytes()).map_err(fail)
    }

    #[test]
    fn a_recording_reads_as_it_was_written_in_any_order_of_columns() {
        let good = read(GOOD).unwrap();
        let frame = Frame { group: 10, tile: (6, 4), values: [127, 122, 120, 132, 135, 130, 131, 128] };
        assert_eq!(good.frames, [(5, frame)]);
        let mut written = Vec::new();
        good.write(&mut written).unwrap();
        assert_eq!(written, GOOD.as_bytes());
        let other = "timestamp,frame_number,group_id,magic_number,x,y,0,1,2,3,4,5,6,7\n\
                     5137,55,10,23,6,4,127,122,120,132,135,130,131,128\n";
        assert_eq!(read(other).unwrap(), good);
    }

    #[test]
    fn what_cannot_be_used_is_one_line_that_says_where_and_why() {
        let row = GOOD.lines().nth(1).unwrap();
        for (text, wanted) in [
            (String::new(), "walk.csv: holds no frame"),
            (GOOD.lines().next().unwrap().to_owned(), "walk.csv: holds no frame"),
            (row.to_owned(), "walk.csv:1: the first line names no column stamp_us"),
            (GOOD.replace(",7\n", "\n"), "walk.csv:1: the first line names no column 7"),
            (GOOD.replace(",128\n", "\n"), "walk.csv:2: 11 fields where the first line names 12"),
            (GOOD.replace("132", "256"), "walk.csv:2: 3 is no whole number from 0 to 255: \"256\""),
            (GOOD.replace("5,10,", "5,-1,"), "walk.csv:2: group is no whole number from 0 to 65535: \"-1\""),
            (
                format!("{GOOD}604800000006{}", &row[1..]),
                "walk.csv:3: more than a week behind the first frame",
            ),
            (format!("{GOOD}4{}", &row[1..]), "walk.csv:3: the stamp is smaller than the one before"),
            (GOOD.replace("\n5,10", "\n18446744073709551615,10"), "walk.csv:2: the stamp is no whole number"),
        ] {
            let said = read(&text).unwrap_err();
            assert!(said.starts_with(wanted) && !said.contains('\n'), "{said}");
        }
    }
}
