//! The log on stderr: what happens while a command runs. Its own output and its final error are no log.
//!
//! ```text
//!   2026-11-22T18:51:02.123456Z  WARN the tracker: database: disk full
//! ```

use std::io::{self, Write, stderr};

use tracing_subscriber::filter::LevelFilter;

/// Standard error, whether or not it has a reader. A line that cannot be written is lost; the daemon goes on.
struct Forgetful;

impl Write for Forgetful {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        // The logger reports a failure with `eprintln!`, which would panic for the same reason.
        let _ = stderr().write_all(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let _ = stderr().flush();
        Ok(())
    }
}

/// Logs from now on what is at least as grave as `level`.
pub(super) fn start(level: LevelFilter) {
    tracing_subscriber::fmt().with_max_level(level).with_target(false).with_writer(|| Forgetful).init();
}

/// A line that is no log: a command's result in words, or why it failed. Without a reader it is lost.
pub(super) fn say(line: impl std::fmt::Display) {
    let _ = writeln!(stderr(), "{line}");
}
