//! The tracker's daemon: sockets, the live map, MQTT, the database and recordings around `kehai-tracking`.
//!
//! ```text
//! UDP ─▶ net ─▶ kehai_tracking ─▶ Arc<Snapshot> ─▶ web · mqtt · store · record · metrics
//! ```
#![forbid(unsafe_code)]

pub mod access;
pub mod alarm_handle;
pub mod area_losses;
pub mod areas;
pub mod backup;
pub mod calibration;
pub mod certificate;
pub mod clock;
pub mod connections;
pub mod daemon;
pub mod doctor;
pub mod doors;
pub mod firmware;
pub mod http_agent;
pub mod key_file;
pub mod label_flash;
pub mod links;
pub mod log_limit;
pub mod map;
pub mod metrics;
pub mod module;
pub mod module_id;
pub mod mqtt;
mod named;
pub mod net;
pub mod output_file;
pub mod owned_file;
pub mod picture;
pub mod questions;
pub mod record;
pub mod reports;
pub mod ros2;
pub mod scans;
pub mod service;
pub mod shared_count;
pub mod signs;
pub mod site_file;
pub mod store;
pub mod supervise;
pub mod tracker_alarms;
mod type_schema;
pub mod viewer;
pub mod web;
pub mod webhook;
