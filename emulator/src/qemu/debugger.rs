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
//! 03  ──▶  T02…   $D#44  ──▶  OK   the end of the watch: the program runs on
//! ```
//!
//! While a program stands here its board is frozen: the rest of the world does not wait for it. While it runs, an
//! answer may need many steps of its time, since QEMU answers nothing as long as the program stands at the end of one.
//!
//! The code is in RAM, so it is whole again after the next reset, when QEMU loads the image anew.
//!
//! Source: GDB manual, appendix "GDB Remote Serial Protocol"; ARM DDI 0403 for the instruction.

use std::collections::VecDeque;
use std::io::{Read, Write};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::rc::Rc;

use super::lockstep::Lockstep;
use super::{Error, GuestTime, PATIENCE_US};

/// Digits of a register, and the place of the program counter among them.
const REGISTER_DIGITS: usize = 8;
const PROGRAM_COUNTER: usize = 15;

/// Stops a running program.
const STOP: u8 = 3;

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
    board: Rc<Lockstep>,
    /// Address and length, as the debugger's protocol writes them.
    range: String,
    running: bool,
}

impl Watch {
    /// Watches `len` bytes from `address` on. The program stands until [`next`](Self::next).
    pub(super) fn start(
        path: &Path,
        (time, board): (&GuestTime, &Rc<Lockstep>),
        (address, len): (u32, usize),
    ) -> Result<Self, Error> {
        let mut session = Session::connect(path, time)?;
        let range = format!("{address:x},{len:x}");
        session.order(&format!("Z2,{range}"))?;
        board.set_frozen(true);
        Ok(Self { session, board: Rc::clone(board), range, running: false })
    }

    /// Lets the program run until it has written once more; false if it has not within `wait_us` of its own time,
    /// and runs on.
    ///
    /// # Errors
    /// QEMU is gone.
    pub fn next(&mut self, wait_us: u64) -> Result<bool, Error> {
        if !self.running {
            self.run_on();
            self.session.send("c")?;
        }
        if !self.session.packet_begins(wait_us)? {
            return Ok(false);
        }
        self.session.rest_of_packet()?;
        self.stands();
        // It stands before the instruction that writes, and would for ever.
        self.session.order(&format!("z2,{}", self.range))?;
        self.session.send("s")?;
        self.session.packet()?;
        self.session.order(&format!("Z2,{}", self.range))?;
        Ok(true)
    }

    /// Its time is waited for again: it may come to the end of a step before QEMU answers.
    fn run_on(&mut self) {
        self.running = true;
        self.board.set_frozen(false);
    }

    fn stands(&mut self) {
        self.running = false;
        self.board.set_frozen(true);
    }

    /// Ends the watch. QEMU takes commands only while the program stands.
    fn leave(&mut self) -> Result<(), Error> {
        if self.running {
            self.session.stream.write_all(&[STOP])?;
            self.session.packet()?;
        }
        self.run_on();
        self.session.order("D")
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        // QEMU may be gone already; then there is nothing to end.
        let _ = self.leave();
    }
}

/// A connection to QEMU's debugger.
struct Session {
    stream: UnixStream,
    /// Bytes that have come and were not looked at.
    received: VecDeque<u8>,
    time: GuestTime,
}

impl Session {
    fn connect(path: &Path, time: &GuestTime) -> Result<Self, Error> {
        Ok(Self { stream: UnixStream::connect(path)?, received: VecDeque::new(), time: time.clone() })
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
        loop {
            while let Some(byte) = self.received.pop_front() {
                if byte == b'$' {
                    return Ok(true);
                }
            }
            if self.time.now_us() >= end_us {
                return Ok(false);
            }
            if self.time.step_or(Some(self.stream.as_fd())) {
                self.read()?;
            }
        }
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
        loop {
            if let Some(byte) = self.received.pop_front() {
                return Ok(byte);
            }
            self.time.until_ready(self.stream.as_fd())?;
            self.read()?;
        }
    }

    /// Reads what has come; to be called when something has.
    fn read(&mut self) -> Result<(), Error> {
        let mut bytes = [0; 256];
        match self.stream.read(&mut bytes)? {
            0 => Err(Error::Gone("the debugger has hung up".into())),
            count => {
                self.received.extend(bytes.iter().take(count));
                Ok(())
            }
        }
    }
}
