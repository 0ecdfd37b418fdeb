//! Device registers: each device is a `repr(C)` struct of [`Register`]s and gaps, its layout the
//! register map of the data sheet.

use core::cell::UnsafeCell;

/// One 32-bit register. There is no way to make one: references come from [`device`].
#[repr(transparent)]
pub struct Register(UnsafeCell<u32>);

impl Register {
    pub fn read(&self) -> u32 {
        // SAFETY: a Register exists only inside a device at its address (see `device`).
        unsafe { self.0.get().read_volatile() }
    }

    pub fn write(&self, value: u32) {
        // SAFETY: as above; no register of this board's devices changes memory by itself.
        unsafe { self.0.get().write_volatile(value) }
    }
}

/// The device at `address`.
///
/// # Safety
/// A device with the register map `Device` is at `address`, for as long as the program runs.
pub unsafe fn device<Device>(address: usize) -> &'static Device {
    // SAFETY: the caller vouches for address and layout; registers are only touched through
    // volatile accesses behind `UnsafeCell`.
    unsafe { &*core::ptr::with_exposed_provenance(address) }
}
