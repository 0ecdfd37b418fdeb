//! The pages in other languages, in a real browser: the map and the screen beside a door in German and Japanese.
//!
//! ```text
//!   frames made by the test ─▶ doors, server ─HTTP▶ Chromium that wishes "de-DE" ◀─DevTools─ this test
//! ```
//!
//! The browser's only fonts have no Japanese characters: texts and rectangles are read, no picture is looked at.

mod chromium;
mod described;
mod door_fixture;
mod http_client;

use chromium::Page;
use door_fixture::DoorServer;
use serde_json::{Value, json};

/// What is read of a page with one person in its zone: the language, the browser's wish, and some of its words.
const READ: [(&str, &str, [&str; 4]); 3] = [
    ("en", "en-US", ["person here", "all of it seen", "nothing is wrong", "Edit site"]),
    ("de", "de-DE", ["Person hier", "ganz eingesehen", "alles in Ordnung", "Anlage bearbeiten"]),
    ("ja", "ja-JP", ["人います", "全体が見えています", "異常はありません", "サイトを編集"]),
];

/// English of the dictionary that stands on the page: a sentence of it within any text, or a single word as the whole of one. Names of
/// the test's site, and what is marked as English, may be.
const ENGLISH: &str = r#"(async () => {
  const [{ default: en }, { default: own }] = await Promise.all([import("/words-en.js"), import("/words-LANGUAGE.js")]);
  const texts = (entry) => typeof entry === "string" ? [entry] : Object.values(entry);
  // Some words are words of both.
  const also = new Set(Object.values(own).flatMap(texts));
  const other = Object.values(en).flatMap(texts).map((text) => text.trim())
    .filter((text) => !/[{}]/.test(text) && text.length > 3 && !also.has(text));
  const found = [], names = ["area", "front", "kehai"];
  const look = (text, where) => {
    const said = text.trim();
    if (names.includes(said)) return;
    for (const one of other) {
      if (said === one || (one.includes(" ") && said.includes(one))) found.push(`${where}: ${one}`);
    }
  };
  const walk = document.createTreeWalker(document.documentElement, NodeFilter.SHOW_TEXT | NodeFilter.SHOW_ELEMENT);
  for (let node = walk.currentNode; node; node = walk.nextNode()) {
    const element = node.nodeType === Node.TEXT_NODE ? node.parentElement : node;
    if (element.closest("[lang=en]:not(html), script, style")) continue;
    if (node.nodeType === Node.TEXT_NODE) look(node.textContent, element.tagName);
    else for (const name of ["title", "aria-label", "placeholder", "aria-valuetext"]) look(node.getAttribute(name) ?? "", name);
  }
  return found;
})()"#;

/// Where each key of the screen is.
const KEYS: &str = "JSON.stringify([...document.querySelectorAll('.keys button')].map((key) => \
     { const { x, y, width, height } = key.getBoundingClientRect(); return [x, y, width, height].map(Math.round); }))";

/// Gives the screen of a door answers of the test's own: of each phase what it may say, and none. Waits until it is shown.
const ANSWERED: &str = r#"(async () => {
  const find = (id) => document.getElementById(id);
  window.real ??= await (await fetch("/api/door/front")).json();
  const own = CHANGES;
  let asked = 0;
  window.fetch = () => {
    asked += 1;
    if (own === null) return Promise.reject(new TypeError("gone"));
    return Promise.resolve(new Response(JSON.stringify({ ...real, ...own })));
  };
  const until = own === null ? "lost" : own.phase;
  const is = () => document.body.dataset.phase === until && (own === null || find("people").children.length >= 7);
  // When it asks again, the answer before is shown.
  while (asked < 3 || !is()) await new Promise((done) => setTimeout(done, 20));
  return find("prompt").textContent;
})()"#;

fn opens(page: &mut Page, server: &DoorServer, path: &str, wish: &str) {
    page.open("about:blank");
    page.wait("the page is gone", "document.body && !document.body.children.length");
    page.language(wish);
    page.open(&format!("http://{}{path}", server.server.address()));
}

#[track_caller]
fn has_no_english(page: &mut Page, language: &str, view: &str) {
    if language == "en" {
        return;
    }
    let left = page.value(&ENGLISH.replace("LANGUAGE", language));
    assert_eq!(left, json!([]), "{view} in {language}");
}

#[test]
fn the_map_speaks_the_browser_s_language() {
    let Some(mut page) = chromium::start() else { return };
    let server = DoorServer::new();
    server.waits_for("idle");
    server.people(&[[0.0, 0.4]]);
    page.size(1280, 800, 1);
    for (language, wish, words) in READ {
        opens(&mut page, &server, "/", wish);
        page.wait("the map is live", "document.querySelector('#link').dataset.state === 'live'");
        page.wait("one person is counted", "document.querySelector('#total').textContent === '1'");
        assert_eq!(page.value("document.documentElement.lang"), json!(language));
        for word in words {
            page.wait(word, &format!("document.body.innerText.includes({word:?})"));
        }
        has_no_english(&mut page, language, "map");
        page.fits_a_phone(&format!("map {language}"));
        page.click("#total-why");
        page.wait("why is told", "document.querySelectorAll('#why li').length === 2");
        has_no_english(&mut page, language, "reasons");
        page.value("document.querySelector('#doors button').click()");
        page.wait("the door is told", "document.querySelectorAll('#door-card dt').length >= 4");
        has_no_english(&mut page, language, "door's card");
        page.fits_a_phone(&format!("door's card {language}"));
        page.value("document.querySelector('#edit-open').click()");
        page.wait("the editor is open", "document.querySelector('#edit-form') !== null");
        page.value("document.querySelector('#tool-zone').click()");
        has_no_english(&mut page, language, "editor");
        page.fits_a_phone(&format!("editor {language}"));
        opens(&mut page, &server, "/report", wish);
        page.wait("the report is there", "document.querySelector('#range') !== null");
        has_no_english(&mut page, language, "report");
        page.fits_a_phone(&format!("report {language}"));
        opens(&mut page, &server, "/firmware", wish);
        page.wait("where firmware would be is said", "document.querySelector('#none') !== null");
        has_no_english(&mut page, language, "firmware");
    }
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn a_language_that_is_chosen_is_kept_and_a_link_says_one() {
    let Some(mut page) = chromium::start() else { return };
    let server = DoorServer::new();
    opens(&mut page, &server, "/", "en-US");
    let is = |language: &str| {
        format!("document.documentElement.lang === '{language}' && document.querySelector('#language')")
    };
    page.wait("as the browser wishes", &is("en"));
    page.value(
        "void (() => { const choice = document.querySelector('#language'); choice.value = 'de'; \
         choice.dispatchEvent(new Event('change')); })()",
    );
    page.wait("as is chosen", &is("de"));
    opens(&mut page, &server, "/report", "en-US");
    page.wait("on other pages, too", &is("de"));
    opens(&mut page, &server, "/door/front?lang=ja", "en-US");
    page.wait("as a link says", &is("ja"));
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn no_key_of_the_door_s_screen_moves_whatever_it_says() {
    let Some(mut page) = chromium::start() else { return };
    let server = DoorServer::new();
    server.waits_for("idle");
    let said = |phase: &str, prompt: &str, entered: u32| json!({ "phase": phase, "prompt_name": prompt, "entered": entered, "through": 0, "tries_left": 9 });
    let phases: Vec<Value> = [
        ("failed", "starting", 0),
        ("idle", "ready", 0),
        ("asked", "how-many", 0),
        ("checking", "counting", 7),
        ("asked", "not-seen", 7),
        ("asked", "count-again", 7),
        ("asked", "stand-apart", 7),
        ("idle", "begin-again", 0),
        ("unlocked", "go-in", 7),
        ("closing", "closing", 7),
        ("held-open", "let-shut", 0),
        ("alarmed", "called", 0),
        ("failed", "out-of-order", 0),
    ]
    .map(|(phase, prompt, entered)| said(phase, prompt, entered))
    .into_iter()
    .chain([Value::Null])
    .collect();
    for (width, height) in [(1280, 800), (390, 844), (360, 780)] {
        page.size(width, height, 1);
        let mut first = Value::Null;
        for (language, wish, _) in READ {
            opens(&mut page, &server, "/door/front", wish);
            page.wait(
                "the door is there",
                "document.querySelectorAll('.keys button:not(.unknown)').length === 9",
            );
            let mut sentences = std::collections::BTreeSet::new();
            for phase in &phases {
                let sentence = page.value(&ANSWERED.replace("CHANGES", &phase.to_string()));
                page.settle();
                let keys = page.value(KEYS);
                if first.is_null() {
                    first = keys.clone();
                }
                assert_eq!(keys, first, "{language}, {width} px: keys have moved at {phase}: {sentence}");
                sentences.insert(sentence.as_str().unwrap().to_owned());
            }
            assert_eq!(sentences.len(), phases.len(), "{language}: {sentences:?}");
            assert_eq!(
                page.value("document.documentElement.scrollHeight <= innerHeight"),
                json!(true),
                "{language}, {width} px"
            );
            has_no_english(&mut page, language, "door's screen");
        }
    }
    assert_eq!(page.errors, Vec::<String>::new());
}
