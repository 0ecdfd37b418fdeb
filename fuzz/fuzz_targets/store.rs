//! The store in flash that is cut off twice and decays: the settings are the old ones, the new ones, or the defaults with the
//! damage reported; and whatever has happened, it takes settings again.
//!
//! ```text
//!   input:  flash │ step │ step │ …        page size, error correction
//!   step:   0–79    settings are stored
//!           80–129  another record is stored, so often that pages are left behind
//!           130–229 settings are stored, and the power is cut: after, seed; at the start after it again: after, seed
//!           230–    a word decays: seed
//! ```
#![no_main]

#[path = "../../tests/store/rough_flash.rs"]
mod rough_flash;

use embassy_futures::block_on;
use kehai::device::Settings;
use kehai::store::{Start, save_baud, save_settings, start};
use libfuzzer_sys::fuzz_target;
use rough_flash::Rough;

/// More say nothing new.
const STEPS: usize = 64;

struct Used<const PAGE: usize> {
    flash: Rough<PAGE>,
    /// What may be in the store.
    allowed: Vec<Settings>,
    /// All that has been in it: what decays may uncover it.
    ever: Vec<Settings>,
    number: u32,
}

impl<const PAGE: usize> Used<PAGE> {
    fn new(pages: usize, corrects_errors: bool) -> Self {
        let defaults = vec![Settings::new()];
        Self {
            flash: Rough::new(pages, corrects_errors),
            allowed: defaults.clone(),
            ever: defaults,
            number: 0,
        }
    }

    fn begin(&self) -> Start {
        block_on(start(&mut self.flash.store(), 1 << 31))
    }

    fn next(&mut self) -> Settings {
        self.number += 1;
        let settings = Settings::new().changed_by(&format!("name=hall {}", self.number)).unwrap();
        self.ever.push(settings.clone());
        settings
    }

    fn save(&self, settings: &Settings) -> bool {
        block_on(save_settings(&mut self.flash.store(), settings)).is_ok()
    }

    /// The device starts: its settings are some that it may have. It is mended by then, or locked: where keys cannot be read,
    /// nothing is erased.
    fn judge(&mut self) {
        let found = self.begin();
        let reported = found.failed && found.settings == Settings::new();
        assert!(reported || self.allowed.contains(&found.settings), "{found:?} of {:?}", self.allowed);
        let again = self.begin();
        assert!(!again.failed || again.keyring.is_lost(), "still damaged");
        assert_eq!(again.settings, found.settings);
        self.allowed = vec![found.settings];
    }

    fn store_settings(&mut self) {
        let new = self.next();
        // The first try may find damage, and mend it.
        let is_saved = self.save(&new) || self.save(&new);
        assert!(is_saved || self.begin().keyring.is_lost(), "it takes no settings any more");
        self.allowed = vec![new];
        self.judge();
    }

    fn store_others(&mut self, count: u32) {
        for _ in 0..count {
            self.number += 1;
            // An error reports that what was stored may be lost.
            if block_on(save_baud(&mut self.flash.store(), self.number)).is_err() {
                self.allowed.push(Settings::new());
            }
        }
    }

    fn cut(&mut self, [after, seed, second_after, second_seed]: [u8; 4]) {
        let new = self.next();
        self.flash.cut(after.into(), seed.into());
        let done = self.save(&new);
        let was_cut = self.flash.power_on();
        if done {
            self.allowed.clear();
        }
        self.allowed.push(new);
        if !done && !was_cut {
            // Damage was found, and reported.
            self.allowed.push(Settings::new());
        }
        self.flash.cut(second_after.into(), second_seed.into());
        self.begin();
        self.flash.power_on();
        self.judge();
    }

    fn decay(&mut self, seed: u8) {
        self.flash.corrupt(seed.into());
        self.allowed = self.ever.clone();
        self.judge();
    }

    fn run(&mut self, mut rest: &[u8]) {
        for _ in 0..STEPS {
            let Some((&step, behind)) = rest.split_first() else { break };
            rest = behind;
            match step {
                0..80 => self.store_settings(),
                80..130 => self.store_others(u32::from(step - 79) * 4),
                130..230 => {
                    let Some((&cut, behind)) = rest.split_first_chunk() else { break };
                    rest = behind;
                    self.cut(cut);
                }
                230.. => {
                    let Some((&seed, behind)) = rest.split_first() else { break };
                    rest = behind;
                    self.decay(seed);
                }
            }
        }
        self.store_settings();
    }
}

fuzz_target!(|input: &[u8]| {
    let Some((&flash, rest)) = input.split_first() else { return };
    let corrects_errors = flash & 1 != 0;
    if flash & 2 == 0 {
        Used::<4096>::new(4, corrects_errors).run(rest);
    } else {
        Used::<8192>::new(3, corrects_errors).run(rest);
    }
});
