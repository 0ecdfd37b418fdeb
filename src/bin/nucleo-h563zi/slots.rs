//! Where images are on the NUCLEO-H563ZI's flash of 2 MiB: sectors of 8 KiB, words of 16 bytes, two banks of 1 MiB.
//!
//! The spare slot is in the second bank: what comes is written there while the image runs from the first.

use kehai::update::slots::Slots;

/// Offsets from 0x0800_0000. The boot loader is before the notes, settings and background are the last 128 KiB.
pub static SLOTS: Slots = Slots {
    notes: 0xc000..0x1_0000,
    state: 0x1_0000..0x1_4000,
    active: 0x2_0000..0x6_0000,
    spare: 0x10_0000..0x14_2000,
};
