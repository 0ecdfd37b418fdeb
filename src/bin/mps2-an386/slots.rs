//! Where images are in the memory that stands for flash: pages of 4 KiB, words of 16 bytes.

use kehai::update::slots::Slots;

/// Offsets from 0x2100_0000, behind settings and background and what says how they fail.
pub static SLOTS: Slots = Slots {
    notes: 0x4_0000..0x4_2000,
    state: 0x4_2000..0x4_4000,
    active: 0x5_0000..0x9_0000,
    spare: 0x9_0000..0xd_1000,
};
