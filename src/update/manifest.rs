//! What an image is, signed by its maker: the first 192 bytes of an image's file.
//!
//! ```text
//!    0  "kehai\0i\x01"    8
//!    8  program          16   ASCII, zeros behind it: the board's name, or that of another program for that board
//!   24  version           6   major, minor, patch, u16 each
//!   30  least version     6   once this image has confirmed itself, no image below this version starts any more
//!   36  size              4   bytes of the image
//!   40  digest           64   SHA-512 of the image
//!  104  zeros            24
//!  128  signature        64   Ed25519, of the 128 bytes before
//!  192
//! ```
//!
//! In a file the image follows at once. Integers are little-endian.
//!
//! Source: RFC 8032 (Ed25519), FIPS 180-4 (SHA-512).

use super::Version;

/// Bytes of a manifest.
pub const MANIFEST_LEN: usize = 192;
/// Bytes of it that are signed.
pub const SIGNED_LEN: usize = 128;
/// Most bytes of a program's name.
pub const PROGRAM_MAX: usize = 16;

const MAGIC: [u8; 8] = *b"kehai\0i\x01";

/// What an image says of itself.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Manifest {
    /// The program's name, zeros behind it.
    pub program: [u8; PROGRAM_MAX],
    /// Its version.
    pub version: Version,
    /// The lowest version that may start after it has confirmed itself.
    pub least: Version,
    /// Bytes of the image.
    pub size: u32,
    /// Their SHA-512.
    pub digest: [u8; 64],
}

/// The bytes are no manifest.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NoManifest;

/// A program's name with zeros behind it; what is too long is cut off.
#[must_use]
pub fn program(name: &str) -> [u8; PROGRAM_MAX] {
    let mut program = [0; PROGRAM_MAX];
    program.iter_mut().zip(name.bytes()).for_each(|(place, byte)| *place = byte);
    program
}

impl Manifest {
    /// Reads a manifest; its signature is not looked at.
    ///
    /// # Errors
    /// [`NoManifest`].
    pub fn read(bytes: &[u8; MANIFEST_LEN]) -> Result<Self, NoManifest> {
        let (magic, rest) = bytes.split_first_chunk().ok_or(NoManifest)?;
        let (program, rest) = rest.split_first_chunk().ok_or(NoManifest)?;
        let (version, rest) = rest.split_first_chunk().ok_or(NoManifest)?;
        let (least, rest) = rest.split_first_chunk().ok_or(NoManifest)?;
        let (size, rest) = rest.split_first_chunk().ok_or(NoManifest)?;
        let (digest, _) = rest.split_first_chunk().ok_or(NoManifest)?;
        if *magic != MAGIC {
            return Err(NoManifest);
        }
        Ok(Self {
            program: *program,
            version: Version::from_bytes(*version),
            least: Version::from_bytes(*least),
            size: u32::from_le_bytes(*size),
            digest: *digest,
        })
    }

    /// The bytes that are signed.
    #[must_use]
    pub fn signed_bytes(&self) -> [u8; SIGNED_LEN] {
        let mut bytes = [0; SIGNED_LEN];
        let head = MAGIC.into_iter().chain(self.program);
        let versions = self.version.bytes().into_iter().chain(self.least.bytes());
        let all = head.chain(versions).chain(self.size.to_le_bytes()).chain(self.digest);
        bytes.iter_mut().zip(all).for_each(|(place, byte)| *place = byte);
        bytes
    }

    /// The bytes of a manifest that are signed, and the signature.
    #[must_use]
    pub fn signature(bytes: &[u8; MANIFEST_LEN]) -> (&[u8; SIGNED_LEN], &[u8; MANIFEST_LEN - SIGNED_LEN]) {
        const NONE: &[u8; MANIFEST_LEN - SIGNED_LEN] = &[0; MANIFEST_LEN - SIGNED_LEN];
        const NOTHING: &[u8; SIGNED_LEN] = &[0; SIGNED_LEN];
        match bytes.split_first_chunk() {
            Some((signed, signature)) => (signed, signature.first_chunk().unwrap_or(NONE)),
            None => (NOTHING, NONE),
        }
    }

    /// The name of its program.
    #[must_use]
    pub fn program_name(&self) -> &str {
        let length = self.program.iter().position(|&byte| byte == 0).unwrap_or(PROGRAM_MAX);
        self.program.get(..length).and_then(|name| core::str::from_utf8(name).ok()).unwrap_or("")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_manifest_reads_as_it_was_written() {
        let manifest = Manifest {
            program: program("w5500-evb-pico2"),
            version: Version([1, 2, 300]),
            least: Version([1, 0, 0]),
            size: 190_000,
            digest: core::array::from_fn(|index| index as u8),
        };
        let mut bytes = [7; MANIFEST_LEN];
        bytes[..SIGNED_LEN].copy_from_slice(&manifest.signed_bytes());
        assert_eq!(Manifest::read(&bytes), Ok(manifest));
        assert_eq!(manifest.program_name(), "w5500-evb-pico2");
        assert_eq!(Manifest::signature(&bytes), (&manifest.signed_bytes(), &[7; 64]));
        bytes[7] = 2;
        assert_eq!(Manifest::read(&bytes), Err(NoManifest));
    }
}
