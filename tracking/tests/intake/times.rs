//! Times of the simulated world, µs.

pub const SECOND_US: u64 = 1_000_000;

/// Between two scans of a module.
pub const SCAN_US: u64 = 100_000;

/// Longest that a datagram is on its way when nothing holds it up.
pub const WAY_US: u64 = 5_000;
