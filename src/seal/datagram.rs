//! A datagram sealed and opened in its place: the header in clear, the tag in it, the message encrypted.
//!
//! ```text
//!     0             15      16         24      40
//!     │ … boot, id, kind │key│ counter  │ tag    │ message, encrypted
//!     ╰─── associated ──────────────────╯
//! ```

use heapless::Vec;

use super::{Key, aead};
use crate::wire::HEADER_LEN;

/// Longest message that is authenticated and stays in clear, bytes.
pub(super) const SIGNED_MAX: usize = 32;

/// A header and a message without the tag between them. What does not fit is cut off, and no tag of it is right.
type Clear = Vec<u8, { TAG_AT + SIGNED_MAX }>;

/// Where the header names the key.
const KEY_AT: usize = 15;
/// Where its counter begins.
const COUNTER_AT: usize = 16;
/// Where its tag begins: all before it is associated with the text.
const TAG_AT: usize = 24;

/// Associated bytes, tag and message.
fn parts(datagram: &mut [u8]) -> Option<(&mut [u8; TAG_AT], &mut [u8; HEADER_LEN - TAG_AT], &mut [u8])> {
    let (associated, rest) = datagram.split_first_chunk_mut::<TAG_AT>()?;
    let (tag, message) = rest.split_first_chunk_mut::<{ HEADER_LEN - TAG_AT }>()?;
    Some((associated, tag, message))
}

/// Seals a whole datagram in its place: `number` and `counter` go to its header. One that is shorter than a header stays as
/// it is.
pub(super) fn seal(datagram: &mut [u8], key: &Key, number: u8, counter: u64) {
    if let Some((associated, tag, message)) = named(datagram, number, counter) {
        *tag = aead::seal(key, counter, associated, message);
    }
}

/// The same for a short message that stays in clear: all of it is associated, and nothing encrypted.
pub(super) fn sign(datagram: &mut [u8], key: &Key, number: u8, counter: u64) {
    if let Some((associated, tag, message)) = named(datagram, number, counter) {
        *tag = aead::seal(key, counter, &clear(associated, message), &mut []);
    }
}

fn clear(associated: &[u8; TAG_AT], message: &[u8]) -> Clear {
    let mut clear = Vec::new();
    for &byte in associated.iter().chain(message) {
        let _ = clear.push(byte);
    }
    clear
}

fn named(
    datagram: &mut [u8],
    number: u8,
    counter: u64,
) -> Option<(&mut [u8; TAG_AT], &mut [u8; HEADER_LEN - TAG_AT], &mut [u8])> {
    if let Some(slot) = datagram.get_mut(KEY_AT) {
        *slot = number;
    }
    if let Some(slot) = datagram.get_mut(COUNTER_AT..TAG_AT) {
        slot.iter_mut().zip(counter.to_le_bytes()).for_each(|(slot, byte)| *slot = byte);
    }
    parts(datagram)
}

/// Opens a sealed datagram in its place; one that is not sealed with `key` stays as it is.
#[must_use]
pub(super) fn open(datagram: &mut [u8], key: &Key, counter: u64) -> bool {
    parts(datagram)
        .is_some_and(|(associated, tag, message)| aead::open(key, counter, associated, message, tag))
}

/// Whether a short datagram in clear is authenticated with `key`.
#[must_use]
pub(super) fn is_signed(datagram: &[u8], key: &Key, counter: u64) -> bool {
    let parts = datagram.split_first_chunk::<TAG_AT>().and_then(|(associated, rest)| {
        let (tag, message) = rest.split_first_chunk::<{ HEADER_LEN - TAG_AT }>()?;
        Some((associated, tag, message))
    });
    parts.is_some_and(|(associated, tag, message)| {
        aead::open(key, counter, &clear(associated, message), &mut [], tag)
    })
}

/// Which key the header names, and the counter under it; none for a datagram in clear.
#[must_use]
pub fn named_key(datagram: &[u8]) -> Option<(u8, u64)> {
    let (_, rest) = datagram.split_at_checked(KEY_AT)?;
    let (&number, rest) = rest.split_first()?;
    let (&counter, _) = rest.split_first_chunk::<8>()?;
    (number != 0).then(|| (number, u64::from_le_bytes(counter)))
}
