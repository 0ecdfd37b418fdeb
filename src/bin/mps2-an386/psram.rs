//! The memory that stands for flash: where it is.
//!
//! Source: ARM DAI 0386, memory map.

use core::ptr::{with_exposed_provenance, with_exposed_provenance_mut};

use embedded_storage_async::nor_flash::NorFlash;

use super::storage::{Control, IMAGES_AT, STORAGE_LEN, storage};

/// Where it begins.
pub const PSRAM: usize = 0x2100_0000;
/// Bytes for images: slots.rs.
const IMAGES_LEN: usize = 0x9_1000;

/// The PSRAM as flash. To be called once.
pub fn psram() -> impl NorFlash {
    // SAFETY: memory of the board, outside of what the linker hands out but for the active slot, which a program in it
    // only reads, and borrowed only here. An image that runs there erases and writes none of it.
    let part = |at: usize, len: usize| unsafe {
        core::slice::from_raw_parts_mut(with_exposed_provenance_mut(PSRAM + at), len)
    };
    // SAFETY: as above; any bits are a control, and a test that changes them changes atomics.
    let control = unsafe { &*with_exposed_provenance::<Control>(PSRAM + STORAGE_LEN) };
    storage((part(0, STORAGE_LEN), part(IMAGES_AT, IMAGES_LEN)), control)
}
