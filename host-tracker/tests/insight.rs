//! Why a figure is what it is, the report, where people were, and the handover page, in a real browser and on the command line.
//!
//! ```text
//!   yesterday, made: 20 minutes from 10:00, then no tracker ─▶ database ─┐
//!   simulated building ─▶ modules ─▶ kehai-tracker run ─────────────────┴─HTTP▶ Chromium, kehai-tracker explain
//! ```

mod chromium;
mod described;
mod http_client;
mod mapped;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::time::Duration;

use chromium::Page;
use host_sim::building::Building;
use host_sim::world::scene::Scene;
use host_tracker::store::{Keep, Store};
use jiff::{ToSpan as _, Zoned};
use kehai_tracking::site::Site;
use mapped::Tracker;
use serde_json::{Map, Value, json};

/// How often the front door's line was crossed inward yesterday.
const CROSSED: u64 = 19;

impl Tracker {
    fn get(&self, path: &str) -> (u16, Value) {
        let address = self.map.trim_start_matches("http://").trim_end_matches('/').parse().unwrap();
        let (status, body) = http_client::ask(address, &format!("GET {path}"), &[], b"");
        (status, serde_json::from_str(&body).unwrap())
    }

    /// What the command prints, and whether it succeeded.
    fn explain(&self, arguments: &[&str]) -> (bool, String) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
        let out = command.arg("explain").args(arguments).args(["--tracker", &self.map]).output().unwrap();
        let text = [out.stdout, out.stderr].map(|bytes| String::from_utf8(bytes).unwrap()).concat();
        (out.status.success(), text)
    }
}

/// Yesterday at 10:00 by this machine's calendar.
fn yesterday() -> Zoned {
    let now = Zoned::now().checked_sub(1.day()).unwrap();
    now.date().at(10, 0, 0, 0).to_zoned(now.time_zone().clone()).unwrap()
}

/// One person walks about in the study for twenty minutes, and each minute another comes in at the front.
fn happened(database: &Path, site: &Site, begun_ms: u64) {
    let store = Store::open(database, &Arc::new(site.clone()), Keep::USUAL).unwrap();
    let study = site.modules.iter().find(|module| module.name == "study").unwrap();
    for second in 0..1200_u64 {
        let x = study.x - 1.5 + 0.5 * (second as f64 * 0.2).sin();
        let track = json!({ "id": 7007, "x": x, "y": study.y - 1.0, "state": "confirmed" });
        let zone = |zone: &kehai_tracking::site::Zone| {
            let count = u32::from(["study", "home"].contains(&zone.name.as_str()));
            (
                zone.name.clone(),
                json!({ "count": count, "p": [0.0, 1.0], "seen_share": 1.0, "state": "known" }),
            )
        };
        let zones: Map<String, Value> = site.zones.iter().map(zone).collect();
        let lines: Vec<Value> = site
            .lines
            .iter()
            .map(|line| {
                let inward = if line.name == "front" { second / 60 } else { 0 };
                json!({ "name": line.name, "in": inward, "out": 0, "state": "known", "unknown_s": 0.0 })
            })
            .collect();
        let frame = json!({
            "unix_ms": begun_ms + 1000 * second, "t": second, "tracks": [track], "zones": zones, "lines": lines, "modules": [],
        });
        store.see_waiting(Arc::new(serde_json::from_value(frame).unwrap()));
    }
}

fn pictures() -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR"))
}

/// In light and in dark.
fn is_accessible(page: &mut Page, view: &str) {
    for scheme in ["light", "dark"] {
        page.scheme(scheme);
        page.is_accessible(&format!("{view}, {scheme}"));
    }
    page.scheme("light");
}

#[test]
fn reasons_report_heat_and_handover_in_a_browser() {
    let Some(mut page) = chromium::start() else { return };
    let scene = Scene::load("building").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("building.toml");
    std::fs::write(&file, toml::to_string(&scene.site).unwrap()).unwrap();
    let begun = yesterday();
    happened(&file.with_extension("db"), &scene.site, begun.timestamp().as_millisecond().unsigned_abs());
    let building = Building::start(&scene, scene.seed).unwrap();
    let tracker = Tracker::start(&file, &building);
    page.size(1440, 900, 1);
    page.scheme("light");
    page.open(&tracker.map);
    page.wait("the map is live", "document.querySelector('#link').dataset.state === 'live'");
    page.wait("people are counted", "Number(document.querySelector('#total').textContent) >= 2");
    reasons_on_the_map(&mut page);
    reasons_in_a_terminal(&tracker);
    heat_on_the_map(&mut page);
    report(&mut page, &tracker, &begun);
    handover(&mut page, &tracker, &file);
    assert_eq!(page.errors, Vec::<String>::new());
}

fn reasons_on_the_map(page: &mut Page) {
    let said = "document.querySelector('#why').innerText";
    page.click("#zones [data-key='living room'] .figure");
    page.wait("the reasons of the zone are there", &format!("/% seen/.test({said})"));
    page.wait("under its name", "document.querySelector('#why h2').innerText === 'Why: living room'");
    page.wait(
        "each part that is not seen is hatched on the map",
        "document.querySelectorAll('#why .part').length > 0 && document.querySelectorAll('.unseen-patch').length > 0",
    );
    page.wait("with the reason", &format!("/(behind|farther|beside|judge)/.test({said})"));
    page.picture(&pictures().join("why.png"));
    is_accessible(page, "reasons");
    page.fits_a_phone("reasons");
    page.key("Escape", 27);
    page.wait("they are closed", "document.querySelector('#why').hidden");
    page.wait("nothing is hatched", "document.querySelectorAll('.unseen-patch').length === 0");
    // A number on the map, and the sum of all.
    page.click("#map text.zone-name[data-zone=kitchen]");
    page.wait(
        "the number on the map has reasons",
        "document.querySelector('#why h2').innerText === 'Why: kitchen'",
    );
    page.click("#total-why");
    page.wait(
        "so has the sum, zone by zone",
        "document.querySelectorAll('#why button.link-like').length === 4",
    );
    page.click("#why button.link-like");
    page.wait(
        "each leads to its own",
        "/^Why: (living room|hall|kitchen|study)$/.test(document.querySelector('#why h2').innerText)",
    );
    // A person who stands on the label is in front of it.
    for _ in 0..20 {
        page.click("#map .line-group[data-line=front] text");
        std::thread::sleep(Duration::from_secs(1));
        if page.value("document.querySelector('#why h2').innerText") == "Why: line front" {
            break;
        }
        page.key("Escape", 27);
    }
    page.wait(
        "a line has reasons",
        &format!("document.querySelector('#why h2').innerText === 'Why: line front' && /seen/.test({said})"),
    );
    page.value("document.querySelector('#map .person.confirmed').focus()");
    page.key("Enter", 13);
    page.wait("a person has reasons", &format!("/first seen/.test({said}) && /sees it/.test({said})"));
    page.key("Escape", 27);
    page.wait("they are closed again", "document.querySelector('#why').hidden");
}

fn reasons_in_a_terminal(tracker: &Tracker) {
    let (fine, said) = tracker.explain(&["zone", "living room"]);
    assert!(fine && said.contains("% seen") && said.contains("known"), "{said}");
    let (fine, said) = tracker.explain(&["alarm", "silent"]);
    assert!(
        fine && said.contains("no alarm silent stands") && said.contains("kitchen: does not ring: heard"),
        "{said}"
    );
    let (fine, said) = tracker.explain(&["zone", "cellar"]);
    assert!(!fine && said.contains("there is no zone \"cellar\""), "{said}");
    let (fine, said) = tracker.explain(&["line", "front", "--json"]);
    let line: Value = serde_json::from_str(&said).unwrap();
    assert!(fine && line["zone"]["is_line"] == true, "{said}");
    let (_, state) = tracker.get("/api/state");
    let person = state["tracks"].as_array().unwrap().iter().find(|track| track["state"] == "confirmed");
    if let Some(id) = person.map(|person| person["id"].to_string()) {
        let (fine, said) = tracker.explain(&["person", &id]);
        assert!(!fine || said.contains(&format!("{id} ")), "{said}");
    }
    for (asked, status) in
        [("zone=a&line=b", 400), ("person=me", 400), ("alarm=rain", 400), ("person=999999", 404)]
    {
        assert_eq!(tracker.get(&format!("/api/explain?{asked}")).0, status, "{asked}");
    }
}

fn heat_on_the_map(page: &mut Page) {
    page.value("document.querySelector('#heat-toggle').scrollIntoView()");
    page.click("#heat-toggle");
    page.wait("where people were is drawn", "document.querySelectorAll('.heat .heat-cell').length === 6");
    page.wait("in words, too", "/Warmest/.test(document.querySelector('#heat-words').innerText)");
    page.wait(
        "a person was somewhere",
        "document.querySelector('.heat .heat-5').getAttribute('d').length > 0",
    );
    page.picture(&pictures().join("heat.png"));
    page.fits_a_phone("heat");
    page.value("document.querySelector('#heat-toggle').scrollIntoView()");
    page.click("#heat-toggle");
    page.wait("it is gone", "document.querySelectorAll('.heat path').length === 0");
}

fn report(page: &mut Page, tracker: &Tracker, begun: &Zoned) {
    let day = begun.strftime("%Y-%m-%d").to_string();
    page.open(&format!("{}report?period=day&date={day}", tracker.map));
    let front = "document.querySelector('[data-of=\"line:front\"]')";
    page.wait("the line is there", &format!("{front} !== null"));
    // One hour in which something was known: the others have no bar, not one of no height.
    page.wait("one hour has a bar", &format!("{front}.querySelectorAll('.chart-bar.in').length === 1"));
    page.wait(
        "all of them are hatched, that one in part",
        &format!("{front}.querySelectorAll('.chart-unknown').length >= 23"),
    );
    let widths = page.value(&format!(
        "[...{front}.querySelectorAll('.chart-unknown')].map((one) => Number(one.getAttribute('width'))).sort((a, b) => a - b)"
    ));
    let widths: Vec<f64> = widths.as_array().unwrap().iter().map(|width| width.as_f64().unwrap()).collect();
    assert!(
        (widths[0] / widths[1] - 2.0 / 3.0).abs() < 0.02,
        "twenty of sixty minutes are known: {widths:?}"
    );
    let cells = page.value("[...document.querySelectorAll('table')][0].innerText");
    // Of a day with unknown hours it is not known that no person went out.
    assert!(cells.as_str().unwrap().contains(&format!("front\t{CROSSED}\t–\t23.7 h")), "{cells}");
    let study = page.value(
        "[...document.querySelectorAll('tr')].find((row) => row.innerText.startsWith('study')).innerText",
    );
    assert!(study.as_str().unwrap().starts_with("study\t1\t"), "{study}");
    page.wait("where people were", "document.querySelector('#heat .heat-5').getAttribute('d').length > 0");
    page.wait(
        "and where no module looked",
        "document.querySelector('#heat .heat-unknown').getAttribute('d').length > 100",
    );
    page.picture(&pictures().join("report.png"));
    page.scheme("dark");
    page.picture(&pictures().join("report-dark.png"));
    page.scheme("light");
    is_accessible(page, "report");
    page.fits_a_phone("report");
    // One zone alone, by the keyboard.
    page.value("(() => { const of = document.querySelector('#of'); of.value = 'zone:study'; of.dispatchEvent(new Event('change')); })()");
    page.wait(
        "one zone is shown alone",
        "[...document.querySelectorAll('section[data-of]')].filter((one) => !one.hidden).length === 1",
    );
    // On paper: white, without controls.
    page.call("Emulation.setEmulatedMedia", json!({ "media": "print" }));
    page.wait(
        "no controls on paper",
        "getComputedStyle(document.querySelector('.controls')).display === 'none'",
    );
    page.wait(
        "on white",
        "getComputedStyle(document.querySelector('section')).backgroundColor === 'rgb(255, 255, 255)'",
    );
    let pages = page.call("Page.printToPDF", json!({ "preferCSSPageSize": true }));
    assert!(pages["data"].as_str().unwrap().len() > 10_000);
    page.call("Emulation.setEmulatedMedia", json!({ "media": "" }));
    page.scheme("light");
    page.value("(() => { const period = document.querySelector('#period'); period.value = 'month'; period.dispatchEvent(new Event('change')); })()");
    page.wait("a month has days", "/–/.test(document.querySelector('#range').innerText)");
    page.value("(() => { const date = document.querySelector('#date'); date.value = '2090-01-01'; date.dispatchEvent(new Event('change')); })()");
    page.wait(
        "what has not come is not unknown",
        "document.querySelector('#report').innerText.includes('not come yet')",
    );
}

fn handover(page: &mut Page, tracker: &Tracker, file: &Path) {
    let (status, found) = tracker.get("/api/coverage");
    assert_eq!(status, 200);
    assert!(found["all"]["one"].as_f64().unwrap() > 0.5, "{}", found["all"]);
    page.open(&format!("{}handover", tracker.map));
    page.wait("the coverage is there", "document.querySelectorAll('#coverage tbody tr').length === 5");
    page.wait("as a picture", "document.querySelector('#coverage .cover-1').getAttribute('d').length > 100");
    page.wait("the modules are listed", "document.querySelectorAll('#health tbody tr').length === 6");
    page.wait("what would help is said", "/facing|No place/.test(document.querySelector('#next').innerText)");
    let expected = "document.querySelector('#expected')";
    page.wait(
        "what is to be expected is there by itself, for each number of people",
        &format!("{expected}.querySelectorAll('tbody tr').length === 4"),
    );
    page.wait(
        "with how sure that is, and where it is from",
        &format!(
            "/\\d%\\s+\\d+% to \\d+%/.test({expected}.innerText) && /Expected, not measured: .*10 simulated rooms/.test({expected}.innerText)"
        ),
    );
    page.wait(
        "and how to simulate",
        "document.querySelector('#expected').innerText.includes('kehai-sim plan building.toml')",
    );
    page.wait(
        "the form knows what the tracker knows",
        "/\\d of 6 work/.test(document.querySelector('#acceptance').innerText)
            && /% at most: \\w/.test(document.querySelector('#acceptance').innerText)
            && /% at least: \\w/.test(document.querySelector('#acceptance').innerText)",
    );
    page.wait("and has lines for the rest", "document.querySelectorAll('#acceptance .sign').length === 5");
    page.wait(
        "on one sheet of A4, 180 mm by 257 mm",
        "(() => { const form = document.querySelector('#acceptance'); form.style.width = '680px';
            const fits = form.offsetHeight < 971; form.style.width = ''; return fits; })()",
    );
    page.wait("where modules were put", "document.querySelectorAll('#changes tbody tr').length >= 6");
    let site: Value = tracker.get("/api/site").1["site"].clone();
    let plan = json!({ "people": 4, "layouts": [{ "modules": site["module"], "exact": 0.983, "exact_95": [0.975, 0.99], "runs": 40 }] });
    std::fs::write(file.with_extension("expected.json"), plan.to_string()).unwrap();
    page.open(&format!("{}handover", tracker.map));
    page.wait(
        "what was simulated is told",
        "document.querySelector('#expected').innerText.includes('98.3% of the time (97.5–99.0)')",
    );
    page.wait("of the layout of now", "!document.querySelector('#expected').innerText.includes('elsewhere')");
    page.picture(&pictures().join("handover.png"));
    page.scheme("dark");
    page.picture(&pictures().join("handover-dark.png"));
    page.scheme("light");
    is_accessible(page, "handover");
    page.fits_a_phone("handover");
}
