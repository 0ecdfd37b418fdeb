//! `--tracks-out`: a JSON line every 0.1 s into a file or pipe, which may be full or gone.
//!
//! ```text
//!   line ─▶ the rest of a line that was cut, first ─▶ the line ─┬─ Ok
//!                                                               └─ fails: counted, alarm `tracks-out`, next line tried
//! ```
//!
//! A line that was begun is finished before another is: what is in the file are whole lines.

use std::io::{self, Write};

use kehai_tracking::jsonl::TracksLine;

/// How often a write that was interrupted is begun again at once, before it counts as failed.
const INTERRUPTIONS: u32 = 16;

/// Where the lines go.
pub(super) struct TracksOut<W> {
    out: W,
    name: String,
    /// What is still to be written of a line that was begun.
    rest: Vec<u8>,
    lost: u64,
    trouble: Option<String>,
}

impl<W: Write> TracksOut<W> {
    /// Lines into `out`, which is called `name` in messages.
    pub(super) fn new(out: W, name: String) -> Self {
        Self { out, name, rest: Vec::new(), lost: 0, trouble: None }
    }

    /// Writes a line, or counts it as lost.
    ///
    /// # Errors
    /// Why it was lost.
    pub(super) fn line(&mut self, line: &TracksLine) -> io::Result<()> {
        let done = self.finish().and_then(|()| {
            self.rest = serde_json::to_vec(line)?;
            self.rest.push(b'\n');
            let whole = self.rest.len();
            self.finish().inspect_err(|_| {
                // Nothing of it is written: the next line may be in its place.
                if self.rest.len() == whole {
                    self.rest.clear();
                }
            })
        });
        match &done {
            Ok(()) => self.trouble = None,
            Err(error) => {
                self.lost += 1;
                self.trouble = Some(format!("{}: {error}; {} lines are lost so far", self.name, self.lost));
            }
        }
        done
    }

    /// What is wrong, in words, if anything is.
    pub(super) fn trouble(&self) -> Option<&str> {
        self.trouble.as_deref()
    }

    /// Writes what is left of a line.
    fn finish(&mut self) -> io::Result<()> {
        let mut interruptions = 0;
        while !self.rest.is_empty() {
            match self.out.write(&self.rest) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(written) => drop(self.rest.drain(..written.min(self.rest.len()))),
                Err(error) if error.kind() == io::ErrorKind::Interrupted && interruptions < INTERRUPTIONS => {
                    interruptions += 1;
                }
                Err(error) => return Err(error),
            }
        }
        self.out.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disk with room for so many bytes.
    struct Disk {
        written: Vec<u8>,
        room: usize,
    }

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let len = bytes.len().min(self.room);
            if len == 0 {
                return Err(io::ErrorKind::StorageFull.into());
            }
            self.room -= len;
            self.written.extend(&bytes[..len]);
            Ok(len)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn f12_lines_on_a_full_disk_are_counted_and_what_is_written_are_whole_lines() {
        let mut out = TracksOut::new(Disk { written: Vec::new(), room: 100 }, "disk".into());
        let mut lost = 0;
        for tenth in 0..30 {
            // Room for half a line each time, from the tenth line on.
            out.out.room += if tenth < 10 { 0 } else { 20 };
            let line = TracksLine { t: f64::from(tenth), ..TracksLine::default() };
            lost += u32::from(out.line(&line).is_err());
        }
        assert_eq!(out.lost, u64::from(lost));
        let text = String::from_utf8(out.out.written).unwrap();
        let whole = text.lines().filter(|line| serde_json::from_str::<TracksLine>(line).is_ok()).count();
        assert!(lost > 5 && whole > 5, "{lost} lost, {whole} whole");
        let torn = text.lines().count() - whole;
        assert!(torn == 0 || torn == 1 && !text.ends_with('\n'), "{text}");
    }
}
