//! The live map in a real browser: a building with people, `kehai-tracker run`, and Chromium that looks and clicks.
//!
//! ```text
//!   simulated building ─SCIP▶ modules ─UDP▶ kehai-tracker run ─HTTP▶ Chromium ◀─DevTools─ this test
//! ```
//!
//! With `KEHAI_SCREENSHOTS=1` the pictures of `docs/images` are taken anew; otherwise they go under `target/`.

mod chromium;
mod mapped;

use std::path::Path;
use std::sync::Arc;

use chromium::{Page, pictures};
use host_sim::building::Building;
use host_sim::world::scene::Scene;
use host_tracker::site_file;
use host_tracker::store::reader::Reader;
use host_tracker::store::{Keep, Store};
use kehai_tracking::alarm::{AlarmKind, AlarmLine, Severity};
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{ModuleLine, unix_ms};
use mapped::Tracker;
use serde_json::{Value, json};

/// A track's number that no tracker of today comes to.
const GUEST: u64 = 7007;

/// When the study's module had an alarm then, s after it began, and when it had none any more.
const ALARM_S: u64 = 35;
/// See [`ALARM_S`].
const CLEARED_S: u64 = 45;

/// Confirmed tracks on the map.
const CONFIRMED: &str = "document.querySelectorAll('.person.confirmed').length";

/// Looks at the page fifty times a second: the least number of people it says, and the people it showed at first.
const SAMPLER: &str = "void (() => {
    const shown = () => new Set([...document.querySelectorAll('.person.confirmed')].map((one) => one.dataset.person));
    window.kept = { looks: 0, least: Infinity, people: shown(), shown };
    setInterval(() => {
        const total = document.querySelector('#total').textContent;
        kept.looks += 1;
        if (total !== '–') kept.least = Math.min(kept.least, Number(total));
    }, 20);
})()";

#[test]
fn people_modules_zones_and_the_past_in_a_browser() {
    let Some(mut page) = chromium::start() else { return };
    let scene = Scene::load("building").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("building.toml");
    std::fs::write(&file, toml::to_string(&scene.site).unwrap()).unwrap();
    let hour_ago_ms = unix_ms() - 3_600_000;
    happened_before(&file.with_extension("db"), &scene.site, hour_ago_ms);
    let building = Building::start(&scene, scene.seed).unwrap();
    let tracker = Tracker::start(&file, &building);
    page.size(1440, 900, 1);
    page.scheme("light");
    page.open(&tracker.map);

    page.wait("the map is live", "document.querySelector('#link').dataset.state === 'live'");
    page.wait("modules see something", "document.querySelectorAll('.fields path').length >= 6");
    page.wait("people are on the map", &format!("{CONFIRMED} >= 3"));
    page.wait("the panel counts them", "Number(document.querySelector('#total').textContent) >= 3");
    take_pictures(&mut page);
    page.fits_a_phone("map");

    walkers_move_at_every_repaint(&mut page);
    module_details(&mut page);
    a_zone_is_drawn(&mut page, &file);
    looking_back(&mut page);
    looking_back_an_hour(&mut page, hour_ago_ms);

    let own = tracker.map.trim_end_matches('/').trim_start_matches("http://").to_owned();
    // The browser's own picture of a calendar is no request.
    let is_own = |address: &String| address.contains(&own) || address.starts_with("data:");
    assert!(page.requests.iter().all(is_own), "{:?}", page.requests);
    drop(tracker);
    page.wait(
        "the loss of the connection is said",
        "document.querySelector('#notice').innerText.includes('No connection to the tracker')",
    );
    page.fits_a_phone("lost connection");
    page.wait("no count is shown without one", "document.querySelector('#total').textContent === '–'");
    assert_eq!(page.errors, Vec::<String>::new());
}

fn take_pictures(page: &mut Page) {
    let folder = pictures();
    page.picture(&folder.join("live-map.png"));
    page.is_accessible("live map");
    page.scheme("dark");
    page.picture(&folder.join("live-map-dark.png"));
    page.is_accessible("live map, dark");
    page.size(360, 780, 2);
    page.scheme("light");
    page.wait("the page has the phone's width", "document.documentElement.scrollWidth <= 360");
    page.wait("people are on the phone", &format!("{CONFIRMED} >= 1"));
    page.picture(&folder.join("live-map-phone.png"));
    page.is_accessible("live map, phone");
    page.size(3840, 2160, 1);
    page.wait(
        "letters grow with a screen on a wall",
        "parseFloat(getComputedStyle(document.querySelector('.legend')).fontSize) >= 24",
    );
    page.picture(&std::env::temp_dir().join("kehai-wall.png"));
    page.size(1440, 900, 1);
    page.wait("the page is wide again", "innerWidth === 1440");
    let ground = "getComputedStyle(document.querySelector('.stage')).backgroundColor";
    let before = page.value(ground);
    let before = before.as_str().unwrap().to_owned();
    page.forced_colors();
    page.wait("colours are forced", "matchMedia('(forced-colors: active)').matches");
    page.wait(
        "what is not seen still differs from what is",
        &format!("{ground} === '{before}' && getComputedStyle(document.querySelector('.k.person')).backgroundColor !== 'rgba(0, 0, 0, 0)'"),
    );
    page.scheme("light");
}

fn module_details(page: &mut Page) {
    page.click("[data-module=kitchen] .box");
    page.wait(
        "the kitchen's details are open",
        "document.querySelector('#detail h2')?.innerText === 'kitchen'",
    );
    page.wait(
        "they say how it is",
        "/scans\\s+(9|10)\\.\\d a second/.test(document.querySelector('#detail').innerText)",
    );
    page.wait(
        "what it sees stands out",
        "document.querySelector('.fields.chosen path')?.dataset.field === 'kitchen'",
    );
    page.fits_a_phone("module");
    page.key("Escape", 27);
    page.wait("the details are closed", "document.querySelector('#detail').hidden");
}

fn a_zone_is_drawn(page: &mut Page, file: &Path) {
    let shapes = "document.querySelectorAll('.shape[data-kind=zone]').length";
    page.click("#edit-open");
    page.wait("the tools are there", "!document.querySelector('#tools').hidden");
    page.click("#tool-zone");
    let [x, y] = page.middle(".module[data-module=study] .box");
    page.drag([x - 130.0, y + 40.0], [x - 30.0, y + 110.0]);
    page.wait("a zone more", &format!("{shapes} === 6"));
    page.click("#undo");
    page.wait("it is undone", &format!("{shapes} === 5"));
    page.click("#redo");
    page.wait("it is back", &format!("{shapes} === 6"));
    page.value("document.querySelector('.shape[data-kind=zone][data-index=\"5\"]').focus()");
    page.wait("its form is open", "document.querySelector('#part-name')?.value === 'zone 1'");
    page.fits_a_phone("edit");
    page.value("document.querySelector('#part-name').select()");
    page.write("context");
    page.key("Tab", 9);
    page.wait("it has its name", "document.querySelector('#part-name').value === 'context'");
    page.click("#tool-line");
    for along in [-120.0, -40.0] {
        page.drag([x + along, y + 90.0], [x + along, y + 90.0]);
    }
    page.wait("a line more", "document.querySelectorAll('.shape[data-kind=line]').length === 5");
    page.value(SAMPLER);
    page.click("#save");
    page.wait("it is saved", "!document.body.classList.contains('editing')");
    page.wait("a hundred looks", "kept.looks >= 100");
    assert!(page.value("kept.least").as_u64() > Some(0), "{}", page.value("JSON.stringify(kept)"));
    assert_eq!(page.value("[...kept.people].some((id) => kept.shown().has(id))"), json!(true));
    page.wait("the panel counts it", "document.querySelector('#zones').innerText.includes('context')");
    let saved = site_file::load(file).unwrap();
    let names: Vec<&str> = saved.zones.iter().map(|zone| zone.name.as_str()).collect();
    assert_eq!(names.last(), Some(&"context"), "{names:?}");
    assert_eq!(names.len(), 6);
    assert_eq!(saved.lines.len(), 5);
    let said = "document.querySelector('[data-line=front] text').textContent";
    page.wait("a line says who crossed it", &format!("/^front · in \\d+ · out \\d+$/.test({said})"));
}

/// Watches repaints until there are 100 of a person who walks: at how many of them that person has moved.
const REPAINTS: &str = "void (() => {
    const STEP_M = 0.0005, WALKS_M_S = 0.3, AROUND = 15;
    const kept = [];
    window.repaints = { walked: 0, moved: 0, gaps: [] };
    const look = (now) => {
        const places = {};
        for (const one of document.querySelectorAll('.person.confirmed')) {
            const { e, f } = new DOMMatrix(getComputedStyle(one).transform);
            places[one.dataset.person] = [e, f];
        }
        kept.push({ now, places });
        const at = kept.length - 1 - AROUND;
        if (at > AROUND) {
            const [before, last, here, after] = [kept[at - AROUND], kept[at - 1], kept[at], kept[at + AROUND]];
            repaints.gaps.push(here.now - last.now);
            for (const id of Object.keys(here.places)) {
                if (!before.places[id] || !last.places[id] || !after.places[id]) continue;
                const far = (from, to) => Math.hypot(...to.places[id].map((value, axis) => value - from.places[id][axis]));
                if (far(before, after) < WALKS_M_S * (after.now - before.now) / 1000) continue;
                repaints.walked += 1;
                repaints.moved += far(last, here) > STEP_M;
            }
        }
        if (repaints.walked < 400) requestAnimationFrame(look);
    };
    requestAnimationFrame(look);
})()";

fn walkers_move_at_every_repaint(page: &mut Page) {
    page.value(REPAINTS);
    page.wait("400 repaints of people who walk", "repaints.walked >= 400");
    let share = page.value("repaints.moved / repaints.walked").as_f64().unwrap();
    let gap = page.value("repaints.gaps.sort((a, b) => a - b)[repaints.gaps.length >> 1]");
    println!("a person who walks moves in {:.1} % of the repaints, {gap} ms apart", share * 100.0);
    assert!(share >= 0.95, "a person who walks moves in {:.1} % of the repaints only", share * 100.0);
    page.reduce_motion();
    page.value(REPAINTS);
    page.wait("400 more", "repaints.walked >= 400");
    let [moved, walked] =
        ["moved", "walked"].map(|key| page.value(&format!("repaints.{key}")).as_f64().unwrap());
    let all_ms = page.value("repaints.gaps.reduce((sum, gap) => sum + gap, 0)").as_f64().unwrap();
    println!("without motion in {:.1} %, in {all_ms:.0} ms", 100.0 * moved / walked);
    // No repaint between two frames shows other places.
    let repaints = page.value("repaints.gaps.length").as_f64().unwrap();
    let most = (all_ms / 100.0 + 2.0) / repaints;
    assert!(
        moved / walked <= most.max(0.1) + 0.05,
        "{moved} of {walked}, {repaints} repaints in {all_ms} ms"
    );
    page.scheme("light");
}

/// A person stood in the study for a minute, long ago: another tracker kept it.
fn happened_before(database: &Path, site: &Site, begun_ms: u64) {
    let store = Store::open(database, &Arc::new(site.clone()), Keep::USUAL).unwrap();
    let study = site.modules.iter().find(|module| module.name == "study").unwrap();
    let (x, y) = (study.x - 1.0, study.y - 1.0);
    for tenth in 0..600_u32 {
        let track = json!({ "id": GUEST, "x": x, "y": y - 0.001 * f64::from(tenth), "state": "confirmed" });
        let zones: serde_json::Map<String, Value> = site
            .zones
            .iter()
            .map(|zone| {
                (
                    zone.name.clone(),
                    json!({ "count": u32::from(["study", "home"].contains(&zone.name.as_str())), "p": [0.0, 1.0], "seen_share": 1.0, "state": "known" }),
                )
            })
            .collect();
        let sick = (ALARM_S..CLEARED_S).contains(&(u64::from(tenth) / 10));
        let text = "no scans for 2 s".into();
        let alarm = AlarmLine { kind: AlarmKind::Silent, severity: Severity::default(), text };
        let module = ModuleLine {
            name: "study".into(),
            alarms: sick.then_some(alarm).into_iter().collect(),
            ..ModuleLine::default()
        };
        let frame = json!({
            "unix_ms": begun_ms + 100 * u64::from(tenth), "t": f64::from(tenth) * 0.1, "tracks": [track], "zones": zones, "modules": [module],
        });
        store.see_waiting(Arc::new(serde_json::from_value(frame).unwrap()));
    }
    drop(store);
    // It ended with its last frame, not now.
    assert!(Reader::open(database).unwrap().lives(begun_ms, begun_ms + 60_000).unwrap().len() == 1);
}

fn looking_back_an_hour(page: &mut Page, hour_ago_ms: u64) {
    let guest = format!("[data-person=\"{GUEST}\"]");
    page.wait(
        "the database is there",
        "!document.querySelector('#range option[value=\"21600000\"]').disabled",
    );
    page.value(
        "(() => { const range = document.querySelector('#range'); range.value = '21600000'; \
         range.dispatchEvent(new Event('change')); })()",
    );
    page.wait(
        "six hours are drawn",
        "document.querySelector('#density .counts').getAttribute('d').length > 0",
    );
    page.wait(
        "and where no tracker ran it says so",
        "document.querySelector('#density .gaps').getAttribute('d').length > 100",
    );
    assert_eq!(page.value(&format!("document.querySelectorAll('{guest}').length")), json!(0));
    let there_ms = hour_ago_ms + 30_000;
    page.value(&format!(
        "(() => {{ const slider = document.querySelector('#slider'); slider.focus(); \
         slider.value = ({there_ms} - Date.now()) / 1000; slider.dispatchEvent(new Event('input')); }})()"
    ));
    page.wait(
        "the person who was there an hour ago is shown",
        &format!("document.querySelectorAll('{guest}').length === 1"),
    );
    page.wait("alone", "document.querySelectorAll('#map .person').length === 1");
    page.wait("and counted", "document.querySelector('#total').textContent === '1'");
    page.wait("what happened is told", "document.querySelector('#events').innerText.includes('came into')");
    page.picture(&pictures().join("live-map-past.png"));
    page.fits_a_phone("past");
    for _ in 0..3 {
        page.click("#speed");
    }
    page.wait("it plays fast", "document.querySelector('#speed').textContent === '60×'");
    page.click("#play");
    page.wait("until no person was there", "document.querySelectorAll('#map .person').length === 0");
    page.wait("which is not the same as nothing", "document.querySelector('#total').textContent === '–'");
    page.click("#live");
    page.wait("it is now again", "!document.body.classList.contains('past')");
    page.wait("with the people of now", &format!("{CONFIRMED} >= 1"));
    // A link to a time shows it, in a range that holds it.
    page.value(
        "(() => { const range = document.querySelector('#range'); range.value = '600000'; \
         range.dispatchEvent(new Event('change')); })()",
    );
    page.value(&format!("void (location.hash = '#at={there_ms}')"));
    page.wait("the link's time is shown", &format!("document.querySelectorAll('{guest}').length === 1"));
    page.wait("the range holds it", "Number(document.querySelector('#range').value) > 3600000 - 1");
    from_mark_to_mark(page, hour_ago_ms);
    page.click("#live");
    page.wait(
        "the link is followed once",
        "location.hash === '' && !document.body.classList.contains('past')",
    );
}

/// The buttons beside the time line, the day, and the address, which anybody else can open.
fn from_mark_to_mark(page: &mut Page, hour_ago_ms: u64) {
    let at = |s: u64| format!("location.hash === '#at={}'", hour_ago_ms + 1000 * s);
    page.value(&format!("void (location.hash = '#at={}')", hour_ago_ms + 55_000));
    page.wait("from after the alarm", "!document.querySelector('#event-after').disabled");
    page.click("#event-before");
    page.wait("to its end", &at(CLEARED_S));
    page.wait("which is said", "/study/.test(document.querySelector('#notice').innerText)");
    page.value("document.querySelector('#event-before').focus()");
    page.key(" ", 32);
    page.wait("by a key to its beginning", &at(ALARM_S));
    page.wait("in words", "/study.*no scans/s.test(document.querySelector('#notice').innerText)");
    page.fits_a_phone("mark");
    page.click("#event-after");
    page.wait("and on again", &at(CLEARED_S));
    // The same address in another window shows the same time.
    let link = page.value("location.href").as_str().unwrap().to_owned();
    page.open("about:blank");
    page.wait("nothing is open", "location.href === 'about:blank'");
    page.open(&link);
    page.wait(
        "the link's time",
        &format!("document.querySelectorAll('[data-person=\"{GUEST}\"]').length === 1"),
    );
    page.wait("is in its address", &at(CLEARED_S));
    page.wait(
        "and so is its day",
        "document.querySelector('#day').value === new Date(Number(location.hash.slice(4))).toLocaleDateString('sv')",
    );
    // The slider writes it, too.
    page.value(
        "(() => { const slider = document.querySelector('#slider'); slider.value = Number(slider.value) + 600; \
         slider.dispatchEvent(new Event('input')); })()",
    );
    let moved_s = format!("(Number(location.hash.slice(4)) - {hour_ago_ms}) / 1000");
    page.wait("a place on the slider has an address", &format!("Math.abs({moved_s} - 645) < 60"));
    page.value(
        "(() => { const day = document.querySelector('#day'); day.stepDown(2); day.dispatchEvent(new Event('change')); })()",
    );
    let days = format!("({moved_s} - 645) / 86400");
    page.wait("two days before, at the same time of day", &format!("Math.abs({days} + 2) < 0.05"));
    page.wait("of which nothing is kept", "document.querySelector('#total').textContent === '–'");
    page.click("#event-before");
    page.wait("nor anything before", "/No alarm/.test(document.querySelector('#notice').innerText)");
}

fn looking_back(page: &mut Page) {
    // Some seconds with people, to be looked back at.
    page.wait(
        "people stay on the map",
        &format!(
            "(window.since = {CONFIRMED} >= 1 ? window.since ?? performance.now() : undefined, \
             performance.now() - window.since > 5000)"
        ),
    );
    let then = page.value("document.querySelector('#clock').textContent");
    page.value("document.querySelector('#slider').focus()");
    for _ in 0..6 {
        page.key("ArrowLeft", 37);
    }
    page.wait("the page looks back", "document.body.classList.contains('past')");
    let back = page.value("document.querySelector('#clock').textContent");
    assert_ne!(then, back);
    assert_eq!(page.value("document.querySelector('#live').getAttribute('aria-pressed')"), json!("false"));
    page.wait("people of then are shown", "document.querySelectorAll('#map .person').length >= 1");
    page.click("#live");
    page.wait("it is now again", "!document.body.classList.contains('past')");
}
