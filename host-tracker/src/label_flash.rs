//! The secret of a label as a board's flash holds it: a file for the person who flashes the board.
//!
//! ```text
//!   label ─▶ the store's record, in pages and words of that board ─▶ bytes from the beginning of its settings on
//! ```
//!
//! The device's own store writes it, into memory that behaves like the board's flash.

use embassy_futures::block_on;
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use kehai::seal::LABEL_BYTES;
use kehai::store::flash::FlashStore;
use kehai::store::save_label;

/// A board, by how its flash is written.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LabelBoard {
    /// NUCLEO-H563ZI: sectors of 8 KiB, words of 16 bytes.
    NucleoH563zi,
    /// W5500-EVB-Pico2: sectors of 4 KiB, words of a byte.
    W5500EvbPico2,
}

impl LabelBoard {
    /// Where the settings begin: the last 128 KiB of 2 MiB.
    #[must_use]
    pub const fn address(self) -> u32 {
        match self {
            Self::NucleoH563zi => 0x081e_0000,
            Self::W5500EvbPico2 => 0x101e_0000,
        }
    }
}

/// Bytes of settings and background: the same on every board.
const SETTINGS_LEN: usize = 128 * 1024;

/// Erased flash of such pages and words.
struct Memory<const PAGE: usize, const WORD: usize>(Vec<u8>);

impl<const PAGE: usize, const WORD: usize> Memory<PAGE, WORD> {
    fn part(&mut self, at: u32, len: usize) -> Result<&mut [u8], NorFlashErrorKind> {
        let part = self.0.get_mut(at as usize..).and_then(|rest| rest.get_mut(..len));
        part.ok_or(NorFlashErrorKind::OutOfBounds)
    }
}

impl<const PAGE: usize, const WORD: usize> ErrorType for Memory<PAGE, WORD> {
    type Error = NorFlashErrorKind;
}

impl<const PAGE: usize, const WORD: usize> ReadNorFlash for Memory<PAGE, WORD> {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, at: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        bytes.copy_from_slice(self.part(at, bytes.len())?);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl<const PAGE: usize, const WORD: usize> NorFlash for Memory<PAGE, WORD> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        self.part(from, to.saturating_sub(from) as usize)?.fill(0xff);
        Ok(())
    }

    async fn write(&mut self, at: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        let part = self.part(at, bytes.len())?;
        part.iter_mut().zip(bytes).for_each(|(place, byte)| *place &= byte);
        Ok(())
    }
}

/// The bytes for the board's settings, as far as they are not erased flash.
#[must_use]
pub fn label_flash(board: LabelBoard, label: &[u8; LABEL_BYTES]) -> Vec<u8> {
    match board {
        LabelBoard::NucleoH563zi => written(Memory::<8192, 16>(vec![0xff; SETTINGS_LEN]), label),
        LabelBoard::W5500EvbPico2 => written(Memory::<4096, 1>(vec![0xff; SETTINGS_LEN]), label),
    }
}

fn written<const PAGE: usize, const WORD: usize>(
    memory: Memory<PAGE, WORD>,
    label: &[u8; LABEL_BYTES],
) -> Vec<u8> {
    let Some(mut store) = FlashStore::new(memory, 0..SETTINGS_LEN as u32) else { return Vec::new() };
    // Memory that was erased takes it.
    let _ = block_on(save_label(&mut store, label));
    let Memory(mut bytes) = store.into_flash();
    let last = bytes.iter().rposition(|byte| *byte != 0xff).map_or(0, |last| last + 1);
    // Whole pages: the rest of a page that is flashed is erased.
    bytes.truncate(last.next_multiple_of(PAGE));
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the device reads it at its start.
    fn read<const PAGE: usize, const WORD: usize>(bytes: &[u8]) -> kehai::seal::Keyring {
        let mut memory = vec![0xff; SETTINGS_LEN];
        memory[..bytes.len()].copy_from_slice(bytes);
        let memory = Memory::<PAGE, WORD>(memory);
        let mut store = FlashStore::new(memory, 0..SETTINGS_LEN as u32).unwrap();
        block_on(kehai::store::start(&mut store, 1)).keyring
    }

    #[test]
    fn a_board_finds_its_label_where_it_looks() {
        let label = [0x5a; LABEL_BYTES];
        let mut wanted = kehai::seal::Keyring::new();
        wanted.set_label(&label);
        let nucleo = label_flash(LabelBoard::NucleoH563zi, &label);
        assert_eq!((nucleo.len(), read::<8192, 16>(&nucleo)), (8192, wanted.clone()));
        let pico = label_flash(LabelBoard::W5500EvbPico2, &label);
        assert_eq!((pico.len(), read::<4096, 1>(&pico)), (4096, wanted));
        assert_ne!(read::<8192, 16>(&[]), read::<8192, 16>(&nucleo), "a board without one");
    }
}
