//! A guarded door in the map's editor: drawn by mouse and by the keyboard alone, set in its card, and watched once it is saved.
//!
//! ```text
//!   Chromium ─HTTP▶ the map's server ─▶ site file ─▶ doors ─▶ frames ─▶ the door on the map
//! ```

mod chromium;
mod described;
mod door_fixture;
mod editor;
mod http_client;

use chromium::Page;
use door_fixture::DoorServer;
use editor::{choose, draw, fill, open_editor, picture, press, save, tab_to};
use kehai_tracking::site::Site;
use kehai_tracking::site::door::{Door, Fail};
use serde_json::json;

const SITE: &str = "# the lobby
[[module]]
name = \"left\"
x = 0.9
y = -0.9

[[zone]]
name = \"area\" # before the door
polygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]]

[[zone]]
name = \"yard\"
polygon = [[2, -1], [3, -1], [3, 1], [2, 1]]
secure = true
";

/// Opens the map, and the editor on it.
fn edit(server: &DoorServer, page: &mut Page) {
    page.size(1280, 800, 1);
    page.scheme("light");
    page.open(&format!("http://{}/", server.server.address()));
    page.wait("the map is live", "document.querySelector('#link').dataset.state === 'live'");
    open_editor(page);
}

fn site(server: &DoorServer) -> Site {
    Site::parse("server.toml", &server.site()).unwrap()
}

/// Until a field of the card is wrong, and how.
fn refused(page: &mut Page, key: &str, words: &str) {
    let said = format!("document.querySelector('#wrong-{key}')");
    page.wait(words, &format!("!{said}.hidden && {said}.innerText.includes({words:?})"));
    let field = format!("document.querySelector('#part-{key}').getAttribute('aria-invalid')");
    assert_eq!(page.value(&field), json!("true"), "{key}");
}

fn taken(page: &mut Page, key: &str) {
    page.wait(key, &format!("document.querySelector('#wrong-{key}').hidden"));
}

/// Where a place of the site is on the screen.
fn at(page: &mut Page, [x, y]: [f64; 2]) -> [f64; 2] {
    let place = format!(
        "(() => {{ const at = new DOMPoint({x}, {}).matrixTransform(document.querySelector('#map').getScreenCTM()); return [at.x, at.y]; }})()",
        -y
    );
    let found = page.value(&place);
    [0, 1].map(|axis| found[axis].as_f64().unwrap())
}

/// What the card says of keys.
const KEYS: &str = "document.querySelector('#about-keys').innerText";

fn pick(page: &mut Page, field: &str, value: &str) {
    page.value(&format!(
        "void (() => {{ const field = document.querySelector('{field}'); field.value = '{value}'; field.dispatchEvent(new Event('change')); }})()"
    ));
}

#[test]
fn a_door_is_drawn_by_mouse_and_set_in_its_card_and_stands_on_the_map() {
    let Some(mut page) = chromium::start() else { return };
    let server = DoorServer::of(SITE);
    edit(&server, &mut page);
    page.click("#tool-door");
    for end in [[-0.45, 1.2], [0.45, 1.2]] {
        let [x, y] = at(&mut page, end);
        page.drag([x, y], [x, y]);
    }
    page.wait("it is drawn", "document.querySelectorAll('.shape[data-kind=door]').length === 1");
    page.wait("and marked", "document.querySelector('#map .door[data-door=\"door 1\"]') !== null");
    // Of the nearest zone, which a door cannot have yet.
    assert_eq!(page.value("document.querySelector('#part-zone').value"), json!("area"));
    refused(&mut page, "zone", "must have secure = true");
    page.is_accessible("a door whose zone is not secure");
    page.click("#make-secure");
    taken(&mut page, "zone");
    // Without keys it is of no use, and the card says so.
    assert!(
        page.value(KEYS).as_str().unwrap().ends_with("has no key, the door is failed, and stays locked.")
    );
    pick(&mut page, "#part-fail", "safe");
    page.wait("in trouble it is unlocked", &format!("{KEYS}.endsWith('and stands unlocked.')"));
    page.click("#part-without_keys");
    page.wait("whom it believes", &format!("{KEYS}.endsWith('can open it.')"));
    for (key, nonsense, words, right) in [
        ("people_max", "-3", "people_max: must be from 1 to 16, is 0", "3.6"),
        ("tries_max", "11", "tries_max: must be from 1 to 10, is 11", "2"),
        ("ask_s", "0.5", "ask_s: must be from 1 to 600, is 0.5", "45.5"),
        ("passback_s", "1e9", "passback_s: must be from 0 to 86400", "0"),
    ] {
        fill(&mut page, &format!("#part-{key}"), nonsense);
        refused(&mut page, key, words);
        fill(&mut page, &format!("#part-{key}"), right);
        taken(&mut page, key);
    }
    page.click("#part-elsewhere");
    page.wait("where cards are shown", "document.querySelector('#part-reader-x').value === '0.7'");
    page.is_accessible("the card of a door");
    picture(&mut page, "edit-door");
    page.fits_a_phone("card of a door");
    // A copy takes its reader along; taking it away and undoing it are as with other shapes.
    page.click("#duplicate");
    page.wait("a copy", "document.querySelector('#part-name').value === 'door 2'");
    assert_eq!(page.value("document.querySelector('#part-reader-x').value"), json!("1.2"));
    page.click("#remove");
    page.wait("one is left", "document.querySelectorAll('.shape[data-kind=door]').length === 1");
    page.click("#undo");
    page.wait("two again", "document.querySelectorAll('.shape[data-kind=door]').length === 2");
    page.click("#redo");
    page.wait("and one", "document.querySelectorAll('.shape[data-kind=door]').length === 1");
    // It follows the name of its zone.
    choose(&mut page, "zone", 0);
    fill(&mut page, "#part-name", "lobby");
    page.wait("it is renamed", "document.querySelector('[aria-label=\"Zone lobby\"]') !== null");
    choose(&mut page, "door", 0);
    fill(&mut page, "#part-name", "front");
    page.wait("so is the door", "document.querySelector('#map .door').dataset.door === 'front'");
    save(&mut page);
    let expected = Door {
        fail: Fail::Safe,
        reader: Some([0.7, 1.2]),
        people_max: 4,
        ask_s: 45.5,
        tries_max: 2,
        passback_s: 0.0,
        without_keys: true,
        ..Door::new("front", "lobby", [[-0.45, 1.2], [0.45, 1.2]])
    };
    assert_eq!(site(&server).doors, [expected]);
    let text = server.site();
    assert!(text.starts_with("# the lobby") && text.contains("name = \"lobby\" # before the door"), "{text}");
    // The frames have it from then on. No frames tell of its zone: it is in trouble, says so, and stands open, as it fails safe.
    page.wait(
        "how it is",
        "(({ state, lock }) => state === 'alarm' && lock === 'unlocked')(document.querySelector('#map .door[data-door=front]').dataset)",
    );
    page.wait("in the list, too", "document.querySelector('#doors').innerText.includes('front')");
    // Its neighbours stay as they were.
    open_editor(&mut page);
    choose(&mut page, "door", 0);
    assert_eq!(page.value("document.querySelector('#part-ask_s').value"), json!("45.5"));
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn a_door_is_drawn_by_the_keyboard_alone_and_locks() {
    let Some(mut page) = chromium::start() else { return };
    let server = DoorServer::of(SITE);
    page.size(1280, 800, 1);
    page.scheme("light");
    page.open(&format!("http://{}/", server.server.address()));
    page.wait("the map is live", "document.querySelector('#link').dataset.state === 'live'");
    tab_to(&mut page, "edit-open");
    press(&mut page, "Enter", false);
    page.wait("the tools are there", "!document.querySelector('#tools').hidden");
    draw(&mut page, "door", &["ArrowLeft", "ArrowUp", "Enter", "ArrowLeft", "Enter"]);
    assert_eq!(page.value("document.querySelector('#part-zone').value"), json!("area"));
    // From the shape to its card; by Tab the next shape would be chosen.
    page.wait(
        "the shape has the focus",
        "document.activeElement.matches('.shape[data-kind=door], #part-name')",
    );
    if page.value("document.activeElement.id") != json!("part-name") {
        press(&mut page, "Enter", false);
    }
    page.wait("its card has the focus", "document.activeElement.id === 'part-name'");
    tab_to(&mut page, "make-secure");
    press(&mut page, "Enter", false);
    page.wait("it is", "document.querySelector('#make-secure') === null");
    tab_to(&mut page, "part-fail");
    press(&mut page, "ArrowDown", false);
    page.wait("it fails safe", "document.querySelector('#part-fail').value === 'safe'");
    // A choice keeps the focus: a user who goes too far can go back.
    page.wait("it has the focus", "document.activeElement.id === 'part-fail'");
    press(&mut page, "ArrowUp", false);
    page.wait("and back", "document.querySelector('#part-fail').value === 'secure'");
    press(&mut page, "ArrowDown", false);
    page.wait("and again", "document.querySelector('#part-fail').value === 'safe'");
    tab_to(&mut page, "save");
    press(&mut page, "Enter", false);
    page.wait("it is saved", "!document.body.classList.contains('editing')");
    let [door] = &site(&server).doors[..] else { panic!("{}", server.site()) };
    assert_eq!((door.name.as_str(), door.zone.as_str(), door.fail), ("door 1", "area", Fail::Safe));
    let [from, to] = door.line;
    assert!((from[0] - to[0] - 1.0).abs() < 1e-6 && (from[1] - to[1]).abs() < 1e-6, "{:?}", door.line);
    page.wait("it locks", "document.querySelector('#map .door').dataset.state === 'locked'");
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn two_who_set_one_door_are_asked_and_its_fields_have_names() {
    let (Some(mut one), Some(mut other)) = (chromium::start(), chromium::start()) else { return };
    let server = DoorServer::new();
    server.waits_for("idle");
    edit(&server, &mut one);
    edit(&server, &mut other);
    for (page, most) in [(&mut one, "3"), (&mut other, "5")] {
        choose(page, "door", 0);
        fill(page, "#part-people_max", most);
    }
    save(&mut one);
    other.click("#save");
    other.wait("it asks", "document.querySelector('#conflicts') !== null");
    let asked = other.value("document.querySelector('#conflicts').innerText");
    let asked = asked.as_str().unwrap();
    assert!(asked.contains("Door front") && asked.contains("Most people at once 5 or 3"), "{asked}");
    other.click("#conflicts input[value=mine]");
    other.click("#settle");
    other.wait("it goes on", "document.querySelector('#save') !== null");
    save(&mut other);
    let [door] = &site(&server).doors[..] else { panic!("{}", server.site()) };
    assert_eq!((door.people_max, door.without_keys, door.exit_s), (5, true, 1.0));
    assert_eq!([&one.errors, &other.errors], [&Vec::<String>::new(); 2]);
}
