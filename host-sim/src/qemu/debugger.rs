//! What a debugger can do to the program: make it hang, or stop it at each write to some memory.
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

use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

use super::{Error, PATIENCE};

/// Digits of a register, and the place of the program counter among them.
const REGISTER_DIGITS: usize = 8;
const PROGRAM_COUNTER: usize = 15;

/// Connecting stops the program; leaving lets it go on, at an instruction that leads to itself.
pub fn hang(path: &Path) -> Result<(), Error> {
    let mut stream = UnixStream::connect(path)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    let registers = ask(&mut stream, "g")?;
    let address = registers
        .get(PROGRAM_COUNTER * REGISTER_DIGITS..(PROGRAM_COUNTER + 1) * REGISTER_DIGITS)
        .and_then(|digits| u32::from_str_radix(digits, 16).ok())
        .ok_or_else(|| Error::Refused { command: "g".into(), answer: registers.clone() })?
        .swap_bytes();
    for command in [format!("M{address:x},2:fee7"), "D".into()] {
        order(&mut stream, &command)?;
    }
    Ok(())
}

/// A program that stands after each of its writes to some memory. It runs on when this is dropped.
pub struct Watch {
    stream: UnixStream,
    /// Address and length, as the debugger is told.
    range: String,
    running: bool,
}

impl Watch {
    /// Watches `len` bytes from `address` on. The program stands until [`next`](Self::next).
    pub(super) fn start(path: &Path, address: u32, len: usize) -> Result<Self, Error> {
        let mut stream = UnixStream::connect(path)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        let range = format!("{address:x},{len:x}");
        order(&mut stream, &format!("Z2,{range}"))?;
        Ok(Self { stream, range, running: false })
    }

    /// Lets the program run until it has written once more; false if it has not within `wait`, and runs on.
    ///
    /// # Errors
    /// QEMU is gone.
    pub fn next(&mut self, wait: Duration) -> Result<bool, Error> {
        if !self.running {
            send(&mut self.stream, "c")?;
            self.running = true;
        }
        self.stream.set_read_timeout(Some(wait))?;
        match packet(&mut self.stream) {
            Err(Error::Io(error)) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                return Ok(false);
            }
            stopped => stopped?,
        };
        self.running = false;
        self.stream.set_read_timeout(Some(PATIENCE))?;
        // It stands before the instruction that writes, and would for ever.
        order(&mut self.stream, &format!("z2,{}", self.range))?;
        send(&mut self.stream, "s")?;
        packet(&mut self.stream)?;
        order(&mut self.stream, &format!("Z2,{}", self.range))?;
        Ok(true)
    }
}

/// Sends a packet that is to be answered with OK.
fn order(stream: &mut UnixStream, command: &str) -> Result<(), Error> {
    match ask(stream, command)?.as_str() {
        "OK" => Ok(()),
        answer => Err(Error::Refused { command: command.into(), answer: answer.into() }),
    }
}

fn send(stream: &mut UnixStream, command: &str) -> Result<(), Error> {
    let sum = command.bytes().fold(0u8, u8::wrapping_add);
    Ok(write!(stream, "${command}#{sum:02x}")?)
}

/// Sends a packet and returns what the answering packet holds.
fn ask(stream: &mut UnixStream, command: &str) -> Result<String, Error> {
    send(stream, command)?;
    loop {
        let answer = packet(stream)?;
        // That the program has stopped, at connecting, is no answer.
        if !answer.starts_with('T') {
            return Ok(answer);
        }
    }
}

/// The next packet, without its checksum.
fn packet(stream: &mut UnixStream) -> Result<String, Error> {
    let mut next = || -> Result<u8, Error> {
        let mut byte = [0];
        stream.read_exact(&mut byte)?;
        Ok(byte[0])
    };
    while next()? != b'$' {}
    let mut content = String::new();
    loop {
        match next()? {
            b'#' => break,
            byte => content.push(char::from(byte)),
        }
    }
    next()?;
    next()?;
    stream.write_all(b"+")?;
    Ok(content)
}
