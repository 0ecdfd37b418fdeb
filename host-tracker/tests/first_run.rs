//! The first run, in a browser: from a tracker without a site to people who are counted in a room, and no file touched by hand.
//!
//! ```text
//!   simulated room ─SCIP▶ two modules ─UDP▶ kehai-tracker run ─HTTP▶ Chromium: use, name, walk, accept
//!     a person comes once it is learned        └─▶ site.toml, made by it
//! ```
//!
//! Every click and every field that is filled is counted. With `KEHAI_SCREENSHOTS=1` the pictures of `docs/images` are taken
//! anew; otherwise they go under `target/`.

mod chromium;
mod described;
mod hall;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use chromium::Page;
use hall::Tracker;
use host_sim::building::Building;
use host_sim::world::scene::Scene;
use host_tracker::site_file;
use kehai_tracking::geometry::Point;

/// A site is ready after so many clicks and filled fields at most.
const ACTIONS: u32 = 25;

/// How far the modules may be off each other in this test, which is of the way there, not of the figures.
const WITHIN_M: f64 = 0.25;

/// A closed room of 5 by 4 m, empty for the time that two modules learn it; then a person walks in wide loops.
const SCENE: &str = r#"
[[site.module]]
name = "kehai-one"
x = 0.1
y = 0.1
yaw_deg = 45.0

[[site.module]]
name = "kehai-two"
x = 4.9
y = 3.9
yaw_deg = -135.0

[[site.wall]]
points = [[0, 0], [5, 0], [5, 4], [0, 4], [0, 0]]

[[person]]
route = [[1.2, 1.1], [3.8, 1.0], [3.9, 2.9], [2.5, 2.0], [1.1, 3.0]]
repeat = "loop"
speed_m_s = 0.9
from_s = 30
"#;

/// A visitor who acts, and is counted.
struct Visitor {
    page: Page,
    actions: u32,
    pictures: PathBuf,
}

impl Visitor {
    fn click(&mut self, selector: &str) {
        self.page.wait(
            &format!("{selector} is there"),
            &format!(
                "(({selector:?}, document.querySelector({selector:?})?.offsetParent) && !document.querySelector({selector:?}).disabled)"
            ),
        );
        self.page
            .value(&format!("document.querySelector({selector:?}).scrollIntoView({{ block: 'nearest' }})"));
        self.page.click(selector);
        self.actions += 1;
    }

    /// A click into a field, and other words in it.
    fn fill(&mut self, selector: &str, text: &str) {
        self.click(selector);
        // What stands above may have grown by a line meanwhile.
        self.page.value(&format!("document.querySelector({selector:?}).select()"));
        self.page.write(text);
        self.page.key("Enter", 13);
        self.actions += 1;
    }

    fn wait(&mut self, what: &str, expression: &str) {
        self.page.wait(what, expression);
    }

    fn stage(&mut self, stage: &str) {
        self.wait(
            &format!("the stage {stage}"),
            &format!("!document.querySelector('#tray').hidden && document.querySelector('#tray').dataset.stage === '{stage}'"),
        );
        let headline = self.page.value("document.querySelector('.total').innerText");
        let headline = headline.as_str().unwrap_or_default();
        assert!(!headline.starts_with('0'), "{headline:?} with nothing to count in");
        assert!(
            self.page
                .value("document.querySelector('#tray h2').innerText")
                .as_str()
                .is_some_and(|text| !text.is_empty())
        );
    }

    fn picture(&mut self, name: &str) {
        self.page.settle();
        let file = self.pictures.join(name);
        self.page.picture(&file);
    }

    /// Fails on what axe-core finds, if it is there.
    fn axe(&mut self) {
        self.page.is_accessible("first run");
    }
}

#[test]
fn from_nothing_to_a_counted_room_in_a_browser_alone() {
    let Some(mut page) = chromium::start() else { return };
    let scene = Scene::parse("room", SCENE).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let site = folder.path().join("site.toml");
    let building = Building::start(&scene, 7).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.current_dir(folder.path()).args(["run", "--http", "127.0.0.1:0", "--no-mdns"]);
    for (_, address) in building.modules() {
        command.args(["--module", &address.to_string()]);
    }
    let tracker = Tracker::start(command);
    let map = tracker.says("live map at ");
    page.size(1440, 900, 1);
    page.scheme("light");
    page.open(&map);
    let pictures = chromium::pictures();
    let mut visitor = Visitor { page, actions: 0, pictures };

    visitor.stage("found");
    visitor.wait("both are in the tray", "document.querySelectorAll('.tray-card').length === 2");
    assert!(!site.exists(), "looking makes no file");
    visitor.click("#next");
    visitor.wait(
        "they can be named",
        "document.querySelectorAll('.tray-card input:not([hidden])').length === 2",
    );
    visitor.fill(".tray-card input[aria-label$='kehai-one']", "door");
    visitor
        .wait("it has its name", "document.querySelector(\".tray-card input[aria-label$='door']\") !== null");
    visitor.fill(".tray-card input[aria-label$='kehai-two']", "window");
    visitor.wait(
        "it has its name",
        "document.querySelector(\".tray-card input[aria-label$='window']\") !== null",
    );
    visitor.stage("unplaced");
    visitor.wait(
        "a person before a module lights it up",
        "document.querySelector('.tray-card.lit .tray-state').innerText.includes('sees you')",
    );
    visitor.wait(
        "what it sees is shown",
        "document.querySelector('.tray-card.lit circle') && document.querySelector('.tray-free').getAttribute('d').length > 100",
    );
    visitor.page.fits_a_phone("tray");
    visitor.picture("first-run.png");
    visitor.axe();

    visitor.click("#next");
    visitor.wait("both have seen enough", "document.querySelector('#calibrate').dataset.state === 'enough'");
    visitor.click("#calibrate-finish");
    visitor.wait("they are placed", "document.querySelector('#calibrate').dataset.state === 'found'");
    visitor.click("#calibrate-accept");
    visitor
        .wait("the room is proposed", "document.querySelectorAll('#survey li[data-kind=zone]').length === 1");
    visitor.fill("#survey li[data-kind=zone] input:not([type=checkbox])", "living room");
    visitor.page.fits_a_phone("measured plan");
    visitor.picture("measured-plan.png");
    visitor.axe();
    visitor.click("#survey-accept");
    visitor.wait("the tray is gone", "document.querySelector('#tray').hidden");
    visitor.wait(
        "one person is counted in the room",
        "document.querySelector('.zone-card h3').innerText === 'living room' && document.querySelector('.zone-card b').innerText === '1'",
    );
    visitor.wait(
        "and said",
        "document.querySelector('.total').innerText.replace(/\\s+/g, ' ').startsWith('1 person here')",
    );
    println!("{} clicks and filled fields", visitor.actions);
    assert!(visitor.actions <= ACTIONS, "{} actions", visitor.actions);
    assert_eq!(visitor.page.errors, Vec::<String>::new());
    is_the_room(&site);
}

/// The file that the tracker has made is of the room that is there.
fn is_the_room(file: &Path) {
    let found = site_file::load(file).unwrap();
    // In the file they stand in the order in which they answered.
    let names: BTreeSet<&str> = found.modules.iter().map(|module| module.name.as_str()).collect();
    assert_eq!(names, BTreeSet::from(["door", "window"]));
    assert!(found.modules.iter().all(|module| module.placed), "{:?}", found.modules);
    let apart = found.modules[1].pose().at - found.modules[0].pose().at;
    let truth = Point::new(4.8, 3.8).length();
    assert!((apart.length() - truth).abs() < WITHIN_M, "{:.2} m apart, not {truth:.2} m", apart.length());
    let corners = found.zones[0].corners();
    let sides = corners.iter().zip(corners.iter().cycle().skip(1));
    let area_m2 = 0.5 * sides.map(|(from, to)| from.cross(*to)).sum::<f64>().abs();
    assert!((area_m2 - 20.0).abs() < 1.5, "{area_m2:.1} m²: {corners:?}");
    let long_m: f64 =
        found.walls.iter().flat_map(|wall| wall.sides()).map(|(from, to)| (to - from).length()).sum();
    assert!((long_m - 18.0).abs() < 1.5, "{long_m:.1} m of wall: {:?}", found.walls);
}
