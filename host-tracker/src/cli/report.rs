//! `kehai-tracker report`: what a database says of a day or of some hours, by the hour.

use std::io;
use std::path::PathBuf;

use clap::Args;
use host_tracker::store::StoreError;
use host_tracker::store::figures::{BINS_MAX, Bin, Figures, edges, figures};
use host_tracker::store::raw;
use host_tracker::store::reader::Reader;
use jiff::civil::Date;
use jiff::tz::TimeZone;
use jiff::{Timestamp, ToSpan as _};
use kehai_tracking::snapshot::unix_ms;

use super::failure::Failure;
use super::output::{print, print_json};

/// An hour, ms.
const HOUR_MS: u64 = 3_600_000;

/// Say how many people crossed each line, were in each zone and how long they stayed, hour by hour
///
/// A bin in which nothing was known has no numbers; beside each stands for how long it was unknown.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker report door.db                        the last 24 hours, and the one that has begun
  kehai-tracker report door.db --day 2026-03-14       a day, by this machine's time zone
  kehai-tracker report door.db --hours 168 --csv")]
pub struct Arguments {
    /// From kehai-tracker run --db
    #[arg(value_name = "FILE")]
    db: PathBuf,

    /// A day, by this machine's time zone
    #[arg(long, value_name = "YYYY-MM-DD", conflicts_with = "hours")]
    day: Option<Date>,

    /// The last so many whole hours, and the one that has begun
    #[arg(long, value_name = "N", default_value_t = 24, value_parser = clap::value_parser!(u64).range(1..BINS_MAX))]
    hours: u64,

    /// Print one JSON object
    #[arg(long, conflicts_with = "csv")]
    json: bool,

    /// Print CSV: a row for each line and zone of each hour
    #[arg(long)]
    csv: bool,
}

/// Reports.
///
/// # Errors
/// One line: what cannot be read or written.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let now_ms = unix_ms();
    let (from_ms, to_ms) = match arguments.day {
        Some(day) => span_of(day)?,
        None => (begin_of_last(arguments.hours, now_ms), now_ms),
    };
    let file = &arguments.db;
    let reader = Reader::open_kept(file)?;
    if let Err(error) = raw::forget_expired(file, now_ms) {
        tracing::warn!("raw scans that have expired are not deleted: {error}");
    }
    let found = figures(&reader, &edges((from_ms, to_ms.min(now_ms)), HOUR_MS))
        .map_err(|error| StoreError::Sqlite { file: file.clone(), error })?;
    if arguments.json {
        print_json(&found)
    } else if arguments.csv {
        write_csv(&found)
    } else {
        found.bins.iter().try_for_each(print_bin)
    }
}

/// When the last so many whole hours begin, ms since 1970; the hour that has begun is none of them.
const fn begin_of_last(hours: u64, now_ms: u64) -> u64 {
    (now_ms / HOUR_MS).saturating_sub(hours) * HOUR_MS
}

/// When a day begins and ends here, ms since 1970; it may have 23 or 25 hours.
fn span_of(day: Date) -> Result<(u64, u64), Failure> {
    let begins = |day: Date| -> Result<u64, Failure> {
        let begins = day.to_zoned(TimeZone::system())?.timestamp().as_millisecond();
        Ok(u64::try_from(begins).map_err(|_| format!("{day}: before 1970"))?)
    };
    Ok((begins(day)?, begins(day.checked_add(1.day())?)?))
}

/// By the clocks of a time zone. An hour that they show twice, as summer time ends, has its offset beside it.
fn clock(at_ms: u64, zone: &TimeZone) -> String {
    let at = i64::try_from(at_ms).ok().and_then(|at_ms| Timestamp::from_millisecond(at_ms).ok());
    let Some(at) = at.map(|at| at.to_zoned(zone.clone())) else { return String::new() };
    let is_shown_twice = zone.to_ambiguous_zoned(at.datetime()).is_ambiguous();
    at.strftime(if is_shown_twice { "%Y-%m-%d %H:%M %:z" } else { "%Y-%m-%d %H:%M" }).to_string()
}

fn number(value: Option<impl ToString>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| value.to_string())
}

fn print_bin(bin: &Bin) -> Result<(), Failure> {
    print(clock(bin.from_ms, &TimeZone::system()))?;
    let unknown =
        |unknown_s: f64| if unknown_s < 0.5 { String::new() } else { format!(", unknown {unknown_s:.0} s") };
    for (name, line) in &bin.lines {
        let (inward, outward) = (number(line.inward), number(line.outward));
        print(format_args!("  line {name}: in {inward}, out {outward}{}", unknown(line.unknown_s)))?;
    }
    for (name, zone) in &bin.zones {
        let mean = number(zone.mean.map(|mean| format!("{mean:.1}")));
        let dwell = zone.dwell_s.map_or_else(String::new, |dwell_s| format!(", median {dwell_s:.1} s"));
        let (most, entered, stays) = (number(zone.most), number(zone.entered), number(zone.stays));
        let unknown = unknown(zone.unknown_s);
        print(format_args!(
            "  zone {name}: mean {mean}, most {most}, entered {entered}, stays {stays}{dwell}{unknown}"
        ))?;
    }
    Ok(())
}

fn write_csv(found: &Figures) -> Result<(), Failure> {
    let mut out = csv::Writer::from_writer(io::stdout());
    out.write_record([
        "time",
        "kind",
        "name",
        "in",
        "out",
        "mean",
        "most",
        "stays",
        "dwell_s",
        "unknown_s",
        "entered",
    ])?;
    let text = |value: Option<String>| value.unwrap_or_default();
    let whole = |value: Option<u32>| text(value.map(|value| value.to_string()));
    let real = |value: Option<f64>| text(value.map(|value| format!("{value:.3}")));
    for bin in &found.bins {
        let time = real(Some(bin.from_ms as f64 * 1e-3));
        for (name, line) in &bin.lines {
            let (inward, outward) = (whole(line.inward), whole(line.outward));
            let unknown = real(Some(line.unknown_s));
            out.write_record([&time, "line", name, &inward, &outward, "", "", "", "", &unknown, ""])?;
        }
        for (name, zone) in &bin.zones {
            let (mean, most, stays) = (real(zone.mean), whole(zone.most), whole(zone.stays));
            let (dwell, unknown) = (real(zone.dwell_s), real(Some(zone.unknown_s)));
            let entered = whole(zone.entered);
            let row = [&time, "zone", name, "", "", &mean, &most, &stays, &dwell, &unknown, &entered];
            out.write_record(row)?;
        }
    }
    Ok(out.flush()?)
}

#[cfg(test)]
mod tests {
    use std::ffi::OsStr;

    use clap::Parser as _;

    use super::*;

    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        arguments: Arguments,
    }

    #[test]
    fn raw_scans_that_have_expired_are_deleted_by_a_report_too() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("home.db");
        drop(raw::RawScanWriter::begin(&file, "hall", 1, 2).unwrap());
        let kept = || Reader::open(&file).unwrap().raw(0).unwrap().len();
        assert_eq!(kept(), 1);
        let line = Line::try_parse_from([OsStr::new("report"), file.as_os_str()]).unwrap();
        run(&line.arguments).unwrap();
        assert_eq!(kept(), 0);
    }

    #[test]
    fn an_hour_that_clocks_show_twice_is_told_from_the_other() {
        let berlin = TimeZone::posix("CET-1CEST,M3.5.0,M10.5.0/3").unwrap();
        // 25 October 2026, 0:00 UTC.
        let first_ms = 1_792_886_400_000;
        let hours = [0, 1, 2].map(|hour| clock(first_ms + hour * HOUR_MS, &berlin));
        assert_eq!(hours, ["2026-10-25 02:00 +02:00", "2026-10-25 02:00 +01:00", "2026-10-25 03:00"]);
    }

    #[test]
    fn the_hour_that_has_begun_is_shown_beside_so_many_whole_ones() {
        for past_ms in [0, 1, HOUR_MS - 1] {
            let now_ms = 500 * HOUR_MS + past_ms;
            assert_eq!(begin_of_last(24, now_ms), 476 * HOUR_MS, "{past_ms}");
        }
        let asked = |hours: u64| {
            let line = format!("report home.db --hours {hours}");
            Line::try_parse_from(line.split(' ')).map(|line| line.arguments.hours)
        };
        assert!(asked(BINS_MAX).is_err(), "with the one that has begun it is one too many");
        let (most, now_ms) = (asked(BINS_MAX - 1).unwrap(), 5000 * HOUR_MS + 1);
        let bins = edges((begin_of_last(most, now_ms), now_ms), HOUR_MS);
        assert_eq!(bins.last(), Some(&now_ms), "the most that may be asked for, up to now");
        assert_eq!(begin_of_last(24, HOUR_MS), 0);
    }
}
