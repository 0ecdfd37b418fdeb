//! The boot loader with its power cut at every write and erasure, and with images that must not start.
//!
//! ```text
//!   image that runs (here: its own code for flash) ─▶ spare, notes ─▶ boot loader ─ cut ─▶ boot loader ─▶ active: old or new
//! ```

mod bytewise;

use embassy_futures::block_on;
use embedded_storage_async::nor_flash::NorFlash;
use kehai::link::Images;
use kehai::store::damaged::ZeroDamaged;
use kehai::store::flash::FlashStore;
use kehai::update::Version;
use kehai::update::boot::{Policy, prepare};
use kehai::update::manifest::{MANIFEST_LEN, Manifest, SIGNED_LEN, program};
use kehai::update::notes::{Candidate, Fault, Stage};
use kehai::update::plan::{ImageJob, pages};
use kehai::update::slots::Slots;
use kehai::update::standing::Run;
use kehai_emulator::pc::flash::{Flash, FlashError};
use salty::{Keypair, Sha512};

use bytewise::Bytewise;

const PAGE: u32 = 4096;
const PAGES: u32 = 14;
const SLOTS: Slots = Slots {
    notes: 2 * PAGE..4 * PAGE,
    state: 4 * PAGE..5 * PAGE,
    active: 5 * PAGE..9 * PAGE,
    spare: 9 * PAGE..14 * PAGE,
};
static STATIC_SLOTS: Slots = SLOTS;

/// The maker's secret, and one who is no maker.
const MAKER: [u8; 32] = [42; 32];
const STRANGER: [u8; 32] = [43; 32];

/// A flash whose power goes.
trait Power: NorFlash + Clone {
    fn copy(&self) -> Self;
    fn cut_after(&self, operations: u32);
    fn power_on(&self) -> bool;
    fn operations(&self) -> u32;
    fn contents(&self) -> Vec<u8>;
}

/// The STM32H5's: words of 16 bytes, which a cut leaves unreadable, and which read as zeros then.
#[derive(Clone)]
struct Corrected(ZeroDamaged<Flash, fn(&FlashError) -> bool>, Flash);

impl Corrected {
    fn of(flash: Flash) -> Self {
        Self(ZeroDamaged::new(flash.clone(), |error| *error == FlashError::Damaged), flash)
    }
}

impl Power for Corrected {
    fn copy(&self) -> Self {
        Self::of(self.1.copy())
    }

    fn cut_after(&self, operations: u32) {
        self.1.cut_after(operations);
    }

    fn power_on(&self) -> bool {
        self.1.power_on()
    }

    fn operations(&self) -> u32 {
        self.1.operations()
    }

    fn contents(&self) -> Vec<u8> {
        self.1.contents()
    }
}

impl embedded_storage_async::nor_flash::ErrorType for Corrected {
    type Error = FlashError;
}

impl embedded_storage_async::nor_flash::ReadNorFlash for Corrected {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, at: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        self.0.read(at, bytes).await
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl NorFlash for Corrected {
    const WRITE_SIZE: usize = 16;
    const ERASE_SIZE: usize = PAGE as usize;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        self.0.erase(from, to).await
    }

    async fn write(&mut self, at: u32, bytes: &[u8]) -> Result<(), FlashError> {
        self.0.write(at, bytes).await
    }
}

fn image(seed: u8, len: usize) -> Vec<u8> {
    (0..len).map(|at| (at / 3) as u8 ^ (at >> 8) as u8 ^ seed).collect()
}

fn digest(bytes: &[u8]) -> [u8; 64] {
    let mut digest = Sha512::new();
    digest.update(bytes);
    digest.finalize()
}

fn about(image: &[u8]) -> Manifest {
    let (version, least) = (Version([0, 3, 0]), Version([0, 2, 0]));
    Manifest { program: program("pc"), version, least, size: image.len() as u32, digest: digest(image) }
}

fn signed(manifest: &Manifest, secret: &[u8; 32]) -> [u8; MANIFEST_LEN] {
    let mut bytes = [0; MANIFEST_LEN];
    let (head, signature) = bytes.split_at_mut(SIGNED_LEN);
    head.copy_from_slice(&manifest.signed_bytes());
    signature.copy_from_slice(&Keypair::from(secret).sign(head).to_bytes());
    bytes
}

fn store<F: Power>(flash: &F) -> FlashStore<F> {
    FlashStore::new(flash.clone(), 0..2 * PAGE).unwrap().with_slots(Some(&STATIC_SLOTS))
}

/// What the image that runs does with one that comes.
fn receive<F: Power>(flash: &F, manifest: &[u8; MANIFEST_LEN], image: &[u8]) {
    let mut store = store(flash);
    block_on(store.images(ImageJob::Begin(manifest))).unwrap();
    for (number, bytes) in image.chunks(1024).enumerate() {
        block_on(store.images(ImageJob::Write { offset: number as u32 * 1024, bytes })).unwrap();
    }
    block_on(store.images(ImageJob::Complete)).unwrap();
}

/// A flash with an old image in its active slot.
fn with_old<F: Power>(mut flash: F) -> F {
    let old = image(1, SLOTS.active.len());
    block_on(flash.write(SLOTS.active.start, &old)).unwrap();
    flash
}

fn start<F: Power>(flash: &F) {
    let maker = Keypair::from(&MAKER).public.to_bytes();
    let policy = Policy { program: program("pc"), makers: &[[0; 32], maker] };
    prepare(flash.clone(), &SLOTS, &policy);
}

fn active<F: Power>(flash: &F, len: usize) -> Vec<u8> {
    flash.contents()[SLOTS.active.start as usize..][..len].to_vec()
}

fn stage<F: Power>(flash: &F) -> Option<Stage> {
    let page = pages(&SLOTS).1.start as usize;
    Candidate::read(flash.contents()[page..].first_chunk().unwrap()).map(|candidate| candidate.stage)
}

fn run<F: Power>(flash: &F) -> Run {
    block_on(store(flash).images(ImageJob::Look)).unwrap().run
}

/// Starts with the power cut in each operation in turn, and once more without: what flash is like then.
fn each_cut<F: Power>(flash: &F, mut check: impl FnMut(u32, &F)) -> u32 {
    let whole = flash.copy();
    start(&whole);
    let operations = whole.operations();
    check(u32::MAX, &whole);
    for cut in 0..operations {
        let flash = flash.copy();
        flash.cut_after(cut);
        start(&flash);
        assert!(flash.power_on(), "{cut}");
        start(&flash);
        check(cut, &flash);
    }
    operations
}

fn a_new_image_is_tried_kept_when_confirmed_and_swapped_back_when_not<F: Power>(flash: F) {
    let (old, new) = (image(1, SLOTS.active.len()), image(2, 3 * PAGE as usize + 100));
    let flash = with_old(flash);
    receive(&flash, &signed(&about(&new), &MAKER), &new);
    let mut untried = 0;
    let operations = each_cut(&flash, |cut, flash| {
        if active(flash, new.len()) != new {
            // The last word of the swap was cut off: it counts as tried, in flash that cannot write it again.
            assert!(active(flash, old.len()) == old, "{cut}: neither");
            untried += 1;
            return;
        }
        assert_eq!(run(flash), Run::OnTrial, "{cut}");
        // Kept, once it says so.
        let kept = flash.copy();
        block_on(store(&kept).images(ImageJob::Confirm)).unwrap();
        (0..2).for_each(|_| start(&kept));
        assert!(active(&kept, new.len()) == new, "{cut}");
        assert_eq!((run(&kept), stage(&kept)), (Run::Confirmed, Some(Stage::Confirmed)), "{cut}");
        // Swapped back, and never tried again.
        (0..4).for_each(|_| start(flash));
        assert!(active(flash, old.len()) == old, "{cut}");
        assert_eq!(stage(flash), Some(Stage::Reverted), "{cut}");
    });
    assert!(operations > 40 && untried <= 1, "{operations}, {untried}");
    println!("tried: power cut in each of {operations} operations");
    start(&flash);
    let operations = each_cut(&flash, |cut, flash| {
        assert!(active(flash, old.len()) == old, "{cut}");
        (0..3).for_each(|_| start(flash));
        assert!(active(flash, old.len()) == old, "{cut}: tried again");
        assert_eq!(stage(flash), Some(Stage::Reverted), "{cut}");
        // The next image is received and tried as the first one was.
        receive(flash, &signed(&about(&new), &MAKER), &new);
        start(flash);
        assert!(active(flash, new.len()) == new, "{cut}");
    });
    println!("swapped back: power cut in each of {operations} operations");
}

#[test]
fn power_cuts_in_flash_of_words_that_correct_errors() {
    let flash = Corrected::of(Flash::with_error_correction(PAGES as usize));
    a_new_image_is_tried_kept_when_confirmed_and_swapped_back_when_not(flash);
}

#[test]
fn power_cuts_in_flash_of_words() {
    let flash = Corrected::of(Flash::new(PAGES as usize));
    a_new_image_is_tried_kept_when_confirmed_and_swapped_back_when_not(flash);
}

#[test]
fn power_cuts_in_flash_of_bytes() {
    a_new_image_is_tried_kept_when_confirmed_and_swapped_back_when_not(Bytewise::new(PAGES));
}

/// The old image runs as before, and the notes say why.
fn refuses(manifest: &[u8; MANIFEST_LEN], image_bytes: &[u8], fault: Fault) {
    let old = image(1, SLOTS.active.len());
    let flash = with_old(Corrected::of(Flash::with_error_correction(PAGES as usize)));
    receive(&flash, manifest, image_bytes);
    let operations = each_cut(&flash, |cut, flash| {
        (0..2).for_each(|_| start(flash));
        assert!(active(flash, old.len()) == old, "{fault:?}");
        assert_ne!(run(flash), Run::OnTrial);
        if cut == u32::MAX {
            assert_eq!(stage(flash), Some(Stage::Refused(fault)));
        }
    });
    assert_eq!(operations, 1, "only the note is written");
}

#[test]
fn an_image_that_is_not_its_makers_or_not_whole_never_starts() {
    let new = image(2, 3 * PAGE as usize + 100);
    let right = about(&new);
    refuses(&signed(&right, &STRANGER), &new, Fault::Forged);
    // Whatever of the manifest is changed, the signature is none any more.
    let manifest = signed(&right, &MAKER);
    for at in (8..MANIFEST_LEN).step_by(7) {
        let mut changed = manifest;
        changed[at] ^= 1 << (at % 8);
        refuses(&changed, &new, Fault::Forged);
    }
    let mut flipped = new.clone();
    for at in [0, 1023, 1024, new.len() - 1] {
        flipped[at] ^= 0x10;
        refuses(&manifest, &flipped, Fault::Damaged);
        flipped[at] ^= 0x10;
    }
    refuses(&manifest, &new[..2048], Fault::Damaged);
    let too_large = Manifest { size: SLOTS.active.len() as u32 + 16, ..right };
    refuses(&signed(&too_large, &MAKER), &new, Fault::Damaged);
    let other = Manifest { program: program("nucleo-h563zi"), ..right };
    refuses(&signed(&other, &MAKER), &new, Fault::OtherProgram);
}

#[test]
fn an_image_below_the_least_version_never_starts() {
    let new = image(2, 2000);
    let flash = with_old(Corrected::of(Flash::with_error_correction(PAGES as usize)));
    receive(&flash, &signed(&about(&new), &MAKER), &new);
    start(&flash);
    block_on(store(&flash).images(ImageJob::Confirm)).unwrap();
    let older = image(3, 2000);
    let manifest = Manifest { version: Version([0, 1, 9]), ..about(&older) };
    receive(&flash, &signed(&manifest, &MAKER), &older);
    start(&flash);
    assert!(active(&flash, 2000) == new);
    assert_eq!(stage(&flash), Some(Stage::Refused(Fault::TooOld)));
    // As old as may be.
    let manifest = Manifest { version: Version([0, 2, 0]), ..about(&older) };
    receive(&flash, &signed(&manifest, &MAKER), &older);
    start(&flash);
    assert!(active(&flash, 2000) == older);
    assert_eq!(stage(&flash), Some(Stage::Tried));
}

#[test]
fn an_image_that_has_not_all_come_is_not_looked_at() {
    let new = image(2, 2000);
    let flash = with_old(Corrected::of(Flash::with_error_correction(PAGES as usize)));
    block_on(store(&flash).images(ImageJob::Begin(&signed(&about(&new), &MAKER)))).unwrap();
    let operations = flash.operations();
    start(&flash);
    assert_eq!((flash.operations(), stage(&flash)), (operations, Some(Stage::Receiving)));
    // Flash that never held an image.
    let flash = with_old(Bytewise::new(PAGES));
    let operations = flash.operations();
    start(&flash);
    assert_eq!(flash.operations(), operations);
}
