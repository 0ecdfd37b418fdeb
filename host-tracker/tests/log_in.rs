//! Log-in in a browser: the page, a wrong password, what is hidden from whom, and the log-out.

mod chromium;
mod described;
mod house;
mod http_client;

use std::sync::Arc;

use host_tracker::access::roles::Role;
use host_tracker::web::Limits;
use house::{DOORS, House, PASSWORD, S, ZONE};
use kehai_tracking::snapshot::{Snapshot, unix_ms};

/// Types into a field, as a visitor does.
fn type_into(page: &mut chromium::Page, field: &str, text: &str) {
    page.click(field);
    page.value(&format!("document.querySelector({field:?}).value = ''"));
    page.write(text);
}

/// Waits until the log-in page is there and its script has run. If the server ends while the page still loads, that is one of the
/// page's errors.
fn at_log_in(page: &mut chromium::Page, what: &str) {
    page.wait(what, "location.pathname === '/login.html' && !document.querySelector('#send').disabled");
}

fn log_in(page: &mut chromium::Page, name: &str, password: &str) {
    at_log_in(page, "the log-in page comes");
    type_into(page, "#name", name);
    type_into(page, "#password", password);
    page.click("#send");
}

#[test]
fn a_visitor_logs_in_sees_what_it_may_and_logs_out() {
    let Some(mut page) = chromium::start() else { return };
    for (site, roles) in [
        (ZONE.to_owned(), [(Role::View, false), (Role::Edit, true)]),
        (format!("{ZONE}{DOORS}"), [(Role::Edit, false), (Role::Admin, true)]),
    ] {
        let house = House::of(&site);
        let map = format!("http://{}/", house.server.address());
        for (role, edits) in roles {
            let name = format!("the {role}");
            house.add(&name, role);
            page.size(1440, 900, 1);
            page.open(&map);
            log_in(&mut page, &name, "wrong");
            page.wait(
                "a wrong password is said",
                "document.querySelector('#why').innerText.includes('do not belong')",
            );
            page.fits_a_phone("log-in");
            log_in(&mut page, &name, PASSWORD);
            page.wait(
                "the map comes",
                "location.pathname === '/' && !document.querySelector('#log-out').hidden",
            );
            house.frames.send_replace(Arc::new(Snapshot { unix_ms: unix_ms(), ..Snapshot::default() }));
            page.wait("it is live", "document.querySelector('#link').dataset.state === 'live'");
            page.wait("the site is there", "document.querySelector('#site-name').textContent === 'house'");
            let shown = "document.querySelector('#edit-open').checkVisibility()";
            page.wait(&format!("{name} is shown the editor: {edits}"), &format!("{shown} === {edits}"));
            assert_eq!(page.value("document.cookie"), serde_json::json!(""), "no script reads the session");
            page.click("#log-out");
            at_log_in(&mut page, "the log-in page comes again");
        }
        log_in(&mut page, "anna", PASSWORD);
        page.wait("the map comes", "location.pathname === '/' && !document.querySelector('#log-out').hidden");
        house.pass(12 * 3600 * S);
        house.frames.send_replace(Arc::new(Snapshot { unix_ms: unix_ms(), ..Snapshot::default() }));
        at_log_in(&mut page, "a session that is over ends at the log-in page");
    }
    assert_eq!(page.errors, Vec::<String>::new());
}

/// Over TLS, by the tracker's own certificate, which a visitor has taken.
#[test]
fn a_visitor_guesses_ten_times_over_tls_and_then_waits() {
    let Some(mut page) = chromium::start() else { return };
    let house = House::bound(ZONE, Limits::default(), true);
    page.call("Security.setIgnoreCertificateErrors", serde_json::json!({"ignore": true}));
    page.open(&format!("https://localhost:{}/", house.server.address().port()));
    log_in(&mut page, "anna", PASSWORD);
    page.wait("the map comes", "location.pathname === '/' && !document.querySelector('#log-out').hidden");
    house.frames.send_replace(Arc::new(Snapshot { unix_ms: unix_ms(), ..Snapshot::default() }));
    page.wait("it is live, over TLS too", "document.querySelector('#link').dataset.state === 'live'");
    assert_eq!(page.value("location.protocol"), serde_json::json!("https:"));
    page.click("#log-out");
    for _ in 0..10 {
        log_in(&mut page, "anna", "wrong");
        page.wait(
            "a wrong password is said",
            "document.querySelector('#why').innerText.includes('do not belong')",
        );
        page.value("document.querySelector('#why').innerText = ''");
    }
    log_in(&mut page, "anna", PASSWORD);
    page.wait(
        "it says how long to wait",
        "/too many|wait|again/i.test(document.querySelector('#why').innerText)",
    );
    assert_eq!(page.value("location.pathname"), serde_json::json!("/login.html"), "not even the right one");
    house.pass(40 * S);
    log_in(&mut page, "anna", PASSWORD);
    page.wait("the map comes", "location.pathname === '/' && !document.querySelector('#log-out').hidden");
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn the_screen_of_a_door_has_its_token_by_its_link() {
    let Some(mut page) = chromium::start() else { return };
    let house = House::of(&format!("{ZONE}{DOORS}"));
    let screen = format!("http://{}/door/front", house.server.address());
    page.open(&screen);
    page.wait("it says what is missing", "document.querySelector('#why').innerText.includes('log in')");
    let token = house.token("screen", &[Role::Keypad], Some("front"));
    page.open("about:blank");
    page.open(&format!("{screen}#token={}", token.trim_start_matches("Bearer ")));
    page.wait("it is connected", "document.querySelector('#link').dataset.state === 'live'");
    assert_eq!(page.value("location.hash"), serde_json::json!(""), "the token is not left for all to see");
    page.open("about:blank");
    page.open(&screen);
    page.wait("it remembers", "document.querySelector('#link').dataset.state === 'live'");
    assert_eq!(page.errors, Vec::<String>::new());
}
