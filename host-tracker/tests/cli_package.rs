//! What a package and a supervisor ask of `kehai-tracker`: checks, completions, manual pages, signs of life.
#![cfg(target_os = "linux")]

use std::os::unix::fs::PermissionsExt as _;
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

/// A hundred times what a loaded machine needs.
const PATIENCE: Duration = Duration::from_secs(60);

fn tracker(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_kehai-tracker")).args(arguments).output().unwrap()
}

#[test]
fn check_says_what_is_in_a_site_and_where_it_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let (good, wrong) = (folder.path().join("good.toml"), folder.path().join("wrong.toml"));
    std::fs::write(&good, "[[module]]\nname = \"left\"\nx = 0\ny = 0\n").unwrap();
    std::fs::write(&wrong, "# home\n[[zone]]\nname = 3\n").unwrap();
    let [good, wrong] = [good, wrong].map(|path| path.to_str().unwrap().to_owned());
    let checked = tracker(&["check", &good]);
    let said = String::from_utf8(checked.stdout).unwrap();
    assert!(
        checked.status.success() && said.ends_with("1 module, 0 floors, 0 walls, 0 zones, 0 doors\n"),
        "{said}"
    );
    std::fs::write(
        &good,
        "[[module]]\nname = \"left\"\nx = 0\ny = -0.04\nyaw_deg = 90\n[[wall]]\npoints = [[-5, 0], [5, 0]]\n",
    )
    .unwrap();
    let checked = tracker(&["check", &good]);
    let said = String::from_utf8(checked.stdout).unwrap();
    assert!(checked.status.success() && said.lines().count() == 2, "{said}");
    assert!(said.ends_with("move the module or the wall\n"), "{said}");
    let refused = tracker(&["check", &good, &wrong]);
    let said = String::from_utf8(refused.stderr).unwrap();
    assert_eq!((refused.status.code(), said.lines().count()), (Some(1), 1), "{said}");
    assert!(said.contains("wrong.toml:3: "), "{said}");
}

#[test]
fn the_script_that_makes_the_package_says_first_what_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let play = |program: &str, script: &str| {
        let file = folder.path().join(program);
        std::fs::write(&file, format!("#!/bin/sh\n{script}\n")).unwrap();
        std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o755)).unwrap();
    };
    // A machine whose cargo has none of the programs that it is asked for, and which has no target.
    play("cargo", "exit 101");
    play("rustc", "echo /no/such/folder");
    let path = format!("{}:{}", folder.path().display(), std::env::var("PATH").unwrap());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../packaging/package.sh");
    let made = |without_firmware: &str| {
        let mut command = Command::new("bash");
        command.arg(&script).env("PATH", &path).env("KEHAI_WITHOUT_FIRMWARE", without_firmware);
        let output = command.output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), said.lines().count()), (Some(1), 1), "{said}");
        assert!(said.contains("cargo-deb") && said.contains("cargo-cyclonedx"), "{said}");
        said
    };
    let target = "rustup target add thumbv8m.main-none-eabihf";
    let said = made("");
    assert!(said.contains(target) && said.contains("KEHAI_WITHOUT_FIRMWARE=1"), "{said}");
    assert!(!made("1").contains(target));
}

#[test]
fn completions_are_what_the_shell_reads() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("kehai-tracker");
    std::fs::write(&file, tracker(&["completions", "bash"]).stdout).unwrap();
    let asked = "source \"$0\"; COMP_WORDS=(kehai-tracker ca) COMP_CWORD=1; _kehai__tracker kehai-tracker ca; \
                 echo \"${COMPREPLY[@]}\"";
    let replied = Command::new("bash").args(["-c", asked]).arg(&file).output().unwrap();
    assert_eq!(String::from_utf8(replied.stdout).unwrap(), "calibrate\n");
}

#[test]
fn there_is_a_manual_page_for_each_command() {
    let folder = tempfile::tempdir().unwrap();
    let pages = folder.path().join("man");
    assert!(tracker(&["man", pages.to_str().unwrap()]).status.success());
    for command in [
        "",
        "-run",
        "-check",
        "-doctor",
        "-calibrate",
        "-module",
        "-module-list",
        "-module-update",
        "-firmware-sign",
        "-user-add",
        "-token",
        "-replay",
        "-export",
    ] {
        let page = std::fs::read_to_string(pages.join(format!("kehai-tracker{command}.1"))).unwrap();
        assert!(page.contains(".SH NAME"), "{command}: {page}");
    }
}

#[test]
fn systemd_hears_that_it_is_ready_goes_on_and_ends() {
    let folder = tempfile::tempdir().unwrap();
    let (site, path) = (folder.path().join("home.toml"), folder.path().join("notices"));
    std::fs::write(&site, "").unwrap();
    let notices = UnixDatagram::bind(&path).unwrap();
    let mut process = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"))
        .args(["run", "--http", "0", "--seconds", "3", "--site"])
        .arg(site)
        .env("NOTIFY_SOCKET", &path)
        .spawn()
        .unwrap();
    let mut heard = Vec::new();
    let begin = Instant::now();
    while heard.last().is_none_or(|state| state != "STOPPING=1") {
        let mut buffer = [0; 256];
        notices.set_read_timeout(Some(PATIENCE.saturating_sub(begin.elapsed()))).unwrap();
        let length = notices.recv(&mut buffer).unwrap_or_else(|error| panic!("{error} after {heard:?}"));
        heard.push(String::from_utf8_lossy(&buffer[..length]).trim().to_owned());
    }
    assert_eq!(heard[0], "READY=1");
    assert!(heard[1..heard.len() - 1].iter().all(|state| state == "WATCHDOG=1"), "{heard:?}");
    assert!(heard.len() >= 3, "{heard:?}");
    assert_eq!(process.wait().unwrap().code(), Some(0), "a service that waits for modules has not failed");
}
