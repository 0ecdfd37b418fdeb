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

fn has_feature(name: &str) -> bool {
    env::var_os(format!("CARGO_FEATURE_{name}")).is_some()
}

/// The public keys of the makers whose images a boot loader starts: one or two, 64 hexadecimal digits each, with a comma.
fn makers(board: &str, out: &Path) {
    println!("cargo::rerun-if-env-changed=KEHAI_UPDATE_KEYS");
    let text = match env::var("KEHAI_UPDATE_KEYS") {
        Ok(keys) => {
            let keys: Vec<String> = keys.split(',').map(|key| format!("{:?}", bytes(key.trim()))).collect();
            assert!(keys.len() <= 2, "KEHAI_UPDATE_KEYS: a boot loader knows two makers at most");
            format!("const MAKERS: &[[u8; 32]] = &[{}];\n", keys.join(", "))
        }
        Err(_) => {
            if board != "mps2-an386" {
                println!(
                    "cargo::warning=this boot loader starts images signed by anybody: KEHAI_UPDATE_KEYS names makers"
                );
            }
            "const MAKERS: &[[u8; 32]] = &[kehai::update::maker::DEVELOPMENT];\n".into()
        }
    };
    fs::write(out.join("makers.rs"), text).expect("OUT_DIR can be written");
}

fn bytes(digits: &str) -> [u8; 32] {
    let wrong =
        || -> ! { panic!("KEHAI_UPDATE_KEYS: \"{digits}\" is no public key of 64 hexadecimal digits") };
    if digits.len() != 64 || !digits.is_ascii() {
        wrong();
    }
    std::array::from_fn(|at| u8::from_str_radix(&digits[2 * at..2 * at + 2], 16).unwrap_or_else(|_| wrong()))
}

fn build_image(board: &str) {
    let folder = Path::new("src/bin").join(board);
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let boots = has_feature("BOOT");
    let memory = match (boots, has_feature("IN_SLOT")) {
        (true, _) => "boot.x",
        // Only the QEMU board has an image elsewhere.
        (false, true) if board == "mps2-an386" => "slot.x",
        (false, _) => "memory.x",
    };
    copy(&folder.join(memory), &out.join("board.x"));
    if boots {
        makers(board, &out);
    }
    if folder.join("device.x").exists() {
        copy(&folder.join("device.x"), &out.join("device.x"));
    }
    println!("cargo::rustc-link-search={}", out.display());
    // Beside the board's image, the one for a floor, and the program that counts instructions.
    let others: &[&str] = if board == "mps2-an386" { &["mps2-an386-floor", "mps2-an386-bench"] } else { &[] };
    let boot = format!("{board}-boot");
    for image in [board, &boot].iter().chain(others) {
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
        git(&["describe", "--always", "--dirty", "--abbrev=12"]).unwrap_or("unknown".into())
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
