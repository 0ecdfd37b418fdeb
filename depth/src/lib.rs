//! People in incomplete depth images, and a depth camera as an ordinary kehai device.
//!
//! ```text
//!   frames ─▶ background ─▶ foreground ─┬─▶ clusters ─▶ segments (place, volume, top)     `kehai-depth look`
//!  (source)                             └─▶ fan: one range a bearing ─▶ SCIP ─▶ device    `kehai-depth`
//! ```
//!
//! The fan is measured by an emulated range finder, so that background, candidates, clock, session and report are
//! the firmware's own, and a host needs to know nothing about depth.
//!
//! After Ukyo, Hiromori, Yamaguchi and Higashino, Osaka University: pedestrians in incomplete point clouds.
#![cfg(not(target_os = "none"))]
#![forbid(unsafe_code)]

pub mod background;
mod bearings;
pub mod camera;
pub mod cluster;
pub mod device;
mod ends;
pub mod fan;
pub mod foreground;
pub mod frame;
pub mod reach;
pub mod segment;
pub mod sizes;
pub mod source;

#[cfg(test)]
mod golden;
#[cfg(test)]
mod standing;
