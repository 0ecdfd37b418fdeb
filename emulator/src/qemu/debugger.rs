//! Debugger: makes the program hang, or stops it at each write to some memory.
//!
//! ```text
//! $g#67  ──▶   registers r0 … r15, eight hexadecimal digits each, low byte first
//! $Mpc,2:fee7#..  ──▶  OK          e7fe: branch to itself
//! $D#44  ──▶   OK, and the program runs on
//!
//! $Z2,address,length#..  ──▶  OK   a watch for writes
//! $c#63  ──▶   …                   the program runs on …  ──▶  T05watch:…   it is about to write, and stands
//! $z2,…  $s#73  $Z2,…              the write, without the watch
//! ```
//!
//! The code is in RAM, so it is whole again after the next reset, when QEMU loads the image anew.
//!
//! Source: GDB manual, appendix "GDB Remote Serial Protocol"; ARM DDI 0403 for the instruction.

use std::io::{Read, Write};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::path::Path;

use super::{Error, GuestTime, PATIENCE, PATIENCE_US};

/// Digits of a register, and the place of the program counter among them.
const REGISTER_DIGITS: usize = 8;
const PROGRAM_COUNTER: usize = 15;

/// Connecting stops the program; leaving lets it go on, at an instruction that leads to itself.
pub fn hang(path: &Path, time: &GuestTime) -> Result<(), Error> {
    let mut session = Session::connect(path, time)?;
    let registers = session.ask("g")?;
    let address = registers
        .get(PROGRAM_COUNTER * REGISTER_DIGITS..(PROGRAM_COUNTER + 1) * REGISTER_DIGITS)
        .and_then(|digits| u32::from_str_radix(digits, 16).ok())
        .ok_or_else(|| Error::Refused { command: "g".into(), answer: registers.clone() })?
        .swap_bytes();
    for command in [format!("M{address:x},2:fee7"), "D".into()] {
        session.order(&command)?;
    }
    Ok(())
}

/// A program that stands after each of its writes to some memory. It runs on when this is dropped.
pub struct Watch {
    session: Session,
    /// Address and length, as the debugger's protocol writes them.
    range: String,
    running: bool,
}

impl Watch {
    /// Watches `len` bytes from `address` on. The program stands until [`next`](Self::next).
    pub(super) fn start(path: &Path, time: &GuestTime, address: u32, len: usize) -> Result<Self, Error> {
        let mut session = Session::connect(path, time)?;
        let range = format!("{address:x},{len:x}");
        session.order(&format!("Z2,{range}"))?;
        Ok(Self { session, range, running: false })
    }

    /// Lets the program run until it has written once more; false if it has not within `wait_us` of its own time,
    /// and runs on.
    ///
    /// # Errors
    /// QEMU is gone.
    pub fn next(&mut self, wait_us: u64) -> Result<bool, Error> {
        if !self.running {
            self.session.send("c")?;
            self.running = true;
        }
        if !self.session.packet_begins(wait_us)? {
            return Ok(false);
        }
        self.session.rest_of_packet()?;
        self.running = false;
        // It stands before the instruction that writes, and would for ever.
        self.session.order(&format!("z2,{}", self.range))?;
        self.session.send("s")?;
        self.session.packet()?;
        self.session.order(&format!("Z2,{}", self.range))?;
        Ok(true)
    }
}

/// A connection to QEMU's debugger.
struct Session {
    stream: UnixStream,
    time: GuestTime,
}

impl Session {
    fn connect(path: &Path, time: &GuestTime) -> Result<Self, Error> {
        let stream = UnixStream::connect(path)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        Ok(Self { stream, time: time.clone() })
    }

    /// Sends a packet and expects the answer OK.
    fn order(&mut self, command: &str) -> Result<(), Error> {
        match self.ask(command)?.as_str() {
            "OK" => Ok(()),
            answer => Err(Error::Refused { command: command.into(), answer: answer.into() }),
        }
    }

    fn send(&mut self, command: &str) -> Result<(), Error> {
        let sum = command.bytes().fold(0u8, u8::wrapping_add);
        Ok(write!(self.stream, "${command}#{sum:02x}")?)
    }

    /// Sends a packet and returns the content of the answer.
    fn ask(&mut self, command: &str) -> Result<String, Error> {
        self.send(command)?;
        loop {
            let answer = self.packet()?;
            // That the program has stopped, at connecting, is no answer.
            if !answer.starts_with('T') {
                return Ok(answer);
            }
        }
    }

    /// The next packet, without its checksum.
    fn packet(&mut self) -> Result<String, Error> {
        if !self.packet_begins(PATIENCE_US)? {
            return Err(Error::Gone("the debugger is silent".into()));
        }
        self.rest_of_packet()
    }

    /// Reads over acknowledgements up to the next packet; false if none begins within `wait_us`.
    fn packet_begins(&mut self, wait_us: u64) -> Result<bool, Error> {
        let end_us = self.time.now_us() + wait_us;
        while self.time.now_us() < end_us {
            if self.time.step_or(Some(self.stream.as_fd())) && self.byte()? == b'$' {
                return Ok(true);
            }
        }
        Ok(false)
    }

    fn rest_of_packet(&mut self) -> Result<String, Error> {
        let mut content = String::new();
        loop {
            match self.byte()? {
                b'#' => break,
                byte => content.push(char::from(byte)),
            }
        }
        self.byte()?;
        self.byte()?;
        self.stream.write_all(b"+")?;
        Ok(content)
    }

    fn byte(&mut self) -> Result<u8, Error> {
        let mut byte = [0];
        self.stream.read_exact(&mut byte)?;
        Ok(byte[0])
    }
}
