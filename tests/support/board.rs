//! The image, and a board in QEMU that runs it.
#![allow(dead_code, reason = "every test file uses a part of this")]

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use host_sim::module::host::Host;
use host_sim::qemu::{self, Error, Line, Machine, Network, Qemu};

pub const MAC: [u8; 6] = [0x52, 0x54, 0x00, 0x12, 0x34, 0x81];

/// The image, built once; `None`, with a message, where it cannot be built or run.
pub fn image() -> Option<&'static Path> {
    static IMAGE: OnceLock<Option<PathBuf>> = OnceLock::new();
    let build = || match qemu::image() {
        Ok(image) => Some(image),
        Err(error @ (Error::NoQemu | Error::NoTarget)) if std::env::var_os("CI").is_none() => {
            println!("{error}: nothing tested");
            None
        }
        Err(error) => panic!("{error}"),
    };
    IMAGE.get_or_init(build).as_deref()
}

/// A board with this sensor, on a network of its own.
pub fn start(image: &Path, line: Line<'_>, flash: Option<&Path>) -> Qemu {
    Qemu::start(&Machine { image, mac: MAC, line, network: Network::User, flash }).unwrap()
}

/// Waits for `text` and fails with what QEMU and the log have to say.
#[track_caller]
pub fn wait_for(board: &mut Qemu, text: &str) -> qemu::Message {
    board.wait_for(text).unwrap_or_else(|error| panic!("{error}"))
}

/// A host of the board's module.
pub fn host_of(board: &Qemu) -> Host {
    Host::new(board.module()).unwrap()
}
