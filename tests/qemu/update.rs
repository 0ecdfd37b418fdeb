//! The boot loader and the real firmware image in QEMU: an image that came is tried, kept if it works, and swapped back if it
//! hangs, sees nothing or is not its maker's.
//!
//! ```text
//!   file of flash: active = the image, spare = the next one, notes = its manifest ─▶ boot loader ─▶ which one runs
//! ```

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use kehai::update::Version;
use kehai::update::manifest::{MANIFEST_LEN, Manifest, SIGNED_LEN, program};
use kehai::update::notes::{COMPLETE, Candidate, Fault, Stage, least_word, mark};
use kehai::wire::{EventKind, Message};
use kehai_emulator::pc::host::Way;
use kehai_emulator::qemu::{GuestTime, Line, Machine, Network, Qemu};
use kehai_emulator::serve::UdpSensor;
use kehai_emulator::source::StillRoom;
use kehai_emulator::urg::model::URG_04LX;
use kehai_emulator::urg::{Config, Urg};
use object::Endianness;
use object::elf::{FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader, ProgramHeader};
use salty::{Keypair, Sha512};

use crate::support::board::{MAC, host_of, slot_image};

/// Bytes of the file that QEMU takes for the flash, and where what is in it: src/bin/mps2-an386/slots.rs.
const FILE_LEN: usize = 16 * 1024 * 1024;
const SETTINGS_LEN: usize = 0x2_0000;
const IMAGES: std::ops::Range<usize> = 0x4_0000..0xd_1000;
const NOTES: usize = 0x4_0000;
const CANDIDATE: usize = NOTES + 0x1000;
const ACTIVE: usize = 0x5_0000;
const SPARE: usize = 0x9_0000;

/// What the boot loader was built with: everybody's key.
fn maker() -> Keypair {
    let digits = include_str!("../data/update/development.key").trim();
    let seed: [u8; 32] =
        std::array::from_fn(|at| u8::from_str_radix(&digits[2 * at..2 * at + 2], 16).unwrap());
    Keypair::from(&seed)
}

/// The bytes that flash holds of an ELF.
fn flattened(elf: &Path) -> Vec<u8> {
    let file = std::fs::read(elf).unwrap();
    let header = FileHeader32::<Endianness>::parse(file.as_slice()).unwrap();
    let endian = header.endian().unwrap();
    let mut image = Vec::new();
    for segment in header.program_headers(endian, file.as_slice()).unwrap() {
        let bytes = segment.data(endian, file.as_slice()).unwrap();
        if segment.p_type(endian) == PT_LOAD && !bytes.is_empty() {
            image.resize(segment.p_paddr(endian) as usize - 0x2100_0000 - ACTIVE, 0xff);
            image.extend_from_slice(bytes);
        }
    }
    image
}

/// A file of flash with an image in the active slot, and one that came.
pub struct Flash {
    path: PathBuf,
    pub old: Vec<u8>,
    pub new: Vec<u8>,
}

impl Flash {
    /// What came is the same image and sixteen bytes more, with this manifest.
    pub fn new(image: &Path, manifest: impl FnOnce(&[u8]) -> [u8; MANIFEST_LEN]) -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("kehai-update-{}-{number}", std::process::id()));
        let old = flattened(image);
        let new = [old.as_slice(), b"sixteen bytes, a"].concat();
        let mut bytes = vec![0; FILE_LEN];
        bytes[..SETTINGS_LEN].fill(0xff);
        bytes[IMAGES].fill(0xff);
        let mut put = |at: usize, what: &[u8]| bytes[at..at + what.len()].copy_from_slice(what);
        put(ACTIVE, &old);
        put(SPARE, &new);
        put(CANDIDATE, &manifest(&new));
        put(CANDIDATE + COMPLETE as usize, &mark());
        put(NOTES, &least_word(Version([0, 1, 0])));
        std::fs::write(&path, bytes).unwrap();
        Self { path, old, new }
    }

    /// Puts settings there.
    pub fn set_settings(&self, settings: &[u8]) {
        let mut bytes = std::fs::read(&self.path).unwrap();
        bytes[..settings.len()].copy_from_slice(settings);
        std::fs::write(&self.path, bytes).unwrap();
    }

    pub fn runs(&self, image: &[u8]) -> bool {
        let bytes = std::fs::read(&self.path).unwrap();
        let (slot, rest) = bytes[ACTIVE..ACTIVE + self.new.len()].split_at(image.len());
        slot == image && (image.len() == self.new.len() || rest.iter().all(|byte| *byte == 0xff))
    }

    fn stage(&self) -> Stage {
        let bytes = std::fs::read(&self.path).unwrap();
        Candidate::read(bytes[CANDIDATE..].first_chunk().unwrap()).unwrap().stage
    }
}

impl Drop for Flash {
    fn drop(&mut self) {
        // It may be gone with the whole folder.
        let _ = std::fs::remove_file(&self.path);
    }
}

pub fn about(image: &[u8]) -> Manifest {
    let mut digest = Sha512::new();
    digest.update(image);
    let (version, least) = (Version([0, 2, 0]), Version([0, 2, 0]));
    let program = program("mps2-an386");
    Manifest { program, version, least, size: image.len() as u32, digest: digest.finalize() }
}

pub fn signed(manifest: &Manifest) -> [u8; MANIFEST_LEN] {
    let mut bytes = [0; MANIFEST_LEN];
    let (head, signature) = bytes.split_at_mut(SIGNED_LEN);
    head.copy_from_slice(&manifest.signed_bytes());
    signature.copy_from_slice(&maker().sign(head).to_bytes());
    bytes
}

pub fn board((image, boot): (&Path, &Path), line: Line<'_>, flash: &Flash) -> Qemu {
    let (time, network) = (&GuestTime::new(), Network::User);
    let machine =
        Machine { image, boot: Some(boot), mac: MAC, time, line, network, flash: Some(&flash.path) };
    Qemu::start(&machine).unwrap()
}

fn sensor() -> UdpSensor {
    UdpSensor::new(Urg::new(Config::new(URG_04LX), Box::new(StillRoom::new(URG_04LX.geometry)), 0)).unwrap()
}

/// Listens to the board until it says that.
fn hears(board: &Qemu, kind: EventKind) {
    let mut host = host_of(board);
    host.subscribe();
    host.look(|_, message| match message {
        Message::Health(health) => health.events.iter().any(|event| event.kind == kind).then_some(()),
        _ => None,
    });
}

#[test]
fn a_new_image_is_tried_and_stays_once_it_works() {
    let Some(images) = slot_image() else { return };
    let flash = Flash::new(images.0, |new| signed(&about(new)));
    let sensor = sensor();
    let mut board = board(images, Line::AnySpeed(&sensor), &flash);
    hears(&board, EventKind::ImageOnTrial);
    hears(&board, EventKind::ImageConfirmed);
    assert!(flash.runs(&flash.new));
    assert_eq!(flash.stage(), Stage::Confirmed);
    board.reset().unwrap();
    let mut host = host_of(&board);
    host.more(3);
    assert!(flash.runs(&flash.new), "it was swapped back");
}

#[test]
fn an_image_that_hangs_is_swapped_back_by_the_watchdog() {
    let Some(images) = slot_image() else { return };
    let flash = Flash::new(images.0, |new| signed(&about(new)));
    // Without a sensor it is not confirmed before it hangs.
    let mut board = board(images, Line::Open, &flash);
    hears(&board, EventKind::ImageOnTrial);
    assert!(flash.runs(&flash.new));
    board.hang().unwrap();
    hears(&board, EventKind::ImageReverted);
    assert!(flash.runs(&flash.old));
    assert_eq!(flash.stage(), Stage::Reverted);
}

/// With `KEHAI_TRIAL=1`: two minutes of a processor. `--test keys images` has the same without QEMU.
#[test]
fn an_image_that_sees_nothing_is_swapped_back_after_its_trial() {
    let Some(images) = slot_image().filter(|_| std::env::var_os("KEHAI_TRIAL").is_some()) else { return };
    let flash = Flash::new(images.0, |new| signed(&about(new)));
    let board = board(images, Line::Open, &flash);
    hears(&board, EventKind::ImageOnTrial);
    // Five minutes of its time, with a host that listens all the while.
    let mut host = host_of(&board);
    let reverted = |message: &Message<'_>| match message {
        Message::Health(health) => {
            health.events.iter().any(|event| event.kind == EventKind::ImageReverted).then_some(())
        }
        _ => None,
    };
    while host.turn(|_, message| reverted(message)).is_none() {
        assert!(host.way.now_us() < 330_000_000, "it is still there");
    }
    assert!(host.way.now_us() > 300_000_000, "it was given no time");
    assert!(flash.runs(&flash.old));
}

#[test]
fn what_is_not_its_makers_not_whole_not_for_it_or_too_old_is_never_started() {
    let Some(images) = slot_image() else { return };
    let forged = |new: &[u8]| {
        let mut manifest = signed(&about(new));
        manifest[190] ^= 1;
        manifest
    };
    let damaged = |new: &[u8]| signed(&Manifest { digest: [1; 64], ..about(new) });
    let other = |new: &[u8]| signed(&Manifest { program: program("nucleo-h563zi"), ..about(new) });
    let old = |new: &[u8]| signed(&Manifest { version: Version([0, 0, 9]), ..about(new) });
    type Make<'a> = &'a dyn Fn(&[u8]) -> [u8; MANIFEST_LEN];
    let cases: [(Make<'_>, Fault, EventKind); 4] = [
        (&forged, Fault::Forged, EventKind::ImageForged),
        (&damaged, Fault::Damaged, EventKind::ImageDamaged),
        (&other, Fault::OtherProgram, EventKind::ImageOther),
        (&old, Fault::TooOld, EventKind::ImageTooOld),
    ];
    for (manifest, fault, kind) in cases {
        let flash = Flash::new(images.0, manifest);
        let sensor = sensor();
        let board = board(images, Line::AnySpeed(&sensor), &flash);
        hears(&board, kind);
        assert!(flash.runs(&flash.old), "{fault:?}");
        assert_eq!(flash.stage(), Stage::Refused(fault));
    }
}
