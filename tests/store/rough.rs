//! The store in flash that fails badly: garbage instead of half a word, pages erased in parts, words that cannot be read,
//! a second cut while the first is repaired; pages of the real chip (8 KiB) and of the other boards (4 KiB).

use crate::rough_flash::Rough;
use embassy_futures::block_on;
use kehai::device::Settings;
use kehai::store::{Start, save_baud, save_settings, start};

/// Writes of a record into a page with room.
const WRITES: u32 = 3;

/// Moments of the store's work at which the power is cut, in each kind of flash.
const CUTS: u64 = 200;

fn settings(number: u32) -> Settings {
    Settings::new().changed_by(&format!("name=hall {number}\nskip={}", number % 10)).unwrap()
}

fn begin<const PAGE: usize>(flash: &Rough<PAGE>) -> Start {
    block_on(start(&mut flash.store(), 1 << 31))
}

/// The settings are the old or the new ones, or the defaults, with the loss reported.
#[track_caller]
fn judge(found: &Start, allowed: &[&Settings], what: &str) {
    let reported = found.failed && found.settings == Settings::new();
    assert!(reported || allowed.contains(&&found.settings), "{what}: {found:?}");
}

/// A store in use, with the power cut at `CUTS` moments of its work and once more while it starts after each.
fn cuts<const PAGE: usize>(pages: usize, corrects_errors: bool) -> [u32; 3] {
    let flash = Rough::<PAGE>::new(pages, corrects_errors);
    let [mut old, mut new, mut lost] = [0; 3];
    let mut stored = Settings::new();
    let (mut baud, mut erasing) = (19_200, 0);
    for cut in 0..CUTS {
        let wanted = settings(cut as u32);
        let operations = loop {
            let trial = flash.copy();
            assert!(block_on(save_settings(&mut trial.store(), &wanted)).is_ok());
            let operations = trial.operations() - flash.operations();
            // Every other cut is in work that erases a page, and copies what lives in it.
            if cut % 2 == 0 || operations > WRITES {
                break operations;
            }
            baud += 1;
            assert!(block_on(save_baud(&mut flash.store(), baud)).is_ok());
        };
        erasing += u32::from(operations > WRITES);
        flash.cut((cut / 2) as u32 % operations, cut);
        let done = block_on(save_settings(&mut flash.store(), &wanted)).is_ok();
        assert!(flash.power_on() && !done);
        for second in 0.. {
            let copy = flash.copy();
            copy.cut(second, cut << 8 | u64::from(second));
            begin(&copy);
            let was_cut = copy.power_on();
            let what = format!("pages of {PAGE}, cut {cut}, second cut {second}");
            judge(&begin(&copy), &[&stored, &wanted], &what);
            assert!(!begin(&copy).failed, "{what}: it stays damaged");
            assert!(
                block_on(save_settings(&mut copy.store(), &wanted)).is_ok(),
                "{what}: it takes no settings any more"
            );
            judge(&begin(&copy), &[&wanted], &what);
            if !was_cut {
                break;
            }
        }
        let found = begin(&flash);
        old += u32::from(found.settings == stored);
        new += u32::from(found.settings == wanted);
        lost += u32::from(found.failed);
        stored = found.settings;
    }
    println!(
        "pages of {PAGE}, {corrects_errors}: old {old}, new {new}, lost and reported {lost}; {erasing} cuts in work that erases, {} words unreadable",
        flash.damaged()
    );
    [old, new, lost]
}

#[test]
fn the_power_is_cut_at_two_hundred_moments_and_the_settings_are_the_old_or_the_new_ones() {
    let outcomes =
        [cuts::<8192>(4, false), cuts::<8192>(4, true), cuts::<4096>(8, false), cuts::<4096>(8, true)];
    for [old, new, lost] in outcomes {
        assert!(old > 0 && new > 0, "old {old}, new {new}");
        assert_eq!(lost, 0, "a cut alone loses nothing");
    }
}
