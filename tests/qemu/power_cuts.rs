//! The power is cut in the midst of what the real firmware image stores, in QEMU: it starts each time, with the settings that
//! it has acknowledged last or the ones it was being given.
//!
//! ```text
//!   power on ─▶ settings as they must be? ─▶ arm ─▶ set, set, … ─▶ cut in the midst of a word ─▶ that word is spoiled
//!      ▲                                                                                              │
//!      └────── every fourth time: cut once more while it starts, and spoiled ◀───────────────────────┘
//! ```
//!
//! A word is left half done or holds any bits, and three of four can no longer be read, as in flash with error correction.
//! Every other cut is in work that erases a page. `KEHAI_POWER_CUTS=200` cuts at 200 moments; without it, at 16.

use std::fs::File;
use std::ops::Range;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use crate::support::board::{host_of, image, start};
use crate::support::hostile::Random;
use crate::support::observer::{Observer, sensor};
use kehai::device::Settings;
use kehai::store::flash::FlashStore;
use kehai::store::save_settings;
use kehai::wire::{Message, Request};
use kehai_emulator::pc::flash::{Flash, PAGE_LEN, WORD_LEN};
use kehai_emulator::pc::host::{Host, Way};
use kehai_emulator::qemu::{Forwarded, Line, PATIENCE_US, Qemu};
use kehai_emulator::serve::UdpSensor;
use kehai_emulator::source::StillRoom;
use kehai_emulator::urg::Config;
use kehai_emulator::urg::model::UST_10LX;

/// Bytes of the image's flash.
const FLASH_LEN: usize = 128 * 1024;
/// Bytes of the file that QEMU takes for it.
const FILE_LEN: u64 = 16 * 1024 * 1024;
/// Where the image looks for how its flash fails: `Control` in `src/bin/mps2-an386/storage.rs`.
const CONTROL: u64 = FLASH_LEN as u64;
/// Its fields, and where the bits of the damaged words begin.
const CUT_WORD: u64 = CONTROL + 12;
const DAMAGED: u64 = CONTROL + 16;
/// Set in the number of a word that was being erased.
const ERASURE: u32 = 1 << 31;

/// Settings that are stored until each page was in use: 32 pages of 4 KiB, 300 bytes each time.
const STORED_BEFORE: u32 = 600;

/// Moments in a usual run.
const CUTS: u64 = 16;

/// Between two requests for the same, µs.
const AGAIN_US: u64 = 1_000_000;

/// Long settings under this name, so that a page is full after some of them.
fn settings(name: &str) -> String {
    let others: Vec<String> = (3..10).map(|host| format!("10.100.200.{host}")).collect();
    format!("name={name}\nhosts=10.0.2.2,{}", others.join(","))
}

/// Flash that has been in use, in a file that QEMU shares while it runs.
struct Cells {
    path: PathBuf,
    file: File,
}

impl Cells {
    fn used() -> Self {
        // Tests of one process run side by side.
        static MADE: AtomicU32 = AtomicU32::new(0);
        let name =
            format!("kehai-power-cuts-{}-{}", std::process::id(), MADE.fetch_add(1, Ordering::Relaxed));
        let path = std::env::temp_dir().join(name);
        let file = File::options().read(true).write(true).create(true).truncate(true).open(&path).unwrap();
        let cells = Self { path, file };
        cells.wear(0..STORED_BEFORE);
        cells
    }

    /// Stores settings of these numbers, one after the other. The machine is off, and no word is unreadable.
    fn wear(&self, numbers: Range<u32>) {
        if numbers.start > 0 {
            self.file.set_len(FLASH_LEN as u64).unwrap();
        }
        let flash = Flash::open(&self.path, FLASH_LEN / PAGE_LEN).unwrap();
        let mut store = FlashStore::new(flash.clone(), 0..FLASH_LEN as u32).unwrap();
        for number in numbers {
            let stored = Settings::new().changed_by(&settings(&format!("before-{number}"))).unwrap();
            embassy_futures::block_on(save_settings(&mut store, &stored)).unwrap();
        }
        let erased = |page: &&[u8]| page.iter().all(|byte| *byte == 0xff);
        assert!(flash.contents().chunks(PAGE_LEN).filter(erased).count() < 3);
        self.file.set_len(FILE_LEN).unwrap();
    }

    /// Cuts the power in the `cut`th operation from now on, or from the next erasure on, when so many 256ths are done.
    fn arm(&self, cut: u32, from_erasure: bool, reached: u32) {
        let fields = [cut, u32::from(from_erasure), reached, 0];
        // Last what arms it: the image may be at work.
        for (number, field) in fields.into_iter().enumerate().rev() {
            self.file.write_all_at(&field.to_le_bytes(), CONTROL + 4 * number as u64).unwrap();
        }
    }

    /// The word in whose midst the power went.
    fn cut_word(&self) -> Option<u32> {
        let mut bytes = [0; 4];
        self.file.read_exact_at(&mut bytes, CUT_WORD).unwrap();
        Some(u32::from_le_bytes(bytes)).filter(|word| *word != 0)
    }

    /// Makes a word unreadable.
    fn damage(&self, word: u64) {
        let (mut byte, at) = ([0], DAMAGED + word / 8);
        self.file.read_exact_at(&mut byte, at).unwrap();
        self.file.write_all_at(&[byte[0] | 1 << (word % 8)], at).unwrap();
    }

    /// The machine is off: spoils the word in whose midst the power went. Whether it was being erased, and whether it can no
    /// longer be read.
    fn spoil(&self, random: &mut Random) -> (bool, bool) {
        let found = self.cut_word().expect("the power was cut");
        self.arm(0, false, 0);
        let word = u64::from((found & !ERASURE) - 1);
        if random.next().is_multiple_of(2) {
            let any: Vec<u8> = (0..WORD_LEN).map(|_| random.next() as u8).collect();
            self.file.write_all_at(&any, word * WORD_LEN as u64).unwrap();
        }
        let is_damaged = !random.next().is_multiple_of(4);
        if is_damaged {
            self.damage(word);
        }
        (found & ERASURE != 0, is_damaged)
    }
}

impl Drop for Cells {
    fn drop(&mut self) {
        // It may be gone with the whole folder.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// The board, cut again and again.
struct Bench {
    image: &'static Path,
    sensor: UdpSensor,
    cells: Cells,
    request: u32,
}

/// A board that is on, with its host.
struct On {
    _board: Qemu,
    host: Host<Forwarded>,
}

impl Bench {
    fn new(image: &'static Path) -> Self {
        // A sensor that answers within a millisecond: the stream is stopped before anything is stored.
        let sensor = sensor(Config::new(UST_10LX), StillRoom::new(UST_10LX.geometry));
        Self { image, sensor, cells: Cells::used(), request: 1_000_000 }
    }

    fn power_on(&self) -> On {
        let board = start(self.image, Line::AnySpeed(&self.sensor), Some(&self.cells.path));
        let mut host = host_of(&board);
        host.subscribe();
        On { _board: board, host }
    }

    /// Asks for `request` until it is answered: what `answered` makes of the answer; none if the power goes before.
    fn ask<T>(
        &mut self,
        on: &mut On,
        request: Request<'_>,
        answered: impl Fn(u32, &Message<'_>) -> Option<T>,
    ) -> Option<T> {
        self.request += 1;
        let (id, cells) = (self.request, &self.cells);
        let mut asked_us = None;
        on.host.look(|host, message| {
            if cells.cut_word().is_some() {
                return Some(None);
            }
            if let Some(answer) = answered(id, message) {
                return Some(Some(answer));
            }
            let now_us = host.way.now_us();
            if asked_us.is_none_or(|asked_us| now_us > asked_us + AGAIN_US) {
                let mut datagram = [0; 1400];
                let len = request.encode(host.identity, id, host.cookie, &mut datagram).unwrap();
                host.way.send(&datagram[..len]);
                asked_us = Some(now_us);
            }
            None
        })
    }

    /// The module's name.
    fn name(&mut self, on: &mut On) -> String {
        let name = |id: u32, message: &Message<'_>| match message {
            Message::Settings { request_id, text, .. } if *request_id == id => {
                text.lines().find_map(|line| line.strip_prefix("name=")).map(str::to_owned)
            }
            _ => None,
        };
        self.ask(on, Request::GetSettings, name).expect("the power is on")
    }

    /// Sets one name after the other until the power goes: the last that was acknowledged, and the one under way.
    fn set_until_cut(&mut self, on: &mut On, cut: u64, before: &str) -> [String; 2] {
        let mut stored = before.to_owned();
        for number in 0.. {
            let wanted = format!("cut-{cut}-{number}");
            let done = |id: u32, message: &Message<'_>| {
                matches!(message, Message::Done { request_id } if *request_id == id).then_some(())
            };
            if self.ask(on, Request::SetSettings { text: &settings(&wanted) }, done).is_none() {
                return [stored, wanted];
            }
            stored = wanted;
        }
        unreachable!("the power goes before");
    }
}

#[test]
fn a_start_that_searches_a_store_of_many_unreadable_words_lasts() {
    let Some(image) = image() else { return };
    let bench = Bench::new(image);
    let mut on = bench.power_on();
    // A background is stored: its parts are searched for one by one.
    on.host.settle();
    drop(on);
    // Far from the newest page, where the search begins.
    bench.cells.wear(STORED_BEFORE..STORED_BEFORE + STORED_BEFORE / 2);
    // Each makes the search of its page longer.
    let words_of_a_page = PAGE_LEN / WORD_LEN;
    for page in 0..FLASH_LEN / PAGE_LEN {
        (5..words_of_a_page)
            .step_by(11)
            .for_each(|word| bench.cells.damage((page * words_of_a_page + word) as u64));
    }
    // It is heard again.
    bench.power_on();
}

#[test]
fn wherever_the_power_is_cut_the_image_starts_with_the_old_or_the_new_settings() {
    let Some(image) = image() else { return };
    let cuts = std::env::var("KEHAI_POWER_CUTS")
        .map_or(CUTS, |count| count.parse().expect("KEHAI_POWER_CUTS: a number"));
    let mut bench = Bench::new(image);
    let mut on = bench.power_on();
    // A background that is stored just then would keep the settings waiting.
    on.host.settle();
    let mut found = bench.name(&mut on);
    assert_eq!(found, format!("before-{}", STORED_BEFORE - 1));
    let [mut old, mut new, mut erasing, mut unreadable, mut starting] = [0; 5];
    for cut in 0..cuts {
        let mut random = Random(cut);
        let (erases, number) = (cut % 2 == 1, (cut / 2) as u32);
        bench.cells.arm(1 + number % if erases { 6 } else { 12 }, erases, random.next() as u32 % 256);
        let allowed = bench.set_until_cut(&mut on, cut, &found);
        drop(on);
        let mut spoil = |random: &mut Random| {
            let (is_erasure, is_damaged) = bench.cells.spoil(random);
            erasing += u32::from(is_erasure);
            unreadable += u32::from(is_damaged);
        };
        spoil(&mut random);
        if cut % 4 < 2 && cut / 4 % 2 == 0 {
            // While it starts, it counts that, and repairs what it finds.
            bench.cells.arm(1 + number % 2, false, random.next() as u32 % 256);
            let board = start(image, Line::AnySpeed(&bench.sensor), Some(&bench.cells.path));
            let cells = &bench.cells;
            board.time().until(PATIENCE_US, || cells.cut_word()).expect("a start stores its number");
            drop(board);
            spoil(&mut random);
            starting += 1;
        }
        on = bench.power_on();
        found = bench.name(&mut on);
        assert!(allowed.contains(&found), "cut {cut}: {found} is none of {allowed:?}");
        old += u32::from(found == allowed[0]);
        new += u32::from(found == allowed[1]);
    }
    println!(
        "cut at {cuts} moments, {starting} times once more while it started: old settings {old} times, new ones {new} times; \
         {erasing} words were being erased, {unreadable} could not be read"
    );
    assert!(old > 0 && erasing > 0 && unreadable > 0);
}
