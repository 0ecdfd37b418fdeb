//! Where the images come from.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::{Error, TARGET};

/// What is at the end of the board's serial line, and so which image runs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Image {
    /// A range finder.
    RangeFinder,
    /// A SensFloor.
    Floor,
    /// A range finder, by an image for the active slot.
    InSlot,
    /// The boot loader, which starts that one.
    Boot,
}

impl Image {
    /// Its program.
    const fn name(self) -> &'static str {
        match self {
            Self::RangeFinder | Self::InSlot => "mps2-an386",
            Self::Floor => "mps2-an386-floor",
            Self::Boot => "mps2-an386-boot",
        }
    }

    /// The variable that names it where it is built already.
    const fn variable(self) -> &'static str {
        match self {
            Self::RangeFinder => "KEHAI_QEMU_IMAGE",
            Self::Floor => "KEHAI_QEMU_FLOOR_IMAGE",
            Self::InSlot => "KEHAI_QEMU_SLOT_IMAGE",
            Self::Boot => "KEHAI_QEMU_BOOT",
        }
    }

    const fn features(self) -> &'static str {
        match self {
            Self::RangeFinder | Self::Floor => "board-mps2-an386",
            Self::InSlot => "board-mps2-an386,in-slot",
            Self::Boot => "board-mps2-an386,boot",
        }
    }
}

/// The image, built from these sources; or the one that `KEHAI_QEMU_IMAGE`,
/// `KEHAI_QEMU_FLOOR_IMAGE`, `KEHAI_QEMU_SLOT_IMAGE` or `KEHAI_QEMU_BOOT` names.
///
/// # Errors
/// [`Error::NoQemu`] or [`Error::NoTarget`] where it cannot be done at all; [`Error::Build`].
pub fn image(image: Image) -> Result<PathBuf, Error> {
    Command::new("qemu-system-arm").arg("--version").output().map_err(|_| Error::NoQemu)?;
    if let Some(built) = env::var_os(image.variable()) {
        return Ok(built.into());
    }
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let libraries = Command::new("rustc").args(["--print", "target-libdir", "--target", TARGET]).output()?;
    if !Path::new(String::from_utf8_lossy(&libraries.stdout).trim()).is_dir() {
        return Err(Error::NoTarget);
    }
    let target = env::var_os("CARGO_TARGET_DIR").map_or_else(|| workspace.join("target"), PathBuf::from);
    let target = if image == Image::InSlot { target.join("slot") } else { target };
    let build = Command::new("cargo")
        .current_dir(&workspace)
        .args(["build", "--release", "--locked", "--package", "kehai", "--target", TARGET])
        .args(["--bin", image.name(), "--features", image.features()])
        .arg("--target-dir")
        .arg(&target)
        .output()?;
    if !build.status.success() {
        return Err(Error::Build(String::from_utf8_lossy(&build.stderr).into_owned()));
    }
    Ok(target.join(TARGET).join("release").join(image.name()))
}
