//! Where the image comes from.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::{Error, TARGET};

const BOARD: &str = "mps2-an386";

/// The image, built from these sources; or the one that `KEHAI_QEMU_IMAGE` names.
///
/// # Errors
/// [`Error::NoQemu`] or [`Error::NoTarget`] where it cannot be done at all; [`Error::Build`].
pub fn image() -> Result<PathBuf, Error> {
    Command::new("qemu-system-arm").arg("--version").output().map_err(|_| Error::NoQemu)?;
    if let Some(image) = env::var_os("KEHAI_QEMU_IMAGE") {
        return Ok(image.into());
    }
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let libraries = Command::new("rustc").args(["--print", "target-libdir", "--target", TARGET]).output()?;
    if !Path::new(String::from_utf8_lossy(&libraries.stdout).trim()).is_dir() {
        return Err(Error::NoTarget);
    }
    let build = Command::new("cargo")
        .current_dir(&workspace)
        .args(["build", "--release", "--locked", "--package", "kehai", "--target", TARGET])
        .args(["--bin", BOARD, "--features", "board-mps2-an386"])
        .output()?;
    if !build.status.success() {
        return Err(Error::Build(String::from_utf8_lossy(&build.stderr).into_owned()));
    }
    let target = env::var_os("CARGO_TARGET_DIR").map_or_else(|| workspace.join("target"), PathBuf::from);
    Ok(target.join(TARGET).join("release").join(BOARD))
}
