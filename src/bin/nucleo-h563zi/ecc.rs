//! Words of the storage that a loss of power has left with wrong check bits.
//!
//! ```text
//!   read ─▶ double error ─▶ NMI ─┬─ in data: noted, cleared ─▶ the read is an error, the store goes on
//!                                └─ anywhere else: the watchdog starts the module anew
//!
//!   ECCDETR  31 ECCD   22 bank   15 … 0 number of the word of 16 bytes in its bank
//! ```
//!
//! Without this the NMI would come again at every start: one power cut in the middle of a write, and the module
//! never runs again.
//!
//! Source: RM0481, embedded flash memory, "Error code correction (ECC)" and FLASH_ECCDETR. Never run on a board.

use core::future::ready;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::asm;
use cortex_m_rt::exception;
use embassy_stm32::pac;
use embedded_storage::nor_flash::{self as blocking, ErrorType as BlockingErrorType};
use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use kehai::store::damaged::ZeroDamaged;

use super::slots::SLOTS;

/// A read has met a word that cannot be read.
static DAMAGED: AtomicBool = AtomicBool::new(false);

/// Whether a word of the first bank is data: what boot loader and image tell each other. All of the second bank is.
fn is_data(word: u32) -> bool {
    (SLOTS.notes.start / 16..SLOTS.state.end / 16).contains(&word)
}

/// Why an access failed.
#[derive(Debug)]
pub enum StorageError<E> {
    /// A word cannot be read until its page is erased.
    Damaged,
    /// As the flash says.
    Flash(E),
}

impl<E: NorFlashError> NorFlashError for StorageError<E> {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Damaged => NorFlashErrorKind::Other,
            Self::Flash(error) => error.kind(),
        }
    }
}

/// `flash`, with an error for words that cannot be read.
pub struct Checked<F>(F);

/// Whether an error is that of a damaged word.
type IsDamaged<F> = fn(&StorageError<<F as BlockingErrorType>::Error>) -> bool;

/// The storage in `flash`: damaged words read as zeros.
pub fn storage<F: blocking::NorFlash>(flash: F) -> ZeroDamaged<Checked<F>, IsDamaged<F>> {
    ZeroDamaged::new(Checked(flash), |error| matches!(error, StorageError::Damaged))
}

impl<F: blocking::NorFlash> ErrorType for Checked<F> {
    type Error = StorageError<F::Error>;
}

// No `async fn`: each of those can panic once it is over, and nothing here is waited for.
impl<F: blocking::NorFlash> ReadNorFlash for Checked<F> {
    const READ_SIZE: usize = F::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> impl Future<Output = Result<(), Self::Error>> {
        DAMAGED.store(false, Ordering::Relaxed);
        let read = self.0.read(offset, bytes).map_err(StorageError::Flash);
        // The NMI has come by now.
        asm::dsb();
        asm::isb();
        ready(if DAMAGED.swap(false, Ordering::Relaxed) { Err(StorageError::Damaged) } else { read })
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl<F: blocking::NorFlash> NorFlash for Checked<F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> impl Future<Output = Result<(), Self::Error>> {
        ready(self.0.erase(from, to).map_err(StorageError::Flash))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> impl Future<Output = Result<(), Self::Error>> {
        ready(self.0.write(offset, bytes).map_err(StorageError::Flash))
    }
}

#[exception]
unsafe fn NonMaskableInt() {
    let error = pac::FLASH.eccdetr().read();
    let in_program_memory = !error.sysf_ecc() && !error.obk_ecc() && !error.edata_ecc() && !error.otp_ecc();
    let in_data = error.bk_ecc() || is_data(error.addr_ecc().into());
    if error.eccd() && in_program_memory && in_data {
        DAMAGED.store(true, Ordering::Relaxed);
        // Written as 1, the flag goes.
        pac::FLASH.eccdetr().modify(|register| register.set_eccd(true));
        asm::dsb();
        return;
    }
    loop {
        asm::nop();
    }
}
