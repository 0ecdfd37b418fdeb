//! The log on stderr: what happens while a command runs. Its own output and its final error are no log.
//!
//! ```text
//!   2026-11-22T18:51:02.123456Z  WARN module hall cannot be announced: permission denied
//! ```

use std::io::stderr;

use tracing_subscriber::filter::LevelFilter;

/// Logs from now on what is at least as grave as `level`.
pub(super) fn start(level: LevelFilter) {
    tracing_subscriber::fmt()
        .with_max_level(level)
        .with_target(false)
        .with_ansi(false)
        .with_writer(stderr)
        .init();
}
