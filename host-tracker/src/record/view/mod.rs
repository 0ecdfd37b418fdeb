//! What a recording shows in Foxglove and Lichtblick: derived from what it holds, and never read back.
//!
//! ```text
//!   /tf          foxglove.FrameTransforms  JSON      site ─▶ module/NAME    ┐ once, and again
//!   /map         foxglove.SceneUpdate      JSON      walls, zones, lines …  ┘ when the site changes
//!   /people      foxglove.SceneUpdate      JSON      the tracks of each line
//!   /scan/NAME   foxglove.LaserScan        protobuf  how far each beam of a module saw nothing
//!   /log         foxglove.Log              JSON      alarms that begin, are acknowledged, end
//! ```
//!
//! Each of these channels has `derived = true` in its metadata: a replay of the recording leaves it out.
//!
//! Messages: <https://docs.foxglove.dev/docs/sdk/schemas>.

mod log;
mod message;
mod people;
mod scan;
mod schema;
mod site;

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use mcap::McapError;
use schemars::JsonSchema;

pub use log::log;
pub use people::people;
pub use scan::scan;
pub use schema::of as schema_of;
pub use site::{map, transforms};

use message::{FrameTransforms, Log, SceneUpdate};

/// Key in the metadata of a channel that is derived from others.
pub const DERIVED: &str = "derived";

/// Numbers of the derived channels in the file.
pub struct Channels {
    pub transforms: u16,
    pub map: u16,
    pub people: u16,
    pub log: u16,
    scan_schema: u16,
    scans: BTreeMap<String, u16>,
}

impl Channels {
    /// Adds them.
    pub fn add<Out: Write + Seek>(mcap: &mut mcap::Writer<Out>) -> Result<Self, McapError> {
        Ok(Self {
            transforms: json::<FrameTransforms, _>(mcap, "/tf", "foxglove.FrameTransforms")?,
            map: json::<SceneUpdate, _>(mcap, "/map", "foxglove.SceneUpdate")?,
            people: json::<SceneUpdate, _>(mcap, "/people", "foxglove.SceneUpdate")?,
            log: json::<Log, _>(mcap, "/log", "foxglove.Log")?,
            scan_schema: mcap.add_schema(scan::SCHEMA, "protobuf", &scan::descriptor())?,
            scans: BTreeMap::new(),
        })
    }

    /// That of a module's scans, which is added with the first of them.
    pub fn scan<Out: Write + Seek>(
        &mut self,
        mcap: &mut mcap::Writer<Out>,
        module: &str,
    ) -> Result<u16, McapError> {
        if let Some(&channel) = self.scans.get(module) {
            return Ok(channel);
        }
        let topic = format!("/scan/{module}");
        let channel = mcap.add_channel(self.scan_schema, &topic, "protobuf", &derived())?;
        self.scans.insert(module.to_owned(), channel);
        Ok(channel)
    }
}

fn json<Message: JsonSchema, Out: Write + Seek>(
    mcap: &mut mcap::Writer<Out>,
    topic: &str,
    schema: &str,
) -> Result<u16, McapError> {
    let schema = mcap.add_schema(schema, "jsonschema", &schema::of::<Message>())?;
    mcap.add_channel(schema, topic, "json", &derived())
}

fn derived() -> BTreeMap<String, String> {
    BTreeMap::from([(DERIVED.to_owned(), "true".to_owned())])
}

/// The frame of the site's walls, zones and people.
const SITE_FRAME: &str = "site";

/// The frame of a module: x where its front step points, y to the left, z up; also of one that hangs head down.
fn module_frame(module: &str) -> String {
    format!("module/{module}")
}
