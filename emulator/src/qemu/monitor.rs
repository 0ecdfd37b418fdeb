//! QEMU's monitor (QMP): one JSON object a line, asked and answered.
//!
//! QEMU answers nothing while the program stands at the end of a step: until the whole answer is here, its time goes on.
//!
//! Source: QEMU documentation, "QEMU Machine Protocol Specification".

use std::io::{self, Read, Write};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;

use serde_json::{Value, json};

use super::{Error, GuestTime};

/// An open session.
pub struct Monitor {
    stream: UnixStream,
    /// What has come of the next lines.
    received: Vec<u8>,
    time: GuestTime,
}

impl Monitor {
    /// Opens a session with a machine that lives in `time`.
    pub fn open(stream: UnixStream, time: &GuestTime) -> Result<Self, Error> {
        let mut monitor = Self { stream, received: Vec::new(), time: time.clone() };
        monitor.execute("qmp_capabilities", json!({}))?;
        Ok(monitor)
    }

    /// Has `command` done.
    pub fn execute(&mut self, command: &str, arguments: Value) -> Result<(), Error> {
        let request = json!({ "execute": command, "arguments": arguments });
        self.stream.write_all(format!("{request}\n").as_bytes())?;
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
        loop {
            if let Some(end) = self.received.iter().position(|&byte| byte == b'\n') {
                let line: Vec<u8> = self.received.drain(..=end).collect();
                return serde_json::from_slice(&line).map_err(|error| io::Error::from(error).into());
            }
            self.time.until_ready(self.stream.as_fd())?;
            let mut bytes = [0; 1024];
            match self.stream.read(&mut bytes)? {
                0 => return Err(Error::Gone("the monitor has hung up".into())),
                count => self.received.extend(bytes.iter().take(count)),
            }
        }
    }
}
