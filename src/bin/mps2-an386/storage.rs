//! Flash for a board that has none: memory that behaves like it.
//!
//! ```text
//! 0x21000000 ┌──────────┬──────────┬─ … ─┬──────────┐
//!            │ page 0   │ page 1   │     │ page 31  │   32 pages of 4 KiB
//!            └──────────┴──────────┴─ … ─┴──────────┘   erase: a page to ones
//!              words of 16 bytes                        write: ones to zeros
//! ```
//!
//! QEMU can keep that memory in a file of the host, so that it survives like flash and a test can
//! cut the power at any write. The word is the largest of the real boards' (STM32H563), so that
//! what is stored here can be stored there.

use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

/// Bytes of a page.
pub const PAGE_LEN: usize = 4096;
/// Bytes of a word.
pub const WORD_LEN: usize = 16;
/// Bytes of the whole: the same on every board.
pub const STORAGE_LEN: usize = 128 * 1024;

/// Memory that behaves like flash.
pub struct Storage {
    memory: &'static mut [u8],
}

/// Access outside the storage, or not at the bounds of its words and pages.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct BadAddress;

impl NorFlashError for BadAddress {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::OutOfBounds
    }
}

impl Storage {
    /// Flash in `memory`.
    pub fn new(memory: &'static mut [u8]) -> Self {
        Self { memory }
    }

    /// `len` bytes from `offset` on, both multiples of `unit`.
    fn part(&mut self, offset: u32, len: usize, unit: usize) -> Result<&mut [u8], BadAddress> {
        let offset = offset as usize;
        if !offset.is_multiple_of(unit) || !len.is_multiple_of(unit) {
            return Err(BadAddress);
        }
        self.memory.get_mut(offset..).and_then(|rest| rest.get_mut(..len)).ok_or(BadAddress)
    }
}

impl ErrorType for Storage {
    type Error = BadAddress;
}

impl ReadNorFlash for Storage {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), BadAddress> {
        let part = self.part(offset, bytes.len(), Self::READ_SIZE)?;
        bytes.copy_from_slice(part);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.memory.len()
    }
}

impl NorFlash for Storage {
    const WRITE_SIZE: usize = WORD_LEN;
    const ERASE_SIZE: usize = PAGE_LEN;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), BadAddress> {
        let len = to.checked_sub(from).ok_or(BadAddress)?;
        self.part(from, len as usize, PAGE_LEN)?.fill(0xff);
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), BadAddress> {
        for (place, &byte) in self.part(offset, bytes.len(), WORD_LEN)?.iter_mut().zip(bytes) {
            *place &= byte;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embassy_futures::block_on;

    fn storage() -> Storage {
        Storage::new(Box::leak(vec![0xff; 4 * PAGE_LEN].into_boxed_slice()))
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
        assert_eq!(block_on(storage.write(8, &[0; WORD_LEN])), Err(BadAddress));
        assert_eq!(block_on(storage.write(0, &[0; 15])), Err(BadAddress));
        assert_eq!(block_on(storage.erase(0, 100)), Err(BadAddress));
        assert_eq!(block_on(storage.erase(8192, 4096)), Err(BadAddress));
        assert_eq!(block_on(storage.erase(0, 5 * 4096)), Err(BadAddress));
        assert_eq!(block_on(storage.read(16 * 1024 - 1, &mut [0; 2])), Err(BadAddress));
    }
}
