//! ROS 2 without ROS: people, zones, modules and scans, as a node with rmw_zenoh publishes them.
//!
//! ```text
//!   snapshots ─▶ thread "ros2" ─┬─ <domain>/people/people_msgs::msg::dds_::People_/RIHS01_…     CDR, ten times a second
//!   site      ─▶                ├─ …/kehai/markers/…   …/diagnostics/…
//!   scans     ─▶                ├─ …/kehai/MODULE/scan/…       while a node subscribes
//!                               ├─ …/tf_static/…               also to those who come later
//!                               ╰─ @ros2_lv/<domain>/…         liveliness tokens: the node and its publishers
//! ```
//!
//! Nothing is published that would say that a place is empty where that is not known (docs/ros2.md).
//!
//! Source: rmw_zenoh, `docs/design.md` and `rmw_zenoh_cpp/src/detail`; REP-2011 and REP-2016 (type hashes); REP-103, REP-105.
//!
//! | file | what |
//! |---|---|
//! | `settings` | the domain, and how Zenoh is reached |
//! | `names` | keys, liveliness tokens, names of topics and frames |
//! | `qos` | quality of service, as tokens have it |
//! | `describe` | what a type of ROS is made of, and its hash |
//! | `messages` | the messages, field by field |
//! | `encode` | a message and its attachment, in bytes |
//! | `people`, `markers`, `transforms`, `diagnostics`, `scan` | from what is known to a message |
//! | `publisher` | one topic |
//! | `publish` | the thread |

#[cfg(feature = "zenoh")]
mod describe;
#[cfg(feature = "zenoh")]
mod diagnostics;
#[cfg(feature = "zenoh")]
mod encode;
#[cfg(feature = "zenoh")]
mod markers;
#[cfg(feature = "zenoh")]
mod messages;
#[cfg(feature = "zenoh")]
mod names;
#[cfg(feature = "zenoh")]
mod people;
#[cfg(feature = "zenoh")]
mod publish;
#[cfg(feature = "zenoh")]
mod publisher;
#[cfg(feature = "zenoh")]
mod qos;
#[cfg(feature = "zenoh")]
mod scan;
mod settings;
#[cfg(feature = "zenoh")]
mod transforms;

#[cfg(feature = "zenoh")]
pub use publish::{Inputs, Ros2};
pub use settings::Ros2Settings;
