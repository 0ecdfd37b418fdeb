//! Flash as it is when the power fails: garbage where a word was being written, pages erased in parts, words that
//! cannot be read.
//!
//! ```text
//!   written    │ whole  │ whole  │ ? │ as it was │      ? is the old word, half a word, any bits, or unreadable
//!   erased     │ erased │ erased │ ? │ as it was │      from its beginning on
//!                                  └ the choices come from a seed: the same seed, the same damage
//! ```
//!
//! A page whose erasure is cut is erased up to some word here. Real cells are erased at once, each at its own speed: a page
//! of which any words are left, its first among them, is not tried. `sequential-storage` could take it for a whole one.
//!
//! Source: RM0481 (STM32H5), embedded flash memory: what a programming or erase operation cut short leaves is undefined,
//! and may raise an ECC error when it is read.
#![allow(dead_code, reason = "the tests and the fuzz target use a part of this each")]

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::rc::Rc;

use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use kehai::store::damaged::ZeroDamaged;
use kehai::store::flash::FlashStore;

/// Bytes of a word, as the STM32H5 has it.
pub const WORD: usize = 16;

/// Why an access failed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum RoughError {
    NoPower,
    Damaged,
    BadAddress,
}

impl NorFlashError for RoughError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// Flash with pages of so many bytes. Clones are the same flash.
#[derive(Clone, Debug)]
pub struct Rough<const PAGE: usize>(Rc<RefCell<State>>);

#[derive(Clone, Debug)]
struct State {
    bytes: Vec<u8>,
    damaged: BTreeSet<usize>,
    /// Error correction: garbage may be unreadable.
    corrects_errors: bool,
    off: bool,
    /// Writes and erasures until the power goes, and the seed of what it leaves.
    cut: Option<(u32, u64)>,
    operations: u32,
}

/// The store in such flash.
pub type RoughStore<const PAGE: usize> = FlashStore<ZeroDamaged<Rough<PAGE>, fn(&RoughError) -> bool>>;

/// Steele's SplitMix64.
fn mix(seed: &mut u64) -> u64 {
    *seed = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mixed = (*seed ^ *seed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ mixed >> 31
}

impl<const PAGE: usize> Rough<PAGE> {
    /// Erased flash.
    pub fn new(pages: usize, corrects_errors: bool) -> Self {
        let (bytes, damaged) = (vec![0xff; pages * PAGE], BTreeSet::new());
        Self(Rc::new(RefCell::new(State {
            bytes,
            damaged,
            corrects_errors,
            off: false,
            cut: None,
            operations: 0,
        })))
    }

    /// A store that has just begun with it.
    pub fn store(&self) -> RoughStore<PAGE> {
        let is_damaged: fn(&RoughError) -> bool = |error| *error == RoughError::Damaged;
        let len = self.capacity() as u32;
        FlashStore::new(ZeroDamaged::new(self.clone(), is_damaged), 0..len).expect("whole pages")
    }

    /// Another flash that holds the same.
    pub fn copy(&self) -> Self {
        Self(Rc::new(RefCell::new(self.0.borrow().clone())))
    }

    /// Cuts the power in the midst of the `after`-th write or erasure from now on.
    pub fn cut(&self, after: u32, seed: u64) {
        self.0.borrow_mut().cut = Some((after, seed));
    }

    /// The power is there again. Whether it was cut.
    pub fn power_on(&self) -> bool {
        let mut state = self.0.borrow_mut();
        state.cut = None;
        std::mem::take(&mut state.off)
    }

    /// Writes and erasures so far.
    pub fn operations(&self) -> u32 {
        self.0.borrow().operations
    }

    /// Words that cannot be read.
    pub fn damaged(&self) -> usize {
        self.0.borrow().damaged.len()
    }

    /// Changes a word as age and radiation do: a bit, or all of it.
    pub fn corrupt(&self, seed: u64) {
        let mut seed = seed;
        let mut state = self.0.borrow_mut();
        let word = mix(&mut seed) as usize % (state.bytes.len() / WORD);
        if mix(&mut seed).is_multiple_of(2) {
            state.spoil(word, None, &mut seed);
        } else {
            state.bytes[word * WORD + mix(&mut seed) as usize % WORD] ^= 1 << (mix(&mut seed) % 8);
        }
    }
}

impl State {
    /// Leaves a word as it was, half written, as any bits, or unreadable.
    fn spoil(&mut self, word: usize, written: Option<&[u8]>, seed: &mut u64) {
        let place = &mut self.bytes[word * WORD..][..WORD];
        match (mix(seed) % 4, written) {
            (0, _) => {}
            (1, Some(written)) => {
                place.iter_mut().zip(written).take(WORD / 2).for_each(|(place, byte)| *place &= byte);
            }
            (2, Some(written)) => {
                // The cells that are done, and those that are not.
                place.iter_mut().zip(written).for_each(|(place, byte)| *place &= byte | mix(seed) as u8);
            }
            _ => place.fill_with(|| mix(seed) as u8),
        }
        if self.corrects_errors && mix(seed).is_multiple_of(2) {
            self.damaged.insert(word);
        }
    }

    /// Does an operation on whole words; `written` are the bytes of a write, none of an erasure.
    fn operate(
        &mut self,
        offset: usize,
        len: usize,
        unit: usize,
        written: Option<&[u8]>,
    ) -> Result<(), RoughError> {
        let inside = offset.checked_add(len).is_some_and(|end| end <= self.bytes.len());
        if !inside || !offset.is_multiple_of(unit) || !len.is_multiple_of(unit) {
            return Err(RoughError::BadAddress);
        }
        if self.off {
            return Err(RoughError::NoPower);
        }
        self.operations += 1;
        let words = offset / WORD..(offset + len) / WORD;
        let of = |word: usize| written.map(|bytes| &bytes[word * WORD - offset..][..WORD]);
        let whole = |state: &mut Self, word: usize| {
            let place = &mut state.bytes[word * WORD..][..WORD];
            match of(word) {
                Some(bytes) => place.iter_mut().zip(bytes).for_each(|(place, byte)| *place &= byte),
                None => {
                    place.fill(0xff);
                    state.damaged.remove(&word);
                }
            }
        };
        match &mut self.cut {
            Some((0, seed)) => {
                let mut seed = *seed;
                self.off = true;
                let reached = words.start + mix(&mut seed) as usize % words.len().max(1);
                for word in words {
                    match word.cmp(&reached) {
                        std::cmp::Ordering::Less => whole(self, word),
                        std::cmp::Ordering::Equal => self.spoil(word, of(word), &mut seed),
                        std::cmp::Ordering::Greater => {}
                    }
                }
                Err(RoughError::NoPower)
            }
            left => {
                if let Some((left, _)) = left {
                    *left -= 1;
                }
                words.for_each(|word| whole(self, word));
                Ok(())
            }
        }
    }
}

impl<const PAGE: usize> ErrorType for Rough<PAGE> {
    type Error = RoughError;
}

impl<const PAGE: usize> ReadNorFlash for Rough<PAGE> {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), RoughError> {
        let state = self.0.borrow();
        if state.off {
            return Err(RoughError::NoPower);
        }
        let from = offset as usize;
        let part = state.bytes.get(from..from + bytes.len()).ok_or(RoughError::BadAddress)?;
        if state.damaged.range(from / WORD..(from + bytes.len()).div_ceil(WORD)).next().is_some() {
            return Err(RoughError::Damaged);
        }
        bytes.copy_from_slice(part);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.borrow().bytes.len()
    }
}

impl<const PAGE: usize> NorFlash for Rough<PAGE> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), RoughError> {
        let len = to.checked_sub(from).ok_or(RoughError::BadAddress)? as usize;
        self.0.borrow_mut().operate(from as usize, len, PAGE, None)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), RoughError> {
        self.0.borrow_mut().operate(offset as usize, bytes.len(), WORD, Some(bytes))
    }
}
