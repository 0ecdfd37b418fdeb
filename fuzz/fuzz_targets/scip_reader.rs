//! The reader on arbitrary bytes: no panic, every call makes progress, and the same events and
//! ranges however the bytes are cut.
//!
//! ```text
//!   input:  what is expected │ sizes of the pieces │ bytes from the sensor …
//!               1 byte       │      3 bytes        │
//! ```
//!
//! Two bytes that SCIP does not have stand for what a fuzzer would hardly hit upon: 1 for the checksum
//! of the line so far, 2 for the start of a scan.
#![no_main]

use kehai::scip::{Command, Event, Losses, Measurement, Reader, Request, Width, checksum};
use libfuzzer_sys::fuzz_target;

const STREAM: Measurement =
    Measurement { first_step: 0, last_step: 46, cluster: 1, skip: 0, scans: 3, width: Width::Three };
const SINGLE: Measurement = Measurement { last_step: 8, cluster: 2, width: Width::Two, ..STREAM };

fn pending(choice: u8) -> Option<Request> {
    let command = match choice % 9 {
        0 => Command::Version,
        1 => Command::Parameters,
        2 => Command::State,
        3 => Command::StateCode,
        4 => Command::Quit,
        5 => Command::TimeRead,
        6 => Command::Scip20,
        7 => Command::Get(SINGLE),
        _ => return None,
    };
    command.encode().ok()
}

fn without_time(event: Event) -> Event {
    match event {
        Event::Scan(mut scan) => {
            scan.first_byte_us = 0;
            Event::Scan(scan)
        }
        Event::Reply(mut reply) => {
            reply.first_byte_us = 0;
            Event::Reply(reply)
        }
        Event::Time(mut time) => {
            time.first_byte_us = 0;
            Event::Time(time)
        }
        other => other,
    }
}

/// Events and ranges from `bytes`, cut into pieces of the sizes given, over and over.
fn said(choice: u8, bytes: &[u8], sizes: &[usize]) -> (Vec<(Event, Vec<u16>)>, Losses) {
    let mut reader = Reader::new();
    let mut expected = choice;
    for request in [Command::Measure(STREAM).encode().ok(), pending(expected)].iter().flatten() {
        reader.expect(request);
    }
    let mut ranges_mm = [0; 47];
    let room = if choice > 250 { 20 } else { ranges_mm.len() };
    let (mut said, mut rest, mut now_us) = (Vec::new(), bytes, 0);
    let mut sizes = sizes.iter().cycle();
    while !rest.is_empty() {
        let size = sizes.next().map_or(rest.len(), |&size| size.clamp(1, rest.len()));
        let (mut piece, behind) = rest.split_at(size);
        rest = behind;
        now_us += 1;
        while !piece.is_empty() {
            let fed = reader.feed(piece, now_us, &mut ranges_mm[..room]);
            assert!(fed.consumed > 0, "no progress");
            assert!(fed.event.is_some() || fed.consumed == piece.len(), "stopped without a reason");
            piece = &piece[fed.consumed..];
            let Some(event) = fed.event else { continue };
            let beams = match event {
                Event::Scan(scan) => usize::from(scan.beams),
                _ => 0,
            };
            said.push((without_time(event), ranges_mm[..beams].to_vec()));
            if !matches!(event, Event::Lost(_) | Event::Unexpected(_) | Event::Scan(_)) {
                expected = expected.wrapping_add(1);
                pending(expected).inspect(|request| reader.expect(request));
            }
        }
    }
    (said, *reader.losses())
}

fn written_out(bytes: &[u8]) -> Vec<u8> {
    let (mut text, mut line) = (Vec::new(), 0);
    for &byte in bytes {
        match byte {
            1 => text.push(checksum::of(&text[line..])),
            2 => text.extend(b"MD0000004601001\n99b\nJUGnD\n"),
            _ => text.push(byte),
        }
        if text.ends_with(b"\n") {
            line = text.len();
        }
    }
    text
}

fuzz_target!(|input: &[u8]| {
    let [choice, first, second, third, bytes @ ..] = input else { return };
    let bytes = &written_out(bytes);
    let whole = said(*choice, bytes, &[]);
    assert_eq!(whole, said(*choice, bytes, &[1]));
    assert_eq!(whole, said(*choice, bytes, &[(*first).into(), (*second).into(), (*third).into()]));
});
