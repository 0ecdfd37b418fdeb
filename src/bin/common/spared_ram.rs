//! The word of memory that a reset spares, for [`kehai::device::starts`].
//!
//! The start-up code leaves `.uninit` as it is, and neither a reset by the watchdog nor one by the program
//! changes it. After a loss of power it holds anything.

use core::mem::MaybeUninit;

use kehai::link::ResetMemory;

#[unsafe(link_section = ".uninit.starts")]
static mut WORD: MaybeUninit<u32> = MaybeUninit::uninit();

/// The word.
pub struct SparedRam {
    word: *mut u32,
}

impl SparedRam {
    /// There is one word: to be called once.
    pub fn take() -> Self {
        // By its address as a number: the compiler must assume nothing about the content from before the start.
        Self { word: core::ptr::with_exposed_provenance_mut((&raw mut WORD).expose_provenance()) }
    }
}

impl ResetMemory for SparedRam {
    fn read(&mut self) -> u32 {
        // SAFETY: `word` points to a word of memory that nothing else names.
        unsafe { self.word.read_volatile() }
    }

    fn write(&mut self, word: u32) {
        // SAFETY: as above.
        unsafe { self.word.write_volatile(word) }
    }
}
