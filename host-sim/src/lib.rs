//! Emulated sensors.
