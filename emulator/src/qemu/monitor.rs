//! QEMU's monitor (QMP): one JSON object a line, asked and answered.
//!
//! QEMU answers only while the machine runs, or is stopped: until the answer comes, the machine runs steps.
//!
//! Source: QEMU documentation, "QEMU Machine Protocol Specification".

use std::io::{self, BufRead, BufReader, Write};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;

use serde_json::{Value, json};

use super::{Error, GuestTime, PATIENCE};

/// An open session.
pub struct Monitor {
    stream: BufReader<UnixStream>,
    time: GuestTime,
}

impl Monitor {
    /// Opens a session with a machine that lives in `time`.
    pub fn open(stream: UnixStream, time: &GuestTime) -> Result<Self, Error> {
        stream.set_read_timeout(Some(PATIENCE))?;
        let mut monitor = Self { stream: BufReader::new(stream), time: time.clone() };
        monitor.execute("qmp_capabilities", json!({}))?;
        Ok(monitor)
    }

    /// Has `command` done.
    pub fn execute(&mut self, command: &str, arguments: Value) -> Result<(), Error> {
        let request = json!({ "execute": command, "arguments": arguments });
        writeln!(self.stream.get_mut(), "{request}")?;
        loop {
            // The greeting and events come in between.
            let answer = self.read_line()?;
            if answer.get("return").is_some() {
                return Ok(());
            }
            if let Some(error) = answer.get("error") {
                return Err(Error::Refused { command: command.into(), answer: error.to_string() });
            }
        }
    }

    fn read_line(&mut self) -> Result<Value, Error> {
        if self.stream.buffer().is_empty() {
            self.time.until_ready(self.stream.get_ref().as_fd())?;
        }
        let mut line = String::new();
        if self.stream.read_line(&mut line)? == 0 {
            return Err(Error::Gone("the monitor has hung up".into()));
        }
        serde_json::from_str(&line).map_err(|error| io::Error::from(error).into())
    }
}
