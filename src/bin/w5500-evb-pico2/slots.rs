//! Where images are on the W5500-EVB-Pico2's flash of 2 MiB: sectors of 4 KiB, words of one byte.

use kehai::update::slots::Slots;

/// Offsets from 0x1000_0000. The boot loader is before the notes, settings and background are the last 128 KiB.
pub static SLOTS: Slots = Slots {
    notes: 0xc000..0xe000,
    state: 0xe000..0x1_0000,
    active: 0x1_0000..0x5_0000,
    spare: 0x5_0000..0x9_1000,
};
