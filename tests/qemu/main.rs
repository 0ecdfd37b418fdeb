//! The real firmware image, run in QEMU. Nothing else of the core's tests starts a machine.
//!
//! ```text
//!   UdpSensor ══ serial line ══▶ image in QEMU ══ network ══▶ host       a range finder; a SensFloor: floor.rs
//! ```

mod floor;
mod image;
mod network_faults;
mod power_cuts;
mod recording;
mod sealed;
mod segment;
mod sensor_faults;
mod settings;
mod start;
mod support;
mod update;
