//! What a debugger can do to the program: here, make it hang.
//!
//! ```text
//! $g#67  ──▶   registers r0 … r15, eight hexadecimal digits each, low byte first
//! $Mpc,2:fee7#..  ──▶  OK          e7fe: branch to itself
//! $D#44  ──▶   OK, and the program runs on
//! ```
//!
//! The code is in RAM, so it is whole again after the next reset, when QEMU loads the image anew.
//!
//! Source: GDB manual, appendix "GDB Remote Serial Protocol"; ARM DDI 0403 for the instruction.

use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;

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
        let answer = ask(&mut stream, &command)?;
        if answer != "OK" {
            return Err(Error::Refused { command, answer });
        }
    }
    Ok(())
}

/// Sends a packet and returns what the answering packet holds.
fn ask(stream: &mut UnixStream, command: &str) -> Result<String, Error> {
    let sum = command.bytes().fold(0u8, u8::wrapping_add);
    write!(stream, "${command}#{sum:02x}")?;
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
