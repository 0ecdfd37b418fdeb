//! Flash for a board that has none: memory that behaves like it, with error correction and losses of power.
//!
//! ```text
//! 0x21000000 ┌──────────┬──────────┬─ … ─┬──────────┐
//!            │ page 0   │ page 1   │     │ page 31  │   32 pages of 4 KiB
//!            └──────────┴──────────┴─ … ─┴──────────┘   erase: a page to ones
//!              words of 16 bytes                        write: ones to zeros
//! 0x21020000 │ cut │ from erasure │ reached │ cut word │ a bit for each word that cannot be read │   Control
//! 0x21040000 ┌──────── … ────────┐
//!            │ images, slots.rs  │                          as flash, too; all of its words can be read
//!            └──────── … ────────┘
//! ```
//!
//! QEMU can keep that memory in a file of the host, so that it survives like flash. A test on the host says there at which
//! operation the power goes, and in whose midst: the word there is half done, and nothing is stored from then on. What a test
//! leaves of that word, and whether it can be read, is for the test to choose. The word is the largest of the real boards'
//! (STM32H563), so that what is stored here can be stored there.

use core::future;
use core::ops::Range;
use core::sync::atomic::{AtomicU32, Ordering};

use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use kehai::store::damaged::ZeroDamaged;

/// Bytes of a page.
pub const PAGE_LEN: usize = 4096;
/// Bytes of a word.
pub const WORD_LEN: usize = 16;
/// Bytes of settings and background: the same on every board.
pub const STORAGE_LEN: usize = 128 * 1024;
/// Where images begin.
pub const IMAGES_AT: usize = 0x4_0000;

/// Bits of [`Control::damaged`] in one of its words.
const BITS: usize = u32::BITS as usize;
/// What [`Control::reached`] counts in.
const PARTS: usize = 256;
/// Set in [`Control::cut_word`] for an erasure.
const ERASURE: u32 = 1 << 31;

/// Memory behind the storage, shared with a test on the host; all 0: nothing goes wrong.
#[repr(C)]
pub struct Control {
    /// The power goes in this operation from now on, 1 for the next; 0 for in none.
    pub cut: AtomicU32,
    /// Not 0: operations count only from the next erasure on.
    pub from_erasure: AtomicU32,
    /// How many of that operation's words are done before, in 256ths.
    pub reached: AtomicU32,
    /// The word that was half done when the power went, from 1; 0 while it is there.
    pub cut_word: AtomicU32,
    /// A bit for each word that cannot be read until its page is erased.
    pub damaged: [AtomicU32; STORAGE_LEN / WORD_LEN / BITS],
}

impl Control {
    /// How many of an operation's `words` are done, if the power goes in it.
    fn cut_in(&self, words: usize, erases: bool) -> Option<usize> {
        let left = self.cut.load(Ordering::Relaxed);
        if left == 0 || !erases && self.from_erasure.load(Ordering::Relaxed) != 0 {
            return None;
        }
        self.from_erasure.store(0, Ordering::Relaxed);
        self.cut.store(left - 1, Ordering::Relaxed);
        let reached = self.reached.load(Ordering::Relaxed) as usize % PARTS;
        (left == 1).then_some(words * reached / PARTS)
    }

    /// The bit of a word, and where it is.
    fn bit(&self, word: usize) -> Option<(&AtomicU32, u32)> {
        Some((self.damaged.get(word / BITS)?, 1 << (word % BITS)))
    }

    fn is_damaged(&self, mut words: Range<usize>) -> bool {
        words.any(|word| self.bit(word).is_some_and(|(bits, bit)| bits.load(Ordering::Relaxed) & bit != 0))
    }

    fn repair(&self, word: usize) {
        if let Some((bits, bit)) = self.bit(word) {
            bits.store(bits.load(Ordering::Relaxed) & !bit, Ordering::Relaxed);
        }
    }
}

/// Memory that behaves like flash.
pub struct Storage {
    memory: &'static mut [u8],
    images: &'static mut [u8],
    control: &'static Control,
}

/// Why an access failed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum StorageError {
    /// Outside the storage, or not at the bounds of its words and pages.
    BadAddress,
    /// A word that cannot be read.
    Damaged,
}

impl NorFlashError for StorageError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::BadAddress => NorFlashErrorKind::OutOfBounds,
            Self::Damaged => NorFlashErrorKind::Other,
        }
    }
}

/// Flash in `memory`, and images: damaged words read as zeros.
pub fn storage(
    (memory, images): (&'static mut [u8], &'static mut [u8]),
    control: &'static Control,
) -> ZeroDamaged<Storage, fn(&StorageError) -> bool> {
    ZeroDamaged::new(Storage { memory, images, control }, |error| *error == StorageError::Damaged)
}

impl Storage {
    /// `len` bytes from `offset` on, both multiples of `unit`.
    fn part(&mut self, offset: u32, len: usize, unit: usize) -> Result<&mut [u8], StorageError> {
        let offset = offset as usize;
        if !offset.is_multiple_of(unit) || !len.is_multiple_of(unit) {
            return Err(StorageError::BadAddress);
        }
        let (memory, offset) = match offset.checked_sub(IMAGES_AT) {
            Some(offset) => (&mut *self.images, offset),
            None => (&mut *self.memory, offset),
        };
        memory.get_mut(offset..).and_then(|rest| rest.get_mut(..len)).ok_or(StorageError::BadAddress)
    }

    /// Changes whole words with `change`; never done if the power goes in the midst of them.
    async fn operate(
        &mut self,
        offset: u32,
        len: usize,
        unit: usize,
        mut change: impl FnMut(usize, &mut [u8]),
    ) -> Result<(), StorageError> {
        let erases = unit == PAGE_LEN;
        let control = self.control;
        let words = self.part(offset, len, unit)?.chunks_exact_mut(WORD_LEN);
        let first = offset as usize / WORD_LEN;
        let cut = control.cut_in(words.len(), erases);
        for (number, word) in words.enumerate() {
            if cut == Some(number) {
                if let Some((half, _)) = word.split_at_mut_checked(WORD_LEN / 2) {
                    change(number, half);
                }
                let which = (first + number + 1) as u32 | if erases { ERASURE } else { 0 };
                control.cut_word.store(which, Ordering::Relaxed);
                future::pending::<()>().await;
            }
            change(number, word);
            if erases {
                control.repair(first + number);
            }
        }
        Ok(())
    }
}

impl ErrorType for Storage {
    type Error = StorageError;
}

impl ReadNorFlash for Storage {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), StorageError> {
        let part = self.part(offset, bytes.len(), Self::READ_SIZE)?;
        bytes.copy_from_slice(part);
        let (from, to) = (offset as usize, offset as usize + bytes.len());
        if self.control.is_damaged(from / WORD_LEN..to.div_ceil(WORD_LEN)) {
            return Err(StorageError::Damaged);
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        IMAGES_AT + self.images.len()
    }
}

impl NorFlash for Storage {
    const WRITE_SIZE: usize = WORD_LEN;
    const ERASE_SIZE: usize = PAGE_LEN;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), StorageError> {
        let len = to.checked_sub(from).ok_or(StorageError::BadAddress)?;
        self.operate(from, len as usize, PAGE_LEN, |_, word| word.fill(0xff)).await
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), StorageError> {
        let written = |number: usize| bytes.get(number * WORD_LEN..).unwrap_or(&[]);
        self.operate(offset, bytes.len(), WORD_LEN, |number, word| {
            word.iter_mut().zip(written(number)).for_each(|(place, &byte)| *place &= byte);
        })
        .await
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embassy_futures::{block_on, poll_once};

    fn erased() -> (&'static mut [u8], &'static Control) {
        let control = Control {
            cut: AtomicU32::new(0),
            from_erasure: AtomicU32::new(0),
            reached: AtomicU32::new(0),
            cut_word: AtomicU32::new(0),
            damaged: [const { AtomicU32::new(0) }; STORAGE_LEN / WORD_LEN / BITS],
        };
        (Box::leak(vec![0xff; 4 * PAGE_LEN].into_boxed_slice()), Box::leak(Box::new(control)))
    }

    fn storage() -> Storage {
        let (memory, control) = erased();
        Storage { memory, images: &mut [], control }
    }

    #[test]
    fn writing_only_clears_bits_and_erasing_sets_them_again() {
        let mut storage = storage();
        let mut byte = [0];
        for (written, left) in [(0xf0, 0xf0), (0x3c, 0x30), (0xff, 0x30)] {
            block_on(storage.write(4096, &[written; WORD_LEN])).unwrap();
            block_on(storage.read(4096 + 15, &mut byte)).unwrap();
            assert_eq!(byte, [left]);
        }
        block_on(storage.erase(4096, 8192)).unwrap();
        block_on(storage.read(4096, &mut byte)).unwrap();
        assert_eq!(byte, [0xff]);
    }

    #[test]
    fn a_page_is_erased_without_its_neighbours() {
        let mut storage = storage();
        block_on(storage.write(0, &[0; 4 * PAGE_LEN])).unwrap();
        block_on(storage.erase(4096, 8192)).unwrap();
        let mut all = [0; 4 * PAGE_LEN];
        block_on(storage.read(0, &mut all)).unwrap();
        assert!(all.chunks(PAGE_LEN).map(|page| page[0]).eq([0, 0xff, 0, 0]));
        assert!(all.chunks(PAGE_LEN).all(|page| page.iter().all(|byte| byte == &page[0])));
    }

    #[test]
    fn what_is_not_at_the_bounds_of_words_and_pages_is_refused() {
        let mut storage = storage();
        let refused = Err(StorageError::BadAddress);
        assert_eq!(block_on(storage.write(8, &[0; WORD_LEN])), refused);
        assert_eq!(block_on(storage.write(0, &[0; 15])), refused);
        assert_eq!(block_on(storage.erase(0, 100)), refused);
        assert_eq!(block_on(storage.erase(8192, 4096)), refused);
        assert_eq!(block_on(storage.erase(0, 5 * 4096)), refused);
        assert_eq!(block_on(storage.read(16 * 1024 - 1, &mut [0; 2])), refused);
    }

    #[test]
    fn the_power_goes_in_the_midst_of_the_operation_that_is_asked_for() {
        let mut storage = storage();
        storage.control.cut.store(2, Ordering::Relaxed);
        storage.control.reached.store(128, Ordering::Relaxed);
        block_on(storage.write(0, &[0; WORD_LEN])).unwrap();
        assert!(poll_once(storage.write(32, &[0; 4 * WORD_LEN])).is_pending());
        assert_eq!(storage.control.cut_word.load(Ordering::Relaxed), 2 + 2 + 1);
        let written: Vec<bool> = storage.memory[32..96].chunks(8).map(|half| half == [0; 8]).collect();
        assert_eq!(written, [true, true, true, true, true, false, false, false]);
        // From the next erasure on.
        storage.control.cut.store(1, Ordering::Relaxed);
        storage.control.from_erasure.store(1, Ordering::Relaxed);
        storage.control.cut_word.store(0, Ordering::Relaxed);
        block_on(storage.write(0, &[0; WORD_LEN])).unwrap();
        assert!(poll_once(storage.erase(0, PAGE_LEN as u32)).is_pending());
        assert_eq!(storage.control.cut_word.load(Ordering::Relaxed), ERASURE | 129);
    }

    #[test]
    fn a_damaged_word_cannot_be_read_until_its_page_is_erased() {
        let mut storage = storage();
        storage.control.damaged[8].store(1, Ordering::Relaxed);
        let mut bytes = [0; 2 * WORD_LEN];
        assert_eq!(block_on(storage.read(4096 - 16, &mut bytes)), Err(StorageError::Damaged));
        assert_eq!(block_on(storage.read(4096 + 16, &mut bytes)), Ok(()));
        block_on(storage.erase(4096, 8192)).unwrap();
        assert_eq!(block_on(storage.read(4096 - 16, &mut bytes)), Ok(()));
    }

    #[test]
    fn the_store_reads_a_damaged_word_as_zeros() {
        let (memory, control) = erased();
        control.damaged[0].store(1 << 1, Ordering::Relaxed);
        let mut bytes = [7; 3 * WORD_LEN];
        block_on(super::storage((memory, &mut []), control).read(0, &mut bytes)).unwrap();
        let words: Vec<[u8; WORD_LEN]> = bytes.as_chunks().0.to_vec();
        assert_eq!(words, [[0xff; WORD_LEN], [0; WORD_LEN], [0xff; WORD_LEN]]);
    }
}
