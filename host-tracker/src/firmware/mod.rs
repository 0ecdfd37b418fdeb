//! Firmware in files: images made of what a compiler wrote, signed, read and looked at.
//!
//! ```text
//!   ELF │ bytes ─▶ flatten ─▶ image ─ sign ─▶ manifest 192, image    NAME.kehai
//! ```
//!
//! The signature is Ed25519, by a maker whose public key is in the boot loader of the modules. `update` is how such an
//! image is brought to modules, one after the other; `folder` is what lies on this machine for new boards.

mod flatten;
pub mod folder;
pub mod update;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use data_encoding::{HEXLOWER, HEXLOWER_PERMISSIVE};
use kehai::update::Version;
use kehai::update::manifest::{MANIFEST_LEN, Manifest, PROGRAM_MAX, SIGNED_LEN, program};
use ring::digest::{SHA512, digest};
use ring::signature::{ED25519, Ed25519KeyPair, KeyPair, UnparsedPublicKey};

use crate::owned_file;

pub use flatten::flatten;

/// Why there is no image, or no key.
#[derive(Debug, thiserror::Error)]
pub enum FirmwareError {
    /// The system.
    #[error("{}: {error}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// Something else is in the file.
    #[error("{}: {what}", file.display())]
    Wrong {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// The system has no randomness.
    #[error("no key can be made: {0}")]
    Random(#[from] getrandom::Error),
}

impl FirmwareError {
    fn file(file: &Path) -> impl FnOnce(io::Error) -> Self + '_ {
        |error| Self::File { file: file.to_owned(), error }
    }

    fn wrong(file: &Path, what: impl Into<String>) -> Self {
        Self::Wrong { file: file.to_owned(), what: what.into() }
    }
}

/// A maker's secret.
#[derive(Debug)]
pub struct MakerKey(Ed25519KeyPair);

impl MakerKey {
    /// Makes one, and writes it to a file that is for its owner alone.
    ///
    /// # Errors
    /// [`FirmwareError`]; a file that is there stays as it is.
    pub fn create(file: &Path) -> Result<Self, FirmwareError> {
        if file.exists() {
            return Err(FirmwareError::wrong(file, "is there already: a lost key is never made again"));
        }
        let mut seed = [0; 32];
        getrandom::fill(&mut seed)?;
        let text = format!("{}\n", HEXLOWER.encode(&seed));
        let folder = owned_file::folder_of(file).map_err(FirmwareError::file(file))?;
        owned_file::write(file, &folder, text.as_bytes()).map_err(FirmwareError::file(file))?;
        Self::of_seed(file, &seed)
    }

    /// Reads one.
    ///
    /// # Errors
    /// [`FirmwareError`].
    pub fn load(file: &Path) -> Result<Self, FirmwareError> {
        let text = fs::read_to_string(file).map_err(FirmwareError::file(file))?;
        let seed = HEXLOWER_PERMISSIVE.decode(text.trim().as_bytes()).ok();
        let seed: Option<[u8; 32]> = seed.and_then(|seed| seed.try_into().ok());
        Self::of_seed(
            file,
            &seed.ok_or_else(|| FirmwareError::wrong(file, "is no key of a maker: 64 hexadecimal digits"))?,
        )
    }

    fn of_seed(file: &Path, seed: &[u8; 32]) -> Result<Self, FirmwareError> {
        let pair = Ed25519KeyPair::from_seed_unchecked(seed);
        pair.map(Self).map_err(|error| FirmwareError::wrong(file, format!("is no key of a maker: {error}")))
    }

    /// The public key: what boot loaders are built with.
    #[must_use]
    pub fn public(&self) -> [u8; 32] {
        let mut public = [0; 32];
        public.copy_from_slice(self.0.public_key().as_ref());
        public
    }
}

/// An image and its manifest.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SignedImage {
    /// As it is in the file: 192 bytes.
    pub manifest: [u8; MANIFEST_LEN],
    /// What that says.
    pub about: Manifest,
    /// The image.
    pub bytes: Vec<u8>,
}

impl SignedImage {
    /// Signs an image for a program of a board, the board's name if it is its only one.
    ///
    /// # Errors
    /// A text: the program's name is too long, or the image is empty or too large.
    pub fn sign(
        bytes: Vec<u8>,
        (name, version, least): (&str, Version, Version),
        key: &MakerKey,
    ) -> Result<Self, String> {
        if name.is_empty() || name.len() > PROGRAM_MAX || !name.is_ascii() {
            return Err(format!("a program's name has 1 to {PROGRAM_MAX} ASCII characters: \"{name}\""));
        }
        let size = u32::try_from(bytes.len())
            .ok()
            .filter(|size| *size > 0)
            .ok_or("the image is empty, or too large")?;
        if least > version {
            return Err(format!(
                "the image could not start itself again: its version is {version}, the least {least}"
            ));
        }
        let mut about = Manifest { program: program(name), version, least, size, digest: [0; 64] };
        about.digest.copy_from_slice(digest(&SHA512, &bytes).as_ref());
        let mut manifest = [0; MANIFEST_LEN];
        let (signed, signature) = manifest.split_at_mut(SIGNED_LEN);
        signed.copy_from_slice(&about.signed_bytes());
        signature.copy_from_slice(key.0.sign(signed).as_ref());
        Ok(Self { manifest, about, bytes })
    }

    /// Reads one; its signature is not looked at.
    ///
    /// # Errors
    /// [`FirmwareError`]: the file is none, is cut off or damaged.
    pub fn load(file: &Path) -> Result<Self, FirmwareError> {
        let all = fs::read(file).map_err(FirmwareError::file(file))?;
        let wrong = |what: &str| FirmwareError::wrong(file, what);
        let (manifest, bytes) =
            all.split_first_chunk::<MANIFEST_LEN>().ok_or_else(|| wrong("is no signed image: too short"))?;
        let about = Manifest::read(manifest)
            .map_err(|_| wrong("is no signed image: kehai-tracker firmware sign makes one"))?;
        if bytes.len() != about.size as usize {
            return Err(wrong(&format!("has {} bytes of an image of {}", bytes.len(), about.size)));
        }
        if digest(&SHA512, bytes).as_ref() != about.digest {
            return Err(wrong("is damaged: its digest is another"));
        }
        Ok(Self { manifest: *manifest, about, bytes: bytes.to_vec() })
    }

    /// Whether this maker has signed it.
    #[must_use]
    pub fn is_signed_by(&self, maker: &[u8; 32]) -> bool {
        let (signed, signature) = Manifest::signature(&self.manifest);
        UnparsedPublicKey::new(&ED25519, maker).verify(signed, signature).is_ok()
    }

    /// Writes it.
    ///
    /// # Errors
    /// [`FirmwareError`].
    pub fn save(&self, file: &Path) -> Result<(), FirmwareError> {
        let all = [self.manifest.as_slice(), &self.bytes].concat();
        fs::write(file, all).map_err(FirmwareError::file(file))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Signed here, taken by the very check that boot loaders make.
    #[test]
    fn a_boot_loader_takes_the_signature_and_the_digest() {
        let folder = tempfile::tempdir().unwrap();
        let key = MakerKey::create(&folder.path().join("maker.key")).unwrap();
        let versions = ("w5500-evb-pico2", Version([0, 3, 0]), Version([0, 2, 0]));
        let image = SignedImage::sign(vec![7; 5000], versions, &key).unwrap();
        let (signed, signature) = Manifest::signature(&image.manifest);
        let maker = salty::PublicKey::try_from(&key.public()).unwrap();
        assert!(maker.verify(signed, &salty::Signature::from(signature)).is_ok());
        let mut digest = salty::Sha512::new();
        digest.update(&image.bytes);
        assert_eq!(digest.finalize(), image.about.digest);
        assert!(image.is_signed_by(&key.public()));
        let other = MakerKey::create(&folder.path().join("other.key")).unwrap();
        assert!(!image.is_signed_by(&other.public()));
    }

    #[test]
    fn the_development_key_is_the_one_whose_secret_everybody_has() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/update/development.key");
        assert_eq!(MakerKey::load(&file).unwrap().public(), kehai::update::maker::DEVELOPMENT);
    }

    #[test]
    fn a_file_that_is_cut_off_or_changed_is_said_to_be() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("image.kehai");
        let key = MakerKey::create(&folder.path().join("maker.key")).unwrap();
        let image =
            SignedImage::sign(vec![7; 5000], ("pc", Version([1, 0, 0]), Version::default()), &key).unwrap();
        image.save(&file).unwrap();
        assert_eq!(SignedImage::load(&file).unwrap(), image);
        let whole = fs::read(&file).unwrap();
        for (bytes, what) in [
            (whole[..100].to_vec(), "too short"),
            (whole[..whole.len() - 1].to_vec(), "4999 bytes of an image of 5000"),
            ([&whole[..whole.len() - 1], &[8]].concat(), "damaged"),
            (vec![0; 5192], "no signed image"),
        ] {
            fs::write(&file, bytes).unwrap();
            let said = SignedImage::load(&file).unwrap_err().to_string();
            assert!(said.contains(what), "{said}");
        }
        assert!(MakerKey::create(&folder.path().join("maker.key")).is_err(), "it would be lost");
    }
}
