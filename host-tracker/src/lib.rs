//! Host tracker.
