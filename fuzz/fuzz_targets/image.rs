//! Flash with any notes, any state and any images, at a boot loader and at the image that runs: no panic, and the active slot
//! keeps its bytes unless the maker has signed others.
//!
//! ```text
//!   input:  notes page 0 (64) │ notes page 1 (304) │ state (64) │ spare …
//! ```
#![no_main]

use std::cell::RefCell;
use std::rc::Rc;

use embassy_futures::block_on;
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use kehai::link::Images;
use kehai::store::flash::FlashStore;
use kehai::update::boot::{Policy, prepare};
use kehai::update::maker::DEVELOPMENT;
use kehai::update::manifest::program;
use kehai::update::plan::ImageJob;
use kehai::update::slots::Slots;
use libfuzzer_sys::fuzz_target;

const PAGE: u32 = 1024;
static SLOTS: Slots = Slots {
    notes: 2 * PAGE..4 * PAGE,
    state: 4 * PAGE..5 * PAGE,
    active: 5 * PAGE..7 * PAGE,
    spare: 7 * PAGE..10 * PAGE,
};

#[derive(Clone)]
struct Flash(Rc<RefCell<Vec<u8>>>);

impl Flash {
    fn part(&self, at: u32, len: usize, mut change: impl FnMut(&mut [u8])) -> Result<(), NorFlashErrorKind> {
        let mut bytes = self.0.borrow_mut();
        let part = bytes.get_mut(at as usize..).and_then(|rest| rest.get_mut(..len));
        part.map(&mut change).ok_or(NorFlashErrorKind::OutOfBounds)
    }
}

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, at: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        self.part(at, bytes.len(), |part| bytes.copy_from_slice(part))
    }

    fn capacity(&self) -> usize {
        self.0.borrow().len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 16;
    const ERASE_SIZE: usize = PAGE as usize;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        self.part(from, (to - from) as usize, |part| part.fill(0xff))
    }

    async fn write(&mut self, at: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        self.part(at, bytes.len(), |part| part.iter_mut().zip(bytes).for_each(|(place, byte)| *place &= byte))
    }
}

fuzz_target!(|input: &[u8]| {
    let mut bytes = vec![0xff; 10 * PAGE as usize];
    let mut rest = input;
    for (at, len) in [(SLOTS.notes.start, 64), (SLOTS.notes.start + PAGE, 304), (SLOTS.state.start, 64)] {
        let (head, tail) = rest.split_at(rest.len().min(len));
        bytes[at as usize..][..head.len()].copy_from_slice(head);
        rest = tail;
    }
    let spare = rest.len().min(3 * PAGE as usize);
    bytes[SLOTS.spare.start as usize..][..spare].copy_from_slice(&rest[..spare]);
    let active = SLOTS.active.start as usize..SLOTS.active.end as usize;
    bytes[active.clone()].fill(0x5c);
    // A swap that is said to be under way goes on: what it was begun for is over.
    let is_swapping = bytes[SLOTS.state.start as usize..][..16] == [0xf0; 16];
    let flash = Flash(Rc::new(RefCell::new(bytes)));
    let mut store = FlashStore::new(flash.clone(), 0..2 * PAGE).expect("pages").with_slots(Some(&SLOTS));
    let _ = block_on(store.images(ImageJob::Look));
    prepare(flash.clone(), &SLOTS, &Policy { program: program("pc"), makers: &[DEVELOPMENT] });
    let _ = block_on(store.images(ImageJob::Confirm));
    let _ = block_on(store.images(ImageJob::Told));
    let kept = flash.0.borrow()[active].iter().all(|byte| *byte == 0x5c);
    assert!(kept || is_swapping, "an image without a valid signature");
});
