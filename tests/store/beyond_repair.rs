//! A store that cannot be repaired is erased, unless the device has keys: it is as locked afterwards as it was before,
//! wherever the power is cut.

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
        assert!(found.failed, "start {number}: nothing is erased under a lock");
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

/// A record that is stored four times, each time over a word that was not erased; then the store gives up.
fn spoil_words(flash: &Flash) {
    // A record of 31 words, behind the five to fourteen of those that are there.
    for word in [24, 55, 86, 117] {
        spoil(flash, word * WORD_LEN as u32, WORD_LEN as u32);
    }
}

fn lose_by_words(flash: &Flash) {
    spoil_words(flash);
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
    assert_eq!((found.boot, found.failed), (2, false), "nothing was erased");
    assert_eq!(found.keyring.bytes()[..], KEY);
}

#[test]
fn keys_of_a_device_without_any_are_taken_at_the_second_try() {
    let flash = device();
    // Four records of nineteen words, behind the five that are there.
    for word in [20, 30, 50, 70] {
        spoil(&flash, word * WORD_LEN as u32, WORD_LEN as u32);
    }
    let of_id = |id: u8| {
        let mut key = KEY;
        key[0] = id;
        key
    };
    let keys: Vec<u8> = (1..=8).flat_map(of_id).collect();
    assert!(block_on(open(&flash).save(KEYS, &keys)).is_err(), "all else was lost");
    assert!(block_on(open(&flash).save(KEYS, &keys)).is_ok());
    assert_eq!(begin(&flash).keyring.bytes()[..], keys[..]);
}

#[test]
fn a_device_with_keys_is_locked_wherever_the_power_is_cut_in_a_store_that_takes_no_record() {
    let spoilers: [fn(&Flash); 2] = [spoil_words, |flash| spoil(flash, 0, LEN)];
    for spoiler in spoilers {
        for cut in 0.. {
            let flash = device();
            block_on(open(&flash).save(KEYS, &KEY)).unwrap();
            spoiler(&flash);
            flash.cut_after(cut);
            assert!(block_on(open(&flash).save(OTHER, &[0xa5; 480])).is_err());
            let was_cut = flash.power_on();
            assert!(begin(&flash).keyring.is_claimed(), "cut {cut}");
            if !was_cut {
                break;
            }
        }
    }
}
