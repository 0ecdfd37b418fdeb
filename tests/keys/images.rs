//! Images by the sealed wire: which are received, how they come to flash, and what a module says of the one that runs.

use std::collections::VecDeque;

use embassy_futures::block_on;
use embedded_storage_async::nor_flash::NorFlash;
use kehai::device::Wish;
use kehai::link::{Images, StoreError};
use kehai::store::damaged::ZeroDamaged;
use kehai::store::flash::FlashStore;
use kehai::update::Version;
use kehai::update::manifest::{MANIFEST_LEN, Manifest, SIGNED_LEN, program};
use kehai::update::notes::{CONFIRMED, Candidate, Fault, OUTCOME, Stage, mark};
use kehai::update::plan::{ImageJob, pages};
use kehai::update::slots::Slots;
use kehai::update::standing::{Run, Standing};
use kehai::wire::{CHUNK_MAX, EventKind, ImageFault};
use kehai_emulator::pc::flash::{Flash, FlashError, PAGE_LEN};

use super::*;

const PAGE: u32 = PAGE_LEN as u32;
const SLOTS: Slots = Slots {
    notes: 2 * PAGE..4 * PAGE,
    state: 4 * PAGE..5 * PAGE,
    active: 5 * PAGE..9 * PAGE,
    spare: 9 * PAGE..14 * PAGE,
};

fn flash() -> Flash {
    Flash::with_error_correction(14)
}

fn store(flash: &Flash) -> FlashStore<impl NorFlash> {
    // As on the board whose flash corrects errors.
    let flash = ZeroDamaged::new(flash.clone(), |error: &FlashError| *error == FlashError::Damaged);
    FlashStore::new(flash, 0..2 * PAGE).unwrap().with_slots(Some(&SLOTS))
}

pub fn manifest(image: &[u8], version: [u16; 3]) -> [u8; MANIFEST_LEN] {
    let digest = [9; 64];
    let size = image.len() as u32;
    let manifest = Manifest {
        program: program("pc"),
        version: Version(version),
        least: Version([0, 2, 0]),
        size,
        digest,
    };
    let mut bytes = [version[1] as u8; MANIFEST_LEN];
    bytes[..SIGNED_LEN].copy_from_slice(&manifest.signed_bytes());
    bytes
}

fn image(len: usize) -> Vec<u8> {
    (0..len).map(|at| (at * 7 + at / 251) as u8).collect()
}

/// A module, its flash, and the holder of its control key.
struct World {
    module: Box<Module<1>>,
    flash: Flash,
    owner: Program,
}

impl World {
    fn new() -> Self {
        Self::on(flash())
    }

    /// A start with this flash.
    fn on(flash: Flash) -> Self {
        let mut module = claimed();
        let standing = block_on(store(&flash).images(ImageJob::Look));
        module.begin_images(standing);
        let owner = Program::of(5000, Role::Control).met(&mut module);
        Self { module, flash, owner }
    }

    /// Asks once: where the next piece begins, or why not.
    fn ask(&mut self, request: Request<'_>) -> Result<u32, Refusal> {
        let mut bytes = self.owner.sealed(request);
        self.deliver(&mut bytes)
    }

    fn deliver(&mut self, bytes: &mut [u8]) -> Result<u32, Refusal> {
        let mut sent = Sent::default();
        let now_us = self.owner.now_us;
        if let Some(work) = self.module.receive(self.owner.at, bytes, now_us, &mut sent) {
            assert!(sent.0.iter().all(|(_, bytes)| self.owner.opened(bytes).is_none_or(|bytes| {
                !matches!(Message::decode(&bytes).unwrap().1, Message::Receiving { .. })
            })));
            let done = block_on(store(&self.flash).images(work.job(bytes))).map(|_| ());
            self.module.image_done(&work, done, now_us, &mut sent);
        }
        let answers: VecDeque<Vec<u8>> =
            sent.0.into_iter().filter_map(|(_, bytes)| self.owner.opened(&bytes)).collect();
        answers
            .iter()
            .find_map(|bytes| match Message::decode(bytes).unwrap().1 {
                Message::Receiving { next, .. } => Some(Ok(next)),
                Message::Done { .. } => Some(Ok(u32::MAX)),
                Message::Refused(refused) => Some(Err(refused.refusal)),
                _ => None,
            })
            .expect("an answer")
    }

    fn candidate(&self) -> Option<Candidate> {
        let page = pages(&SLOTS).1.start as usize;
        Candidate::read(self.flash.contents()[page..].first_chunk().unwrap())
    }

    fn spare(&self) -> Vec<u8> {
        self.flash.contents()[SLOTS.spare.start as usize..SLOTS.spare.end as usize].to_vec()
    }

    /// What it says in its next health messages.
    fn events(&mut self) -> Vec<EventKind> {
        let mut sent = Sent::default();
        self.owner.now_us += 2_000_000;
        self.module.poll(self.owner.now_us, &mut sent);
        let opened: Vec<_> = sent.0.iter().filter_map(|(_, bytes)| self.owner.opened(bytes)).collect();
        let health = opened.iter().find_map(|bytes| match Message::decode(bytes).unwrap().1 {
            Message::Health(health) => Some(health.events.iter().map(|event| event.kind).collect()),
            _ => None,
        });
        health.expect("health each second")
    }
}

const fn refused(fault: ImageFault) -> Result<u32, Refusal> {
    Err(Refusal::Image(fault))
}

#[test]
fn an_image_comes_piece_by_piece_and_a_piece_that_comes_twice_is_stored_once() {
    let mut world = World::new();
    let image = image(3 * CHUNK_MAX + 100);
    let manifest = manifest(&image, [0, 3, 0]);
    assert_eq!(world.ask(Request::UpdateInstall), refused(ImageFault::Sequence));
    assert_eq!(world.ask(Request::Update { manifest: &manifest }), Ok(0));
    assert_eq!(world.candidate().unwrap().stage, Stage::Receiving);
    let mut at = 0;
    for bytes in image.chunks(CHUNK_MAX) {
        assert_eq!(world.ask(Request::UpdateInstall), refused(ImageFault::Sequence));
        let next = (at + bytes.len()) as u32;
        let chunk = Request::UpdateChunk { offset: at as u32, bytes };
        assert_eq!(world.ask(chunk), Ok(next));
        let operations = world.flash.operations();
        assert_eq!(world.ask(chunk), Ok(next), "its answer was lost");
        assert_eq!(world.flash.operations(), operations);
        // A host that has lost its place asks again.
        assert_eq!(world.ask(Request::Update { manifest: &manifest }), Ok(next));
        at += bytes.len();
    }
    assert_eq!(world.spare()[..image.len()], image);
    assert_eq!(world.ask(Request::UpdateInstall), Ok(u32::MAX));
    assert_eq!(world.candidate().unwrap().stage, Stage::Complete);
    assert_eq!(world.module.wish(), Some(Wish::Restart));
    assert_eq!(world.flash.rewritten(), 0);
}

#[test]
fn what_is_not_the_next_piece_is_refused_and_another_image_begins_anew() {
    let mut world = World::new();
    let image = image(2 * CHUNK_MAX);
    let first = manifest(&image, [0, 3, 0]);
    world.ask(Request::Update { manifest: &first }).unwrap();
    let piece = |offset, len| Request::UpdateChunk { offset, bytes: &image[..len] };
    assert_eq!(world.ask(piece(16, 16)), refused(ImageFault::Sequence), "a gap");
    assert_eq!(world.ask(piece(0, 15)), refused(ImageFault::Sequence), "half a word");
    assert_eq!(world.ask(piece(0, 1024)), Ok(1024));
    assert_eq!(world.ask(piece(512, 1024)), refused(ImageFault::Sequence), "half of it came before");
    assert_eq!(world.ask(piece(2048, 16)), refused(ImageFault::Sequence), "behind its end");
    assert_eq!(world.ask(piece(u32::MAX, 16)), refused(ImageFault::Sequence));
    let second = manifest(&image, [0, 4, 0]);
    assert_eq!(world.ask(Request::Update { manifest: &second }), Ok(0));
    assert_eq!(world.candidate().unwrap().manifest.version, Version([0, 4, 0]));
    assert_eq!(world.module.counters().get(Counter::RefusedImage), 5);
}

#[test]
fn an_image_that_cannot_be_is_refused_before_anything_is_erased() {
    let mut world = World::new();
    let right = manifest(&image(100), [0, 3, 0]);
    let of = |change: &dyn Fn(&mut Manifest)| {
        let mut manifest = Manifest::read(&right).unwrap();
        change(&mut manifest);
        let mut bytes = right;
        bytes[..SIGNED_LEN].copy_from_slice(&manifest.signed_bytes());
        bytes
    };
    let too_large = SLOTS.active.end - SLOTS.active.start + 1;
    for (manifest, fault) in [
        ([0; MANIFEST_LEN], ImageFault::Manifest),
        (of(&|image| image.program = program("nucleo-h563zi")), ImageFault::Program),
        (of(&|image| image.size = too_large), ImageFault::TooLarge),
        (of(&|image| image.size = 0), ImageFault::TooLarge),
    ] {
        assert_eq!(world.ask(Request::Update { manifest: &manifest }), refused(fault));
    }
    assert_eq!(world.flash.operations(), 0);
    // Without a boot loader there is no such request.
    world.module.begin_images(Ok(Standing::NO_BOOT_LOADER));
    assert_eq!(world.ask(Request::Update { manifest: &right }), Err(Refusal::Unsupported));
}

#[test]
fn an_image_that_cannot_be_stored_is_said_and_forgotten() {
    let mut world = World::new();
    let image = image(CHUNK_MAX);
    let manifest = manifest(&image, [0, 3, 0]);
    world.ask(Request::Update { manifest: &manifest }).unwrap();
    world.flash.cut_after(0);
    let chunk = Request::UpdateChunk { offset: 0, bytes: &image };
    assert_eq!(world.ask(chunk), Err(Refusal::NotStored));
    world.flash.power_on();
    assert_eq!(world.ask(chunk), refused(ImageFault::Sequence));
    assert_eq!(world.ask(Request::Update { manifest: &manifest }), Ok(0));
    assert_eq!(world.ask(chunk), Ok(1024));
}

/// Puts flash into the state in which a boot loader starts a new image.
fn on_trial(stage: &[(u32, [u8; 16])], state: u8) -> Flash {
    let mut world = World::new();
    let image = image(100);
    let manifest = manifest(&image, [0, 3, 0]);
    world.ask(Request::Update { manifest: &manifest }).unwrap();
    world.ask(Request::UpdateChunk { offset: 0, bytes: &image }).unwrap();
    world.ask(Request::UpdateInstall).unwrap();
    let mut flash = world.flash.clone();
    let page = pages(&SLOTS).1.start;
    for (at, word) in stage {
        block_on(flash.write(page + at, word)).unwrap();
    }
    block_on(flash.write(SLOTS.state.start, &[state; 16])).unwrap();
    flash
}

#[test]
fn an_image_on_trial_says_so_and_receives_no_other() {
    let mut world = World::on(on_trial(&[(OUTCOME, mark())], 0xf0));
    assert!(world.events().contains(&EventKind::ImageOnTrial));
    let other = manifest(&image(100), [0, 4, 0]);
    assert_eq!(world.ask(Request::Update { manifest: &other }), refused(ImageFault::OnTrial));
    // It sees nothing: it may not stay, and starts anew after five minutes.
    assert_ne!(world.module.wish(), Some(Wish::Confirm));
    for _ in 0..310 {
        world.owner.ask(&mut world.module, Request::Subscribe { t1: [0; 8] });
        world.owner.now_us += 1_000_000;
        world.module.poll(world.owner.now_us, &mut Sent::default());
        if world.module.wish().is_some() {
            break;
        }
    }
    assert_eq!(world.module.wish(), Some(Wish::Restart));
    assert!((299_000_000..305_000_000).contains(&world.owner.now_us), "{}", world.owner.now_us);
}

#[test]
fn a_confirmed_image_raises_the_least_version_once_and_whatever_power_does() {
    let look = |flash: &Flash| block_on(store(flash).images(ImageJob::Look)).unwrap();
    let begun = on_trial(&[(OUTCOME, mark())], 0xf0);
    assert_eq!(look(&begun).run, Run::OnTrial);
    let whole = begun.copy();
    block_on(store(&whole).images(ImageJob::Confirm)).unwrap();
    let operations = whole.operations();
    assert!(operations >= 4);
    for cut in 0..operations {
        let flash = begun.copy();
        flash.cut_after(cut);
        assert_eq!(block_on(store(&flash).images(ImageJob::Confirm)), Err(StoreError), "{cut}");
        flash.power_on();
        let after = look(&flash);
        // What its mark does not say yet is done once more.
        if after.run != Run::Confirmed {
            block_on(store(&flash).images(ImageJob::Confirm)).unwrap();
        }
        let end = look(&flash);
        assert_eq!((end.run, end.least), (Run::Confirmed, Version([0, 2, 0])), "{cut}");
    }
    let after = look(&whole);
    assert_eq!((after.run, after.least), (Run::Confirmed, Version([0, 2, 0])));
    block_on(store(&whole).images(ImageJob::Confirm)).unwrap();
    assert_eq!(look(&whole), after);
    assert_eq!(whole.rewritten(), 0);
    let mut world = World::on(whole);
    let older = manifest(&image(100), [0, 1, 9]);
    assert_eq!(world.ask(Request::Update { manifest: &older }), refused(ImageFault::TooOld));
    let page = pages(&SLOTS).1.start as usize + CONFIRMED as usize;
    assert_eq!(world.flash.contents()[page..page + 16], mark());
}

#[test]
fn below_the_least_version_of_an_image_that_has_confirmed_itself_none_is_received() {
    let mut world = World::on(on_trial(&[(OUTCOME, mark())], 0xf0));
    let done = block_on(store(&world.flash).images(ImageJob::Confirm)).map(|_| ());
    world.module.confirmed(done, world.owner.now_us, &mut Sent::default());
    let older = manifest(&image(100), [0, 1, 9]);
    assert_eq!(world.ask(Request::Update { manifest: &older }), refused(ImageFault::TooOld));
    let newer = manifest(&image(100), [0, 2, 0]);
    assert_eq!(world.ask(Request::Update { manifest: &newer }), Ok(0));
}

#[test]
fn an_outcome_is_noted_as_told_once_a_host_was_sent_it_and_no_other_image_has_begun_to_come() {
    let flash = on_trial(&[(OUTCOME, Fault::Damaged.word())], 0xd0);
    let mut alone = claimed();
    alone.begin_images(block_on(store(&flash).images(ImageJob::Look)));
    alone.poll(2_000_000, &mut Sent::default());
    assert_eq!(alone.wish(), None, "no host listens");
    let heard = || {
        let mut world = World::on(flash.copy());
        assert!(world.events().contains(&EventKind::ImageDamaged));
        assert_eq!(world.module.wish(), Some(Wish::Told));
        world
    };
    let mut world = heard();
    world.module.told(Ok(()));
    assert_eq!(world.module.wish(), None);
    let mut world = heard();
    let other = manifest(&image(100), [0, 4, 0]);
    assert_eq!(world.ask(Request::Update { manifest: &other }), Ok(0));
    assert_eq!(world.module.wish(), None);
}

#[test]
fn what_has_become_of_an_image_is_told_at_one_start() {
    for (word, kind) in [
        (Fault::Forged.word(), EventKind::ImageForged),
        (Fault::Damaged.word(), EventKind::ImageDamaged),
        (Fault::OtherProgram.word(), EventKind::ImageOther),
        (Fault::TooOld.word(), EventKind::ImageTooOld),
    ] {
        let flash = on_trial(&[(OUTCOME, word)], 0xd0);
        let mut world = World::on(flash.clone());
        assert!(world.events().contains(&kind), "{kind:?}");
        block_on(store(&flash).images(ImageJob::Told)).unwrap();
        assert!(!World::on(flash).events().contains(&kind));
    }
}
