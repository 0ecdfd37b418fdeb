//! How the sensor is, and what was counted: everything a report of health needs to know.

use crate::scan::GeometryError;
use crate::scip::Status;

/// How the sensor is.
///
/// ```text
///   Searching ─▶ Starting ─▶ Streaming ⇄ Stalled ─▶ Searching
///        ▲ ▲          │
///        │ Booting ◀──┤ Abnormal: rebooted            a sensor that cannot be used is
///        └────────────┴ TooLarge, Unusable, Refused    asked again every few seconds
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SensorState {
    /// No answer yet, at any rate.
    Searching,
    /// It answers that it is not ready, or is being rebooted.
    Booting,
    /// Found, and being set up.
    Starting,
    /// Scans come.
    Streaming,
    /// Scans came and do not any more; it is being asked to go on.
    Stalled,
    /// It reports a fault of its own; it is being rebooted.
    Abnormal,
    /// Its scans have more beams than there is memory for.
    TooLarge {
        /// Beams of a scan.
        beams: u16,
        /// Beams there is memory for.
        capacity: u16,
    },
    /// Its parameters, with the settings, describe no scan.
    Unusable(GeometryError),
    /// It refuses to measure, with this status.
    Refused(Status),
    /// Its stream was stopped on purpose.
    Paused,
}

/// What happened since the start. Counters stop at their largest value.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SensorCounters {
    /// Scans handed on.
    pub scans_accepted: u32,
    /// Scans missing between those, by the sensor's stamps: damaged on the way, or left out by a
    /// sensor whose line is too slow. [`Losses`](crate::scip::Losses) counts the causes that were observed.
    pub scans_missing: u32,
    /// Scans with the stamp of the one before; not handed on.
    pub scans_repeated: u32,
    /// Scans the sensor itself left out as unstable (status 0M).
    pub scans_unstable: u32,
    /// Times the stream fell silent.
    pub stalls: u32,
    /// Times the stream was asked to go on without a full start.
    pub resumes: u32,
    /// Times a sensor was found and set up.
    pub starts: u32,
    /// Times the sensor's counter started anew.
    pub clock_restarts: u32,
    /// Resets and reboots of the sensor.
    pub reboots: u32,
    /// Times the speed of the line was raised.
    pub baud_changes: u32,
    /// Requests the sensor refused.
    pub refusals: u32,
    /// Requests without an answer in time.
    pub timeouts: u32,
    /// Reads that failed or found the end of file, and writes that failed or hung.
    pub link_failures: u32,
}

/// Adds to a counter that stops at its largest value.
pub(super) fn count(counter: &mut u32, more: u32) {
    *counter = counter.saturating_add(more);
}
