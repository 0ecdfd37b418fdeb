//! Dependencies against the order of the crates are found in small workspaces.

use std::path::Path;

use structure::layers::{heavy_core, roots, upward, workspace};
use tempfile::TempDir;

/// A workspace of crates without code; of each its name and its lines of dependencies.
fn crates(crates: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let names: Vec<String> = crates.iter().map(|(name, _)| format!("{name:?}")).collect();
    let text = format!("[workspace]\nresolver = \"3\"\nmembers = [{}]\n", names.join(", "));
    write(&folder.path().join("Cargo.toml"), &text);
    for (name, dependencies) in crates {
        let manifest = format!(
            "[package]\nname = \"{name}\"\nversion = \"0.1.0\"\nedition = \"2024\"\n{dependencies}\n"
        );
        write(&folder.path().join(name).join("Cargo.toml"), &manifest);
        write(&folder.path().join(name).join("src/lib.rs"), "");
    }
    folder
}

fn write(path: &Path, text: &str) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, text).unwrap();
}

fn faults(members: &[(&str, &str)]) -> Vec<String> {
    upward(&workspace(crates(members).path()).unwrap())
}

const KEHAI: (&str, &str) = ("kehai", "");
const TRACKING: (&str, &str) = ("kehai-tracking", "[dependencies]\nkehai.path = \"../kehai\"");
const EMULATOR: (&str, &str) = ("kehai-emulator", "[dependencies]\nkehai.path = \"../kehai\"");

#[test]
fn the_order_of_the_project_is_no_fault() {
    let daemon = "[dependencies]\nkehai-tracking.path = \"../kehai-tracking\"\n\
                  [dev-dependencies]\nkehai-emulator.path = \"../kehai-emulator\"";
    assert_eq!(faults(&[KEHAI, TRACKING, EMULATOR, ("host-tracker", daemon)]), Vec::<String>::new());
}

#[test]
fn upward_and_sideways_dependencies_are_named() {
    let upward = "[dependencies]\nkehai-tracking.path = \"../kehai-tracking\"";
    for member in ["kehai", "kehai-emulator"] {
        // Cargo itself refuses two crates that need each other, so tracking needs nothing here.
        let fault = faults(&[(member, upward), ("kehai-tracking", "")]);
        let line = format!("crate {member}: dependency on kehai-tracking is against the order of the crates");
        assert_eq!(fault, [line]);
    }
}

#[test]
fn tests_may_need_only_what_is_listed_for_tests() {
    let tests_need = |name: &str| format!("[dev-dependencies]\n{name}.path = \"../{name}\"");
    assert_eq!(faults(&[("kehai", &tests_need("kehai-emulator")), EMULATOR]), Vec::<String>::new());
    let fault = faults(&[("kehai", &tests_need("kehai-tracking")), TRACKING]);
    assert_eq!(fault, ["crate kehai: dev-dependency on kehai-tracking is against the order of the crates"]);
}

#[test]
fn the_daemon_needs_the_emulator_in_its_tests_alone() {
    let needs = "[dependencies]\nkehai-emulator.path = \"../kehai-emulator\"";
    let fault = faults(&[KEHAI, EMULATOR, ("host-tracker", needs)]);
    let line = "crate host-tracker: dependency on kehai-emulator is against the order of the crates";
    assert_eq!(fault, [line]);
}

#[test]
fn a_crate_without_a_place_is_named() {
    let fault = faults(&[("newcomer", "")]);
    assert_eq!(fault, ["crate newcomer: has no place in the order of structure/src/layers.rs"]);
}

#[test]
fn a_library_of_the_daemon_in_the_core_s_tests_is_named() {
    let emulator = "[dependencies]\nkehai.path = \"../kehai\"\nrusqlite.path = \"../rusqlite\"";
    let kehai = "[dev-dependencies]\nkehai-emulator.path = \"../kehai-emulator\"";
    let folder = crates(&[("kehai", kehai), ("kehai-emulator", emulator), ("rusqlite", "")]);
    let fault = heavy_core(folder.path()).unwrap();
    assert_eq!(fault, ["crate kehai: its tests build rusqlite, which only the daemon needs"]);
    assert_eq!(heavy_core(crates(&[KEHAI]).path()).unwrap(), Vec::<String>::new());
}

#[test]
fn libraries_and_programs_are_read() {
    let folder = crates(&[KEHAI]);
    write(&folder.path().join("kehai/src/bin/tool/main.rs"), "fn main() {}");
    write(&folder.path().join("kehai/tests/some.rs"), "");
    let roots = roots(&workspace(folder.path()).unwrap());
    let ends = |end: &str| roots.iter().any(|root| root.ends_with(end));
    assert!(roots.len() == 2 && ends("src/lib.rs") && ends("src/bin/tool/main.rs"), "{roots:?}");
}
