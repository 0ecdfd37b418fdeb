//! A factory reset, and losses of power in it: what is found is as before it or as after it, and the label's secret is
//! always there.

use crate::rough_flash::Rough;
use embassy_futures::block_on;
use embedded_storage_async::nor_flash::NorFlash;
use kehai::background::{Background, Fingerprint};
use kehai::device::Settings;
use kehai::link::Store;
use kehai::scip::Text;
use kehai::seal::{LABEL_BYTES, LABEL_ID};
use kehai::store::damaged::ZeroDamaged;
use kehai::store::flash::FlashStore;
use kehai::store::{
    KEYS, Start, begin_reset, load_background, save_background, save_baud, save_label, save_settings, start,
};
use kehai_emulator::pc::flash::{Flash, FlashError, PAGE_LEN};

const BEAMS: usize = 300;
/// The record of the label.
const LABEL: u8 = 6;
const SECRET: [u8; LABEL_BYTES] = *b"secret of label!";
/// A key that controls, of the id 1.
const KEY: [u8; 34] = {
    let mut key = *b"..key of the site that was before.";
    (key[0], key[1]) = (1, 3);
    key
};
const STARTS: u32 = 5;

/// Flash of a device, whose power can be cut.
trait Cuttable: Clone {
    type Readable: NorFlash;

    fn store(&self) -> FlashStore<Self::Readable>;
    fn copy(&self) -> Self;
    /// In the midst of the `after`-th operation from now on.
    fn cut(&self, after: u32);
    /// Whether the power was cut.
    fn power_on(&self) -> bool;
}

impl Cuttable for Flash {
    type Readable = ZeroDamaged<Self, fn(&FlashError) -> bool>;

    fn store(&self) -> FlashStore<Self::Readable> {
        let is_damaged: fn(&FlashError) -> bool = |error| *error == FlashError::Damaged;
        let len = (8 * PAGE_LEN) as u32;
        FlashStore::new(ZeroDamaged::new(self.clone(), is_damaged), 0..len).unwrap()
    }

    fn copy(&self) -> Self {
        self.copy()
    }

    fn cut(&self, after: u32) {
        self.cut_after(after);
    }

    fn power_on(&self) -> bool {
        self.power_on()
    }
}

impl<const PAGE: usize> Cuttable for Rough<PAGE> {
    type Readable = ZeroDamaged<Self, fn(&crate::rough_flash::RoughError) -> bool>;

    fn store(&self) -> FlashStore<Self::Readable> {
        self.store()
    }

    fn copy(&self) -> Self {
        self.copy()
    }

    fn cut(&self, after: u32) {
        self.cut(after, after.into());
    }

    fn power_on(&self) -> bool {
        self.power_on()
    }
}

fn settings() -> Settings {
    Settings::new().changed_by("name=hall\nskip=1").unwrap()
}

fn begin(flash: &impl Cuttable) -> Start {
    block_on(start(&mut flash.store(), 1 << 31))
}

fn has_background(flash: &impl Cuttable) -> bool {
    let mut read = Box::new(Background::<BEAMS>::new());
    block_on(load_background(&mut flash.store(), &mut read)).unwrap().is_some()
}

/// Makes it the flash of a device in use: it has a label, an owner, and has learned its room.
fn use_it(flash: &impl Cuttable) {
    let store = &mut flash.store();
    for _ in 0..STARTS {
        block_on(start(store, 1 << 31));
    }
    let mut background = Box::new(Background::<BEAMS>::new());
    background.restore_part(0, &[9; 6 * BEAMS]);
    background.restored(BEAMS, 3, Fingerprint(7));
    block_on(save_label(store, &SECRET)).unwrap();
    block_on(store.save(KEYS, &KEY)).unwrap();
    block_on(save_settings(store, &settings())).unwrap();
    block_on(save_baud(store, 115_200)).unwrap();
    block_on(save_background(store, &background, Text::new(b"H123"))).unwrap();
}

/// The device is as it came if `is_reset`, else as it was; the secret of its label is there.
#[track_caller]
fn judge(found: &Start, flash: &impl Cuttable, is_reset: bool, what: &str) {
    let mut secret = [0; LABEL_BYTES];
    let length = block_on(flash.store().load(LABEL, &mut secret));
    assert_eq!((length, secret), (Ok(Some(LABEL_BYTES)), SECRET), "{what}: the label is lost");
    let before = (settings(), Some(115_200), KEY.to_vec(), true);
    let after = (Settings::new(), None, vec![], false);
    let keys = found.keyring.bytes().to_vec();
    let now = (found.settings.clone(), found.last_baud, keys, has_background(flash));
    assert!(now == if is_reset { after } else { before }, "{what}, reset {is_reset}: {now:?}");
    assert_eq!(found.keyring.get(LABEL_ID).is_some(), is_reset, "{what}: what the label opens");
    assert!(!found.failed && found.boot > STARTS && found.boot <= STARTS + 2, "{what}: {found:?}");
}

#[test]
fn a_factory_reset_erases_all_but_the_number_of_the_start_and_the_label() {
    let flash = Flash::new(8);
    use_it(&flash);
    assert!(!begin(&flash).was_reset);
    block_on(begin_reset(&mut Cuttable::store(&flash))).unwrap();
    let found = begin(&flash);
    judge(&found, &flash, true, "reset");
    assert!(found.was_reset && found.boot == STARTS + 2);
    let contents = flash.contents();
    for gone in [&b"hall"[..], b"key of the site", &[9; 40]] {
        assert!(!contents.windows(gone.len()).any(|bytes| bytes == gone), "{gone:x?}");
    }
    block_on(save_settings(&mut Cuttable::store(&flash), &settings())).unwrap();
    let found = begin(&flash);
    assert!(!found.was_reset && found.settings == settings(), "once only");
    assert_eq!(flash.rewritten(), 0);
}

/// Cuts the power at every `step`-th operation of a reset. How often the device was as before.
fn cut_resets(used: &impl Cuttable, step: usize) -> u32 {
    use_it(used);
    let mut as_before = 0;
    for cut in 0.. {
        let flash = used.copy();
        flash.cut(cut);
        let is_begun = block_on(begin_reset(&mut flash.store())).is_ok();
        if !flash.power_on() {
            break;
        }
        assert!(!is_begun);
        let found = begin(&flash);
        judge(&found, &flash, found.was_reset, &format!("cut {cut} of its beginning"));
        as_before += u32::from(!found.was_reset);
    }
    block_on(begin_reset(&mut used.store())).unwrap();
    for cut in (0..).step_by(step) {
        let flash = used.copy();
        flash.cut(cut);
        begin(&flash);
        let was_cut = flash.power_on();
        let found = begin(&flash);
        judge(&found, &flash, true, &format!("cut {cut}"));
        if !was_cut {
            println!("{cut} cuts");
            break;
        }
    }
    as_before
}

#[test]
fn a_reset_that_is_cut_off_is_not_done_or_is_done_at_the_next_start_and_keeps_the_label() {
    assert!(cut_resets(&Flash::new(8), 3) > 0);
    assert!(cut_resets(&Flash::with_error_correction(8), 1) > 0);
}

#[test]
fn a_reset_that_is_cut_off_leaving_garbage_keeps_the_label() {
    for corrects_errors in [false, true] {
        assert!(cut_resets(&Rough::<8192>::new(4, corrects_errors), 5) > 0);
        assert!(cut_resets(&Rough::<4096>::new(8, corrects_errors), 5) > 0);
    }
}
