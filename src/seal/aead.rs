//! ChaCha20-Poly1305 in place, with the tag beside.
//!
//! ```text
//!   key, nonce ─▶ ChaCha20 block 0 ─▶ one-time key ─▶ Poly1305(associated, 0…, text, 0…, both lengths) ─▶ tag
//!              └▶ block 1 …  ⊕ text
//! ```
//!
//! Source: RFC 8439, section 2.8. Put together from the two primitives: the crate of both links a panic.

use chacha20::cipher::{KeyIvInit, StreamCipher, StreamCipherCore, StreamCipherCoreWrapper};
use chacha20::variants::Ietf;
use chacha20::{ChaChaCore, R20};
use poly1305::Poly1305;
use poly1305::universal_hash::{KeyInit, UniversalHash};
use subtle::ConstantTimeEq;

use super::Key;

/// ChaCha20 of RFC 8439, without a buffer for the rest of a block.
type Core = ChaChaCore<R20, Ietf>;

/// Proves a text and what is associated with it.
pub(super) type Tag = [u8; 16];

/// Encrypts `text` in place.
///
/// Under one key no counter may come twice.
pub(super) fn seal(key: &Key, counter: u64, associated: &[u8], text: &mut [u8]) -> Tag {
    let (cipher, mac) = begin(key, counter);
    apply(cipher, text);
    tag(mac, associated, text)
}

/// Decrypts `text` in place, if the tag is right; else it stays as it is.
pub(super) fn open(key: &Key, counter: u64, associated: &[u8], text: &mut [u8], given: &Tag) -> bool {
    let (cipher, mac) = begin(key, counter);
    let is_right = bool::from(tag(mac, associated, text).ct_eq(given));
    if is_right {
        apply(cipher, text);
    }
    is_right
}

/// The cipher at its second block, and the authenticator keyed by its first.
fn begin(key: &Key, counter: u64) -> (Core, Poly1305) {
    let mut nonce = [0; 12];
    if let Some(low) = nonce.last_chunk_mut::<8>() {
        *low = counter.to_le_bytes();
    }
    let mut cipher = Core::new(&key.0.into(), &nonce.into());
    let mut block = [0; 64].into();
    cipher.write_keystream_block(&mut block);
    let mut one_time = [0; 32];
    one_time.iter_mut().zip(block).for_each(|(slot, byte)| *slot = byte);
    (cipher, Poly1305::new(&one_time.into()))
}

/// A key's stream ends after 256 GB; a datagram has 1400 bytes.
fn apply(cipher: Core, text: &mut [u8]) {
    let _ = StreamCipherCoreWrapper::from_core(cipher).try_apply_keystream(text);
}

fn tag(mut mac: Poly1305, associated: &[u8], text: &[u8]) -> Tag {
    mac.update_padded(associated);
    mac.update_padded(text);
    let mut lengths = [0; 16];
    let both = (associated.len() as u64).to_le_bytes().into_iter().chain((text.len() as u64).to_le_bytes());
    lengths.iter_mut().zip(both).for_each(|(slot, byte)| *slot = byte);
    mac.update(&[lengths.into()]);
    mac.finalize().into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn bytes(hex: &str) -> Vec<u8> {
        let digits: Vec<u8> = hex.bytes().filter(u8::is_ascii_hexdigit).collect();
        digits
            .chunks(2)
            .map(|pair| u8::from_str_radix(core::str::from_utf8(pair).unwrap(), 16).unwrap())
            .collect()
    }

    /// RFC 8439, appendix A.5: key, nonce and associated data of its own; the nonce's first four bytes are 0.
    #[test]
    fn the_text_of_the_rfc_opens() {
        let key = Key(bytes("1c9240a5eb55d38af333888604f6b5f0473917c1402b80099dca5cbc207075c0")
            .try_into()
            .unwrap());
        let counter = u64::from_le_bytes(bytes("0102030405060708").try_into().unwrap());
        let mut text = bytes(
            "64a0861575861af460f062c79be643bd5e805cfd345cf389f108670ac76c8cb24c6cfc18755d43eea09ee94e382d26b0\
             bdb7b73c321b0100d4f03b7f355894cf332f830e710b97ce98c8a84abd0b948114ad176e008d33bd60f982b1ff37c855\
             9797a06ef4f0ef61c186324e2b3506383606907b6a7c02b0f9f6157b53c867e4b9166c767b804d46a59b5216cde7a4e9\
             9040c5a40433225ee282a1b0a06c523eaf4534d7f83fa1155b0047718cbc546a0d072b04b3564eea1b422273f548271a\
             0bb2316053fa76991955ebd63159434ecebb4e466dae5a1073a6727627097a1049e617d91d361094fa68f0ff77987130\
             305beaba2eda04df997b714d6c6f2c29a6ad5cb4022b02709b",
        );
        let tag = bytes("eead9d67890cbb22392336fea1851f38").try_into().unwrap();
        let associated = bytes("f33388860000000000004e91");
        let sealed = text.clone();
        assert!(open(&key, counter, &associated, &mut text, &tag));
        assert!(text.starts_with(b"Internet-Drafts are draft documents valid for a maximum of six months"));
        assert_eq!(seal(&key, counter, &associated, &mut text), tag);
        assert_eq!(text, sealed);
    }

    #[test]
    fn a_bit_changed_anywhere_opens_nothing_and_leaves_the_text_as_it_was() {
        let (key, associated, plain) = (Key([7; 32]), [1_u8; 24], [2_u8; 70]);
        let mut sealed = plain;
        let tag = seal(&key, 9, &associated, &mut sealed);
        for bit in 0..(70 + 24 + 16) * 8 {
            let (mut text, mut beside, mut proof) = (sealed, associated, tag);
            let (byte, mask) = (bit / 8, 1 << (bit % 8));
            match byte {
                0..70 => text[byte] ^= mask,
                70..94 => beside[byte - 70] ^= mask,
                _ => proof[byte - 94] ^= mask,
            }
            let before = text;
            assert!(!open(&key, 9, &beside, &mut text, &proof), "bit {bit}");
            assert_eq!(text, before);
        }
        assert!(!open(&key, 8, &associated, &mut sealed.clone(), &tag), "another counter");
        assert!(!open(&Key([8; 32]), 9, &associated, &mut sealed.clone(), &tag), "another key");
        assert!(open(&key, 9, &associated, &mut sealed, &tag));
        assert_eq!(sealed, plain);
    }
}
