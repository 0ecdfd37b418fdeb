//! How long a sensor may be silent, and what follows.
//!
//! ```text
//!   no reply      0.25 s and its bytes on the line ─▶ asked again, or the start begins anew
//!   no scan       5 intervals ─▶ Stalled    at least 0.6 s ─▶ asked to go on    10 intervals ─▶ the alarm `no_scans`
//!   only damaged ones   30 s ─▶ started anew
//! ```
//!
//! When it is reset or rebooted: `cures`. The tracker's own alarm about a silent sensor is in
//! `tracking/src/session/health/alarms.rs`.

/// Time to wait for a reply, beside that of its bytes on the line: sensors answer on the rhythm of
/// their mirror, 100 ms the slowest, and two of its turns may pass.
pub const REPLY_US: u64 = 250_000;

/// Longest wait for a reply while scans come in front of it.
pub const BACKLOG_US: u64 = 4_000_000;

/// Intervals without a scan after which the stream counts as stalled: more than the longest stalls
/// seen in recordings at 10 Hz (390 ms).
pub const STALL_INTERVALS: u64 = 5;

/// Least time without a scan before the stream is asked to go on: what is held back for less arrives yet.
pub const RESUME_US: u64 = 600_000;

/// Intervals without a scan that raise the alarm `no_scans`: the stream had stalled, and was asked to go on.
pub const NO_SCAN_INTERVALS: u64 = 10;

/// Longest time in which only damaged scans come.
pub const DAMAGED_US: u64 = 30_000_000;

/// Time a sensor may verify an error.
pub const VERIFY_US: u64 = 10_000_000;
