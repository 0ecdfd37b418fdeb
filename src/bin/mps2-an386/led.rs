//! The board's two LEDs and two buttons, bits of the FPGA's register block.
//!
//! Source: ARM DAI 0386, FPGA system control and I/O: 0x40028000 LED0, bits 0 and 1; 0x40028008 BUTTON, bits 0 and 1.

use super::mmio::{Register, device};

/// The green LED, bit 0.
pub struct Led;

impl Led {
    /// Lights it, or not.
    pub fn set(&mut self, on: bool) {
        // SAFETY: the FPGA's first register, LED0.
        let leds: &Register = unsafe { device(0x4002_8000) };
        leds.write(u32::from(on));
    }
}

/// Whether button 0 is pressed.
pub fn button_pressed() -> bool {
    // SAFETY: the FPGA's third register, BUTTON.
    let buttons: &Register = unsafe { device(0x4002_8008) };
    buttons.read() & 1 != 0
}
