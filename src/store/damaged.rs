//! Flash whose words can become unreadable, made readable: a damaged word reads as zeros.
//!
//! ```text
//!   power cut in the middle of a word ─▶ its check bits fit nothing ─▶ reading it is an error, until it is erased
//!
//!   read 48 bytes ─┬─ no error ─▶ as they are
//!                  └─ damaged ──▶ word by word: │ as it is │ 0 0 0 … 0 │ as it is │
//! ```
//!
//! A word of zeros fits no checksum of the store: it is treated as any record that was cut off. The error itself
//! would end every access to its page, and the page would never be erased.
//!
//! Source: RM0481 (STM32H5) "Error code correction": 9 bits of ECC for 128 bits, a double error raises the NMI.

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

/// `flash`; `is_damaged` distinguishes the error of an unreadable word from all other errors.
#[derive(Clone, Copy, Debug)]
pub struct ZeroDamaged<F, P> {
    flash: F,
    is_damaged: P,
}

impl<F: NorFlash, P: Fn(&F::Error) -> bool> ZeroDamaged<F, P> {
    /// Makes `flash` readable.
    pub const fn new(flash: F, is_damaged: P) -> Self {
        Self { flash, is_damaged }
    }
}

impl<F: NorFlash, P> ErrorType for ZeroDamaged<F, P> {
    type Error = F::Error;
}

impl<F: NorFlash, P: Fn(&F::Error) -> bool> ReadNorFlash for ZeroDamaged<F, P> {
    const READ_SIZE: usize = F::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), F::Error> {
        match self.flash.read(offset, bytes).await {
            Err(error) if (self.is_damaged)(&error) => {}
            done => return done,
        }
        let (mut at, mut rest) = (offset, bytes);
        while !rest.is_empty() {
            let word_left = F::WRITE_SIZE - at as usize % F::WRITE_SIZE;
            let (word, behind) = rest.split_at_mut(word_left.min(rest.len()));
            match self.flash.read(at, word).await {
                Err(error) if (self.is_damaged)(&error) => word.fill(0),
                done => done?,
            }
            at = at.saturating_add(word.len() as u32);
            rest = behind;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl<F: NorFlash, P: Fn(&F::Error) -> bool> NorFlash for ZeroDamaged<F, P> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    // No `async fn`: each of those can panic once it is over.
    fn erase(&mut self, from: u32, to: u32) -> impl Future<Output = Result<(), F::Error>> {
        self.flash.erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> impl Future<Output = Result<(), F::Error>> {
        self.flash.write(offset, bytes)
    }
}
