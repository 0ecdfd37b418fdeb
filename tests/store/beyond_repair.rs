//! A store that cannot be repaired is erased. The device is as locked afterwards as it was before.

use embassy_futures::block_on;
use embedded_storage_async::nor_flash::NorFlash;
use kehai::link::Store;
use kehai::seal::{LABEL_BYTES, LABEL_ID};
use kehai::store::flash::FlashStore;
use kehai::store::{KEYS, Start, begin_reset, save_label, start};
use kehai_emulator::pc::flash::{Flash, PAGE_LEN, WORD_LEN};

const PAGES: usize = 8;
/// The key of some other record.
const OTHER: u8 = 16;

const LEN: u32 = (PAGES * PAGE_LEN) as u32;

/// A key that controls, of the id 1.
const KEY: [u8; 34] =
    [1, 3, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7];

fn open(flash: &Flash) -> FlashStore<Flash> {
    FlashStore::new(flash.clone(), 0..LEN).unwrap()
}

fn begin(flash: &Flash) -> Start {
    block_on(start(&mut open(flash), 1 << 31))
}

/// Writes zeros over the words from `at` on.
fn spoil(flash: &Flash, at: u32, len: u32) {
    block_on(flash.clone().write(at, &vec![0; len as usize])).unwrap();
}

/// A device with a label that has started once.
fn device() -> Flash {
    let flash = Flash::new(PAGES);
    begin(&flash);
    block_on(save_label(&mut open(&flash), &[5; LABEL_BYTES])).unwrap();
    flash
}

#[test]
fn a_device_whose_keys_cannot_be_read_stays_locked_until_its_button_is_held() {
    let flash = device();
    block_on(open(&flash).save(KEYS, &KEY)).unwrap();
    spoil(&flash, 0, LEN);
    for number in 0..3 {
        let found = begin(&flash);
        assert!(found.keyring.is_lost() && found.keyring.is_claimed(), "start {number}: {found:?}");
        assert_eq!(found.failed, number == 0);
    }
    block_on(begin_reset(&mut open(&flash))).unwrap();
    let found = begin(&flash);
    assert!(found.was_reset && !found.failed && !found.keyring.is_claimed(), "{found:?}");
}

#[test]
fn a_button_that_is_held_opens_a_store_that_no_start_has_repaired() {
    let flash = device();
    block_on(open(&flash).save(KEYS, &KEY)).unwrap();
    spoil(&flash, 0, LEN);
    block_on(begin_reset(&mut open(&flash))).unwrap();
    let found = begin(&flash);
    assert!(found.was_reset && !found.failed && !found.keyring.is_claimed(), "{found:?}");
    let found = begin(&flash);
    assert!(!found.was_reset && !found.failed && found.boot == 2, "{found:?}");
}

/// Stores a record four times, each time over a word that was not erased; then the store gives up and erases all.
fn lose_by_words(flash: &Flash) {
    // A record of 31 words, behind the five to fourteen of those that are there.
    for word in [24, 55, 86, 117] {
        spoil(flash, word * WORD_LEN as u32, WORD_LEN as u32);
    }
    assert!(block_on(open(flash).save(OTHER, &[0xa5; 480])).is_err());
}

#[test]
fn a_device_whose_keys_can_be_read_keeps_them_and_its_label() {
    let flash = device();
    lose_by_words(&flash);
    let unclaimed = begin(&flash);
    assert!(!unclaimed.keyring.is_claimed(), "no key was there");
    assert!(unclaimed.keyring.get(LABEL_ID).is_some(), "{unclaimed:?}");

    let flash = device();
    block_on(open(&flash).save(KEYS, &KEY)).unwrap();
    lose_by_words(&flash);
    let found = begin(&flash);
    assert_eq!(found.boot, 1, "all else was lost");
    assert_eq!(found.keyring.bytes()[..], KEY);
}
