//! The map's editor in a browser: two who edit at once, a page from before a restart, nonsense, and drawing by the keyboard alone.
//!
//! ```text
//!   Chromium ─╮
//!             ├─HTTP▶ the map's server ─▶ site file       no devices: frames without people
//!   Chromium ─╯
//! ```

mod chromium;
mod editor;

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

use chromium::Page;
use editor::{choose, drag, draw, fill, open_editor, picture, press, save, tab_to, type_into};
use host_tracker::site_file::{self, SiteFile};
use host_tracker::web::{Server, ServerContext};
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{Snapshot, unix_ms};
use serde_json::json;
use tokio::sync::watch;

const HOME: &str = "# where we live
[[module]]
name = \"left\"
x = 0.0
y = 0.0 # by ruler

[[zone]]
name = \"hall\"
polygon = [[0, 0], [4, 0], [4, 4], [0, 4]]
count = true

[[zone]]
name = \"study\"
polygon = [[5, 0], [8, 0], [8, 4], [5, 4]]
count = true
";

/// A server that ends when it is dropped, and can be started again at its address.
struct Tracker {
    server: Option<Server>,
    stop: Sender<()>,
    frames: Option<JoinHandle<()>>,
}

impl Tracker {
    fn start(site: &Path, at: SocketAddr) -> Self {
        let (newest_in, newest) = watch::channel(Arc::default());
        let (stop, stopped) = channel::<()>();
        let frames = std::thread::spawn(move || {
            while stopped
                .recv_timeout(Duration::from_millis(50))
                .is_err_and(|error| !error.to_string().contains("disconnected"))
            {
                newest_in.send_replace(Arc::new(Snapshot { unix_ms: unix_ms(), ..Snapshot::default() }));
            }
        });
        let context = || ServerContext::alone(newest.clone(), SiteFile::load(site).unwrap());
        // Its address may be in use for a moment by the one before.
        let server = loop {
            match Server::start(at, context()) {
                Ok(server) => break server,
                Err(error) if error.kind() == std::io::ErrorKind::AddrInUse => {
                    std::thread::sleep(Duration::from_millis(50));
                }
                Err(error) => panic!("{error}"),
            }
        };
        Self { server: Some(server), stop, frames: Some(frames) }
    }

    fn address(&self) -> SocketAddr {
        self.server.as_ref().unwrap().address()
    }
}

impl Drop for Tracker {
    fn drop(&mut self) {
        drop(self.server.take());
        let _ = self.stop.send(());
        let _ = self.frames.take().unwrap().join();
    }
}

struct House {
    tracker: Tracker,
    folder: tempfile::TempDir,
}

impl House {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("home.toml"), HOME).unwrap();
        let tracker = Tracker::start(&folder.path().join("home.toml"), SocketAddr::from(([127, 0, 0, 1], 0)));
        Self { tracker, folder }
    }

    fn path(&self) -> PathBuf {
        self.folder.path().join("home.toml")
    }

    fn text(&self) -> String {
        std::fs::read_to_string(self.path()).unwrap()
    }

    fn site(&self) -> Site {
        site_file::load(&self.path()).unwrap()
    }

    /// Opens the map, and the editor on it.
    fn edit(&self, page: &mut Page) {
        page.size(1280, 800, 1);
        page.scheme("light");
        page.value("void (window.before = true)");
        page.open(&format!("http://{}/", self.tracker.address()));
        page.wait(
            "the map is live",
            "window.before === undefined && document.querySelector('#link').dataset.state === 'live'",
        );
        open_editor(page);
    }
}

#[test]
fn two_who_edit_at_once_lose_nothing() {
    let (Some(mut one), Some(mut other)) = (chromium::start(), chromium::start()) else { return };
    let house = House::new();
    house.edit(&mut one);
    house.edit(&mut other);
    // Different parts: the second takes in what the first has saved, and goes on.
    one.click("#tool-zone");
    drag(&mut one, [-60.0, -250.0, 60.0, -200.0]);
    one.wait("a zone more", "document.querySelectorAll('.shape[data-kind=zone]').length === 3");
    other.click("#tool-mover");
    drag(&mut other, [-60.0, 200.0, 60.0, 250.0]);
    other.wait("a mover", "document.querySelectorAll('.shape[data-kind=mover]').length === 1");
    save(&mut one);
    other.wait("it is said at once", "document.querySelector('#edit-newer') !== null");
    other.is_accessible("another user has saved");
    other.click("#take-in");
    other.wait("theirs are there", "document.querySelectorAll('.shape[data-kind=zone]').length === 3");
    other.wait(
        "and said",
        "document.querySelector('#edit-taken').innerText.includes('zone \"zone 1\" added')",
    );
    other.wait("mine is, too", "document.querySelectorAll('.shape[data-kind=mover]').length === 1");
    save(&mut other);
    assert_eq!((house.site().zones.len(), house.site().movers.len()), (3, 1));
    // Without taking anything in: what does not meet is merged by saving.
    open_editor(&mut one);
    open_editor(&mut other);
    choose(&mut one, "zone", 0);
    fill(&mut one, "#part-name", "lounge");
    choose(&mut other, "zone", 1);
    fill(&mut other, "#part-name", "library");
    save(&mut one);
    save(&mut other);
    other.wait(
        "one line says so",
        "document.querySelector('#notice').innerText.includes('zone \"lounge\" changed')",
    );
    let names = |site: Site| site.zones.into_iter().map(|zone| zone.name).collect::<Vec<_>>();
    assert_eq!(names(house.site()), ["lounge", "library", "zone 1"]);
    // The same part, and one that only the second has drawn.
    open_editor(&mut one);
    one.wait("it has all of it", "document.querySelector('[aria-label=\"Zone library\"]') !== null");
    open_editor(&mut other);
    other.wait("it has all of it", "document.querySelector('[aria-label=\"Zone lounge\"]') !== null");
    choose(&mut other, "zone", 0);
    fill(&mut other, "#part-people_max", "4");
    choose(&mut one, "zone", 0);
    fill(&mut one, "#part-name", "salon");
    save(&mut one);
    other.click("#tool-exclude");
    drag(&mut other, [-200.0, 200.0, -150.0, 250.0]);
    other.wait("an area more", "document.querySelectorAll('.shape[data-kind=exclude]').length === 1");
    other.click("#save");
    other.wait("it asks", "document.querySelector('#conflicts') !== null");
    let asked = other.value("document.querySelector('#conflicts').innerText");
    let asked = asked.as_str().unwrap();
    assert!(asked.contains("You changed it, and another user changed it"), "{asked}");
    assert!(
        asked.contains("“lounge” or “salon”") && asked.contains("Most people (alarm above) 4 or none"),
        "{asked}"
    );
    assert_eq!(other.value("document.querySelector('#settle').disabled"), json!(true));
    assert_eq!(other.value("document.querySelectorAll('#map .theirs').length"), json!(1));
    other.is_accessible("a conflict");
    picture(&mut other, "edit-conflict");
    other.fits_a_phone("conflict");
    other.click("#conflicts input[value=mine]");
    other.click("#settle");
    other.wait("it goes on", "document.querySelector('#save') !== null");
    save(&mut other);
    let site = house.site();
    assert_eq!(
        (site.zones[0].name.as_str(), site.zones[0].people_max, site.excludes.len()),
        ("lounge", Some(4), 1)
    );
    let text = house.text();
    assert!(text.starts_with("# where we live") && text.contains("y = 0.0 # by ruler"), "{text}");
    let former = std::fs::read_to_string(house.folder.path().join("home.toml.bak1")).unwrap();
    assert!(former.contains("salon") && !former.contains("people_max"), "{former}");
    assert_eq!([&one.errors, &other.errors], [&Vec::<String>::new(); 2]);
}

#[test]
fn what_others_save_takes_no_corner_of_a_drawing_and_without_the_site_there_is_none() {
    let Some(mut page) = chromium::start() else { return };
    let house = House::new();
    page.size(1280, 800, 1);
    // The site is long on its way.
    let source = "const real = globalThis.fetch; globalThis.fetch = async (path, how) => { \
                  if (path === '/api/site' && !globalThis.sent) await new Promise((sent) => globalThis.send = sent); \
                  return real(path, how); };";
    page.call("Page.addScriptToEvaluateOnNewDocument", json!({ "source": source }));
    page.open(&format!("http://{}/", house.tracker.address()));
    page.wait("the map is live", "document.querySelector('#link').dataset.state === 'live'");
    page.wait("the site is asked for", "globalThis.send !== undefined");
    page.click("#edit-open");
    page.settle();
    assert_eq!(page.value("document.querySelector('#tools').hidden"), json!(true));
    page.value("void (globalThis.sent = true, send())");
    page.wait("the tools are there", "!document.querySelector('#tools').hidden");
    page.wait(
        "with the site",
        "document.querySelector('#edit-form').innerText.includes('Saves to home.toml')",
    );
    // Another page saves when two corners are set.
    tab_to(&mut page, "tool-zone");
    for key in ["Enter", "Enter", "ArrowRight", "ArrowUp", "Enter"] {
        press(&mut page, key, key.starts_with("Arrow"));
    }
    let rename = "import('/site-file.js').then(({ changeSite }) => changeSite((site) => { site.zone[1].name = 'den'; }))";
    page.value(&format!("{rename}.then(() => null)"));
    page.wait("it is said", "document.querySelector('#edit-newer') !== null");
    page.value("document.querySelector('#take-in').click()");
    page.wait("theirs is there", "document.querySelector('[aria-label=\"Zone den\"]') !== null");
    page.value("document.querySelector('#map').focus()");
    press(&mut page, "Enter", false);
    page.wait("mine, too", "document.querySelector('[aria-label=\"Zone zone 1\"]') !== null");
    save(&mut page);
    let names = house.site().zones.into_iter().map(|zone| zone.name).collect::<Vec<_>>();
    assert_eq!(names, ["hall", "den", "zone 1"]);
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn a_page_from_before_a_restart_saves_over_nothing_and_loses_nothing() {
    let Some(mut page) = chromium::start() else { return };
    let mut house = House::new();
    house.edit(&mut page);
    choose(&mut page, "zone", 0);
    fill(&mut page, "#part-name", "lounge");
    let at = house.tracker.address();
    let path = house.path();
    drop(std::mem::replace(&mut house.tracker, Tracker::start(&path, SocketAddr::from(([127, 0, 0, 1], 0)))));
    page.wait("it is lost", "document.querySelector('#link').dataset.state === 'lost'");
    let by_hand = HOME.replace("[8, 4]", "[8, 5]") + "\n# by hand\n[[wall]]\npoints = [[0, 0], [8, 0]]\n";
    std::fs::write(&path, by_hand).unwrap();
    house.tracker = Tracker::start(&path, at);
    page.wait("it is back", "document.querySelector('#link').dataset.state === 'live'");
    page.wait("the drawing is still there", "document.querySelector('#part-name').value === 'lounge'");
    save(&mut page);
    let (site, text) = (house.site(), house.text());
    assert_eq!(
        (site.zones[0].name.as_str(), site.zones[1].polygon[2], site.walls.len()),
        ("lounge", [8.0, 5.0], 1)
    );
    assert!(text.contains("# by hand\n[[wall]]"), "{text}");
    // A page that goes away with a drawing leaves it in the browser.
    open_editor(&mut page);
    page.wait("it shows the site", "document.querySelector('[aria-label=\"Zone lounge\"]') !== null");
    page.click("#tool-zone");
    drag(&mut page, [-60.0, -250.0, 60.0, -200.0]);
    page.wait("it is kept", "localStorage.getItem('kehai-drawing:home.toml')?.includes('zone 1')");
    // The test cannot answer whether to leave.
    page.value("void (Event.prototype.preventDefault = function () {})");
    house.edit(&mut page);
    page.wait("it is offered", "document.querySelector('#edit-left') !== null");
    page.click("#left-take");
    page.wait("it is back", "document.querySelector('[aria-label=\"Zone zone 1\"]') !== null");
    save(&mut page);
    assert_eq!(house.site().zones.len(), 3);
    assert_eq!(page.value("localStorage.getItem('kehai-drawing:home.toml')"), json!(null));
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn what_is_being_typed_is_saved_by_a_key_and_by_a_click() {
    let Some(mut page) = chromium::start() else { return };
    let house = House::new();
    house.edit(&mut page);
    choose(&mut page, "zone", 0);
    type_into(&mut page, "#part-name", "lounge");
    let key =
        json!({ "type": "keyDown", "key": "s", "code": "KeyS", "windowsVirtualKeyCode": 83, "modifiers": 2 });
    page.call("Input.dispatchKeyEvent", key);
    page.wait("it is saved", "!document.body.classList.contains('editing')");
    assert_eq!(house.site().zones[0].name, "lounge");
    open_editor(&mut page);
    choose(&mut page, "zone", 0);
    fill(&mut page, "#part-name", "salon");
    page.wait("Tab goes on", "document.activeElement.id === 'part-count'");
    type_into(&mut page, "#part-people_max", "4");
    save(&mut page);
    let zones = house.site().zones;
    assert_eq!((zones[0].name.as_str(), zones[0].people_max), ("salon", Some(4)));
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn nonsense_is_refused_at_the_field() {
    let Some(mut page) = chromium::start() else { return };
    let house = House::new();
    house.edit(&mut page);
    choose(&mut page, "module", 0);
    for (field, key, value, words) in [
        ("#part-height_m", "height_m", "-5", "must be from 0.05 to 10, is -5"),
        ("#part-yaw_deg", "yaw_deg", "1000000", "must be from -360 to 360"),
    ] {
        fill(&mut page, field, value);
        let said = format!("document.querySelector('#wrong-{key}')");
        page.wait(
            "it is said under the field",
            &format!("!{said}.hidden && {said}.innerText.includes('{words}')"),
        );
        page.wait(
            "and at it",
            &format!("document.querySelector('{field}').getAttribute('aria-invalid') === 'true'"),
        );
    }
    page.is_accessible("nonsense");
    picture(&mut page, "edit-nonsense");
    page.fits_a_phone("nonsense");
    choose(&mut page, "zone", 1);
    fill(&mut page, "#part-name", "hall");
    page.wait(
        "which zones are alike",
        "document.querySelector('#wrong-name').innerText === 'two zones are named \"hall\": rename one'",
    );
    page.wait("and the others", "document.querySelectorAll('#edit-wrong li').length === 3");
    page.wait("on the map, too", "document.querySelectorAll('.shape.wrong').length === 3");
    page.click("#save");
    page.wait("the tracker refuses it", "!document.querySelector('#edit-error').hidden");
    assert_eq!(house.text(), HOME);
    page.click("#edit-wrong li:nth-child(2) button");
    page.wait("the one it is about is chosen", "document.querySelector('#part-height_m') !== null");
    fill(&mut page, "#part-height_m", "0.8");
    fill(&mut page, "#part-yaw_deg", "90");
    page.wait(
        "it is well",
        "document.querySelector('#wrong-height_m').hidden && document.querySelector('#wrong-yaw_deg').hidden",
    );
    choose(&mut page, "zone", 1);
    fill(&mut page, "#part-name", "study");
    page.wait("nothing is wrong", "document.querySelectorAll('.shape.wrong').length === 0 && document.querySelector('#edit-wrong').hidden");
    // A bow tie: corner after corner.
    page.click("#tool-zone");
    let [x, y] = page.middle("#map");
    for [aside, up] in [[-60.0, 200.0], [60.0, 260.0], [60.0, 200.0], [-60.0, 260.0], [-60.0, 200.0]] {
        page.drag([x + aside, y + up], [x + aside, y + up]);
    }
    page.wait("it is drawn", "document.querySelectorAll('.shape[data-kind=zone]').length === 3");
    page.wait(
        "it crosses itself",
        "document.querySelector('#edit-wrong').innerText.includes('crosses itself')",
    );
    page.click("#remove");
    page.wait("it is gone", "document.querySelector('#edit-wrong').hidden");
    save(&mut page);
    assert_eq!(house.site().modules[0].height_m, 0.8);
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn all_is_drawn_by_the_keyboard_alone() {
    let Some(mut page) = chromium::start() else { return };
    let house = House::new();
    page.size(1280, 800, 1);
    page.scheme("light");
    page.open(&format!("http://{}/", house.tracker.address()));
    page.wait("the map is live", "document.querySelector('#link').dataset.state === 'live'");
    tab_to(&mut page, "edit-open");
    press(&mut page, "Enter", false);
    page.wait("the tools are there", "!document.querySelector('#tools').hidden");
    // Two corners and once more: a rectangle.
    draw(&mut page, "zone", &["Enter", "ArrowRight", "ArrowRight", "ArrowUp", "Enter", "Enter"]);
    // Corner after corner, closed by Enter at the last one.
    draw(&mut page, "exclude", &["Enter", "ArrowRight", "Enter", "ArrowDown", "Enter", "Enter"]);
    draw(&mut page, "wall", &["Enter", "ArrowUp", "Enter", "ArrowLeft", "Enter", "Enter"]);
    draw(&mut page, "entry", &["ArrowDown", "Enter", "ArrowLeft", "Enter"]);
    draw(&mut page, "line", &["ArrowDown", "ArrowDown", "Enter", "ArrowLeft", "Enter"]);
    draw(&mut page, "module", &["ArrowUp", "Enter"]);
    // What is done is said, in metres.
    tab_to(&mut page, "tool-wall");
    press(&mut page, "Enter", false);
    let spoken = "document.querySelector('#edit-spoken').innerText";
    let hint = "document.querySelector('#hint').innerText";
    page.wait("how it is done is said", &format!("{hint}.startsWith('Arrow keys move the cursor')"));
    page.wait("and where", &format!("/^Wall: x -?\\d+\\.\\d\\d, y -?\\d+\\.\\d\\d metres$/.test({spoken})"));
    press(&mut page, "Enter", false);
    page.wait("a corner is said", &format!("{spoken}.startsWith('Corner 1 set at x ')"));
    for _ in 0..3 {
        press(&mut page, "ArrowRight", false);
    }
    page.wait("and how far it is", &format!("{spoken}.endsWith(', 0.30 metres from the last corner')"));
    press(&mut page, "ArrowRight", true);
    page.wait("on the map, too", "document.querySelector('#map .length').textContent === '1.30 m · 0°'");
    page.is_accessible("drawing by keyboard");
    picture(&mut page, "edit-keyboard");
    press(&mut page, "Escape", false);
    page.wait(
        "Escape leaves",
        "document.querySelector('#tool-select').getAttribute('aria-pressed') === 'true'",
    );
    page.wait("the focus is where it was", "document.activeElement.id === 'tool-wall'");
    tab_to(&mut page, "save");
    press(&mut page, "Enter", false);
    page.wait("it is saved", "!document.body.classList.contains('editing')");
    let site = house.site();
    let sides = |points: &[[f64; 2]]| -> Vec<[f64; 2]> {
        points
            .windows(2)
            .map(|ends| [0, 1].map(|axis| ((ends[1][axis] - ends[0][axis]) * 1000.0).round() / 1000.0))
            .collect()
    };
    assert_eq!(sides(&site.zones[2].polygon), [[2.0, 0.0], [0.0, 1.0], [-2.0, 0.0]]);
    assert_eq!(sides(&site.excludes[0].polygon), [[1.0, 0.0], [0.0, -1.0]]);
    assert_eq!(sides(&site.walls[0].points), [[0.0, 1.0], [-1.0, 0.0]]);
    assert_eq!(sides(&site.entries[0].line), [[-1.0, 0.0]]);
    assert_eq!(sides(&[site.lines[0].from, site.lines[0].to]), [[-1.0, 0.0]]);
    assert_eq!(site.modules[1].name, "module 1");
    assert!((site.modules[1].y - site.walls[0].points[1][1]).abs() < 1e-9, "a metre above the middle");
    assert_eq!(page.errors, Vec::<String>::new());
}
