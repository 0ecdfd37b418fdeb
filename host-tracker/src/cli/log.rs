//! The log on stderr: what happens while a command runs. Its own output and its final error are no log.
//!
//! ```text
//!   2026-11-22T18:51:02.123456Z  WARN the tracker: database: disk full
//! ```

use std::io::{self, Write, stderr};

use kehai_tracking::text::printable;
use tracing::Metadata;
use tracing_subscriber::filter::{LevelFilter, filter_fn};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;
use tracing_subscriber::{Layer, fmt};

/// Standard error, whether or not it has a reader. A line that cannot be written is lost; the daemon goes on. A text that
/// came over the network stays within its line.
struct Forgetful;

impl Write for Forgetful {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        // The logger reports a failure with `eprintln!`, which would panic for the same reason.
        say(one_line(bytes));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let _ = stderr().flush();
        Ok(())
    }
}

/// An event of the log, which comes whole, without the line's end.
fn one_line(event: &[u8]) -> String {
    let text = String::from_utf8_lossy(event);
    printable(text.strip_suffix('\n').unwrap_or(&text))
}

/// Where the targets of this program's own events begin.
const OURS: [&str; 2] = ["kehai", "host_tracker"];

/// Logs from now on what is at least as grave as `level`; what libraries say, from `debug` on.
pub(super) fn start(level: LevelFilter) {
    let is_said = move |event: &Metadata<'_>| {
        level >= LevelFilter::DEBUG || OURS.iter().any(|own| event.target().starts_with(own))
    };
    // Whether there are colours is not for a library to switch on.
    let lines = fmt::layer().with_target(false).with_ansi(false).with_writer(|| Forgetful);
    tracing_subscriber::registry().with(level).with(lines.with_filter(filter_fn(is_said))).init();
}

/// A line that is no log: a command's result in words, or why it failed. Without a reader it is lost.
pub(super) fn say(line: impl std::fmt::Display) {
    let _ = writeln!(stderr(), "{line}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f12_an_event_is_one_line_whatever_it_says() {
        assert_eq!(one_line(b" WARN hall: over\n"), " WARN hall: over");
        assert_eq!(
            one_line(b"why\n WARN door: forged\x1b[2J\xff\n"),
            "why\u{fffd} WARN door: forged\u{fffd}[2J\u{fffd}"
        );
    }
}
