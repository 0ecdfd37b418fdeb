//! Calibration by walking, live: a furnished home with four modules and a floor at wrong places in the site, a person who walks
//! about, and both clients that may calibrate at the same time: the terminal, and a browser that looks and clicks.
//!
//! ```text
//!   simulated home ─SCIP▶ modules ─UDP─┬▶ kehai-tracker calibrate --accept ─▶ terminal.toml
//!                                      └▶ kehai-tracker run ─HTTP▶ Chromium ─▶ browser.toml
//! ```
//!
//! With `KEHAI_SCREENSHOTS=1` the picture of `docs/images` is taken anew; otherwise it goes under `target/`.

mod chromium;
mod mapped;

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use chromium::{Page, pictures};
use host_sim::building::Building;
use host_sim::world::scene::Scene;
use host_sim::world::walker::Repeat;
use host_tracker::site_file;
use host_tracker::store::pose::Source;
use host_tracker::store::reader::Reader;
use kehai_tracking::site::Site;
use kehai_tracking::site::floor::Floor;
use mapped::map_of;

/// How far poses may be off in this test, which is of the way there, not of the figures: the walk is short, and the machine
/// may be busy.
const WITHIN_M: f64 = 0.25;

fn tracker(arguments: &[&str], site: &Path, building: &Building) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(arguments).args(["--no-mdns", "--site"]).arg(site);
    for (_, address) in building.modules() {
        command.arg("--module").arg(address.to_string());
    }
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// The scene, its walker going round and round over a floor, and a site file in which all but the first module are elsewhere.
fn home() -> (Scene, String) {
    let mut scene = Scene::load("home").unwrap();
    scene.people[0].repeat = Repeat::Loop;
    let name = "mat".to_owned();
    scene.site.floors =
        vec![Floor { name, x: -2.2, y: -1.8, yaw_deg: 0.0, columns: 32, rows: 32, pitch_m: 0.1 }];
    let mut wrong = scene.site.clone();
    (wrong.floors[0].x, wrong.floors[0].y, wrong.floors[0].yaw_deg) = (2.0, 1.0, 90.0);
    for (index, module) in wrong.modules.iter_mut().enumerate().skip(1) {
        module.x = 0.5 * index as f64;
        module.y = 0.0;
        module.yaw_deg = 0.0;
    }
    (scene, format!("# this comment stays\n{}", toml::to_string(&wrong).unwrap()))
}

fn is_right(file: &Path, truth: &Site) {
    let text = std::fs::read_to_string(file).unwrap();
    assert!(text.starts_with("# this comment stays"), "{text}");
    let found = site_file::load(file).unwrap();
    assert_eq!((found.walls.len(), found.zones.len()), (truth.walls.len(), truth.zones.len()));
    for (found, truth) in found.modules.iter().zip(&truth.modules) {
        let off_m = (found.pose().at - truth.pose().at).length();
        assert!(off_m < WITHIN_M, "{} is {off_m:.2} m off", found.name);
    }
    let [found, truth] = [&found, truth].map(|site| site.floors[0].corner());
    let off_m = (found.at - truth.at).length();
    assert!(off_m < WITHIN_M && found.yaw_rad.abs() < 0.1, "the floor is {off_m:.2} m off: {found:?}");
}

#[test]
fn a_person_walks_and_both_terminal_and_browser_find_modules_and_floor() {
    let (scene, text) = home();
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| -> PathBuf {
        let path = folder.path().join(name);
        std::fs::write(&path, &text).unwrap();
        path
    };
    let building = Building::start(&scene, scene.seed).unwrap();
    let by_terminal = file("terminal.toml");
    let db = folder.path().join("home.db");
    let arguments = ["calibrate", "--accept", "--json", "--seconds", "120", "--db", db.to_str().unwrap()];
    let terminal = tracker(&arguments, &by_terminal, &building);
    if let Some(page) = chromium::start() {
        in_the_browser(page, &file("browser.toml"), &building, &scene.site);
    }
    let output = terminal.wait_with_output().unwrap();
    let (said, errors) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{errors}\n{said}");
    let last: serde_json::Value = serde_json::from_str(said.lines().last().unwrap()).unwrap();
    assert_eq!(last["found"]["modules"].as_array().map(Vec::len), Some(5), "{last}");
    is_right(&by_terminal, &scene.site);
    let mut kept = Reader::open(&db).unwrap().poses().unwrap();
    kept.retain(|pose| pose.module == "shelf");
    assert_eq!(kept.iter().map(|pose| pose.source).collect::<Vec<_>>(), [Source::Calibration]);
}

fn in_the_browser(mut page: Page, file: &Path, building: &Building, truth: &Site) {
    let mut run = tracker(&["run", "--http", "127.0.0.1:0"], file, building);
    let map = map_of(&mut run);
    page.size(1440, 900, 1);
    page.scheme("light");
    page.open(&map);
    page.wait("the map is live", "document.querySelector('#link').dataset.state === 'live'");
    page.click("#calibrate-open");
    page.wait(
        "it says where to walk",
        "document.querySelector('#calibrate-advice').textContent.includes('walk')",
    );
    page.wait(
        "every module has been seen with another for long enough",
        "document.querySelectorAll('#calibrate-pairs .done').length >= 3",
    );
    page.wait(
        "and the floor with one of them",
        "[...document.querySelectorAll('#calibrate-pairs .done')].some((pair) => pair.innerText.includes('mat'))",
    );
    page.fits_a_phone("calibration walk");
    page.click("#calibrate-finish");
    page.wait("poses are found", "document.querySelector('#calibrate').dataset.state === 'found'");
    page.wait(
        "how well the clocks agree",
        "/its clock within \\d+ ms/.test(document.querySelector('#calibrate-result').innerText)",
    );
    page.wait(
        "where the floor is, and how surely",
        "/mat: x .* its outer corner within \\d+ cm and [\\d.]+°/.test(document.querySelector('#calibrate-result').innerText)",
    );
    page.wait(
        "what two modules see",
        "/\\w+ \\+ \\w+: [\\d.]+ m²/.test(document.querySelector('.walk-areas').innerText)",
    );
    page.wait(
        "the map says of a place who sees it",
        "[...document.querySelectorAll('#map .coverage title')].some((title) => /^Seen by \\w+, \\w+/.test(title.textContent))",
    );
    page.picture(&pictures().join("calibration.png"));
    page.fits_a_phone("calibration result");
    page.value("document.querySelector('#calibrate-accept').scrollIntoView()");
    page.click("#calibrate-accept");
    page.wait("the view is closed", "!document.body.classList.contains('calibrating')");
    is_right(file, truth);
    assert_eq!(page.errors, Vec::<String>::new());
    let _ = run.kill();
    let _ = run.wait();
}

#[test]
fn a_walk_that_is_too_short_is_refused_and_nothing_is_written() {
    let (mut scene, text) = home();
    scene.people.clear();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("home.toml");
    std::fs::write(&file, &text).unwrap();
    let building = Building::start(&scene, scene.seed).unwrap();
    let mut process = tracker(&["calibrate", "--accept", "--seconds", "3"], &file, &building);
    let mut said = String::new();
    process.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    assert!(!process.wait().unwrap().success());
    assert!(said.contains("has not seen you together with any other module"), "{said}");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), text);
}
