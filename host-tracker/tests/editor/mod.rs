//! What a visitor does in the map's editor: opens it, draws by mouse or keyboard, writes into fields, saves.
#![allow(dead_code, reason = "each test uses its own part of it")]

use std::path::Path;

use serde_json::json;

use crate::chromium::Page;

/// Opens the editor of the map that is shown.
pub fn open_editor(page: &mut Page) {
    page.click("#edit-open");
    page.wait("the tools are there", "!document.querySelector('#tools').hidden");
}

/// Chooses a part, by its kind and number.
pub fn choose(page: &mut Page, kind: &str, index: usize) {
    page.value(&format!(
        "document.querySelector('.shape[data-kind={kind}][data-index=\"{index}\"]').focus()"
    ));
    page.wait("its form is open", "document.querySelector('#remove') !== null");
}

/// Types something into a field in the place of what is there, and stays in it.
pub fn type_into(page: &mut Page, field: &str, text: &str) {
    page.value(&format!(
        "(() => {{ const field = document.querySelector('{field}'); field.focus(); field.select(); }})()"
    ));
    page.write(text);
}

/// Types something into a field in the place of what is there, and leaves it.
pub fn fill(page: &mut Page, field: &str, text: &str) {
    type_into(page, field, text);
    page.key("Tab", 9);
}

/// Saves what was drawn.
pub fn save(page: &mut Page) {
    page.click("#save");
    page.wait("it is saved", "!document.body.classList.contains('editing')");
}

/// Drags over the map; both places are counted from its middle, in pixels.
pub fn drag(page: &mut Page, by: [f64; 4]) {
    let [x, y] = page.middle("#map");
    page.drag([x + by[0], y + by[1]], [x + by[2], y + by[3]]);
}

/// Keeps a picture of the page.
pub fn picture(page: &mut Page, name: &str) {
    page.picture(&Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.png")));
}

/// Presses a key, with Shift or not, as a keyboard does.
pub fn press(page: &mut Page, key: &str, shift: bool) {
    let (code, text) = match key {
        "Enter" => (13, "\r"),
        "Escape" => (27, ""),
        "Backspace" => (8, ""),
        "Tab" => (9, ""),
        "ArrowLeft" => (37, ""),
        "ArrowUp" => (38, ""),
        "ArrowRight" => (39, ""),
        "ArrowDown" => (40, ""),
        other => panic!("{other}"),
    };
    let modifiers = if shift { 8 } else { 0 };
    for kind in ["keyDown", "keyUp"] {
        let text = if kind == "keyDown" { text } else { "" };
        let event = json!({ "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code, "text": text, "modifiers": modifiers });
        page.call("Input.dispatchKeyEvent", event);
    }
}

/// Goes on by Tab until something has the focus.
pub fn tab_to(page: &mut Page, id: &str) {
    for _ in 0..150 {
        if page.value("document.activeElement.id") == json!(id) {
            return;
        }
        press(page, "Tab", false);
    }
    panic!("{id} is not reached by Tab");
}

/// Takes a tool and draws: steps of a metre, and corners where there is no step.
pub fn draw(page: &mut Page, kind: &str, keys: &[&str]) {
    tab_to(page, &format!("tool-{kind}"));
    press(page, "Enter", false);
    page.wait("the map has the keys", "document.activeElement.id === 'map'");
    page.wait("the cursor is there", "document.querySelector('#map .cursor') !== null");
    for key in keys {
        press(page, key, *key != "Enter");
    }
    page.wait("it is drawn", &format!("document.querySelector('[aria-label=\"{}\"]') !== null", label(kind)));
}

fn label(kind: &str) -> String {
    let name = if kind == "wall" { "1".to_owned() } else { format!("{kind} 1") };
    format!("{}{} {name}", kind[..1].to_uppercase(), &kind[1..])
}
