//! Messages into a file that may be full for a while.
//!
//! ```text
//!   message ─▶ MCAP writer ─▶ pending bytes ── each second ──▶ file ─┬─ all written: on with the next second
//!                                                                    └─ fails: they wait; what comes is lost and counted
//!   there is room again: the pending bytes, then a note of how many were lost, and the site if it has changed
//! ```
//!
//! What the MCAP writer gives is written whole, at its place, or waits: at any time the file is the beginning of a good one.
//! What waits in memory is a second at most. Beside it the MCAP writer keeps the index that it writes at the end: where each chunk is, and
//! each channel in it. Two modules make that grow by about 0.4 kB a second, 35 MB a day; viewers find their way by it.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::sync::Arc;

use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use parking_lot::Mutex;
use serde::Serialize;

use super::derived;
use super::format::{Cause, DATAGRAMS, ELSEWHERE, LINES, LOST, Losses, Lost, Message, SITE, Told};
use crate::viewer;
use kehai_tracking::jsonl::TracksLine;

/// Bytes that are not in the file yet. Clones are the same bytes.
#[derive(Clone, Default)]
struct Pending(Arc<Mutex<Vec<u8>>>);

impl Pending {
    /// Writes them; those that could not be written stay.
    fn write_to(&self, out: &mut impl Write) -> io::Result<()> {
        let mut bytes = self.0.lock();
        while !bytes.is_empty() {
            match out.write(&bytes) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(written) => {
                    let len = bytes.len();
                    bytes.drain(..written.min(len));
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        out.flush()
    }
}

impl Write for Pending {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Numbers of the channels in the file.
struct Channels {
    site: u16,
    datagrams: u16,
    elsewhere: u16,
    lines: u16,
    lost: u16,
    derived: derived::Channels,
}

/// A file that is being written.
pub struct Writer<Out> {
    mcap: mcap::Writer<NoSeek<Pending>>,
    pending: Pending,
    out: Out,
    channels: Channels,
    begun_ns: u64,
    sequence: u32,
    /// Time of the newest message, µs.
    newest_us: u64,
    /// Messages that are not in the file: those that came while there was no room, and those that the queue had none for.
    lost: Losses,
    /// How many of them the file says.
    noted: Lost,
    /// Whether bytes wait for room; and the site that was told meanwhile.
    is_waiting: bool,
    told: Option<Box<Told>>,
}

impl<Out: Write> Writer<Out> {
    /// Begins a recording into `out`. What is lost is counted in `lost`, to which others may add.
    pub fn new(out: Out, begun_ns: u64, lost: Losses) -> Result<Self, Cause> {
        let options =
            mcap::WriteOptions::new().compression(None).library("kehai-tracker").disable_seeking(true);
        let pending = Pending::default();
        let mut mcap = options.create(NoSeek::new(pending.clone()))?;
        let none = BTreeMap::new();
        let mut json = |topic: &str, name: &str, schema: Vec<u8>| {
            let schema = mcap.add_schema(name, "jsonschema", &schema)?;
            mcap.add_channel(schema, topic, "json", &none)
        };
        let site = json(SITE, "kehai.Told", viewer::schema_of::<Told>())?;
        let lines = json(LINES, "kehai.TracksLine", viewer::schema_of::<TracksLine>())?;
        let lost_channel = json(LOST, "kehai.Lost", viewer::schema_of::<Lost>())?;
        let datagrams = mcap.add_channel(0, DATAGRAMS, "kehai", &none)?;
        let elsewhere = mcap.add_channel(0, ELSEWHERE, "kehai", &none)?;
        let derived = derived::Channels::add(&mut mcap)?;
        let channels = Channels { site, datagrams, elsewhere, lines, lost: lost_channel, derived };
        Ok(Self {
            mcap,
            pending,
            out,
            channels,
            begun_ns,
            sequence: 0,
            newest_us: 0,
            lost,
            noted: Lost::default(),
            is_waiting: false,
            told: None,
        })
    }

    /// Writes a message, or counts it as lost while there is no room.
    pub fn write(&mut self, message: Message) -> Result<(), Cause> {
        self.newest_us = self.newest_us.max(message.at_us());
        match message {
            // Without the site nothing that follows means anything.
            Message::Told(_, told) if self.is_waiting => self.told = Some(told),
            message if self.is_waiting => self.lost.add(message.is_shown()),
            // One that has waited for room is of now: the messages before it were recorded under the site before.
            Message::Told(_, told) => self.told(self.newest_us, &told)?,
            Message::Datagram(at_us, datagram) => self.message(self.channels.datagrams, at_us, &datagram)?,
            Message::Elsewhere(at_us, device) => self.message(self.channels.elsewhere, at_us, &device.0)?,
            Message::Line(at_us, line) => self.line(at_us, &line)?,
            Message::Scan(at_us, scan) => {
                let channel = self.channels.derived.scan(&mut self.mcap, &scan.module)?;
                self.message(channel, at_us, &viewer::scan(&scan, self.begun_ns))?;
            }
            Message::Alarm(at_us, change) => {
                self.json(self.channels.derived.log, at_us, &viewer::log(&change, self.unix_ns(at_us)))?;
            }
        }
        Ok(())
    }

    /// Ends a chunk and writes it: what came so far can be read whatever happens. Messages that were lost since the last
    /// one are noted.
    ///
    /// # Errors
    /// There is no room now: [`Cause::Io`]. Other causes are for good.
    pub fn chunk(&mut self) -> Result<(), Cause> {
        if !self.is_waiting {
            self.note()?;
            self.mcap.flush()?;
        }
        self.is_waiting = true;
        self.pending.write_to(&mut self.out)?;
        self.is_waiting = false;
        self.note()?;
        match self.told.take() {
            Some(told) => self.told(self.newest_us, &told),
            None => Ok(()),
        }
    }

    /// Ends the file.
    ///
    /// # Errors
    /// It ends early: there is no room.
    pub fn finish(&mut self) -> Result<(), Cause> {
        self.chunk()?;
        self.mcap.finish()?;
        Ok(self.pending.write_to(&mut self.out)?)
    }

    /// Writes how many messages were lost since the last note, if any were.
    fn note(&mut self) -> Result<(), Cause> {
        let (lost, noted) = (self.lost.so_far(), self.noted);
        if lost == noted {
            return Ok(());
        }
        self.noted = lost;
        let more = Lost { messages: lost.messages - noted.messages, shown: lost.shown - noted.shown };
        self.json(self.channels.lost, self.newest_us, &more)
    }

    /// The site, and how it looks.
    fn told(&mut self, at_us: u64, told: &Told) -> Result<(), Cause> {
        let at_ns = self.unix_ns(at_us);
        self.json(self.channels.site, at_us, told)?;
        self.json(self.channels.derived.transforms, at_us, &viewer::transforms(&told.site, at_ns))?;
        self.json(self.channels.derived.map, at_us, &viewer::map(&told.site, at_ns))
    }

    fn line(&mut self, at_us: u64, line: &TracksLine) -> Result<(), Cause> {
        self.json(self.channels.lines, at_us, line)?;
        self.json(self.channels.derived.people, at_us, &viewer::people(line, self.unix_ns(at_us)))
    }

    /// A time of the tracker's clock, ns since 1970.
    const fn unix_ns(&self, at_us: u64) -> u64 {
        self.begun_ns.saturating_add(at_us.saturating_mul(1000))
    }

    fn json(&mut self, channel: u16, now_us: u64, value: &impl Serialize) -> Result<(), Cause> {
        let bytes = serde_json::to_vec(value)?;
        self.message(channel, now_us, &bytes)
    }

    fn message(&mut self, channel_id: u16, now_us: u64, bytes: &[u8]) -> Result<(), Cause> {
        let log_time = self.unix_ns(now_us);
        let header = MessageHeader { channel_id, sequence: self.sequence, log_time, publish_time: log_time };
        self.sequence = self.sequence.wrapping_add(1);
        Ok(self.mcap.write_to_known_channel(&header, bytes)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::replay::replay;
    use kehai_tracking::site::Site;

    const ZONE: &str = "[[zone]]\nname = \"hall\"\npolygon = [[0, 0], [1, 0], [1, 1]]\n";

    /// A disk with room for so many bytes. Clones are the same disk.
    #[derive(Clone, Default)]
    struct Disk(Arc<Mutex<(Vec<u8>, usize)>>);

    impl Disk {
        fn room(&self, more: usize) {
            self.0.lock().1 += more;
        }
    }

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let (written, room) = &mut *self.0.lock();
            let len = bytes.len().min(*room);
            if len == 0 {
                return Err(io::ErrorKind::StorageFull.into());
            }
            *room -= len;
            written.extend(&bytes[..len]);
            Ok(len)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn told(text: &str) -> Message {
        let site: Site = toml::from_str(text).unwrap();
        let tracker = kehai_tracking::tracker::Selected::default().to_string();
        Message::Told(0, Box::new(Told { tracker, site, restored: None }))
    }

    /// Bytes of a recording before anything has come in.
    fn head() -> usize {
        let disk = Disk::default();
        disk.room(1 << 20);
        let mut writer = Writer::new(disk.clone(), 1000, Losses::default()).unwrap();
        writer.write(told("")).unwrap();
        writer.chunk().unwrap();
        disk.0.lock().0.len()
    }

    #[test]
    fn f12_a_recording_goes_on_after_a_full_disk_and_says_what_is_missing() {
        let (disk, lost) = (Disk::default(), Losses::default());
        disk.room(head() + 20_000);
        let mut writer = Writer::new(disk.clone(), 1000, lost.clone()).unwrap();
        writer.write(told("")).unwrap();
        let (mut taken, mut failed) = (0, 0);
        for second in 0..60_u64 {
            for tenth in 0..10 {
                let at_us = second * 1_000_000 + tenth * 100_000;
                writer.write(Message::Datagram(at_us, vec![tenth as u8; 100].into())).unwrap();
                taken += 1;
            }
            // Full for a while, with room for a part of what waits each time; and the site changes meanwhile.
            match second {
                20 => writer.write(told(ZONE)).unwrap(),
                30..40 => disk.room(150),
                40 => disk.room(1 << 20),
                _ => {}
            }
            failed += u32::from(writer.chunk().is_err());
        }
        let line = TracksLine { t: 60.0, ..TracksLine::default() };
        writer.write(Message::Line(60_000_000, Box::new(line))).unwrap();
        writer.finish().unwrap();
        assert!((10..40).contains(&failed), "{failed}");

        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("full.mcap");
        std::fs::write(&file, &disk.0.lock().0).unwrap();
        let mut zones = Vec::new();
        let outcome = replay(&file, |_, line| {
            zones.extend(line.zones.keys().cloned());
            Ok(())
        })
        .unwrap();
        assert_eq!(outcome.cut_off, None);
        assert_eq!((outcome.datagrams + outcome.lost, outcome.lost), (taken, lost.so_far().messages));
        assert!((100..400).contains(&outcome.lost), "{outcome:?}");
        assert_eq!(zones, ["hall"], "the site that was told while there was no room");
        // The index at the end fits what is there: Foxglove reads by it.
        let bytes = disk.0.lock().0.clone();
        let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
        let counts = summary.stats.as_ref().unwrap().channel_message_counts.clone();
        let count = |topic: &str| {
            let channel = summary.channels.values().find(|channel| channel.topic == topic).unwrap();
            counts.get(&channel.id).copied().unwrap_or(0)
        };
        assert_eq!((count(SITE), count(DATAGRAMS), count(LINES)), (2, outcome.datagrams, 1));
        let indexed: usize = summary
            .chunk_indexes
            .iter()
            .map(|index| summary.stream_chunk(&bytes, index).unwrap().count())
            .sum();
        assert_eq!(indexed as u64, counts.values().sum::<u64>());
    }

    #[test]
    fn f12_a_recording_that_never_has_room_again_is_the_beginning_of_one() {
        let (disk, lost) = (Disk::default(), Losses::default());
        disk.room(head() + 5000);
        let mut writer = Writer::new(disk.clone(), 1000, lost).unwrap();
        writer.write(told("")).unwrap();
        for second in 0..20_u64 {
            writer.write(Message::Datagram(second * 1_000_000, vec![7; 500].into())).unwrap();
            let _ = writer.chunk();
        }
        assert!(writer.finish().is_err());
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("full.mcap");
        std::fs::write(&file, &disk.0.lock().0).unwrap();
        let outcome = replay(&file, |_, _| Ok(())).unwrap();
        assert!(outcome.datagrams > 2, "{outcome:?}");
        assert_ne!(outcome.cut_off, None);
    }
}
