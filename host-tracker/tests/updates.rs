//! Updates from end to end: `kehai-tracker` brings signed images to a module, the firmware's own tasks in a process of its
//! own, over real sockets; and that process is killed in the midst of it.
//!
//! ```text
//!   kehai-tracker module update ─▶ child: emulated sensor, module, flash in a file, boot loader at each start
//!                                    └─ killed at any moment ─▶ started anew: the old image, or the new one
//! ```
#![allow(missing_docs, reason = "a test program")]
#![cfg(unix)]

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use host_tracker::firmware::{MakerKey, SignedImage};
use kehai::update::Version;
use kehai::update::maker::DEVELOPMENT;
use kehai_emulator::pc::device::{Beside, Pc, set_label};
use kehai_emulator::pc::flash::Flash;
use kehai_emulator::pc::image::{Fault, Image, PAGES_WITH_IMAGES};
use kehai_emulator::pc::reactor::Reactor;
use kehai_emulator::pc::udp::Udp;
use kehai_emulator::ports::free_udp;
use kehai_emulator::serve::{Control, serve_tcp};
use kehai_emulator::source::StillRoom;
use kehai_emulator::urg::model::URG_04LX;
use kehai_emulator::urg::{Config, Urg};
use kehai_tracking::keys::Label;
use serde_json::Value;
use tempfile::TempDir;

const LABEL: [u8; 16] = [0x5a; 16];
const PATIENCE: Duration = Duration::from_secs(120);
/// Where a child keeps its flash, and its port.
const FLASH: &str = "KEHAI_TEST_FLASH";
const PORT: &str = "KEHAI_TEST_PORT";

/// Not a test: the module, in the process that [`Module::start`] starts.
#[test]
fn module() {
    let (Ok(file), Ok(port)) = (std::env::var(FLASH), std::env::var(PORT)) else { return };
    let stop = Arc::new(AtomicBool::new(false));
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let place = format!("tcp://{}", listener.local_addr().unwrap()).parse().unwrap();
    let stopped = Arc::clone(&stop);
    std::thread::spawn(move || {
        let room = Box::new(StillRoom::new(URG_04LX.geometry));
        let urg = Urg::new(Config { paced: false, ..Config::new(URG_04LX) }, room, 0);
        serve_tcp(&listener, urg, &mut Control { stop: &stopped, on_status: &mut |_| {} }).unwrap();
    });
    let flash = Flash::open(Path::new(&file), PAGES_WITH_IMAGES).unwrap();
    let at = format!("127.0.0.1:{port}").parse().unwrap();
    let port = Udp::bind(at, &Reactor::new()).unwrap();
    let pc = Pc {
        beside: Beside::Sensor,
        sensor: &place,
        port: &port,
        flash: &flash,
        name: Some("updated"),
        unique: Some("updated"),
        maker: DEVELOPMENT,
        announced: false,
        amend: None,
    };
    loop {
        pc.start(&stop, |_| {}).unwrap();
    }
}

/// A module in a process of its own.
struct Module {
    process: Child,
}

impl Module {
    fn start(bench: &Bench) -> Self {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["module", "--exact", "--nocapture"]).env(FLASH, &bench.flash).env(PORT, &bench.port);
        let process = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        Self { process }
    }
}

impl Drop for Module {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// A module's flash and keys, and the makers of its images.
struct Bench {
    folder: TempDir,
    flash: PathBuf,
    keys: String,
    port: String,
    address: String,
    maker: MakerKey,
}

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let flash = folder.path().join("module.flash");
        let keys = folder.path().join("hall.keys").to_str().unwrap().to_owned();
        let port = free_udp().unwrap().to_string();
        let address = format!("127.0.0.1:{port}");
        let key = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/update/development.key");
        let maker = MakerKey::load(&key).unwrap();
        let label = Flash::open(&flash, PAGES_WITH_IMAGES).unwrap();
        set_label(&label, &LABEL, &AtomicBool::new(false)).unwrap();
        Self { folder, flash, keys, port, address, maker }
    }

    /// A signed image for a program, and its file.
    fn image(&self, program: &str, version: [u16; 3], fault: Fault, maker: &MakerKey) -> String {
        let version = Version(version);
        let bytes = Image { version: version.to_string(), fault }.bytes(190_001);
        let file = self.folder.path().join(format!("{program}-{version}-{fault:?}.kehai"));
        let image =
            SignedImage::sign(bytes, (program, version, version.min(Version([0, 2, 0]))), maker).unwrap();
        image.save(&file).unwrap();
        file.to_str().unwrap().to_owned()
    }

    fn update<'a>(&'a self, file: &'a str) -> Vec<&'a str> {
        vec!["module", "update", &self.address, "--keys", &self.keys, "--without-tracker", file]
    }

    fn info(&self) -> Option<Value> {
        let output = kehai_tracker(&["module", "info", &self.address, "--keys", &self.keys, "--json"]);
        output.status.success().then(|| serde_json::from_slice(&output.stdout).unwrap())
    }

    /// What it says it runs, once it answers.
    fn firmware(&self) -> String {
        let begin = Instant::now();
        loop {
            let firmware = self.info().and_then(|info| Some(info["firmware"].as_str()?.to_owned()));
            if let Some(firmware) = firmware.filter(|firmware| !firmware.is_empty()) {
                return firmware;
            }
            assert!(begin.elapsed() < PATIENCE, "it does not answer");
        }
    }

    fn claim(&self) {
        self.firmware_in_clear();
        let code = Label(LABEL).text();
        let claim = ["module", "claim", &self.address, "--keys", &self.keys, "--new", "--code", &code];
        let claimed = kehai_tracker(&claim);
        assert!(claimed.status.success(), "{}", text(&claimed.stderr));
        let named = kehai_tracker(&["module", "set", &self.address, "--keys", &self.keys, "learn_scans=77"]);
        assert!(named.status.success(), "{}", text(&named.stderr));
    }

    fn firmware_in_clear(&self) {
        let begin = Instant::now();
        while !kehai_tracker(&["module", "info", &self.address]).status.success() {
            assert!(begin.elapsed() < PATIENCE, "it does not answer");
        }
    }

    fn is_set_as_before(&self) -> bool {
        let settings = kehai_tracker(&["module", "get", &self.address, "--keys", &self.keys]);
        text(&settings.stdout).contains("learn_scans=77")
    }
}

fn kehai_tracker(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_kehai-tracker")).args(arguments).output().expect("it runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[track_caller]
fn done(arguments: &[&str]) -> String {
    let output = kehai_tracker(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

#[track_caller]
fn refused(arguments: &[&str]) -> String {
    let output = kehai_tracker(arguments);
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stdout));
    text(&output.stderr).lines().last().unwrap_or_default().to_owned()
}

#[test]
fn a_module_takes_what_its_maker_signed_and_keeps_what_works() {
    let bench = Bench::new();
    let _module = Module::start(&bench);
    bench.claim();
    let built_in = bench.firmware();
    let good = bench.image("pc", [0, 2, 0], Fault::None, &bench.maker);
    let other = bench.image("nucleo-h563zi", [0, 2, 0], Fault::None, &bench.maker);
    let line = refused(&bench.update(&other));
    assert!(line.contains("for nucleo-h563zi, and updated is pc"), "{line}");
    let stranger = MakerKey::create(&bench.folder.path().join("stranger.key")).unwrap();
    let forged = bench.image("pc", [0, 2, 1], Fault::None, &stranger);
    let line = refused(&bench.update(&forged));
    assert!(line.contains("not signed by its maker") && line.contains(&built_in), "{line}");
    assert_eq!(bench.firmware(), built_in);

    assert!(done(&bench.update(&good)).contains("runs 0.2.0, and it stays"));
    assert_eq!(bench.firmware(), "0.2.0");
    assert!(done(&bench.update(&good)).contains("runs 0.2.0 already"));
    assert!(bench.is_set_as_before());

    let hangs = bench.image("pc", [0, 3, 0], Fault::Hangs, &bench.maker);
    let line = refused(&bench.update(&hangs));
    assert!(line.contains("did not work") && line.contains("it runs 0.2.0"), "{line}");
    let old = bench.image("pc", [0, 1, 9], Fault::None, &bench.maker);
    let line = refused(&bench.update(&old));
    assert!(line.contains("older than the module may go back to"), "{line}");
    assert_eq!(bench.firmware(), "0.2.0");
    // A module that is asked without its keys takes nothing.
    let unkeyed = bench.folder.path().join("none.keys");
    std::fs::write(&unkeyed, format!("secret = \"{}\"\n", "ab".repeat(32))).unwrap();
    let line = refused(&[
        "module",
        "update",
        &bench.address,
        "--keys",
        unkeyed.to_str().unwrap(),
        "--without-tracker",
        "--again",
        &good,
    ]);
    assert!(line.contains("has keys, and they are not in"), "{line}");
}

#[test]
fn a_maker_makes_a_key_signs_an_image_and_looks_at_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (key, image, signed) = (path("maker.key"), path("image.bin"), path("image.kehai"));
    std::fs::write(&image, Image { version: "0.2.0".into(), fault: Fault::None }.bytes(5000)).unwrap();
    let public = done(&["firmware", "key", "--make", &key]);
    assert_eq!(public, done(&["firmware", "key", &key]));
    assert!(refused(&["firmware", "key", "--make", &key]).contains("is there already"));
    let sign = |program: &str, version: &str| {
        [
            "firmware",
            "sign",
            "--key",
            &key,
            "--program",
            program,
            "--image-version",
            version,
            &image,
            "-o",
            &signed,
        ]
        .map(str::to_owned)
    };
    done(&sign("pc", "0.2.0").each_ref().map(String::as_str));
    let shown = done(&["firmware", "show", &signed, "--maker", public.trim(), "--json"]);
    let shown: Value = serde_json::from_str(&shown).unwrap();
    assert_eq!((&shown["program"], &shown["version"]), (&"pc".into(), &"0.2.0".into()));
    assert_eq!(
        (&shown["size"], &shown["signed_by_maker"], &shown["development"]),
        (&5000.into(), &true.into(), &false.into())
    );
    let line = refused(&["firmware", "show", &signed, "--maker", &"ab".repeat(32)]);
    assert!(line.contains("not signed by this maker"), "{line}");
    let line = refused(&sign("a program with a long name", "0.2.0").each_ref().map(String::as_str));
    assert!(line.contains("1 to 16"), "{line}");
    std::fs::write(&image, b"\x7fELF and no more").unwrap();
    let line = refused(&sign("pc", "0.2.0").each_ref().map(String::as_str));
    assert!(line.contains("the ELF cannot be read"), "{line}");
    assert_eq!(kehai_tracker(&["firmware", "show", &path("none.kehai")]).status.code(), Some(1));
}

/// A row of numbers.
struct Dice(u64);

impl Dice {
    fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % end
    }
}

#[test]
fn a_module_that_is_killed_in_the_midst_of_updates_always_starts() {
    let kills: u32 = std::env::var("KEHAI_KILLS").ok().and_then(|text| text.parse().ok()).unwrap_or(10);
    let (bench, mut dice) = (Bench::new(), Dice(5));
    let mut module = Module::start(&bench);
    bench.claim();
    let images = [[0, 2, 0], [0, 3, 0]].map(|version| bench.image("pc", version, Fault::None, &bench.maker));
    let (mut took, mut stayed, mut back) = (0, 0, 0);
    let mut earlier = bench.firmware();
    for kill in 0..kills {
        let before = bench.firmware();
        let image = &images[usize::from(before == "0.2.0")];
        let mut update = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
        update.args(bench.update(image)).stdout(Stdio::null()).stderr(Stdio::null());
        let mut update = update.spawn().unwrap();
        std::thread::sleep(Duration::from_millis(dice.below(2500)));
        drop(module);
        let _ = update.kill();
        let _ = update.wait();
        module = Module::start(&bench);
        let after = bench.firmware();
        let is_new = image.contains(&format!("-{after}-"));
        // Killed on trial, the one before is back.
        assert!(is_new || after == before || after == earlier, "{kill}: {earlier}, {before}, then {after}");
        assert!(bench.is_set_as_before(), "{kill}");
        match (after == before, is_new) {
            (true, _) => stayed += 1,
            (false, true) => took += 1,
            (false, false) => back += 1,
        }
        earlier = before;
    }
    println!(
        "{kills} kills: as before {stayed} times, the new image {took} times, back from a trial {back} times"
    );
    // All is well in the end.
    let image = &images[usize::from(bench.firmware() == "0.2.0")];
    assert!(done(&bench.update(image)).contains("and it stays"));
}
