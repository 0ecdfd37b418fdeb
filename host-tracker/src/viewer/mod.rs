//! What Foxglove and Lichtblick show: in a recording, and live.
//!
//! ```text
//!   /tf          foxglove.FrameTransforms  JSON      site ─▶ module/NAME    ┐ once, and again
//!   /map         foxglove.SceneUpdate      JSON      walls, zones, lines …  ┘ when the site changes
//!   /people      foxglove.SceneUpdate      JSON      the tracks of each line
//!   /scan/NAME   foxglove.LaserScan        protobuf  how far each beam of a module saw nothing
//!   /log         foxglove.Log              JSON      alarms that begin, are acknowledged, end
//! ```
//!
//! Messages: <https://docs.foxglove.dev/docs/sdk/schemas>.
//!
//! | file | what |
//! |---|---|
//! | `message`, `schema` | the messages in JSON, and their schemas |
//! | `site`, `people`, `scan`, `log` | from what is known to a message |
//! | `live` | the server for viewers that are open now |

#[cfg(feature = "foxglove")]
mod live;
mod log;
mod message;
mod people;
mod scan;
mod schema;
mod site;

#[cfg(feature = "foxglove")]
pub use live::{Inputs, Live, LiveError};
pub(crate) use log::log;
pub(crate) use people::people;
pub(crate) use scan::{SCHEMA as SCAN, descriptor as scan_descriptor, scan};
pub(crate) use schema::of as schema_of;
pub(crate) use site::{map, transforms};

use message::{FrameTransforms, Log, SceneUpdate};

/// A topic in JSON, of which there is one.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Topic {
    Transforms,
    Map,
    People,
    Log,
}

impl Topic {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Transforms => "/tf",
            Self::Map => "/map",
            Self::People => "/people",
            Self::Log => "/log",
        }
    }

    /// The name of its messages' schema.
    pub(crate) const fn schema_name(self) -> &'static str {
        match self {
            Self::Transforms => "foxglove.FrameTransforms",
            Self::Map | Self::People => "foxglove.SceneUpdate",
            Self::Log => "foxglove.Log",
        }
    }

    /// That schema.
    pub(crate) fn schema(self) -> Vec<u8> {
        match self {
            Self::Transforms => schema_of::<FrameTransforms>(),
            Self::Map | Self::People => schema_of::<SceneUpdate>(),
            Self::Log => schema_of::<Log>(),
        }
    }
}

/// The topic of a module's scans.
pub(crate) fn scan_topic(module: &str) -> String {
    format!("/scan/{module}")
}

/// The frame of the site's walls, zones and people.
const SITE_FRAME: &str = "site";

/// The frame of a module: x where its front step points, y to the left, z up; also of one that hangs head down.
fn module_frame(module: &str) -> String {
    format!("module/{module}")
}
