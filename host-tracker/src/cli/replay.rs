//! `kehai-tracker replay`: follows a recording again.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use host_tracker::output_file;
use host_tracker::record::replay::{ReplayError, replay};
use kehai_tracking::jsonl::write_line;

use super::failure::Failure;
use super::log::say;

/// Slowest replay: slower ones would wait for times that no clock has.
const SLOWEST: f64 = 0.001;

/// Follow a recording again, and compare with what was found then
///
/// The same datagrams go into the same tracker at the same times. Exit status 0: every line is, byte for byte, what it
/// was; 1: something differs, or the file cannot be read.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker replay evening.mcap
  kehai-tracker replay evening.mcap --tracks-out - --speed 10")]
pub struct Arguments {
    /// From kehai-tracker run --record
    #[arg(value_name = "FILE.mcap")]
    file: PathBuf,

    /// Write tracks and zones, a JSON line every 0.1 s; - is the terminal. What is there of an earlier run or replay is kept
    /// beside, with its time in the name
    #[arg(long, value_name = "FILE")]
    tracks_out: Option<PathBuf>,

    /// Times as fast as life, 0.001 or more; without it, as fast as it can be done
    #[arg(long, value_name = "N", value_parser = speed)]
    speed: Option<f64>,
}

/// Replays.
///
/// # Errors
/// One line: the file cannot be read, or the lines differ.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut out: Option<Box<dyn Write>> = match arguments.tracks_out.as_deref() {
        None => None,
        Some(file) if file.as_os_str() == "-" => Some(Box::new(io::stdout())),
        Some(file) => {
            let begun = output_file::begin(file).map_err(|error| format!("{}: {error}", file.display()))?;
            Some(Box::new(BufWriter::new(begun)))
        }
    };
    let begun = Instant::now();
    let outcome = replay(&arguments.file, |at_us, line| {
        if let Some(speed) = arguments.speed {
            let due = Duration::from_secs_f64(at_us as f64 * 1e-6 / speed);
            std::thread::sleep(due.saturating_sub(begun.elapsed()));
        }
        out.as_mut().map_or(Ok(()), |out| write_line(out, line))
    });
    let outcome = outcome.map_err(|error| match error {
        ReplayError::Output(error) => of_output(error, arguments.tracks_out.as_deref()),
        ReplayError::Recording(error) => error.into(),
    })?;
    if let Some(out) = &mut out {
        out.flush().map_err(|error| of_output(error, arguments.tracks_out.as_deref()))?;
    }
    say(format_args!("{} datagrams, {} lines", outcome.datagrams, outcome.lines));
    say(format_args!("recorded sha256 {}", outcome.recorded));
    say(format_args!("replayed sha256 {}", outcome.replayed));
    if let Some(why) = &outcome.cut_off {
        say(format_args!("the file ends early: {why}"));
    }
    if outcome.lost > 0 {
        say(format_args!(
            "{} messages are missing, as the disk was full or too slow: what follows them may differ",
            outcome.lost
        ));
    }
    if outcome.different > 0 {
        return Err(format!("{}: {} lines differ", arguments.file.display(), outcome.different).into());
    }
    say("identical");
    Ok(())
}

/// Why lines cannot be written, with the file. That a reader has had enough is told as it is: it is no failure.
fn of_output(error: io::Error, file: Option<&Path>) -> Failure {
    match file {
        Some(file) if error.kind() != io::ErrorKind::BrokenPipe => {
            format!("{}: {error}", file.display()).into()
        }
        _ => error.into(),
    }
}

fn speed(text: &str) -> Result<f64, String> {
    let speed: f64 = text.parse().map_err(|error| format!("{error}"))?;
    if speed.is_finite() && speed >= SLOWEST { Ok(speed) } else { Err("must be 0.001 or more".to_owned()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_every_speed_the_last_time_that_a_recording_can_have_is_one_that_can_be_waited_for() {
        assert_eq!(speed("10"), Ok(10.0));
        for wrong in ["0", "-1", "1e-30", "nan", "inf", "fast"] {
            assert!(speed(wrong).is_err(), "{wrong}");
        }
        assert!(Duration::try_from_secs_f64(u64::MAX as f64 * 1e-6 / speed("0.001").unwrap()).is_ok());
    }
}
