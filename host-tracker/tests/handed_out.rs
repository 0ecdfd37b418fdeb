//! Firmware for new boards, from the map's page to a file on an installer's disk, in a real browser and as a program takes it.
//! With `KEHAI_SCREENSHOTS=1` the picture of `docs/images` is taken anew.
//!
//! ```text
//!   folder of firmware ─▶ kehai-tracker run --firmware ─HTTP▶ Chromium: boards, steps, links ─▶ the file's bytes
//! ```

mod chromium;
mod described;
mod http_client;
mod mapped;

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use chromium::pictures;
use mapped::{Tracker, map_of};
use serde_json::{Value, json};

const DRAGGED: &str = "w5500-evb-pico2-complete.uf2";

/// What is in a file: of the length of a real one, about.
fn content(name: &str) -> String {
    format!("this is {name}\n").repeat(10_000)
}

/// As packaging/firmware.sh makes them, but for what is in them; a maker's key lies there by mistake.
fn firmware(folder: &Path) {
    for name in [
        DRAGGED,
        "w5500-evb-pico2-complete.hex",
        "w5500-evb-pico2.elf",
        "nucleo-h563zi-complete.hex",
        "nucleo-h563zi.elf",
        "69-kehai-probes.rules",
        "SHA256SUMS",
        "maker.key",
    ] {
        fs::write(folder.join(name), content(name)).unwrap();
    }
    fs::write(folder.join("MAKERS"), "development\n").unwrap();
}

fn tracker(site: &Path, firmware: &Path) -> Tracker {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command
        .args(["run", "--http", "127.0.0.1:0", "--no-mdns", "--module", "127.0.0.1:9", "--site"])
        .arg(site);
    let mut process = command.arg("--firmware").arg(firmware).stderr(Stdio::piped()).spawn().unwrap();
    let map = map_of(&mut process);
    Tracker { process, map }
}

#[test]
fn an_installer_takes_the_firmware_of_a_board_from_the_map() {
    let Some(mut page) = chromium::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    firmware(folder.path());
    let tracker = tracker(&folder.path().join("site.toml"), folder.path());
    page.size(1280, 800, 1);
    page.open(&tracker.map);
    let link = "[...document.querySelectorAll('#tray a')].find((a) => a.pathname === '/firmware')";
    page.wait("where no module is found yet the map leads to the firmware", &format!("{link}?.offsetParent"));
    page.value(&format!("{link}.click()"));
    page.wait("both boards are there", "document.querySelectorAll('[data-board]').length === 2");
    let steps = "document.querySelector('[data-board=w5500-evb-pico2]').innerText";
    page.wait("how one is dragged is said", &format!("{steps}.includes('RP2350')"));
    let run = "document.querySelector('[data-board=nucleo-h563zi] pre').innerText";
    page.wait(
        "and what writes the other",
        &format!("{run}.includes('STM32H563ZITx --binary-format hex nucleo')"),
    );
    page.wait("whose updates they take is said", "document.querySelector('#development') !== null");
    let links = "[...document.querySelectorAll('.files a')].map((a) => a.download)";
    assert_eq!(page.value(&format!("{links}.length")), json!(7));
    assert_eq!(page.value(&format!("{links}.includes('maker.key')")), json!(false));
    for scheme in ["light", "dark"] {
        page.scheme(scheme);
        page.is_accessible(&format!("firmware, {scheme}"));
    }
    page.scheme("light");
    page.picture(&pictures().join("firmware.png"));
    page.fits_a_phone("firmware");
    assert_eq!(page.errors, Vec::<String>::new());

    let address = tracker.map.trim_start_matches("http://").trim_end_matches('/').parse().unwrap();
    let get = |path: &str| http_client::ask(address, &format!("GET {path}"), &[], b"");
    assert_eq!(get(&format!("/api/firmware/{DRAGGED}")), (200, content(DRAGGED)));
    let (_, listed) = get("/api/firmware");
    let listed: Value = serde_json::from_str(&listed).unwrap();
    assert_eq!(listed["development_key"], true, "{listed}");
    for other in ["maker.key", "MAKERS", "..%2fsite.toml", "nothing"] {
        assert_eq!(get(&format!("/api/firmware/{other}")).0, 404, "{other}");
    }
}
