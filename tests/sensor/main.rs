//! Driver and session against an emulated sensor, on virtual time: found, read, timed, and found again.

mod driver_and_sensor;
mod recovery;
mod session;
mod startup;
mod time;
