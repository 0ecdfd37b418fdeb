//! Builds a board's image: picks its memory map, its link arguments and its identity.
//!
//! On a PC, and for the bare library, it does nothing. Link arguments go to the chosen board's
//! binary alone: `no-panic` links without start-up code.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

const BOARDS: [&str; 3] = ["mps2-an386", "nucleo-h563zi", "w5500-evb-pico2"];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    let chosen: Vec<&str> = BOARDS.into_iter().filter(|board| is_chosen(board)).collect();
    match chosen[..] {
        [] => {}
        [board] => build_image(board),
        _ => panic!("one image is for one board, but these features are on together: {chosen:?}"),
    }
}

fn is_chosen(board: &str) -> bool {
    env::var_os(format!("CARGO_FEATURE_BOARD_{}", board.to_uppercase().replace('-', "_"))).is_some()
}

fn build_image(board: &str) {
    let folder = Path::new("src/bin").join(board);
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    copy(&folder.join("memory.x"), &out.join("board.x"));
    if folder.join("device.x").exists() {
        copy(&folder.join("device.x"), &out.join("device.x"));
    }
    println!("cargo::rustc-link-search={}", out.display());
    // Beside the board's image, the one for a floor, and the program that counts instructions.
    let others: &[&str] = if board == "mps2-an386" { &["mps2-an386-floor", "mps2-an386-bench"] } else { &[] };
    for image in [board].iter().chain(others) {
        for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
            println!("cargo::rustc-link-arg-bin={image}={argument}");
        }
    }

    // Our own messages from `info` on, those of the dependencies only when something is wrong.
    println!("cargo::rerun-if-env-changed=DEFMT_LOG");
    println!("cargo::rustc-env=DEFMT_LOG={}", env::var("DEFMT_LOG").unwrap_or("info".into()));
    println!("cargo::rustc-env=KEHAI_BOARD={board}");
    println!(
        "cargo::rustc-env=KEHAI_GIT={}",
        git(&["describe", "--always", "--dirty"]).unwrap_or("unknown".into())
    );
    println!("cargo::rerun-if-changed=src");
    for file in ["HEAD", "index"] {
        if let Some(path) = git(&["rev-parse", "--git-path", file]) {
            println!("cargo::rerun-if-changed={path}");
        }
    }
}

fn copy(from: &Path, to: &Path) {
    println!("cargo::rerun-if-changed={}", from.display());
    fs::copy(from, to).unwrap_or_else(|error| panic!("{} to {}: {error}", from.display(), to.display()));
}

/// What git prints, or `None` outside a repository or without git.
fn git(arguments: &[&str]) -> Option<String> {
    let output =
        Command::new("git").args(arguments).output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}
