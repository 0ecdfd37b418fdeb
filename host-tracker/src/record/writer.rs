//! Messages into the file.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use mcap::records::MessageHeader;
use serde::Serialize;

use super::format::{Cause, DATAGRAMS, LINES, SITE, Told};
use super::people;
use kehai_tracking::jsonl::TracksLine;

/// Schemas: whatever an object holds, its name says.
const OBJECT: &[u8] = br#"{"type":"object"}"#;

/// A file that is being written.
pub struct Writer {
    file: mcap::Writer<BufWriter<File>>,
    begun_ns: u64,
    sequence: u32,
    site: u16,
    datagrams: u16,
    lines: u16,
    people: u16,
}

impl Writer {
    pub fn create(file: &Path, begun_ns: u64) -> Result<Self, Cause> {
        let options = mcap::WriteOptions::new().compression(None).library("kehai-tracker");
        let mut file = options.create(BufWriter::new(File::create(file)?))?;
        let none = BTreeMap::new();
        let mut json = |topic: &str, schema: &str| {
            let schema = file.add_schema(schema, "jsonschema", OBJECT)?;
            file.add_channel(schema, topic, "json", &none)
        };
        let site = json(SITE, "kehai.Told")?;
        let lines = json(LINES, "kehai.TracksLine")?;
        let people = json(people::TOPIC, people::SCHEMA)?;
        let datagrams = file.add_channel(0, DATAGRAMS, "kehai", &none)?;
        Ok(Self { file, begun_ns, sequence: 0, site, datagrams, lines, people })
    }

    pub fn told(&mut self, now_us: u64, told: &Told) -> Result<(), Cause> {
        self.json(self.site, now_us, told)
    }

    pub fn datagram(&mut self, now_us: u64, datagram: &[u8]) -> Result<(), Cause> {
        self.message(self.datagrams, now_us, datagram)
    }

    pub fn line(&mut self, at_us: u64, line: &TracksLine) -> Result<(), Cause> {
        self.json(self.lines, at_us, line)?;
        let at_ns = self.begun_ns.saturating_add(at_us.saturating_mul(1000));
        self.json(self.people, at_us, &people::scene(line, at_ns))
    }

    /// Ends a chunk: what came so far can be read whatever happens.
    pub fn flush(&mut self) -> Result<(), Cause> {
        Ok(self.file.flush()?)
    }

    pub fn finish(&mut self) -> Result<(), Cause> {
        self.file.finish()?;
        Ok(())
    }

    fn json(&mut self, channel: u16, now_us: u64, value: &impl Serialize) -> Result<(), Cause> {
        let bytes = serde_json::to_vec(value)?;
        self.message(channel, now_us, &bytes)
    }

    fn message(&mut self, channel_id: u16, now_us: u64, bytes: &[u8]) -> Result<(), Cause> {
        let log_time = self.begun_ns.saturating_add(now_us.saturating_mul(1000));
        let header = MessageHeader { channel_id, sequence: self.sequence, log_time, publish_time: log_time };
        self.sequence = self.sequence.wrapping_add(1);
        Ok(self.file.write_to_known_channel(&header, bytes)?)
    }
}
