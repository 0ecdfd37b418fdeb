//! The channels of a recording that viewers show: derived from what it holds, and never read back.
//!
//! ```text
//!   channel /people, /map, … ─ metadata: derived = true ─▶ a replay of the recording leaves it out
//! ```

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use mcap::McapError;

use crate::viewer::{SCAN, Topic, scan_descriptor, scan_topic};

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
        let mut json = |topic: Topic| {
            let schema = mcap.add_schema(topic.schema_name(), "jsonschema", &topic.schema())?;
            mcap.add_channel(schema, topic.name(), "json", &derived())
        };
        Ok(Self {
            transforms: json(Topic::Transforms)?,
            map: json(Topic::Map)?,
            people: json(Topic::People)?,
            log: json(Topic::Log)?,
            scan_schema: mcap.add_schema(SCAN, "protobuf", &scan_descriptor())?,
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
        let channel = mcap.add_channel(self.scan_schema, &scan_topic(module), "protobuf", &derived())?;
        self.scans.insert(module.to_owned(), channel);
        Ok(channel)
    }
}

fn derived() -> BTreeMap<String, String> {
    BTreeMap::from([(DERIVED.to_owned(), "true".to_owned())])
}
