//! The parts of the boards that touch no register, tested on the PC: their tests are beside them.

#[path = "../src/bin/mps2-an386/slots.rs"]
mod an386_slots;
#[path = "../src/bin/nucleo-h563zi/slots.rs"]
mod nucleo_slots;
#[path = "../src/bin/w5500-evb-pico2/slots.rs"]
mod pico2_slots;
#[path = "../src/bin/mps2-an386/storage.rs"]
mod storage;
#[path = "../src/bin/mps2-an386/uptime.rs"]
mod uptime;

use kehai::update::slots::Slots;

#[test]
fn the_storage_is_whole_pages() {
    assert!(storage::STORAGE_LEN.is_multiple_of(storage::PAGE_LEN));
}

/// What the boot loader takes for granted: embassy-boot panics on other parts.
#[test]
fn each_board_has_room_for_two_images_and_for_the_steps_of_their_swap() {
    /// Bytes of a page and of a word, and where settings begin.
    type Board<'a> = (&'a Slots, u32, u32, std::ops::Range<u32>);
    const MIB: u32 = 1024 * 1024;
    let boards: [Board<'_>; 3] = [
        (&an386_slots::SLOTS, 4096, 16, 0..0x4_0000),
        (&nucleo_slots::SLOTS, 8192, 16, 2 * MIB - 128 * 1024..2 * MIB),
        (&pico2_slots::SLOTS, 4096, 1, 2 * MIB - 128 * 1024..2 * MIB),
    ];
    for (slots, page, word, settings) in boards {
        let Slots { notes, state, active, spare } = slots;
        for part in [notes, state, active, spare] {
            assert!(part.start.is_multiple_of(page) && part.end.is_multiple_of(page), "{slots:?}");
            assert!(part.end <= settings.start || settings.end <= part.start, "{slots:?}");
        }
        assert!(notes.end <= state.start && state.end <= active.start && active.end <= spare.start);
        assert!(notes.len() as u32 >= 2 * page);
        assert_eq!(spare.len(), active.len() + page as usize, "{slots:?}");
        // Two words name the state, and each page takes two steps there and two back.
        let steps = active.len() as u32 / page * 4;
        assert!(state.len() as u32 / word >= 2 + steps, "{slots:?}");
        // The bound of an image, ci.sh.
        assert!(active.len() >= 224 * 1024, "{slots:?}");
    }
}
