//! A line of a full table, and the digest of every run: the files beside the pages.
//!
//! ```text
//! TABLE.csv         commit,row,tracker,first_seed,last_seed,runs,figure,value,low,high,of,printed
//!                   c84fdb3,"door area, H, 7",kehai,10000,10199,200,IDF1,0.912,,,,0.912      a figure a line
//!
//! TABLE-seeds.csv   commit,row,tracker,first_seed,digests
//!                   c84fdb3,"door area, H, 7",kehai,10000,1f0a 77b2 …                         16 bits a seed
//! ```
//!
//! A digest is of every figure of a run. A run that comes out otherwise keeps its digest with a probability of 2⁻¹⁶.

use std::collections::BTreeMap;
use std::error::Error;
use std::io::{Read, Write};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::score::statistics::{Interval, wilson};

/// Name of the figure by which a run of the door area succeeds.
pub const COUNTED_RIGHT: &str = "counted right, % of runs";

/// One figure of one row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// The commit that printed it.
    pub commit: String,
    /// The run: the scene with its condition and number of people, or the rule.
    pub row: String,
    /// The tracker, or the source of a pose.
    pub tracker: String,
    /// The first seed.
    pub first_seed: u64,
    /// The last seed.
    pub last_seed: u64,
    /// How many runs.
    pub runs: u64,
    /// Name of the figure, with its unit.
    pub figure: String,
    /// Its value; None where nothing can be said.
    pub value: Option<f64>,
    /// Lower end of its interval at 95 %, where it has one.
    pub low: Option<f64>,
    /// Upper end.
    pub high: Option<f64>,
    /// Of how many cases it is a share, or values the mean.
    pub of: Option<u64>,
    /// As it stands on the page.
    pub printed: String,
}

/// Fields common to all figures of a row.
#[derive(Clone, Debug, Default)]
pub(super) struct Heading {
    pub row: String,
    pub tracker: String,
    pub seeds: (u64, u64),
    pub runs: u64,
}

impl Heading {
    /// The line of one figure. Values are kept with six digits.
    pub(super) fn line(&self, figure: &str, value: Option<f64>, printed: String) -> Line {
        Line {
            commit: String::new(),
            row: self.row.clone(),
            tracker: self.tracker.clone(),
            first_seed: self.seeds.0,
            last_seed: self.seeds.1,
            runs: self.runs,
            figure: figure.to_owned(),
            value: value.and_then(six_digits),
            low: None,
            high: None,
            of: None,
            printed,
        }
    }

    /// The line of a share of cases, in %.
    pub(super) fn share(&self, figure: &str, yes: u64, of: u64) -> Line {
        let Interval { low, high } = wilson(yes, of);
        let share = 100.0 * yes as f64 / of.max(1) as f64;
        let interval = (six_digits(100.0 * low), six_digits(100.0 * high));
        Line {
            low: interval.0,
            high: interval.1,
            of: Some(of),
            ..self.line(figure, Some(share), percent(yes, of))
        }
    }
}

/// The value with six digits, where it is finite.
pub(super) fn six_digits(value: f64) -> Option<f64> {
    format!("{value:.5e}").parse().ok().filter(|value: &f64| value.is_finite())
}

/// `98.5 [96–99]`, without decimals where there are none.
pub(super) fn percent(successes: u64, runs: u64) -> String {
    let Interval { low, high } = wilson(successes, runs);
    let short = |share: f64| {
        let text = format!("{:.1}", share * 100.0);
        text.strip_suffix(".0").map(str::to_owned).unwrap_or(text)
    };
    let rate = successes as f64 / runs.max(1) as f64;
    format!("{} [{:.0}–{:.0}]", short(rate), low * 100.0, high * 100.0)
}

/// What one run gave: a row has one of each seed and tracker, or several, which are taken together.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// The row.
    pub row: String,
    /// The tracker.
    pub tracker: String,
    /// The seed.
    pub seed: u64,
    /// Every figure of the run.
    pub figures: String,
}

/// `name value` of every figure, values with six digits.
pub(super) fn text<'a>(figures: impl Iterator<Item = (&'a str, Option<f64>)>) -> String {
    let word = |(name, value): (&str, Option<f64>)| match value.and_then(six_digits) {
        Some(value) => format!("{name} {value}\n"),
        None => format!("{name} none\n"),
    };
    figures.map(word).collect()
}

/// The digests of a row's runs, seed after seed from the first one on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Digests {
    /// The commit that printed them.
    pub commit: String,
    /// The row.
    pub row: String,
    /// The tracker.
    pub tracker: String,
    /// The seed of the first digest.
    pub first_seed: u64,
    /// One a seed, in hexadecimal.
    pub digests: String,
}

/// Row and tracker, and of every seed the digest.
pub type ByRow = BTreeMap<(String, String), BTreeMap<u64, u16>>;

/// The digests of these runs.
#[must_use]
pub fn digests(runs: &[Run]) -> ByRow {
    let mut hashers: BTreeMap<_, BTreeMap<u64, crc32fast::Hasher>> = BTreeMap::new();
    for run in runs {
        let row = hashers.entry((run.row.clone(), run.tracker.clone())).or_default();
        row.entry(run.seed).or_default().update(run.figures.as_bytes());
    }
    // The lower half of a CRC-32 is spread as evenly as all of it.
    let digest = |(seed, hasher): (u64, crc32fast::Hasher)| (seed, hasher.finalize() as u16);
    hashers.into_iter().map(|(row, seeds)| (row, seeds.into_iter().map(digest).collect())).collect()
}

/// As they are written.
#[must_use]
pub fn written(rows: &ByRow, commit: &str) -> Vec<Digests> {
    let row = |((row, tracker), seeds): (&(String, String), &BTreeMap<u64, u16>)| Digests {
        commit: commit.to_owned(),
        row: row.clone(),
        tracker: tracker.clone(),
        first_seed: seeds.keys().next().copied().unwrap_or(0),
        digests: seeds.values().map(|digest| format!("{digest:04x}")).collect::<Vec<_>>().join(" "),
    };
    rows.iter().map(row).collect()
}

/// As they were before [`written`].
///
/// # Errors
/// A digest that is none.
pub fn parsed(rows: &[Digests]) -> Result<ByRow, String> {
    let row = |row: &Digests| {
        let words = row.digests.split_whitespace().zip(row.first_seed..);
        let digest = |(word, seed)| {
            let digest = u16::from_str_radix(word, 16);
            Ok((seed, digest.map_err(|_| format!("{}, seed {seed}: \"{word}\" is no digest", row.row))?))
        };
        Ok(((row.row.clone(), row.tracker.clone()), words.map(digest).collect::<Result<_, String>>()?))
    };
    rows.iter().map(row).collect()
}

/// Writes lines or digests as CSV.
///
/// # Errors
/// The error of the writer.
pub fn write<T: Serialize>(rows: &[T], out: impl Write) -> Result<(), Box<dyn Error>> {
    let mut writer = csv::Writer::from_writer(out);
    rows.iter().try_for_each(|row| writer.serialize(row))?;
    Ok(writer.flush()?)
}

/// Reads what [`write()`] wrote.
///
/// # Errors
/// Where and why a line is none.
pub fn read<T: DeserializeOwned>(from: impl Read) -> Result<Vec<T>, Box<dyn Error>> {
    Ok(csv::Reader::from_reader(from).deserialize().collect::<Result<_, _>>()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(seed: u64, value: f64) -> Run {
        let figures = text([("IDF1", Some(value)), ("GOSPA", None)].into_iter());
        Run { row: "door area, H, 7".into(), tracker: "kehai".into(), seed, figures }
    }

    #[test]
    fn lines_survive_csv() {
        let heading = Heading { row: "hall, 3".into(), tracker: "a,b".into(), seeds: (3, 9), runs: 7 };
        let lines = vec![
            heading.share("right, %", 5, 7),
            heading.line("error", Some(1.0 / 3.0), "0.3".into()),
            heading.line("none", None, "–".into()),
        ];
        let mut file = Vec::new();
        write(&lines, &mut file).unwrap();
        assert_eq!(read::<Line>(file.as_slice()).unwrap(), lines);
        assert_eq!((lines[1].value, lines[0].printed.as_str()), (Some(0.333333), "71.4 [36–92]"));
        assert!(read::<Line>(&b"row,tracker\nhall,x\n"[..]).is_err());
    }

    #[test]
    fn a_digest_changes_with_any_figure_of_its_run_and_no_other() {
        let before = digests(&[run(5, 0.91234), run(6, 0.5)]);
        let after = digests(&[run(5, 0.91235), run(6, 0.5)]);
        let (before, after) = (before.values().next().unwrap(), after.values().next().unwrap());
        assert_ne!(before[&5], after[&5]);
        assert_eq!(before[&6], after[&6]);
    }

    #[test]
    fn digests_survive_their_file() {
        let rows = digests(&(5..9).map(|seed| run(seed, seed as f64)).collect::<Vec<_>>());
        let mut file = Vec::new();
        write(&written(&rows, "abc"), &mut file).unwrap();
        let mut read: Vec<Digests> = read(file.as_slice()).unwrap();
        assert_eq!((read.len(), read[0].first_seed, parsed(&read).unwrap()), (1, 5, rows));
        read[0].digests.push_str(" no");
        assert_eq!(parsed(&read).unwrap_err(), "door area, H, 7, seed 9: \"no\" is no digest");
    }
}
