//! QEMU's monitor (QMP): one JSON object a line, asked and answered.
//!
//! Source: QEMU documentation, "QEMU Machine Protocol Specification".

use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;

use serde_json::{Value, json};

use super::{Error, PATIENCE};

/// An open session.
pub struct Monitor {
    stream: BufReader<UnixStream>,
}

impl Monitor {
    /// Opens a session on the socket at `path`.
    pub fn connect(path: &Path) -> Result<Self, Error> {
        let stream = UnixStream::connect(path)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        let mut monitor = Self { stream: BufReader::new(stream) };
        monitor.execute("qmp_capabilities", json!({}))?;
        Ok(monitor)
    }

    /// Has `command` done.
    pub fn execute(&mut self, command: &str, arguments: Value) -> Result<(), Error> {
        let request = json!({ "execute": command, "arguments": arguments });
        writeln!(self.stream.get_mut(), "{request}")?;
        loop {
            // The greeting and events come in between.
            let answer = self.line()?;
            if answer.get("return").is_some() {
                return Ok(());
            }
            if let Some(error) = answer.get("error") {
                return Err(Error::Refused { command: command.into(), answer: error.to_string() });
            }
        }
    }

    fn line(&mut self) -> Result<Value, Error> {
        let mut line = String::new();
        if self.stream.read_line(&mut line)? == 0 {
            return Err(Error::Gone("the monitor has hung up".into()));
        }
        serde_json::from_str(&line).map_err(|error| io::Error::from(error).into())
    }
}
