//! What a boot loader decides: whether the image in the spare slot is tried, and whether the one that was tried stays.
//!
//! ```text
//!   stage     state      then
//!   complete  booted     maker, program, version, size, digest ─▶ right: state swap, note tried │ wrong: note why
//!   complete  swap       power went between the two: note tried
//!   …         swap       swapped page by page; or, swapped before and not confirmed since: swapped back
//!   confirmed swap       state booted: power went between the two
//!   tried     no swap    it was swapped back: note reverted
//! ```
//!
//! The swap is `embassy-boot`'s: a step counts once a word says so, and a loss of power does it again. Whatever cannot be read
//! or written, the image in the active slot is started.
//!
//! Source: embassy-boot 0.7; RFC 8032 (Ed25519), by `salty`.

use core::cell::RefCell;
use core::ops::Range;

use embassy_boot::{BlockingFirmwareState, BootLoader, BootLoaderConfig, State};
use embassy_futures::block_on;
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use embedded_storage_async::nor_flash as waiting;
use salty::{PublicKey, Sha512, Signature};

use super::Version;
use super::manifest::{MANIFEST_LEN, Manifest, PROGRAM_MAX};
use super::notes::{CANDIDATE_LEN, Candidate, Fault, OUTCOME, REVERTED, Stage, WORD_LEN, least_of, mark};
use super::plan::pages;
use super::slots::Slots;

/// Bytes that are copied and digested at once: a part of every board's page.
const PIECE: usize = 1024;

/// What a boot loader starts images for.
#[derive(Clone, Copy, Debug)]
pub struct Policy<'a> {
    /// The program of this board.
    pub program: [u8; PROGRAM_MAX],
    /// The makers' public keys.
    pub makers: &'a [[u8; 32]],
}

/// A part of a flash, as a flash that is not waited for: a board's flash is done when its functions return.
struct Part<'a, F> {
    flash: &'a RefCell<F>,
    range: Range<u32>,
}

impl<F: waiting::NorFlash> ErrorType for Part<'_, F> {
    type Error = F::Error;
}

impl<F: waiting::NorFlash> ReadNorFlash for Part<'_, F> {
    const READ_SIZE: usize = F::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), F::Error> {
        block_on(self.flash.borrow_mut().read(self.range.start.saturating_add(offset), bytes))
    }

    fn capacity(&self) -> usize {
        self.range.len()
    }
}

impl<F: waiting::NorFlash> NorFlash for Part<'_, F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), F::Error> {
        let start = self.range.start;
        block_on(self.flash.borrow_mut().erase(start.saturating_add(from), start.saturating_add(to)))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), F::Error> {
        // A word that power cut off reads as the zeros that were meant, and cannot be written again.
        let mut now = [0xff; WORD_LEN];
        if let Some(now) = now.get_mut(..bytes.len()) {
            self.read(offset, now)?;
            if now == bytes {
                return Ok(());
            }
        }
        block_on(self.flash.borrow_mut().write(self.range.start.saturating_add(offset), bytes))
    }
}

/// Prepares the image in the active slot of this flash to be started.
pub fn prepare<F: waiting::NorFlash>(flash: F, slots: &Slots, policy: &Policy<'_>) {
    let flash = &RefCell::new(flash);
    let part = |range: &Range<u32>| Part { flash, range: range.clone() };
    let (versions, page) = pages(slots);
    let mut notes = part(&page);
    let mut piece = [0; PIECE];
    let config =
        BootLoaderConfig { active: part(&slots.active), dfu: part(&slots.spare), state: part(&slots.state) };
    let mut loader = BootLoader::new(config);
    let state = loader.read_state(&mut piece).unwrap_or(State::Boot);
    let mut bytes = [0xff; CANDIDATE_LEN];
    let candidate = notes.read(0, &mut bytes).ok().and_then(|()| Candidate::read(&bytes));
    if let Some(Candidate { manifest, stage: Stage::Complete, .. }) = candidate {
        let is_begun =
            bytes.get(OUTCOME as usize..).is_some_and(|rest| rest.iter().take(WORD_LEN).any(|&b| b != 0xff));
        match state {
            State::Swap => note(&mut notes, OUTCOME, &mark()),
            // An outcome that was half noted, and no swap: it was refused, or is swapped back.
            _ if is_begun => note(&mut notes, REVERTED, &mark()),
            _ => {
                let least = least(&mut part(&versions));
                let spare = &mut part(&slots.spare);
                match verify(&bytes, &manifest, (slots, spare, least), policy, &mut piece) {
                    Ok(()) => {
                        let mut state = part(&slots.state);
                        let word = piece.get_mut(..F::WRITE_SIZE).unwrap_or(&mut []);
                        if BlockingFirmwareState::new(&mut state, word).mark_updated().is_ok() {
                            note(&mut notes, OUTCOME, &mark());
                        }
                    }
                    Err(Some(fault)) => note(&mut notes, OUTCOME, &fault.word()),
                    // It cannot be read now.
                    Err(None) => {}
                }
            }
        }
    }
    if state == State::Swap && candidate.is_some_and(|candidate| candidate.stage == Stage::Confirmed) {
        let mut state = part(&slots.state);
        let word = piece.get_mut(..F::WRITE_SIZE).unwrap_or(&mut []);
        let _ = BlockingFirmwareState::new(&mut state, word).mark_booted();
    }
    // What is wrong with flash then, is wrong with the swap: the active image is what there is.
    let _ = loader.prepare_boot(&mut piece);
    let stage = notes.read(0, &mut bytes).ok().and_then(|()| Candidate::read(&bytes)).map(|one| one.stage);
    let swapped = loader.read_state(&mut piece).unwrap_or(State::Swap) == State::Swap;
    if !swapped && stage == Some(Stage::Tried) {
        note(&mut notes, REVERTED, &mark());
    }
}

/// Writes a word where it is erased. One that cannot be written is found missing, or half written, at the next start.
fn note<F: NorFlash>(notes: &mut F, at: u32, word: &[u8; WORD_LEN]) {
    let mut now = [0; WORD_LEN];
    if notes.read(at, &mut now).is_ok() && now == [0xff; WORD_LEN] {
        let _ = notes.write(at, word);
    }
}

/// The lowest version that may start.
fn least<F: NorFlash>(versions: &mut F) -> Version {
    let mut least = Version::default();
    for at in (0..versions.capacity()).step_by(WORD_LEN) {
        let mut word = [0; WORD_LEN];
        if versions.read(at as u32, &mut word).is_err() || word == [0xff; WORD_LEN] {
            break;
        }
        least = least_of(&word).map_or(least, |version| version.max(least));
    }
    least
}

/// Whether an image may be tried; why not, if that can be told.
fn verify<F: NorFlash>(
    notes: &[u8; CANDIDATE_LEN],
    manifest: &Manifest,
    (slots, spare, least): (&Slots, &mut F, Version),
    policy: &Policy<'_>,
    piece: &mut [u8; PIECE],
) -> Result<(), Option<Fault>> {
    let (signed, signature) = Manifest::signature(notes.first_chunk::<MANIFEST_LEN>().ok_or(None)?);
    let signature = Signature::from(signature);
    let by = |maker: &[u8; 32]| {
        PublicKey::try_from(maker).is_ok_and(|maker| maker.verify(signed, &signature).is_ok())
    };
    if !policy.makers.iter().any(by) {
        return Err(Some(Fault::Forged));
    }
    if manifest.program != policy.program {
        return Err(Some(Fault::OtherProgram));
    }
    if manifest.version < least {
        return Err(Some(Fault::TooOld));
    }
    if manifest.size == 0 || manifest.size as usize > slots.active.len() {
        return Err(Some(Fault::Damaged));
    }
    let mut digest = Sha512::new();
    for at in (0..manifest.size).step_by(PIECE) {
        let left = (manifest.size.saturating_sub(at) as usize).min(PIECE);
        let bytes = piece.get_mut(..left).ok_or(None)?;
        spare.read(at, bytes).map_err(|_| None)?;
        digest.update(bytes);
    }
    if digest.finalize() == manifest.digest { Ok(()) } else { Err(Some(Fault::Damaged)) }
}
