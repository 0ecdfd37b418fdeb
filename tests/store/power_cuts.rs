//! Stored data survives a loss of power at any single write: either the old or the new is read, never none.

use embassy_futures::block_on;
use kehai::background::{Background, Fingerprint};
use kehai::device::Settings;
use kehai::link::Store;
use kehai::scan::{Geometry, GeometryParts, MAX_BEAMS};
use kehai::scip::Text;
use kehai::store::damaged::ZeroDamaged;
use kehai::store::flash::FlashStore;
use kehai::store::{load_background, save_background, save_settings, start};
use kehai_emulator::pc::flash::{Flash, FlashError, PAGE_LEN};

/// The smallest region allowed: 32 KiB.
const PAGES: usize = 8;

type Readable = ZeroDamaged<Flash, fn(&FlashError) -> bool>;

fn open(flash: &Flash) -> FlashStore<Readable> {
    let readable = Readable::new(flash.clone(), |error| *error == FlashError::Damaged);
    FlashStore::new(readable, 0..(PAGES * PAGE_LEN) as u32).unwrap()
}

/// Without and with error correction.
fn flashes() -> [Flash; 2] {
    [Flash::new(PAGES), Flash::with_error_correction(PAGES)]
}

fn geometry() -> Geometry {
    Geometry::new(GeometryParts {
        first_step: 0,
        last_step: MAX_BEAMS as u16 - 1,
        cluster: 1,
        front_step: 540,
        steps_per_turn: 1440,
        period_us: 25_000,
        range_min_mm: 20,
        range_max_mm: 30_000,
    })
    .unwrap()
}

/// A background of which every beam shows its number.
fn background(number: u16) -> Box<Background<MAX_BEAMS>> {
    let mut background = Box::new(Background::new());
    let [low, high] = (1000 * number).to_le_bytes();
    let beams: Vec<u8> = (0..MAX_BEAMS).flat_map(|beam| [low, high, beam as u8, 0, 9, 2]).collect();
    background.restore_part(0, &beams);
    background.restored(MAX_BEAMS, number, Fingerprint::of(b"H123", &geometry()));
    background.bind(&geometry(), Fingerprint::of(b"H123", &geometry()), Some(19));
    background
}

/// The number of the background in the store; it must be whole.
fn stored(flash: &Flash) -> Option<u16> {
    let mut read = Box::new(Background::<MAX_BEAMS>::new());
    let serial = block_on(load_background(&mut open(flash), &mut read)).unwrap()?;
    assert_eq!(serial.as_str(), "H123");
    let number = read.version();
    assert_eq!(read.fingerprint(), Fingerprint::of(b"H123", &geometry()));
    read.bind(&geometry(), Fingerprint::of(b"H123", &geometry()), Some(19));
    assert!(read.is_known());
    assert!(read.profile().eq(background(number).profile()), "background {number} is not whole");
    Some(number)
}

fn settings(name: &str) -> Settings {
    Settings::new().changed_by(&format!("name={name}\nskip=1")).unwrap()
}

/// Does `work` on copies of `flash`, with the power cut in the middle of every write and erasure of it in turn;
/// `check` is told whether the work was done.
fn cut_everywhere(flash: &Flash, work: impl Fn(&Flash) -> bool, mut check: impl FnMut(&Flash, bool)) -> u32 {
    for cut in 0.. {
        let copy = flash.copy();
        copy.cut_after(cut);
        let done = work(&copy);
        let was_off = copy.power_on();
        assert_eq!(done, !was_off, "cut {cut}");
        check(&copy, done);
        if done {
            return cut;
        }
    }
    unreachable!("the work ends some time")
}

#[test]
fn a_background_is_the_old_or_the_new_one_wherever_the_power_is_cut() {
    flashes().into_iter().for_each(|flash| cut_backgrounds(&flash));
}

fn cut_backgrounds(flash: &Flash) {
    let save = |flash: &Flash, number: u16| {
        block_on(save_background(&mut open(flash), &background(number), Text::new(b"H123"))).is_ok()
    };
    assert_eq!(stored(flash), None);
    let mut cuts = 0;
    // The fourth goes round the pages once more, and erases.
    for number in 1..=4 {
        let mut outcomes = [0, 0];
        cuts += cut_everywhere(
            flash,
            |flash| save(flash, number),
            |flash, done| {
                let found = stored(flash);
                let old = (number > 1).then_some(number - 1);
                assert!(found == Some(number) || !done && found == old, "{found:?} while storing {number}");
                outcomes[usize::from(found == Some(number))] += 1;
                // And it can be stored afterwards.
                assert!(save(flash, number + 1));
                assert_eq!(stored(flash), Some(number + 1));
            },
        );
        assert!(outcomes[0] > 10 && outcomes[1] > 0, "{outcomes:?}");
        assert!(save(flash, number));
    }
    println!("{cuts} cuts, {} words written twice", flash.rewritten());
    assert_eq!(flash.rewritten(), 0);
}

#[test]
fn settings_are_the_old_or_the_new_ones_wherever_the_power_is_cut() {
    flashes().into_iter().for_each(|flash| cut_settings(&flash));
}

fn cut_settings(flash: &Flash) {
    let save = |flash: &Flash, name: &str| block_on(save_settings(&mut open(flash), &settings(name))).is_ok();
    assert!(block_on(save_background(&mut open(flash), &background(7), Text::new(b"H123"))).is_ok());
    assert!(save(flash, "0"));
    // Enough to go through all pages and erase every one.
    for number in 1..300 {
        let name = number.to_string();
        let before = flash.operations();
        let trial = flash.copy();
        assert!(save(&trial, &name));
        let erases = trial.operations() > 3;
        if number < 4 || erases {
            let cuts = cut_everywhere(
                flash,
                |flash| save(flash, &name),
                |flash, done| {
                    let found = block_on(start(&mut open(flash), 99));
                    let old = settings(&(number - 1).to_string());
                    let new = settings(&name);
                    assert!(!found.failed, "start failed at {number}");
                    assert!(found.settings == new || !done && found.settings == old, "{:?}", found.settings);
                    assert_eq!(found.boot, 1);
                    assert_eq!(stored(flash), Some(7), "the background was not touched");
                },
            );
            assert!(cuts > 0);
        }
        assert!(save(flash, &name));
        assert!(flash.operations() > before);
    }
    assert_eq!(flash.rewritten(), 0);
}

#[test]
fn starts_are_counted_wherever_the_power_is_cut() {
    flashes().into_iter().for_each(|flash| cut_starts(&flash));
}

fn cut_starts(flash: &Flash) {
    let begin = |flash: &Flash| block_on(start(&mut open(flash), 1 << 31));
    for boot in 1..=2000 {
        if boot < 10 || boot % 200 == 0 {
            cut_everywhere(
                flash,
                |flash| !begin(flash).failed,
                |flash, _| {
                    let next = begin(flash);
                    assert!(!next.failed);
                    assert!(next.boot == boot || next.boot == boot + 1, "start {} after {boot}", next.boot);
                },
            );
        }
        assert_eq!(begin(flash).boot, boot);
    }
}

#[test]
fn memory_that_was_never_a_store_becomes_one() {
    let flash = Flash::new(PAGES);
    {
        use embedded_storage_async::nor_flash::NorFlash;
        let noise: Vec<u8> = (0..PAGES * PAGE_LEN).map(|at| (at * 7 + at / 251) as u8).collect();
        block_on(flash.clone().write(0, &noise)).unwrap();
    }
    let first = block_on(start(&mut open(&flash), 77));
    println!("{first:?}");
    let second = block_on(start(&mut open(&flash), 77));
    assert!(!second.failed);
    assert_eq!(second.boot, first.boot + 1);
}

#[test]
fn a_record_that_is_too_long_is_refused_and_changes_nothing() {
    let flash = Flash::new(PAGES);
    let mut store = open(&flash);
    assert!(block_on(store.save(9, &[1; 1024])).is_ok());
    assert!(block_on(store.save(9, &[2; 1025])).is_err());
    let mut record = [0; 1024];
    assert_eq!(block_on(store.load(9, &mut record)), Ok(Some(1024)));
    assert_eq!(record, [1; 1024]);
    assert!(block_on(store.load(9, &mut [0; 1023])).is_err());
    assert_eq!(block_on(store.load(10, &mut record)), Ok(None));
}

#[test]
fn a_second_cut_while_the_first_is_repaired_leaves_the_old_or_the_new_settings() {
    for flash in flashes() {
        let save =
            |flash: &Flash, name: &str| block_on(save_settings(&mut open(flash), &settings(name))).is_ok();
        let mut damaged = 0;
        // Enough to go through all pages.
        for number in 1..150 {
            assert!(save(&flash, &(number - 1).to_string()));
            if number % 7 != 0 {
                continue;
            }
            let name = number.to_string();
            let allowed = [settings(&(number - 1).to_string()), settings(&name)];
            cut_everywhere(
                &flash,
                |flash| save(flash, &name),
                |flash, _| {
                    damaged += flash.damaged();
                    cut_everywhere(
                        flash,
                        |flash| !block_on(start(&mut open(flash), 99)).failed,
                        |flash, _| {
                            let found = block_on(start(&mut open(flash), 99));
                            assert!(!found.failed, "start failed at {number}");
                            assert!(allowed.contains(&found.settings), "{:?}", found.settings);
                        },
                    );
                },
            );
        }
        println!("{damaged} words could not be read");
    }
}

#[test]
fn a_word_that_cannot_be_read_is_zeros_and_its_neighbours_are_not() {
    use embedded_storage_async::nor_flash::{NorFlash, ReadNorFlash};
    let flash = Flash::with_error_correction(PAGES);
    block_on(flash.clone().write(0, &[7; 64])).unwrap();
    flash.cut_after(0);
    assert!(block_on(flash.clone().write(64, &[7; 16])).is_err());
    flash.power_on();
    block_on(flash.clone().write(80, &[7; 16])).unwrap();
    let mut read = [1; 44];
    assert_eq!(block_on(flash.clone().read(45, &mut read)), Err(FlashError::Damaged));
    let is_damaged: fn(&FlashError) -> bool = |error| *error == FlashError::Damaged;
    block_on(Readable::new(flash, is_damaged).read(45, &mut read)).unwrap();
    assert!(read[..19].iter().chain(&read[35..]).all(|&byte| byte == 7), "{read:?}");
    assert!(read[19..35].iter().all(|&byte| byte == 0), "{read:?}");
}
