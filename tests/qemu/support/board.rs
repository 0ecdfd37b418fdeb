//! The image, and a board in QEMU that runs it.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use kehai_emulator::pc::host::Host;
use kehai_emulator::qemu::{self, Error, Forwarded, GuestTime, Image, Line, Machine, Network, Qemu};

pub const MAC: [u8; 6] = [0x52, 0x54, 0x00, 0x12, 0x34, 0x81];

/// The image, built once; `None`, with a message, where it cannot be built or run.
pub fn image() -> Option<&'static Path> {
    static IMAGE: OnceLock<Option<PathBuf>> = OnceLock::new();
    IMAGE.get_or_init(|| build(Image::RangeFinder)).as_deref()
}

/// The same of the image for a floor.
pub fn floor_image() -> Option<&'static Path> {
    static IMAGE: OnceLock<Option<PathBuf>> = OnceLock::new();
    IMAGE.get_or_init(|| build(Image::Floor)).as_deref()
}

/// The image for the active slot, and the boot loader that starts it.
pub fn slot_image() -> Option<(&'static Path, &'static Path)> {
    static IMAGES: OnceLock<Option<(PathBuf, PathBuf)>> = OnceLock::new();
    let images = IMAGES.get_or_init(|| build(Image::InSlot).zip(build(Image::Boot))).as_ref();
    images.map(|(image, boot)| (image.as_path(), boot.as_path()))
}

fn build(image: Image) -> Option<PathBuf> {
    match qemu::image(image) {
        Ok(image) => Some(image),
        Err(error @ (Error::NoQemu | Error::NoTarget)) => {
            test_support::fail_in_ci_else_skip(error);
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// A board with this sensor, on a network of its own, in a time of its own.
pub fn start(image: &Path, line: Line<'_>, flash: Option<&Path>) -> Qemu {
    let (time, network) = (&GuestTime::new(), Network::User);
    Qemu::start(&Machine { image, boot: None, mac: MAC, time, line, network, flash }).unwrap()
}

/// Waits for `text` and fails with what QEMU and the log have to say.
#[track_caller]
pub fn wait_for(board: &mut Qemu, text: &str) -> qemu::Message {
    board.wait_for(text).unwrap_or_else(|error| panic!("{error}"))
}

/// A host of the board's module.
pub fn host_of(board: &Qemu) -> Host<Forwarded> {
    Host::at(Forwarded::new(board.module(), board.time()).unwrap())
}
