//! A message and what goes with it, in bytes.
//!
//! ```text
//!   payload      00 01 00 00 │ CDR, little-endian, aligned from here         XCDR version 1
//!   attachment   sequence i64 │ sent, ns since 1970, i64 │ 10 │ gid, 16 bytes         little-endian
//! ```
//!
//! Source: rmw_zenoh, `attachment_helpers.cpp` and `cdr.cpp`; DDS-XTypes 1.3, 7.6.3.1.2.

use byteorder::LittleEndian;

use super::describe::Message;

/// CDR, little-endian, without options.
const HEAD: [u8; 4] = [0, 1, 0, 0];

/// Whose a message is: one for each publisher.
pub type Gid = [u8; 16];

/// Of an attachment.
pub const ATTACHMENT: usize = 33;

/// A message in bytes.
///
/// # Errors
/// It cannot be written as CDR.
pub fn payload<M: Message>(message: &M) -> Result<Vec<u8>, cdr_encoding::Error> {
    let mut bytes = HEAD.to_vec();
    cdr_encoding::to_writer::<M, LittleEndian, _>(&mut bytes, message)?;
    Ok(bytes)
}

/// What goes with the message of a number, from 1, that is sent at `sent_ns` since 1970.
pub fn attachment(sequence: u64, sent_ns: u64, gid: &Gid) -> [u8; ATTACHMENT] {
    let mut bytes = [0; ATTACHMENT];
    bytes[..8].copy_from_slice(&sequence.to_le_bytes());
    bytes[8..16].copy_from_slice(&sent_ns.to_le_bytes());
    bytes[16] = gid.len() as u8;
    bytes[17..].copy_from_slice(gid);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros2::messages::{Header, People, Person};

    #[test]
    fn values_are_aligned_from_behind_the_head() {
        let person = Person { name: "track-7".into(), reliability: 0.5, ..Person::default() };
        let people = People { header: Header::new("map", 2_000_000_003), people: vec![person] };
        let bytes = payload(&people).unwrap();
        assert_eq!(bytes[..12], [0, 1, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0]);
        assert_eq!(bytes[12..20], [4, 0, 0, 0, b'm', b'a', b'p', 0]);
        assert_eq!(bytes[20..36], *b"\x01\0\0\0\x08\0\0\0track-7\0");
        // The position begins at a multiple of eight, from behind the head.
        let at = |value: usize| 4 + 32 + 8 * value;
        assert_eq!(bytes[at(6)..at(7)], 0.5_f64.to_le_bytes());
        assert_eq!(bytes.len(), at(7) + 8);
    }

    #[test]
    fn an_attachment_has_number_time_and_gid() {
        let bytes = attachment(0x0102, 0x0304, &[7; 16]);
        assert_eq!(bytes[..17], [2, 1, 0, 0, 0, 0, 0, 0, 4, 3, 0, 0, 0, 0, 0, 0, 16]);
        assert_eq!(bytes[17..], [7; 16]);
    }
}
